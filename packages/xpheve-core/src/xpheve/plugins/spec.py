"""LawSpec: the interface of a law, read off its class; checked by pydantic when its pack is loaded, never later."""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

from xpheve.errors import LawDefinitionError, ParameterError, UnitError
from xpheve.laws import API_VERSION, Column, FieldLaw, FlowLaw, PairLaw, Param, PhysicalLaw, ResponseLaw
from xpheve.laws.conditions import Condition
from xpheve.units import check_unit, dimension

if TYPE_CHECKING:
    from pydantic import BaseModel

__all__ = ["ColumnSpec", "LawSpec", "ParamSpec", "check_spec", "default_api", "parameters_model", "spec_of"]

T = TypeVar("T")

ID_PATTERN = r"^[a-z0-9_-]+:[a-z0-9_]+$"
KINDS = ("field", "pair", "flow", "response", "free")
PARAM_KINDS = ("number", "integer", "vector", "text", "switch")

# Names that a parameter cannot have, since a law's constructor or the law itself already uses them.
RESERVED = frozenset(dir(PhysicalLaw)) | {
    "name", "enabled", "between", "pairs", "state", "containers", "evaluations", "engine", "parameters", "force", "torque",
    "potential", "respond", "flow", "law",
}  # fmt: skip

# Names that a column cannot have, since a view of objects, or the constructor of an object, already uses them.
EVERY_OBJECTS = frozenset({
    "position", "velocity", "orientation", "angular_velocity", "mass", "inertia", "volume", "since", "time", "up", "to_world", "to_body",
    "shape", "fixed", "name",
})  # fmt: skip


@dataclass(frozen=True, slots=True)
class ParamSpec:
    """What is known of a parameter without its class; fields as in `xpheve.laws.Param`."""

    name: str
    kind: str
    unit: str = "1"
    default: Any = None
    doc: str = ""
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None
    choices: tuple[str, ...] = ()
    size: int = 0
    optional: bool = False


@dataclass(frozen=True, slots=True)
class ColumnSpec:
    """What is known of a column without its class; ``default`` is NaN for "not given"."""

    name: str
    unit: str = "1"
    default: float = 0.0
    doc: str = ""


