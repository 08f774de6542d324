"""From an engine to a scene file: the same bits in the same order, so that files can be compared line by line.

What a scene cannot say is left to checkpoints: the time, what laws keep in ``state``, timers under way, and
forces that laws stored.
"""

from __future__ import annotations

import json
import math
import os
import re
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xpheve.errors import SceneError, XpheveError, XpheveWarning
from xpheve.kernels.clock import elapsed
from xpheve.laws import LawContainer, PairLaw, PhysicalLaw, ResponseLaw
from xpheve.objects import PhysicalObject, moments_of
from xpheve.observers import Probe
from xpheve.scene.names import Names
from xpheve.scene.source import form_of, show
from xpheve.scene.wakeups import write_condition, write_point

if TYPE_CHECKING:
    from xpheve.engine import PhysicsEngine

VERSION = 1
WIDTH = 120  # characters; lists and tables that fit stand on one line
RUN_KEYS = ("until", "dt", "every", "rtol", "atol", "record")
SCRIPT = (
    "Put it into a pack (a module that an entry point of the group xpheve.packs names; see registry.register for a try)"
)

Plain = dict[str, Any]


def save(engine: PhysicsEngine, path: str | os.PathLike[str], *, run: Mapping[str, Any] | None = None) -> Path:
    """Write the scene of ``engine`` to ``path``, TOML or JSON by its ending; aside, then in the place of a file there.

    Parameters
    ----------
    run
        Settings for ``xpheve run``: ``until``, ``dt``, ``every``, ``rtol``, ``atol``, ``record``.

    Raises
    ------
    SceneError
        If the scene holds what a file cannot say, such as a law that no pack offers, or the file cannot be written.
    """
    target = Path(path)
    data = dumps(engine, form_of(target), run=run).encode()
    beside = target.with_name(f".{target.stem[:100]}.{os.getpid()}.new{target.suffix}")
    try:
        with open(beside, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, target)
    except OSError as wrong:
        raise SceneError(f"{target}: cannot be written: {wrong.strerror or wrong}") from None
    finally:
        beside.unlink(missing_ok=True)
    return target


def dumps(engine: PhysicsEngine, form: str = "toml", *, run: Mapping[str, Any] | None = None) -> str:
    """Return the scene of ``engine`` as text, TOML or JSON; raises as `save` does."""
    if form not in ("toml", "json"):
        raise SceneError(f"form = {form!r}: choose 'toml' or 'json'")
    tables = _Tables(engine).tables
    if run:
        tables = {
            "xpheve": tables.pop("xpheve"),
            "up": tables.pop("up"),
            "seed": tables.pop("seed"),
            **{name: tables.pop(name) for name in ("compile", "stepper", "periodic") if name in tables},
            "run": _run(run),
            **tables,
        }
    text = _json(tables) if form == "json" else _toml(tables, engine.time)
    try:
        text.encode()
    except UnicodeEncodeError:
        raise SceneError(
            "a name in this scene has half of a surrogate pair, which is no character; rename it"
        ) from None
    return text


