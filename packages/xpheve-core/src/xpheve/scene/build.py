"""From a scene file to an engine: read, checked whole, and only then handed out."""

from __future__ import annotations

import itertools
import math
import os
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xpheve
from xpheve.errors import SceneError, XpheveError, XpheveWarning
from xpheve.forces import Force
from xpheve.laws import LawContainer, PairLaw, PhysicalLaw, conditions
from xpheve.objects import FIELDS, PhysicalObject
from xpheve.scene.model import SHAPES, ConditionTable, LawTable, ObjectTable, RunTable, check_scene, near
from xpheve.scene.names import Names
from xpheve.scene.paths import inside
from xpheve.scene.quantities import number
from xpheve.scene.source import Path_, Source, read_source, show
from xpheve.shapes import Box, Capsule, Plane, Shape, Sphere

if TYPE_CHECKING:
    from xpheve.engine import PhysicsEngine
    from xpheve.plugins.registry import Registry

CORE_SHAPES: dict[str, type[Shape]] = {"sphere": Sphere, "box": Box, "capsule": Capsule, "plane": Plane}
assert CORE_SHAPES.keys() == SHAPES.keys()

CONDITIONS: dict[str, type[conditions.Condition]] = {
    kind.__name__: kind
    for kind in vars(conditions).values()
    if isinstance(kind, type) and issubclass(kind, conditions.Condition) and kind is not conditions.Condition
}

UNIT_LENGTH = 1e-14  # |q|^2 this near to 1 is rounding of a run and kept to the bit; what people round off is farther
SHOWN = 8  # names in an error


def read(path: str | os.PathLike[str], *, allow_outside: bool = False) -> SceneFile:
    """Return the scene file ``path``, its tables checked; no pack is imported before `SceneFile.build`.

    Raises
    ------
    SceneError
        For the first thing that is wrong, with file, line, key, value and the way out.
    """
    return SceneFile(read_source(path), Path(path).parent, allow_outside=allow_outside)


def load(
    path: str | os.PathLike[str],
    *,
    registry: Registry | None = None,
    disable: Sequence[str] = (),
    on_law_error: str = "raise",
    allow_outside: bool = False,
) -> PhysicsEngine:
    """Return an engine with the scene in the file ``path``, TOML or JSON by its ending; at time 0.

    Parameters
    ----------
    registry, disable, on_law_error
        For the engine; see `xpheve.PhysicsEngine`.
    allow_outside
        Whether the scene may name paths outside its folder.

    Raises
    ------
    SceneError
        For the first thing that is wrong, with file, line, key, value and the way out; nothing has been built then.
    """
    scene = read(path, allow_outside=allow_outside)
    return scene.build(registry=registry, disable=disable, on_law_error=on_law_error)


def loads(
    text: str,
    form: str = "toml",
    *,
    name: str = "scene",
    folder: str | os.PathLike[str] = ".",
    registry: Registry | None = None,
    disable: Sequence[str] = (),
    on_law_error: str = "raise",
    allow_outside: bool = False,
) -> PhysicsEngine:
    """As `load`, of a text; ``form`` is ``"toml"`` or ``"json"``, ``name`` stands in errors."""
    if form not in ("toml", "json"):
        raise SceneError(f"form = {form!r}: choose 'toml' or 'json'")
    scene = SceneFile(Source(text, name, form), Path(folder), allow_outside=allow_outside)
    return scene.build(registry=registry, disable=disable, on_law_error=on_law_error)


class SceneFile:
    """A scene file whose tables are sound; ``run`` holds its settings for a run, ``record`` the path of its record."""

    def __init__(self, source: Source, folder: Path, *, allow_outside: bool = False) -> None:
        self.source = source
        self.table = check_scene(source)
        self.run: RunTable = self.table.run
        self.record: Path | None = None
        if self.run.record is not None:
            try:
                self.record = inside(folder, self.run.record, allow_outside=allow_outside)
            except SceneError as wrong:
                raise source.wrong(("run", "record"), str(wrong)) from None

    def build(
        self,
        *,
        registry: Registry | None = None,
        disable: Sequence[str] = (),
        on_law_error: str = "raise",
        without: Sequence[str] = (),
    ) -> PhysicsEngine:
        """Return an engine with the scene, at time 0; laws whose name or id is in ``without`` are left out.

        Raises `SceneError`, also for what a pack finds wrong.
        """
        return _Building(self.source, self.table, registry, disable, on_law_error, without).engine


