"""What a scene file may say: the pydantic models of its tables. The one door to pydantic in this room.

They check what can be checked without a pack; laws, containers and shapes of packs are looked up by their ids, and hold
their own parameters to their own rules (see `xpheve.scene.build`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, ValidationError
from pydantic_core import core_schema

from xpheve.errors import SceneError
from xpheve.orientation import from_axis_angle, from_euler, from_pose
from xpheve.plugins.spec import ParamSpec, json_schema_of
from xpheve.plugins.suggest import closest
from xpheve.scene.quantities import Vec, number, numbers
from xpheve.scene.source import Path_, Source, show

VERSION = 1
MOST_OBJECTS = (
    100_000  # in TOML about half a minute to read; more are built faster in Python, or restored from a checkpoint
)
MOST_LAWS = 10_000  # each is planned for itself; a law of ten thousand springs is a law with columns
LONGEST_NAME = 200  # characters; names are shown in tables and errors


def _positive(value: float, unit: str) -> float:
    if value <= 0:
        raise ValueError(f"a number above 0{'' if unit == '1' else ' ' + unit} is needed")
    return value


def _no_less_than_0(value: float, unit: str) -> float:
    if value < 0:
        raise ValueError(f"a number from 0{'' if unit == '1' else ' ' + unit} up is needed")
    return value


def _mass(value: Any) -> float:
    found = number(value, "kg")
    if found <= 0:
        raise ValueError("a mass above 0 kg is needed; what never moves has fixed = true")
    return found


def _inertia(value: Any) -> float | Vec:
    if isinstance(value, list):
        x, y, z = numbers(value, "kg*m^2", 3)
        return x, y, z
    return number(value, "kg*m^2")


def _duration(value: Any) -> float:
    if isinstance(value, float) and value == float("inf"):
        raise ValueError("a force that never ends has no duration: leave the key out")
    return _no_less_than_0(number(value, "s"), "s")


def _name(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError("a text is needed")
    if len(value) > LONGEST_NAME:
        raise ValueError(f"names have up to {LONGEST_NAME} characters, this has {len(value)}")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValueError("half of a surrogate pair is no character") from None
    if value.startswith("#"):
        raise ValueError('a name cannot begin with "#", which stands for places in the file: "#2" is the second')
    return value


def _texts(value: Any) -> tuple[str, ...]:
    if isinstance(value, str):
        raise ValueError(f"a list of names is needed: [{show(value)}]")
    if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
        raise ValueError("a list of names is needed")
    return tuple(value)


def _text_or_texts(value: Any) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else _texts(value)


def _sides(value: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError('two lists of object names are needed, such as [["sun"], ["earth", "mars"]]')
    these, those = (_text_or_texts(side) for side in value)
    return these, those


def _pairs(value: Any) -> tuple[tuple[str, str], ...]:
    if not isinstance(value, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in value):
        raise ValueError('a list of pairs of object names is needed, such as [["sun", "earth"], ["earth", "moon"]]')
    found = (_texts(pair) for pair in value)
    return tuple((a, b) for a, b in found)


def _for_pairs(value: Any) -> tuple[tuple[tuple[str, str], dict[str, Any]], ...]:
    example = '{ objects = ["ball", "floor"], restitution = 0.5 }'
    if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
        raise ValueError(f"a list of tables is needed, each of two objects and values, such as [{example}]")
    found = []
    for one in value:
        objects = one.get("objects")
        if not isinstance(objects, list) or len(objects) != 2 or len(one) < 2:
            raise ValueError(f"two objects and values are needed, such as {example}")
        a, b = _texts(objects)
        found.append(((a, b), {key: given for key, given in one.items() if key != "objects"}))
    return tuple(found)


def _force_id(value: Any) -> int | str:
    if isinstance(value, bool) or not isinstance(value, (int, str)):
        raise ValueError("a whole number or a text is needed")
    if isinstance(value, int) and abs(value) >= 1 << 63:
        raise ValueError("a whole number of up to 63 bits is needed")
    return _name(value) if isinstance(value, str) else value


def _switch(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError("true or false is needed")
    return value


def _seed(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 1 << 63:
        raise ValueError("a whole number from 0 up, of at most 63 bits, is needed")
    return value


def _periodic(value: Any) -> tuple[float, float, float]:
    wanted = 'three lengths above 0 m, or "none" along an axis without period, are needed, such as [1.0, "none", 2.0]'
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError(wanted)
    x, y, z = (float("inf") if one == "none" else number(one, "m") for one in value)
    if not min(x, y, z) > 0:
        raise ValueError(wanted)
    return x, y, z


def _columns(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError("a table of numbers is needed, such as { charge = 1e-6 }")
    for name, one in value.items():
        if isinstance(one, bool) or not isinstance(one, (int, float, str)):
            raise ValueError(f"column {name} needs a number")
    return value


def _rows(value: Any, kinds: tuple[type, ...], wanted: str) -> Any:
    """Rows of three numbers, or the text that stands for many of them; what they mean is checked with the shape."""
    if isinstance(value, str) and value.startswith("base64:"):
        return value
    if not isinstance(value, list) or not value:
        raise ValueError(f"{wanted} are needed")
    for k, row in enumerate(value):
        if not isinstance(row, list) or len(row) != 3:
            raise ValueError(f"{wanted} are needed; row {k + 1} is {show(row)}")
        if any(isinstance(one, bool) or not isinstance(one, kinds) for one in row):
            raise ValueError(f"{wanted} are needed; row {k + 1} is {show(row)}")
    return value


def _places(value: Any) -> Any:
    return _rows(value, (int, float), "places, lists of three numbers in m,")


def _triangles(value: Any) -> Any:
    return _rows(value, (int,), "triangles, lists of three whole numbers from 0 up,")


def _orientation(value: Any) -> tuple[float, ...]:
    """A quaternion, an axis and an angle, or three turns about x, y, z."""
    if not isinstance(value, dict):
        return numbers(value, "1", 4)
    if value.keys() == {"axis", "angle"}:
        return from_axis_angle(numbers(value["axis"], "1", 3), number(value["angle"], "rad"))
    if value.keys() in ({"euler"}, {"euler", "order"}):
        return from_euler(numbers(value["euler"], "rad", 3), value.get("order", "xyz"))
    raise ValueError(
        'a quaternion [w, x, y, z], { axis = [...], angle = ... } or { euler = [...], order = "xyz" } is needed'
    )


def _pose(value: Any) -> tuple[tuple[float, ...], ...]:
    if not isinstance(value, list) or len(value) != 4 or not all(isinstance(row, list) for row in value):
        raise ValueError("four rows of four numbers are needed")
    found = tuple(numbers(row, "1", 4) for row in value)
    from_pose(found)
    return found


class Checked:
    """Tells pydantic to take values as ``check`` makes them, and to describe them by ``schema``."""

    def __init__(self, check: Callable[[Any], Any], schema: dict[str, Any]) -> None:
        self.check = check
        self.schema = schema

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return dict(self.schema)


def quantity(unit: str, check: Callable[[float, str], float] | None = None, **bounds: float) -> Checked:
    """Return a number of ``unit`` that ``check`` may refuse."""

    def validate(value: Any) -> float:
        found = number(value, unit)
        return found if check is None else check(found, unit)

    return Checked(validate, json_schema_of(ParamSpec("", "number", unit, **bounds)))  # type: ignore[arg-type]


def quantities(unit: str, count: int = 3) -> Checked:
    """Return a list of ``count`` numbers of ``unit``."""
    schema = json_schema_of(ParamSpec("", "vector", unit, size=count))
    return Checked(lambda value: numbers(value, unit, count), schema)


_MANY = {"anyOf": [{"type": "array", "items": {"type": "array", "items": {"type": "number"}}}, {"type": "string"}]}
_LIST_OF_TEXT: dict[str, Any] = {"type": "array", "items": {"type": "string"}}
_TEXT_OR_LIST = {"anyOf": [{"type": "string"}, _LIST_OF_TEXT]}
_QUANTITY = json_schema_of(ParamSpec("", "number"))["anyOf"]
_THREE = {"type": "array", "items": {"anyOf": _QUANTITY}, "minItems": 3, "maxItems": 3}

Name = Annotated[str, Checked(_name, {"type": "string", "maxLength": LONGEST_NAME, "pattern": "^(?!#)"})]
Names = Annotated[tuple[str, ...], Checked(_texts, _LIST_OF_TEXT)]
NameOrNames = Annotated[tuple[str, ...], Checked(_text_or_texts, _TEXT_OR_LIST)]
Sides = tuple[tuple[str, ...], tuple[str, ...]]
Between = Annotated[Sides, Checked(_sides, {"type": "array", "items": _TEXT_OR_LIST, "minItems": 2, "maxItems": 2})]
Pairs = Annotated[
    tuple[tuple[str, str], ...],
    Checked(_pairs, {"type": "array", "items": {**_LIST_OF_TEXT, "minItems": 2, "maxItems": 2}}),
]
ForPairs = Annotated[
    tuple[tuple[tuple[str, str], dict[str, Any]], ...],
    Checked(
        _for_pairs,
        {
            "type": "array",
            "items": {
                "type": "object",
                "properties": {"objects": {**_LIST_OF_TEXT, "minItems": 2, "maxItems": 2}},
                "required": ["objects"],
                "minProperties": 2,
            },
        },
    ),
]
Switch = Annotated[bool, Checked(_switch, {"type": "boolean"})]
Seed = Annotated[int, Checked(_seed, {"type": "integer", "minimum": 0, "maximum": (1 << 63) - 1})]
Periodic = Annotated[
    tuple[float, float, float],
    Checked(
        _periodic,
        {"type": "array", "items": {"anyOf": [*_QUANTITY, {"const": "none"}]}, "minItems": 3, "maxItems": 3},
    ),
]
Places = Annotated[Any, Checked(_places, _MANY)]
Triangles = Annotated[Any, Checked(_triangles, _MANY)]
Orientation = Annotated[tuple[float, float, float, float], Checked(_orientation, {"type": ["array", "object"]})]
Pose = Annotated[Any, Checked(_pose, {"type": "array", "minItems": 4, "maxItems": 4})]
Length = Annotated[float, quantity("m", _positive, gt=0.0)]
Time = Annotated[float, quantity("s", _positive, gt=0.0)]
Tolerance = Annotated[float, quantity("1", _positive, gt=0.0)]
Mass = Annotated[float, Checked(_mass, json_schema_of(ParamSpec("", "number", "kg", gt=0.0)))]
Inertia = Annotated[float | Vec, Checked(_inertia, {"anyOf": [*_QUANTITY, _THREE]})]
Duration = Annotated[float, Checked(_duration, json_schema_of(ParamSpec("", "number", "s", ge=0.0)))]
ForceId = Annotated[int | str, Checked(_force_id, {"type": ["integer", "string"]})]
Columns = Annotated[dict[str, Any], Checked(_columns, {"type": "object", "additionalProperties": {"anyOf": _QUANTITY}})]


class Table(BaseModel):
    """What all tables share: unknown keys are refused, and nothing is changed later."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class SphereTable(Table):
    """A solid sphere."""

    kind: Literal["sphere"]
    radius: Length


