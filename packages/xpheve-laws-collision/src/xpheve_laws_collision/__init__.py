"""Laws of touching bodies: exact impact times, restitution, support."""

from xpheve_laws_collision.containers.exact import ExactContacts
from xpheve_laws_collision.laws.elastic import Elastic
from xpheve_laws_collision.server import ExactServer

__version__ = "0.1.0"

__all__ = ["Elastic", "ExactContacts", "ExactServer"]
