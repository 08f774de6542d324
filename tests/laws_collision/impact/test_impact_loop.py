"""The event loop by itself: the same bits whatever way it takes, the laws of nature, and what it leaves to others."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from tests.laws_collision.impact.loops import (
    Restitution,
    at_time,
    crystal,
    flights,
    lattice,
    loop_of,
    plane,
    put,
    room,
    solid,
)

from xpheve.errors import ContactError
from xpheve.kernels.clock import NEVER
from xpheve_laws_collision.impact import rows
from xpheve_laws_collision.impact.impact_loop import ImpactLoop

SIZE = 1.2


def uneven(count: int = 40, law: Any = None, pull: float = -3.0, scenery: Any = None, **more: Any) -> ImpactLoop:
    """Balls of three sizes and five masses in a room, under gravity."""
    loop = loop_of(count, room(SIZE) if scenery is None else scenery, law, **more)
    fill_unevenly(loop, count, pull)
    return loop


def fill_unevenly(loop: ImpactLoop, count: int = 40, pull: float = -3.0) -> None:
    x, v = lattice(count, SIZE, seed=3)
    k = np.arange(count)
    put(loop, x, v, radius=0.05 * (1.0 + 0.2 * (k % 3)), mass=1.0 + k % 5, acceleration=(0.0, 0.0, pull))


def energy(loop: ImpactLoop, time: float, pull: float = 0.0) -> float:
    x, v = at_time(loop, time)
    mass = loop._cold[:, rows.MASS]
    return float((0.5 * mass * (v**2).sum(axis=0) - mass * pull * x[2]).sum())


# The same bits


@pytest.mark.slow
def test_interpreted_and_compiled_are_the_same_to_the_bit() -> None:
    slow, fast = uneven(), uneven(compiled=True)
    for loop in (slow, fast):
        assert loop.run((1.5, 0.0)).kind == "limit"
    assert slow.impacts == fast.impacts > 100
    assert flights(slow).tobytes() == flights(fast).tobytes()


@pytest.mark.slow
def test_cells_or_none_give_the_same_bits() -> None:
    one, other = uneven(compiled=True, cells=True), uneven(compiled=True, cells=False)
    for loop in (one, other):
        loop.run((6.0, 0.0))
    assert one.crossings > 100 and other.crossings == 0 and one.predictions < other.predictions
    assert flights(one).tobytes() == flights(other).tobytes()


@pytest.mark.slow
@given(some.integers(0, 10**6), some.integers(20, 60), some.sampled_from(("same", "mixed", "dust", "points")))
@settings(max_examples=60, deadline=None)
def test_what_a_glance_leaves_out_meets_nobody(seed: int, count: int, kind: str) -> None:
    """Without cells, every pair is looked at closely."""
    rng = np.random.default_rng(seed)
    size, swift = 10.0 ** rng.uniform(-1.0, 1.0), 10.0 ** rng.uniform(-2.0, 2.0)
    radius = {
        "same": np.full(count, 0.04),
        "mixed": rng.uniform(0.002, 0.06, count),
        "dust": np.where(rng.random(count) < 0.2, 0.06, 1e-5),
        "points": np.where(rng.random(count) < 0.5, 0.0, 0.06),
    }[kind] * size
    x, v = lattice(count, size, seed)
    away = rng.choice([0.0, 1e3, 1e6]) * rng.normal(size=(3, 1))
    pull = rng.normal(size=(3, count if rng.random() < 0.3 else 1)) * rng.choice([0.0, 1.0]) * swift**2 / size
    v = (v + rng.choice([0.0, 1e3]) * rng.normal(size=(3, 1)) - 2.0 * (x / size - 0.5)) * swift
    clock = [rng.choice([0.0, 1e3]) + 0.01 * rng.random(count) * size / swift, np.zeros(count)]
    found = set()
    for cells in (True, False):
        loop = loop_of(count, compiled=True, cells=cells)
        put(loop, x + away, v, radius=radius, acceleration=np.broadcast_to(pull, (3, count)), clock=clock)
        loop.run((float(clock[0].max()) + size / swift, 0.0))
        found.add((loop.impacts, flights(loop).tobytes()))
    assert len(found) == 1


@pytest.mark.slow
def test_cells_of_other_sizes_give_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    from xpheve_laws_collision.impact import layout

    found = set()
    for crowd in (0.2, 1.0, 8.0, 1000.0):
        monkeypatch.setattr(layout, "PLACES_A_CELL", crowd)
        loop = uneven(compiled=True)
        loop.run((4.0, 0.0))
        found.add(flights(loop).tobytes())
    assert len(found) == 1


@pytest.mark.slow
def test_limits_at_any_instants_change_no_bit() -> None:
    whole, cut = uneven(compiled=True), uneven(compiled=True)
    whole.run((4.0, 0.0))
    for limit in sorted(np.random.default_rng(1).uniform(0.0, 4.0, 200)):
        assert cut.run((limit, 0.0)).kind == "limit"
        cut.next_time()
    cut.run((4.0, 0.0))
    assert flights(whole).tobytes() == flights(cut).tobytes()


@pytest.mark.slow
def test_places_loaded_again_from_their_flights_go_on_to_the_bit() -> None:
    whole = uneven(compiled=True, law=Restitution(0.9))
    whole.run((1.0, 0.0))
    again = uneven(compiled=True, law=Restitution(0.9))
    state, k = whole._state, np.arange(40)
    put(
        again, state[:, :3].T, state[:, 3:6].T, clock=state[:, 6:8].T, acceleration=state[:, 8:11].T,
        radius=0.05 * (1.0 + 0.2 * (k % 3)), mass=1.0 + k % 5,
    )  # fmt: skip
    for loop in (whole, again):
        loop.run((2.5, 0.0))
    assert flights(whole).tobytes() == flights(again).tobytes()


@pytest.mark.slow
def test_the_order_of_places_changes_no_bit() -> None:
    loop, other = loop_of(40, room(SIZE), compiled=True), loop_of(40, room(SIZE), compiled=True)
    x, v = lattice(40, SIZE, seed=5)
    put(loop, x, v)
    order = np.random.default_rng(2).permutation(40)
    put(other, x[:, order], v[:, order], rank=order)
    for one in (loop, other):
        one.run((3.0, 0.0))
    assert flights(loop)[:, order].tobytes() == flights(other).tobytes()


# The laws of nature


@pytest.mark.slow
def test_no_two_overlap_and_none_leaves_the_room() -> None:
    loop = uneven(compiled=True)
    radius = 0.05 * (1.0 + 0.2 * (np.arange(40) % 3))
    apart = radius + radius[:, np.newaxis]
    for time in np.linspace(0.1, 5.0, 50):
        loop.run((time, 0.0))
        x, _ = at_time(loop, time)
        gaps = np.linalg.norm(x[:, :, np.newaxis] - x[:, np.newaxis, :], axis=0) - apart + 10.0 * np.eye(40)
        assert gaps.min() > -1e-13 and (x.min(axis=0) - radius).min() > -1e-13
        assert (SIZE - x.max(axis=0) - radius).min() > -1e-13


@pytest.mark.slow
def test_energy_stays_over_a_hundred_thousand_impacts_with_gravity() -> None:
    loop = uneven(compiled=True)
    before = energy(loop, 0.0, -3.0)
    time = 0.0
    while loop.impacts < 100_000:
        time += 50.0
        assert loop.run((time, 0.0)).kind == "limit"
    assert abs(energy(loop, time, -3.0) / before - 1.0) < 1e-12


@pytest.mark.slow
def test_momentum_and_energy_stay_in_a_periodic_box() -> None:
    x, v, length = crystal(0.3, 4)
    loop = loop_of(256, compiled=True, periodic=(length,) * 3)
    put(loop, x, v, radius=0.5)
    time = 0.0
    while loop.impacts < 100_000:
        time += 5.0
        assert loop.run((time, 0.0)).kind == "limit"
    after = loop._state[:, 3:6].T
    assert abs((after**2).sum() / (v**2).sum() - 1.0) < 1e-13
    assert np.abs(after.sum(axis=1)).max() < 1e-11


def contact_errors(loop: ImpactLoop, length: float, until: float) -> list[float]:
    """How far from one diameter the centres are at each impact."""
    found = []
    loop.watch(range(loop.count))
    while (outcome := loop.run((until, 0.0))).kind == "watched":
        d = loop._state[outcome.place, :3] - loop._state[outcome.partner, :3]
        found.append(abs(np.linalg.norm(d - length * np.round(d / length)) - 1.0))
    return found


@pytest.mark.slow
def test_centres_are_one_diameter_apart_at_each_impact() -> None:
    x, v, length = crystal(0.2, 3)
    loop = loop_of(108, compiled=True, periodic=(length,) * 3)
    put(loop, x, v, radius=0.5)
    errors = contact_errors(loop, length, 3.0)
    assert len(errors) > 500 and max(errors) < 1e-13


def rate_over_enskog(packing: float, cells: int, warm: int, impacts: int) -> float:
    """Collisions per time over Enskog's rate with the contact value of Carnahan and Starling."""
    x, v, length = crystal(packing, cells)
    count = x.shape[1]
    loop = loop_of(count, compiled=True, periodic=(length,) * 3)
    put(loop, x, v, radius=0.5)
    contact = (1.0 - 0.5 * packing) / (1.0 - packing) ** 3
    rate = 2.0 * count * count / length**3 * math.sqrt(math.pi) * contact
    begin = warm / rate
    loop.run((begin, 0.0))
    before = loop.impacts
    loop.run((begin + impacts / rate, 0.0))
    return (loop.impacts - before) / impacts


