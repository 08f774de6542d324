"""``xpheve schema``: the JSON schema of scene files."""

from __future__ import annotations

from pathlib import Path

import click


@click.command("schema", short_help="Print the JSON schema of scene files.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE", help="Write it there instead.")
def command(out: Path | None) -> None:
    """Print the JSON schema of scene files, with the parameters of all installed laws."""
    import json

    from xpheve.scene import schema

    text = json.dumps(schema(), indent=1)
    if out is None:
        click.echo(text)
    else:
        out.write_text(text + "\n", encoding="utf-8")
        click.echo(f"{out}: written")