class _Tables:
    """An engine as plain tables."""

    def __init__(self, engine: PhysicsEngine) -> None:
        self.engine = engine
        # Named ones by name, as a reader looks for them; the others as added, so that a file changes little.
        self.objects = sorted(engine.objects, key=lambda obj: (not obj.name, _natural(obj.name), obj.serial))
        order = {law: k for k, law in enumerate(engine.laws)}
        self.laws = sorted(engine.laws, key=lambda law: (not law.name, _natural(law.name), law.label(), order[law]))
        held: dict[Any, int] = {}
        for container in engine.containers:
            if not container.name:
                held[_kind(container)] = held.get(_kind(container), 0) + 1
        self.shared = [
            container
            for container in engine.containers
            if container.name
            or held[_kind(container)] > 1
            or not container.laws
            or container.parameters != {key: param.default for key, param in container.params.items()}
            or any(len(law.containers) > 1 for law in container.laws)
        ]
        self.shared.sort(key=lambda container: (not container.name, _natural(container.name)))
        self.object_names = Names([(obj.name, "") for obj in self.objects])
        self.law_names = Names([(law.name, law.label()) for law in self.laws])
        self.container_names = Names([(container.name, type(container).id) for container in self.shared])
        self.object_places = {obj: k for k, obj in enumerate(self.objects)}
        self.law_places = {law: k for k, law in enumerate(self.laws)}
        for kind, names in (
            ("object", self.object_names),
            ("law", self.law_names),
            ("container", self.container_names),
        ):
            for name, _ in names.rows:
                if name.startswith("#"):
                    raise SceneError(
                        f'{kind} {show(name)}: in scene files "#" stands for places, and begins no name; rename it'
                    )
            if names.twice:
                raise SceneError(
                    f"two {kind}s are called {show(names.rows[names.twice[0][0]][0])}; names are unique: rename one"
                )
        tables: Plain = {"xpheve": VERSION, "up": engine.up, "seed": engine.seed}
        if engine.compile != "auto":
            tables["compile"] = engine.compile
        if engine.stepper:
            tables["stepper"] = engine.stepper
        if engine.periodic is not None:
            tables["periodic"] = [edge if edge < math.inf else "none" for edge in engine.periodic]
        last = engine._world.force_ids.last
        ids = [force.id for obj in self.objects for force in engine.user_forces(obj) if isinstance(force.id, int)]
        if last > max(ids, default=0):  # an id that was given once is not given again
            tables["force_ids"] = last
        for key, rows in (
            ("containers", [self.container(one) for one in self.shared]),
            ("laws", [self.law(one) for one in self.laws]),
            ("objects", [self.object(one) for one in self.objects]),
            ("observers", [write_point(one, lambda obj: self._called(obj, "observer")) for one in engine.observers]),
            ("probes", [write_point(one, lambda obj: self._called(obj, "probe")) for one in engine.probes]),
        ):
            if rows:
                tables[key] = rows
        self.tables = tables

    # Laws and containers

    def law(self, law: PhysicalLaw) -> Plain:
        label = f"law {show(law.name)} ({law.label()})" if law.name else f"law {law.label()}"
        self._check_offered("law", law, label)
        table: Plain = {"id": law.id}
        if law.name:
            table["name"] = law.name
        if not law.enabled:
            table["enabled"] = False
        for key, value in law.parameters.items():
            param = law.params[key]
            if value is None:
                if param.default is not None:
                    if param.kind == "text":
                        raise SceneError(f"{label}: {key} = None: a scene file cannot say that; set a text")
                    table[key] = "none"
            elif value != param.default or _is_finite(value):
                table[key] = _plain(value, f"{label}: {key}")
        if isinstance(law, PairLaw) and law.between is not None:
            table["between"] = [
                [self._object_called(obj) for obj in side if obj in self.object_places and law in obj.laws]
                for side in law.between
            ]
            if law.one_sided:
                table["one_sided"] = True
        if isinstance(law, PairLaw) and law.pairs is not None:
            table["pairs"] = [
                [self._object_called(obj) for obj in pair]
                for pair in law.pairs
                if all(obj in self.object_places and law in obj.laws for obj in pair)
            ]
        if isinstance(law, ResponseLaw) and law.pair_values:
            table["for_pairs"] = [
                {"objects": [self._object_called(obj) for obj in self._ordered(couple)], **values}
                for couple, values in law.pair_values.items()
            ]
        table |= self._when(law, label)
        return table

    def _ordered(self, couple: Iterable[PhysicalObject]) -> list[PhysicalObject]:
        return sorted(couple, key=lambda obj: self.object_places[obj])

    def _when(self, law: PhysicalLaw, label: str) -> Plain:
        """Return what the table of ``law`` says of its containers; nothing, if they are its own default."""
        if not law.containers:
            if law.container or law.condition is not None:
                raise SceneError(f"{label}: it is in no container, so it never acts; put it into one, or remove it")
            return {}
        if any(container in self.shared for container in law.containers):
            words = [self.container_names.called(self.shared.index(one)) for one in law.containers]
            if not all(words):
                raise SceneError(f"{label}: its containers cannot be told apart by name; give them names")
            return {"container": words[0] if len(words) == 1 else words}
        container = law.containers[0]
        kind = type(container)
        table: Plain = {}
        if kind is not LawContainer:
            self._check_offered("container", container, f"{label}: container {container!r}")
            if kind.id != law.container:
                table["container"] = kind.id
        elif law.container:
            raise SceneError(f"{label}: it is in a plain container, not in {law.container}; give that one a name")
        default = kind.condition if kind.condition is not None else law.condition
        if container.condition is not None and container.condition != default:
            table["condition"] = self._condition(container.condition, label)
        return table

    def container(self, container: LawContainer) -> Plain:
        table: Plain = {}
        label = f"container {show(container.name)}" if container.name else f"container {container!r}"
        if container.name:
            table["name"] = container.name
        if type(container) is not LawContainer:
            self._check_offered("container", container, label)
            table["id"] = container.id
        if container.condition is not None and container.condition != type(container).condition:
            table["condition"] = self._condition(container.condition, label)
        changed = {key: value for key, value in container.parameters.items() if value != container.params[key].default}
        if changed:
            table["parameters"] = {key: _plain(value, f"{label}: {key}") for key, value in changed.items()}
        return table

    def _condition(self, condition: Any, label: str) -> Plain:
        return write_condition(condition, label, lambda thing: self._called(thing, label))

    def _called(self, thing: Any, label: str) -> str:
        """The name by which the file knows what a condition or observer names."""
        if isinstance(thing, Probe):
            if thing.engine is not self.engine:
                raise SceneError(f"{label}: {thing!r} is not in this engine; add it, or take it out of the condition")
            return thing.name
        places: dict[Any, int] = self.law_places if isinstance(thing, PhysicalLaw) else self.object_places
        if thing not in places:
            raise SceneError(f"{label}: {thing!r} is not in this engine; add it, or take it out of the condition")
        if isinstance(thing, PhysicalLaw):
            same = [law for law in self.laws if law.label() == thing.label()]
            if not thing.name and len(same) > 1:
                raise SceneError(
                    f"{label}: its condition names one of {len(same)} laws {thing.label()}; give it a name"
                )
            return thing.name or thing.label()
        return self.object_names.called(places[thing])

    def _check_offered(self, kind: str, thing: Any, label: str) -> None:
        """Raise unless a pack offers the class of ``thing`` under its id, so that a file can name it."""
        cls = type(thing)
        if not cls.id:
            raise SceneError(
                f"{label}: the class {cls.__qualname__} is of no pack, so that a file cannot name it. {SCRIPT}"
            )
        try:
            found = self.engine.registry.find(kind, cls.id)
        except XpheveError as wrong:
            raise SceneError(
                f"{label}: the class {cls.__qualname__} is of no pack that can be found ({wrong}). {SCRIPT}"
            ) from None
        if found is not cls:
            raise SceneError(
                f"{label}: its class {cls.__module__}.{cls.__qualname__} is not what packs offer under this id, "
                f"{found.__module__}.{found.__qualname__}; a file would bring back that one. Give it an id of its own"
            )

    # Objects

    def _object_called(self, obj: PhysicalObject) -> str:
        return self.object_names.called(self.object_places[obj])

    def object(self, obj: PhysicalObject) -> Plain:
        label = f"object {show(obj.name)}" if obj.name else f"object {obj!r}"
        table: Plain = {}
        if obj.name:
            table["name"] = obj.name
        if obj.shape is not None:
            table["shape"] = self._shape(obj.shape, label)
        if obj.fixed:
            table["fixed"] = True
        if obj.driven:
            table["driven"] = True
            table |= self._arrival(obj)
        if type(obj) is not PhysicalObject:
            self._warn_of_class(obj, label)
        mass = obj.mass
        density = obj._density
        natural = 1.0 if obj.shape is None or obj.shape.mass is None else obj.shape.mass
        if density is not None and obj.shape is not None and density * obj.shape.volume == mass:
            table["density"] = density
        elif not obj.fixed or mass != natural:
            table["mass"] = mass
        inertia = obj.inertia
        hollow = obj.shape is not None and not obj.shape.solid and not obj.fixed
        if hollow or not _same_bits(inertia, moments_of(obj.shape, mass)):
            table["inertia"] = list(inertia)
        still = (0.0, 0.0, 0.0)
        for name, usual in (
            ("position", None),
            ("velocity", still),
            ("orientation", (1.0, 0.0, 0.0, 0.0)),
            ("angular_velocity", still),
        ):
            value = getattr(obj, name)
            if usual is None or not _same_bits(value, usual):
                table[name] = list(value)
        columns = obj.columns
        if columns:
            table["columns"] = {name: columns[name] for name in sorted(columns)}
        laws = [self.law_places[law] for law in obj.laws if not self._between(law, obj)]
        if laws:
            table["laws"] = [self.law_names.called(place) for place in sorted(laws)]
        forces = [_force(one) for one in self.engine.user_forces(obj)]
        if forces:
            table["forces"] = forces
        for key in ("position", "velocity", "orientation", "angular_velocity", "inertia"):
            _plain(table.get(key, 0.0), f"{label}: {key}")
        return table

    def _arrival(self, obj: PhysicalObject) -> Plain:
        world = self.engine._world
        arrival = world.arrivals.get(obj)
        if arrival is None:
            return {}
        within = elapsed(arrival.at, world.time)
        place = {"position": list(arrival.position), "orientation": list(arrival.orientation), "within": within}
        return {"arrival": place}

    def _warn_of_class(self, obj: PhysicalObject, label: str) -> None:
        text = (
            f"{label}: a scene file says nothing of its class {type(obj).__qualname__}: read again, it is a PhysicalObject that moves the "
            "same. A checkpoint keeps classes: engine.checkpoint, PhysicsEngine.restore(..., objects=[...])"
        )
        warnings.warn(text, XpheveWarning, stacklevel=2)

    def _between(self, law: PhysicalLaw, obj: PhysicalObject) -> bool:
        """Whether ``law`` is mapped to ``obj`` by naming it."""
        if not isinstance(law, PairLaw):
            return False
        if law.pairs is not None:
            mapped = self.engine._world.mapping.objects(law)
            return any(other in mapped for other in law.joined(obj))
        return law.between is not None and any(obj in side for side in law.between)

    def _shape(self, shape: Any, label: str) -> Plain:
        from xpheve.shapes import CORE as CORE_SHAPES

        described: Plain = {key: value for key, value in shape.describe().items() if value is not None}
        if CORE_SHAPES.get(shape.kind) is not type(shape):
            self._check_offered("shape", shape, f"{label}: shape {shape!r}")
            described["kind"] = shape.id
        return {key: _plain(value, f"{label}: shape.{key}") for key, value in described.items()}


