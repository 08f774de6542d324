"""A world as plain values and arrays, and back: for reset, copy, checkpoint and restore.

Predictions and the queue are not kept: they are made again from the flights, to the same bits.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xpheve.errors import RecordError, UnknownLawError
from xpheve.forces import Force
from xpheve.laws import LawContainer, PairLaw, PhysicalLaw, ResponseLaw
from xpheve.laws import conditions as when
from xpheve.laws.combinations import leaves
from xpheve.laws.conditions.text import TextExpression
from xpheve.objects import FIELDS, PhysicalObject
from xpheve.observers import Observer, Probe
from xpheve.plan.driven import Arrival, watch
from xpheve.plan.groups import Batch, choose, find_group
from xpheve.plan.proof import require_formula
from xpheve.plan.stored import StoredForce
from xpheve.plan.wakeups.saving import Reader, Writer
from xpheve.plan.world import World
from xpheve.shapes.base import Shape
from xpheve.steppers.contract import Signature

Header = dict[str, Any]
Arrays = dict[str, NDArray[Any]]

VERSION = 3
ROWS = ("clock", "turn_clock", "fixed", "driven", "serial", "version", "batch", "local")


class Saved:
    """A world at an instant: header, arrays, and the live handles it had."""

    def __init__(
        self,
        header: Header,
        arrays: Arrays,
        objects: Sequence[PhysicalObject],
        laws: Sequence[PhysicalLaw],
        containers: Sequence[LawContainer],
        shapes: Sequence[Shape | None],
        functions: Sequence[Callable[..., Any]] = (),
        points: Sequence[Probe] = (),
        gone: Sequence[PhysicalObject] = (),
    ) -> None:
        self.header, self.arrays = header, arrays
        self.shapes = shapes
        """Of the objects, as they were then."""
        self.objects, self.laws, self.containers = objects, laws, containers
        self.functions, self.points = functions, points
        self.gone = gone
        """Objects that left the engine, of which events and conditions still speak."""

    def check_functions(self) -> None:
        """Raise `RecordError` if the functions of conditions cannot be told apart by their names in a checkpoint."""
        names = [getattr(one, "__qualname__", type(one).__name__) for one in self.functions]
        for name in names:
            if names.count(name) > 1:
                raise RecordError(
                    f"two functions of conditions are called {name}, so a checkpoint cannot tell them apart: def each under a name"
                )

    def portable(self, authored: Saved | None = None) -> tuple[Header, Arrays]:
        """Without live handles, and with the state that `reset` goes back to; raises `RecordError` if something cannot be written."""
        table = _Shapes()
        header, arrays = table.describe(self), dict(self.arrays)
        if authored is not None:
            header["authored"] = table.describe(authored)
            arrays |= {f"authored.{name}": array for name, array in authored.arrays.items()}
        header["shapes"] = table.described
        try:
            json.dumps(header)
        except (TypeError, ValueError) as error:
            raise RecordError(
                f"the scene holds something that cannot be saved ({error}): post plain values only"
            ) from None
        return header, arrays


class _Shapes:
    """The shapes of a checkpoint: one that many objects share is described once, and shared again by what is made of it."""

    def __init__(self) -> None:
        self.described: list[Header] = []
        self._places: dict[int, int] = {}

    def describe(self, saved: Saved) -> Header:
        """The header of ``saved``, in which objects name their shapes by place."""
        return saved.header | {
            name: [
                entry | {"shape": self._place(shape)} for entry, shape in zip(saved.header[name], shapes, strict=True)
            ]
            for name, shapes in (("objects", saved.shapes), ("gone", [obj._shape for obj in saved.gone]))
        }

    def _place(self, shape: Shape | None) -> int | None:
        if shape is None:
            return None
        if id(shape) not in self._places:
            self._places[id(shape)] = len(self.described)
            self.described.append(shape.describe())
        return self._places[id(shape)]


def save(world: World, started: bool) -> Saved:
    """Everything that the future of ``world`` depends on."""
    bodies, n = world.bodies, world.bodies.count
    laws, containers = list(world.laws), list(world.containers)
    number = {law: k for k, law in enumerate(laws)}
    owner: dict[Any, Any] = {None: "user"} | dict(number)
    writer = Writer(world, laws, containers)
    header: Header = {
        "format": "xpheve checkpoint",
        "version": VERSION,
        "up": world.up,
        "seed": world.seed,
        "periodic": None if world.periodic is None else [_edge(edge) for edge in world.periodic],
        "started": started,
        "time": world.time,
        "epoch": world.ranks.epoch,
        "ranks": [world.ranks.next_object, world.ranks._next],
        "force_ids": world.force_ids.last,
        "input_ids": world.force_ids.inputs,
        "next_serial": world._next_serial,
        "grid": world.grid,
        "posts": world.posts,
        "events": world.events,
        "work": dict(world.work),
        "settings": dataclasses.asdict(world.settings),
        "compile": world.compile,
        "stepper": world.wish,
        "tiers": [[dataclasses.astuple(signature), tier] for signature, tier in world.tiers.items()],
        "dirty": world.dirty,
        "unplanned": [obj.serial for obj in world.unplanned],
        "laws": [_law(world, law) for law in laws],
        "containers": [_container(world, container, number, writer) for container in containers],
        "objects": [_object(world, obj, number) for obj in bodies.objects],
        "forces": [
            [
                obj.serial,
                owner.get(one.owner, "contacts"),
                one.force.vector,
                one.force.torque,
                one.force.id,
                one.until,
                one.accounted,
            ]
            for obj in bodies.objects
            for one in world.forces.on(obj)
        ],
        "arrivals": [[obj.serial, *arrival] for obj, arrival in world.arrivals.items()],
        "constant": {str(number[law]): sorted(reads) for law, reads in world.constant.items()},
        "streams": {str(number[law]): stream.bit_generator.state for law, stream in world.streams.items()},
        "batches": [
            [batch.stepper.id, dataclasses.astuple(batch.signature), dict(batch.state.numbers)]
            for batch in world.batches
        ],
        "wakeups": writer.wakeups(),
        "contacts": None if world.contacts is None else world.contacts.save(),
        "defaults": {name: _plain(value) for name, value in bodies.defaults.items()},
    }
    header["gone"] = [_gone(obj) for obj in writer.gone]
    arrays: Arrays = {f"bodies.{name}": array[:, :n].copy() for name, array in bodies.arrays.items()}
    arrays |= {f"column.{name}": array[:n].copy() for name, array in bodies.columns.items()}
    for name in ROWS:
        arrays[f"row.{name}"] = getattr(bodies, name)[..., :n].copy()
    for k, batch in enumerate(world.batches):
        arrays[f"batch{k}.rows"] = batch.state.rows.copy()
        for name, array in batch.state.arrays.items():
            arrays[f"batch{k}.array.{name}"] = array.copy()
    shapes = [obj._shape for obj in bodies.objects]
    points = list(world.wakeups.points.values())
    return Saved(header, arrays, list(bodies.objects), laws, containers, shapes, writer.functions, points, writer.gone)


def _edge(edge: float) -> float | None:
    return edge if edge < math.inf else None


def _plain(value: float) -> Any:
    return None if math.isnan(value) else value


def _parameters(plain: Header) -> dict[str, Any]:
    """Parameters as laws keep them."""
    return {key: tuple(v) if isinstance(v, list) else v for key, v in plain.items()}


def _law(world: World, law: PhysicalLaw) -> Header:
    between = getattr(law, "between", None)
    pairs = getattr(law, "pairs", None)
    return {
        "id": law.label(),
        "serial": world.laws[law],
        "name": law.name,
        "enabled": law.enabled,
        "switches": world.switches.get(law, 0),
        "parameters": dict(law.parameters),
        "state": {key: list(value) if isinstance(value, list) else value for key, value in law.state.items()},
        "evaluations": law.evaluations,
        "rank": world.ranks.law_ranks.get(law),
        "between": None if between is None else [[obj.serial for obj in side] for side in between],
        "pairs": None if pairs is None else [[a.serial, b.serial] for a, b in pairs],
        "one_sided": getattr(law, "one_sided", False),
        "for_pairs": _for_pairs(law),
    }


def _for_pairs(law: PhysicalLaw) -> list[Any]:
    """What was set for pairs of objects alone: two serial numbers, and the values by name."""
    if not isinstance(law, ResponseLaw):
        return []
    return [[*sorted(obj.serial for obj in couple), dict(values)] for couple, values in law.pair_values.items()]


def _container(world: World, container: LawContainer, number: dict[PhysicalLaw, int], writer: Writer) -> Header:
    condition = container.condition
    return {
        "id": container.label(),
        "name": container.name,
        "condition": None if condition is None else writer.condition(condition),
        "parameters": dict(container.parameters),
        "laws": [number[law] for law in container.laws],
        "rank": world.ranks.container_ranks.get(container),
        "spent": container in world.spent,
        "counts": [container.firings, container.detections],
    }


def _gone(obj: PhysicalObject) -> Header:
    """An object that left the engine, with the state that it took along."""
    return {
        "serial": obj.serial,
        "name": obj.name,
        "density": obj._density,
        "kind": "" if type(obj) is PhysicalObject else type(obj).__qualname__,
        "columns": dict(obj._columns),
        "fixed": obj._fixed,
        "state": {name: obj._own[name] for name in FIELDS},
    }


def _object(world: World, obj: PhysicalObject, number: dict[PhysicalLaw, int]) -> Header:
    return {
        "serial": obj.serial,
        "name": obj.name,
        "density": obj._density,
        "kind": "" if type(obj) is PhysicalObject else type(obj).__qualname__,
        "rank": obj.rank,
        "columns": dict(obj._columns),
        "laws": [[number[law], since] for law, since in world.mapping.laws(obj).items()],
    }


# Back


def restore_into(engine: Any, saved: Saved) -> None:
    """Bring ``engine`` back to ``saved`` with the handles it had then; what came since is let go with its last state."""
    world = engine._world
    kept = set(saved.objects)
    for obj in list(world.bodies.objects):
        state = {name: obj._get(name) for name in FIELDS}
        obj._own.update(state)
        obj._driven = False
        if obj not in kept:
            obj._engine, obj._row, obj.rank = None, -1, -1
    for law in world.laws:
        law.engine = None
        law.containers = []
    for container in world.containers:
        container.engine = None
        container.laws = []
    for point in world.wakeups.points.values():
        point._position, point._attached, point.engine = point.position, None, None
    engine._renew(World(saved.header["up"], saved.header["seed"], engine._all_steppers, world.periodic))
    for law, entry in zip(saved.laws, saved.header["laws"], strict=True):
        law.parameters = _parameters(entry["parameters"])
        law._enabled = entry["enabled"]
        law.evaluations = entry["evaluations"]
        law.state = {key: list(v) if isinstance(v, list) else v for key, v in entry["state"].items()}
    for obj, shape in zip(saved.objects, saved.shapes, strict=True):
        obj._shape = shape
    for container, entry in zip(saved.containers, saved.header["containers"], strict=True):
        container.firings, container.detections = entry["counts"]
    serials = [entry["serial"] for entry in saved.header["objects"]]
    points = {point.name: point for point in saved.points}
    reader = Reader(saved.objects, serials, saved.laws, points, saved.functions, True, saved.gone)
    reader.points_of(saved.header["wakeups"]["points"], engine)
    _build(engine, saved.header, saved.arrays, saved.objects, saved.laws, saved.containers, reader)
    engine._world.wish_compiled(world.compile)
    engine._world.wish_stepper(world.wish)


def revive(
    kind: type[Any],
    portable: tuple[Header, Arrays],
    laws: Sequence[type[PhysicalLaw]],
    containers: Sequence[type[LawContainer]],
    registry: Any,
    class_of: Callable[[Header], type[PhysicalObject]] = lambda entry: PhysicalObject,
    functions: Sequence[Callable[..., Any]] = (),
    by_place: bool = False,
    first_functions: Sequence[Callable[..., Any]] = (),
) -> Any:
    """A new engine of class ``kind`` from what `save` gave, with handles of its own; ``class_of`` says of which class an object is."""
    header, arrays = portable
    _check_version(header.get("version"))
    engine = kind(up=header["up"], seed=header["seed"], registry=registry, **_setting(header))
    local_laws = {law.label(): law for law in laws}
    local_containers: dict[str, type[LawContainer]] = {c.label(): c for c in containers} | {
        "LawContainer": LawContainer
    }
    made_laws = [_revive_law(engine, entry, local_laws) for entry in header["laws"]]
    from xpheve.shapes.described import from_description

    shapes: list[Shape] = [from_description(described) for described in header["shapes"]]
    objects = [_revive_object(entry, shapes, arrays, row, class_of) for row, entry in enumerate(header["objects"])]
    gone = [_revive_gone(entry, shapes, class_of) for entry in header["gone"]]
    numbers = [entry["serial"] for entry in header["objects"]]
    reader = Reader(objects, numbers, made_laws, {}, functions, by_place, gone)
    reader.points_of(header["wakeups"]["points"], engine)
    made_containers = [_revive_container(engine, entry, local_containers, reader) for entry in header["containers"]]
    _build(engine, header, arrays, objects, made_laws, made_containers, reader)
    engine._started = header["started"]
    if header.get("authored"):
        first = header["authored"]
        of_first = {
            name.removeprefix("authored."): array for name, array in arrays.items() if name.startswith("authored.")
        }
        serials = {obj.serial: obj for obj in objects}
        known = {entry["serial"]: law for entry, law in zip(header["laws"], made_laws, strict=True)}
        first_objects = [
            serials.get(entry["serial"]) or _revive_object(entry, shapes, of_first, k, class_of)
            for k, entry in enumerate(first["objects"])
        ]
        first_laws = [known.get(entry["serial"]) or _revive_law(engine, entry, local_laws) for entry in first["laws"]]
        numbers = [entry["serial"] for entry in first["objects"]]
        points = dict(reader.points)
        functions = first_functions if by_place else functions
        first_gone = [_revive_gone(entry, shapes, class_of) for entry in first["gone"]]
        again = Reader(first_objects, numbers, first_laws, points, functions, by_place, first_gone)
        for kind_, name, _, _, radius in first["wakeups"]["points"]:
            if name not in points:
                points[name] = Observer(name, radius=radius) if kind_ == "observer" else Probe(name)
        first_containers = [_revive_container(engine, entry, local_containers, again) for entry in first["containers"]]
        kept = [points[name] for _, name, *_ in first["wakeups"]["points"]]
        live = functions if by_place else _functions_of(first_containers)
        had = [_shape_of(entry, shapes) for entry in first["objects"]]
        engine._authored = Saved(
            first, of_first, first_objects, first_laws, first_containers, had, live, kept, first_gone
        )
    return engine


def _setting(header: Header) -> dict[str, Any]:
    """What only some scenes say; subclasses of the engine that know nothing of it need not take it otherwise."""
    return {} if header.get("periodic") is None else {"periodic": header["periodic"]}


def _check_version(version: Any) -> None:
    if version == VERSION:
        return
    if isinstance(version, int) and 0 < version < VERSION:
        way = "it lacks what runs depend on now; go on with the xpheve that wrote it, or run the scene anew"
    else:
        way = "upgrade xpheve"
    raise RecordError(f"checkpoint version {version!r}: this xpheve reads version {VERSION}; {way}")


def attributes_of(engine: Any) -> dict[int, dict[str, Any]]:
    """What subclasses of `PhysicalObject` keep beside the engine's state, by serial number."""
    found = {obj.serial: getattr(obj, "__dict__", None) for obj in engine._world.bodies.objects}
    return {serial: dict(kept) for serial, kept in found.items() if kept}


