"""Thesis 5.3: a library of laws, each with its interface, complexity, benefits and drawbacks beside similar laws."""

from __future__ import annotations

import pytest

from xpheve.plugins import Registry

REGISTRY = Registry(allow=("basic",))
IDS = sorted(info.id for info in REGISTRY.laws() if info.pack == "basic")


@pytest.mark.thesis("packages-of-laws")
def test_5_3_the_library_covers_gravity_drag_wind_springs_fluids_charges_and_frames() -> None:
    names = (
        "black_hole_gravity buoyancy coulomb damper damper_to_point electric_field linear_drag magnetic_field magnus"
    )
    names += " planet_gravity quadratic_drag rotating_frame spring spring_to_point thrust universal_gravity wind"
    assert set(IDS) >= {f"basic:{name}" for name in names.split()}


@pytest.mark.thesis("packages-of-laws")
@pytest.mark.parametrize("id", IDS)
def test_5_3_a_law_is_documented_by_interface_complexity_benefits_and_drawbacks(id: str) -> None:
    text = REGISTRY.law(id).__doc__ or ""
    assert "O(n" in text
    assert "Benefits and drawbacks:" in text
    assert all(param.doc for param in REGISTRY.law(id).params.values())
