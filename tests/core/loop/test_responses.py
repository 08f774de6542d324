"""Responses of collision laws as one text: what it answers is what the laws answer in Python, to the bit, or it asks them."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
import xpheve_laws_collision as collision
from xpheve.compile import assemble, interpreted
from xpheve.kernels import response as layout
from xpheve.laws import Column, Contact, Impulse, ResponseLaw, Velocities
from xpheve.loop.response_check import contacts, python_answer, same, scratch_of
from xpheve.loop.responses import Responses

ENTRY = "\n\ndef entry(f, n):\n    return respond(f, n)\n"


class Fused:
    """The text of some laws, ready to be asked."""

    def __init__(self, *laws: ResponseLaw, columns: tuple[str, ...] = ()) -> None:
        self.responses = Responses(laws, columns)
        self.run = interpreted(assemble(self.responses.text + ENTRY, self.responses.files))
        self.table, self.places = self.responses.parameters()

    def ask(self, contact: Contact, law: int = 0) -> tuple[int, tuple[float, ...]]:
        scratch = scratch_of(contact, self.responses.columns)
        branch, place = self.places[law]
        kind = self.run([scratch, self.table], [np.array([law, branch, place], dtype=np.int64)])
        assert scratch[layout.KIND] == kind
        return kind, tuple(scratch[layout.VALUES : layout.VALUES + (1, 3, 6, 0)[kind]].tolist())


def agree(law: ResponseLaw, asks: int = 0, samples: int = 60, columns: tuple[str, ...] = ()) -> Fused:
    """A law is fused, and answers as it does in Python; ``asks`` is how often the text may leave it to Python."""
    fused = Fused(law, columns=columns)
    assert fused.responses.why(law) == ""
    asked = 0
    for contact in contacts(law, fused.responses.columns, samples, seed=7):
        expected, found = python_answer(law, contact), fused.ask(contact)
        if found[0] == layout.ASK:
            asked += 1
        else:
            assert same(expected, found), (expected, found)
    assert asked <= asks
    return fused


class Plain(ResponseLaw):
    """What a newcomer writes."""

    id = "test:plain"
    columns: ClassVar[dict[str, Column]] = {"bounce": Column(math.nan, ge=0, le=1)}
    limit = xp.Param(2.0, unit="m/s")
    soft = xp.Param(False)
    mode = xp.Param("slow", choices=("slow", "fast"))
    wind = xp.Param((1.0, -2.0, 0.5), unit="m/s")

    def respond(self, contact: Contact) -> float:
        v = contact.approach_speed
        if v < self.limit:
            return 0.0
        own = contact.body_a["bounce"]
        if math.isnan(own):
            own = 0.5 if self.mode == "slow" else 0.9
        return min(own * v, self.limit + max(0.0, self.wind[0]))


def test_plain_python_with_decisions_is_fused() -> None:
    fused = agree(Plain())
    assert fused.responses.columns == ("bounce",)
    assert fused.responses.partly(fused.responses.laws[0]) == ""


def test_choices_are_branches_and_numbers_are_not() -> None:
    laws = [Plain(), Plain(limit=3.0), Plain(mode="fast"), Plain(limit=9.0, mode="fast")]
    fused = Fused(*laws)
    assert [branch for branch, _ in fused.places] == [0, 0, 1, 1]
    assert [place for _, place in fused.places] == [0, 2, 4, 6]
    for number, law in enumerate(laws):
        for contact in contacts(law, fused.responses.columns, 20, seed=number):
            assert same(python_answer(law, contact), fused.ask(contact, number))


def test_a_changed_parameter_is_a_changed_number_and_no_other_text() -> None:
    law = Plain()
    fused = Fused(law)
    law.set_parameter("limit", 0.25)
    fused.table, _ = fused.responses.parameters()
    for contact in contacts(law, fused.responses.columns, 20):
        assert same(python_answer(law, contact), fused.ask(contact))


def test_a_changed_choice_is_another_text() -> None:
    law = Plain()
    responses = Responses([law])
    law.set_parameter("limit", 0.25)
    assert responses.current
    law.set_parameter("mode", "fast")
    assert not responses.current


def test_values_for_pairs_are_looked_up_in_python() -> None:
    law = collision.Elastic()
    responses = Responses([law])
    law.put_pairs({frozenset(): {"restitution": 0.5}})
    assert not responses.current
    assert "single pairs" in Responses([law]).why(law)


class Coulomb(ResponseLaw):
    """Impulse with friction, written without any vector class."""

    id = "test:coulomb"
    e = xp.Param(0.8, unit="1")
    mu = xp.Param(0.3, unit="1")

    def respond(self, contact: Contact) -> Impulse:
        a, b, n = contact.body_a, contact.body_b, contact.normal
        slip = [q - p for p, q in zip(a.velocity, b.velocity, strict=True)]
        along = sum(u * c for u, c in zip(slip, n, strict=True))
        across = [u - along * c for u, c in zip(slip, n, strict=True)]
        size = math.sqrt(sum(u * u for u in across))
        weights = (0.0 if a.fixed else 1.0 / a.mass) + (0.0 if b.fixed else 1.0 / b.mass)
        push = (1.0 + self.e) * contact.approach_speed / weights
        if size == 0.0:
            return Impulse(push * c for c in n)
        drag = min(self.mu * push, size / weights) / size
        return Impulse(push * c - drag * u for c, u in zip(n, across, strict=True))


def test_an_impulse_of_sums_and_roots_is_fused() -> None:
    agree(Coulomb())


class Vectors(ResponseLaw):
    """The same with xp.vector."""

    id = "test:vectors"

    def respond(self, contact: Contact) -> Velocities:
        n, v = xp.vector(*contact.normal), xp.vector(*contact.body_b.velocity)
        turned = v - 2.0 * v.dot(n) * n
        return Velocities(contact.body_a.velocity, turned + xp.where(contact.body_a.fixed, 0.0, 1.0) * n.cross(v))


def test_vectors_of_the_house_are_fused() -> None:
    agree(Vectors())


class Everything(ResponseLaw):
    """All that a contact and its bodies have."""

    id = "test:everything"
    columns: ClassVar[dict[str, Column]] = {"heat": Column(300.0, unit="K", gt=0)}

    def respond(self, contact: Contact) -> Velocities:
        a, b = contact.body_a, contact.body_b
        x = [*contact.point, contact.separation, *a.position, *b.orientation, *a.inertia, *b.angular_velocity]
        total = 0.0
        for one in x:
            total += abs(one)
        grown = math.exp(-total) + math.atan2(a.mass, b.mass) + math.log1p(a["heat"]) + math.pow(b.heat, 0.25)
        return Velocities((grown, a.shape.radius, -b.shape.radius), (total, a.mass**2, 1.0 / b.mass))


def test_all_that_a_contact_has_can_be_read() -> None:
    agree(Everything())


class Careless(ResponseLaw):
    """Divides by what may be 0, and takes roots of what may be below it."""

    id = "test:careless"

    def respond(self, contact: Contact) -> float:
        vx = contact.body_a.velocity[0]
        return min(1.0, 1.0 / vx) + math.sqrt(contact.body_b.velocity[1]) * 0.0


def test_what_python_refuses_python_is_asked_for() -> None:
    fused = agree(Careless(), asks=60)
    answers = [fused.ask(contact)[0] for contact in contacts(Careless(), (), 60, seed=7)]
    assert {layout.ASK, layout.SPEED} == set(answers)


@pytest.mark.parametrize("answer", [-1.0, math.inf, math.nan])
def test_a_speed_that_is_none_is_left_to_python(answer: float) -> None:
    class Wrong(ResponseLaw):
        id = "test:wrong"

        def respond(self, contact: Contact) -> float:
            return answer * contact.approach_speed

    assert agree(Wrong(), asks=60).ask(next(contacts(Wrong(), (), 1)))[0] == layout.ASK


def test_a_mass_that_is_not_known_is_asked_for() -> None:
    def respond(self: Any, contact: Contact) -> float:
        return contact.approach_speed / (1.0 + 1.0 / contact.body_b.mass)

    fused = Fused(_law(respond))
    scratch = scratch_of(next(contacts(fused.responses.laws[0], (), 1)), ())
    for mass, kind in ((2.0, layout.SPEED), (math.inf, layout.ASK), (math.nan, layout.ASK)):
        scratch[layout.BODY_B + layout.MASS] = mass
        assert fused.run([scratch, fused.table], [np.zeros(3, dtype=np.int64)]) == kind


class Rare(ResponseLaw):
    """A formula but for rare cases."""

    id = "test:rare"

    def respond(self, contact: Contact) -> float:
        if contact.approach_speed > 100.0:
            raise RuntimeError(f"{contact.body_a.name} broke")
        if contact.body_a.mass > 500.0:
            return len(contact.body_a.name) * 1.0
        return 0.5 * contact.approach_speed


def test_ways_that_are_no_formula_are_left_to_python_and_the_others_are_fused() -> None:
    law = Rare()
    fused = agree(law, asks=40)
    assert "name" in fused.responses.partly(law)
    assert {fused.ask(contact)[0] for contact in contacts(law, (), 60)} == {layout.SPEED, layout.ASK}


class Many(ResponseLaw):
    """More ways than are read."""

    id = "test:many"

    def respond(self, contact: Contact) -> float:
        found = 0.0
        for k in range(8):
            for component in contact.point:
                if component > 0.2 * k:
                    found += 1.0
        return found


def test_of_too_many_ways_the_rest_is_left_to_python() -> None:
    law = Many()
    fused = agree(law, asks=60)
    assert "more than 64 ways" in fused.responses.partly(law)


class Parent(ResponseLaw):
    """Methods of all kinds."""

    id = "test:parent"
    e = xp.Param(0.5, unit="1")

    @property
    def twice(self) -> float:
        return 2.0 * self.e

    @staticmethod
    def half(x: float) -> float:
        return math.sqrt(x * x) / 2.0

    def respond(self, contact: Contact) -> float:
        return self.half(self.twice * contact.approach_speed)


class Child(Parent):
    """What calls its parent."""

    id = "test:child"

    def respond(self, contact: Contact) -> float:
        return 0.5 * super().respond(contact)


def test_methods_properties_and_parents_are_read_through() -> None:
    agree(Parent())
    agree(Child())


def test_a_loop_that_ends_by_what_it_computes_is_fused_as_far_as_it_is_read() -> None:
    class Loop(ResponseLaw):
        id = "test:loop"

        def respond(self, contact: Contact) -> float:
            v, k = contact.approach_speed, 0
            while v > 1.0:
                v, k = 0.5 * v, k + 1
            return v

    agree(Loop(), asks=60)


HITS: list[Any] = []
COUNTS: dict[str, int] = {}


class Log:
    """Somebody's helper."""

    hits = 0

    @classmethod
    def hit(cls) -> float:
        cls.hits += 1
        return 1.0