def _force(force: Any) -> Plain:
    table: Plain = {"vector": list(force.vector)}
    if any(force.torque):
        table["torque"] = list(force.torque)
    if force.duration != math.inf:
        table["duration"] = force.duration
    if force.id is not None:
        table["id"] = force.id
    return table


def _run(run: Mapping[str, Any]) -> Plain:
    table: Plain = {}
    for key in run:
        if key not in RUN_KEYS:
            from xpheve.plugins.suggest import did_you_mean

            raise SceneError(f"run has no {key!r}.{did_you_mean(key, RUN_KEYS)} It has: {', '.join(RUN_KEYS)}")
    for key in RUN_KEYS:
        if run.get(key) is not None:
            table[key] = str(run[key]) if key == "record" else _plain(float(run[key]), f"run.{key}")
    return table


def _kind(container: LawContainer) -> tuple[type, Any]:
    return type(container), container.condition


def _natural(name: str) -> list[tuple[int, str]]:
    """So that ``ball_2`` comes before ``ball_10``."""
    return [
        (int(part), "") if part.isdecimal() and part.isascii() else (-1, part) for part in re.split(r"([0-9]+)", name)
    ]


def _same_bits(one: Any, other: Any) -> bool:
    return [x.hex() for x in one] == [x.hex() for x in other]


