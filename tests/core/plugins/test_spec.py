"""LawSpec: what a law's class says of itself, checked when its pack is loaded, and its parameters as a schema."""

from __future__ import annotations

import json
import math
from typing import Any, ClassVar, cast

import pydantic
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xpheve.errors import LawDefinitionError
from xpheve.laws import Column, FieldLaw, PairLaw, Param, PhysicalLaw, ResponseLaw
from xpheve.laws.conditions import Elapsed
from xpheve.plugins.spec import ColumnSpec, LawSpec, ParamSpec, check_spec, parameters_model, spec_of


class Drag(FieldLaw):
    """Quadratic drag: F = -c |v| v,
    against the air.

    Holds for fast spheres.

    Source: Newton (1687),
    book II.

    More.
    """

    id = "aero:drag"
    role = "drag"
    columns: ClassVar[dict[str, Column]] = {"charge": Column(math.nan, unit="C", doc="Charge.")}
    before = ("aero:wind",)
    exclusive = frozenset({"b", "a"})
    c = Param(0.1, unit="kg/m", gt=0, doc="0.5 * rho * C_d * A")
    wind = Param((0.0, 0.0, 0.0), unit="m/s")
    model = Param("smooth", choices=("smooth", "rough"))
    on = Param(True)
    limit = Param(None, unit="m/s", ge=0)
    far = Param(math.inf, unit="m")

    def force(self, body: Any) -> Any:
        return -self.c * body.velocity.norm() * body.velocity

    def potential(self, body: Any) -> Any:
        return 0.0


class Spring(PairLaw):
    """A spring."""

    id = "aero:spring"

    def force(self, a: Any, b: Any) -> Any:
        return a.position - b.position


def test_a_spec_says_what_the_class_says() -> None:
    spec = spec_of(Drag)
    assert (spec.id, spec.role, spec.kind, spec.has_potential) == ("aero:drag", "drag", "field", True)
    assert spec.doc == "Quadratic drag: F = -c |v| v, against the air."
    assert spec.cite == "Newton (1687), book II."
    assert spec.before == ("aero:wind",)
    assert spec.exclusive == ("a", "b")
    assert [param.name for param in spec.params] == ["c", "wind", "model", "on", "limit", "far"]
    assert [param.kind for param in spec.params] == ["number", "vector", "text", "switch", "number", "number"]
    assert spec.params[0] == ParamSpec("c", "number", "kg/m", 0.1, "0.5 * rho * C_d * A", gt=0)
    assert spec.columns[0].name == "charge" and math.isnan(spec.columns[0].default)
    check_spec(spec, Drag, pack="aero")


def test_the_kinds_of_laws_are_told_apart() -> None:
    assert spec_of(Spring).kind == "pair"
    assert not spec_of(Spring).has_potential
    assert spec_of(ResponseLaw).kind == "response"
    assert spec_of(ResponseLaw).condition == "Impact()"
    assert spec_of(PhysicalLaw).kind == "free"


def test_a_spec_survives_json() -> None:
    text = json.dumps(spec_of(Drag).to_dict(), allow_nan=False)
    again = LawSpec.from_dict(json.loads(text))
    assert again.params == spec_of(Drag).params
    assert again.to_dict() == spec_of(Drag).to_dict()


@pytest.mark.parametrize(
    "entry",
    [3, [], "x", {}, {"id": "a:b"}, {"id": "a:b", "role": "x", "kind": 3}, {"id": "a:b", "role": "x", "kind": "y",
     "params": 5}, {"id": "a:b", "role": "x", "kind": "y", "params": [3]}, {"id": "a:b", "role": "x", "kind": "y",
     "params": [{"name": "c", "kind": "number", "default": {"x": 1}}]}, {"id": "a:b", "role": "x", "kind": "y",
     "before": "a:c"}, {"id": "a:b", "role": "x", "kind": "y", "priority": "high"}],
)  # fmt: skip
def test_an_entry_that_is_no_spec_is_refused(entry: Any) -> None:
    with pytest.raises(ValueError, match=r"law|param"):
        LawSpec.from_dict(entry)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=10,
)
fields = st.sampled_from([*LawSpec.__dataclass_fields__, *ParamSpec.__dataclass_fields__, "other"])


@given(st.dictionaries(fields, json_values, max_size=6))
def test_any_json_is_a_spec_or_a_value_error(entry: Any) -> None:
    try:
        LawSpec.from_dict({"id": "a:b", "role": "x", "kind": "field", **entry})
    except ValueError:
        pass