class BoxTable(Table):
    """A solid box of full edge lengths."""

    kind: Literal["box"]
    size: Annotated[Vec, quantities("m")]


class CapsuleTable(Table):
    """A cylinder along the body's z axis with a half sphere on each end; ``length`` is the cylinder's."""

    kind: Literal["capsule"]
    radius: Length
    length: Length


class PlaneTable(Table):
    """The half space behind a plane; without a normal, of the scene's up."""

    kind: Literal["plane"]
    normal: Annotated[Vec, quantities("1")] | None = None
    offset: Annotated[float, quantity("m")] = 0.0


class HullTable(Table):
    """The convex hull of points; or of what a mesh file beside the scene holds."""

    kind: Literal["hull"]
    points: Places | None = None
    faces: Triangles | None = None
    file: str | None = None
    scale: Annotated[float, quantity("1", _positive, gt=0.0)] | None = None


class MeshTable(Table):
    """Triangles, written out or in a mesh file beside the scene (GLB, glTF, OBJ, STL, PLY), ``scale`` times as large."""

    kind: Literal["mesh"]
    vertices: Places | None = None
    faces: Triangles | None = None
    solid: Literal["hull", "none"] | None = None
    file: str | None = None
    scale: Annotated[float, quantity("1", _positive, gt=0.0)] | None = None


