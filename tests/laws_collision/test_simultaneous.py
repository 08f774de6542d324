"""Impacts at one instant: conserved quantities, mirrors and orders to the bit, Newton's cradle, a break."""

import itertools
import math
import random
from collections.abc import Sequence
from fractions import Fraction

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from xpheve_laws_collision.simultaneous import (
    EXACT_PAIRS,
    apply,
    components,
    separation_speeds,
    solve_generation,
    wanted_speeds,
)

Vector = tuple[float, float, float]
Scene = tuple[list[tuple[int, int]], list[float], list[Vector], list[Vector]]

REST = (0.0, 0.0, 0.0)


def unit(v: Sequence[float]) -> Vector:
    length = math.hypot(*v)
    return (v[0] / length, v[1] / length, v[2] / length)


def flipped(v: Vector) -> Vector:
    return (-v[0], -v[1], -v[2])


def random_scene(pair_count: int, seed: int, flat: bool = False) -> Scene:
    """Bodies of random masses and speeds in one connected tangle, every pair approaching."""
    r = random.Random(seed)
    count = pair_count // 2 + 2
    masses = [0.0 if r.random() < 0.1 else 1 / r.uniform(0.1, 3) for _ in range(count)]
    velocities = [(r.gauss(0, 1), r.gauss(0, 1), 0.0 if flat else r.gauss(0, 1)) for _ in range(count)]
    velocities = [v if m else REST for v, m in zip(velocities, masses, strict=True)]
    pairs, normals = [], []
    while len(pairs) < pair_count:
        i, j = (len(pairs), len(pairs) + 1) if len(pairs) < count - 1 else r.sample(range(count), 2)
        if masses[i] == masses[j] == 0.0:
            masses[i] = 1.0
        n = unit((r.gauss(0, 1), r.gauss(0, 1), 0.0 if flat else r.gauss(0, 1)))
        if separation_speeds([(i, j)], [n], velocities)[0] > 0:
            n = flipped(n)
        pairs.append((i, j))
        normals.append(n)
    return pairs, masses, normals, velocities


def resolve(scene: Scene, restitution: float = 1.0) -> tuple[list[Fraction], list[Vector]]:
    pairs, masses, normals, velocities = scene
    targets = wanted_speeds(pairs, normals, velocities, [restitution] * len(pairs))
    impulses = solve_generation(pairs, masses, normals, velocities, targets)
    return impulses, apply(pairs, normals, impulses, masses, velocities)


def run(scene: Scene, restitution: float = 1.0) -> list[Vector]:
    """Generation after generation of what touches and approaches, until nothing does."""
    pairs, masses, normals, velocities = scene
    for _ in range(1000):
        speeds = separation_speeds(pairs, normals, velocities)
        now = [k for k, s in enumerate(speeds) if s < -1e-14]
        if not now:
            return velocities
        part = ([pairs[k] for k in now], masses, [normals[k] for k in now], velocities)
        velocities = resolve(part, restitution)[1]
    raise AssertionError("it does not end")


def energy(masses: Sequence[float], velocities: Sequence[Vector]) -> Fraction:
    """Of the movable bodies [J], without error."""
    return sum(
        (sum(Fraction(x) ** 2 for x in v) / (2 * Fraction(w)) for w, v in zip(masses, velocities, strict=True) if w),
        Fraction(0),
    )


def momentum(masses: Sequence[float], velocities: Sequence[Vector], axis: int) -> Fraction:
    """Of the movable bodies [N s], without error."""
    return sum((Fraction(v[axis]) / Fraction(w) for w, v in zip(masses, velocities, strict=True) if w), Fraction(0))


def exact_matrix(scene: Scene) -> list[list[Fraction]]:
    """J M^-1 J^T from its definition: push one pair by a unit, look at the others."""
    pairs, masses, normals, velocities = scene
    size = len(pairs)
    matrix = [[Fraction(0)] * size for _ in range(size)]
    for m, (i, j) in enumerate(pairs):
        change = [[Fraction(0)] * 3 for _ in velocities]
        for c in range(3):
            change[i][c] -= Fraction(normals[m][c]) * Fraction(masses[i])
            change[j][c] += Fraction(normals[m][c]) * Fraction(masses[j])
        for k, (a, b) in enumerate(pairs):
            matrix[k][m] = sum((Fraction(normals[k][c]) * (change[b][c] - change[a][c]) for c in range(3)), Fraction(0))
    return matrix