def give_attributes(engine: Any, kept: dict[int, dict[str, Any]]) -> None:
    """Give the objects of a revived engine what `attributes_of` found."""
    for obj in engine._world.bodies.objects:
        if obj.serial in kept:
            obj.__dict__.update(kept[obj.serial])


def _revive_law(engine: Any, entry: Header, local: dict[str, type[PhysicalLaw]]) -> PhysicalLaw:
    kind = local.get(entry["id"])
    if kind is None:
        if ":" not in entry["id"]:
            raise UnknownLawError(
                f"the checkpoint needs the law class {entry['id']}, of no pack: restore(..., laws=[{entry['id']}])"
            )
        try:
            kind = engine.registry.law(entry["id"])
        except UnknownLawError as error:
            raise UnknownLawError(
                f"{error}. A class of your own is given back: restore(..., laws=[TheClass])"
            ) from None
    law = kind(name=entry["name"], enabled=entry["enabled"], **entry["parameters"])
    law.state = dict(entry["state"])
    law.evaluations = entry["evaluations"]
    return law


def _functions_of(containers: Sequence[LawContainer]) -> list[Callable[..., Any]]:
    """The functions of conditions, in the order in which `Writer` meets them."""
    found = [leaf.expression for c in containers for leaf in leaves(c.condition) if isinstance(leaf, when.Crosses)]
    return list(dict.fromkeys(one for one in found if not isinstance(one, TextExpression)))