class _Building:
    """One engine in the making."""

    def __init__(
        self,
        source: Source,
        table: Any,
        registry: Registry | None,
        disable: Sequence[str],
        on_law_error: str,
        without: Sequence[str],
    ) -> None:
        self.source = source
        self.table = table
        self.law_names = self._names("laws")
        self.object_names = self._names("objects")
        self.container_names = self._names("containers")
        self.left_out = self._left_out(without)
        with self._blame(()):
            self.engine = xpheve.PhysicsEngine(
                up=table.up, seed=table.seed, registry=registry, disable=disable, on_law_error=on_law_error
            )
        self.registry = self.engine.registry
        self.unnamed: dict[Any, LawContainer] = {}
        self.containers = [self._container(place) for place in range(len(table.containers))]
        self.laws: list[PhysicalLaw | None] = [self._law(place) for place in range(len(table.laws))]
        self.mapped = self._mapping()
        self.objects = [self._object(place) for place in range(len(table.objects))]
        self._add_objects()
        self._set_between()
        self._add_forces()

    # Errors and names

    @contextmanager
    def _blame(self, path: Path_) -> Iterator[None]:
        """Turn what goes wrong inside, whatever a pack's code raises, into a `SceneError` that names ``path``."""
        try:
            yield
        except SceneError:
            raise
        except Exception as wrong:
            text = str(wrong) if isinstance(wrong, XpheveError) else f"{type(wrong).__name__}: {wrong}"
            where = self.source.name if not path else self.source.at(self._nearest(path, text))
            raise SceneError(f"{where}: {text}") from wrong

    def _nearest(self, path: Path_, text: str) -> Path_:
        """Return the key of the table at ``path`` that ``text`` speaks of, if it does."""
        table = self.source.value(path)
        for key in table if isinstance(table, dict) else ():
            if re.search(rf"(^|[ .]){re.escape(key)}( =|:| is)", text):
                return (*path, key)
        return path

    def _names(self, kind: str) -> Names:
        names = Names([(row.name, getattr(row, "id", "")) for row in getattr(self.table, kind)])
        if names.twice:
            first, second = names.twice[0]
            line = self.source.line((kind, first, "name"))
            raise self.source.wrong(
                (kind, second, "name"),
                f"line {line} has this name already; names are unique, choose another",
            )
        return names

    def _find(self, names: Names, word: str, path: Path_, kind: str) -> int:
        place = names.find(word)
        if place >= 0:
            return place
        owner, rest = self.source.owner(path)
        lead = ": ".join(part for part in (self.source.at(path), owner, rest) if part)
        if place == -2:
            raise SceneError(
                f'{lead}: several {kind}s here are {show(word)}: give them names, or count: "{word}#1", "{word}#2", ...'
            )
        known = names.known()
        hand = ", ".join(known[:SHOWN]) + (", ..." if len(known) > SHOWN else "")
        raise SceneError(
            f"{lead}: no {kind} of this file is called {show(word)}.{near(word, known)} At hand: {hand or 'none'}"
        )

    def _left_out(self, without: Sequence[str]) -> set[int]:
        found: set[int] = set()
        for word in without:
            places = [place for place, row in enumerate(self.law_names.rows) if word in row]
            if not places:
                known = self.law_names.known()
                raise SceneError(
                    f"{self.source.name}: no law of this file is called {show(word)}, so it cannot be left out."
                    f"{near(word, known)} At hand: {', '.join(known[:SHOWN]) or 'none'}"
                )
            found.update(places)
        return found

    # Containers and conditions

    def _condition(self, table: ConditionTable | None, path: Path_) -> conditions.Condition | None:
        if table is None:
            return None
        kind = CONDITIONS.get(table.kind)
        if kind is None:
            raise self.source.wrong(
                (*path, "kind"),
                f"no condition is called so.{near(table.kind, CONDITIONS)} Conditions: {', '.join(CONDITIONS)}",
            )
        declared = {field.name: str(field.type) for field in fields(kind)}
        given: dict[str, Any] = {}
        for key, value in (table.model_extra or {}).items():
            if key not in declared:
                keys = ["kind", *declared]
                raise self.source.error((*path, key), f"unknown key.{near(key, keys)} Keys here: {', '.join(keys)}")
            try:
                given[key] = _plain(value, declared[key])
            except ValueError as wrong:
                raise self.source.wrong((*path, key), str(wrong)) from None
        for field in fields(kind):
            if field.name == "seconds" and "seconds" not in given:
                raise self.source.error(path, f"the key seconds is missing: {kind.__name__} waits for a length of time")
        with self._blame(path):
            return kind(**given)

    def _container_class(self, id: str, path: Path_) -> type[LawContainer]:
        if not id:
            return LawContainer
        with self._blame(path):
            return self.registry.container(id)

    def _container(self, place: int) -> LawContainer:
        table, path = self.table.containers[place], ("containers", place)
        kind = self._container_class(table.id, (*path, "id"))
        condition = self._condition(table.condition, (*path, "condition"))
        with self._blame(path):
            made = kind(condition, name=table.name) if table.name else kind(condition)
            for key, value in table.parameters.items():
                made.set_parameter(key, value)
            return self.engine.add_container(made)

    def _shared(self, kind: type[LawContainer], condition: conditions.Condition | None, path: Path_) -> LawContainer:
        """Return the container without a name of this kind and condition; laws of one condition share it."""
        key = (kind, condition if condition is not None else kind.condition)
        if key not in self.unnamed:
            with self._blame(path):
                self.unnamed[key] = kind(condition)
        return self.unnamed[key]

    def _containers_of(self, law: PhysicalLaw, table: LawTable, path: Path_) -> list[LawContainer]:
        """Return the containers that the file names for ``law``; empty for the law's own default."""
        condition = self._condition(table.condition, (*path, "condition"))
        if table.container is None:
            if condition is None:
                return []
            kind = self._container_class(law.container, path)
            return [self._shared(kind, condition, path)]
        found = []
        for word in table.container:
            where = (*path, "container")
            if self.container_names.find(word) < 0 and ":" in word and "#" not in word:
                kind = self._container_class(word, where)
                settled = condition is not None or kind.condition is not None or kind.detects()
                own = condition if settled else law.condition
                found.append(self._shared(kind, own, where))
                continue
            place = self._find(self.container_names, word, where, "container")
            if condition is not None:
                raise self.source.error(
                    (*path, "condition"), f"the container {show(word)} has a condition of its own; take one away"
                )
            found.append(self.containers[place])
        return found

    # Laws

    def _law(self, place: int) -> PhysicalLaw | None:
        if place in self.left_out:
            return None
        table, path = self.table.laws[place], ("laws", place)
        with self._blame((*path, "id")):
            kind = self.registry.law(table.id)
        parameters = self._parameters(kind, table, path)
        if table.between is not None and not issubclass(kind, PairLaw):
            raise self.source.error(
                (*path, "between"), f"{table.id} acts on single objects, so it takes no between; name it in their laws"
            )
        with self._blame(path):
            law = kind(name=table.name, enabled=table.enabled, **parameters)
        containers = self._containers_of(law, table, path)
        with self._blame(path):
            self.engine.add_law(law, container=containers[0] if containers else None)
            for container in containers[1:]:
                self.engine.add_container(container).add_law(law)
        return law

    def _parameters(self, kind: type[PhysicalLaw], table: LawTable, path: Path_) -> dict[str, Any]:
        """Return the parameters of a law, as `Param.check` makes them."""
        found: dict[str, Any] = {}
        for key, value in (table.model_extra or {}).items():
            where = (*path, key)
            param = kind.params.get(key)
            if param is None:
                own = [name for name in LawTable.model_fields if name != "id"]
                at, owner = self.source.at(where), self.source.owner(where)[0]
                hint = near(key, [*kind.params, *own])
                has = ", ".join(kind.params) or "none"
                raise SceneError(f"{at}: {owner}: unknown parameter {key}.{hint} It has: {has}")
            if value == "none" and param.optional and param.kind != "text":
                found[key] = None
                continue
            with self._blame(where):
                found[key] = param.check(value, kind.label())
        return found

    # Objects

    def _mapping(self) -> list[tuple[int, ...]]:
        """For each object the places of the laws it obeys, those that name it in ``between`` last."""
        mapped: list[dict[int, None]] = []
        for place, table in enumerate(self.table.objects):
            row: dict[int, None] = {}
            for k, word in enumerate(table.laws):
                found = self._find(self.law_names, word, ("objects", place, "laws", k), "law")
                if found not in self.left_out:
                    row[found] = None
            mapped.append(row)
        self.between: dict[int, tuple[list[int], list[int]]] = {}
        for place, law in enumerate(self.table.laws):
            if law.between is None:
                continue
            sides: tuple[list[int], list[int]] = ([], [])
            for k, side in enumerate(law.between):
                for word in side:
                    sides[k].append(self._find(self.object_names, word, ("laws", place, "between"), "object"))
            if place not in self.left_out:
                self.between[place] = sides
                for obj in (*sides[0], *sides[1]):
                    mapped[obj][place] = None
        return [tuple(row) for row in mapped]

    def _object(self, place: int) -> PhysicalObject:
        table, path = self.table.objects[place], ("objects", place)
        shape = None if table.shape is None else self._shape(table.shape, (*path, "shape"))
        columns = self._columns(place, table)
        with self._blame(path):
            obj = PhysicalObject(
                shape,
                name=table.name,
                mass=table.mass,
                density=table.density,
                position=table.position,
                velocity=table.velocity,
                orientation=table.orientation,
                angular_velocity=table.angular_velocity,
                inertia=table.inertia,
                fixed=table.fixed,
                **columns,
            )
        _keep_bits(obj, table)
        return obj

    def _shape(self, table: Any, path: Path_) -> Shape:
        given = {key: getattr(table, key) for key in type(table).model_fields if key != "kind"}
        if table.kind in CORE_SHAPES:
            kind: type[Shape] = CORE_SHAPES[table.kind]
        else:
            with self._blame((*path, "kind")):
                kind = self.registry.find("shape", table.kind)
            given = dict(table.model_extra or {})
        with self._blame(path):
            shape = kind(**given)
        if isinstance(shape, Plane) and table.kind == "plane" and table.normal is not None:
            if abs(math.fsum(x * x for x in table.normal) - 1.0) <= UNIT_LENGTH:
                shape.normal = table.normal
        return shape

    def _columns(self, place: int, table: ObjectTable) -> dict[str, float]:
        found: dict[str, float] = {}
        laws = [law for k in self.mapped[place] if (law := self.laws[k]) is not None]
        for name, value in table.columns.items():
            path = ("objects", place, "columns", name)
            if name in (*FIELDS, "shape", "fixed", "name", "density", "laws", "forces"):
                raise self.source.error(path, f"{name} is no column: write it into the object's own table")
            declared = [law.columns[name] for law in laws if name in law.columns]
            if not declared:
                self._warn_of_column(path, name)
                if isinstance(value, str):
                    said = "no law of this object declares the column, so a unit says nothing; give a number"
                    raise self.source.wrong(path, said)
            try:
                found[name] = number(value, declared[0].unit if declared else "1")
            except ValueError as wrong:
                raise self.source.wrong(path, str(wrong)) from None
            for column in declared:
                with self._blame(path):
                    column.check(
                        found[name], f"object {show(table.name)}" if table.name else f"object {place + 1}", name
                    )
        return found

    def _warn_of_column(self, path: Path_, name: str) -> None:
        declared = {column for law in self.laws if law is not None for column in law.columns}
        hint = "" if name in declared else near(name, declared)
        if hint:
            owner, rest = self.source.owner(path)
            text = f"{self.source.at(path)}: {owner}: {rest}: no law of this scene reads this column.{hint}"
            warnings.warn(text, XpheveWarning, stacklevel=2)

    def _add_objects(self) -> None:
        places = range(len(self.objects))
        for mapped, group in itertools.groupby(places, key=self.mapped.__getitem__):
            members = list(group)
            laws = [law for k in mapped if (law := self.laws[k]) is not None]
            with self._blame(("objects", members[0], "laws")):
                self.engine.add_objects([self.objects[place] for place in members], laws)

    def _set_between(self) -> None:
        for place, sides in self.between.items():
            law = self.laws[place]
            assert isinstance(law, PairLaw)
            these, those = (tuple(self.objects[k] for k in side) for side in sides)
            law.between = (these, those)

    def _add_forces(self) -> None:
        for place, table in enumerate(self.table.objects):
            for k, one in enumerate(table.forces):
                with self._blame(("objects", place, "forces", k)):
                    duration = math.inf if one.duration is None else one.duration
                    self.objects[place].add_force(Force(one.vector, duration, one.id, torque=one.torque))


def _plain(value: Any, kind: str) -> Any:
    """``value`` for a field of a condition whose annotation is ``kind``; ValueError says what is needed."""
    if kind == "float":
        return number(value, "s")
    wanted: dict[str, tuple[Any, str]] = {
        "bool": (bool, "true or false is needed"),
        "int": (int, "a whole number is needed"),
        "str": (str, "a text is needed"),
    }
    types, message = wanted.get(kind, ((int, str), "a whole number or a text is needed"))
    if not isinstance(value, types) or (kind != "bool" and isinstance(value, bool)):
        raise ValueError(message)
    return value


def _keep_bits(obj: PhysicalObject, table: ObjectTable) -> None:
    """Give ``obj`` the very bits of the file: signs of zeros, and a unit quaternion as a run left it."""
    own = obj._own
    for name in ("position", "velocity", "angular_velocity"):
        own[name] = getattr(table, name)
    if isinstance(table.inertia, tuple):
        own["inertia"] = table.inertia
    if abs(math.fsum(x * x for x in table.orientation) - 1.0) <= UNIT_LENGTH:
        own["orientation"] = table.orientation