def check_complementary(scene: Scene, targets: Sequence[Fraction], impulses: Sequence[Fraction]) -> None:
    """p >= 0, w >= target, and one of both an equality: without any error."""
    matrix = exact_matrix(scene)
    speeds = separation_speeds(scene[0], scene[2], scene[3])
    for k, row in enumerate(matrix):
        w = speeds[k] + sum(a * p for a, p in zip(row, impulses, strict=True))
        assert impulses[k] >= 0
        assert w >= targets[k]
        assert impulses[k] == 0 or w == targets[k]


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(1e-3, 1e3), st.floats(-5, 5), st.floats(-5, 5))
def test_equal_masses_exchange_their_velocities_exactly(u: float, v: float, mass: float, y: float, z: float) -> None:
    assume(u > v)
    scene: Scene = ([(0, 1)], [1 / mass] * 2, [(1.0, 0.0, 0.0)], [(u, y, z), (v, z, y)])
    assert resolve(scene)[1] == [(v, y, z), (u, z, y)]


@given(st.floats(0, 1), st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_one_pair_leaves_at_its_restitution(e: float, m: float, n: float) -> None:
    scene: Scene = ([(0, 1)], [1 / m, 1 / n], [unit((3, 4, 12))], [(1.0, 2.0, 3.0), (-1.0, 0.5, 0.0)])
    impulses, after = resolve(scene, e)
    approach = float(-separation_speeds(*[scene[k] for k in (0, 2, 3)])[0])
    assert float(impulses[0]) == pytest.approx((1 + e) * approach / (1 / m + 1 / n), rel=1e-14)
    # Each of six components is rounded once, relative to its size.
    assert float(separation_speeds(scene[0], scene[2], after)[0]) == pytest.approx(e * approach, abs=1e-15 * 40)


@pytest.mark.parametrize("pair_count", [1, 2, 3, 5, 8, 12, 16])
@pytest.mark.parametrize("seed", range(4))
def test_the_impulses_are_exactly_complementary(pair_count: int, seed: int) -> None:
    scene = random_scene(pair_count, seed)
    r = random.Random(seed)
    targets = wanted_speeds(scene[0], scene[2], scene[3], [r.random() for _ in scene[0]])
    check_complementary(scene, targets, solve_generation(*scene, targets))


@pytest.mark.parametrize("pair_count", [1, 2, 3, 6, 10, 16, 25])
@pytest.mark.parametrize("seed", range(4))
def test_energy_and_momentum_are_conserved(pair_count: int, seed: int) -> None:
    scene = random_scene(pair_count, seed)
    masses, before = scene[1], scene[3]
    after = resolve(scene)[1]
    e = energy(masses, before)
    assert abs(energy(masses, after) - e) <= 1e-15 * e
    if all(masses):
        for axis in range(3):
            size = sum(abs(v[axis]) / w for w, v in zip(masses, after, strict=True))
            assert abs(momentum(masses, after, axis) - momentum(masses, before, axis)) <= 2.0**-53 * size


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("flat", [False, True])
def test_order_sides_and_mirrors_change_no_bit(seed: int, flat: bool) -> None:
    r = random.Random(seed)
    pairs, masses, normals, velocities = scene = random_scene(r.choice([2, 3, 5, 9, 14]), seed, flat)
    impulses, after = resolve(scene)

    order = r.sample(range(len(pairs)), len(pairs))
    place = r.sample(range(len(masses)), len(masses))  # body k is now called place[k]
    called = [place.index(k) for k in range(len(masses))]
    axis = r.randrange(3)
    turned = [r.random() < 0.5 for _ in pairs]

    def mirrored(v: Vector) -> Vector:
        return (*v[:axis], -v[axis], *v[axis + 1 :])  # type: ignore[return-value]

    other: Scene = ([], [masses[k] for k in called], [], [mirrored(velocities[k]) for k in called])
    for k in order:
        i, j = place[pairs[k][0]], place[pairs[k][1]]
        n = mirrored(normals[k])
        other[0].append((j, i) if turned[k] else (i, j))
        other[2].append(flipped(n) if turned[k] else n)
    other_impulses, other_after = resolve(other)
    assert other_impulses == [impulses[k] for k in order]
    assert [other_after[place[k]] for k in range(len(masses))] == [mirrored(v) for v in after]


@pytest.mark.parametrize("seed", range(3))
def test_large_sets_do_not_depend_on_order_beyond_rounding(seed: int) -> None:
    pairs, masses, normals, velocities = scene = random_scene(40, seed)
    assert max(map(len, components(pairs, masses))) > EXACT_PAIRS
    impulses, after = resolve(scene)
    order = random.Random(seed).sample(range(40), 40)
    other_impulses, other_after = resolve(([pairs[k] for k in order], masses, [normals[k] for k in order], velocities))
    size = max(impulses)
    assert all(abs(p - impulses[k]) <= 1e-13 * size for p, k in zip(other_impulses, order, strict=True))
    assert after == other_after  # here, with no redundant pairs, even to the bit


def test_large_redundant_sets_move_alike_in_any_order() -> None:
    """Twenty contacts of one ball: how they share is not kept to the bit, what they do is (to 1e-13 of the speed)."""
    normals = [unit((1, 0.1 * k, 0.3)) for k in range(20)]
    velocities: list[Vector] = [(1.0, 0.2, 0.3), REST]
    there = resolve(([(0, 1)] * 20, [1.0, 0.0], normals, velocities))[1][0]
    back = resolve(([(0, 1)] * 20, [1.0, 0.0], normals[::-1], velocities))[1][0]
    assert there == pytest.approx(back, abs=1e-13)


def test_large_and_exact_solutions_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(10):
        scene = random_scene(14, seed)
        exact = resolve(scene)[0]
        monkeypatch.setattr("xpheve_laws_collision.simultaneous.EXACT_PAIRS", 1)
        floats = resolve(scene)[0]
        monkeypatch.undo()
        assert all(abs(a - b) <= 1e-13 * max(exact) for a, b in zip(exact, floats, strict=True))


def ring(count: int) -> Scene:
    """Equal balls around one in the middle, each running into it; the balls also touch their neighbours."""
    angles = [2 * math.pi * k / count for k in range(count)]
    out = [(math.cos(a), math.sin(a), 0.0) for a in angles]
    pairs = [(0, k + 1) for k in range(count)] + [(k + 1, (k + 1) % count + 1) for k in range(count)]
    normals = out + [unit([out[(k + 1) % count][c] - out[k][c] for c in range(3)]) for k in range(count)]
    return pairs, [1.0] * (count + 1), normals, [REST, *map(flipped, out)]


@pytest.mark.parametrize("count", [3, 4, 6])
def test_redundant_contacts_share_evenly(count: int) -> None:
    """In the plane the ring has more contacts than speeds; of all solutions it takes the least one, the even one."""
    scene = ring(count)
    targets = [Fraction(0)] * len(scene[0])
    impulses = solve_generation(*scene, targets)
    check_complementary(scene, targets, impulses)
    for part in (impulses[:count], impulses[count:]):
        assert all(abs(p - part[0]) < 1e-14 for p in part)  # the cosines are not exactly even


def test_redundant_contacts_take_the_solution_of_least_norm() -> None:
    """One ball pressed by the same contact seen three times: each carries a third."""
    scene: Scene = ([(0, 1)] * 3, [1.0, 0.0], [(1.0, 0.0, 0.0)] * 3, [(1.0, 0.0, 0.0), REST])
    impulses, after = resolve(scene)
    assert impulses == [Fraction(2, 3)] * 3
    assert after[0] == (-1.0, 0.0, 0.0)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6))