RNG = np.random.default_rng(3)
LOG = Log()


def _law(body: Any, **members: Any) -> ResponseLaw:
    kind = type("Tried", (ResponseLaw,), {"id": "test:tried", "respond": body, "__module__": __name__, **members})
    made: ResponseLaw = kind()
    return made


def appends(self: Any, contact: Contact) -> float:
    HITS.append(contact)
    return contact.approach_speed


def counts(self: Any, contact: Contact) -> float:
    COUNTS["hits"] = COUNTS.get("hits", 0) + 1
    return contact.approach_speed


def by_default(self: Any, contact: Contact, seen: Any = []) -> float:  # noqa: B006
    seen.append(contact)
    return contact.approach_speed


def remembers(self: Any, contact: Contact) -> float:
    self.count = getattr(self, "count", 0) + 1
    return contact.approach_speed


def swallows(self: Any, contact: Contact) -> float:
    try:
        self.state["n"] = 1
    except Exception:
        return 0.0
    return contact.approach_speed


def draws(self: Any, contact: Contact) -> float:
    return float(np.random.uniform()) * contact.approach_speed  # noqa: NPY002


def draws_its_own(self: Any, contact: Contact) -> float:
    return RNG.uniform() * contact.approach_speed


def asks_a_helper(self: Any, contact: Contact) -> float:
    return Log.hit() * contact.approach_speed


