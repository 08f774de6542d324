"""``xpheve doctor``: what is installed, and what is the matter with it."""

from __future__ import annotations

from typing import Any

import click

from xpheve.cli.options import json_option

LIBRARIES = ("numpy", "pluggy", "pydantic", "click", "rich", "pyarrow", "matplotlib", "pillow")
SICK = ("broken", "duplicate", "incompatible")


@click.command("doctor", short_help="Say what is installed, and what is broken.")
@json_option
def command(as_json: bool) -> int:
    """Import every pack and say which work; exits with 1 if something installed is broken."""
    found = examine()
    if as_json:
        from xpheve.cli.output import print_json

        print_json(found)
    else:
        _print(found)
    return 0 if found["healthy"] else 1


def examine() -> dict[str, Any]:
    """Return versions, packs, what is broken and why, and where the index is kept."""
    import os
    import platform
    import sys

    from xpheve import __version__
    from xpheve.plugins import Registry
    from xpheve.plugins.index import cache_folder

    registry = Registry.default()
    broken = registry.try_all()
    packs = registry.packs()
    laws = registry.laws()
    folder = cache_folder()
    return {
        "xpheve": __version__,
        "python": platform.python_version(),
        "executable": sys.executable,
        "platform": platform.platform(),
        "libraries": {name: _version(name) for name in LIBRARIES},
        "packs": [
            {
                "name": info.name,
                "distribution": info.distribution,
                "version": info.version,
                "status": info.status,
                "laws": sum(law.pack == info.name for law in laws) if info.status == "loaded" else 0,
                "load_seconds": round(info.load_seconds, 6),
                "location": info.location,
                "reason": info.reason,
                "hint": info.hint,
            }
            for info in packs
        ],
        "broken": [
            {
                "pack": one.pack,
                "distribution": one.distribution,
                "version": one.version,
                "phase": one.phase,
                "exception": one.exception,
                "hint": one.hint,
            }
            for one in broken
        ],
        "remarks": registry.remarks(),
        "index_cache": {"folder": folder, "writable": _is_writable(folder), "exists": os.path.isdir(folder)},
        "healthy": not broken and not any(info.status in SICK for info in packs),
    }


def _version(name: str) -> str | None:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _is_writable(folder: str) -> bool:
    """Whether ``folder``, or the nearest one above that exists, can be written to."""
    import os

    while not os.path.isdir(folder) and os.path.dirname(folder) != folder:
        folder = os.path.dirname(folder)
    return os.access(folder, os.W_OK)


def _print(found: dict[str, Any]) -> None:
    from xpheve.cli.output import print_table

    click.echo(f"xpheve {found['xpheve']}, Python {found['python']} ({found['executable']}), {found['platform']}")
    click.echo(", ".join(f"{name} {version or 'not installed'}" for name, version in found["libraries"].items()))
    cache = found["index_cache"]
    told = "" if cache["writable"] else " (cannot be written: packs are searched for each time)"
    click.echo(f"index cache: {cache['folder']}{told}")
    click.echo()
    if found["packs"]:
        print_table(
            ["pack", "of", "status", "laws", "import"],
            [
                [p["name"], f"{p['distribution']} {p['version']}".strip(), p["status"], str(p["laws"]),
                 f"{p['load_seconds'] * 1e3:.0f} ms" if p["status"] == "loaded" else ""]
                for p in found["packs"]
            ],
        )  # fmt: skip
    else:
        click.echo("no packs are installed; pip install xpheve-laws-basic xpheve-laws-collision")
    for one in found["broken"]:
        called = " ".join(part for part in (one["distribution"], one["version"]) if part) or one["pack"]
        click.echo(f"\nbroken: {called}: {one['phase']}: {one['exception']}\n  {one['hint']}")
    for pack in found["packs"]:
        if pack["reason"] and not any(one["pack"] == pack["name"] for one in found["broken"]):
            hint = f" {pack['hint']}" if pack["hint"] else ""
            click.echo(f"\n{pack['status']}: {pack['name']}: {pack['reason']}.{hint}")
    for remark in found["remarks"]:
        click.echo(f"\nremark: {remark}")
    click.echo("\nall is well" if found["healthy"] else "\nsomething is broken")