@pytest.mark.slow
@pytest.mark.parametrize("packing", [0.1, 0.3])
def test_balls_collide_as_often_as_enskog_says(packing: float) -> None:
    assert rate_over_enskog(packing, 8, 40_000, 60_000) == pytest.approx(1.0, abs=0.02)


@pytest.mark.stress
@pytest.mark.parametrize("packing", [0.1, 0.3, 0.45])
def test_balls_collide_as_often_as_enskog_says_to_half_a_percent(packing: float) -> None:
    assert rate_over_enskog(packing, 14, 400_000, 1_000_000) == pytest.approx(1.0, abs=0.005)


def test_all_go_back_when_velocities_are_reversed() -> None:
    loop = loop_of(27, room(SIZE))
    x, v = lattice(27, SIZE, seed=7)
    put(loop, x, v)
    loop.run((0.8, 0.0))
    assert 20 < loop.impacts < 200
    there, speed = at_time(loop, 0.8)
    put(loop, there, -speed, clock=(0.8, 0.0))
    loop.run((1.6, 0.0))
    assert np.abs(at_time(loop, 1.6)[0] - x).max() < 1e-9


def test_work_of_a_law_is_what_the_energy_lacks() -> None:
    loop = uneven(27, Restitution(0.7))
    before = energy(loop, 0.0, -3.0)
    loop.run((1.0, 0.0))
    assert loop.evaluations[0] == loop.impacts > 20
    assert energy(loop, 1.0, -3.0) - before == pytest.approx(loop.work[0], rel=1e-12)


