"""The door of queries: core asks, a pack answers; without one the error says which to install."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import xpheve as xp
from xpheve.errors import UnknownLawError
from xpheve.plugins.registry import Registry
from xpheve.queries import Queries, RayHits
from xpheve.steppers.contract import ContactServer


def test_without_a_pack_the_error_says_which_to_install() -> None:
    engine = xp.PhysicsEngine(registry=Registry(disable=["collision"]))
    with pytest.raises(UnknownLawError, match="pip install xpheve-laws-collision"):
        engine.queries  # noqa: B018


def test_a_contact_server_answers_no_queries_unless_it_says_so() -> None:
    assert ContactServer.queries(xp.PhysicsEngine()) is None


def test_the_answers_are_of_the_contract_and_the_same_each_time() -> None:
    engine = xp.PhysicsEngine()
    assert isinstance(engine.queries, Queries) and engine.queries is engine.queries
    assert engine.copy().queries is not engine.queries
    assert engine._world.contacts is None  # asking takes up no contact server


def test_an_engine_that_is_asked_nothing_imports_nothing_of_it() -> None:
    import subprocess
    import sys

    code = (
        "import sys, xpheve as xp; e = xp.PhysicsEngine(); e.add_object(xp.PhysicalObject()); e.run(until=1.0); "
        "assert not [m for m in sys.modules if 'queries' in m or m.endswith('plan.periodic')], sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


def test_hits_are_read_by_number() -> None:
    ball: Any = object()
    nan = np.full(3, np.nan)
    hits = RayHits(
        np.array([0, -1]),
        np.array([2.0, np.inf]),
        np.array([(1.0, 2.0, 3.0), nan]),
        np.array([(0.0, 0.0, 1.0), nan]),
        (ball,),
    )
    assert len(hits) == 2 and hits[1] is None
    assert hits[0] == (ball, 2.0, (1.0, 2.0, 3.0), (0.0, 0.0, 1.0))
