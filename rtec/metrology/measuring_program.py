"""The measuring program: G-code that drives an axis through the targets, and its parser for the simulated machine.

The writer gives what the thesis's macro LaserMotion gives, line for line. The parser reads exactly this subset and
refuses every other word, so that the simulated machine never guesses.

References
----------
Thesis, section 4.1.2, Figure 4.3; Appendix B (macro and the listing that it produced).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from itertools import accumulate
from operator import add, sub
from pathlib import Path

from rtec import axis
from rtec.errors import ArgumentError, FileFormatError
from rtec.io import read_text
from rtec.metrology.measuring_plan import AxisMeasure, InchMode, MeasuringPlan
from rtec.metrology.plain_numbers import shown
from rtec.units import MM_PER_INCH

STOP_S = 1.0
"""After so long the operator continues at a stop."""


def measuring_program(plan: MeasuringPlan) -> list[str]:
    """Export a plan as the macro's program: in inches, to four decimals; feeds to a tenth, dwells in whole seconds.

    Returns
    -------
    list of str
        The lines, without line ends. A run is: overshoot below the start, start, targets forward, overshoot beyond
        the end, targets back from the end, M01. Before the first run M00 stops the machine to zero the laser.

    Notes
    -----
    The macro adds the increments up and formats each sum to four decimals, and so does this: the sums of the way back
    start from the end, and may differ from those of the way forth in the last digit where the increment has more.

    Examples
    --------
    >>> plan = MeasuringPlan(start_mm=25.4, end_mm=50.8, increment_mm=25.4, dwell_s=2, runs=1,
    ...                      feed_mm_s=50 * 25.4 / 60, overshoot_mm=2.54)
    >>> measuring_program(plan)[:8]  # doctest: +NORMALIZE_WHITESPACE
    ['G70', 'G01G59G90G94  (Setting Machine Modals)', 'G53Z1.0F50.', 'G53Z0.9F50.', 'G04F2', 'G53Z1.0F50.',
     'M00  (Program Stop for Zero Laser)', '(Measurement run: 1)']
    """
    feed = f"F{_written(60.0 * _inches(plan.feed_mm_s), most=1)}"
    dwell = f"G04F{_written(plan.dwell_s, most=0)}"
    first, last, overshoot = _inches(plan.start_mm), _inches(plan.end_mm), _inches(plan.overshoot_mm)
    steps = [_inches(plan.increment_mm)] * (plan.targets_mm.size - 1)
    start = _move(plan, first) + feed
    below = _move(plan, first - overshoot) + feed
    beyond = _move(plan, last + overshoot)
    forward = [_move(plan, position) for position in accumulate(steps, add, initial=first)][1:]
    back = [_move(plan, position) for position in accumulate(steps, sub, initial=last)]
    lines = ["G07"] if plan.axis.measure is AxisMeasure.DIAMETER else []
    lines += [plan.axis.inch_mode.name, "G01G59G90G94  (Setting Machine Modals)", start]
    for run in range(1, plan.runs + 1):
        lines += [below, dwell, start]
        lines += ["M00  (Program Stop for Zero Laser)" if run == 1 else dwell, f"(Measurement run: {run})"]
        for move in (*forward, beyond, *back):
            lines += [move, dwell]
        lines.append(f"M01 (End of Run: {run})")
    return lines


def _inches(length_mm: float) -> float:
    """Return a length in inches, without the last digits that a conversion leaves."""
    return round(length_mm / MM_PER_INCH, 12)


def _move(plan: MeasuringPlan, position_inch: float) -> str:
    return f"G53{plan.axis.letter}{_written(position_inch, most=4, whole=1, least=1)}"


def _written(value: float, *, most: int, whole: int = 0, least: int = 0) -> str:
    """Return a number as Visual Basic's ``Format`` writes it: with ``most`` decimals, 0 at the end left out.

    It rounds half away from zero on the 15 digits that Visual Basic keeps of a double; as many digits as ``whole``
    and ``least`` say stand before and behind the point in any case.
    """
    rounded = Decimal(f"{value:.14e}").quantize(Decimal(1).scaleb(-most), rounding=ROUND_HALF_UP)
    left, _, right = f"{abs(rounded):f}".partition(".")
    right = right[:least] + right[least:].rstrip("0")
    return f"{'-' if rounded < 0 else ''}{left.lstrip('0').rjust(whole, '0')}{'.' if most else ''}{right}"


@dataclass(frozen=True, slots=True)
class Move:
    """A feed move in machine coordinates; the feed is the last one programmed."""

    line: int
    axis: str
    position_mm: float
    feed_mm_s: float


@dataclass(frozen=True, slots=True)
class Dwell:
    """A rest."""

    line: int
    duration_s: float


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop (M00, M01), until the operator continues."""

    line: int