def test_equal_balls_exchange_velocities_to_the_bit() -> None:
    loop = loop_of(2)
    put(loop, [[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]], [[1.1, -0.3], [0.7, 0.1], [0.2, 0.0]], radius=0.25)
    loop._state[:, rows.V + 1 : rows.V + 3] = 0.0
    loop.run((1.0, 0.0))
    assert loop._state[:, rows.V].tolist() == [-0.3, 1.1]


def test_a_ball_bounces_where_the_parabola_says() -> None:
    loop = loop_of(1, [plane((0, 0, 1), 0.0)], Restitution(0.5))
    put(loop, (0, 0, 1.25), (2, 0, 0), radius=0.0, acceleration=(0, 0, -10.0))
    assert loop.next_time()[0] == pytest.approx(0.5, rel=1e-15)
    assert loop.run((0.75, 0.0)).kind == "limit"
    now = loop.changed()
    assert now.places.tolist() == [0] and now.position[:, 0].tolist() == [1.0, 0.0, 0.0]
    assert now.velocity[:, 0].tolist() == [2.0, 0.0, 2.5]
    assert loop.run((10.0, 0.0)).kind == "collapse"


@given(
    some.lists(some.tuples(*[some.floats(-1.0, 1.0)] * 4), min_size=3, max_size=6),
    some.sampled_from([0.0, -2.0]),
    some.integers(0, 2**30),
)
@settings(max_examples=25, deadline=None)
def test_few_balls_do_what_small_steps_say(balls: list[tuple[float, ...]], pull: float, seed: int) -> None:
    """Against steps of 1e-4 s that look for overlaps: the first impact's pair and time."""
    rng = np.random.default_rng(seed)
    count = len(balls)
    x = np.array([[1.2 * k, 0.3 * ball[0], 0.3 * ball[1]] for k, ball in enumerate(balls)]).T
    v = rng.uniform(-1.0, 1.0, (3, count))
    pulls = np.array([[pull * (k % 2), 0.0, 0.0] for k in range(count)]).T
    loop = loop_of(count)
    put(loop, x, v, radius=0.4, acceleration=pulls)
    time = loop.next_time()[0]
    end = min(time, 3.0)
    steps = np.linspace(0.0, end, 3001)[:-1]
    for i in range(count):
        for j in range(i):
            s = steps[:, np.newaxis]
            d = (x[:, i] - x[:, j]) + s * (v[:, i] - v[:, j]) + 0.5 * s * s * (pulls[:, i] - pulls[:, j])
            assert np.linalg.norm(d, axis=1).min() > 0.8 - 1e-9
    if time < 3.0:
        y = x + time * v + 0.5 * time * time * pulls
        gaps = [abs(np.linalg.norm(y[:, i] - y[:, j]) - 0.8) for i in range(count) for j in range(i)]
        assert min(gaps) < 1e-13


