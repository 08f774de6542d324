"""The contact server: finds impacts through core's queue, answers them in generations, and keeps what rests at rest.

Its rooms, each building on those before: `pairs` (who stands how to whom), `telling` (listeners), `standing` (what rests), `prediction` (what
is next), `saving`, `answering` (contacts that polled containers found). Beside them `generations` (pairs solved together) and `instant` (the
impacts of one instant).
"""

from __future__ import annotations

from typing import Any, ClassVar

from xpheve_laws_collision.server.answering import Answering


class ExactServer(Answering):
    """Contacts of spheres, points and planes at their exact instants.

    A pair is open (its closing is predicted), *touching* (in ``touching``), *inside* (overlapping with nobody to answer), collapsing
    towards rest (in ``collapsing``), or a support (in ``supports``), whose normal coordinate is set and not tested.
    """

    id: ClassVar[str] = "collision:exact_server"

    @classmethod
    def queries(cls, engine: Any) -> Any:
        from xpheve_laws_collision.queries import SceneQueries

        return SceneQueries(engine)


__all__ = ["ExactServer"]
