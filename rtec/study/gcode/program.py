"""A program of G-code from file to file, line by line, with one axis corrected."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from rtec.errors import ArgumentError, FileFormatError, OutputError
from rtec.io import WholeFile, unreadable
from rtec.jobs import Report
from rtec.predictors import Predictor
from rtec.study.compensation import Compensation
from rtec.study.gcode.axis import AxisCorrection, ErrorLeft
from rtec.study.gcode.modes import LINEAR, Modes
from rtec.study.gcode.moves import Moves

LONGEST_LINE = 1 << 14
_AT_ONCE = 1 << 13
_HEAD = 1 << 14
"""Characters in which is looked how the program writes comments."""
_BYTES = "latin-1"
"""Every byte is a letter, and leaves as the same byte."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CorrectedProgram:
    """What became of a program; errors in mm, over the ends of its moves and along its feed moves."""

    axis: str
    lines: int
    lines_written: int
    moves: int
    """Of the axis."""
    outside: int
    """Moves that end beyond the range of the model, whose end is held there."""
    points_max_mm: float
    points_rms_mm: float
    between_max_mm: float
    between_rms_mm: float
    before_max_mm: float
    before_rms_mm: float
    notes: tuple[tuple[str, int], ...]
    """What was left as it is, and the line where it stands first."""


def correct_program(
    source: str | Path,
    target: str | Path,
    *,
    table: Compensation,
    predictor: Predictor,
    axis: str = "X",
    head: tuple[str, ...] = (),
    zero_mm: float = 0.0,
    unit_mm: float = 1.0,
    resolution_mm: float = 1e-4,
    within_mm: float = 1e-4,
    progress: Report = lambda share: None,
) -> CorrectedProgram:
    """Write a program so that an axis with the errors of a predictor comes to the places that it states.

    Parameters
    ----------
    source, target
        Files.
    table
        The errors at nodes: moves are split there.
    predictor
        The errors that the result is judged by.
    axis
        Letter of the axis: X, Y, Z, U, V or W.
    head
        Sentences of the comment at the top.
    zero_mm
        Where the program's zero lies on the axis.
    unit_mm
        Of the program, until it says G20 or G21.
    resolution_mm
        Steps of the numbers that are written, at most.
    within_mm
        How far an arc may be from what the correction asks for.
    progress
        Told the share that is done.

    Raises
    ------
    FileFormatError
        A file that cannot be read, or a line that cannot be followed: it is named.
    ArgumentError
        Another axis, or a target that is the source.
    OutputError
        The target cannot be written.

    Notes
    -----
    ``commanded = wanted - error(commanded)``, in the direction in which the axis moves. Where it turns round in a
    feed move, a line takes up the play first. Memory does not grow with the program.
    """
    if axis not in LINEAR or len(axis) != 1:
        raise ArgumentError("axis", repr(axis)[:40], ", ".join(LINEAR))
    if _same(source, target):
        raise ArgumentError("-o", str(target), "another file than the program itself")
    left = ErrorLeft(predictor=predictor, zero_mm=zero_mm)
    moves = Moves(
        modes=Modes(source=str(source), axis=axis, unit_mm=unit_mm),
        correction=AxisCorrection(table, zero_mm),
        left=left,
        resolution_mm=resolution_mm,
        within_mm=within_mm,
    )
    written = 0
    try:
        with open(source, encoding=_BYTES, newline="") as file, WholeFile(target) as whole:
            size = max(os.fstat(file.fileno()).st_size, 1)
            waiting: list[str] = []
            for line in _corrected(file, moves, head, str(source)):
                waiting.append(line)
                written += 1
                if len(waiting) >= _AT_ONCE:
                    progress(min(os.lseek(file.fileno(), 0, os.SEEK_CUR) / size, 1.0))
                    whole.write("".join(waiting).encode(_BYTES, errors="replace"))
                    waiting.clear()
            whole.write("".join(waiting).encode(_BYTES, errors="replace"))
    except OutputError:
        raise
    except OSError as error:
        raise unreadable(source, error, "a G-code program") from error
    left.settle()
    return CorrectedProgram(
        axis=axis,
        lines=moves.modes.number,
        lines_written=written,
        moves=moves.moves,
        outside=moves.outside,
        points_max_mm=left.points.largest_mm,
        points_rms_mm=left.points.rms_mm,
        between_max_mm=left.between.largest_mm,
        between_rms_mm=left.between.rms_mm,
        before_max_mm=left.before.largest_mm,
        before_rms_mm=left.before.rms_mm,
        notes=tuple(moves.modes.notes.items()),
    )


def _same(source: str | Path, target: str | Path) -> bool:
    try:
        return os.path.samefile(source, target)
    except OSError:  # one of them is not there
        return Path(source).resolve() == Path(target).resolve()


def _corrected(file: TextIO, moves: Moves, head: tuple[str, ...], source: str) -> Iterator[str]:
    begin = file.read(_HEAD)
    file.seek(0)
    semicolons = ";" in begin and "(" not in begin
    end = "\r\n" if "\r\n" in begin else "\n"
    told = [f"; {_plain(sentence)}{end}" if semicolons else f"({_plain(sentence)}){end}" for sentence in head]
    for line in _lines(file, source):
        text = line.rstrip("\r\n")
        if told and text.strip() and not text.lstrip().startswith("%"):  # behind the line that begins a tape
            yield from told
            told = []
        found = moves.take(text)
        own_end = line[len(text) :]
        yield from (each + (own_end or end) for each in found[:-1])
        yield found[-1] + own_end
    yield from told


def _lines(file: TextIO, source: str) -> Iterator[str]:
    number = 0
    while line := file.readline(LONGEST_LINE):
        number += 1
        if len(line) >= LONGEST_LINE:
            raise FileFormatError(source, number, f"a line of {LONGEST_LINE} characters or more", "lines of G-code")
        if "\0" in line:
            raise FileFormatError(source, number, "a byte of 0", "a text file of G-code")
        yield line


def _plain(text: str) -> str:
    """Return text that no control takes for the end of a comment."""
    return "".join(letter if " " <= letter <= "~" and letter not in "();%" else "-" for letter in text)
