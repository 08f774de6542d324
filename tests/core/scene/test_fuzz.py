"""Whatever a file holds, reading it gives an engine or a SceneError, and never anything else."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import xpheve as xp
from xpheve.errors import SceneError, XpheveWarning
from xpheve.plugins import Registry
from xpheve.scene import load, loads

quick = settings(max_examples=250, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])

TEXT = """# A scene
xpheve = 1
up = "z"
seed = 3
[run]
until = 1.0
record = "run.arrow"
[[containers]]
name = "clock"
condition = { kind = "Elapsed", seconds = 1.0, every = true }
[[laws]]
id = "toy:wind"
name = "wind"
push = ["1 N", 0.0, 1e-3]
[[laws]]
id = "toy:pull"
between = [["a"], ["b", "#1"]]
[[laws]]
id = "toy:tick"
container = "clock"
[[objects]]
name = "a"
shape = { kind = "sphere", radius = 0.1 }
mass = 1.0
position = [0.0, -1.5, 2e3]
orientation = [1.0, 0.0, 0.0, 0.0]
columns = { charge = 1e-6 }
laws = ["wind", "toy:pull"]
forces = [{ vector = [1.0, 0.0, 0.0], duration = 2.0, id = "push" }]
[[objects]]
name = "b"
fixed = true
shape.kind = "plane"
"""

DATA: dict[str, Any] = {
    "xpheve": 1,
    "up": "z",
    "seed": 3,
    "run": {"until": 1.0, "record": "run.arrow"},
    "containers": [{"name": "clock", "condition": {"kind": "Elapsed", "seconds": 1.0, "every": True}}],
    "laws": [
        {"id": "toy:wind", "name": "wind", "push": ["1 N", 0.0, 1e-3], "limit": None, "mode": "soft"},
        {"id": "toy:pull", "between": [["a"], ["b", "#1"]], "k": "3 N/m"},
        {"id": "toy:tick", "container": "clock"},
        {"id": "toy:tick", "condition": {"kind": "Posted", "id": 3}},
    ],
    "objects": [
        {
            "name": "a",
            "shape": {"kind": "sphere", "radius": 0.1},
            "mass": 1.0,
            "position": [0.0, -1.5, 2e3],
            "columns": {"charge": 1e-6},
            "laws": ["wind", "toy:pull"],
            "forces": [{"vector": [1.0, 0.0, 0.0], "duration": 2.0, "id": "push"}],
        },
        {"name": "b", "fixed": True, "shape": {"kind": "toy:ring", "radius": 2}},
    ],
}

PIECES = [
    "[", "]", "{", "}", '"', "'", '"""', "#", "=", ",", ".", "\n", "\r\n", "\\", "\0", "\ufeff", "-", "nan", "inf", "1e999",
    "1_000", "0x10", "true", "[[objects]]\n", "[[laws]]\n", 'id = "toy:wind"\n', "mass = -1\n", "1979-05-27T07:32:00Z",
    "#1", "toy:pull#1", "\u202e", "\U0001f600", "[objects.shape]\n", "a.b.c = 1\n",
]  # fmt: skip


def attempt(text: str, form: str, registry: Registry) -> None:
    """Read ``text``; anything but an engine or a SceneError comes through."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", XpheveWarning)
        try:
            engine = loads(text, form, name="s", registry=registry)
        except SceneError as wrong:
            assert str(wrong).startswith("s:") or str(wrong).startswith("s: ")
            assert len(str(wrong)) < 2000
        else:
            assert isinstance(engine, xp.PhysicsEngine)


@st.composite
def mutated(draw: st.DrawFn, text: str) -> str:
    """``text`` with some slices taken out, doubled, put elsewhere, or replaced."""
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.integers(0, 40)))
        at = draw(st.integers(0, len(text)))
        piece = draw(st.one_of(st.sampled_from(PIECES), st.text(max_size=5), st.just(text[start:end])))
        text = draw(
            st.sampled_from(
                [
                    text[:start] + text[end:],
                    text[:at] + piece + text[at:],
                    text[:start] + piece + text[end:],
                    text[:end],
                ]
            )
        )
    return text


@quick
@given(text=mutated(TEXT))
def test_mutated_toml_is_read_or_refused(text: str, registry: Registry) -> None:
    attempt(text, "toml", registry)


@quick
@given(text=mutated(json.dumps(DATA, indent=1)))
def test_mutated_json_is_read_or_refused(text: str, registry: Registry) -> None:
    attempt(text, "json", registry)


values = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text(max_size=8),
        st.sampled_from([10**400, 1e308, -0.0, 5e-324, "none", "3 m", "1e400 m", "#1", "#0", "a", "toy:wind", "toy:at_start", ":"]),
    ),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(["kind", "id", "a", "seconds"]), inner, max_size=3),
    max_leaves=5,
)  # fmt: skip


@st.composite
def altered(draw: st.DrawFn) -> Any:
    """The tables with some values replaced, keys renamed, rows taken out."""
    data = json.loads(json.dumps(DATA))
    for _ in range(draw(st.integers(1, 3))):
        here = data
        while True:
            keys = list(here) if isinstance(here, dict) else list(range(len(here)))
            if not keys:
                break
            key = draw(st.sampled_from(keys))
            inner = here[key]
            if isinstance(inner, (dict, list)) and inner and draw(st.integers(0, 4)):
                here = inner
                continue
            act = draw(st.sampled_from(["set", "set", "set", "delete", "rename", "copy"]))
            if act == "set":
                here[key] = draw(values)
            elif act == "delete":
                del here[key]
            elif act == "rename" and isinstance(here, dict):
                here[draw(st.sampled_from(["mass", "id", "kind", "name", "between", "condition", "x"]))] = here.pop(key)
            elif act == "copy" and isinstance(here, list):
                here.append(inner)
            break
    return data


@settings(quick, max_examples=600)
@given(data=altered())
@example(data={**DATA, "objects": [{"shape": {"kind": ":", "radius": 1}}]})
@example(data={**DATA, "objects": [{"columns": {"self": 1, "": 2}}]})
@example(data={"xpheve": 1, "laws": [{"id": "toy:wind", "self": 1}, {"id": "toy:wind", "name": "none"}]})
@example(data={"xpheve": 1, "containers": [{"condition": {"kind": "Started", "self": 1}}]})
def test_altered_tables_are_read_or_refused(data: Any, registry: Registry) -> None:
    attempt(json.dumps(data), "json", registry)


@settings(quick, max_examples=100)
@given(data=st.binary(max_size=60), suffix=st.sampled_from([".toml", ".json"]))
def test_bytes_are_read_or_refused(data: bytes, suffix: str, registry: Registry, tmp_path: Path) -> None:
    path = tmp_path / f"s{suffix}"
    path.write_bytes(data)
    try:
        load(path, registry=registry)
    except SceneError:
        pass


@pytest.mark.parametrize("cut", range(0, len(TEXT), 7))
def test_a_torn_file_is_read_or_refused(cut: int, registry: Registry) -> None:
    attempt(TEXT[:cut], "toml", registry)


def test_the_unharmed_texts_are_read(registry: Registry) -> None:
    assert len(loads(TEXT, registry=registry).objects) == 2
    assert len(loads(json.dumps(DATA), "json", registry=registry).laws) == 4
