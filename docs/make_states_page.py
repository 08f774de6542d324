"""Writes ``real_time_states.md`` from the table of states and commands.

Run ``python docs/make_states_page.py`` after the table has changed; a test says when that was forgotten.
"""

from __future__ import annotations

from pathlib import Path

from xpheve.realtime.states import STATES, TABLE

PAGE = Path(__file__).parent / "real_time_states.md"

HEAD = """\
# States and commands

What each command does in each state of an engine. This page is made by `docs/make_states_page.py` from the table that the engine
itself asks (`xpheve/realtime/states.py`); where a command is refused, the error says the way out in the same words. Each cell has a
test. Why it is so: [decision 12](decisions/0012-the-real-clock.md).

`engine.state` says `"running"` for *running* and *started*, `"suspended"` for *suspended* and *paused*.
"""


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD, "| state | the engine |\n|---|---|"]
    parts[-1] += "".join(f"\n| {state} | {says} |" for state, says in STATES.items())
    for command, row in TABLE.items():
        lines = [f"## {command}", "", "| in state | becomes | |", "|---|---|---|"]
        for state, cell in row.items():
            what = cell.says if cell.allowed else f"refused: {cell.says}"
            lines.append(f"| {state} | {cell.after or state} | {what} |")
        parts.append("\n".join(lines))
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
    print(f"{PAGE}: written")