def asks_an_object(self: Any, contact: Contact) -> float:
    return LOG.hits * contact.approach_speed


def asks_who(self: Any, contact: Contact) -> float:
    return 0.0 if contact.body_a is HITS else contact.approach_speed


def asks_what(self: Any, contact: Contact) -> float:
    return 0.0 if isinstance(contact.approach_speed, float) else 1.0


def prints(self: Any, contact: Contact) -> float:
    print(contact.approach_speed)
    return 0.0


def pushes(self: Any, contact: Contact) -> float:
    contact.body_a.velocity = (0.0, 0.0, 0.0)
    return 0.0


def reads_a_name(self: Any, contact: Contact) -> float:
    return float(contact.body_a.name == "ball")


def reads_no_column(self: Any, contact: Contact) -> float:
    return contact.body_a["softness"]


def reads_a_number_of_the_class(self: Any, contact: Contact) -> float:
    return self.e * contact.approach_speed


def calls_numpy(self: Any, contact: Contact) -> float:
    return float(np.exp(-contact.approach_speed))


def calls_hypot(self: Any, contact: Contact) -> float:
    return math.hypot(*contact.body_a.velocity)


def makes_an_array(self: Any, contact: Contact) -> float:
    return float(np.asarray(contact.normal) @ np.asarray(contact.point))


