"""``xpheve show``: a law's card, or what is in a file."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from xpheve.cli.options import json_option

if TYPE_CHECKING:
    from xpheve.plugins.spec import ParamSpec

FORMS = {
    "apply": "called in Python with NumPy arrays of all its objects; never compiled",
    "kernel": "a kernel file written by hand; runs in the loop",
}
"""What is said of laws that are no formula."""


@click.command("show", short_help="Show a law's card, or what is in a file.")
@click.argument("what", metavar="ID_OR_FILE")
@json_option
def command(what: str, as_json: bool) -> None:
    """Show a law by its id (formula, parameters, source), a record (.arrow, or a run's folder), or a scene file."""
    from xpheve.cli.output import print_json

    path = Path(what)
    if path.is_dir() or path.suffix in (".arrow", ".toml", ".json") or path.is_file():
        found = _scene(path) if path.suffix in (".toml", ".json") else _record(path)
    else:
        found = _law(what)
    if as_json:
        print_json(found)
    elif "id" in found:
        _print_law(found)
    else:
        _print_file(found)


def _law(id: str) -> dict[str, Any]:
    from xpheve.errors import UnknownLawError
    from xpheve.plugins import Registry

    registry = Registry.default()
    info = next((info for info in registry.laws() if info.id == id), None)
    if info is None:
        if ":" not in id and "/" not in id:
            from xpheve.plugins.suggest import did_you_mean

            ids = [one.id for one in registry.laws()]
            near = [one for one in ids if one.partition(":")[2] == id]
            hint = f' Did you mean "{near[0]}"?' if near else did_you_mean(id, ids)
            raise UnknownLawError(f"{id!r} is neither a law nor a file.{hint} xpheve laws lists the laws")
        registry.law(id)  # says what is the matter
        raise UnknownLawError(f'law "{id}" is in no listing of its pack')
    text = inspect.cleandoc(registry.law(id).__doc__ or "")
    where = {"pack": info.pack, "distribution": info.distribution, "version": info.version}
    return {**info.spec.to_dict(), **where, "text": text, "parameters": [_param(one) for one in info.spec.params]}


def _param(param: ParamSpec) -> dict[str, Any]:
    bounds = [
        f"{sign} {bound:g}"
        for sign, bound in ((">", param.gt), (">=", param.ge), ("<", param.lt), ("<=", param.le))
        if bound is not None
    ]
    return {
        "name": param.name,
        "kind": param.kind,
        "unit": param.unit,
        "default": param.default,
        "bounds": " and ".join(bounds) or (f"one of {', '.join(param.choices)}" if param.choices else ""),
        "doc": param.doc,
    }


def _print_law(found: dict[str, Any]) -> None:
    from xpheve.cli.output import print_table

    click.echo(f"{found['id']}  ({found['role']}, {found['kind']}; {found['distribution']} {found['version']})\n")
    click.echo(found["text"] + "\n")
    if found.get("nature"):
        click.echo(f"{found['form']}: {found['nature']}\n")
    elif found.get("form") in FORMS:
        click.echo(f"{found['form']}: {FORMS[found['form']]}\n")
    if found["parameters"]:
        print_table(
            ["parameter", "default", "unit", "bounds", "what"],
            [[p["name"], _default(p), p["unit"], p["bounds"], p["doc"]] for p in found["parameters"]],
        )
    else:
        click.echo("no parameters")
    if found.get("columns"):
        click.echo()
        print_table(
            ["column of objects", "default", "unit", "what"],
            [[c["name"], str(c.get("default", 0.0)), c.get("unit", "1"), c.get("doc", "")] for c in found["columns"]],
        )
    if found.get("condition"):
        click.echo(f"\nacts at: {found['condition']}")


def _default(param: dict[str, Any]) -> str:
    value = param["default"]
    return "not given" if value is None else str(list(value)) if isinstance(value, tuple) else str(value)


def _record(path: Path) -> dict[str, Any]:
    from xpheve.record import Record

    record = Record.open(path / "record.arrow" if path.is_dir() else path)
    times = record.time
    return {
        "file": str(record.path),
        "what": "record",
        "torn": record.torn,
        "frames": len(record),
        "from": float(times[0]) if len(record) else None,
        "to": float(times[-1]) if len(record) else None,
        "energy_drift": record.energy_drift,
        "metadata": record.metadata,
        "objects": record.objects,
    }


def _scene(path: Path) -> dict[str, Any]:
    from xpheve.scene import read

    table = read(path, allow_outside=True).table
    return {
        "file": str(path),
        "what": "scene",
        "up": table.up,
        "seed": table.seed,
        "periodic": table.periodic and [edge if edge < float("inf") else None for edge in table.periodic],
        "run": table.run.model_dump(exclude_none=True),
        "laws": [{"id": law.id, "name": law.name, "enabled": law.enabled} for law in table.laws],
        "objects": [
            {
                "name": obj.name,
                "shape": obj.shape.model_dump() if obj.shape else None,
                "mass": obj.mass,
                "fixed": obj.fixed,
            }
            for obj in table.objects
        ],
    }


SHOWN = 20  # objects in the table that is printed


def _print_file(found: dict[str, Any]) -> None:
    from xpheve.cli.output import plural, print_table, printable

    if found["what"] == "record":
        torn = (
            "; torn: the run was stopped hard or goes on, and these are the frames that are whole"
            if found["torn"]
            else ""
        )
        span = f", {found['from']:g} to {found['to']:g} s" if found["frames"] else ""
        click.echo(f"{found['file']}: record of {plural(found['frames'], 'frame')}{span}{torn}")
        drift = found["energy_drift"]
        click.echo(f"energy drift {'not known' if drift != drift else format(drift, '.2g')}")
        said = ", ".join(f"{key} {value}" for key, value in found["metadata"].items())
    else:
        click.echo(f"{found['file']}: scene of {plural(len(found['objects']), 'object')}")
        click.echo("laws: " + (", ".join(printable(law["name"] or law["id"]) for law in found["laws"]) or "none"))
        said = ", ".join(
            f"{key} {value}" for key, value in {"up": found["up"], "seed": found["seed"], **found["run"]}.items()
        )
    click.echo(printable(said))
    if not found["objects"]:
        return
    click.echo()
    rows = []
    for k, row in enumerate(found["objects"][:SHOWN]):
        name = row["name"] or f"#{row.get('serial', k + 1)}"
        shape = row["shape"]["kind"] if row["shape"] else "point"
        mass = "" if row["mass"] is None else f"{row['mass']:g}"
        rows.append([name, shape, mass, "fixed" if row["fixed"] else ""])
    print_table(["object", "shape", "mass [kg]", ""], rows)
    if len(found["objects"]) > SHOWN:
        click.echo(f"... and {len(found['objects']) - SHOWN} more; --json tells of all")
