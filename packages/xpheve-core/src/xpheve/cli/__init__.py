"""The command ``xpheve``, one subcommand a file; each importing what it needs when it is called.

Exit codes: 0 fine; 1 the scene or run failed, or something installed is broken; 2 wrong usage; 130 interrupted.
"""

from __future__ import annotations


def main() -> None:
    """Run the command line of this process and exit."""
    from xpheve.cli.commands import commands

    commands.main(prog_name="xpheve")
