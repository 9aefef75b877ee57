"""The table of verbs, and how the words of a command line reach one of them."""

from __future__ import annotations

import os
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from rtec import __version__
from rtec.cli._help import help_of, markup_mode
from rtec.errors import ArgumentError, RtecError, nearest

_UNITS = frozenset("hz hz_s ps s mm mm_s mm_s2 um deg counts steps sigma degc".split())
"""With which the name of a parameter ends."""


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


def application() -> typer.Typer:
    """Return the command line with all its verbs, in the order in which help lists them."""
    # here, so that Ctrl-C while verbs load meets the handler, and no name of the package hides a module
    from rtec.cli import blind, firmware
    from rtec.cli.add import add
    from rtec.cli.box import box
    from rtec.cli.check import check
    from rtec.cli.compare import compare
    from rtec.cli.diagnose import diagnose
    from rtec.cli.effects import effects
    from rtec.cli.envelope import envelope
    from rtec.cli.export import export
    from rtec.cli.iso230 import iso230
    from rtec.cli.pc import pc
    from rtec.cli.replay import replay
    from rtec.cli.run import run
    from rtec.cli.safety import safety
    from rtec.cli.simulate import simulate
    from rtec.cli.tables import tables
    from rtec.cli.train import train

    app = typer.Typer(cls=Verbs, name="rtec", rich_markup_mode=markup_mode(), pretty_exceptions_enable=False)
    app.callback(help=help_of(_frame))(_frame)
    for verb in (
        run, compare, diagnose, add, train, export, effects, simulate, tables, check, envelope, safety, iso230,
        box, pc, replay,
    ):  # fmt: skip
        app.command(verb.__name__, help=help_of(verb))(verb)
    app.add_typer(blind.application(Verbs), name="blind")
    app.add_typer(firmware.application(Verbs), name="firmware")
    return app


def call(words: list[str]) -> None:
    """Carry out the command that ``words`` say; what goes wrong is raised.

    ``main`` of the group would end the process itself for some errors, so it serves the shell's completion only.
    """
    group = typer.main.get_command(application())
    if "_RTEC_COMPLETE" in os.environ:
        group.main(prog_name="rtec")
        return
    try:
        with group.make_context("rtec", words or ["--help"]) as context:
            group.invoke(context)
    except ArgumentError as error:
        name = option_behind(error.name, _verb_of(group, words))
        raise ArgumentError(name, error.value, error.allowed, error.hint) from error


def _verb_of(command: Any, words: list[str]) -> Any:
    """Return the command that words call."""
    for word in words:
        command = getattr(command, "commands", {}).get(word, command)
    return command


def option_behind(name: str, verb: Any) -> str:
    """Return the option of a verb behind the name of a parameter that a face refuses; the name where there is none.

    >>> verb = _verb_of(typer.main.get_command(application()), ["envelope"])
    >>> option_behind("design", verb), option_behind("jitter_ps", verb), option_behind("x.toml: design", verb)
    ('--design', '--jitter', 'x.toml: design')
    """
    options = {option for parameter in verb.params for option in parameter.opts}
    words = name.split("_")
    for length in range(len(words), 0, -1):  # the last words may be a unit
        option = "--" + "-".join(words[:length])
        if option in options and (length == len(words) or "_".join(words[length:]) in _UNITS):
            return option
    return name
