"""The impacts of one instant, answered in generations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xpheve.errors import ContactError, LawFailedError
from xpheve.events import AFTER
from xpheve.kernels.clock import NEVER, elapsed, later
from xpheve.kernels.vector import Vec
from xpheve.laws import Impulse, ResponseLaw
from xpheve.laws import conditions as when
from xpheve.objects import PhysicalObject
from xpheve_laws_collision.narrow_phase import ULPS, Gap, flipped, still_speed
from xpheve_laws_collision.server.pairs import Pair, contact_of, kinetic
from xpheve_laws_collision.simultaneous import apply, solve_generation, wanted_speeds

if TYPE_CHECKING:
    from xpheve_laws_collision.server.standing import Standing

SHORTEST_FLIGHT = 1e-10  # [s] a bounce shorter than this is ended in closed form (design 8)
STREAK = 1000  # dissipative impacts in a row, each less than CLOSE after the last: collapse
CLOSE = 1e-7  # [s]
GENERATIONS = 10_000  # of one instant; a set of pairs that needs more does not come apart


class ImpactInstant:
    """The impacts of one instant: velocities of those involved, generation after generation."""

    def __init__(self, server: Standing) -> None:
        self.server = server
        self.world = server.world
        self.velocity: dict[PhysicalObject, Vec] = {}
        self.before: dict[PhysicalObject, Vec] = {}
        self.gaps: dict[Pair, Gap] = {}
        self.first: dict[Pair, tuple[Gap, float]] = {}
        self.restitution: dict[Pair, float] = {}

    def solve(self, pairs: list[Pair]) -> None:
        """Until no touching pair approaches; then write, and see what has come apart or to rest."""
        pairs = [pair for pair in pairs if self._approach(pair) > 0.0]
        rounds = 0
        while pairs:
            self.server.generations += 1
            self._generation(sorted(pairs, key=lambda pair: (pair[0].rank, pair[1].rank)))
            moved = {obj for pair in pairs for obj in pair if not obj.fixed}
            pairs = [pair for pair in self._around(moved, pairs) if self._approach(pair) > 0.0]
            rounds += 1
            if rounds > GENERATIONS:
                raise ContactError(
                    f"impacts at t = {self.world.time[0]} s do not end: "
                    + ", ".join(f"{a.label} - {b.label}" for a, b in pairs[:4])
                )
        self._write()

    def _around(self, moved: set[PhysicalObject], pairs: list[Pair]) -> list[Pair]:
        """The touching pairs of bodies whose velocity changed."""
        found = dict.fromkeys(pairs)
        found.update({pair: None for pair in self.first})
        for pair in self.server.touching:
            if (pair[0] in moved or pair[1] in moved) and self.world.response_law(*pair) is not None:
                found[pair] = None
        return list(found)

    def _gap(self, pair: Pair) -> Gap:
        if pair not in self.gaps:
            self.gaps[pair] = self.server._gap(pair, self.world.time)
        return self.gaps[pair]

    def _velocity(self, obj: PhysicalObject) -> Vec:
        if obj not in self.velocity:
            found = self.world.read_row(obj._row, "velocity")
            self.velocity[obj] = self.before[obj] = found
        return self.velocity[obj]

    def _separation_speed(self, pair: Pair) -> float:
        n = self._gap(pair).normal
        u, v = self._velocity(pair[0]), self._velocity(pair[1])
        return math.fsum(c * (q - p) for c, p, q in zip(n, u, v, strict=True))

    def _approach(self, pair: Pair) -> float:
        """Approach speed [m/s]; 0 if it is none."""
        speed = -self._separation_speed(pair)
        return speed if speed > self._still(pair) else 0.0

    def _still(self, pair: Pair) -> float:
        speeds = math.hypot(*self._velocity(pair[0])) + math.hypot(*self._velocity(pair[1]))
        return still_speed(speeds, self._gap(pair).acceleration)

    def _generation(self, pairs: list[Pair]) -> None:
        """Solve the pairs that touch and approach now, together."""
        bodies = list({obj: None for pair in pairs for obj in pair})
        place = {obj: k for k, obj in enumerate(bodies)}
        indices = [(place[a], place[b]) for a, b in pairs]
        velocities = [self._velocity(obj) for obj in bodies]
        inverse = [0.0 if obj.fixed else 1.0 / obj.mass for obj in bodies]
        normals = [self._gap(pair).normal for pair in pairs]
        answered: list[int] = []
        taken: list[tuple[int, Impulse]] = []
        restitutions: list[float] = []
        for k, pair in enumerate(pairs):
            approach = self._approach(pair)
            answer = self._ask(pair, approach)
            if isinstance(answer, Impulse):
                taken.append((k, answer))
                continue
            self.restitution[pair] = answer / approach
            answered.append(k)
            restitutions.append(answer / approach)
        some = [indices[k] for k in answered]
        along = [normals[k] for k in answered]
        targets = wanted_speeds(some, along, velocities, restitutions) if some else []
        impulses = solve_generation(some, inverse, along, velocities, targets) if some else []
        before = [self._separation_speed(pairs[k]) for k in answered]
        if some:
            self.velocity.update(zip(bodies, apply(some, along, impulses, inverse, velocities), strict=True))
        for k, impulse, speed in zip(answered, impulses, before, strict=True):
            pair = pairs[k]
            work = 0.5 * float(impulse) * (speed + self._separation_speed(pair))
            law = self.world.response_law(*pair)[0]
            if self.restitution[pair] < 1.0:
                self.world.add_work(law.label(), work)
                self._count_streak(pair)
            self.server.impacts += 1
        for k, answer in taken:
            self._take_over(pairs[k], answer)

    def _ask(self, pair: Pair, approach: float) -> float | Impulse:
        law: ResponseLaw = self.world.response_law(*pair)[0]
        gap = self._gap(pair)
        if pair not in self.first:
            self.first[pair] = (gap, approach)
        law.evaluations += 1
        try:
            answer = law.respond(contact_of(pair, gap, approach))
        except Exception as error:
            raise LawFailedError(
                f"{law.label()}.respond raised {type(error).__name__}: {error}; at t = {self.world.time[0]} s "
                f"for {pair[0].label} and {pair[1].label}. The engine stands just before that impact",
                law,
            ) from error
        if isinstance(answer, Impulse):
            return answer
        if not (isinstance(answer, (int, float)) and 0.0 <= answer < math.inf):
            raise LawFailedError(
                f"{law.label()}.respond gave {answer!r} for {pair[0].label} and {pair[1].label} at t = {self.world.time[0]} s: "
                "a separation speed from 0 m/s up, or an Impulse, is needed",
                law,
            )
        return float(answer)

    def _take_over(self, pair: Pair, impulse: Impulse) -> None:
        """An impulse that a law gave itself; kinetic energy before and after says its work."""
        law = self.world.response_law(*pair)[0]
        before = math.fsum(kinetic(obj, self._velocity(obj)) for obj in pair)
        for obj, sign in ((pair[0], -1.0), (pair[1], 1.0)):
            if not obj.fixed:
                u, j = self._velocity(obj), impulse.vector
                share = sign / obj.mass
                self.velocity[obj] = (u[0] + share * j[0], u[1] + share * j[1], u[2] + share * j[2])
        self.world.add_work(law.label(), math.fsum(kinetic(obj, self._velocity(obj)) for obj in pair) - before)
        self.server.impacts += 1
        if self._approach(pair) > 0.0:
            raise LawFailedError(
                f"{law.label()}.respond took over the impact of {pair[0].label} and {pair[1].label} at t = {self.world.time[0]} s "
                f"with {impulse.vector} N s, and they still approach: give an impulse on body_b along the normal that parts them",
                law,
            )

    def _count_streak(self, pair: Pair) -> None:
        """Count dissipative impacts that follow each other closely; too many are a collapse that nothing here can end."""
        now = self.world.time
        law = self.world.response_law(*pair)[0]
        for obj in pair:
            if obj.fixed:
                continue
            partner = pair[1] if obj is pair[0] else pair[0]
            count, last, other = self.server.streaks.get(obj, (0, NEVER, partner.serial))
            if last == NEVER or elapsed(now, last) >= CLOSE:
                count = 0
            alone = other == partner.serial and self._ends_in_closed_form(pair)
            count = count if alone else count + 1
            self.server.streaks[obj] = (count, now, partner.serial)
            if count > STREAK:
                if law.parameters.get("resting") != "hold":
                    raise ContactError(
                        f"{obj!r} bounces ever faster at t = {now[0]} s (last between {pair[0].label} and {pair[1].label}): "
                        'a collapse that is known in closed form only for a sphere on a plane. Set resting="hold" on the collision law'
                    )
                self.world.transaction.later.append(lambda obj=obj: self.server._hold(obj))

    def _write(self) -> None:
        world, server = self.world, self.server
        transaction = world.transaction
        for obj in world.in_rank_order(self.velocity):
            velocity = self.velocity[obj]
            if not obj.fixed and velocity != self.before[obj]:
                row = transaction.touch(obj)
                world.bodies.put("velocity", row, [component + 0.0 for component in velocity])
                transaction.forced.add(obj)
        for pair, (gap, _) in self.first.items():
            self._put_on_plane(pair, gap)
        ended: list[tuple[Pair, Gap, float]] = []
        begun = [(pair, gap, speed) for pair, (gap, speed) in self.first.items() if pair not in server.touching]
        for pair, (gap, _) in self.first.items():
            server.touching.setdefault(pair, world.time)
            speed = self._separation_speed(pair)
            if speed > self._still(pair):
                del server.touching[pair]
                ended.append((pair, gap, -speed))
                self._maybe_collapse(pair, gap, speed)
        laws = {world.response_law(*pair)[0] for pair in self.first}
        for container in {c: None for law in laws for c in law.containers}:
            container.firings += 1
        heard = [(pair, gap, speed) for pair, (gap, speed) in self.first.items()]
        server._tell(when.Impact, heard)
        server._tell(when.ContactBegin, begun)
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

        The next flight lasts 2 v / a and each one after that e times its predecessor: together 2 v / (a (1 - e)).
        """
        restitution = self.restitution.get(pair, 1.0)
        if restitution >= 1.0 or not self._ends_in_closed_form(pair):
            return
        flight = -2.0 * speed / gap.acceleration
        if flight < SHORTEST_FLIGHT:
            end = later(self.world.time, flight / (1.0 - restitution))
            self.server.collapsing[pair] = (end, -1)

    def _ends_in_closed_form(self, pair: Pair) -> bool:
        """Whether ``pair`` is pressed together, so that ever shorter bounces lead to rest at a known instant."""
        return self._gap(pair).acceleration < 0.0