class PartTable(Table):
    """A shape of a compound, and where it is: its centre of mass and principal axes, or the frame it was authored in."""

    shape: AnyShape
    position: Annotated[Vec, quantities("m")] = (0.0, 0.0, 0.0)
    orientation: Orientation = (1.0, 0.0, 0.0, 0.0)
    pose: Pose | None = None
    density: Annotated[float, quantity("kg/m^3", _positive, gt=0.0)] | None = None


class CompoundTable(Table):
    """Several shapes that move as one."""

    kind: Literal["compound"]
    parts: list[PartTable]


class PackShapeTable(BaseModel):
    """A shape of a pack, by its id; the other keys are its own parameters."""

    model_config = ConfigDict(extra="allow", frozen=True)
    kind: Annotated[str, Field(pattern=":")]


SHAPES: dict[str, type[BaseModel]] = {
    "sphere": SphereTable,
    "box": BoxTable,
    "capsule": CapsuleTable,
    "plane": PlaneTable,
    "compound": CompoundTable,
    "hull": HullTable,
    "mesh": MeshTable,
}


def _shape_tag(value: Any) -> str | None:
    kind = value.get("kind") if isinstance(value, dict) else None
    return (
        "pack" if isinstance(kind, str) and ":" in kind else kind if isinstance(kind, str) and kind in SHAPES else None
    )


