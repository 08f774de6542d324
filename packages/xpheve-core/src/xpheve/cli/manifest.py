"""``xpheve manifest``: the data file by which a pack is known without importing it."""

from __future__ import annotations

from typing import Any

import click


@click.command("manifest", short_help="Print, write or check the manifest of a pack.")
@click.argument("packs", nargs=-1, metavar="PACK...")
@click.option("--write", is_flag=True, help="Write it next to the pack's module.")
@click.option("--check", is_flag=True, help="Exit with 1 if the one that is there is stale.")
def command(packs: tuple[str, ...], write: bool, check: bool) -> int:
    """Print the manifest of PACK (a pack's name, or its module), write it, or check it."""
    if write and check:
        raise click.UsageError("--write and --check: give one of them")
    if not packs:
        from xpheve.plugins import Registry

        names = ", ".join(info.name for info in Registry.default().packs()) or "none"
        raise click.UsageError(f"which PACK? Installed: {names}")

    from xpheve.cli.output import print_json
    from xpheve.plugins.manifest import build_manifest, check_manifest, write_manifest

    code = 0
    for pack in packs:
        module, name = _module(pack)
        if write:
            click.echo(f"{write_manifest(module, name=name)}: written")
        elif check:
            stale = check_manifest(module, name=name)
            click.echo(stale or f"{pack}: its manifest is fresh", err=bool(stale))
            code = max(code, 1 if stale else 0)
        else:
            print_json(build_manifest(module, name))
    return code


def _module(pack: str) -> tuple[Any, str]:
    """Return the module of ``pack``, and the pack's name if it is installed."""
    from importlib import import_module

    from xpheve.errors import PackError
    from xpheve.plugins.index import read_index
    from xpheve.plugins.suggest import did_you_mean

    offers = read_index().offers
    found = next((offer for offer in offers if pack in (offer.name, offer.distribution, offer.module)), None)
    wanted = found.module if found is not None else pack
    try:
        return import_module(wanted.partition(":")[0]), found.name if found is not None else ""
    except Exception as wrong:
        if found is None and isinstance(wrong, (ModuleNotFoundError, ValueError, TypeError)):
            hint = did_you_mean(pack, [offer.name for offer in offers])
            raise PackError(f"{pack!r} is neither a pack that is installed nor a module.{hint}") from None
        raise PackError(f"{wanted} failed while it was imported: {type(wrong).__name__}: {wrong}") from wrong