# Boxes and capsules


def test_a_ball_bounces_off_a_box_and_a_capsule() -> None:
    box = solid(rows.BOX, (0, 0, 0), (0.5, 0.5, 0.5))
    capsule = solid(rows.CAPSULE, (3, 0, 0), (0.25, 0.5))
    loop = loop_of(1, [box, capsule])
    put(loop, (1.5, 0.0, 0.2), (1, 0, 0), radius=0.25)
    loop.watch([0])
    turns = [loop.run((20.0, 0.0)) for _ in range(3)]
    assert [one.partner for one in turns] == [1, 0, 1]
    assert [one.instant[0] for one in turns] == pytest.approx([1.0, 2.75, 4.5], rel=1e-15)
    put(loop, (1.5, 0.1, 0.2), (1, 0, 0), radius=0.25)
    assert loop.run((20.0, 0.0)).instant[0] == pytest.approx(1.5 - math.sqrt(0.25 - 0.01), rel=1e-14)
    assert np.linalg.norm(loop._state[0, 3:6]) == pytest.approx(1.0, rel=1e-14)


def test_two_turned_boxes_stop_a_ball_where_their_faces_are() -> None:
    c, s = math.cos(0.3), math.sin(0.3)
    loop = loop_of(1, [solid(rows.BOX, (0, 0, 0), (0.5, 2.0, 2.0), [[c, -s, 0], [s, c, 0], [0, 0, 1]])])
    start = np.array([c, s, 0.0]) * 2.0
    put(loop, start, -np.array([c, s, 0.0]), radius=0.25)
    assert loop.next_time()[0] == pytest.approx(1.25, rel=1e-14)


