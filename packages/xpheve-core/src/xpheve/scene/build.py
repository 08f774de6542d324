"""From a scene file to an engine: read, checked whole, and only then handed out."""

from __future__ import annotations

import itertools
import math
import os
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xpheve
from xpheve.errors import SceneError, XpheveError, XpheveWarning
from xpheve.forces import Force
from xpheve.laws import LawContainer, PairLaw, PhysicalLaw, ResponseLaw, conditions
from xpheve.laws.conditions.text import TextExpression
from xpheve.objects import FIELDS, PhysicalObject
from xpheve.observers import Observer, Probe
from xpheve.scene.hold import UNIT_LENGTH, take_hold
from xpheve.scene.model import SHAPES, ConditionTable, LawTable, ObjectTable, RunTable, check_scene, near
from xpheve.scene.names import Names
from xpheve.scene.paths import inside
from xpheve.scene.quantities import number
from xpheve.scene.source import Path_, Source, clip, read_source, show
from xpheve.scene.wakeups import CONDITIONS, KEYS, make_point, read_region, required
from xpheve.shapes import CORE as CORE_SHAPES
from xpheve.shapes import Compound, Hull, Part, Plane, Shape

if TYPE_CHECKING:
    from xpheve.engine import PhysicsEngine
    from xpheve.plugins.registry import Registry

assert CORE_SHAPES.keys() == SHAPES.keys()

LONGEST_TEXT = 2000  # characters of an error; a file may name things that have thousands
SHORTEST_PERIOD = 1e-9  # [s] a clock that ticks faster is a slip of the pen, and its run would not end in a lifetime
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
    compile: str | None = None,
    allow_outside: bool = False,
) -> PhysicsEngine:
    """Return an engine with the scene in the file ``path``, TOML or JSON by its ending; at time 0.

    Parameters
    ----------
    registry, disable, on_law_error, compile
        For the engine; see `xpheve.PhysicsEngine`. ``compile`` goes before what the scene says.
    allow_outside
        Whether the scene may name paths outside its folder.

    Raises
    ------
    SceneError
        For the first thing that is wrong, with file, line, key, value and the way out; nothing has been built then.
    """
    scene = read(path, allow_outside=allow_outside)
    return scene.build(registry=registry, disable=disable, on_law_error=on_law_error, compile=compile)


def loads(
    text: str,
    form: str = "toml",
    *,
    name: str = "scene",
    folder: str | os.PathLike[str] = ".",
    registry: Registry | None = None,
    disable: Sequence[str] = (),
    on_law_error: str = "raise",
    compile: str | None = None,
    allow_outside: bool = False,
) -> PhysicsEngine:
    """As `load`, of a text; ``form`` is ``"toml"`` or ``"json"``, ``name`` stands in errors."""
    if form not in ("toml", "json"):
        raise SceneError(f"form = {form!r}: choose 'toml' or 'json'")
    scene = SceneFile(Source(text, name, form), Path(folder), allow_outside=allow_outside)
    return scene.build(registry=registry, disable=disable, on_law_error=on_law_error, compile=compile)