def _is_finite(value: Any) -> bool:
    numbers = value if isinstance(value, tuple) else (value,)
    return all(not isinstance(one, float) or math.isfinite(one) for one in numbers)


def _plain(value: Any, what: str) -> Any:
    """``value`` as numbers, texts, lists and tables that a file has; what is not finite is refused."""
    if isinstance(value, (tuple, list)):
        return [_plain(one, what) for one in value]
    if isinstance(value, dict):
        return {str(key): _plain(one, what) for key, one in value.items()}
    if isinstance(value, (bool, int, str)):
        return value
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise SceneError(f"{what} = {value!r}: a scene file has numbers, texts, lists and tables only") from None
    if not math.isfinite(number):
        raise SceneError(f"{what} = {value!r}: a scene file has finite numbers only")
    return number


# Text -----------------------------------------------------------------------------------------------------------------


def _toml(tables: Plain, time: float) -> str:
    from xpheve import __version__

    told = "" if time == 0.0 else f" at t = {time!r} s; read again, its time begins at 0"
    parts = [f"# Written by xPheve {__version__}{told}.\n"]
    plain = {key: value for key, value in tables.items() if not isinstance(value, dict) and not _are_tables(value)}
    parts.append("".join(f"{_key(key)} = {_inline(value)}\n" for key, value in plain.items()))
    for key, value in tables.items():
        for row in [value] if isinstance(value, dict) else value if _are_tables(value) else ():
            head = f"[{key}]" if isinstance(value, dict) else f"[[{key}]]"
            parts.append(head + "\n" + "".join(_line(name, one) for name, one in row.items()))
    return "\n".join(parts)


def _are_tables(value: Any) -> bool:
    """Whether ``value`` is a list of tables: objects, laws and so on."""
    return isinstance(value, list) and all(isinstance(one, dict) for one in value)


def _line(name: str, value: Any) -> str:
    start = f"{_key(name)} = "
    text = _inline(value)
    if len(start) + len(text) <= WIDTH or not isinstance(value, list) or not value or isinstance(value[0], float):
        return f"{start}{text}\n"
    return start + "[\n" + "".join(f"    {_inline(one)},\n" for one in value) + "]\n"


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _text(value: str) -> str:
    """As TOML's basic strings: JSON's, but for DEL."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _inline(value: Any) -> str:
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_inline(one)}" for key, one in value.items()) + " }" if value else "{}"
    return repr(value)


def _json(tables: Plain) -> str:
    """One key a line for tables of objects and laws; their values on the line of their key."""
    lines = []
    for key, value in tables.items():
        if _are_tables(value):
            rows = ",\n".join(
                "  {\n" + ",\n".join(f"   {_pair(*pair)}" for pair in row.items()) + "\n  }" for row in value
            )
            lines.append(f" {_dump(key)}: [\n{rows}\n ]")
        else:
            lines.append(f" {_pair(key, value)}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _pair(key: str, value: Any) -> str:
    return f"{_dump(key)}: {_dump(value)}"


def _dump(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
