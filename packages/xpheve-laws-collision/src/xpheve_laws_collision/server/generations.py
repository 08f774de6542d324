"""Generations: pairs that touch and approach are solved together, then those that approach now, until there are none."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xpheve.errors import ContactError, LawFailedError
from xpheve.kernels.quaternion import rotate_inverse
from xpheve.kernels.vector import Vec, add, cross, dot, norm, scale, sub
from xpheve.laws import Grip, Impulse, ResponseLaw, Velocities
from xpheve.laws.event import UNKNOWN
from xpheve.objects import PhysicalObject
from xpheve_laws_collision import turning
from xpheve_laws_collision.mass import immovable
from xpheve_laws_collision.narrow_phase import Gap, still_speed
from xpheve_laws_collision.server.friction import Spot, rub_all
from xpheve_laws_collision.server.pairs import ROUND, TURNING, Given, Pair, contact_of, kinetic
from xpheve_laws_collision.simultaneous import apply, components, solve_generation, wanted_speeds

if TYPE_CHECKING:
    from xpheve_laws_collision.server.standing import Standing

GENERATIONS = 10_000  # of one instant; a set of pairs that needs more does not come apart
TURNING_GENERATIONS = 1_000  # the same where bodies turn, each of which takes milliseconds


class Generations:
    """The velocities of those involved at an instant, generation after generation. Nothing is written before `write`."""

    counts = 1
    """Whether a question to a law counts as its evaluation."""

    def __init__(self, server: Standing) -> None:
        self.server = server
        self.world = server.world
        self.velocity: dict[PhysicalObject, Vec] = {}
        self.spin: dict[PhysicalObject, Vec] = {}
        self.before: dict[PhysicalObject, tuple[Vec, Vec]] = {}
        self.points: dict[Pair, list[Gap]] = {}
        self.first: dict[Pair, tuple[Gap, float]] = {}
        self.restitution: dict[Pair, float] = {}
        self.impulse: dict[Pair, float] = {}
        """Sizes [N s] of the impulses that each pair got, summed over its points."""
        self.vector: dict[Pair, Vec] = {}
        """Their sum [N s] as a vector, on the second body."""
        self.met: dict[Pair, Vec] = {}
        """Velocity [m/s] of the second body seen from the first at their first point, before the first impulse."""

    # What a kind of generations says for itself

    def law(self, pair: Pair) -> ResponseLaw:
        """Who answers ``pair``."""
        raise NotImplementedError

    def find_points(self, pair: Pair) -> list[Gap]:
        """Where ``pair`` touches."""
        raise NotImplementedError

    def around(self, moved: set[PhysicalObject], pairs: list[Pair]) -> list[Pair]:
        """The pairs that may approach now, after ``pairs`` were answered and bodies ``moved``."""
        raise NotImplementedError

    def answered(self, pair: Pair) -> None:
        """Told of each dissipative impact."""

    # The loop

    def solve(self, pairs: list[Pair]) -> None:
        """Until no touching pair approaches."""
        pairs = [pair for pair in pairs if self.approach(pair) > 0.0]
        rounds = 0
        while pairs:
            self.server.generations += 1
            if rounds and not all(self.law(pair).lever_arms for pair in pairs):
                self.write()  # such laws read the velocities themselves
            try:
                self._generation(sorted(pairs, key=lambda pair: (pair[0].rank, pair[1].rank)))
            except OverflowError:
                raise ContactError(
                    f"the impulses between {', '.join(f'{a!r} and {b!r}' for a, b in pairs[:4])} at t = {self.world.time[0]} s "
                    "are beyond what a float can hold: give smaller speeds, masses or moments of inertia"
                ) from None
            moved = {obj for pair in pairs for obj in pair if not immovable(obj)}
            pairs = [pair for pair in self.around(moved, pairs) if self.approach(pair) > 0.0]
            rounds += 1
            if rounds > (TURNING_GENERATIONS if any(map(self.turns, pairs)) else GENERATIONS):
                raise ContactError(
                    f"impacts at t = {self.world.time[0]} s do not end: "
                    + ", ".join(f"{a.label} - {b.label}" for a, b in pairs[:4])
                )

    # States at hand

    def turns(self, pair: Pair) -> bool:
        """Whether impulses on ``pair`` have lever arms: an extended body, and a law that does not answer it as a point."""
        shape = self.server._shape
        return (shape(pair[0]).kind not in ROUND or shape(pair[1]).kind not in ROUND) and self.law(pair).lever_arms

    def points_of(self, pair: Pair) -> list[Gap]:
        """Where ``pair`` touches, found once."""
        if pair not in self.points:
            self.points[pair] = self.find_points(pair)
        return self.points[pair]

    def _take_up(self, obj: PhysicalObject) -> None:
        self.velocity[obj] = self.world.read_row(obj._row, "velocity")
        self.spin[obj] = self.world.read_row(obj._row, "angular_velocity")
        self.before[obj] = self.velocity[obj], self.spin[obj]

    def velocity_of(self, obj: PhysicalObject) -> Vec:
        """Velocity [m/s] now."""
        if obj not in self.velocity:
            self._take_up(obj)
        return self.velocity[obj]

    def body(self, obj: PhysicalObject) -> turning.Body:
        """``obj`` as `turning` takes it, now."""
        velocity = self.velocity_of(obj)
        q = self.world.read_row(obj._row, "orientation")
        spin = self.spin[obj]
        turned = rotate_inverse(q, spin) if any(spin) else spin
        x = self.world.read_row(obj._row, "position")
        if immovable(obj):
            return turning.Body(0.0, (0.0, 0.0, 0.0), velocity, turned, q, x)
        a, b, c = (1.0 / moment if moment else 0.0 for moment in obj.inertia)
        return turning.Body(1.0 / obj.mass, (a, b, c), velocity, turned, q, x)

    def speed(self, pair: Pair, gap: Gap) -> float:
        """How fast [m/s] ``pair`` opens at ``gap``."""
        if self.turns(pair):
            bodies = [self.body(obj) for obj in pair]
            return float(turning.separation_speed(turning.push_at(0, 1, bodies, gap.normal, gap.point), bodies))
        u, v = self.velocity_of(pair[0]), self.velocity_of(pair[1])
        return math.fsum(c * (q - p) for c, p, q in zip(gap.normal, u, v, strict=True))

    def still(self, pair: Pair, gap: Gap) -> float:
        """Speed [m/s] that is none, at ``gap``."""
        speeds = math.hypot(*self.velocity_of(pair[0])) + math.hypot(*self.velocity_of(pair[1]))
        if self.turns(pair):
            none = TURNING * gap.still
            if all((self.velocity[obj], self.spin[obj]) == self.before[obj] for obj in pair):
                return none  # as it was predicted
            for obj in pair:
                if any(self.spin[obj]):
                    x = self.world.read_row(obj._row, "position")
                    speeds += norm(self.spin[obj]) * math.dist(gap.point, x)
            return max(none, still_speed(TURNING * speeds, gap.acceleration))
        return still_speed(speeds, gap.acceleration)

    def approaches(self, pair: Pair) -> list[tuple[Gap, float]]:
        """The points of ``pair`` that approach, each with its speed [m/s]."""
        found = []
        for gap in self.points_of(pair):
            speed = -self.speed(pair, gap)
            if speed > self.still(pair, gap):
                found.append((gap, speed))
        return found

    def approach(self, pair: Pair) -> float:
        """Greatest approach speed [m/s]; 0 if there is none."""
        return max((speed for _, speed in self.approaches(pair)), default=0.0)

    def parts(self, pair: Pair) -> float:
        """How fast [m/s] ``pair`` comes apart wherever it touches; 0 if it does not."""
        speeds = [(self.speed(pair, gap), self.still(pair, gap)) for gap in self.points_of(pair)]
        return min(speed for speed, _ in speeds) if all(speed > still for speed, still in speeds) else 0.0

    def slip(self, pair: Pair, gap: Gap) -> Vec:
        """Velocity [m/s] of the second body seen from the first, at ``gap``."""
        found = []
        for obj in pair:
            velocity = self.velocity_of(obj)
            spin = self.spin[obj]
            found.append(add(velocity, cross(spin, self.arm(pair, obj, gap))) if any(spin) else velocity)
        return sub(found[1], found[0])

    def arm(self, pair: Pair, obj: PhysicalObject, gap: Gap) -> Vec:
        """From the centre of ``obj`` to the contact [m]: of a ball along the normal, to the bit; none if bodies answer as points."""
        if not self.law(pair).lever_arms:
            return (0.0, 0.0, 0.0)
        arm = self.server._lever(obj, gap)
        return scale(gap.normal, dot(gap.normal, arm)) if self.server._shape(obj).kind == "sphere" else arm

    def given(self) -> dict[Pair, Given]:
        """What listeners are told of each pair."""
        return {
            pair: Given(self.impulse.get(pair, math.nan), self.vector.get(pair, UNKNOWN), self.met[pair])
            for pair in self.first
        }

    # One generation

    def _generation(self, pairs: list[Pair]) -> None:
        """Answer what touches and approaches now, together."""
        spots: list[Spot] = []
        taken: list[tuple[Pair, Gap, Impulse | Velocities]] = []
        for pair in pairs:
            found = self.approaches(pair)
            for gap, approach in found:
                if pair not in self.first:
                    self.first[pair] = max(found, key=lambda one: one[1])
                    self.met[pair] = self.slip(pair, self.first[pair][0])
                answer = self._ask(pair, gap, approach)
                if isinstance(answer, (Impulse, Velocities)):
                    taken.append((pair, gap, answer))
                    if isinstance(answer, Velocities):
                        break
                    continue
                spot = Spot(pair, gap, approach, *(answer if isinstance(answer, Grip) else (answer / approach,)))
                spots.append(spot)
                self.restitution[pair] = spot.restitution
        plain, turned = self._parted(spots)
        pushed: list[tuple[Spot, float]] = []
        if plain:
            pushed += zip(plain, self._solve_plain(plain), strict=True)
        for group in turned:
            pushed += zip(group, self._solve_turning(group), strict=True)
        rub_all(self, [(spot, push) for spot, push in pushed if push > 0.0])
        for pair, gap, given in taken:
            self._take_over(pair, gap, given)

    def _parted(self, spots: list[Spot]) -> tuple[list[Spot], list[list[Spot]]]:
        """Those without lever arms, and the connected groups in which some have them."""
        if not any(self.turns(spot.pair) for spot in spots):
            return spots, []
        place = {obj: k for k, obj in enumerate({obj: None for spot in spots for obj in spot.pair})}
        inverse = [0.0 if immovable(obj) else 1.0 for obj in place]
        plain: list[int] = []
        turned: list[list[Spot]] = []
        for members in components([(place[spot.pair[0]], place[spot.pair[1]]) for spot in spots], inverse):
            if any(self.turns(spots[k].pair) for k in members):
                turned.append([spots[k] for k in members])
            else:
                plain += members
        return [spots[k] for k in sorted(plain)], turned

    def _solve_plain(self, spots: list[Spot]) -> list[float]:
        """Bodies without lever arms, in exact fractions; returns the impulses [N s]."""
        bodies = list({obj: None for spot in spots for obj in spot.pair})
        place = {obj: k for k, obj in enumerate(bodies)}
        indices = [(place[spot.pair[0]], place[spot.pair[1]]) for spot in spots]
        velocities = [self.velocity_of(obj) for obj in bodies]
        inverse = [0.0 if immovable(obj) else 1.0 / obj.mass for obj in bodies]
        along = [spot.gap.normal for spot in spots]
        targets = wanted_speeds(indices, along, velocities, [spot.restitution for spot in spots])
        impulses = solve_generation(indices, inverse, along, velocities, targets)
        before = [self.speed(spot.pair, spot.gap) for spot in spots]
        self.velocity.update(zip(bodies, apply(indices, along, impulses, inverse, velocities), strict=True))
        return self._book(spots, [float(impulse) for impulse in impulses], before)

    def _solve_turning(self, spots: list[Spot]) -> list[float]:
        """Bodies with lever arms; returns the impulses [N s]."""
        objects = list({obj: None for spot in spots for obj in spot.pair})
        place = {obj: k for k, obj in enumerate(objects)}
        bodies = [self.body(obj) for obj in objects]
        pushes = [
            turning.push_at(place[pair[0]], place[pair[1]], bodies, gap.normal, gap.point)
            if self.turns(pair)
            else turning.Push(place[pair[0]], place[pair[1]], gap.normal, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
            for pair, gap, *_ in spots
        ]
        speeds = [turning.separation_speed(push, bodies) for push in pushes]
        missing = [
            -speed * (1 + type(speed)(spot.restitution)) if speed < 0 else type(speed)(0)
            for speed, spot in zip(speeds, spots, strict=True)
        ]
        impulses = turning.solve(pushes, bodies, missing)
        for obj, (velocity, change) in zip(objects, turning.after(pushes, bodies, impulses), strict=True):
            self.velocity[obj] = velocity
            self.spin[obj] = turning.new_spin(self.spin[obj], change)
        return self._book(spots, [float(impulse) for impulse in impulses], [float(speed) for speed in speeds])

    def _book(self, spots: list[Spot], impulses: list[float], before: list[float]) -> list[float]:
        """Count the impacts, and account for the work of those that lose energy."""
        for spot, impulse, speed in zip(spots, impulses, before, strict=True):
            pair = spot.pair
            self.note(pair, impulse, scale(spot.gap.normal, impulse))
            if spot.restitution < 1.0:
                self.world.add_work(self.law(pair).label(), 0.5 * impulse * (speed + self.speed(pair, spot.gap)))
                self.answered(pair)
            self._book_hand(pair, spot.gap, impulse)
            self.server.impacts += 1
        return impulses

    def note(self, pair: Pair, size: float, vector: Vec) -> None:
        """Keep what ``pair`` got, for those who are told."""
        self.impulse[pair] = self.impulse.get(pair, 0.0) + size
        self.vector[pair] = add(self.vector.get(pair, (0.0, 0.0, 0.0)), vector)

    def _book_hand(self, pair: Pair, gap: Gap, impulse: float) -> None:
        """Account for the work of the host on what it drives: it keeps the way of a body that ``impulse`` pushes back."""
        if any(immovable(obj) and not obj.fixed for obj in pair):
            self.book_host(pair, gap, scale(gap.normal, impulse))

    def book_host(self, pair: Pair, gap: Gap, vector: Vec) -> None:
        """The same, of an impulse ``vector`` [N s] on the second of ``pair``."""
        for obj, sign in zip(pair, (1.0, -1.0), strict=True):
            if immovable(obj) and not obj.fixed:
                velocity = self.velocity_of(obj)
                velocity = add(velocity, cross(self.spin[obj], self.arm(pair, obj, gap)))
                joules = sign * math.fsum(p * v for p, v in zip(vector, velocity, strict=True))
                if joules:
                    self.world.add_work("driven", joules)

    def _ask(self, pair: Pair, gap: Gap, approach: float) -> float | Impulse | Velocities | Grip:
        law = self.law(pair)
        law.evaluations += self.counts
        told = contact_of(pair, gap, approach, self.world.time, Given(math.nan, UNKNOWN, self.slip(pair, gap)))
        try:
            asked, contact = law.asked(told)
            grip = asked.grip(contact)
            answer = asked.respond(contact) if grip is None else grip
        except Exception as error:
            raise LawFailedError(
                f"{law.label()}.respond raised {type(error).__name__}: {error}; at t = {self.world.time[0]} s "
                f"for {pair[0].label} and {pair[1].label}. The engine stands just before that impact",
                law,
            ) from error
        if isinstance(answer, (Impulse, Velocities)):
            return answer
        if isinstance(answer, Grip):
            return self._checked(law, pair, answer)
        if not (isinstance(answer, (int, float)) and 0.0 <= answer < math.inf):
            raise LawFailedError(
                f"{law.label()}.respond gave {answer!r} for {pair[0].label} and {pair[1].label} at t = {self.world.time[0]} s: "
                "a separation speed from 0 m/s up, an Impulse, or Velocities, is needed",
                law,
            )
        return float(answer)

    def _checked(self, law: ResponseLaw, pair: Pair, grip: Grip) -> Grip:
        """``grip`` as plain numbers, if such surfaces can be."""
        e, mu, beta = map(float, grip)
        if not (0.0 <= e <= 1.0 and mu >= 0.0 and -1.0 <= beta <= 1.0):
            raise LawFailedError(
                f"{law.label()}.grip gave {grip!r} for {pair[0].label} and {pair[1].label} at t = {self.world.time[0]} s: a restitution "
                "from 0 to 1, a friction from 0 up and a tangential restitution from -1 to 1 are needed",
                law,
            )
        return Grip(e, mu, beta)

    def _take_over(self, pair: Pair, gap: Gap, answer: Impulse | Velocities) -> None:
        """What a law gave itself; kinetic energy before and after says its work."""
        if isinstance(answer, Velocities) and self.approach(pair) == 0.0:
            return  # another pair of this generation has parted them
        law = self.law(pair)
        before = self._kinetic(pair)
        if isinstance(answer, Velocities):
            change, vector = 0.0, (0.0, 0.0, 0.0)
            for obj, velocity, sign in zip(pair, (answer.a, answer.b), (-1.0, 1.0), strict=True):
                if not immovable(obj):
                    change = max(change, obj.mass * math.dist(velocity, self.velocity_of(obj)))
                    vector = scale(sub(velocity, self.velocity_of(obj)), sign * obj.mass)
                    self.velocity[obj] = velocity
            self.note(pair, change, vector)
        else:
            self._push(pair, gap, answer.vector)
        self.world.add_work(law.label(), self._kinetic(pair) - before)
        self.server.impacts += 1
        still = max(self.still(pair, gap), 1e-12 * abs(gap.speed))
        if -self.speed(pair, gap) > still:
            given = f"{answer.vector} N s" if isinstance(answer, Impulse) else f"{answer.a} and {answer.b} m/s"
            raise LawFailedError(
                f"{law.label()}.respond took over the impact of {pair[0].label} and {pair[1].label} at t = {self.world.time[0]} s "
                f"with {given}, and they still approach: give an impulse on body_b along the normal that parts them",
                law,
            )

    def _push(self, pair: Pair, gap: Gap, vector: Vec) -> None:
        """An impulse [N s] on the second of ``pair``, its opposite on the first."""
        self.note(pair, norm(vector), vector)
        for obj, sign in ((pair[0], -1.0), (pair[1], 1.0)):
            if immovable(obj):
                continue
            u, share = self.velocity_of(obj), sign / obj.mass
            twist = self._twist(pair, obj, gap, scale(vector, sign))
            if any(twist):
                self.spin[obj] = turning.new_spin(self.spin[obj], turning.spun(self.body(obj), twist))
            self.velocity[obj] = (u[0] + share * vector[0], u[1] + share * vector[1], u[2] + share * vector[2])

    def _twist(self, pair: Pair, obj: PhysicalObject, gap: Gap, own: Vec) -> Vec:
        """Angular impulse [N m s] of ``own`` on ``obj``; exactly none of one along the normal of a ball."""
        arm = self.arm(pair, obj, gap)
        twist = cross(arm, own)
        none = self.server._shape(obj).kind == "sphere" and norm(twist) <= 4e-16 * norm(arm) * norm(own)
        return (0.0, 0.0, 0.0) if none else twist

    def _kinetic(self, pair: Pair) -> float:
        found = [kinetic(obj, self.velocity_of(obj)) for obj in pair]
        if self.law(pair).lever_arms:
            for obj in pair:
                if not immovable(obj):
                    spin = self.body(obj).spin
                    found += [0.5 * moment * w * w for moment, w in zip(obj.inertia, spin, strict=True)]
        return math.fsum(found)

    # The end

    def write(self) -> None:
        """Give the rows their new velocities."""
        world, transaction = self.world, self.world.transaction
        for obj in world.in_rank_order(self.velocity):
            velocity, spin = self.velocity[obj], self.spin[obj]
            if not immovable(obj) and (velocity, spin) != self.before[obj]:
                row = transaction.touch(obj)
                if velocity != self.before[obj][0]:
                    world.bodies.put("velocity", row, [component + 0.0 for component in velocity])
                if spin != self.before[obj][1]:
                    world.bodies.put("angular_velocity", row, [component + 0.0 for component in spin])
                transaction.forced.add(obj)
                self.before[obj] = velocity, spin