def takes_the_rest(self: Any, contact: Contact) -> float:
    return contact.approach_speed % 1.0


def returns_nothing(self: Any, contact: Contact) -> None:
    return None


def returns_text(self: Any, contact: Contact) -> str:
    return "fast"


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (appends, "append"),
        (counts, "item assignment"),
        (by_default, "append"),
        (remembers, "sets count"),
        (swallows, "self.state"),
        (draws, "random numbers"),
        (draws_its_own, "RNG"),
        (asks_a_helper, "Log"),
        (asks_an_object, "LOG"),
        (asks_who, "`is`"),
        (asks_what, "isinstance"),
        (prints, "print"),
        (pushes, "sets velocity"),
        (reads_a_name, "body_a.name"),
        (reads_no_column, "softness"),
        (reads_a_number_of_the_class, "Param"),
        (calls_numpy, "math.exp"),
        (calls_hypot, "math.hypot"),
        (makes_an_array, "NumPy array"),
        (takes_the_rest, "// and %"),
        (returns_nothing, "None"),
        (returns_text, "fast"),
    ],
)
def test_what_is_no_formula_is_left_to_python_and_says_why(body: Any, said: str) -> None:
    law = _law(body, e=0.5)
    before = len(HITS), dict(COUNTS), Log.hits
    responses = Responses([law, collision.Elastic()])
    assert said in responses.why(law), responses.why(law)
    assert "test:tried" in responses.why(law)
    assert [branch for branch, _ in responses.parameters()[1]] == [-1, 0]
    assert (len(HITS), COUNTS, Log.hits) == before


def test_a_list_of_the_function_around_it_is_not_written_into() -> None:
    seen: list[Any] = []

    class Recording(ResponseLaw):
        id = "test:recording"

        def respond(self, contact: Contact) -> float:
            seen.append(contact)
            return contact.approach_speed

    law = Recording()
    assert "append" in Responses([law]).why(law) and not seen


def test_a_response_set_by_hand_is_left_to_python() -> None:
    law = collision.Stop()
    law.__dict__["respond"] = lambda contact: 1.0
    assert "by hand" in Responses([law]).why(law)


def test_what_the_reading_misses_the_numbers_show() -> None:
    """`from math import` of something that looks like a float function, but rounds otherwise when it is given numbers."""

    class Odd(float):
        def __mul__(self, other: Any) -> Any:
            return float(self) * other if isinstance(other, float) else 2.0 * other

    odd = Odd(0.5)

    class Two(ResponseLaw):
        id = "test:two"

        def respond(self, contact: Contact) -> float:
            return odd * contact.approach_speed

    law = Two()
    assert "in Python" in Responses([law]).why(law)


def test_columns_of_all_laws_stand_in_one_order_and_are_not_too_many() -> None:
    def kind(names: list[str]) -> ResponseLaw:
        def respond(self: Any, contact: Contact) -> float:
            return abs(sum(contact.body_a[name] for name in names))

        return _law(respond, columns={name: Column(0.0) for name in names})

    laws = [kind([f"c{k}" for k in range(10)]), kind([f"d{k}" for k in range(10)]), kind([f"d{k}" for k in range(6)])]
    responses = Responses(laws)
    assert responses.columns == (*(f"c{k}" for k in range(10)), *(f"d{k}" for k in range(6)))
    assert ["columns" in responses.why(law) for law in laws] == [False, True, False]
    assert "17 columns" in Responses([big := kind([f"c{k}" for k in range(17)])]).why(big)


