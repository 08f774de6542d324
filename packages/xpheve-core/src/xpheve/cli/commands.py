"""The group of subcommands: finds them lazily, and turns whatever goes wrong into one line and an exit code."""

from __future__ import annotations

import os
import sys
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any, NoReturn

import click

FINE, FAILED, USAGE, INTERRUPTED = 0, 1, 2, 130

NAMES = ("run", "explain", "warm", "laws", "show", "export", "doctor", "schema", "manifest")


class Commands(click.Group):
    """Subcommands by name, each the ``command`` of the module of its name."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order of the help."""
        return list(NAMES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the one that is called."""
        if cmd_name not in NAMES:
            return None
        found: click.Command = import_module(f"xpheve.cli.{cmd_name}").command
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Say what an unknown name was probably meant to be."""
        if args and args[0] not in NAMES and not args[0].startswith("-"):
            from xpheve.plugins.suggest import did_you_mean

            hint = did_you_mean(args[0], NAMES)
            ctx.fail(f"no command {args[0]!r}.{hint} Commands: {', '.join(NAMES)}")
        return super().resolve_command(ctx, args)

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        windows_expand_args: bool = True,
        **extra: Any,
    ) -> NoReturn:
        """Run, and exit with the code that says how it went."""
        given = list(sys.argv[1:] if args is None else args)
        end = given.index("--") if "--" in given else len(given)
        shows_trace = "--traceback" in given[:end] or os.environ.get("XPHEVE_TRACEBACK", "") not in ("", "0")
        given = [arg for arg in given[:end] if arg != "--traceback"] + given[end:]
        for stream in (sys.stdout, sys.stderr):
            with suppress(AttributeError, ValueError, OSError):  # a name may hold what the terminal cannot show
                stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
        sys.exit(self._code(given, prog_name or "xpheve", complete_var, shows_trace, extra))

    def _code(
        self, args: list[str], prog_name: str, complete_var: str | None, shows_trace: bool, extra: dict[str, Any]
    ) -> int:
        from xpheve.errors import XpheveError

        try:
            with _plain_warnings():
                code = super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
            sys.stdout.flush()
        except click.Abort:
            _say("interrupted")
            return INTERRUPTED
        except click.exceptions.Exit as wrong:
            return wrong.exit_code
        except click.ClickException as wrong:
            wrong.show()
            return wrong.exit_code
        except BrokenPipeError:  # who read us has seen enough
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return FAILED
        except (XpheveError, OSError) as wrong:
            if shows_trace:
                traceback.print_exc()
            _say(f"error: {wrong}")
            return FAILED
        except Exception as wrong:
            if shows_trace:
                traceback.print_exc()
            text = " ".join(f"{type(wrong).__name__}: {wrong}".split())
            way = "" if shows_trace else " To see where, say --traceback, or set XPHEVE_TRACEBACK=1"
            _say(f"error: this should not happen: {text}.{way}")
            return FAILED
        return code if isinstance(code, int) else FINE


def _say(text: str) -> None:
    click.echo(text, err=True)


@contextmanager
def _plain_warnings() -> Iterator[None]:
    """Show warnings of xPheve as one line on stderr."""
    from xpheve.errors import XpheveWarning

    before = warnings.showwarning

    def show(message: Any, category: Any, *rest: Any, **more: Any) -> None:
        if issubclass(category, XpheveWarning):
            _say(f"warning: {message}")
        else:
            before(message, category, *rest, **more)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


def _show_version(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    if value:
        from xpheve import __version__

        click.echo(f"xpheve {__version__}")
        ctx.exit()


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 fine; 1 the scene or run failed, or something installed is broken; 2 wrong usage; 130 "
    "interrupted. With --traceback, or XPHEVE_TRACEBACK=1, errors show where they came from.",
)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version and exit.",
)
def commands() -> None:
    """Run scenes of the physics engine xPheve, explain them, and look at what is installed."""