AnyShape = Annotated[
    Annotated[SphereTable, Tag("sphere")]
    | Annotated[BoxTable, Tag("box")]
    | Annotated[CapsuleTable, Tag("capsule")]
    | Annotated[PlaneTable, Tag("plane")]
    | Annotated[CompoundTable, Tag("compound")]
    | Annotated[HullTable, Tag("hull")]
    | Annotated[MeshTable, Tag("mesh")]
    | Annotated[PackShapeTable, Tag("pack")],
    Discriminator(_shape_tag),
]
PartTable.model_rebuild()
CompoundTable.model_rebuild()


class ForceTable(Table):
    """A force on an object; without a duration it acts for ever."""

    vector: Annotated[Vec, quantities("N")] = (0.0, 0.0, 0.0)
    torque: Annotated[Vec, quantities("N*m")] = (0.0, 0.0, 0.0)
    duration: Duration | None = None
    id: ForceId | None = None


class ArrivalTable(Table):
    """Where a carried object will stand, and in how long."""

    position: Annotated[Vec, quantities("m")]
    orientation: Annotated[tuple[float, float, float, float], quantities("1", 4)] = (1.0, 0.0, 0.0, 0.0)
    within: Time


class ObjectTable(Table):
    """A physical object, the laws it obeys, and the forces on it."""

    name: Name = ""
    shape: AnyShape | None = None
    mass: Mass | None = None
    density: Annotated[float, quantity("kg/m^3", _positive, gt=0.0)] | None = None
    position: Annotated[Vec, quantities("m")] = (0.0, 0.0, 0.0)
    velocity: Annotated[Vec, quantities("m/s")] = (0.0, 0.0, 0.0)
    orientation: Orientation = (1.0, 0.0, 0.0, 0.0)
    pose: Pose | None = None
    angular_velocity: Annotated[Vec, quantities("rad/s")] = (0.0, 0.0, 0.0)
    inertia: Inertia | None = None
    fixed: Switch = False
    driven: Switch = False
    arrival: ArrivalTable | None = None
    columns: Annotated[Columns, Field(default_factory=dict)]
    laws: Names = ()
    forces: Annotated[list[ForceTable], Field(default_factory=list)]