def _revive_container(engine: Any, entry: Header, local: dict[str, type[LawContainer]], reader: Reader) -> LawContainer:
    kind = local.get(entry["id"])
    if kind is None:
        if ":" not in entry["id"]:
            raise UnknownLawError(
                f"the checkpoint needs the container class {entry['id']}, of no pack: restore(..., containers=[{entry['id']}])"
            )
        kind = engine.registry.container(entry["id"])
    condition = None
    if entry["condition"] is not None:
        condition = reader.condition(entry["condition"])
    container: LawContainer = kind(condition, name=entry["name"], **entry.get("parameters", {}))
    container.firings, container.detections = entry["counts"]
    return container


def _shape_of(entry: Header, shapes: Sequence[Shape]) -> Shape | None:
    return None if entry["shape"] is None else shapes[entry["shape"]]


def _revive_object(
    entry: Header,
    shapes: Sequence[Shape],
    arrays: Arrays,
    row: int,
    class_of: Callable[[Header], type[PhysicalObject]],
) -> PhysicalObject:
    values = {name: arrays[f"bodies.{name}"][:, row].tolist() for name in FIELDS}
    state = {name: tuple(value) for name, value in values.items()} | {"mass": values["mass"][0]}
    return _made(entry, _shape_of(entry, shapes), bool(arrays["row.fixed"][row]), state, class_of)