@dataclass(frozen=True, slots=True)
class LawSpec:
    """The interface of a law: a plain frozen value, the same whether read off the class or out of a manifest."""

    id: str
    role: str
    kind: str
    api: str = ""
    params: tuple[ParamSpec, ...] = ()
    columns: tuple[ColumnSpec, ...] = ()
    condition: str = ""
    container: str = ""
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    priority: int = 0
    exclusive: tuple[str, ...] = ()
    doc: str = ""
    cite: str = ""
    has_potential: bool = False
    form: str = ""
    """How a field or pair law says its force: "formula" (traced), "apply" (NumPy, called) or "kernel" (a file written by hand)."""
    nature: str = ""
    """Of a formula with the default parameters: what it depends on, whether it is constant, linear, conservative; what it costs."""

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON can hold it; fields at their default are left out."""
        return _to_dict(self)

    @classmethod
    def from_dict(cls, entry: Mapping[str, Any]) -> LawSpec:
        """Return the spec that `to_dict` wrote. Raises ValueError if ``entry`` is none; nothing is executed."""
        return _from_dict(cls, entry, "law")


def default_api() -> str:
    """Return the versions of the law contract that a pack written today is for, such as ``">=1,<2"``."""
    return f">={API_VERSION},<{API_VERSION + 1}"


def kind_of(law: type[PhysicalLaw]) -> str:
    """Return ``"field"``, ``"pair"``, ``"flow"``, ``"response"`` or ``"free"``."""
    for base, kind in ((FieldLaw, "field"), (PairLaw, "pair"), (FlowLaw, "flow"), (ResponseLaw, "response")):
        if issubclass(law, base):
            return kind
    return "free"


def spec_of(law: type[PhysicalLaw]) -> LawSpec:
    """Return the interface of ``law``, as its class says; see `check_spec` for whether that makes sense.

    Raises
    ------
    LawDefinitionError
        If something that the class says cannot even be read, such as a plain value that hides a parameter.

    """
    if not (isinstance(law, type) and issubclass(law, PhysicalLaw)):
        raise LawDefinitionError(
            f"{law!r} is no law class: derive from FieldLaw, PairLaw, FlowLaw, ResponseLaw or PhysicalLaw"
        )
    where = f"{law.__module__}.{law.__qualname__}"
    for name in law.params:
        if not isinstance(inspect.getattr_static(law, name, None), Param):
            raise LawDefinitionError(
                f"{where}: {name} = {getattr(law, name, None)!r} hides the parameter {name!r}; "
                f"write {name} = Param({getattr(law, name, None)!r}, ...)"
            )
    columns = law.columns
    if not isinstance(columns, Mapping) or not all(isinstance(column, Column) for column in columns.values()):
        raise LawDefinitionError(f'{where}: columns = {columns!r}: write {{"charge": Column(0.0, unit="C")}}')
    condition: object = law.condition
    if condition is not None and not isinstance(condition, Condition):
        raise LawDefinitionError(f"{where}: condition = {condition!r}: give one such as xpheve.when.Elapsed(1.0)")
    doc = inspect.cleandoc(law.__doc__ or "")
    return LawSpec(
        id=law.id,
        role=law.role,
        kind=kind_of(law),
        api=law.__dict__["api"] if isinstance(law.__dict__.get("api"), str) else default_api(),
        params=tuple(_param_spec(name, param) for name, param in law.params.items()),
        columns=tuple(ColumnSpec(name, column.unit, column.default, column.doc) for name, column in columns.items()),
        condition="" if condition is None else str(condition),
        container=law.container,
        before=_as_tuple(law.before),
        after=_as_tuple(law.after),
        priority=law.priority,
        exclusive=tuple(sorted(law.exclusive)) if isinstance(law.exclusive, (set, frozenset)) else law.exclusive,
        doc=doc.partition("\n\n")[0].replace("\n", " "),
        cite=_cite(doc),
        has_potential=issubclass(law, (FieldLaw, PairLaw, FlowLaw)) and law.defines("potential"),
        form=form_of(law),
    )


def form_of(law: type[PhysicalLaw]) -> str:
    """Return how ``law`` says its force: ``"formula"``, ``"apply"`` or ``"kernel"``; empty if it has none."""
    if not issubclass(law, (FieldLaw, PairLaw)):
        return ""
    for form, written in (
        ("apply", law.defines("apply")),
        ("formula", law.defines("force") or law.defines("torque")),
        ("kernel", bool(law.kernel)),
    ):
        if written:
            return form
    return ""


def nature_words(law: type[PhysicalLaw]) -> str:
    """Return what `xpheve.trace.nature` says of ``law`` with its default parameters; empty if it is not traced, or cannot be made so.

    Raises
    ------
    TraceError
        If the law should be a formula, and is none.

    """
    if form_of(law) != "formula":
        return ""
    from xpheve.trace.check import nature_of

    try:
        made: Any = law()
    except Exception:  # whoever makes one hears of it
        return ""
    found = nature_of(made)
    return "" if found is None else found.words()


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _param_spec(name: str, param: Param) -> ParamSpec:
    return ParamSpec(
        name=name,
        kind=param.kind,
        unit=param.unit,
        default=param.default,
        doc=param.doc,
        gt=param.gt,
        ge=param.ge,
        lt=param.lt,
        le=param.le,
        choices=tuple(param.choices),
        size=param.size,
        optional=param.optional,
    )


def _cite(doc: str) -> str:
    """Return what follows ``Source:`` up to the next empty line."""
    lines: list[str] = []
    for line in doc.splitlines():
        if lines and not line.strip():
            break
        if lines or line.strip().startswith("Source:"):
            lines.append(line.strip().removeprefix("Source:").strip())
    return " ".join(line for line in lines if line)


# The check ------------------------------------------------------------------------------------------------------------


def check_spec(spec: LawSpec, law: type[PhysicalLaw] | None = None, *, pack: str = "") -> None:
    """Raise `LawDefinitionError`, naming class, field and value, unless ``spec`` is a sound interface.

    Parameters
    ----------
    spec
        What to check.
    law
        The class that it was read off: its defaults are then held against its bounds.
    pack
        The pack that offers it: the id must begin with its name.

    """
    where = f"{law.__module__}.{law.__qualname__}" if law is not None else spec.id
    if not spec.id:
        raise LawDefinitionError(f'{where} has no id: give it one, such as id = "{pack or "pack"}:name"')
    from pydantic import ValidationError

    try:
        _twin().model_validate(_as_plain(spec))
    except ValidationError as wrong:
        first = wrong.errors(include_url=False)[0]
        field = ".".join(_step(spec, first["loc"], index) for index in range(len(first["loc"])))
        message = first["msg"].removeprefix("Value error, ")
        raise LawDefinitionError(f"{where}: {field} = {_short(first['input'])}: {message}") from None
    if pack and spec.id.partition(":")[0] != pack:
        raise LawDefinitionError(
            f'{where}: id = "{spec.id}": ids begin with the name of their pack, here '
            f'"{pack}:{spec.id.partition(":")[2]}"'
        )
    for name, param in (law.params if law is not None else {}).items():
        _check_default(where, name, param)


def _check_default(where: str, name: str, param: Param) -> None:
    values = param.default if isinstance(param.default, tuple) else (param.default,)
    numbers = all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values)
    if param.default is None or (numbers and any(math.isinf(value) for value in values)):
        return  # "not given", and "without limit", which no scene file can write
    try:
        param.check(param.default, where)
    except ParameterError as wrong:
        raise LawDefinitionError(f"{where}: the default does not fit the declaration of {name}: {wrong}") from None


@lru_cache(maxsize=1)
def _twin() -> type[BaseModel]:
    """Return the pydantic twin of `LawSpec`; built when the first pack is loaded, since pydantic is slow to import."""
    from typing import Annotated, Literal

    from pydantic import AfterValidator, ConfigDict, Field, create_model, model_validator

    def known_unit(unit: str) -> str:
        try:
            check_unit(unit)
        except UnitError as wrong:
            raise ValueError(str(wrong)) from None
        return unit

    def free_name(name: str) -> str:
        if name in RESERVED:
            raise ValueError("every law has something of this name; call the parameter something else")
        return name

    def free_column(name: str) -> str:
        if name in EVERY_OBJECTS:
            raise ValueError("every object, or its view, has something of this name; call the column something else")
        return name

    def bounds_hold(self: Any) -> Any:
        low = max((b for b in (self.gt, self.ge) if b is not None), default=-math.inf)
        high = min((b for b in (self.lt, self.le) if b is not None), default=math.inf)
        if low > high or (low == high and (self.gt == low or self.lt == high)):
            raise ValueError(f"no value lies between the bounds {low:g} and {high:g}")
        return self

    strict = ConfigDict(extra="forbid", frozen=True, strict=True)
    identifier = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
    unit = Annotated[str, AfterValidator(known_unit)]
    law_id = Annotated[str, Field(pattern=ID_PATTERN)]
    bound = Annotated[float | None, Field(allow_inf_nan=False)]
    word = Annotated[str, Field(pattern=r"^[a-z0-9_-]+$")]

    param_fields: dict[str, Any] = {
        "name": (Annotated[identifier, AfterValidator(free_name)], ...),
        "kind": (Literal[PARAM_KINDS], ...),
        "unit": (unit, "1"),
        "default": (Any, None),
        "doc": (str, ""),
        "gt": (bound, None),
        "ge": (bound, None),
        "lt": (bound, None),
        "le": (bound, None),
        "choices": (tuple[str, ...], ()),
        "size": (Annotated[int, Field(ge=0, le=1000)], 0),
        "optional": (bool, False),
    }
    hold: Any = model_validator(mode="after")(bounds_hold)
    param: Any = create_model("ParamModel", __config__=strict, __validators__={"bounds": hold}, **param_fields)
    column_fields: dict[str, Any] = {
        "name": (Annotated[identifier, AfterValidator(free_column)], ...),
        "unit": (unit, "1"),
        "default": (float, 0.0),
        "doc": (str, ""),
    }
    column: Any = create_model("ColumnModel", __config__=strict, **column_fields)
    law_fields: dict[str, Any] = {
        "id": (law_id, ...),
        "role": (word, ...),
        "kind": (Literal[KINDS], ...),
        "api": (str, ""),
        "params": (tuple[param, ...], ()),
        "columns": (tuple[column, ...], ()),
        "condition": (str, ""),
        "container": (Annotated[str, Field(pattern=r"^$|" + ID_PATTERN)], ""),
        "before": (tuple[law_id, ...], ()),
        "after": (tuple[law_id, ...], ()),
        "priority": (int, 0),
        "exclusive": (tuple[word, ...], ()),
        "doc": (str, ""),
        "cite": (str, ""),
        "has_potential": (bool, False),
        "form": (Literal["", "formula", "apply", "kernel"], ""),
        "nature": (str, ""),
    }
    return create_model("LawModel", __config__=strict, **law_fields)


def _step(spec: LawSpec, location: tuple[int | str, ...], index: int) -> str:
    """Return one step of pydantic's location, with the names of parameters and columns for their numbers."""
    step = location[index]
    rows: Any = {"params": spec.params, "columns": spec.columns}.get(str(location[0]))
    if index == 1 and isinstance(step, int) and rows is not None and step < len(rows):
        return str(rows[step].name)
    return str(step)


