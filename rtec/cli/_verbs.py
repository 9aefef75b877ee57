"""The table of verbs, and how the words of a command line reach one of them."""

from __future__ import annotations

import os
from collections.abc import Iterable
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

from rtec import __version__
from rtec.cli._groups import verbs_under
from rtec.cli._verb import read_quickly
from rtec.errors import RtecError, nearest

VERBS = {
    "run": "Calibrate an axis, find what is wrong with it, correct it with each insertion design, and report it all.",
    "compare": "Compare a measurement with a model: what is left, against the noise floor, and where it lives.",
    "diagnose": "Find which physical effects a measurement shows that the model lacks, one by one, down to the "
    "noise floor.",
    "add": "Add an effect to a model, refit it to a measurement, write it, and show how far the error falls.",
    "train": "Fit tables, physical effects and networks to one measurement, and compare them by readings that"
    " none has seen.",
    "export": "Write what a model or a trained predictor says of position and direction, for another program.",
    "effects": "List the physical effects that are known, show the card of one, or check those that you wrote.",
    "simulate": "Send an encoder's edges through the box into the controller, compare the counts, and draw an "
    "insertion.",
    "contour": "Plan the feed of a toolpath, run it on two emulated drives, and show following and contour error.",
    "ballbar": "Judge a circle test after ISO 230-4, and name the errors of the machine that it shows.",
    "tables": "Show what each design does to A and B, from every state and for both signs.",
    "check": "Hold any insertion algorithm to the contract of a corrector, and hunt for the stream that breaks it.",
    "envelope": "Find the largest safe encoder frequency of each design on each processor, and what breaks first.",
    "safety": "Inject every fault in every phase of operation, and compare what the controller counts in the end.",
    "campaign": "Carry out a plan of many jobs, resume it where it was left, and say what was tried and what failed.",
    "iso230": "Judge positioning tests: figures of ISO 230-2 and VDI/DGQ 3441, their uncertainty, what speaks "
    "against them.",
    "box": "Run axes with their boxes on a live bus, for any PC software to talk to.",
    "pc": "Correct axes on a live bus by what a predictor says, and hold the machine where it must be held.",
    "replay": "Play a bus log into a live node, at the log's own times, and compare its answers with those of "
    "the log.",
    "blind": "Hide physical effects in an emulated axis, and find out whether they are named.",
    "firmware": "Run, read, build and check firmware: machine code of the MCS-51 in Intel HEX, alone or in the box.",
    "docs": "List the pages of the documentation, or show one of them or a part of it.",
}
"""What each verb does, in the order in which help lists them; each stands in the module of its name."""
_GROUPS = ("blind", "firmware")
"""Verbs that have verbs of their own."""


class Verbs(TyperGroup):
    """A group of commands that names the nearest one where a word is unknown."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words in front of the verb."""
        read_quickly(self.get_params(ctx), {})
        return super().parse_args(ctx, args)

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
    version: bool = typer.Option(
        False, "--version", help="Show the version and exit.", callback=_print_version, is_eager=True
    ),
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
    return verbs_under(_frame, {name: _verb(name) for name in verbs}, Verbs)


def _verb(name: str) -> Any:
    module: Any = import_module(f"rtec.cli.{name}")  # here, so that Ctrl-C while it loads meets the handler
    return module.application(Verbs) if name in _GROUPS else getattr(module, name)


def _listing() -> typer.Typer:
    """Return the command line whose verbs have a line of help only: to load them takes longer than all else."""
    app = verbs_under(_frame, {}, Verbs)
    for name, does in VERBS.items():
        app.command(name, help=does)(lambda: None)
    return app


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