def _revive_gone(
    entry: Header, shapes: Sequence[Shape], class_of: Callable[[Header], type[PhysicalObject]]
) -> PhysicalObject:
    state = {name: tuple(value) if isinstance(value, list) else value for name, value in entry["state"].items()}
    obj = _made(entry, _shape_of(entry, shapes), entry["fixed"], state, class_of)
    obj.serial, obj._density = entry["serial"], entry["density"]
    return obj


def _made(
    entry: Header,
    shape: Shape | None,
    fixed: bool,
    state: dict[str, Any],
    class_of: Callable[[Header], type[PhysicalObject]],
) -> PhysicalObject:
    """A free object in ``state``."""
    kind = class_of(entry)
    obj = kind.__new__(kind)  # a subclass may ask its __init__ for anything
    inertia = None if shape is None or shape.solid else (0.0, 0.0, 0.0)
    PhysicalObject.__init__(obj, shape, name=entry["name"], fixed=fixed, mass=1.0, inertia=inertia, **entry["columns"])
    obj._own = dict(state)
    return obj


def _build(
    engine: Any,
    header: Header,
    arrays: Arrays,
    objects: Sequence[PhysicalObject],
    laws: Sequence[PhysicalLaw],
    containers: Sequence[LawContainer],
    reader: Reader,
) -> None:
    """Fill the fresh world of ``engine``."""
    world: World = engine._world
    world.time = _instant(header["time"])
    world.ranks.epoch = header["epoch"]
    world.ranks.next_object, world.ranks._next = header["ranks"]
    world.force_ids.last = header["force_ids"]
    world.force_ids.inputs = header.get("input_ids", 0)
    world._next_serial = header["next_serial"]
    grid = header["grid"]
    world.grid = None if grid is None else (_instant(grid[0]), float(grid[1]), int(grid[2]))
    world.posts, world.events, world.work = header["posts"], header["events"], dict(header["work"])
    world.settings = type(world.settings)(**header["settings"])
    world.compile = header["compile"]
    world.wish = header.get("stepper", "")
    world.tiers = {_signature(entry): tier for entry, tier in header["tiers"]}
    _build_laws(engine, world, header, laws, containers)
    _build_bodies(engine, world, header, arrays, objects)
    serials = {obj.serial: obj for obj in objects}
    for law, entry in zip(laws, header["laws"], strict=True):
        if isinstance(law, PairLaw) and entry["between"] is not None:
            these, those = (tuple(serials[serial] for serial in side if serial in serials) for side in entry["between"])
            law.between, law.one_sided = (these, those), entry.get("one_sided", False)
        if isinstance(law, PairLaw) and entry.get("pairs") is not None:
            law.pairs = tuple((serials[a], serials[b]) for a, b in entry["pairs"])
        if isinstance(law, ResponseLaw):
            law._pairs = {
                frozenset((serials[a], serials[b])): _parameters(values) for a, b, values in entry.get("for_pairs", [])
            }
    _build_mapping(world, header, objects, laws)
    _build_batches(engine, world, header, arrays)
    for serial, owner, vector, torque, ident, until, accounted in header["forces"]:
        source: Any = None if owner == "user" else world.contacts if owner == "contacts" else laws[owner]
        force = Force(vector, id=ident, torque=torque)
        obj = serials[serial]
        stored = StoredForce(force, source, tuple(until), accounted)
        world.forces.put(obj, stored)
        world.watch_force(obj, stored)
    for serial, at, position, orientation in header["arrivals"]:
        arrival = Arrival(tuple(at), tuple(position), tuple(orientation))
        world.arrivals[serials[serial]] = arrival
        watch(world, serials[serial], arrival)
    for serial in header["unplanned"]:
        world.unplanned[serials[serial]] = None
    world.dirty = header["dirty"]
    reader.wakeups(world, containers, header["wakeups"])
    if world.contacts is not None:
        world.contacts.restore(header["contacts"])
        world.contacts.refresh([obj._row for obj in world.in_rank_order(objects)])
        world.note_listeners()


