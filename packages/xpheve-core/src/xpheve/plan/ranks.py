"""Ranks: an order of objects, laws and containers that does not depend on the order in which they were put in."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from xpheve.bodies import AUTHORED_WIDTHS, STATE_WIDTHS, Bodies
from xpheve.laws import LawContainer, PhysicalLaw
from xpheve.objects import PhysicalObject
from xpheve.plan.mapping import Mapping


class Ranks:
    """Ranks as whole numbers: frozen at the first plan after adding, so that what is added later comes after."""

    def __init__(self) -> None:
        self.epoch = 0
        self.law_ranks: dict[PhysicalLaw, int] = {}
        self.container_ranks: dict[LawContainer, int] = {}
        self.next_object = 0
        self._next = 0

    def freeze_laws(self, laws: Iterable[PhysicalLaw], serials: dict[PhysicalLaw, int]) -> None:
        """Rank the laws that have no rank: named first, then by name or id and parameters, then as added."""
        new = [law for law in laws if law not in self.law_ranks]
        new.sort(key=lambda law: (not law.name, law.name, law.label(), repr(law.parameters), serials[law]))
        for law in new:
            self.law_ranks[law] = self._take()

    def freeze_containers(self, containers: Iterable[LawContainer]) -> None:
        """Rank containers by name, id, condition and the ranks of their laws."""
        new = [container for container in containers if container not in self.container_ranks]
        new.sort(
            key=lambda c: (
                not c.name,
                c.name,
                c.label(),
                str(c.condition),
                [self.law_ranks.get(law, -1) for law in c.laws],
            )
        )
        for container in new:
            self.container_ranks[container] = self._take()

    def _take(self) -> int:
        self._next += 1
        return self._next

    def freeze_objects(self, objects: Sequence[PhysicalObject], bodies: Bodies, mapping: Mapping) -> None:
        """Rank new objects: named first, then by name or the bytes of their state, columns, shape and laws, then as added."""
        if not objects:
            return
        rows = np.array([obj._row for obj in objects])
        names = (*STATE_WIDTHS, *AUTHORED_WIDTHS)
        state = np.concatenate([bodies.arrays[name][:, rows] for name in names]).T.copy()
        shapes: dict[int, str] = {}
        keys = []
        for obj, values in zip(objects, state, strict=True):
            shape = shapes.get(id(obj.shape))
            if shape is None:
                shape = shapes[id(obj.shape)] = repr(obj.shape)
            laws = sorted(self.law_ranks[law] for law in mapping.laws(obj))
            columns = sorted(obj._columns.items()) if obj._columns else []
            keys.append((not obj.name, obj.name, values.tobytes(), columns, shape, laws, obj._driven, obj.serial))
        for k in sorted(range(len(objects)), key=keys.__getitem__):
            objects[k].rank = self.next_object
            self.next_object += 1