def _short(value: Any) -> str:
    if isinstance(value, dict) and "name" in value:
        value = {key: kept for key, kept in value.items() if kept not in (None, "", (), 0, False)}
    text = repr(value)
    return text if len(text) <= 120 else text[:117] + "..."


def _as_plain(value: Any) -> Any:
    if isinstance(value, (LawSpec, ParamSpec, ColumnSpec)):
        return {field.name: _as_plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, tuple) and value and isinstance(value[0], (ParamSpec, ColumnSpec)):
        return tuple(_as_plain(item) for item in value)
    return value


# Parameters in scene files --------------------------------------------------------------------------------------------


@lru_cache(maxsize=512)
def parameters_model(law: type[PhysicalLaw]) -> type[BaseModel]:
    """Return a pydantic model of the parameters of ``law``, for scene files and their JSON schema.

    Values are taken as `Param.check` takes them (SI numbers, or text with a unit); unknown names are refused.
    """
    from typing import Annotated

    from pydantic import ConfigDict, Field, PlainValidator, WithJsonSchema, create_model

    owner = law.label()
    found: dict[str, Any] = {}
    for name, param in law.params.items():
        kind = Annotated[
            Any,
            PlainValidator(lambda value, param=param: param.check(value, owner)),
            WithJsonSchema(json_schema_of(_param_spec(name, param))),
        ]
        found[name] = (kind, Field(default=param.default))
    doc = inspect.cleandoc(law.__doc__ or "").partition("\n")[0]
    title = "".join(part.capitalize() for part in owner.replace("-", "_").replace(":", "_").split("_"))
    return create_model(title, __config__=ConfigDict(extra="forbid", frozen=True, title=owner), __doc__=doc, **found)