def _build_laws(
    engine: Any, world: World, header: Header, laws: Sequence[PhysicalLaw], containers: Sequence[LawContainer]
) -> None:
    for law, entry in zip(laws, header["laws"], strict=True):
        require_formula(law)
        law.engine = engine
        world.laws[law] = entry["serial"]
        if entry["switches"]:
            world.switches[law] = entry["switches"]
        if entry["rank"] is not None:
            world.ranks.law_ranks[law] = entry["rank"]
    for key, reads in header["constant"].items():
        world.constant[laws[int(key)]] = set(reads)  # type: ignore[index]
    for key, state in header["streams"].items():
        stream = np.random.default_rng()
        stream.bit_generator.state = state
        world.streams[laws[int(key)]] = stream
    for container, entry in zip(containers, header["containers"], strict=True):
        container.engine = engine
        container.laws = [laws[k] for k in entry["laws"]]
        for law in container.laws:
            law.containers.append(container)
        world.containers.append(container)
        if entry["rank"] is not None:
            world.ranks.container_ranks[container] = entry["rank"]
        if entry["spent"]:
            world.spent.add(container)
    from xpheve.plan.order import positions

    world.law_positions = positions(laws)
    if header["contacts"] is not None:
        engine._serve_contacts()


def _instant(value: Any) -> tuple[float, float]:
    """An instant of a header; raises what is no pair of numbers, before anything is built on it."""
    base, offset = value
    return float(base), float(offset)


