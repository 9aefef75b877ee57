"""The option ``--algorithm`` of verbs in whose boxes an algorithm of one's own may work."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli._groups import OptionGroup
from rtec.cli._parameters import apart, named, needs, option, whole
from rtec.cli._verb import said
from rtec.cli._words import files_ending
from rtec.errors import ArgumentError

if TYPE_CHECKING:
    from rtec.board import Microcontroller
    from rtec.injector import Design
    from rtec.machine.station_settings import InBox

    States = tuple[int, ...]
    """Angle states 0 to 3."""


def algorithm(text: str, **more: Any) -> Any:
    """Return the option ``--algorithm``."""
    return option("--algorithm", "ALGORITHM", text, complete=files_ending(".py", ".ihx", ".hex"), **more)


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnOptions(OptionGroup):
    """An algorithm of one's own in the boxes; None where nothing was said."""

    PANEL = "An algorithm of your own"

    algorithm: str | None = algorithm("file.py:Name or image.ihx in the boxes, in the place of a design.")
    step_counts: int | None = whole("--step", "Counts of one step, in the place of --design.", low=1)
    states: States | None = named(
        "--states",
        "rtec.verify.contract.contract:states_of",
        "00|all",
        "Levels of A and B in which it inserts at rest; all.",
    )

    def load(self, context: typer.Context, designs: list[Design]) -> tuple[InBox, Design] | None:
        """Return the algorithm and the design whose step and states it has; None where nothing was said.

        Raises
        ------
        RtecError
            A file that cannot be used, no design or several, or a step that no design has.
        """
        if self.algorithm is None:
            if words := said(context, "step_counts", "states"):
                raise needs(words[0], "--algorithm")
            return None
        if designs and (self.step_counts is not None or self.states is not None):
            raise apart("--step" if self.step_counts is not None else "--states", "--design")
        if self.step_counts is not None:
            from rtec.verify.contract.contract import design_with

            designs = [design_with(self.step_counts, self.states or (0, 1, 2, 3))]
        if len(designs) != 1:
            allowed = "--design original|a|b|c once, or --step N and --states 00"
            raise ArgumentError("--algorithm", self.algorithm, allowed, problem="needs the step that it has")
        return load(self.algorithm), designs[0]


def load(word: str) -> InBox:
    """Return an algorithm for the boxes of a machine.

    Raises
    ------
    RtecError
        No file, no class of that name in it, or another form.
    """
    from rtec.injector import Design

    file, _, name = word.rpartition(":")
    if file.lower().endswith(".py") and name:
        from rtec.verify.contract.in_box import PythonInBox

        return PythonInBox(Path(file), name)
    if word.lower().endswith((".ihx", ".hex")):
        return _with_program(Path(word))
    if word.lower() in (known.value for known in Design):
        raise apart(f"--algorithm {word}", "--design", "a design of rtec needs no --algorithm")
    problem = "does not say which class" if word.lower().endswith(".py") else "cannot work in these boxes"
    raise ArgumentError("--algorithm", repr(word[:80]), "file.py:Name or image.ihx", problem=problem)


def _with_program(image: Path) -> Microcontroller:
    """Return the report's processor with this program."""
    from firmware_model import read_hex
    from rtec.board import Microcontroller
    from rtec.cli._image import as_bad_input

    with as_bad_input():
        read_hex(image)
    return replace(Microcontroller.named("8051-12mhz"), program=image)