QUANTITY_PATTERN = r"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?(\s*[^\s\d].*|\s+1\s*/.*)?$"


def json_schema_of(param: ParamSpec) -> dict[str, Any]:
    """Return the JSON schema of values of ``param``: with unit, dimension (kg, m, s, A, K, mol, cd) and bounds."""
    bounds = {"exclusiveMinimum": param.gt, "minimum": param.ge, "exclusiveMaximum": param.lt, "maximum": param.le}
    number: dict[str, Any] = {"type": "number", **{key: bound for key, bound in bounds.items() if bound is not None}}
    quantity = {"anyOf": [number, {"type": "string", "pattern": QUANTITY_PATTERN}]}
    kinds: dict[str, dict[str, Any]] = {
        "vector": {"type": "array", "items": quantity, "minItems": param.size, "maxItems": param.size},
        "text": {"type": "string", **({"enum": list(param.choices)} if param.choices else {})},
        "switch": {"type": "boolean"},
    }
    schema = kinds.get(param.kind, quantity)
    if param.optional:
        schema = {"anyOf": [*schema["anyOf"], {"type": "null"}] if "anyOf" in schema else [schema, {"type": "null"}]}
    else:
        schema = dict(schema)
    if param.doc:
        schema["description"] = param.doc
    if param.kind not in ("text", "switch"):
        schema["unit"] = param.unit
        schema["dim"] = list(dimension(param.unit))
    return schema