def test_least_norm_against_all_sets_of_pushing_pairs(seed: int) -> None:
    """Redundant on purpose: four to five contacts on two balls in the plane and on a line, with integer normals."""
    r = random.Random(seed)
    choices = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.6, 0.8, 0.0), (1.0, 1.0, 0.0)]
    velocities: list[Vector] = [(float(r.randint(-3, 3)), float(r.randint(-3, 3)), 0.0) for _ in range(2)] + [REST]
    pairs, normals = [], []
    for _ in range(r.randint(2, 5)):
        pair, n = r.choice([(0, 1), (0, 2), (1, 2)]), r.choice(choices)
        speed = separation_speeds([pair], [n], velocities)[0]
        if speed != 0:
            pairs.append(pair)
            normals.append(n if speed < 0 else flipped(n))
    if not pairs:
        return
    scene: Scene = (pairs, [1.0, 0.5, 0.0], normals, velocities)
    targets = wanted_speeds(pairs, normals, velocities, [1.0] * len(pairs))
    impulses = solve_generation(*scene, targets)
    check_complementary(scene, targets, impulses)
    # No move along the null space of A that keeps p >= 0 makes the norm smaller: against every vertex of the set.
    norm = sum(p * p for p in impulses)
    for other in vertices(exact_matrix(scene), scene, targets):
        # p is the nearest point to 0 of a convex set if and only if p . (q - p) >= 0 for all its points q.
        assert sum(p * q for p, q in zip(impulses, other, strict=True)) >= norm


