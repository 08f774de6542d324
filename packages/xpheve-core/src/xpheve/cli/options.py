"""Options that several subcommands share."""

from __future__ import annotations

from typing import Any

import click


class Quantity(click.ParamType[float]):
    """A number, or a text with a unit, such as ``2 h``."""

    name = "number"

    def __init__(self, unit: str, *, above: bool = True) -> None:
        self.unit = unit
        self.above = above
        """Whether 0 is too little."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number of ``unit``; what is none is wrong usage."""
        from xpheve.errors import UnitError
        from xpheve.units import parse_quantity

        if isinstance(value, float):
            return value
        try:
            number = parse_quantity(str(value), self.unit)
        except UnitError as wrong:
            self.fail(str(wrong), param, ctx)
        if number < 0 or (self.above and number == 0):
            self.fail(f'"{value}": a number {"above" if self.above else "from"} 0 is needed', param, ctx)
        return number


json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON document and nothing else.")
outside_option = click.option("--allow-outside", is_flag=True, help="Let the scene name paths outside its folder.")
without_option = click.option(
    "--no-law", "without", multiple=True, metavar="ID", help="Leave out a law, by id or name; may be given again."
)
compile_option = click.option(
    "--compile",
    "compile_",
    type=click.Choice(["auto", "always", "never"]),
    help="Compile loops over many objects (auto), all, or none; before what the scene says.",
)
until_option = click.option("--until", type=Quantity("s", above=False), metavar="T", help="Time to run to [s].")