class SceneFile:
    """A scene file whose tables are sound; ``run`` holds its settings for a run, ``record`` the path of its record."""

    def __init__(self, source: Source, folder: Path, *, allow_outside: bool = False) -> None:
        self.source = source
        self.table = check_scene(source)
        self.run: RunTable = self.table.run
        self.folder, self.allow_outside = folder, allow_outside
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
        compile: str | None = None,
    ) -> PhysicsEngine:
        """Return an engine with the scene, at time 0; laws whose name or id is in ``without`` are left out.

        ``compile`` goes before what the scene says.

        Raises `SceneError`, also for what a pack finds wrong.
        """

        def place(text: str) -> Path:
            return inside(self.folder, text, allow_outside=self.allow_outside)

        return _Building(self.source, self.table, registry, disable, on_law_error, without, place, compile).engine


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
        place: Callable[[str], Path],
        compile: str | None,
    ) -> None:
        self.source = source
        self.place_of = place
        self.files: dict[tuple[Any, ...], Shape] = {}
        self.table = table
        self.law_names = self._names("laws")
        self.object_names = self._names("objects")
        self.container_names = self._names("containers")
        self.left_out = self._left_out(without)
        with self._blame(()):
            self.engine = xpheve.PhysicsEngine(
                up=table.up,
                seed=table.seed,
                compile=compile or table.compile,
                stepper=table.stepper,
                **({} if table.periodic is None else {"periodic": table.periodic}),
                registry=registry,
                disable=disable,
                on_law_error=on_law_error,
            )
        self.registry = self.engine.registry
        self.unnamed: dict[Any, LawContainer] = {}
        self.laws: list[PhysicalLaw | None] = []
        # Conditions name objects, and what columns mean is said by laws: so objects first, their columns last.
        self.mapped = self._mapping()
        self.objects = [self._object(place) for place in range(len(table.objects))]
        self.points = self._points()
        self.containers = [self._container(place) for place in range(len(table.containers))]
        self.laws += [self._law(place) for place in range(len(table.laws))]
        self._set_columns()
        self._add_objects()
        self._add_points()
        self._set_between()
        self._add_forces()
        self._drive()
        self.engine._world.force_ids.given(table.force_ids)

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
            raise SceneError(f"{where}: {clip(text, LONGEST_TEXT)}") from wrong

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
        declared = {KEYS.get(field.name, field.name): str(field.type) for field in fields(kind) if field.init}
        own = {key: name for name, key in KEYS.items()}
        given: dict[str, Any] = {}
        for key, value in (table.model_extra or {}).items():
            if key not in declared:
                keys = ["kind", *declared]
                raise self.source.error((*path, key), f"unknown key.{near(key, keys)} Keys here: {', '.join(keys)}")
            try:
                given[own.get(key, key)] = self._field(key, value, declared[key], (*path, key))
            except ValueError as wrong:
                if isinstance(wrong, SceneError):
                    raise
                raise self.source.wrong((*path, key), clip(str(wrong), LONGEST_TEXT)) from None
        for key in required(kind):
            if key not in given:
                said = (
                    f"{kind.__name__} waits for a length of time" if key == "seconds" else f"{kind.__name__} needs it"
                )
                raise self.source.error(path, f"the key {KEYS.get(key, key)} is missing: {said}")
        if given.get("every") and 0.0 < given.get("seconds", 1.0) < SHORTEST_PERIOD:
            raise self.source.wrong(
                (*path, "seconds"), f"a scene file's clocks tick at most once in {SHORTEST_PERIOD} s; give it longer"
            )
        with self._blame(path):
            return kind(*given.pop("of", ()), **given)

    def _field(self, key: str, value: Any, declared: str, path: Path_) -> Any:
        """The value of a condition's field; ValueError says what is needed."""
        if key == "of":
            if not isinstance(value, list) or not all(
                isinstance(one, dict) and isinstance(one.get("kind"), str) for one in value
            ):
                raise ValueError('a list of conditions is needed: [{ kind = "Posted" }, { kind = "Steps" }]')
            return [self._condition(ConditionTable(**one), (*path, k)) for k, one in enumerate(value)]
        if key == "region":
            return read_region(value)
        if key == "expression":
            if not isinstance(value, str):
                raise ValueError('text that says an expression of the body is needed, such as "body.position.z - 2.0"')
            return TextExpression(value)
        if key == "match":
            return value
        if key in ("obj", "a", "b", "probe"):
            if not isinstance(value, str):
                raise ValueError(
                    "the name of an object is needed" if key != "probe" else "the name of an object or probe is needed"
                )
            if key == "probe" and value in self.points:
                return self.points[value]
            return self.objects[self._find(self.object_names, value, path, "object")]
        return _plain(value, declared)

    def _points(self) -> dict[str, Probe]:
        """Observers and probes, in no engine yet."""
        found: dict[str, Probe] = {}
        for key, kind in (("observers", Observer), ("probes", Probe)):
            for place, table in enumerate(getattr(self.table, key)):
                path: Path_ = (key, place)
                attached = None
                if table.attached is not None:
                    if table.position is not None:
                        raise self.source.error(path, "give position or attached, not both")
                    attached = self.objects[
                        self._find(self.object_names, table.attached, (*path, "attached"), "object")
                    ]
                with self._blame(path):
                    found[table.name] = make_point(kind, table, attached)
        return found

    def _add_points(self) -> None:
        for key in ("observers", "probes"):
            for place, table in enumerate(getattr(self.table, key)):
                point = self.points[table.name]
                with self._blame((key, place)):
                    if isinstance(point, Observer):
                        self.engine.add_observer(point)
                    else:
                        self.engine.add_probe(point)

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
        if table.for_pairs is not None and not issubclass(kind, ResponseLaw):
            raise self.source.error(
                (*path, "for_pairs"), f"{table.id} answers no contacts, so that it takes no for_pairs"
            )
        if table.between is not None and not issubclass(kind, PairLaw):
            raise self.source.error(
                (*path, "between"), f"{table.id} acts on single objects, so it takes no between; name it in their laws"
            )
        if table.pairs is not None and not issubclass(kind, PairLaw):
            raise self.source.error(
                (*path, "pairs"), f"{table.id} acts on single objects, so it takes no pairs; name it in their laws"
            )
        if table.pairs is not None and table.between is not None:
            raise self.source.error((*path, "pairs"), "between says which pairs already; give one of the two")
        if table.one_sided and table.between is None:
            raise self.source.error(
                (*path, "one_sided"), "one_sided says who acts on whom: give between = [sources, targets] with it"
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
                raise SceneError(f"{at}: {owner}: unknown parameter {clip(key)}.{hint} It has: {has}")
            if value == "none" and param.optional and param.kind != "text":
                found[key] = None
                continue
            with self._blame(where):
                found[key] = param.check(value, kind.label())
        return found

    # Objects

    def _mapping(self) -> list[tuple[int, ...]]:
        """For each object the places of the laws it obeys, those that it names in ``between`` or ``pairs`` last."""
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
        self.pairs: dict[int, list[tuple[int, int]]] = {}
        for place, law in enumerate(self.table.laws):
            if law.pairs is not None:
                pairs = self._pairs_of(law.pairs, ("laws", place, "pairs"))
                if place not in self.left_out:
                    self.pairs[place] = pairs
                    for obj in (one for pair in pairs for one in pair):
                        mapped[obj][place] = None
        return [tuple(row) for row in mapped]

    def _pairs_of(self, pairs: Sequence[tuple[str, str]], path: Path_) -> list[tuple[int, int]]:
        """The places of the objects that ``pairs`` names; raises `SceneError` for a pair that is none, or comes twice."""
        found: dict[tuple[int, int], None] = {}
        for words in pairs:
            a, b = (self._find(self.object_names, word, path, "object") for word in words)
            both = " and ".join(map(show, words))
            if a == b:
                raise self.source.error(path, f"{both} are one object: two different objects are needed")
            if (a, b) in found or (b, a) in found:
                raise self.source.error(path, f"{both} are a pair already: give each pair once, in one order")
            found[a, b] = None
        return list(found)

    def _object(self, place: int) -> PhysicalObject:
        table, path = self.table.objects[place], ("objects", place)
        shape = None if table.shape is None else self._shape(table.shape, (*path, "shape"))
        with self._blame(path):
            obj = PhysicalObject(
                shape,
                name=table.name,
                mass=table.mass,
                density=table.density,
                position=table.position,
                velocity=table.velocity,
                orientation=table.orientation,
                pose=table.pose,
                angular_velocity=table.angular_velocity,
                inertia=table.inertia,
                fixed=table.fixed,
            )
        _keep_bits(obj, table)
        return obj

    def _set_columns(self) -> None:
        for place, table in enumerate(self.table.objects):
            for name, value in self._columns(place, table).items():
                with self._blame(("objects", place)):
                    self.objects[place][name] = value

    def _shape(self, table: Any, path: Path_) -> Shape:
        if table.kind == "compound":
            return self._compound(table, path)
        if table.kind in ("hull", "mesh"):
            return self._polyhedron(table, path)
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
                object.__setattr__(shape, "normal", table.normal)  # to the bit
        return shape

    def _compound(self, table: Any, path: Path_) -> Shape:
        parts = []
        for k, one in enumerate(table.parts):
            where = (*path, "parts", k)
            shape = self._shape(one.shape, (*where, "shape"))
            with self._blame(where):
                parts.append(Part(shape, one.position, one.orientation, one.density, pose=one.pose))
        with self._blame(path):
            return Compound(parts)

    def _polyhedron(self, table: Any, path: Path_) -> Shape:
        given = {key: value for key in type(table).model_fields if (value := getattr(table, key)) is not None}
        kind = CORE_SHAPES[given.pop("kind")]
        if table.file is None:
            scale = given.pop("scale", None)
            needed = ("points",) if kind is Hull else ("vertices", "faces")
            missing = [key for key in needed if key not in given]
            if missing:
                raise self.source.error(path, f'the key {missing[0]} is missing; or name a mesh file, file = "..."')
            with self._blame(path):
                made = kind(**given)
                return made if scale is None else made.scaled(scale)
        extra = sorted(given.keys() - {"file", "solid", "scale"})
        if extra:
            raise self.source.error((*path, extra[0]), "this stands in the file already; give one or the other")
        key = (table.kind, table.file, given.get("solid", ""), table.scale)
        if key not in self.files:
            self.files[key] = self._from_file(kind, *key[1:], path=(*path, "file"))
        return self.files[key]

    def _from_file(self, kind: type[Shape], file: str, solid: str, scale: float | None, *, path: Path_) -> Shape:
        from xpheve import meshes

        try:
            target = self.place_of(file)
        except SceneError as wrong:
            raise self.source.wrong(path, str(wrong)) from None
        with self._blame(path):
            made = meshes.load(target, solid=solid, scale=scale or 1.0)
            return Hull(meshes.points_of(made)) if kind is Hull else made

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
                with warnings.catch_warnings():  # misspelt columns were told of with their line
                    warnings.filterwarnings("ignore", message=".*no law of it reads column", category=XpheveWarning)
                    self.engine.add_objects([self.objects[place] for place in members], laws)

    def _set_between(self) -> None:
        for place, sides in self.between.items():
            law = self.laws[place]
            assert isinstance(law, PairLaw)
            these, those = (tuple(self.objects[k] for k in side) for side in sides)
            law.between, law.one_sided = (these, those), self.table.laws[place].one_sided
            with self._blame(("laws", place, "between")):
                law.check_sides()
        for place, pairs in self.pairs.items():
            law = self.laws[place]
            assert isinstance(law, PairLaw)
            law.pairs = tuple((self.objects[a], self.objects[b]) for a, b in pairs)
        self._set_for_pairs()

    def _set_for_pairs(self) -> None:
        """Give pairs of objects the values that hold for them alone."""
        for place, table in enumerate(self.table.laws):
            law = self.laws[place]
            if table.for_pairs is None or not isinstance(law, ResponseLaw):
                continue
            for k, (words, values) in enumerate(table.for_pairs):
                path = ("laws", place, "for_pairs", k)
                a, b = (self.objects[self._find(self.object_names, word, path, "object")] for word in words)
                with self._blame(path):
                    law.set_pair(a, b, **values)

    def _drive(self) -> None:
        """Take hold of what the host drove, as it moves."""
        for place, (obj, table) in enumerate(zip(self.objects, self.table.objects, strict=True)):
            path = ("objects", place)
            if table.arrival is not None and not table.driven:
                raise self.source.error(
                    (*path, "arrival"), "only what is driven arrives: add driven = true, or take arrival out"
                )
            if table.driven:
                with self._blame((*path, "driven")):
                    take_hold(obj, table)

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
    for name in (
        ("velocity", "angular_velocity") if table.pose is not None else ("position", "velocity", "angular_velocity")
    ):
        own[name] = getattr(table, name)
    if isinstance(table.inertia, tuple):
        own["inertia"] = table.inertia
    if table.pose is None and abs(math.fsum(x * x for x in table.orientation) - 1.0) <= UNIT_LENGTH:
        own["orientation"] = table.orientation