# What is left to others


def cradle(law: Any = None, **more: Any) -> ImpactLoop:
    loop = loop_of(3, law=law)
    put(loop, [[-1.0, 0.0, 0.5], [0, 0, 0], [0, 0, 0]], [[1.0, 0.0, 0.0], [0, 0, 0], [0, 0, 0]], radius=0.25, **more)
    return loop


def test_a_second_contact_at_the_instant_is_left_as_it_is() -> None:
    loop = cradle()
    before = flights(loop)[:6]
    outcome = loop.run((10.0, 0.0))
    assert outcome.kind == "touch" and {outcome.place, outcome.partner} == {0, 1} and not outcome.is_scenery
    assert outcome.instant == (0.5, 0.0) and sorted(loop.near(1, outcome.instant)) == [(0, False), (2, False)]
    assert (flights(loop)[:6] == before).all() and loop.impacts == 0 and loop.next_time() == (0.5, 0.0)
    assert loop.run((10.0, 0.0)) == outcome


def test_a_law_without_text_is_left_to_python() -> None:
    outcome = cradle(Restitution(None)).run((10.0, 0.0))
    assert outcome.kind == "law" and outcome.instant == (0.5, 0.0)


def test_pairs_that_both_listen_are_left_to_python() -> None:
    assert cradle(heard=1).run((10.0, 0.0)).kind == "law"
    assert cradle(heard=[1, 0, 1]).run((10.0, 0.0)).kind == "touch"


def test_a_watched_place_stops_the_loop_after_its_impact() -> None:
    loop = loop_of(2)
    put(loop, [[-1.0, 0.0], [0, 0], [0, 0]], [[1.0, 0.0], [0, 0], [0, 0]], radius=0.25)
    loop.watch([1])
    outcome = loop.run((10.0, 0.0))
    assert outcome.kind == "watched" and loop._state[:, rows.V].tolist() == [0.0, 1.0]
    assert loop.run((10.0, 0.0)).kind == "limit"


def test_what_is_pressed_onto_a_plane_at_no_speed_rests_there() -> None:
    loop = loop_of(1, [plane((0, 0, 1), 0.0)])
    put(loop, (0, 0, 0.05), (1, 0, 0), acceleration=(0, 0, -10.0), clock=(2.0, 0.0))
    assert loop.run((10.0, 0.0))[:5] == ("rest", (2.0, 0.0), 0, 0, True)
    loop.set_skip(0, 0)
    assert loop.run((10.0, 0.0)).kind == "limit"


def test_without_restitution_a_ball_rests_right_after_its_impact() -> None:
    loop = loop_of(1, [plane((0, 0, 1), 0.0)], Restitution(0.0))
    put(loop, (0, 0, 1.25), (0, 0, 0), radius=0.0, acceleration=(0, 0, -10.0))
    assert loop.run((10.0, 0.0)).kind == "collapse"


def test_bounces_between_closing_walls_are_a_streak() -> None:
    walls = [plane((1, 0, 0), 0.0), plane((-1, 0, 0), -(0.1 + 1e-9))]
    loop = loop_of(1, walls, Restitution(0.99))
    put(loop, (0.05 + 5e-10, 0, 0), (1, 0, 0))
    assert loop.run((10.0, 0.0)).kind == "streak"
    assert loop.impacts == 7


def test_too_many_impacts_at_one_instant_are_told() -> None:
    loop = loop_of(1, [plane((1, 0, 0), 0.0), plane((-1, 0, 0), -0.05)])
    put(loop, (0.025, 0, 0), (1, 0, 0))
    outcome = loop.run((10.0, 0.0))
    assert outcome.kind == "busy" and loop.impacts <= 1001


