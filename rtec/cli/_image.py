"""Images of firmware as verbs take them: the file, what the firmware model refuses of it, the part that runs it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal, cast

import typer

from rtec.cli._words import files_ending
from rtec.errors import RtecError

if TYPE_CHECKING:
    from rtec.board import Microcontroller

HEX = typer.Argument(
    ...,
    metavar="IMAGE.hex",
    help="Machine code as Intel HEX.",
    show_default=False,
    autocompletion=files_ending(".hex", ".ihx"),
)


@contextmanager
def as_bad_input() -> Iterator[None]:
    """Say what the firmware model refuses as rtec says it."""
    from firmware_model import FirmwareError

    try:
        yield
    except FirmwareError as error:
        raise RtecError(str(error)) from error


def with_part(chip: Microcontroller, part: str | None) -> Microcontroller:
    """Return a processor with the memory of a part; without one the smaller on a 12-clock processor."""
    known = "8051" if chip.timing == "12-clock" else "8052"
    return dataclasses.replace(chip, part=cast("Literal['8051', '8052']", part or known))