def _build_bodies(engine: Any, world: World, header: Header, arrays: Arrays, objects: Sequence[PhysicalObject]) -> None:
    bodies, n = world.bodies, len(objects)
    bodies.reserve(n)
    bodies.count = n
    bodies.objects = list(objects)
    for name, default in header["defaults"].items():
        bodies.add_column(name, math.nan if default is None else default)[:n] = arrays[f"column.{name}"]
    for name in bodies.arrays:
        bodies.arrays[name][:, :n] = arrays[f"bodies.{name}"]
    for name in ROWS:
        getattr(bodies, name)[..., :n] = arrays[f"row.{name}"]
    for row, (obj, entry) in enumerate(zip(objects, header["objects"], strict=True)):
        obj._engine, obj._row = engine, row
        obj.serial, obj.rank = entry["serial"], entry["rank"]
        obj._columns = dict(entry["columns"])
        obj._driven = bool(bodies.driven[row])
        obj._density = entry["density"]
    bodies.change += 1


def _build_mapping(
    world: World, header: Header, objects: Sequence[PhysicalObject], laws: Sequence[PhysicalLaw]
) -> None:
    for obj, entry in zip(objects, header["objects"], strict=True):
        for number, since in entry["laws"]:
            world.mapping.add(obj, laws[number], tuple(since))
    for obj in objects:
        if obj not in world.groups and any(isinstance(law, PairLaw) for law in world.continuous_laws(obj)):
            group = find_group(world, obj)
            world.groups.update(dict.fromkeys(group, group))