Block = Move | Dwell | Stop
"""What a line of a program lets the axis do."""

_COMMENT = re.compile(r"\(([^()]*)\)")
_REAL = r"-?(?:[0-9]{1,6}(?:\.[0-9]{0,8})?|\.[0-9]{1,8})"
_MOVE = re.compile(rf"G53(?P<axis>[XYZ])(?P<position>{_REAL})(?:F(?P<feed>{_REAL}))?")
_DWELL_WORDS = re.compile(rf"G04F(?P<duration>{_REAL})")
_MODALS = ("G01", "G59", "G90", "G94")
_ALLOWED = "G70, G20, G07, G01G59G90G94, G53<axis><position>[F<feed>], G04F<seconds>, M00, M01, (comment)"


def parse_program(lines: Iterable[str], *, source: str = "program") -> list[Block]:
    """Return the moves, dwells and stops of a measuring program in order; ``source`` is its name for messages.

    Raises
    ------
    FileFormatError
        With the line: an unknown word, a move before inches and modes are set or before any feed, a feed or a dwell
        that is not above zero, a second axis, no move at all.

    Examples
    --------
    >>> blocks = parse_program(["G70", "G01G59G90G94", "G53Z1.0F50.", "G04F2", "M00 (zero)"])
    >>> blocks[0], blocks[2]
    (Move(line=3, axis='Z', position_mm=25.4, feed_mm_s=21.166666666666668), Stop(line=5))
    """
    blocks: list[Block] = []
    last: Move | None = None
    modes: set[str] = set()
    for number, text in enumerate(lines, 1):
        words = "".join(_COMMENT.sub("", text).split())
        if words in ("M00", "M01"):
            blocks.append(Stop(number))
        elif (dwell := _DWELL_WORDS.fullmatch(words)) is not None:
            duration = float(dwell["duration"])
            if duration <= 0:
                raise FileFormatError(source, number, f"dwell of {duration:g} s", "more than 0 s")
            blocks.append(Dwell(number, duration))
        elif (move := _MOVE.fullmatch(words)) is not None:
            block = _moved(source, number, move, last)
            _refuse_unready(source, block, modes, last)
            last = block
            blocks.append(block)
        elif words:
            modes |= _modes(source, number, words, text)
    if last is None:
        raise FileFormatError(source, None, "the program moves no axis", "moves such as G53Z1.0F50.")
    return blocks


def _moved(source: str, number: int, move: re.Match[str], last: Move | None) -> Move:
    """Return the move of a line, whose feed is that of the last one where it states none."""
    if move["feed"]:
        feed = float(move["feed"]) * MM_PER_INCH / 60.0
    elif last is not None:
        feed = last.feed_mm_s
    else:
        raise FileFormatError(source, number, "a move before any feed", "F behind the position, such as F50.")
    if feed <= 0:
        raise FileFormatError(source, number, f"feed of {move['feed']} inch/min", "more than 0 inch/min")
    return Move(number, move["axis"], float(move["position"]) * MM_PER_INCH, feed)


def _modes(source: str, number: int, words: str, text: str) -> set[str]:
    """Return the modes that a line sets (G70, G07, G01G59G90G94)."""
    codes = {words[start : start + 3] for start in range(0, len(words), 3)}
    if (len(words) <= 12 and codes <= {*_MODALS}) or words in ("G07", *(mode.name for mode in InchMode)):
        return codes
    raise FileFormatError(source, number, f"{shown(text.strip())} is not understood", _ALLOWED)


def _refuse_unready(source: str, move: Move, modes: set[str], last: Move | None) -> None:
    """Refuse a move whose unit, coordinates or axis are not what the program has said."""
    if not modes & {mode.name for mode in InchMode}:
        raise FileFormatError(source, move.line, "a move before the unit is set", "G70 (inches) first")
    lacking = [code for code in _MODALS if code not in modes]
    if lacking:
        problem = f"a move before {', '.join(lacking)}"
        raise FileFormatError(source, move.line, problem, "G01G59G90G94 first")
    if last is not None and move.axis != last.axis:
        problem = f"axis {move.axis} after {last.axis}"
        raise FileFormatError(source, move.line, problem, "one axis in a measuring program")


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
            else:
                blocks.append(axis.Dwell(seconds=block.duration_s if isinstance(block, Dwell) else STOP_S))
        except ArgumentError as error:
            raise FileFormatError(source, block.line, f"{error.name} {error.value}", error.allowed) from error
    if not any(isinstance(block, axis.Move) and block.target_mm != 0.0 for block in blocks):
        raise FileFormatError(source, None, "the axis stays at 0", "a move to somewhere else, such as G53Z1.0F50.")
    return axis.Program(blocks=tuple(blocks))