def test_an_answer_that_is_no_number_fails_before_anything_changes() -> None:
    loop = loop_of(2, law=Restitution(math.inf))
    put(loop, [[-1.0, 0.0], [0, 0], [0, 0]], [[1.0, 0.0], [0, 0], [0, 0]], radius=0.25)
    assert loop.run((10.0, 0.0)).kind == "failed"
    assert loop._state[:, rows.V].tolist() == [1.0, 0.0] and loop.impacts == 0


def test_places_that_share_no_law_pass_through_each_other() -> None:
    loop = loop_of(2, law=Restitution(1.0, 1.0))
    put(loop, [[-1.0, 0.0], [0, 0], [0, 0]], [[1.0, 0.0], [0, 0], [0, 0]], radius=0.25, mask=[1, 2])
    assert loop.next_time() == NEVER
    put(loop, [[0.0], [0], [0]], [[0.0], [0], [0]], places=[1], radius=0.25, mask=3)
    assert loop.next_time() == (0.5, 0.0)


def test_a_place_is_emptied_by_a_mask_of_nothing() -> None:
    loop = cradle()
    put(loop, [[0.0], [0], [0]], [[0.0], [0], [0]], places=[1], mask=0)
    assert loop.next_time() == (1.0, 0.0)


def test_an_impulse_turns_spheres() -> None:
    class Rough(Restitution):
        text = "def respond(f, n):\n    c = f[0]\n    c[112] = 1.0\n    c[113] = 2.0\n    c[114] = 0.5\n    c[115] = 0.0\n    return 1\n"

    loop = loop_of(2, law=Rough())
    put(loop, [[-1.0, 0.0], [0, 0], [0, 0]], [[2.0, 0.0], [0, 0], [0, 0]], radius=0.25)
    loop.run((10.0, 0.0))
    now = loop.changed()
    assert now.velocity[:, 0].tolist() == [0.0, -0.5, 0.0] and now.velocity[:, 1].tolist() == [2.0, 0.5, 0.0]
    assert now.turned.tolist() == [0, 1]
    assert np.allclose(now.spin, [[0, 0], [0, 0], [-0.25 * 0.5 / 0.025] * 2], rtol=1e-14)
    assert (now.turn_clock == now.clock).all() and loop.changed().places.size == 0
    gained = 0.5 * (0.25 + 4.25 - 4.0) + 0.5 * 0.025 * 2 * 25.0
    assert loop.take_counts().work == [pytest.approx(gained, rel=1e-14)] and loop.impacts == 0


# Periodic boxes


def test_a_ball_meets_the_image_of_another() -> None:
    loop = loop_of(2, periodic=(4.0, math.inf, math.inf))
    put(loop, [[0.5, 3.0], [0, 0], [0, 0]], [[-1.0, 0.0], [0, 0], [0, 0]], radius=0.25)
    loop.run((1.5, 0.0))
    assert loop._state[:, rows.V].tolist() == [0.0, -1.0] and loop._state[:, rows.X].tolist() == [3.5, 3.0]
    assert loop.run((1000.0, 0.0)).kind == "limit" and loop.next_time() == (1000.0, 0.0)
    assert loop.impacts == 333
    assert (loop._state[:, rows.X] >= 0.0).all() and (loop._state[:, rows.X] < 4.0).all()


def test_positions_outside_the_box_are_brought_into_it() -> None:
    loop = loop_of(2, periodic=(4.0, 4.0, 4.0))
    put(loop, [[-3.5, 7.0], [4.0, 0], [0, -1e-20]], [[-1.0, 0.0], [0, 0], [0, 0]], radius=0.25)
    loop.run((1.0, 0.0))
    assert loop.impacts == 0
    loop.run((1.0, math.inf))
    assert loop.impacts == 1


@pytest.mark.parametrize(("lengths", "word"), [((0.4, 4.0, 4.0), "narrower"), ((-1.0, 4.0, 4.0), "above 0")])
def test_a_box_too_narrow_is_refused(lengths: tuple[float, ...], word: str) -> None:
    with pytest.raises(ContactError, match=word):
        loop = loop_of(1, periodic=lengths)
        put(loop, (0.1, 0, 0), (0, 0, 0), radius=0.25)
        loop.run((1.0, 0.0))


