"""The impacts of one instant that the server predicted: answered in generations, then told, and seen to come apart or to rest."""

from __future__ import annotations

import math

from xpheve.errors import ContactError
from xpheve.events import AFTER
from xpheve.kernels.clock import NEVER, elapsed, later
from xpheve.laws import ResponseLaw
from xpheve.laws import conditions as when
from xpheve.objects import PhysicalObject
from xpheve_laws_collision.mass import immovable
from xpheve_laws_collision.narrow_phase import ULPS, Gap, flipped
from xpheve_laws_collision.server.generations import Generations
from xpheve_laws_collision.server.pairs import ROUND, SHORTEST_FLIGHT, Pair

STREAK = 1000  # dissipative impacts in a row, each less than CLOSE after the last: collapse
CLOSE = 1e-7  # [s]
TURNING_STREAK, TURNING_CLOSE = 200, 1e-6  # the same where bodies turn, each of whose impacts takes milliseconds


class ImpactInstant(Generations):
    """Pairs of the server's tables, by their own geometry."""

    def law(self, pair: Pair) -> ResponseLaw:
        found: ResponseLaw = self.world.response_law(*pair)[0]
        return found

    def find_points(self, pair: Pair) -> list[Gap]:
        if self.turns(pair) or self.server._has_mesh(pair):
            return self.server._points(pair, self.world.time)  # each face of an edge or corner pushes for itself
        return [self.server._gap(pair, self.world.time)]

    def around(self, moved: set[PhysicalObject], pairs: list[Pair]) -> list[Pair]:
        """The touching pairs of bodies whose velocity changed."""
        found = dict.fromkeys(pairs)
        found.update({pair: None for pair in self.first})
        for pair in self.server.touching:
            if (pair[0] in moved or pair[1] in moved) and self.server._answered(pair):
                found[pair] = None
        return list(found)

    def answered(self, pair: Pair) -> None:
        """Count dissipative impacts that follow each other closely; too many are a collapse that nothing here can end."""
        now = self.world.time
        law = self.law(pair)
        for obj in pair:
            if immovable(obj):
                continue
            partner = pair[1] if obj is pair[0] else pair[0]
            count, last, other = self.server.streaks.get(obj, (0, NEVER, partner.serial))
            turns = self.turns(pair)
            if last == NEVER or elapsed(now, last) >= (TURNING_CLOSE if turns else CLOSE):
                count = 0
            alone = other == partner.serial and not turns and self._ends_in_closed_form(pair)
            count = count if alone else count + 1
            self.server.streaks[obj] = (count, now, partner.serial)
            if count > (TURNING_STREAK if turns else STREAK):
                if law.parameters.get("resting") != "hold":
                    raise ContactError(
                        f"{obj!r} bounces ever faster at t = {now[0]} s (last between {pair[0].label} and {pair[1].label}): "
                        'a collapse that is known in closed form only for a sphere on a plane. Set resting="hold" on the collision law'
                    )
                self.world.transaction.later.append(lambda obj=obj: self.server._hold(obj))

    def finish(self) -> None:
        """Write velocities, tell listeners, and see what has come apart or is about to rest."""
        world, server = self.world, self.server
        self.write()
        for pair, (gap, _) in self.first.items():
            self._put_on_plane(pair, gap)
        ended: list[tuple[Pair, Gap, float]] = []
        begun = [(pair, gap, speed) for pair, (gap, speed) in self.first.items() if pair not in server.touching]
        for pair, (gap, _) in self.first.items():
            server.touching.setdefault(pair, world.time)
            speed = self.parts(pair)
            if speed > 0.0:
                del server.touching[pair]
                ended.append((pair, gap, -speed))
                self._maybe_collapse(pair, gap, speed)
        laws = {self.law(pair) for pair in self.first}
        for container in {c: None for law in laws for c in law.containers}:
            container.firings += 1
        server.given = self.given()
        try:
            server._tell(when.Impact, [(pair, gap, speed) for pair, (gap, speed) in self.first.items()])
            server._tell(when.ContactBegin, begun)
        finally:
            server.given = {}
        if ended and world.listeners(when.ContactEnd):
            server.parting += ended
            world.schedule(world.time, AFTER, (1,), server._part)

    def _put_on_plane(self, pair: Pair, gap: Gap) -> None:
        """Take the rounding of a long flight out of the normal coordinate, where it could pass for a gap later on."""
        family, swapped = self.server._family(*pair)
        ball, ground = (pair[1], pair[0]) if swapped else pair
        if family.rests and ground.fixed and gap.separation != 0.0 and ball in self.world.transaction.touched:
            flown = self.world.transaction.touched[ball]
            size = sum(math.hypot(*one) for one in (flown.held["position"], flown.flown["position"]))
            if abs(gap.separation) <= ULPS * size:
                n, x = gap.normal if not swapped else flipped(gap).normal, self.world.bodies.get("position", ball._row)
                self.world.bodies.put(
                    "position", ball._row, [c + gap.separation * k for c, k in zip(x, n, strict=True)]
                )

    def _maybe_collapse(self, pair: Pair, gap: Gap, speed: float) -> None:
        """End the bounces of a sphere on a plane in closed form once they have become too short to tell apart.

        The next flight lasts 2 v / a and each one after that e times its predecessor: together 2 v / (a (1 - e)). A corner of a
        turning body does the same for so short a time.
        """
        restitution = self.restitution.get(pair, 1.0)
        if restitution >= 1.0:
            return
        if any(self.server._shape(obj).kind not in ROUND for obj in pair):
            gap = self.server._gap(
                pair, self.world.time
            )  # with the new spin, on which the corner's acceleration depends
        if gap.acceleration >= 0.0:
            return
        flight = -2.0 * speed / gap.acceleration
        if flight < SHORTEST_FLIGHT:
            end = later(self.world.time, flight / (1.0 - restitution))
            self.server.collapsing[pair] = (end, -1)

    def _ends_in_closed_form(self, pair: Pair) -> bool:
        """Whether ``pair`` is pressed together, so that ever shorter bounces lead to rest at a known instant."""
        return self.points_of(pair)[0].acceleration < 0.0


__all__ = ["SHORTEST_FLIGHT", "STREAK", "ImpactInstant"]