class ConditionTable(BaseModel):
    """When a container enforces its laws: the name of a wakeup condition and its own keys."""

    model_config = ConfigDict(extra="allow", frozen=True)
    kind: str


class ContainerTable(Table):
    """A container that several laws share, or that has a name."""

    name: Name = ""
    id: str = ""
    condition: ConditionTable | None = None
    parameters: Annotated[dict[str, Any], Field(default_factory=dict)]


class LawTable(BaseModel):
    """A law by its id; the other keys are its parameters."""

    model_config = ConfigDict(extra="allow", frozen=True)
    id: str
    name: Name = ""
    enabled: Switch = True
    between: Between | None = None
    pairs: Pairs | None = None
    one_sided: Switch = False
    for_pairs: ForPairs | None = None
    container: NameOrNames | None = None
    condition: ConditionTable | None = None


class ProbeTable(Table):
    """A point that the host moves, or that rides on an object."""

    name: str
    position: Annotated[Vec, quantities("m")] | None = None
    attached: str | None = None


class ObserverTable(ProbeTable):
    """A probe with a volume in which laws are awake."""

    radius: Annotated[float, quantity("m", _no_less_than_0, ge=0.0)] = 0.0


class RunTable(Table):
    """What ``xpheve run`` does where its options do not say otherwise."""

    until: Annotated[float, quantity("s", _no_less_than_0, ge=0.0)] | None = None
    dt: Time | None = None
    every: Time | None = None
    rtol: Tolerance | None = None
    atol: Tolerance | None = None
    record: str | None = None


class SceneTable(Table):
    """A scene of xPheve."""

    xpheve: Literal[1]
    up: Literal["x", "y", "z"] = "y"
    seed: Seed = 0
    compile: Literal["auto", "always", "never"] = "auto"
    stepper: str = ""
    periodic: Periodic | None = None
    force_ids: Seed = 0
    run: RunTable = RunTable()
    containers: Annotated[list[ContainerTable], Field(default_factory=list)]
    laws: Annotated[list[LawTable], Field(default_factory=list)]
    objects: Annotated[list[ObjectTable], Field(default_factory=list)]
    observers: Annotated[list[ObserverTable], Field(default_factory=list)]
    probes: Annotated[list[ProbeTable], Field(default_factory=list)]
    schema_file: Annotated[str, Field(alias="$schema")] = ""


def check_scene(source: Source) -> SceneTable:
    """Return the tables of ``source``. Raises `SceneError` for the first thing in it that is wrong."""
    _check_version(source)
    for key, most in (
        ("objects", MOST_OBJECTS),
        ("laws", MOST_LAWS),
        ("containers", MOST_LAWS),
        ("observers", MOST_LAWS),
        ("probes", MOST_LAWS),
    ):
        rows = source.data.get(key)
        if isinstance(rows, list) and len(rows) > most:
            raise source.error(
                (key,), f"{len(rows)} {key} are more than the {most} that are read; build this scene in Python"
            )
    try:
        return SceneTable.model_validate(source.data)
    except UnicodeEncodeError:
        raise SceneError(f"{source.name}: half of a surrogate pair (\\ud800 to \\udfff) is no character") from None
    except ValidationError as wrong:
        found = [(_path_of(row["loc"], source), row) for row in wrong.errors(include_url=False, include_context=True)]
    found.sort(key=lambda pair: source.line(pair[0]))
    (path, row), more = found[0], len(found) - 1
    error = _told(source, path, row)
    if more:
        error = SceneError(f"{error} (and {more} more {'problem' if more == 1 else 'problems'})")
    raise error


