"""What is printed: JSON for programs, tables for people; rich is imported for terminals only."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import click

TICK = 0.1  # [s] between two looks at the time for a progress bar


def print_json(value: Any) -> None:
    """Print ``value`` as one JSON document; NaN and infinity, which JSON does not have, become null."""
    import json

    click.echo(json.dumps(finite(value), indent=1, allow_nan=False))


def finite(value: Any) -> Any:
    """Return ``value`` with lists for tuples, and None for numbers that are not finite."""
    if isinstance(value, dict):
        return {str(key): finite(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def printable(text: str) -> str:
    """Return ``text`` with what could steer a terminal written out; names come from files of other people."""
    return "".join(char if char.isprintable() else repr(char)[1:-1] for char in text)


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print ``rows`` under ``head``: drawn on a terminal, aligned by spaces elsewhere."""
    rows = [[printable(cell) for cell in row] for row in rows]
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.table import Table
        from rich.text import Text

        table = Table(box=None, header_style="bold", pad_edge=False)
        for word in head:
            table.add_column(Text(word))
        for row in rows:
            table.add_row(*(Text(cell) for cell in row))
        Console().print(table)
        return
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]
    for row in [head, *rows]:
        click.echo("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())


def plural(count: int, word: str) -> str:
    """Return ``count`` and ``word`` in its number."""
    return f"{count} {word}{'' if count == 1 else 's'}"


def vector(values: Sequence[float]) -> str:
    """Return ``values`` with six digits."""
    return "(" + ", ".join(f"{value:.6g}" for value in values) + ")"


@contextmanager
def progress(engine: Any, until: float, *, shown: bool) -> Iterator[None]:
    """Show how far ``engine`` has come to ``until``, if ``shown`` and stderr is a terminal; only looks at its time."""
    if not shown or not sys.stderr.isatty():
        yield
        return
    import threading

    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    done = threading.Event()
    with Progress(
        TextColumn("t = {task.completed:.6g} s of {task.total:.6g} s"),
        BarColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    ) as bar:
        task = bar.add_task("", total=until)
        watched = _on_compile(lambda what: bar.console.print(f"compiling {what} ...", markup=False, highlight=False))

        def watch() -> None:
            while not done.wait(TICK):
                bar.update(task, completed=engine.time)

        watcher = threading.Thread(target=watch, daemon=True)
        watcher.start()
        try:
            yield
        finally:
            done.set()
            watcher.join()
            watched()


@contextmanager
def compiling(*, shown: bool) -> Iterator[None]:
    """Show what is being compiled, if ``shown`` and stderr is a terminal."""
    if not shown or not sys.stderr.isatty():
        yield
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status("planning ...") as status:
        watched = _on_compile(lambda what: status.update(Text(f"compiling {what} ...")))
        try:
            yield
        finally:
            watched()


def _on_compile(show: Callable[[str], object]) -> Callable[[], None]:
    """Call ``show`` with what is compiled whenever that begins; returns what ends it."""
    from xpheve.compile import on_compile

    return on_compile(lambda what, seconds: show(printable(what)) if seconds is None else None)