def test_columns_that_others_declare_can_be_read_where_they_are_at_hand() -> None:
    law = _law(reads_no_column)
    assert Responses([law]).why(law) and not Responses([law], columns=("softness",)).why(law)
    fused = agree(law, asks=60, columns=("softness",))
    assert fused.responses.columns == ("softness",)


def test_no_laws_are_a_text_too() -> None:
    fused = Fused(_law(prints))
    assert fused.ask(next(contacts(collision.Stop(), (), 1)))[0] == layout.ASK


def test_the_same_laws_give_the_same_text() -> None:
    laws = [collision.Elastic(), Plain(), Coulomb(), Rare()]
    assert Responses(laws).text == Responses(laws).text


# Any law at all

NUMBER_LEAVES = [
    "contact.approach_speed",
    "contact.separation",
    "contact.normal[1]",
    "contact.body_a.velocity[0]",
    "contact.body_b.angular_velocity[2]",
    "contact.body_b.mass",
    "contact.body_a['own']",
    "self.e",
    "0.0",
    "2.0",
    "-0.75",
]


def _two(numbers: st.SearchStrategy[str]) -> st.SearchStrategy[tuple[str, str]]:
    return st.tuples(numbers, numbers)


def _larger(numbers: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    truths = st.one_of(
        _two(numbers).flatmap(
            lambda ab: st.sampled_from([f"{ab[0]} {sign} {ab[1]}" for sign in ("<", "<=", "==", "!=")])
        ),
        st.sampled_from(["contact.body_a.fixed", "math.isnan(contact.body_a['own'])"]),
        _two(numbers).map(lambda ab: f"{ab[0]} < 1.0 and not {ab[1]} > 2.0"),
    )
    return st.one_of(
        _two(numbers).flatmap(lambda ab: st.sampled_from([f"({ab[0]} {sign} {ab[1]})" for sign in "+-*/"])),
        _two(numbers).flatmap(
            lambda ab: st.sampled_from([f"{name}({ab[0]}, {ab[1]})" for name in ("min", "max", "chosen")])
        ),
        numbers.map(lambda a: f"math.sqrt({a})"),
        numbers.map(lambda a: f"abs({a})"),
        _two(numbers).map(lambda ab: f"sum([{ab[0]}, {ab[1]}, 0.5])"),
        st.tuples(numbers, truths, numbers).map(lambda abc: f"({abc[0]} if {abc[1]} else {abc[2]})"),
        st.tuples(truths, numbers, numbers).map(lambda abc: f"xp.where({abc[0]}, {abc[1]}, {abc[2]})"),
    )


def chosen(a: Any, b: Any) -> Any:
    """A function of somebody's own, with decisions."""
    if a > b:
        return a - b
    return 0.5 * (a + b) if a > 0.0 else b


@settings(max_examples=40)
@given(st.lists(st.recursive(st.sampled_from(NUMBER_LEAVES), _larger, max_leaves=12), min_size=1, max_size=3))
def test_whatever_somebody_writes_it_answers_as_in_python_or_asks(parts: list[str]) -> None:
    lines = [f"        if {part} > 0.3:\n            return {part}" for part in parts[1:]]
    text = "\n".join(["def respond(self, contact):", *lines, f"        return abs({parts[0]})"]).replace(
        "        ", "    ", 1
    )
    text = text.replace("\n        ", "\n    ")
    space: dict[str, Any] = {"math": math, "xp": xp, "chosen": chosen, "__name__": __name__}
    exec(text, space)
    law = _law(space["respond"], e=xp.Param(0.6, unit="1"), columns={"own": Column(math.nan)})
    with np.errstate(all="ignore"):
        fused = Fused(law)
        if fused.responses.why(law):
            assert "raised" in fused.responses.why(law)  # whatever is given, Python refuses
            return
        for contact in contacts(law, fused.responses.columns, 25, seed=5):
            expected, found = python_answer(law, contact), fused.ask(contact)
            assert found[0] == layout.ASK or same(expected, found), text
