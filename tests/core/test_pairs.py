"""Which pairs a pair law acts on, how far it reaches, and in which order its forces are added."""

import math
import time
import tracemalloc
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import InvalidValueError, LawDefinitionError, OwnershipError, ParameterError, SceneError
from xpheve.plan import pairs as pairs_module
from xpheve.plan.pairs import PairSet, add_opposite


class Bond(xp.PairLaw):
    """A spring of no length, stronger on what is charged as ``a``: which of a pair is ``a`` shows."""

    id = "toy:bond"
    columns: ClassVar[dict[str, xp.Column]] = {"weight": xp.Column(1.0, unit="1")}
    k = xp.Param(1.0, unit="N/m", ge=0)

    def force(self, a: Any, b: Any) -> Any:
        return -self.k * a.weight * (a.position - b.position)

    def potential(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return 0.5 * self.k * a.weight * d.dot(d)


class Short(xp.PairLaw):
    """A push that would reach without end, were it not for its cutoff."""

    id = "toy:short"
    cutoff = xp.Param(1.0, unit="m", gt=0, doc="c.")
    soft = xp.Constant(0.01, "m^2")
    strength = xp.Constant(1.0, "J")

    def force(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return self.strength * d / (d.dot(d) + self.soft)

    def potential(self, a: Any, b: Any) -> Any:
        d = a.position - b.position
        return -0.5 * self.strength * np.log((d.dot(d) + self.soft) / (self.cutoff**2 + self.soft))


def scene(
    law: Any, x: Any, *, fixed: Any = (), laws: bool = True, stepper: str = ""
) -> tuple[xp.PhysicsEngine, list[xp.PhysicalObject]]:
    """An engine with bodies at ``x``, all under ``law`` if ``laws``."""
    engine = xp.PhysicsEngine(stepper=stepper)
    if laws:
        engine.add_law(law)
    bodies = [
        xp.PhysicalObject(position=tuple(map(float, p)), fixed=k in fixed, name=f"o{k}", mass=1.0 + 0.5 * k)
        for k, p in enumerate(x)
    ]
    engine.add_objects(bodies, laws=[law] if laws else [])
    return engine, bodies


def cloud(n: int, seed: int = 1, size: float = 2.0) -> Any:
    return np.random.default_rng(seed).uniform(-size, size, (n, 3))


def found(pairs: PairSet, x: Any) -> list[tuple[int, int]]:
    """The pairs as (row of a, row of b), in order, whatever the chunks."""
    position = np.asarray(x, dtype=float).T.copy()
    return [(a, b) for one in pairs.chunks(position) for a, b in zip(*(side.tolist() for side in one), strict=True)]


def near(x: Any, i: int, j: int, reach: float) -> bool:
    dx, dy, dz = (float(x[i][k]) - float(x[j][k]) for k in range(3))
    return dx * dx + dy * dy + dz * dz < reach * reach


# Pairs as given


def test_a_law_with_pairs_acts_on_these_and_maps_what_they_name() -> None:
    engine, o = scene(None, cloud(4), laws=False)
    bond = engine.add_law(Bond, pairs=[(o[2], o[0]), (o[1], o[2])])
    assert bond.pairs == ((o[2], o[0]), (o[1], o[2]))
    assert bond.objects == (o[0], o[1], o[2])
    engine.step(0.1)
    assert o[3].velocity == (0.0, 0.0, 0.0)
    assert all(any(one.velocity) for one in o[:3])


def test_the_force_is_on_the_first_of_a_pair_as_given() -> None:
    for first, second, weight in ((0, 1, 5.0), (1, 0, 1.0)):
        engine = xp.PhysicsEngine()
        o = [xp.PhysicalObject(position=(float(k), 0, 0), weight=5.0 if k == 0 else 1.0) for k in range(2)]
        engine.add_objects(o)
        engine.add_law(Bond, pairs=[(o[first], o[second])])
        assert engine.energy().potential == 0.5 * weight
        engine.step(1e-3)
        assert o[0].velocity[0] == pytest.approx(1e-3 * weight, rel=1e-5)
        assert o[0].velocity[0] == -o[1].velocity[0]


def test_sums_do_not_depend_on_the_order_in_which_pairs_are_given() -> None:
    x = cloud(12)
    order = [(i, j) for i in range(12) for j in range(i)]
    states = []
    for seed in range(3):
        engine, o = scene(None, x, laws=False)
        np.random.default_rng(seed).shuffle(order)
        engine.add_law(Bond, pairs=[(o[i], o[j]) for i, j in order])
        engine.run(until=0.3, dt=0.01)
        states.append([one.position + one.velocity for one in o])
    assert states[0] == states[1] == states[2]


WRONG = {
    "with itself": (lambda o: [(o[0], o[1]), (o[1], o[1])], "pairs[1] joins <PhysicalObject 'o1'> with itself"),
    "twice": (lambda o: [(o[0], o[1]), (o[0], o[1])], "pairs[1] = (<PhysicalObject 'o0'>, <PhysicalObject 'o1'>) was given before"),
    "twice, turned": (lambda o: [(o[0], o[1]), (o[1], o[0])], "was given before: give each pair once"),
    "three": (lambda o: [(o[0], o[1], o[2])], "two objects are needed"),
    "no objects": (lambda o: [("o0", "o1")], "pairs[0] = ('o0', 'o1'): two objects are needed"),
    "no pairs": (lambda o: [o[0], o[1]], "a list of pairs of objects is needed"),
    "no list": (lambda o: 7, "pairs = 7: a list of pairs of objects is needed"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_pairs_that_are_none_are_refused_by_name_before_anything_changes(name: str) -> None:
    make, said = WRONG[name]
    engine, o = scene(None, cloud(3), laws=False)
    with pytest.raises(InvalidValueError) as wrong:
        engine.add_law(Bond, pairs=make(o))
    assert said in str(wrong.value) and str(wrong.value).startswith("toy:bond: ")
    assert engine.laws == () and all(one.laws == () for one in o)


def test_between_and_pairs_together_are_refused() -> None:
    engine, o = scene(None, cloud(3), laws=False)
    with pytest.raises(InvalidValueError, match="between and pairs both say which pairs; give one"):
        engine.add_law(Bond, between=(o[0], o[1]), pairs=[(o[0], o[1])])


def test_pairs_of_another_engine_are_refused() -> None:
    engine, o = scene(None, cloud(2), laws=False)
    with pytest.raises(OwnershipError, match=r"pairs name <PhysicalObject 'far'>, which is not in this engine"):
        engine.add_law(Bond, pairs=[(o[0], xp.PhysicalObject(name="far"))])
    assert engine.laws == ()


def test_an_empty_list_of_pairs_joins_nobody() -> None:
    engine, o = scene(None, cloud(2), laws=False)
    bond = engine.add_law(Bond, pairs=[])
    for one in o:
        engine.map(one, bond)
    engine.step(0.1)
    assert engine.energy() == (0.0, 0.0, 0.0)


def test_only_pairs_join_groups() -> None:
    engine, o = scene(None, cloud(7), fixed={3}, laws=False)
    engine.add_law(Bond, pairs=[(o[0], o[1]), (o[1], o[2]), (o[2], o[3]), (o[3], o[4]), (o[5], o[4])])
    engine.step(0.01)
    world = engine._world
    assert [world.group_of(one) for one in o[:3]] == [o[:3]] * 3  # what is fixed joins nothing
    assert world.group_of(o[4]) == world.group_of(o[5]) == o[4:6]
    assert engine.explain().data["laws"][0]["pairs"] == "5 given"


def test_the_pairs_of_a_removed_object_are_gone() -> None:
    engine, o = scene(None, [(0, 0, 0), (1, 0, 0), (2, 0, 0)], laws=False)
    bond = engine.add_law(Bond, pairs=[(o[0], o[1]), (o[1], o[2])])
    engine.step(0.01)
    engine.remove_object(o[0])
    assert bond.pairs == ((o[1], o[2]),)
    before = o[1].position[0] * o[1].mass + o[2].position[0] * o[2].mass
    energy = engine.energy().potential
    assert energy == pytest.approx(0.5 * (o[2].position[0] - o[1].position[0]) ** 2)
    speed = o[1].velocity[0] * o[1].mass + o[2].velocity[0] * o[2].mass
    engine.step(0.01)
    after = o[1].position[0] * o[1].mass + o[2].position[0] * o[2].mass
    assert after - before == pytest.approx(0.01 * speed, rel=1e-9)


def test_an_unmapped_object_takes_no_part_until_it_is_mapped_again() -> None:
    engine, o = scene(None, [(0, 0, 0), (1, 0, 0), (2, 0, 0)], laws=False)
    bond = engine.add_law(Bond, pairs=[(o[0], o[1]), (o[1], o[2])])
    engine.unmap(o[0], bond)
    assert engine.energy().potential == 0.5 and len(bond.pairs) == 2
    engine.step(0.01)
    assert o[0].velocity == (0.0, 0.0, 0.0)
    engine.map(o[0], bond)
    engine.step(0.01)
    assert o[0].velocity[0] > 0.0


def test_a_driven_end_pulls_its_pairs() -> None:
    engine, o = scene(None, [(0, 0, 0), (1, 0, 0), (5, 0, 0)], laws=False)
    engine.add_law(Bond, pairs=[(o[0], o[1]), (o[2], o[1])])
    o[0].hold()
    engine.run(until=0.1, dt=0.01)
    assert o[0].position == (0.0, 0.0, 0.0) and o[1].velocity[0] > 0.0
    o[0].carry((-50.0, 0.0, 0.0), within=0.05)
    engine.run(until=0.3, dt=0.01)
    assert o[1].velocity[0] < 0.0
    energy = engine.energy()
    assert energy.work != 0.0 and abs(energy.balance - 8.5) < 0.05 * abs(energy.work)


def moved(engine: xp.PhysicsEngine) -> list[tuple[float, ...]]:
    engine.run(until=engine.time + 0.2, dt=0.01)
    return [one.position + one.velocity for one in engine.objects]


def test_copies_checkpoints_and_a_reset_keep_the_pairs(tmp_path: Any) -> None:
    engine, o = scene(None, cloud(5), laws=False)
    bond = engine.add_law(Bond, pairs=[(o[3], o[0]), (o[1], o[3]), (o[4], o[2])])
    engine.step(0.01)
    engine.remove_object(o[1])
    other = engine.copy()
    assert [[one.name for one in pair] for pair in other.laws[0].pairs] == [["o3", "o0"], ["o4", "o2"]]
    engine.checkpoint(tmp_path / "c")
    again = xp.PhysicsEngine.restore(tmp_path / "c", laws=[Bond])
    assert moved(other) == moved(again) == moved(engine)
    engine.reset()
    assert [[one.name for one in pair] for pair in bond.pairs] == [["o3", "o0"], ["o1", "o3"], ["o4", "o2"]]


# Scene files


def springs(pairs: str = "") -> str:
    rows = "".join(f'[[objects]]\nname = "o{k}"\nposition = [{k}, 0, 0]\n' for k in range(3))
    return f'xpheve = 1\n[[laws]]\nid = "basic:spring"\n{pairs}\n{rows}'


def test_a_scene_file_names_pairs_and_is_written_as_it_was_read() -> None:
    from xpheve.scene import dumps, loads

    engine = loads(springs('pairs = [["o2", "o0"], ["o1", "#3"]]'), form="toml")
    spring, o = engine.laws[0], engine.objects
    assert spring.pairs == ((o[2], o[0]), (o[1], o[2]))
    assert all(one.laws == (spring,) for one in o)
    text = dumps(engine)
    assert 'pairs = [["o2", "o0"], ["o1", "o2"]]' in text and "laws = " not in text
    again = loads(text, form="toml")
    assert dumps(again) == text
    assert moved(again) == moved(engine)


FILES = {
    'pairs = [["o0", "o0"]]': 'pairs: "o0" and "o0" are one object: two different objects are needed',
    'pairs = [["o0", "o1"], ["o1", "o0"]]': 'pairs: "o1" and "o0" are a pair already: give each pair once, in one order',
    'pairs = [["o0", "o9"]]': 'pairs: no object of this file is called "o9"',
    'pairs = [["o0"]]': "a list of pairs of object names is needed",
    'pairs = [["o0", "o1"]]\nbetween = ["o0", "o1"]': "pairs: between says which pairs already; give one of the two",
}


@pytest.mark.parametrize("pairs", FILES)
def test_a_scene_file_with_wrong_pairs_is_refused_with_its_line(pairs: str) -> None:
    from xpheve.scene import loads

    with pytest.raises(SceneError) as wrong:
        loads(springs(pairs), form="toml")
    assert FILES[pairs] in str(wrong.value) and 'law "basic:spring"' in str(wrong.value)


def test_pairs_for_a_law_of_single_objects_are_refused_in_a_scene_file() -> None:
    from xpheve.scene import loads

    text = springs('pairs = [["o0", "o1"]]').replace("basic:spring", "basic:planet_gravity")
    with pytest.raises(SceneError, match="takes no pairs; name it in their laws"):
        loads(text, form="toml")


# Cutoff


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, "2 m", True])
def test_a_cutoff_that_is_no_length_is_refused_where_it_is_written(value: Any) -> None:
    with pytest.raises(LawDefinitionError, match=r"Wrong\.cutoff = .*: a length above 0 m is needed"):
        type("Wrong", (Bond,), {"id": "toy:wrong", "cutoff": value})


def test_a_cutoff_parameter_without_a_bound_is_refused_where_it_is_written() -> None:
    with pytest.raises(LawDefinitionError, match=r'write cutoff = Param\(2.5, unit="m", gt=0\)'):
        type("Wrong", (Bond,), {"id": "toy:wrong", "cutoff": xp.Param(2.5, unit="m")})


def test_a_property_that_gives_no_length_is_refused_when_the_law_is_added() -> None:
    kind = type("Wrong", (Bond,), {"id": "toy:wrong", "cutoff": property(lambda law: -law.k)})
    engine = xp.PhysicsEngine()
    with pytest.raises(LawDefinitionError, match=r"toy:wrong\.cutoff = -1\.0"):
        engine.add_law(kind)
    assert engine.laws == ()


def test_a_cutoff_is_checked_as_any_parameter_and_may_be_none_or_infinite() -> None:
    with pytest.raises(ParameterError):
        Short(cutoff=0.0)
    free = type("Free", (Bond,), {"id": "toy:free", "cutoff": xp.Param(None, unit="m", gt=0)})
    assert free().reach() == Bond().reach() == math.inf
    assert free(cutoff="20 cm").reach() == 0.2
    assert type("Plain", (Bond,), {"cutoff": 3})().reach() == 3.0


def test_at_and_beyond_the_cutoff_force_and_potential_are_exactly_0() -> None:
    short = Short()
    engine, o = scene(short, [(0, 0, 0), (1, 0, 0), (-math.nextafter(1.0, 0.0), 0, 0)])
    assert engine.energy().potential != 0.0
    engine.remove_object(o[2])
    assert engine.energy().potential == 0.0
    engine.step(0.1)
    assert o[0].velocity == o[1].velocity == (0.0, 0.0, 0.0)
    assert short.evaluations == 1
    short.cutoff = 1.5
    engine.step(0.1)
    assert o[0].velocity[0] < 0.0 < o[1].velocity[0]
    assert engine.explain().data["laws"][0]["cutoff"] == 1.5
    assert "pairs: all of 2 objects, cutoff 1.5 m" in str(engine.explain())


@pytest.mark.parametrize("n", [20, 400])
def test_energy_is_kept_across_the_cutoff(n: int) -> None:
    engine, _ = scene(Short(cutoff=0.6), cloud(n, size=0.1 * n ** (1 / 3) + 0.5))
    before = engine.energy()
    engine.run(until=0.2, dt=0.002)
    after = engine.energy()
    assert after.kinetic > 1e-3
    assert abs(after.total - before.total) < 2e-4 * after.kinetic * n**0.5


# The set


def oracle(law: Any, x: Any, still: Any, these: Any = None, those: Any = None) -> list[tuple[int, int]]:
    """The pairs by their definition, one by one."""
    n, reach, result = len(x), law.reach(), []
    for i in range(n):
        for j in range(i + 1, n):
            if (still[i] and still[j]) or (math.isfinite(reach) and not near(x, i, j, reach)):
                continue
            if these is None:
                result.append((i, j))
            elif i in these and j in those:
                result.append((i, j))
            elif j in these and i in those:
                result.append((j, i))
    return result


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_a_set_has_the_pairs_of_the_definition_in_their_order(data: Any) -> None:
    n = data.draw(st.integers(0, 40))
    seed = data.draw(st.integers(0, 2**32 - 1))
    reach = data.draw(st.sampled_from([math.inf, 0.3, 1.0, 10.0]))
    r = np.random.default_rng(seed)
    x = r.uniform(-1.5, 1.5, (n, 3))
    still = r.random(n) < data.draw(st.sampled_from([0.0, 0.3, 1.0]))
    o = [xp.PhysicalObject() for _ in range(n)]
    for k, obj in enumerate(o):
        obj._row = k
    kind = data.draw(st.sampled_from(["all", "between", "pairs"]))
    these = those = None
    if kind == "between":
        these, those = ({int(k) for k in np.flatnonzero(r.random(n) < p)} for p in (0.3, 0.6))
        law = Bond(between=([o[k] for k in r.permutation(sorted(these)).astype(int)], [o[k] for k in those]))
        expected = None
    elif kind == "pairs":
        every = [(i, j) for i in range(n) for j in range(i + 1, n) if r.random() < 0.3]
        turned = [(j, i) if r.random() < 0.5 else (i, j) for i, j in every]
        law = Bond(pairs=[(o[i], o[j]) for i, j in [turned[k] for k in r.permutation(len(turned))]])
        expected = [
            (a, b) for a, b in turned if not (still[a] and still[b]) and (reach == math.inf or near(x, a, b, reach))
        ]
    else:
        law, expected = Bond(), None
    law.cutoff = reach
    if expected is None:
        expected = oracle(law, x, still, these, those)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pairs_module, "CHUNK", data.draw(st.sampled_from([1, 7, 1000])))
        patch.setattr(pairs_module, "KEPT", data.draw(st.sampled_from([0, 10, 10**6])))
        patch.setattr(pairs_module, "CROWDED", data.draw(st.sampled_from([0, 64])))
        pairs = PairSet(law, o, still)
        assert found(pairs, x) == expected
        far = {row for pair in zip(*(side.tolist() for side in pairs.every()), strict=True) for row in pair}
        assert set(pairs.used.tolist()) == far


HARD = {
    "clusters": lambda r: (r.normal(0, 0.3, (200, 3)) + 40.0 * r.integers(-2, 3, (200, 3)), 0.4),
    "on a line": lambda r: (r.uniform(-50, 50, (200, 1)) * np.array([[1.0, 2.0, -0.5]]), 2.0),
    "in one place": lambda r: (np.zeros((150, 3)) + 3.0, 0.1),
    "at exactly the reach": lambda r: (r.integers(-3, 4, (200, 3)).astype(float), 1.0),
    "huge": lambda r: (r.uniform(-1e12, 1e12, (200, 3)), 4e11),
    "far from the origin": lambda r: (1e12 + r.uniform(0, 3, (200, 3)), 0.7),
    "tiny": lambda r: (r.uniform(-1e-9, 1e-9, (200, 3)), 5e-10),
    "one far away": lambda r: (np.vstack([r.uniform(-2, 2, (199, 3)), [[1e12, -1e308, 1e9]]]), 0.8),
    "not finite": lambda r: (r.choice([0.0, 0.5, 1e308, -1e308, math.nan, math.inf, -math.inf], (200, 3)), 1.0),
    "beyond all squares": lambda r: (r.uniform(-1, 1, (200, 3)), 1e200),
}


@pytest.mark.parametrize("name", HARD)
def test_cells_find_the_pairs_of_brute_force_wherever_bodies_lie(name: str) -> None:
    x, reach = HARD[name](np.random.default_rng(3))
    o = [xp.PhysicalObject() for _ in x]
    for k, obj in enumerate(o):
        obj._row = k
    pairs = PairSet(Short(cutoff=reach), o, [False] * len(x))
    assert pairs.count > pairs_module.CROWDED * len(x)
    assert found(pairs, x) == [(i, j) for i in range(len(x)) for j in range(i + 1, len(x)) if near(x, i, j, reach)]


# Sums


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 6), st.integers(0, 60), st.integers(0, 2**32 - 1))
def test_forces_are_added_to_the_bits_of_a_loop_in_scalars(n: int, count: int, seed: int) -> None:
    r = np.random.default_rng(seed)
    a, b = r.integers(-1, n, (2, count))
    force = r.normal(0, 1, (3, count)) * 10.0 ** r.integers(-12, 12, (3, count))
    expected = [[0.0] * n for _ in range(3)]
    for p in range(count):
        for k in range(3):
            if a[p] >= 0:
                expected[k][a[p]] += float(force[k, p])
            if b[p] >= 0:
                expected[k][b[p]] -= float(force[k, p])
    total = np.zeros((3, n))
    cut = count // 3
    for part in (slice(0, cut), slice(cut, None)):
        add_opposite(total, a[part], b[part], force[:, part])
    assert total.tobytes() == np.array(expected).tobytes()