# To and from JSON -----------------------------------------------------------------------------------------------------

# Types that the fields of a manifest's entries must have; ``float`` takes whole numbers too.
EXPECTED: dict[str, tuple[type, ...]] = {
    "priority": (int,), "size": (int,), "optional": (bool,), "has_potential": (bool,),
    "gt": (int, float), "ge": (int, float), "lt": (int, float), "le": (int, float),
}  # fmt: skip
TEXTS = ("choices", "before", "after", "exclusive")


def _to_dict(spec: Any) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for field in fields(spec):
        value = getattr(spec, field.name)
        if value == field.default and type(value) is type(field.default):
            continue
        if isinstance(value, tuple) and value and isinstance(value[0], (ParamSpec, ColumnSpec)):
            value = [_to_dict(row) for row in value]
        found[field.name] = _to_json(value)
    return found


def _to_json(value: Any) -> Any:
    """Return ``value`` for JSON, which has neither tuples nor NaN nor infinity."""
    if isinstance(value, tuple):
        return [_to_json(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return {"float": repr(value)}
    return value


def _from_json(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_from_json(item) for item in value)
    if isinstance(value, dict):
        if list(value) != ["float"] or value["float"] not in ("nan", "inf", "-inf"):
            raise ValueError(f"{_short(value)} is no value of a parameter")
        return float(value["float"])
    return value


def _from_dict(cls: type[T], entry: Any, what: str) -> T:
    if not isinstance(entry, Mapping):
        raise ValueError(f"a {what} is {_short(entry)}, not a table")
    known = {field.name for field in fields(cls)}  # type: ignore[arg-type]
    found: dict[str, Any] = {}
    for name, value in entry.items():
        if name not in known:
            continue  # written by a later xpheve
        if name in ("params", "columns"):
            if not isinstance(value, list):
                raise ValueError(f"{name} of a {what} is {_short(value)}, not a list")
            row = ParamSpec if name == "params" else ColumnSpec
            found[name] = tuple(_from_dict(row, item, name[:-1]) for item in value)
        elif name == "default":
            found[name] = _from_json(value)
        elif name in TEXTS:
            if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
                raise ValueError(f"{name} of a {what} is {_short(value)}, not a list of texts")
            found[name] = tuple(value)
        elif not isinstance(value, EXPECTED.get(name, (str,))):
            raise ValueError(f"{name} of a {what} is {_short(value)}")
        else:
            found[name] = value
    try:
        return cls(**found)
    except TypeError as wrong:
        raise ValueError(f"a {what} lacks something: {wrong}") from None
