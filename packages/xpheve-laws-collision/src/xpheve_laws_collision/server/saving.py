"""Saving, restoring and reporting what the server keeps between instants."""

from __future__ import annotations

from typing import Any

from xpheve.events import AFTER, IMPACT
from xpheve_laws_collision.narrow_phase import Gap
from xpheve_laws_collision.server.pairs import Support
from xpheve_laws_collision.server.prediction import Prediction


class Saving(Prediction):
    """Tables as plain values, objects as serial numbers."""

    def save(self) -> dict[str, Any]:
        def pairs(table: Any) -> list[list[int]]:
            return [[a.serial, b.serial] for a, b in table]

        return {
            "touching": pairs(self.touching),
            "inside": pairs(self.inside),
            "begun": [[*self.touching.values()], [*self.inside.values()]],
            "supports": [[ball.serial, s.plane.serial, s.outward] for ball, s in self.supports.items()],
            "held": [obj.serial for obj in self.held],
            "collapsing": [[a.serial, b.serial, end, seen] for (a, b), (end, seen) in self.collapsing.items()],
            "streaks": [[obj.serial, count, last, other] for obj, (count, last, other) in self.streaks.items()],
            "told": [[a.serial, b.serial, when] for (a, b), when in self.told.items()],
            "parting": [[a.serial, b.serial, list(gap), speed] for (a, b), gap, speed in self.parting],
            "counts": [self.impacts, self.generations],
        }

    def restore(self, saved: dict[str, Any]) -> None:
        by = {obj.serial: obj for obj in self.world.bodies.objects}
        self.touching, self.inside = (
            {(by[a], by[b]): tuple(since) for (a, b), since in zip(saved[name], begun, strict=True)}
            for name, begun in zip(("touching", "inside"), saved["begun"], strict=True)
        )
        self.supports = {by[ball]: Support(by[plane], tuple(n)) for ball, plane, n in saved["supports"]}
        self.held = {by[serial]: None for serial in saved["held"]}
        self.collapsing = {}
        for a, b, end, seen in saved["collapsing"]:
            pair = (by[a], by[b])
            mover = pair[0] if pair[1].fixed else pair[1]
            self.collapsing[pair] = (tuple(end), seen)
            self.world.schedule(tuple(end), IMPACT, (pair[0].rank, pair[1].rank), self._settle, ((mover, seen),))
        self.streaks = {by[serial]: (count, tuple(last), other) for serial, count, last, other in saved["streaks"]}
        self.impacts, self.generations = saved["counts"]
        self.told = {(by[a], by[b]): tuple(instant) for a, b, instant in saved["told"]}
        for a, b, gap, speed in saved["parting"]:
            values: list[Any] = [tuple(value) if isinstance(value, list) else value for value in gap]
            self.parting.append(((by[a], by[b]), Gap(*values), speed))
        if self.parting:
            self.world.schedule(self.world.time, AFTER, (1,), self._part)

    def report(self) -> dict[str, Any]:
        return {
            "impacts": self.impacts,
            "generations": self.generations,
            "predictions": self.predictions,
            "touching": [f"{a.label} - {b.label}" for a, b in self.touching],
            "supports": [f"{ball.label} on {support.plane.label}" for ball, support in self.supports.items()],
            "held": [obj.label for obj in self.held],
            "windows": self.curves.windows,
            "parabolas": self._on_parabolas(),
            "impact loop": self.fleet.report(),
            "told": self.fleet.told(),
        }

    def _on_parabolas(self) -> list[str]:
        """Who flies along parabolas only because contacts are looked for, and why."""
        objects = self.world.bodies.objects
        found = []
        for batch in self.world.batches:
            for row in batch.state.rows.tolist() if batch.signature.contacts else ():
                reason = self.parabolas(objects[row])
                if reason:
                    found.append(f"{objects[row].label}: {reason}")
        return sorted(found)
