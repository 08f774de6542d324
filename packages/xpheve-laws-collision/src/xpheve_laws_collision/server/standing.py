"""What stands: supports, what is held, what collapses towards rest."""

from __future__ import annotations

import math

from xpheve.errors import ContactError
from xpheve.events import IMPACT, Entry
from xpheve.kernels.quaternion import rotate_inverse
from xpheve.kernels.vector import Vec
from xpheve.laws import conditions as when
from xpheve.objects import PhysicalObject
from xpheve_laws_collision.mass import immovable
from xpheve_laws_collision.narrow_phase import Gap, flipped
from xpheve_laws_collision.narrow_phase.sphere_plane import put_on
from xpheve_laws_collision.server.pairs import ROUND, SHORTEST_FLIGHT, Pair, Support, kinetic, pair_of
from xpheve_laws_collision.server.telling import Telling


class Standing(Telling):
    """Keeps at rest what rests."""

    def _recheck_standing(self, obj: PhysicalObject) -> None:
        """See whether ``obj``, whose flight is new, is still supported, held or collapsing."""
        for pair, (end, seen) in list(self.collapsing.items()):
            if obj in pair:
                mover = pair[0] if pair[1].fixed else pair[1]
                now = int(self.world.bodies.version[mover._row])
                if seen < 0:
                    self.collapsing[pair] = (end, now)
                    self.world.schedule(end, IMPACT, (pair[0].rank, pair[1].rank), self._settle, ((mover, now),))
                elif seen != now and mover is obj:
                    if self._still_collapses(pair, mover):
                        self.collapsing[pair] = (end, now)
                        self.world.schedule(end, IMPACT, (pair[0].rank, pair[1].rank), self._settle, ((mover, now),))
                    else:
                        del self.collapsing[pair]
        if obj in self.held and (
            any(self.world.bodies.get("velocity", obj._row))
            or (self._shape(obj).kind not in ROUND and any(self.world.bodies.get("angular_velocity", obj._row)))
        ):
            self._release(obj)
        elif obj in self.held:
            self._hold(obj)
        if obj in self.supports:
            self._recheck_support(obj)
        if obj.fixed:
            for ball in [ball for ball, support in self.supports.items() if support.plane is obj]:
                self._recheck_support(ball)

    def _still_collapses(self, pair: Pair, mover: PhysicalObject) -> bool:
        """Whether a step of a curved flight, and no event, is what is new: it bounces still as shortly as when that was ended in closed form."""
        flight = self.world.flight(mover._row)
        if not flight.curved or not flight.t0 < flight.t1:
            return bool(flight.curved)
        gap = self._gap(pair, flight.t0)
        slow = abs(2.0 * gap.speed) < -2.0 * gap.acceleration * SHORTEST_FLIGHT
        return slow and abs(gap.separation) <= gap.touch

    def _recheck_support(self, ball: PhysicalObject) -> None:
        support = self.supports[ball]
        pair = self._pair(ball, support.plane)
        flight = self.world.flight(ball._row)
        if flight.curved:
            return  # about to be planned anew, along parabolas
        gap = self._gap(pair, flight.t0)
        answered = self._answered(pair)
        if not answered or abs(gap.separation) > 10.0 * gap.touch or abs(gap.speed) > gap.still:
            self._end_support(ball)
            return
        self._react(ball, support)

    def _react(self, ball: PhysicalObject, support: Support) -> None:
        """Renew the reaction on a supported ball: it takes away what presses it onto the plane, and ends when nothing does."""
        n, world = support.outward, self.world
        flight = world.flight(ball._row)
        reaction = self._reaction(ball)
        press = math.fsum(f * c for f, c in zip(self._force_without(ball), n, strict=True))
        along = press + math.fsum(r * c for r, c in zip(reaction, n, strict=True))
        extra = ball.mass * math.fsum(a * c for a, c in zip(flight.acceleration, n, strict=True)) - along
        size = math.hypot(*self._force_without(ball)) + abs(extra)
        needed = -(press + (extra if abs(extra) > 1e-12 * size else 0.0))
        if needed < 0.0:
            self._end_support(ball)
            return
        force = (needed * n[0], needed * n[1], needed * n[2])
        if max(abs(f - r) for f, r in zip(force, reaction, strict=True)) > 1e-15 * size or not any(reaction):
            world.put_reaction(ball, self, "support", force)

    def _reaction(self, ball: PhysicalObject) -> Vec:
        for one in self.world.forces.on(ball):
            if one.owner is self:
                found: Vec = one.force.vector
                return found
        return (0.0, 0.0, 0.0)

    def _force_without(self, ball: PhysicalObject) -> Vec:
        """Sum of the stored forces on ``ball`` but for the reaction."""
        others = [one.force.vector for one in self.world.forces.on(ball) if one.owner is not self]
        x, y, z = (math.fsum(vector[k] for vector in others) for k in range(3))
        return x, y, z

    def _end_support(self, ball: PhysicalObject) -> None:
        """The plane no longer carries ``ball``."""
        support = self.supports.pop(ball)
        self._leaves_parabolas(ball)
        if ball._row >= 0:
            self.world.put_reaction(ball, self, "support", None)
            if support.plane._row >= 0:
                self.touching.setdefault(self._pair(ball, support.plane), self.world.time)

    def _leaves_parabolas(self, obj: PhysicalObject) -> None:
        """``obj`` flew along parabolas because it stood: let it have the stepper that it would have else."""
        number = int(self.world.bodies.batch[obj._row]) if obj._row >= 0 else -1
        if number >= 0 and self.world.batches[number].signature.contacts:
            self.world.mark(obj)

    def _takes_parabolas(self, obj: PhysicalObject) -> None:
        """``obj`` stands from now on, which is known along parabolas only."""
        if self.world.flight(obj._row).curved:
            self.world.transaction.replan[obj] = None

    def _settle(self, entries: list[Entry]) -> None:
        """Touching, still and pressed together: a support, a case that cannot be resolved yet, or held."""
        self._keep()
        for pair in [pair_of(entry, self) for entry in entries]:
            self.collapsing.pop(pair, None)
            self._rest(pair)

    def _rest(self, pair: Pair) -> None:
        a, b = pair
        world = self.world
        family, swapped = self._family(a, b)
        ball, ground = (b, a) if swapped else (a, b)
        found = self._response(a, b)
        hold = found is not None and found[0].parameters.get("resting") == "hold"
        if ball in self.held and (ground in self.held or immovable(ground)):
            return
        alone = ball not in self.supports and ball not in self.held
        if not (family.rests and ground.fixed and alone):
            if not hold:
                upper, lower = self._pressed(pair)
                raise ContactError(
                    f"{upper!r} rests on {lower!r} at t = {world.time[0]} s, and "
                    + (
                        "has a second support"
                        if not alone
                        else "only a sphere on one fixed plane can rest in closed form so far"
                    )
                    + '. Set resting="hold" on the collision law to hold such bodies in place'
                )
            for obj in pair:
                if not immovable(obj):
                    self._hold(obj)
            return
        transaction = world.transaction
        row = transaction.touch(ball)
        gap = family.gap(self._mover(ball, world.time), self._mover(ground, world.time))
        position, velocity = put_on(self._mover(ball, world.time), gap)
        world.bodies.put("position", row, position)
        world.bodies.put("velocity", row, velocity)
        n = gap.normal
        outward = (-n[0] + 0.0, -n[1] + 0.0, -n[2] + 0.0)
        support = self.supports[ball] = Support(ground, outward)
        transaction.undo.append(lambda: self.supports.pop(ball, None))
        self._takes_parabolas(ball)
        began = pair not in self.touching
        self.touching.setdefault(pair, world.time)
        press = self._force_without(ball)
        needed = max(-math.fsum(f * c for f, c in zip(press, support.outward, strict=True)), 0.0)
        world.put_reaction(ball, self, "support", tuple(needed * c for c in support.outward))
        if began:
            self._tell(when.ContactBegin, [(pair, gap if not swapped else flipped(gap), 0.0)])

    def _pressed(self, pair: Pair) -> Pair:
        """``pair`` as who is pressed onto whom: first the one that accelerates more into the other."""
        a, b = pair
        n = self._gap(pair, self.world.time).normal
        into, back = (
            math.fsum(c * k for c, k in zip(self.world.flight(obj._row).acceleration, n, strict=True)) for obj in pair
        )
        return (b, a) if -back > into else (a, b)

    def _hold(self, obj: PhysicalObject) -> None:
        """Stop ``obj`` where it is, and cancel what acts on it."""
        self.held[obj] = None
        world = self.world
        with world.instant() as transaction:
            row = transaction.touch(obj)
            self._takes_parabolas(obj)
            lost = kinetic(obj, world.bodies.get("velocity", row))
            if self._shape(obj).kind not in ROUND:
                lost += self._stop_turning(obj, row)
            if lost:
                world.add_work("held", -lost)
            world.bodies.put("velocity", row, (0.0, 0.0, 0.0))
            x, y, z = self._force_without(obj)
            if obj in self.supports:
                del self.supports[obj]
                world.put_reaction(obj, self, "support", None)
            world.put_reaction(obj, self, "hold", (-x + 0.0, -y + 0.0, -z + 0.0), self._torque_against(obj))

    def _stop_turning(self, obj: PhysicalObject, row: int) -> float:
        """Stop an extended body's rotation; returns the energy [J] it had."""
        bodies = self.world.bodies
        spin = rotate_inverse(bodies.get("orientation", row), bodies.get("angular_velocity", row))
        bodies.put("angular_velocity", row, (0.0, 0.0, 0.0))
        return 0.5 * math.fsum(moment * w * w for moment, w in zip(obj.inertia, spin, strict=True))

    def _torque_against(self, obj: PhysicalObject) -> Vec:
        """What cancels the stored torques on an extended body that is held; a round one is left to spin."""
        if self._shape(obj).kind in ROUND:
            return (0.0, 0.0, 0.0)
        others = [one.force.torque for one in self.world.forces.on(obj) if one.owner is not self]
        x, y, z = (0.0 - math.fsum(torque[k] for torque in others) for k in range(3))
        return x, y, z

    def _release(self, obj: PhysicalObject) -> None:
        del self.held[obj]
        self._leaves_parabolas(obj)
        self.world.put_reaction(obj, self, "hold", None)

    def _refuse_sunk(self, entries: list[Entry]) -> None:
        """Bodies at rest inside one another, and pressed further in."""
        pair = pair_of(entries[0], self)
        depth = -self._gap(pair, self.world.time).separation
        raise ContactError(
            f"{pair[0]!r} and {pair[1]!r} overlap by {depth} m at t = {self.world.time[0]} s, at rest, and are pressed together: "
            "move one of them out, or give it a speed"
        )

    def _loaded(self, pair: Pair, gap: Gap) -> bool:
        """Whether the normal acceleration of a touching pair is more than rounding."""
        scale = sum(math.hypot(*self.world.flight(obj._row).acceleration) for obj in pair)
        speeds = sum(_squared(self.world.flight(obj._row).velocity) for obj in pair)
        sizes = sum(getattr(self._shape(obj), "radius", 0.0) for obj in pair)
        for obj in pair:
            if self._shape(obj).kind not in ROUND:
                reach = obj.shape.reach if obj.shape is not None else 0.0
                scale += reach * _squared(self.world.bodies.get("angular_velocity", obj._row))
                sizes = max(sizes, reach)
        return abs(gap.acceleration) > 1e-13 * (scale + (speeds / sizes if sizes else 0.0))

    def _turned(self, pair: Pair) -> None:
        """A pair that came to its impact with no speed left: if it is pressed together, it rests."""
        gap = self._gap(pair, self.world.time)
        if abs(gap.separation) <= 10.0 * gap.touch and gap.speed <= gap.still and gap.acceleration < 0.0:
            if self._loaded(pair, gap) and not self._is_support(pair):
                self._rest(pair)


def _squared(vector: Vec) -> float:
    """The square of its length; infinite where no float holds it."""
    length = math.hypot(*vector)
    return length * length