def vertices(matrix: list[list[Fraction]], scene: Scene, targets: Sequence[Fraction]) -> list[list[Fraction]]:
    """All solutions whose pushing pairs are independent, by trying every set of pairs."""
    size = len(matrix)
    speeds = separation_speeds(scene[0], scene[2], scene[3])
    missing = [t - s for t, s in zip(targets, speeds, strict=True)]
    found = []
    for chosen in itertools.chain.from_iterable(itertools.combinations(range(size), n) for n in range(size + 1)):
        a = [[matrix[k][m] for m in chosen] + [missing[k]] for k in chosen]
        try:
            for k in range(len(a)):
                a[k] = [x / a[k][k] for x in a[k]]
                for i in range(len(a)):
                    if i != k:
                        a[i] = [x - a[i][k] * y for x, y in zip(a[i], a[k], strict=True)]
        except ZeroDivisionError:
            continue
        p = [Fraction(0)] * size
        for k, row in zip(chosen, a, strict=True):
            p[k] = row[-1]
        slack = [sum(x * y for x, y in zip(row, p, strict=True)) - b for row, b in zip(matrix, missing, strict=True)]
        if (
            all(x >= 0 for x in p)
            and all(s >= 0 for s in slack)
            and all(x * s == 0 for x, s in zip(p, slack, strict=True))
        ):
            found.append(p)
    return found


@pytest.mark.parametrize("count", range(2, 13))
@pytest.mark.parametrize("mass", [1.0, 0.17, 3.3])
def test_newtons_cradle_is_exact(count: int, mass: float) -> None:
    """As many leave as came, at the same speed, and the others rest: to the bit, along a slanted line too."""
    for n, v in [((1.0, 0.0, 0.0), (0.3, 0.0, 0.0)), ((0.6, 0.8, 0.0), (0.6, 0.8, 0.0)), ((2 / 3, 1 / 3, -2 / 3),) * 2]:
        for came in range(1, count):
            pairs = [(k, k + 1) for k in range(count - 1)]
            velocities = [v] * came + [REST] * (count - came)
            after = run((pairs, [1 / mass] * count, [n] * (count - 1), velocities))
            assert after == [REST] * (count - came) + [v] * came


def test_one_ball_into_two_leaves_them_mirror_equal() -> None:
    """And what is left of the first runs straight on the axis: -1/5 of its speed, 2 sqrt(3)/5 for each of the two."""
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    scene: Scene = ([(0, 1), (0, 2)], [1 / 0.17] * 3, [(c, s, 0.0), (c, -s, 0.0)], [(1.0, 0.0, 0.0), REST, REST])
    first, upper, lower = run(scene)
    assert first[1] == 0.0
    assert upper == (lower[0], -lower[1], lower[2])
    assert first[0] == pytest.approx(-0.2, rel=1e-15)
    assert math.hypot(*upper) == pytest.approx(2 * math.sqrt(3) / 5, rel=1e-15)


def rack(rows: int) -> Scene:
    """Balls of a triangle in touch, the first hit by the cue ball along the axis."""
    h = math.sqrt(3)
    places = [(h * row, float(2 * k - row)) for row in range(rows) for k in range(row + 1)]
    places = [(-2.0, 0.0), *places]
    pairs, normals = [], []
    for i, j in itertools.combinations(range(len(places)), 2):
        x, y = places[j][0] - places[i][0], places[j][1] - places[i][1]
        if math.hypot(x, y) < 2.1:
            pairs.append((i, j))
            normals.append((1.0, 0.0, 0.0) if i == 0 else (0.0, 1.0, 0.0) if x == 0 else (h / 2, y / 2, 0.0))
    return pairs, [1 / 0.17] * len(places), normals, [(1.0, 0.0, 0.0)] + [REST] * (len(places) - 1)