def test_the_engine_adds_forces_to_the_bits_of_a_loop_in_scalars(monkeypatch: pytest.MonkeyPatch) -> None:
    """Any chunks, any fixed ones among them: the same bits."""
    x, results = cloud(60), []
    for chunk in (1, 50, 10**6):
        monkeypatch.setattr(pairs_module, "CHUNK", chunk)
        engine, o = scene(Bond(), x, fixed={5, 6, 7}, stepper="core:midpoint")
        engine.step(0.0078125)
        results.append([one.velocity for one in o])
    assert results[0] == results[1] == results[2]
    sums = [[0.0] * 3 for _ in x]
    by_rank = sorted(range(60), key=lambda k: o[k].rank)
    for place, i in enumerate(by_rank):
        for j in by_rank[place + 1 :]:
            if not {i, j} <= {5, 6, 7}:
                for k in range(3):
                    f = -1.0 * 1.0 * (float(x[i, k]) - float(x[j, k]))
                    sums[i][k] += f
                    sums[j][k] -= f
    for k, one in enumerate(o):
        expected = (0.0, 0.0, 0.0) if one.fixed else tuple(f * (1.0 / one.mass) * 0.0078125 for f in sums[k])
        assert one.velocity == expected


# Many


@pytest.mark.slow
def test_ten_thousand_objects_with_a_cutoff_take_less_than_a_second() -> None:
    m = 22
    x = 1.06 * np.stack(np.meshgrid(*[np.arange(float(m))] * 3), -1).reshape(-1, 3)[:10_000]
    x += np.random.default_rng(1).normal(0, 0.05, x.shape)
    short = Short(cutoff=2.5)
    engine, _ = scene(short, x)
    engine.step(1e-4)
    spent = []
    for _ in range(3):
        begin = time.process_time()
        potential = engine.energy().potential
        spent.append(time.process_time() - begin)
    assert min(spent) < 1.0
    sample = np.random.default_rng(2).integers(0, 10_000, 20)
    mine = []
    for k in sample.tolist():
        d2 = ((engine.bodies.position - engine.bodies.position[k]) ** 2).sum(axis=1)
        d2 = d2[(d2 < 6.25) & (np.arange(10_000) != k)]
        mine.append(float(-0.5 * np.log((d2 + 0.01) / 6.26).sum()))
    whole = 0.5 * 10_000 * np.mean(mine)
    assert 0.7 * whole < potential < 1.3 * whole