def _signature(entry: Sequence[Any]) -> Signature:
    values: list[Any] = [tuple(one) if isinstance(one, list) else one for one in entry]
    return Signature(*values)


def _build_batches(engine: Any, world: World, header: Header, arrays: Arrays) -> None:
    for k, (ident, signature, numbers) in enumerate(header["batches"]):
        signature = _signature(signature)
        choice = world.choices.get(signature)
        if choice is None:
            choice = world.choices[signature] = choose(signature, world._steppers(signature.evaluated))
        if choice.stepper.id != ident:
            raise RecordError(
                f"the checkpoint was made with the stepper {ident}, which is not at hand: install its pack"
            )
        rows = arrays[f"batch{k}.rows"].astype(np.int64)
        state = choice.stepper.start(rows, world.bodies, world.time, None)
        missing = sorted(state.numbers.keys() - numbers.keys())
        if missing:
            raise RecordError(f"the checkpoint is damaged: what {ident} keeps lacks {missing[0]!r}; take another one")
        state.numbers = dict(numbers)
        for name in state.arrays:
            state.arrays[name] = arrays[f"batch{k}.array.{name}"].copy()
        state.locate()
        batch = Batch(k, signature, choice, state)
        world.batches.append(batch)
        choice.stepper.resume(state, world.bodies, world.time, world.sources(batch))


__all__ = ["Saved", "attributes_of", "give_attributes", "restore_into", "revive", "save"]