@pytest.mark.parametrize("rows", [2, 3, 4, 5])
@pytest.mark.parametrize("restitution", [1.0, 0.95, 0.0])
def test_a_break_is_symmetric_to_the_bit(rows: int, restitution: float) -> None:
    scene = rack(rows)
    after = run(scene, restitution)
    ball = 1
    for row in range(rows):
        line = after[ball : ball + row + 1]
        assert line == [(x, -y, z) for x, y, z in reversed(line)]
        ball += row + 1
    if restitution == 1.0:
        e = energy(scene[1], scene[3])
        assert abs(energy(scene[1], after) - e) <= 2e-15 * e  # one rounding of each velocity a generation


def test_components_of_velocity_across_the_normals_keep_their_bits() -> None:
    velocities: list[Vector] = [(1.0, -0.0, 0.1), (0.0, 5e-324, -0.3)]
    _, after = resolve(([(0, 1)], [1.0, 3.0], [(1.0, 0.0, 0.0)], velocities))
    assert [math.copysign(1, v[1]) for v in after] == [-1.0, 1.0]
    assert [v[1:] for v in after] == [v[1:] for v in velocities]


def test_an_immovable_body_keeps_its_velocity_and_gives_it() -> None:
    """A wall that comes at 2 m/s sends a resting ball away at 4 m/s."""
    scene: Scene = ([(0, 1)], [0.0, 7.0], [(1.0, 0.0, 0.0)], [(2.0, 0.0, 0.0), REST])
    assert resolve(scene)[1] == [(2.0, 0.0, 0.0), (4.0, 0.0, 0.0)]


def test_pairs_that_share_only_what_is_immovable_are_apart() -> None:
    assert components([(0, 1), (0, 2), (2, 3), (4, 0)], [0.0, 1.0, 1.0, 1.0, 1.0]) == [[0], [1, 2], [3]]


def test_two_immovable_bodies_are_left_alone() -> None:
    scene: Scene = ([(0, 1)], [0.0, 0.0], [(1.0, 0.0, 0.0)], [(2.0, 0.0, 0.0), REST])
    assert resolve(scene) == ([Fraction(0)], scene[3])


def test_a_ball_in_a_closing_vice_is_an_error() -> None:
    velocities: list[Vector] = [(1.0, 0.0, 0.0), REST, (-1.0, 0.0, 0.0)]
    with pytest.raises(ValueError, match="squeezed"):
        resolve(([(0, 1), (1, 2)], [0.0, 1.0, 0.0], [(1.0, 0.0, 0.0)] * 2, velocities))


def test_a_pair_that_another_impulse_parts_gets_none() -> None:
    """A heavy ball runs into one that itself runs gently after a light one: only the first pair pushes back."""
    scene: Scene = (
        [(0, 1), (1, 2)],
        [1e-3, 1.0, 1.0],
        [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)],
        [(-10.0, 0.0, 0.0), (-20.0, 0.0, 0.0), (-20.5, 0.0, 0.0)],
    )
    impulses, _ = resolve(scene)
    targets = wanted_speeds(scene[0], scene[2], scene[3], [1.0, 1.0])
    check_complementary(scene, targets, impulses)


@given(st.floats(-300, 300), st.floats(-100, 100))
def test_scales_do_not_matter(speed: float, mass: float) -> None:
    k, w = 2.0 ** int(speed), 2.0 ** int(mass)
    a = resolve(
        ([(0, 1), (1, 2)], [1.0, 3.0, 0.7], [(1.0, 0.0, 0.0), (0.6, 0.8, 0.0)], [(1.0, 0.0, 0.0), REST, (-0.3,) * 3])
    )
    b = resolve(
        (
            [(0, 1), (1, 2)],
            [1.0 * w, 3.0 * w, 0.7 * w],
            [(1.0, 0.0, 0.0), (0.6, 0.8, 0.0)],
            [(1.0 * k, 0.0, 0.0), REST, (-0.3 * k,) * 3],
        )
    )
    assert b[1] == [(x * k, y * k, z * k) for x, y, z in a[1]]
