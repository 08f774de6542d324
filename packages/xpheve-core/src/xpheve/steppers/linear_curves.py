"""The curves of rows under affine forces: rows by themselves, all at once; coupled groups, one by one.

A row, or a group, starts with velocities and with the accelerations that it would have at rest where it is. What its flow makes of them
(`Flow.begin`) is kept; a span is one evaluation from there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from xpheve.steppers.contract import Array, Rows
from xpheve.steppers.linear_flow import Flow, ModalFlow, Mode, flow_of, parts_of
from xpheve.steppers.linear_form import LinearForm
from xpheve.steppers.mode_table import ModeTable
from xpheve.steppers.wide import Wide, wide

Pair = tuple[Array, Array]

KEPT_FLOWS, KEPT_MODES = 256, 64
"""Flows that a batch remembers by their matrices, and modes that all batches do."""
_MODES: dict[object, ModalFlow] = {}
WIDTHS = {"start": 12, "modes": 3, "frame": 1, "speed": 3, "pull": 3, "held": 9, "group": 1, "member": 1}
"""What a row keeps: its start in the coordinates of its flow; numbers of its modes; which frame these are in; velocity, conservative
force and its slopes at the start, for work; the number of its group and 1, or 0, and its place there."""


class Frame(NamedTuple):
    """How the coordinates of a row's flow lie."""

    plane: tuple[int, ...]
    """Two coordinates that are one complex mode; or none."""
    basis: Array | None
    """Columns are the directions of the coordinates, in the world; None if they are x, y, z."""
    flow: Flow | None
    """What carries rows without modes; else None."""


class Group:
    """Rows that act on one another: parts of their coordinates that do not, each with its flow."""

    def __init__(self, mass: Array, speed: Array, parts: list[tuple[Flow, NDArray[np.int64], Array]]) -> None:
        self.mass, self.speed, self.parts = mass, speed, parts
        self.size = len(mass) // 3
        self.kept: Array = np.zeros(len(mass))
        self.held: Array = np.zeros((0, 0))
        """Conservative forces at the start, and their slopes, for work."""
        self._last: tuple[tuple[float, float], Array, Array] | None = None

    def after(self, span: tuple[float, float]) -> tuple[Array, Array]:
        """Ways [m] and velocities [m/s] after ``span`` [s], (3, size)."""
        if self._last is not None and self._last[0] == span:
            return self._last[1], self._last[2]
        way, speed = np.empty(3 * self.size), np.empty(3 * self.size)
        for flow, places, start in self.parts:
            count = places.shape[1]
            found = flow.coefficients(span)
            y, v = flow.end(start, [span] * count, np.repeat(found[:, :, None], count, axis=2))
            way[places], speed[places] = y, v
        found_way, found_speed = way.reshape(self.size, 3).T, speed.reshape(self.size, 3).T
        self._last = span, found_way, found_speed
        return found_way, found_speed

    def work(self, span: tuple[float, float]) -> float:
        """Work [J] of forces without potential: what kinetic and potential energy gained."""
        way, speed = (one.T.ravel() for one in self.after(span))
        gained = 0.5 * self.mass * (speed - self.speed) * (speed + self.speed)
        given = (self.kept + 0.5 * (self.held * way).sum(axis=1)) * way
        return math.fsum([*gained.tolist(), *(-given).tolist()])


