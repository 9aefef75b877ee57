"""A G-code file as a program of the axis: what `parse_program` understands, in millimetres."""

from __future__ import annotations

from pathlib import Path

from rtec import axis
from rtec.errors import ArgumentError, FileFormatError
from rtec.io import read_text
from rtec.metrology.measuring_program import Dwell, Move, Stop, parse_program

STOP_S = 1.0
"""After so long the operator continues at a stop."""


def read_program(path: str | Path) -> axis.Program:
    """Read a G-code file; the axis starts at machine zero. It is as `measuring_program` writes it.

    Raises
    ------
    FileFormatError
        With the line: what `parse_program` refuses, a position or a feed out of range; a program that stays where it
        is.

    Examples
    --------
    >>> read_program("part.nc")
    Traceback (most recent call last):
        ...
    rtec.errors.FileFormatError: part.nc: there is no such file; use the path of a text file
    """
    source = str(path)
    blocks: list[axis.Block] = []
    for block in parse_program(read_text(path).splitlines(), source=source):
        try:
            if isinstance(block, Move):
                blocks.append(axis.Move(target_mm=block.position_mm, feed_mm_s=block.feed_mm_s))
            elif isinstance(block, Dwell):
                blocks.append(axis.Dwell(seconds=block.duration_s))
            elif isinstance(block, Stop):
                blocks.append(axis.Dwell(seconds=STOP_S))
        except ArgumentError as error:
            raise FileFormatError(source, block.line, f"{error.name} {error.value}", error.allowed) from error
    if not any(isinstance(block, axis.Move) and block.target_mm != 0.0 for block in blocks):
        raise FileFormatError(source, None, "the axis stays at 0", "a move to somewhere else, such as G53Z1.0F50.")
    return axis.Program(blocks=tuple(blocks))
