"""Tables of laws: what they are at points, between and outside, as floats and as arrays, and what is refused."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError, UnitError
from xpheve.kernels import table as kernel
from xpheve.laws.view import Batch
from xpheve.trace.derivative import derivative
from xpheve.trace.graph import Graph, Input
from xpheve.trace.numpy_text import array_function
from xpheve.trace.table import ARRAYS, Table, TableRead, packed, tables_of
from xpheve.units import dimension

X = (0.0, 1.0, 2.5, 3.0, 7.0)
Y = (1.0, 3.0, 3.0, -1.0, -2.0)
HEIGHTS = Table((0, 11, 20), (1.225, 0.3639, 0.088), unit_x="km", unit="kg/m^3", outside="hold")

points = st.lists(
    st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)), min_size=2, max_size=12, unique_by=lambda p: p[0]
).filter(lambda found: min(np.diff(sorted(x for x, _ in found))) > 1e-3)


def made(found: list[tuple[float, float]], kind: str, outside: str = "hold") -> Table:
    found = sorted(found)
    return Table([x for x, _ in found], [y for _, y in found], kind=kind, outside=outside)


@pytest.mark.parametrize("kind", ["linear", "cubic"])
def test_a_table_goes_exactly_through_its_points(kind: str) -> None:
    table = Table(X, Y, kind=kind)
    assert [table(x) for x in X] == list(Y)


def test_between_points_a_linear_table_is_a_straight_line() -> None:
    table = Table(X, Y)
    for x in np.linspace(0, 7, 57).tolist():
        assert table(x) == pytest.approx(float(np.interp(x, X, Y)), abs=4e-15)


def test_numbers_are_kept_in_si() -> None:
    assert HEIGHTS.x == (0.0, 11000.0, 20000.0) and HEIGHTS(5500.0) == pytest.approx((1.225 + 0.3639) / 2, rel=1e-15)
    assert (HEIGHTS.dim_x, HEIGHTS.dim) == (dimension("m"), dimension("kg/m^3"))
    assert tuple(HEIGHTS.slope.dim) == dimension("kg/m^4")


@given(points)
def test_a_cubic_table_rises_where_its_points_rise_and_never_overshoots(found: list[tuple[float, float]]) -> None:
    table = made(found, "cubic")
    for k in range(table.count - 1):
        (x, nextx), (y, nexty) = table.x[k : k + 2], table.y[k : k + 2]
        between = table(np.linspace(x, nextx, 40)[:-1])
        room = 1e-12 * max(map(abs, table.y))
        assert (between >= min(y, nexty) - room).all() and (between <= max(y, nexty) + room).all()
        assert (np.diff(between) * np.sign(nexty - y) >= -room).all()


@given(points)
def test_a_cubic_table_and_its_slope_have_no_jumps(found: list[tuple[float, float]]) -> None:
    table = made(found, "cubic", "extend")
    steepest = max(1.0, *(abs(table.slope(x)) for x in np.linspace(table.x[0], table.x[-1], 400).tolist()))
    for x in table.x:
        before = float(np.nextafter(x, -np.inf))
        assert table(before) == pytest.approx(table(x), abs=1e-9 * max(1.0, *map(abs, table.y)))
        assert table.slope(before) == pytest.approx(table.slope(x), abs=1e-7 * steepest)


def test_a_cubic_table_of_points_on_a_line_is_that_line() -> None:
    table = Table(X, [2.0 * x - 1.0 for x in X], kind="cubic", outside="extend")
    assert [table(x) for x in (-4.0, 0.5, 6.9, 11.0)] == pytest.approx([-9.0, 0.0, 12.8, 21.0], rel=1e-14)


def test_a_cubic_table_follows_a_smooth_curve_better_than_straight_lines() -> None:
    x = np.linspace(0.0, 3.0, 31)
    fine = np.linspace(0.2, 2.8, 500)
    worst = [float(np.abs(Table(x, np.exp(x), kind=kind)(fine) - np.exp(fine)).max()) for kind in ("linear", "cubic")]
    assert worst[1] < 0.02 * worst[0]


@pytest.mark.parametrize("kind", ["linear", "cubic"])
def test_outside_it_is_nan_or_held_or_goes_on_in_a_straight_line(kind: str) -> None:
    error, hold, extend = (Table(X, Y, kind=kind, outside=outside) for outside in ("error", "hold", "extend"))
    assert all(math.isnan(error(x)) for x in (-1e-300, math.nextafter(7.0, 8.0), math.inf, -math.inf, math.nan))
    assert [hold(x) for x in (-5.0, -math.inf, 7.5, math.inf)] == [1.0, 1.0, -2.0, -2.0] and math.isnan(hold(math.nan))
    first, last = extend.slope(-9.0), extend.slope(9.0)
    assert extend(-2.0) == 1.0 - 2.0 * first and extend(9.0) == -2.0 + 2.0 * last and first > 0.0 >= last
    assert [hold.slope(x) for x in (-1.0, 8.0, math.inf)] == [0.0, 0.0, 0.0] and math.isnan(error.slope(8.0))


@pytest.mark.parametrize("outside", ["error", "hold", "extend"])
@given(points, st.integers(0, 2**31))
def test_arrays_and_floats_have_the_same_bits(outside: str, found: list[tuple[float, float]], seed: int) -> None:
    tables = [made(found, "linear", outside), made(found, "cubic", outside)]
    numbers, starts = packed(tables)
    x = np.concatenate(
        [tables[0].x, np.random.default_rng(seed).uniform(-1500, 1500, 40), [np.inf, -np.inf, np.nan, 0.0]]
    )
    for table in tables:
        read: TableRead | None = table
        while read is not None:
            with np.errstate(all="ignore"):
                whole = ARRAYS[read.kind](numbers, starts[table], table.count, x)
            flat = numbers.tolist()
            alone = [getattr(kernel, read.kind)(flat, starts[table], table.count, one) for one in x.tolist()]
            np.testing.assert_array_equal(whole, np.array(alone))
            read = read.slope


@pytest.mark.parametrize("kind", ["linear", "cubic"])
def test_the_derivative_of_a_table_is_a_table_too(kind: str) -> None:
    table = Table(X, Y, kind=kind, outside="extend")
    h = 1e-5
    read: TableRead = table
    for _ in range(1 if kind == "linear" else 3):
        assert read.slope is not None
        for x in (-1.3, 0.4, 1.7, 2.8, 5.0, 9.1):
            assert read.slope(x) == pytest.approx((read(x + h) - read(x - h)) / (2 * h), abs=1e-8)
        read = read.slope
    assert read.slope is None


def test_a_table_stands_in_the_text_of_a_graph_and_so_does_its_slope() -> None:
    table = Table(X, Y, kind="cubic", unit_x="m", unit="kg/m^3")
    other = Table((0.0, 9.0), (0.0, 1.0))
    graph = Graph()
    x = graph.input("height", 0, dimension("m"))
    found = graph.op(
        "*",
        graph.table(table, x, table.dim),
        graph.table(other, graph.op("/", x, graph.const(1.0, dimension("m"))), other.dim),
    )
    slope = derivative(graph, found, x)
    run = array_function([found, slope])
    assert "np_table__cubic(tables, 0, 5, i0)" in run.text and "np_table__linear_slope(tables, 34, 2, " in run.text
    assert tables_of([slope]) == [table, other] and tuple(slope.dim or ()) == dimension("kg/m^4")
    at = np.array([0.5, 1.5, 6.0])
    value, steep = run({Input("", "height", 0): at}, {})
    np.testing.assert_allclose(value, table(at) * at / 9.0, rtol=1e-15)
    np.testing.assert_allclose(steep, table.slope(at) * at / 9.0 + table(at) / 9.0, rtol=1e-14)


def test_batches_stay_batches_and_numbers_numbers() -> None:
    table = Table(X, Y)
    column = np.array([[0.5], [1.0], [7.0]]).view(Batch)
    found = table(column)
    assert isinstance(found, Batch) and found.shape == (3, 1) and found[:, 0].tolist() == [2.0, 3.0, -2.0]
    assert type(table(1)) is float and type(table(np.float64(1.0))) is float and table(np.ones((2, 3))).shape == (2, 3)


def test_a_copied_or_pickled_table_is_one_of_its_own() -> None:
    table = Table(X, Y, kind="cubic", unit="N", doc="A force.")
    before = table.slope
    for other in (copy.copy(table), copy.deepcopy(table), pickle.loads(pickle.dumps(table))):
        assert other is not table and other.slope.base is other and before is table.slope
        assert other.numbers().tobytes() == table.numbers().tobytes() and (other.unit, other.doc) == ("N", "A force.")


def test_a_table_of_a_law_knows_its_name() -> None:
    class Air(xp.FieldLaw):
        """Has a table."""

        id = "mine:air"
        density = xp.Table((0, 11), (1.225, 0.3639), unit_x="km", unit="kg/m^3")

    assert repr(Air.density) == "<mine:air.density: linear, 2 points, 0.0 to 11000.0 m>"


def test_the_numbers_of_a_table_cannot_be_written() -> None:
    with pytest.raises(ValueError):
        HEIGHTS.numbers()[0] = 1.0


@pytest.mark.parametrize(
    ("x", "y", "settings", "says"),
    [
        ((0.0,), (1.0,), {}, r"x = (0.0,): at least two points"),
        ((0.0, 1.0), (1.0,), {}, "2 x and 1 y"),
        ((0.0, 1.0, 1.0), (1.0, 2.0, 3.0), {}, "x[2] = 1.0 comes after x[1] = 1.0"),
        ((0.0, -1.0), (1.0, 2.0), {}, "x[1] = -1.0 comes after x[0] = 0.0"),
        ((0.0, math.nan), (1.0, 2.0), {}, "x[1] = nan: a finite number"),
        ((0.0, 1.0), (1.0, math.inf), {"unit": "N"}, "y[1] = inf: a finite number in N"),
        ((0.0, 1.0), (1.0, "a"), {}, "y[1] = 'a'"),
        ((0.0, 1.0), (1.0, True), {}, "y[1] = True"),
        (3.0, (1.0, 2.0), {}, "x = 3.0: a list of numbers"),
        ((0.0, 1e-200), (0.0, 1e200), {}, "so steep"),
        ((0.0, 1.0), (1.0, 2.0), {"kind": "spline"}, "kind = 'spline': choose one of linear, cubic"),
        ((0.0, 1.0), (1.0, 2.0), {"outside": "nan"}, "outside = 'nan': choose one of error, hold, extend"),
    ],
)
def test_what_is_no_table_is_refused_by_name(x: object, y: object, settings: dict[str, str], says: str) -> None:
    with pytest.raises(InvalidValueError) as wrong:
        Table(x, y, **settings)  # type: ignore[arg-type]
    assert says in str(wrong.value)


def test_a_unit_that_is_none_is_refused() -> None:
    with pytest.raises(UnitError, match="kgg"):
        Table((0.0, 1.0), (1.0, 2.0), unit="kgg")


@given(points)
def test_cubic_tables_are_those_of_scipy(found: list[tuple[float, float]]) -> None:
    """`PchipInterpolator` has the same slopes, by the same sources."""
    from scipy.interpolate import PchipInterpolator

    table = made(found, "cubic")
    with np.errstate(over="ignore"):  # of slopes that are denormal
        theirs = PchipInterpolator(table.x, table.y)
    x = np.linspace(table.x[0], table.x[-1], 101)
    steepest = float(np.abs(np.diff(table.y) / np.diff(table.x)).max())
    np.testing.assert_allclose(table(x), theirs(x), atol=1e-12 * max(1.0, *map(abs, table.y)) + 1e-300)
    np.testing.assert_allclose(table.slope(x), theirs(x, 1), atol=1e-7 * steepest + 1e-300)


def test_a_law_with_a_table_runs_in_an_engine() -> None:
    class Ramp(xp.FieldLaw):
        """A push along x that grows for a second, and falls for two."""

        id = "mine:ramp"
        strength = xp.Table((0.0, 1.0, 3.0), (0.0, 4.0, 0.0), unit_x="s", unit="N", outside="hold")

        def force(self, body: Any) -> Any:
            return self.strength(body.time) * np.array((1.0, 0.0, 0.0))

    engine = xp.PhysicsEngine()
    pushed = engine.add_object(xp.PhysicalObject(mass=2.0), laws=[engine.add_law(Ramp)])
    engine.run(until=4.0, dt=0.125)
    assert pushed.velocity[0] == pytest.approx((2.0 + 4.0) / 2.0, rel=1e-14)  # the midpoint is exact on straight lines