class Curves:
    """All curves of a batch; what is kept of a row lies at its place."""

    def __init__(self) -> None:
        self.arrays: dict[str, Array] = {name: np.zeros((width, 0)) for name, width in WIDTHS.items()}
        self.works = False
        self._reset()

    def _reset(self) -> None:
        self.table = ModeTable()
        self.frames: list[Frame] = [Frame((), None, None)]
        self._frames: dict[object, int] = {(): 0}
        self._flows: dict[object, Flow] = {}
        self.groups: dict[int, Group] = {}
        self._next = 0

    def add(self, count: int) -> None:
        """Room for ``count`` more rows, at the end."""
        for name, array in self.arrays.items():
            self.arrays[name] = np.concatenate([array, np.zeros((len(array), count))], axis=1)

    def take(self, local: int, last: int) -> None:
        """Forget the row at ``local``; that at ``last``, the end, has its place then."""
        group = int(self.arrays["group"][0, local]) - 1
        for name, array in self.arrays.items():
            array[:, local] = array[:, last]
            self.arrays[name] = array[:, :last]
        if group in self.groups and not (self.arrays["group"][0] == group + 1).any():
            del self.groups[group]

    # Beginning

    def begin(
        self, form: LinearForm, places: Rows, position: Array, velocity: Array, stored: Array, every: bool
    ) -> Array:
        """New curves of the rows at ``places``, complete groups, under ``form`` and ``stored`` forces [N]; ``every``: there are no others.

        Returns the accelerations [m/s^2] at the start.
        """
        if every:
            self._reset()
        self.works = form.works
        force = form.force(position) + wide(stored)
        pull = force / wide(form.mass)[None]
        for name in ("group", "member"):
            self.arrays[name][:, places] = 0.0
        self.arrays["speed"][:, places] = velocity
        if form.works:
            self.arrays["pull"][:, places] = (form.kept_force(position) + wide(stored)).high
            self.arrays["held"][:, places] = form.held.high.reshape(9, -1)
        total = pull + (form.damping * Wide(velocity)[None]).sum(1) / wide(form.mass)[None]
        groups = form.groups()
        alone = np.ones(len(places), dtype=bool)
        for one in groups:
            alone[one] = False
            total[:, one] = total[:, one] + self._begin_group(form, one, places[one], velocity, pull, stored, position)
        which = np.flatnonzero(alone)
        if len(which):
            self._begin_alone(form, which, places[which], Wide(velocity[:, which]), pull[:, which])
        return total.high

    def _begin_group(
        self, form: LinearForm, group: Rows, places: Rows, velocity: Array, pull: Wide, stored: Array, position: Array
    ) -> Wide:
        """A group begins; returns the accelerations of velocities of others, (3, size)."""
        size = len(group)
        stiffness, damping = form.matrices(group)
        mass = np.repeat(form.mass[group], 3)
        v, f = Wide(velocity[:, group].T.ravel()), Wide(pull.high[:, group].T.ravel(), pull.low[:, group].T.ravel())
        parts = []
        for flow, at in self._known_parts(stiffness, damping, mass):
            parts.append((flow, at, flow.begin(v[at], f[at])))
        made = Group(mass, v.high, parts)
        if form.works:
            made.kept = self.arrays["pull"][:, places].T.ravel()
            made.held = form.held_matrix(group).high
        number = self._next
        self._next += 1
        self.groups[number] = made
        self.arrays["group"][0, places] = number + 1
        self.arrays["member"][0, places] = np.arange(size)
        whole = damping @ v / wide(mass)
        own = (form.damping[:, :, group] * Wide(velocity[:, group])[None]).sum(1) / wide(form.mass[group])[None]
        return Wide(whole.high.reshape(size, 3).T, whole.low.reshape(size, 3).T) - own

    def _known_parts(self, stiffness: Wide, damping: Wide, mass: Array) -> list[tuple[Flow, NDArray[np.int64]]]:
        """The flows of blocks that do not act on one another, with the coordinates of all blocks that are alike, (n, alike)."""
        found: dict[object, tuple[Flow, list[Rows]]] = {}
        for at in parts_of(stiffness, damping):
            part = np.ix_(at, at)
            k, d, m = stiffness[part], damping[part], mass[at]
            key = (k.key(), d.key(), m.tobytes())
            if key not in found:
                found[key] = self._flow(key, k, d, m), []
            found[key][1].append(at)
        return [(flow, np.array(places).T) for flow, places in found.values()]

    def _flow(self, key: object, k: Wide, d: Wide, mass: Array) -> Flow:
        """The flow of a block; modes are remembered for all batches, since a scene that is planned anew has mostly the same."""
        flow = self._flows.get(key) or _MODES.get(key)
        if flow is None:
            flow = flow_of(k, d, mass)
            if isinstance(flow, ModalFlow):
                if len(_MODES) >= KEPT_MODES:
                    _MODES.clear()
                _MODES[key] = flow
        if len(self._flows) >= KEPT_FLOWS:
            self._flows.clear()
        self._flows[key] = flow
        return flow

    def _begin_alone(self, form: LinearForm, which: Rows, places: Rows, velocity: Wide, pull: Wide) -> None:
        """Rows that nobody else acts on begin: those whose axes are apart at once, others set by set of equal numbers."""
        mass = wide(form.mass[which])
        k, d = form.stiffness[:, :, which], form.damping[:, :, which]
        a, b = k / mass[None, None], d / mass[None, None]
        coupled = np.zeros((3, 3, len(which)), dtype=bool)
        for one in (a, b):
            coupled |= one.high != 0.0
        coupled |= coupled.swapaxes(0, 1)
        left = np.ones(len(which), dtype=bool)
        apart = ~(coupled[0, 1] | coupled[0, 2] | coupled[1, 2])
        if apart.any():
            self._begin_apart(np.flatnonzero(apart), places, a, b, velocity, pull)
            left &= ~apart
        for i, j, other in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
            plane = left & ~coupled[i, other] & ~coupled[j, other]
            for one in (a, b):
                plane &= _same(one[i, i], one[j, j]) & _same(one[i, j], -one[j, i])
            if plane.any():
                self._begin_plane(np.flatnonzero(plane), (i, j), other, places, a, b, velocity, pull)
                left &= ~plane
        rest = np.flatnonzero(left)
        if len(rest):
            self._begin_others(rest, places, k, d, form.mass[which], velocity, pull)

    def _keep(self, places: Rows, start: Array, frame: int) -> None:
        self.arrays["start"][: len(start), places] = start
        self.arrays["frame"][0, places] = frame

    def _begin_apart(self, which: Rows, places: Rows, a: Wide, b: Wide, velocity: Wide, pull: Wide) -> None:
        none = Wide(np.zeros(len(which)))
        for axis in range(3):
            numbers = self.table.numbers_of(a[axis, axis, which], b[axis, axis, which], none, none)
            self.arrays["modes"][axis, places[which]] = numbers
        self._keep(places[which], np.concatenate([velocity.high[:, which], pull.high[:, which]]), 0)

    def _begin_plane(
        self,
        which: Rows,
        plane: tuple[int, int],
        other: int,
        places: Rows,
        a: Wide,
        b: Wide,
        velocity: Wide,
        pull: Wide,
    ) -> None:
        i, j = plane
        own = [one[:, :, which] for one in (a, b)]
        across = self.table.numbers_of(own[0][i, i], own[1][i, i], own[0][j, i], own[1][j, i])
        none = Wide(np.zeros(len(which)))
        along = self.table.numbers_of(own[0][other, other], own[1][other, other], none, none)
        for axis, numbers in ((i, across), (j, across), (other, along)):
            self.arrays["modes"][axis, places[which]] = numbers
        self._keep(
            places[which], np.concatenate([velocity.high[:, which], pull.high[:, which]]), self._frame(plane, None)
        )

    def _begin_others(
        self, which: Rows, places: Rows, k: Wide, d: Wide, mass: Array, velocity: Wide, pull: Wide
    ) -> None:
        alike: dict[object, list[int]] = {}
        for local in which.tolist():
            key = (k[:, :, local].key(), d[:, :, local].key(), float(mass[local]))
            alike.setdefault(key, []).append(local)
        for numbers_alike, members in alike.items():
            at = np.array(members, dtype=np.int64)
            one = members[0]
            flow = self._flow(numbers_alike, k[:, :, one], d[:, :, one], np.full(3, mass[one]))
            start = flow.begin(velocity[:, at], pull[:, at])
            if isinstance(flow, ModalFlow):
                numbers, plane = _numbers_in(self.table, flow.modes)
                self.arrays["modes"][:, places[at]] = numbers[:, None]
                self._keep(places[at], start, self._frame(plane, flow))
            else:
                self._keep(places[at], start, self._frame((), flow))

    def _frame(self, plane: tuple[int, ...], flow: Flow | None) -> int:
        basis = flow.basis.high if isinstance(flow, ModalFlow) and not flow.plain else None
        carried = None if isinstance(flow, ModalFlow) else flow
        key = plane, None if basis is None else basis.tobytes(), id(carried) if carried is not None else None
        if key not in self._frames:
            self._frames[key] = len(self.frames)
            self.frames.append(Frame(plane, basis, carried))
        return self._frames[key]

    # Following

    def after(self, places: Rows, spans: Pair) -> Pair:
        """Ways [m] and velocities [m/s] of the rows at ``places`` after ``spans`` [s], (3, places); not finite where they are too large."""
        with np.errstate(all="ignore"):
            return self._after(places, spans)

    def _after(self, places: Rows, spans: Pair) -> Pair:
        way, speed = np.empty((3, len(places))), np.empty((3, len(places)))
        groups = self.arrays["group"][0, places]
        if not self.groups or not groups.any():
            return self._alone_after(places, spans)
        alone = np.flatnonzero(groups == 0.0)
        if len(alone):
            way[:, alone], speed[:, alone] = self._alone_after(places[alone], (spans[0][alone], spans[1][alone]))
        member = self.arrays["member"][0, places].astype(np.int64)
        for k in np.flatnonzero(groups).tolist():
            found = self.groups[int(groups[k]) - 1].after((float(spans[0][k]), float(spans[1][k])))
            way[:, k], speed[:, k] = found[0][:, member[k]], found[1][:, member[k]]
        return way, speed

    def _alone_after(self, places: Rows, spans: Pair) -> Pair:
        frames = self.arrays["frame"][0, places]
        if len(frames) and bool((frames == frames[0]).all()):
            return self._in_frame(self.frames[int(frames[0])], places, spans)
        way, speed = np.empty((3, len(places))), np.empty((3, len(places)))
        for frame in np.unique(frames).tolist():
            which = np.flatnonzero(frames == frame)
            found = self._in_frame(self.frames[int(frame)], places[which], (spans[0][which], spans[1][which]))
            way[:, which], speed[:, which] = found
        return way, speed

    def _in_frame(self, frame: Frame, places: Rows, spans: Pair) -> Pair:
        start = self.arrays["start"][:, places]
        if frame.flow is not None:
            each = list(zip(spans[0].tolist(), spans[1].tolist(), strict=True))
            return frame.flow.end(start, each, np.empty((3, 0, len(each)), dtype=complex))
        numbers = self.arrays["modes"][:, places].astype(np.int64)
        push, pull = start[:3], start[3:6]
        way, speed = np.empty_like(push), np.empty_like(push)
        last: int | None = None
        for axis in range(3):
            if axis in frame.plane:
                continue
            if last is None or not np.array_equal(numbers[axis], numbers[last]):
                found = self.table.at(numbers[axis], spans)
            last = axis
            s, rate, t = found[0], found[2], found[4]
            if not np.isfinite(rate).all():  # grown beyond all bounds: but of nothing comes nothing
                still = (push[axis] == 0.0) & (pull[axis] == 0.0)
                s, rate, t = (np.where(still, 0.0, one) for one in (s, rate, t))
            way[axis] = s * push[axis] + t * pull[axis]
            speed[axis] = rate * push[axis] + s * pull[axis]
        if frame.plane:
            i, j = frame.plane
            found = self.table.at(numbers[i], spans)
            for out, one, other in ((way, found[0:2], found[4:6]), (speed, found[2:4], found[0:2])):
                out[i] = (one[0] * push[i] - one[1] * push[j]) + (other[0] * pull[i] - other[1] * pull[j])
                out[j] = (one[0] * push[j] + one[1] * push[i]) + (other[0] * pull[j] + other[1] * pull[i])
        if frame.basis is None:
            return way, speed
        w = frame.basis
        turned = [w[:, :1] * one[:1] + w[:, 1:2] * one[1:2] + w[:, 2:3] * one[2:3] for one in (way, speed)]
        return turned[0], turned[1]

    def work(self, places: Rows, spans: Pair, mass: Array) -> Array:
        """Work [J] of forces without potential on the rows at ``places``; that on a group stands with its first row.

        It is what kinetic and potential energy gained, formed of differences before they are small: exact up to a few units of the last
        place of the energies that were exchanged.
        """
        found = np.zeros(len(places))
        if self.works:
            with np.errstate(all="ignore"):
                self._add_work(found, places, spans, mass)
        return found

    def _add_work(self, found: Array, places: Rows, spans: Pair, mass: Array) -> None:
        groups = self.arrays["group"][0, places]
        alone = np.flatnonzero(groups == 0.0)
        if len(alone):
            own = places[alone]
            way, speed = self._alone_after(own, (spans[0][alone], spans[1][alone]))
            before = self.arrays["speed"][:, own]
            gained = 0.5 * mass[alone] * ((speed - before) * (speed + before)).sum(axis=0)
            slopes = self.arrays["held"][:, own].reshape(3, 3, -1)
            given = ((self.arrays["pull"][:, own] + 0.5 * (slopes * way[None]).sum(axis=1)) * way).sum(axis=0)
            found[alone] = gained - given
        first = self.arrays["member"][0, places] == 0.0
        for k in np.flatnonzero((groups > 0.0) & first).tolist():
            group = self.groups[int(groups[k]) - 1]
            found[k] = group.work((float(spans[0][k]), float(spans[1][k])))


def _same(a: Wide, b: Wide) -> NDArray[np.bool_]:
    found: NDArray[np.bool_] = (a.high == b.high) & (a.low == b.low)
    return found


def _numbers_in(table: ModeTable, modes: Sequence[Mode]) -> tuple[NDArray[np.int64], tuple[int, ...]]:
    """The numbers of ``modes`` by coordinate, and which two coordinates are one."""
    numbers, plane = np.zeros(3, dtype=np.int64), ()
    for mode in modes:
        a, b = mode.constants[:2]
        parts = [Wide(np.array([one[0]]), np.array([one[1]])) for one in (a[0], b[0], a[1], b[1])]
        numbers[list(mode.places)] = table.numbers_of(*parts)[0]
        if len(mode.places) == 2:
            plane = mode.places  # type: ignore[assignment]
    return numbers, plane
