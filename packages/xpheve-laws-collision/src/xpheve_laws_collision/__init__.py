"""Laws of touching bodies: exact impact times, restitution, support; and the cheaper containers and answers of the thesis."""

from xpheve_laws_collision.containers.bounding_box import BoundingBoxes
from xpheve_laws_collision.containers.exact import ExactContacts
from xpheve_laws_collision.containers.picking import Picking
from xpheve_laws_collision.impact.stepper import ImpactStepper
from xpheve_laws_collision.laws.elastic import Elastic
from xpheve_laws_collision.laws.frictional import Frictional
from xpheve_laws_collision.laws.point import Point
from xpheve_laws_collision.laws.reverse import Reverse
from xpheve_laws_collision.laws.rough import Rough
from xpheve_laws_collision.laws.stick import Stick
from xpheve_laws_collision.laws.stop import Stop
from xpheve_laws_collision.server import ExactServer

__version__ = "0.1.0"

__all__ = [
    "BoundingBoxes",
    "Elastic",
    "ExactContacts",
    "ExactServer",
    "Frictional",
    "ImpactStepper",
    "Picking",
    "Point",
    "Reverse",
    "Rough",
    "Stick",
    "Stop",
]