def _check_version(source: Source) -> None:
    version = source.data.get("xpheve")
    if version is None:
        first = "xpheve = 1" if source.form == "toml" else '"xpheve": 1'
        raise SceneError(f"{source.name}:1: the version of the format is missing: begin the file with {first}")
    if isinstance(version, bool) or not isinstance(version, int):
        raise source.wrong(("xpheve",), f"the version of the format is a whole number, at present {VERSION}")
    if version != VERSION:
        raise source.wrong(
            ("xpheve",), f"this xPheve reads version {VERSION} of the format; for another one, upgrade it"
        )


def _path_of(location: tuple[int | str, ...], source: Source) -> Path_:
    """Pydantic's location without the tags of unions."""
    path: Path_ = ()
    for step in location:
        if path and path[-1] == "shape" and (step in SHAPES or step == "pack") and not _has(source, path, step):
            continue
        path = (*path, step)
    return path


def _has(source: Source, path: Path_, key: int | str) -> bool:
    table = source.value(path)
    return isinstance(table, dict) and key in table


def _told(source: Source, path: Path_, row: Any) -> SceneError:
    """Return the error for one of pydantic's, in our words."""
    kind = row["type"]
    if kind == "extra_forbidden":
        keys = keys_of(path[:-1], source)
        return source.error(path, f"unknown key.{near(str(path[-1]), keys)} Keys here: {', '.join(keys)}")
    if kind == "missing":
        return source.error(path[:-1], f"the key {path[-1]} is missing")
    if kind.startswith("union_tag"):
        table = source.value(path)
        if not isinstance(table, dict):
            return source.wrong(path, 'a table is needed, such as { kind = "sphere", radius = 0.1 }')
        if "kind" not in table:
            return source.error(path, f"the key kind is missing; shapes are {', '.join(SHAPES)}")
        said = f"no shape is called so.{near(str(table['kind']), SHAPES)} Shapes: {', '.join(SHAPES)}, or a pack's id"
        return source.wrong((*path, "kind"), said)
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return source.wrong(path, "a table is needed")
    if kind == "list_type":
        return source.wrong(path, f"a list of tables is needed: [[{path[-1]}]]")
    if kind == "literal_error":
        return source.wrong(path, f"choose one of {row['ctx']['expected'].replace(' or ', ', ')}")
    if kind == "string_type":
        return source.wrong(path, "a text is needed")
    return source.wrong(path, str(row["msg"]).removeprefix("Value error, "))


def near(word: str, known: Any) -> str:
    """Return a sentence on what ``word`` was probably meant to be, or nothing."""
    found = closest(word, known)
    return f' Did you mean "{found}"?' if found else ""


def keys_of(path: Path_, source: Source) -> list[str]:
    """Return the keys that the table at ``path`` may have."""
    names = [step for step in path if isinstance(step, str)]
    tables: dict[str, type[BaseModel]] = {
        "": SceneTable,
        "run": RunTable,
        "containers": ContainerTable,
        "laws": LawTable,
        "objects": ObjectTable,
        "forces": ForceTable,
        "arrival": ArrivalTable,
        "parts": PartTable,
        "observers": ObserverTable,
        "probes": ProbeTable,
    }
    last = names[-1] if names else ""
    if last == "shape":
        table = source.value(path)
        model: type[BaseModel] = SHAPES.get(str(table.get("kind")) if isinstance(table, dict) else "", PackShapeTable)
    else:
        model = tables.get(last, SceneTable)
    return [name for name, field in model.model_fields.items() if not field.alias]
