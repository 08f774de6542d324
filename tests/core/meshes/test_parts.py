"""Closed parts of mesh files: which is solid, which a cavity, which is turned, and what is said."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from xpheve.errors import MeshWarning
from xpheve.meshes import load, parts, repaired
from xpheve.meshes.parts import winding_number
from xpheve.shapes import Mesh


def box(edge: float, at: tuple[float, float, float] = (0, 0, 0), inverted: bool = False) -> trimesh.Trimesh:
    found = trimesh.creation.box((edge,) * 3)
    found.apply_translation(at)
    if inverted:
        found.invert()
    return found


def read(folder: Path, *meshes: trimesh.Trimesh) -> tuple[float, list[str]]:
    """Volume [m^3] of an STL file of ``meshes``, and the warnings."""
    path = folder / "parts.stl"
    trimesh.util.concatenate(list(meshes)).export(path)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        shape = load(path)
    assert all(one.category is MeshWarning for one in said)
    assert isinstance(shape, Mesh)
    return shape.volume, [str(one.message) for one in said]


def test_an_inverted_part_apart_is_turned_and_said(tmp_path: Path) -> None:
    volume, said = read(tmp_path, box(2.0), box(1.0, (5, 0, 0), inverted=True))
    assert volume == pytest.approx(9.0, rel=1e-15)
    assert len(said) == 1 and "wound inwards: 1 of 2 parts, 12 triangles turned round" in said[0]


def test_an_inverted_part_that_is_greater_is_turned_alone(tmp_path: Path) -> None:
    volume, said = read(tmp_path, box(2.0, inverted=True), box(1.0, (5, 0, 0)))
    assert volume == pytest.approx(9.0, rel=1e-15) and "1 of 2 parts" in said[0]


def test_a_cavity_is_kept_without_a_word(tmp_path: Path) -> None:
    volume, said = read(tmp_path, box(2.0), box(1.0, inverted=True))
    assert volume == pytest.approx(7.0, rel=1e-15) and not said


def test_a_whole_file_inside_out_is_turned_with_its_cavity(tmp_path: Path) -> None:
    volume, said = read(tmp_path, box(2.0, inverted=True), box(1.0))
    assert volume == pytest.approx(7.0, rel=1e-15) and "all triangles turned round" in said[0]


def test_solid_in_solid_counts_twice_and_is_said(tmp_path: Path) -> None:
    volume, said = read(tmp_path, box(2.0), box(1.0))
    assert volume == pytest.approx(9.0, rel=1e-15)
    assert "lies inside another and winds outwards: kept, so that volume and mass count twice there" in said[0]


def test_what_lies_in_a_cavity_is_solid(tmp_path: Path) -> None:
    for inverted in (False, True):
        volume, said = read(tmp_path, box(4.0), box(2.0, inverted=True), box(1.0, inverted=inverted))
        assert volume == pytest.approx(64 - 8 + 1, rel=1e-15)
        assert len(said) == inverted and (not said or "1 of 3 parts" in said[0])


def test_a_part_beside_a_bent_one_is_not_inside_it(tmp_path: Path) -> None:
    ring = trimesh.creation.torus(5.0, 1.0)
    for inverted in (False, True):
        volume, said = read(tmp_path, ring, box(1.0, inverted=inverted))
        assert volume == pytest.approx(ring.volume + 1.0, rel=1e-6) and len(said) == inverted


def test_a_cavity_that_touches_the_outer_face_from_within_is_a_cavity() -> None:
    outer, inner = box(2.0), box(1.0, (0.5, 0.0, 0.0), inverted=True)  # one face in that of the other
    both = trimesh.util.concatenate([outer, inner])
    found = repaired(both.vertices, both.faces)
    assert not found.repairs and Mesh(found.vertices, found.faces).volume == pytest.approx(7.0)


def test_too_many_parts_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "MOST_WORK", 10)
    both = trimesh.util.concatenate([box(2.0), box(1.0, inverted=True)])
    assert "too many to tell which lies inside which" in repaired(both.vertices, both.faces).repairs[0]


coordinates = st.floats(-2.0, 2.0).filter(lambda x: abs(abs(x) - 1.0) > 1e-6)


@settings(max_examples=100, deadline=None)
@given(st.tuples(coordinates, coordinates, coordinates), st.sampled_from([1e-100, 1e-3, 1.0, 1e25]))
def test_the_winding_number_is_one_inside_and_zero_outside(at: tuple[float, float, float], scale: float) -> None:
    one = box(2.0)
    turns = winding_number(scale * np.array(at), scale * one.vertices[one.faces])
    assert turns == pytest.approx(float(max(map(abs, at)) < 1.0), abs=1e-9)
