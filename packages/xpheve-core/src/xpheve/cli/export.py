"""``xpheve export``: make tables, plots and moving pictures of a record."""

from __future__ import annotations

from pathlib import Path

import click

SUFFIXES = {"csv": ".csv", "parquet": ".parquet", "plot": ".png", "html": ".html", "gif": ".gif", "glb": ".glb"}


@click.command("export", short_help="Make tables, plots and animations of a record.")
@click.argument("record", type=click.Path(path_type=Path))
@click.argument("out", type=click.Path(path_type=Path))
@click.option("--to", "form", type=click.Choice(list(SUFFIXES)), help="By default as the ending of OUT says.")
@click.option("--frames", type=click.IntRange(min=1), default=120, show_default=True, help="Pictures of an animation.")
def command(record: Path, out: Path, form: str | None, frames: int) -> None:
    """Write RECORD (an .arrow file, or a run's folder) to OUT, as a table, a plot, an animation, or animated glTF."""
    suffix = out.suffix.lower()
    if form is None:
        form = next((name for name, end in SUFFIXES.items() if end == suffix), None)
        if form is None:
            raise click.UsageError(f"{out}: its ending says nothing; give --to {'|'.join(SUFFIXES)}")
    elif form not in ("csv", "parquet") and suffix != SUFFIXES[form]:
        raise click.UsageError(f"{out}: with --to {form}, its name ends in {SUFFIXES[form]}")

    from xpheve.record import Record

    found = Record.open(record / "record.arrow" if record.is_dir() else record)
    if found.torn:
        click.echo(f"warning: {found.path} is torn; exporting the {len(found)} frames that are whole", err=True)
    if form == "csv":
        found.to_csv(out)
    elif form == "parquet":
        found.to_parquet(out)
    elif form == "plot":
        found.plot(out)
    elif form == "glb":
        found.export_glb(out)
    else:
        found.animate(out, frames=frames)
    click.echo(f"{out}: {len(found)} frames")
