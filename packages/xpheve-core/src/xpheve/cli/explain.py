"""``xpheve explain``: say who serves what in a scene, and why."""

from __future__ import annotations

from pathlib import Path

import click

from xpheve.cli.options import Quantity, compile_option, json_option, outside_option, until_option, without_option


@click.command("explain", short_help="Say who serves what in a scene, and why.")
@click.argument("scene", type=click.Path(path_type=Path))
@until_option
@click.option(
    "--dt", type=Quantity("s"), metavar="S", help="Host steps of this length [s]; without it, to a tolerance."
)
@compile_option
@json_option
@without_option
@outside_option
def command(
    scene: Path,
    until: float | None,
    dt: float | None,
    compile_: str | None,
    as_json: bool,
    without: tuple[str, ...],
    allow_outside: bool,
) -> None:
    """Explain SCENE: groups and their steppers, laws and what they cost, what was skipped, the error.

    As it stands at time 0, with steps of --dt or of the scene's [run] if there are any; or with --until after a run: counts and drift tell
    more then.
    """
    from xpheve.cli.output import print_json, progress
    from xpheve.scene import read
    from xpheve.steppers.contract import Settings

    file = read(scene, allow_outside=allow_outside)
    engine = file.build(without=without, compile=compile_)
    dt = dt if dt is not None else file.run.dt
    if until is None and dt is not None:
        engine._world.set_out(Settings(dt))
    if until is not None:
        rtol, atol = (file.run.rtol, file.run.atol) if dt is None else (None, None)
        with progress(engine, until, shown=not as_json):
            engine.run(until, dt=dt, rtol=rtol, atol=atol)
    found = engine.explain()
    if as_json:
        print_json(found.data)
    else:
        click.echo(str(found))