def law_with(**body: object) -> type[FieldLaw]:
    base: dict[str, object] = {"id": "aero:x", "force": lambda self, body: body.velocity, "__doc__": "A law."}
    return type("Odd", (FieldLaw,), base | body)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ({"id": "aero"}, "id = 'aero': String should match pattern"),
        ({"id": "aero:x\n"}, "id = 'aero:x\\n': String should match"),
        ({"id": 3}, "id = 3: Input should be a valid string"),
        ({"id": "other:x"}, 'ids begin with the name of their pack, here "aero:x"'),
        ({"role": ""}, "role = '': String should match pattern"),
        ({"priority": 1.5}, "priority = 1.5: Input should be a valid integer"),
        ({"priority": True}, "priority = True: Input should be a valid integer"),
        ({"before": "aero:y"}, "before = 'aero:y': Input should be a valid tuple"),
        ({"after": ("wind",)}, "after.0 = 'wind': String should match pattern"),
        ({"exclusive": "contact"}, "exclusive = 'contact': Input should be a valid tuple"),
        ({"container": "Start"}, "container = 'Start': String should match pattern"),
        ({"condition": Elapsed}, "condition = <class"),
        ({"columns": {"charge": Column(unit="Coulomb")}}, "columns.charge.unit = 'Coulomb': \"Coulomb\" is no unit"),
        ({"columns": {"my charge": Column()}}, "columns.my charge.name = 'my charge'"),
        (
            {"columns": {"time": Column()}},
            "columns.time.name = 'time': every object, or its view, has something of this name",
        ),
        ({"c": Param(1.0, unit="deg")}, "params.c.unit = 'deg': unit \"deg\" is not SI"),
        ({"c": Param(1.0, unit=cast(str, 5))}, "params.c.unit = 5: Input should be a valid string"),
        ({"c": Param(5.0, le=4.0)}, "the default does not fit the declaration of c"),
        ({"c": Param((1.0, math.nan))}, "the default does not fit the declaration of c"),
        ({"c": Param(1.0, gt=2, lt=2)}, "no value lies between the bounds 2 and 2"),
        ({"c": Param(1.0, ge=math.nan)}, "params.c.ge = nan"),
        ({"c": Param([])}, "the default does not fit the declaration of c"),
        ({"engine": Param(1.0)}, "every law has something of this name"),
    ],
)
def test_an_unsound_interface_names_class_field_and_value(body: Any, said: str) -> None:
    law = law_with(**body)
    with pytest.raises(LawDefinitionError) as caught:
        check_spec(spec_of(law), law, pack="aero")
    assert "Odd" in str(caught.value)
    assert said in str(caught.value)


def test_a_plain_value_that_hides_a_parameter_is_found() -> None:
    heavy = type("Heavy", (Drag,), {"id": "aero:heavy", "c": 3.0})
    with pytest.raises(LawDefinitionError, match=r"Heavy: c = 3\.0 hides the parameter 'c'; write c = Param\(3\.0"):
        spec_of(heavy)


def test_the_model_of_parameters_takes_quantities_and_refuses_the_rest() -> None:
    model = parameters_model(Drag)
    filled = model(c="100 g/m", wind=["36 km/h", 0, 0], model="rough", on=False)
    assert filled.model_dump(exclude={"far"}) == {
        "c": 0.1, "wind": (10.0, 0.0, 0.0), "model": "rough", "on": False, "limit": None,
    }  # fmt: skip
    assert model() == model(c=0.1)
    cases: list[tuple[dict[str, Any], str]] = [
        ({"cd": 1.0}, "Extra inputs are not permitted"),
        ({"c": -1.0}, r"aero:drag.c = -1.0 kg/m: must be > 0"),
        ({"c": "1 N"}, r"unit N is kg\*m/s\^2 \(force\), needs kg/m"),
        ({"wind": [1, 2]}, "3 numbers are needed"),
        ({"model": "smoth"}, 'Did you mean "smooth"?'),
        ({"on": 1}, "give True or False"),
        ({"limit": math.nan}, "a finite number"),
    ]
    for wrong, said in cases:
        with pytest.raises(pydantic.ValidationError, match=said.replace("?", r"\?")):
            model(**wrong)
    assert parameters_model(Drag) is model


def test_the_schema_of_parameters_has_units_and_bounds() -> None:
    schema = parameters_model(Drag).model_json_schema()
    assert schema["additionalProperties"] is False
    c, limit = schema["properties"]["c"], schema["properties"]["limit"]
    assert (c["unit"], c["dim"], c["default"]) == ("kg/m", [1, -1, 0, 0, 0, 0, 0], 0.1)
    assert c["anyOf"][0] == {"type": "number", "exclusiveMinimum": 0}
    assert c["description"] == "0.5 * rho * C_d * A"
    assert {"type": "null"} in limit["anyOf"]
    assert schema["properties"]["model"]["enum"] == ["smooth", "rough"]
    assert schema["properties"]["wind"]["minItems"] == 3
    assert "unit" not in schema["properties"]["on"]
    json.dumps(schema)


def test_columns_not_given_are_equal_after_json() -> None:
    column = LawSpec("a:b", "x", "field", columns=(ColumnSpec("charge", "C", math.nan),))
    assert LawSpec.from_dict(column.to_dict()).to_dict() == column.to_dict()
