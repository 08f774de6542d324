"""``xpheve laws``: list the laws at hand."""

from __future__ import annotations

import click

from xpheve.cli.options import json_option


@click.command("laws", short_help="List the laws at hand.")
@click.option("--role", default="", metavar="ROLE", help="Only laws of this role, such as gravity.")
@json_option
def command(role: str, as_json: bool) -> int:
    """List the laws of the installed packs; none is imported that has a manifest."""
    from xpheve.cli.output import print_json, print_table
    from xpheve.plugins import Registry

    registry = Registry.default()
    everything = registry.laws()
    found = [info for info in everything if not role or info.role == role]
    if as_json:
        print_json(
            [
                {**info.spec.to_dict(), "pack": info.pack, "distribution": info.distribution, "version": info.version}
                for info in found
            ]
        )
    elif found:
        print_table(
            ["law", "role", "kind", "of", "what"],
            [
                [info.id, info.role, info.kind, f"{info.distribution} {info.version}".strip(), info.doc]
                for info in found
            ],
        )
    for broken in registry.broken():
        click.echo(f"warning: {broken.pack or broken.distribution} is broken; see xpheve doctor", err=True)
    if role and not found:
        from xpheve.plugins.suggest import did_you_mean

        roles = sorted({info.role for info in everything})
        click.echo(f"no law has the role {role!r}.{did_you_mean(role, roles)} Roles: {', '.join(roles)}", err=True)
        return 1
    if not found:
        click.echo("no laws are installed; pip install xpheve-laws-basic", err=True)
    return 0
