"""``xpheve warm``: compile ahead."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from xpheve.cli.options import compile_option, json_option, outside_option, without_option


@click.command("warm", short_help="Compile ahead, so that later runs start from the cache.")
@click.argument("scenes", type=click.Path(path_type=Path), nargs=-1, metavar="[SCENE]...")
@compile_option
@json_option
@without_option
@outside_option
def command(
    scenes: tuple[Path, ...], compile_: str | None, as_json: bool, without: tuple[str, ...], allow_outside: bool
) -> int:
    """Compile the loops that each SCENE needs as it stands at time 0; nothing is run.

    Compiled code is kept in the user's cache folder, and later runs load it from there. Loops that come about later, by laws that are
    switched or objects that are added on the way, are compiled then.

    Without SCENE: the loop of each installed law that acts along the way, alone. It serves all scenes in which this law and any whose forces
    are stored, such as planet gravity, act on more objects than are worth interpreting.
    """
    from xpheve import PhysicsEngine
    from xpheve.cli.output import compiling, print_json
    from xpheve.plan.warm import warm, warm_laws
    from xpheve.plugins import Registry
    from xpheve.scene import read

    found: list[dict[str, Any]] = []
    with compiling(shown=not as_json):
        if not scenes:
            found = [{"scene": None, **one._asdict()} for one in warm_laws(PhysicsEngine, Registry.default())]
        for scene in scenes:
            file = read(scene, allow_outside=allow_outside)
            engine = file.build(without=without, compile=compile_)
            found += [{"scene": str(scene), **one._asdict()} for one in warm(engine, file.run.dt)]
    if as_json:
        print_json(found)
    else:
        _print(found)
    return 0


def _print(found: list[dict[str, Any]]) -> None:
    from xpheve.cli.output import plural, print_table
    from xpheve.plan.explain_loops import ORIGINS

    if found:
        rows = [
            [one["what"], one["because"] or ORIGINS[one["origin"]], f"{one['seconds']:.3g}" if one["seconds"] else ""]
            for one in found
        ]
        print_table(["loop", "code", "s"], rows)
    ready = sum(one["origin"] != "none" for one in found)
    click.echo(f"{plural(ready, 'loop')} ready, {sum(one['seconds'] for one in found):.3g} s")
