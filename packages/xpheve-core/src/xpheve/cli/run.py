"""``xpheve run``: run a scene."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from xpheve.cli.options import Quantity, compile_option, json_option, outside_option, until_option, without_option

if TYPE_CHECKING:
    from xpheve.engine import PhysicsEngine

FRAMES = 500  # of a record whose scene does not say: enough for a plot, and for ten seconds of animation
SHOWN = 20  # objects in the table that is printed


@click.command("run", short_help="Run a scene.")
@click.argument("scene", type=click.Path(path_type=Path))
@until_option
@click.option(
    "--dt", type=Quantity("s"), metavar="S", help="Host steps of this length [s]; without it, to a tolerance."
)
@click.option("--every", type=Quantity("s"), metavar="S", help="A frame of the record each S [s].")
@click.option("--rtol", type=Quantity("1"), help="Relative tolerance where motion is not exact.")
@click.option("--atol", type=Quantity("1"), help="Absolute tolerance where motion is not exact.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="A folder for record.arrow, explain.txt and summary.json; or the file of the record, if it ends in .arrow.",
)
@compile_option
@json_option
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@without_option
@outside_option
def command(
    scene: Path,
    until: float | None,
    dt: float | None,
    every: float | None,
    rtol: float | None,
    atol: float | None,
    out: Path | None,
    compile_: str | None,
    as_json: bool,
    quiet: bool,
    without: tuple[str, ...],
    allow_outside: bool,
) -> int:
    """Run SCENE, a TOML or JSON file, and tell how it ended.

    Options go before what the scene says in its [run]. A record can be read at any moment, also after Ctrl-C.
    """
    from xpheve.cli.output import print_json, progress
    from xpheve.scene import read

    begun = time.perf_counter()
    file = read(scene, allow_outside=allow_outside)
    given = file.run
    until = until if until is not None else given.until
    if until is None:
        raise click.UsageError(f"how long? Give --until, or write until = ... under [run] in {scene}")
    dt = dt if dt is not None else given.dt if rtol is None and atol is None else None
    if dt is None:
        rtol = rtol if rtol is not None else given.rtol
        atol = atol if atol is not None else given.atol
    every = every if every is not None else given.every
    engine = file.build(without=without, compile=compile_)
    folder, record_path = _places(out, file.record)
    if record_path is not None and every is None:
        every = until / FRAMES if until > 0 else 1.0
    stamp = None if record_path is None else _stamp(record_path)
    loaded = time.perf_counter()

    failure: BaseException | None = None
    record: Any = None
    try:
        with progress(engine, until, shown=not quiet and not as_json):
            record = engine.run(until, dt=dt, rtol=rtol, atol=atol, every=every, record=record_path)
    except (KeyboardInterrupt, Exception) as wrong:  # told when what there is has been kept
        failure = wrong
    ran = time.perf_counter()
    if record is None and record_path is not None and _stamp(record_path) != stamp:
        record = _reopened(record_path)

    seconds = {"load": round(loaded - begun, 6), "run": round(ran - loaded, 6)}
    summary = summarise(engine, record, scene, until, seconds, failure)
    if folder is not None:
        _keep(folder, engine, summary)
    if failure is not None:
        if as_json:
            print_json(summary)
        return _told(failure, engine, record)
    if as_json:
        print_json(summary)
    elif not quiet:
        _print(engine, summary)
    return 0


def _places(out: Path | None, from_scene: Path | None) -> tuple[Path | None, Path | None]:
    """Return the folder to fill, if any, and the file of the record, if any; their folders are made."""
    if out is None:
        return None, from_scene
    if out.suffix == ".arrow":
        if out.is_dir():
            raise click.UsageError(
                f"--out {out}: this is a folder; give a file, or a folder whose name does not end in .arrow"
            )
        out.parent.mkdir(parents=True, exist_ok=True)
        return None, out
    if out.exists() and not out.is_dir():
        raise click.UsageError(f"--out {out}: this is a file; give a folder, or a record that ends in .arrow")
    out.mkdir(parents=True, exist_ok=True)
    return out, out / "record.arrow"


def _stamp(path: Path) -> tuple[int, int] | None:
    """Return what tells a file from the one that was there before."""
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_ino, stat.st_mtime_ns


def _reopened(path: Path) -> Any:
    """Return the record that a run left that did not end well; None if it cannot be read."""
    from xpheve.errors import RecordError
    from xpheve.record import Record

    try:
        return Record.open(path)
    except RecordError:
        return None


def summarise(
    engine: PhysicsEngine,
    record: Any,
    scene: Path,
    until: float,
    seconds: dict[str, float],
    failure: BaseException | None,
) -> dict[str, Any]:
    """Return what summary.json and ``--json`` say: times, conserved quantities, final state."""
    from xpheve import __version__
    from xpheve.objects import FIELDS
    from xpheve.plan.explain import drift as drift_of

    energy = engine.energy()
    drift = record.energy_drift if record is not None and len(record) else drift_of(engine)
    error = None
    if failure is not None:
        error = "interrupted" if isinstance(failure, KeyboardInterrupt) else f"{type(failure).__name__}: {failure}"
    return {
        "xpheve": __version__,
        "scene": str(scene),
        "time": engine.time,
        "until": until,
        "error": error,
        "seconds": seconds,
        "energy": {"kinetic": energy.kinetic, "potential": energy.potential, "work": energy.work},
        "energy_drift": drift,
        "momentum": engine.momentum(),
        "angular_momentum": engine.angular_momentum(),
        "record": None if record is None or record.path is None else str(record.path),
        "frames": 0 if record is None else len(record),
        "objects": [
            {
                "name": obj.name,
                "serial": obj.serial,
                "fixed": obj.fixed,
                **{name: getattr(obj, name) for name in FIELDS},
            }
            for obj in sorted(engine.objects, key=lambda obj: obj.serial)
        ],
    }


def _keep(folder: Path, engine: PhysicsEngine, summary: dict[str, Any]) -> None:
    import json

    from xpheve.cli.output import finite

    (folder / "explain.txt").write_text(f"{engine.explain()}\n", encoding="utf-8")
    (folder / "summary.json").write_text(json.dumps(finite(summary), indent=1) + "\n", encoding="utf-8")


def _told(failure: BaseException, engine: PhysicsEngine, record: Any) -> int:
    """Say what stopped the run and what is left of it."""
    left = "" if record is None or record.path is None else f"; {record.path} holds the {len(record)} frames until then"
    if isinstance(failure, KeyboardInterrupt):
        click.echo(f"interrupted at t = {engine.time:.6g} s{left}", err=True)
        return 130
    if left:
        click.echo(f"stopped at t = {engine.time:.6g} s{left}", err=True)
    raise failure


def _print(engine: PhysicsEngine, summary: dict[str, Any]) -> None:
    from xpheve.cli.output import plural, print_table, vector

    count = len(summary["objects"])
    click.echo(
        f"{summary['scene']}: t = {summary['time']:.6g} s, {plural(count, 'object')}, {summary['seconds']['run']:.3g} s"
    )
    energy, drift = summary["energy"], summary["energy_drift"]
    told = "not known" if drift is None or drift != drift else f"{drift:.2g}"
    click.echo(
        f"energy: kinetic {energy['kinetic']:.6g} J, potential {energy['potential']:.6g} J, "
        f"work {energy['work']:.6g} J; drift {told}"
    )
    spin = vector(summary["angular_momentum"])
    click.echo(f"momentum {vector(summary['momentum'])} kg m/s, angular momentum {spin} kg m^2/s")
    if summary["record"]:
        click.echo(f"record: {summary['record']}, {plural(summary['frames'], 'frame')}")
    moving = [row for row in summary["objects"] if not row["fixed"]]
    if moving:
        click.echo()
        rows = [
            [row["name"] or f"#{row['serial']}", vector(row["position"]), vector(row["velocity"])]
            for row in moving[:SHOWN]
        ]
        print_table(["object", "position [m]", "velocity [m/s]"], rows)
    if len(moving) > SHOWN:
        click.echo(f"... and {len(moving) - SHOWN} more; --json, or --out, tells of all")