def test_scenery_across_a_periodic_axis_is_refused() -> None:
    with pytest.raises(ContactError, match="fixed shape 0"):
        loop_of(1, [plane((1, 0, 0), 0.0)], periodic=(4.0, math.inf, math.inf))
    loop_of(1, [plane((0, 1, 0), 0.0)], periodic=(4.0, math.inf, math.inf))


@pytest.mark.slow
def test_narrow_and_wide_periodic_boxes_give_what_images_side_by_side_give() -> None:
    """A gas in a periodic box, and eight copies of it in a box twice as long."""
    x, v, length = crystal(0.1, 2, seed=4)
    small = loop_of(32, compiled=True, periodic=(length,) * 3)
    put(small, x, v, radius=0.5)
    shifts = np.array(np.meshgrid(*[[0.0, 1.0]] * 3)).reshape(3, -1) * length
    large = loop_of(256, compiled=True, periodic=(2.0 * length,) * 3)
    put(large, np.concatenate([x + one[:, np.newaxis] for one in shifts.T], axis=1), np.tile(v, 8), radius=0.5)
    for loop in (small, large):
        loop.run((1.0, 0.0))
    assert large.impacts == 8 * small.impacts > 80
    assert np.abs(large._state[:, 3:6].reshape(8, 32, 3) - small._state[:, 3:6]).max() < 1e-9


# Cells that fly along


def test_balls_that_fall_alike_cross_no_cell() -> None:
    loop = loop_of(64)
    x, v = lattice(64, 3.0, seed=1)
    put(loop, x, 0.0 * v + np.array([[100.0], [3.0], [0.0]]), acceleration=(0, 0, -9.81))
    assert loop.run((100.0, 0.0)).kind == "limit" and loop.celled and loop.crossings == 0


def test_a_fast_ball_is_found_however_many_cells_it_crosses() -> None:
    count = 30
    loop = loop_of(count)
    x = np.zeros((3, count))
    x[0] = np.arange(count) * 50.0
    v = np.zeros((3, count))
    v[0, 0] = 1e4
    put(loop, x, v)
    loop.run((1.0, 0.0))
    assert loop.impacts == count - 1 and loop._state[count - 1, rows.V] == 1e4


@pytest.mark.parametrize("speed", [1e9, 1e300])
def test_what_is_too_fast_for_cells_makes_them_wider_and_changes_no_bit(speed: float) -> None:
    found = []
    for cells in (True, False):
        loop = loop_of(20, cells=cells)
        x, v = np.zeros((3, 20)), np.zeros((3, 20))
        x[0] = np.arange(20) * 3.0
        x[1, 0] = 50.0
        v[0, 0], v[0, 1] = speed, 30.0
        put(loop, x, v)
        loop.run((2.0, 0.0))
        assert loop.impacts == 18 and loop.crossings < 50_000
        found.append(loop._state.tobytes())
    assert found[0] == found[1]


def test_counts_of_the_loop_only_grow_where_something_happens() -> None:
    loop = uneven(27)
    seen = [(loop.run((time, 0.0)), loop.impacts)[1] for time in (0.1, 0.2, 0.4)]
    assert all(a <= b for a, b in pairwise(seen)) and seen[-1] > 0


def test_cells_are_made_wide_for_what_crosses_them_without_end_and_no_bit_changes() -> None:
    found = []
    for cells in (True, False):
        loop = loop_of(3, cells=cells)
        put(loop, [(0, 0, 3), (0, 0.5, 0.5), (0, 9, 9)], [(1e12, 1.0, 0), (0, 0, 0), (0, 0, 0)])
        assert loop.run((4.0, 0.0)).kind == "limit"
        assert loop.impacts == 1 and loop.crossings < 100_000
        found.append(loop.changed().velocity.tobytes() + loop.changed().position.tobytes())
    assert found[0] == found[1]
