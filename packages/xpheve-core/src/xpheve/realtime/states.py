"""The states of an engine and what each command does in each: one table, from which the errors and the docs come.

Source: Nourian (2004), figures 3-4 and 3-8; what those leave open is decided in docs/decisions/0012.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from xpheve.errors import StateError

STATES = {
    "ready": "waits for run, step or start",
    "running": "is in run or step, called by the host",
    "started": "runs in real time on its own thread",
    "suspended": "was suspended without a clock",
    "paused": "was started and is suspended; the clock stands",
    "failed": "was started and stands just before an event that failed; the clock stands",
    "terminated": "has ended",
}
"""What each state means; `PhysicsEngine.state` says ``"running"`` for started, and ``"suspended"`` for paused."""


class Cell(NamedTuple):
    """What a command does in a state: the state afterwards and what happens, or (``after`` empty) the way out."""

    after: str
    says: str

    @property
    def allowed(self) -> bool:
        """Whether the command may be given."""
        return self.after != ""


def _no(way_out: str) -> Cell:
    return Cell("", way_out)


_END = "terminate() and reset() it first, or go on with engine.copy()"
_RESUME = "resume() it first"
_RESET = "reset() it first"
_HANDLER = "a handler cannot run it again"
_START = "start() it first"

_RUN = {
    "ready": Cell("ready", "carries the scene on, and is ready again"),
    "running": _no(_HANDLER),
    "started": _no(_END),
    "suspended": _no(_RESUME),
    "paused": _no(_END),
    "failed": _no(_END),
    "terminated": _no(_RESET),
}

TABLE: dict[str, dict[str, Cell]] = {
    "start": {
        "ready": Cell("started", "the clock goes on from the present simulation time"),
        "running": _no("start() when the run is over"),
        "started": _no("it is started already"),
        "suspended": _no(_RESUME),
        "paused": _no("resume() goes on"),
        "failed": _no("resume() tries again, reset() goes back to 0"),
        "terminated": _no(_RESET),
    },
    "run": _RUN,
    "step": _RUN,
    "replay": _RUN,
    "suspend": {
        "ready": Cell("suspended", "nothing runs until resume"),
        "running": Cell("suspended", "the run ends after the present instant"),
        "started": Cell("paused", "objects stand still and the clock stands; no CPU"),
        "suspended": _no("it is suspended already"),
        "paused": _no("it is suspended already"),
        "failed": _no("it stands still already; resume() tries again"),
        "terminated": _no(_RESET),
    },
    "resume": {
        "ready": _no("only what is suspended can be resumed"),
        "running": _no("only what is suspended can be resumed"),
        "started": _no("only what is suspended can be resumed"),
        "suspended": Cell("ready", "it may run again; no start"),
        "paused": Cell("started", "goes on as if nothing had been; no start"),
        "failed": Cell("started", "tries again from just before the event that failed"),
        "terminated": _no(_RESET),
    },
    "terminate": {
        "ready": Cell("terminated", "nothing runs until reset"),
        "running": Cell("terminated", "the run ends after the present instant"),
        "started": Cell("terminated", "what was written before is done, then the thread ends"),
        "suspended": Cell("terminated", "nothing runs until reset"),
        "paused": Cell("terminated", "what was written before is done, then the thread ends"),
        "failed": Cell("terminated", "what was written before is done, then the thread ends"),
        "terminated": Cell("terminated", "nothing more"),
    },
    "reset": {
        "ready": Cell("ready", "time 0 and the scene as first started"),
        "running": _no("reset() when the run is over"),
        "started": _no("suspend() or terminate() it first"),
        "suspended": Cell("ready", "time 0 and the scene as first started"),
        "paused": Cell("ready", "the thread ends; time 0 and the scene as first started"),
        "failed": Cell("ready", "the thread ends; time 0 and the scene as first started"),
        "terminated": Cell("ready", "time 0 and the scene as first started"),
    },
    "wait": {
        "ready": _no(_START),
        "running": _no("a handler cannot wait"),
        "started": Cell("started", "sleeps until the time, or the end"),
        "suspended": _no(_START),
        "paused": Cell("paused", "sleeps on: somebody may resume; returns after a stop time or a handler's suspend"),
        "failed": Cell("failed", "raises what failed"),
        "terminated": Cell("terminated", "returns at once"),
    },
    "frame_passed": {
        "ready": _no(_START),
        "running": _no(_START),
        "started": Cell("started", "counts a frame of the host; each n-th makes an update"),
        "suspended": _no(_START),
        "paused": Cell("paused", "nothing: a suspended engine monitors nothing but its commands"),
        "failed": Cell("failed", "nothing"),
        "terminated": _no(_RESET),
    },
}
"""By command, then by state."""


def state_of(engine: Any, command: str = "") -> str:
    """The row of the table in which ``engine`` is, for ``command``."""
    plain: str = engine._state
    live: bool = engine._live is not None
    if engine._running and command in ("start", "run", "step", "replay", "reset"):
        plain = "running"  # also after a handler suspended or terminated it
    return {"running": "started", "suspended": "paused"}.get(plain, plain) if live else plain


def check(engine: Any, command: str) -> Cell:
    """The cell of ``command`` now; raises `StateError` with the way out if it is refused."""
    state = state_of(engine, command)
    cell = TABLE[command][state]
    if not cell.allowed:
        raise StateError(f"{command}: the engine {STATES[state]} ({state}): {cell.says}")
    return cell


__all__ = ["STATES", "TABLE", "Cell", "check", "state_of"]
