"""The table of verbs, and how the words of a command line reach one of them."""

from __future__ import annotations

import os
from collections.abc import Iterable
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from rtec import __version__
from rtec.cli._help import help_of, markup_mode
from rtec.cli._parameters import Verb
from rtec.errors import RtecError, nearest

VERBS = tuple(
    "run compare diagnose add train export effects simulate tables check envelope safety iso230 box pc replay"
    " blind firmware docs".split()
)
"""In the order in which help lists them; each in the module of its name."""
_GROUPS = ("blind", "firmware")
"""Verbs that have verbs of their own."""


class Verbs(TyperGroup):
    """A group of commands that names the nearest one where a word is unknown."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command that the first word names.

        Raises
        ------
        RtecError
            A word that is no verb.
        """
        if args and args[0] not in self.commands:
            raise RtecError(f"no command {args[0][:60]!r}; {nearest(args[0][:60], self.commands)}")
        return super().resolve_command(ctx, args)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"rtec {__version__}")
        raise typer.Exit


def _frame(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and exit.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Emulate a real-time error corrector: counts inserted between an encoder and a machine-tool controller.

    Every command has --help with three examples, and --json for one JSON document on stdout.

    Exit codes: 0 done, 1 done and the answer is "fails", 2 a bad argument or file.

    Example: rtec simulate --design c --frequency 500kHz --cycles 100000 --corrections 4000
    Example: rtec diagnose z_axis.csv -o report --save found.toml
    Example: rtec run --repeatability 0um -o before-after
    """


def application(verbs: Iterable[str] = VERBS) -> typer.Typer:
    """Return the command line with some of its verbs, all by default, in the order in which help lists them."""
    app = _empty()
    for name in verbs:
        module = _module_of(name)
        if name in _GROUPS:
            app.add_typer(module.application(Verbs), name=name)
        else:
            verb = getattr(module, name)
            app.command(name, cls=Verb, help=help_of(verb))(verb)
    return app


def _listing() -> typer.Typer:
    """Return the command line whose verbs have a help and no parameters: these take longer than all else to make."""
    app = _empty()
    for name in VERBS:
        verb = getattr(_module_of(name), "frame" if name in _GROUPS else name)
        app.command(name, help=help_of(verb))(lambda: None)
    return app


def _empty() -> typer.Typer:
    app = typer.Typer(cls=Verbs, name="rtec", rich_markup_mode=markup_mode(), pretty_exceptions_enable=False)
    app.callback(help=help_of(_frame))(_frame)
    return app


def _module_of(verb: str) -> Any:
    # when it is called for, so that Ctrl-C while it loads meets the handler
    return import_module(f"rtec.cli.{verb}")


def call(words: list[str]) -> None:
    """Carry out the command that ``words`` say; what goes wrong is raised.

    ``main`` of the group would end the process itself for some errors, so it serves the shell's completion only.
    """
    if "_RTEC_COMPLETE" in os.environ:
        typer.main.get_command(application()).main(prog_name="rtec")
        return
    verb = next((word for word in words if not word.startswith("-")), None)  # no option before it takes a value
    group = typer.main.get_command(application([verb]) if verb in VERBS else _listing())
    with group.make_context("rtec", words or ["--help"]) as context:
        group.invoke(context)