@pytest.mark.slow
def test_three_thousand_objects_without_a_cutoff_take_little_memory() -> None:
    x = cloud(3000)
    first, _ = scene(Bond(), x[:500])
    first.step(1e-3)  # the compiler, if it is needed, is loaded before it counts
    engine, _ = scene(Bond(), x)
    tracemalloc.start()
    try:
        potential = engine.energy().potential
        engine.step(1e-3)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 60e6
    centre = x.mean(axis=0)
    assert potential == pytest.approx(0.5 * 3000 * ((x - centre) ** 2).sum(), rel=1e-12)


def test_pairs_that_came_in_while_the_engine_ran_are_replayed() -> None:
    engine, o = scene(None, [(0, 0, 0), (1, 0, 0), (2, 0, 0)], laws=False)
    first = engine.copy()

    engine.start()
    assert engine.wait(until=0.05, timeout=30)
    engine.add_law("basic:spring", pairs=[(o[2], o[0])], stiffness=3.0)
    assert engine.wait(until=engine.time + 0.1, timeout=30)
    engine.terminate()
    first.replay(engine.inputs)
    assert [[one.name for one in pair] for pair in first.laws[0].pairs] == [["o2", "o0"]]
    assert any(first.object("o0").velocity) and first.checkpoint() == engine.checkpoint()
