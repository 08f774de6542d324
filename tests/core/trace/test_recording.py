"""What an author is told to write in place of a Python decision."""

from __future__ import annotations

import pytest

import xpheve as xp
from xpheve.errors import TraceError
from xpheve.trace.recording import Recording, _instead_of, _instead_of_branch


@pytest.mark.parametrize(
    ("line", "advice"),
    [
        ("if v.norm() > 10:", "Use np.where(v.norm() > 10, a, b)"),
        ("elif v.norm() > self.c: return 0", "Use np.where(v.norm() > self.c, a, b)"),
        ("while r < 3:", "Use np.where(r < 3, a, b)"),
        ("assert r > 0, 'inside'", "Use np.where(r > 0, a, b)"),
        ("return a * d if r < 1 else 0.0", "Use np.where(r < 1, a * d, 0.0)"),
        ("k = self.k if r < self.r0 else self.l", "Use np.where(r < self.r0, self.k, self.l)"),
        ("return min(r, 3.0) * d", "Use np.minimum(a, b) or np.maximum(a, b)"),
        ("x = r > 0 and r < 1", "Use np.where(condition, a, b), with (p) & (q) for `p and q`, (p) | (q) for `p or q`, ~(p) for `not p`"),
        ("", "Use np.where(condition, a, b)"),
    ],
)  # fmt: skip
def test_the_advice_names_the_authors_own_condition(line: str, advice: str) -> None:
    assert _instead_of_branch(line) == advice


def test_functions_of_the_math_module_have_a_name_in_numpy() -> None:
    assert _instead_of("float()", "return math.atan2(y, x)") == "Use np.arctan2"
    assert _instead_of("float()", "return float(x)") == "Leave float() out"


def test_the_first_error_is_kept() -> None:
    recording = Recording("test:law", pair=True)
    with pytest.raises(TraceError, match="first") as first:
        recording.refuse("first")
    with pytest.raises(TraceError, match="second"):
        recording.refuse("second")
    assert recording.error is first.value
    assert recording.apply == "apply(self, a, b)"


def test_a_line_that_nobody_can_read_is_named_by_its_number() -> None:
    text = "def force(self, body):\n    '''N.'''\n    return body.mass + body.velocity\n"
    space: dict[str, object] = {}
    exec(compile(text, "typed at a prompt", "exec"), space)
    law = type("Typed", (xp.FieldLaw,), {"__doc__": "Typed.", "id": "test:typed", "force": space["force"]})
    with pytest.raises(TraceError, match=r"typed at a prompt:3\.") as refused:
        xp.PhysicsEngine().add_law(law)
    assert ": ." not in str(refused.value)
