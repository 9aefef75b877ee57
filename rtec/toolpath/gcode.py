"""G-code programs as toolpaths: lines, arcs in the XY plane, feeds as limits, corners blended or not.

Accepted: G0 G1 G2 G3 with X Y Z, I J or R; F; G17 G20 G21 G90 G91 G61 G64 (P); G40 G49 G54 G80 G94, which state the
default; M2 M30; N, comments in () or behind ; and lines of %. Every other word is an error.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path as FilePath

import numpy as np

from rtec.checks import number_within
from rtec.errors import FileFormatError
from rtec.io import brief, read_text
from rtec.toolpath.blending import Floats, Piece, joined
from rtec.toolpath.nurbs import LARGEST_MM
from rtec.toolpath.path import Path
from rtec.units import MM_PER_INCH

BLEND_MM = 0.01
"""Default tolerance of blended corners."""
MOST_BLEND_MM = 1000.0
MOST_BYTES = 1 << 24
MOST_MOVES = 100_000
SHORTEST_MM = 1e-6
"""Shorter straight moves are ignored."""
OFF_CENTRE_MM = 0.01
"""Largest difference of the radii at both ends of an arc: coordinates in programs are rounded."""
_COMMENT = re.compile(r"\([^()]*\)|;.*")
_WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))")
_NEUTRAL = {"G17", "G40", "G49", "G54", "G80", "G94"}
_MOTIONS = {"G0", "G1", "G2", "G3"}
_ALLOWED = "G0 to G3 with X Y Z I J R F, G17, G20, G21, G61, G64 P, G90, G91, M2, M30"


def read_gcode(path: str | FilePath, *, blend_mm: float = BLEND_MM) -> Path:
    """Read a program as a path; a program without a change of Z lies in the plane.

    Parameters
    ----------
    path
        A text file.
    blend_mm
        Tolerance of blended corners until the program says G64 P (in its unit) or G61 (no blend), 0 to 1000 mm.

    Returns
    -------
    Path
        It begins where the first rapids end. F words limit the feed; rapids have no limit.

    Raises
    ------
    FileFormatError
        With the line: a word that is not understood or stands twice, an arc without a centre or with two radii, a
        position beyond 100 m; no move at all.
    ArgumentError
        A tolerance outside its range.

    Examples
    --------
    >>> read_gcode("part.nc")
    Traceback (most recent call last):
        ...
    rtec.errors.FileFormatError: part.nc: there is no such file; use the path of a G-code program
    """
    blend = number_within("blend_mm", blend_mm, 0.0, MOST_BLEND_MM)
    text = read_text(path, "a G-code program", most_bytes=MOST_BYTES)
    return parse_gcode(text, source=str(path), blend_mm=blend)


def parse_gcode(text: str, *, source: str = "program", blend_mm: float = BLEND_MM) -> Path:
    r"""Return the path of a program's text, as `read_gcode`; ``source`` is its name for messages.

    Examples
    --------
    >>> path = parse_gcode("G0 X10\nG1 X20 F600\nG3 X10 Y10 I-10", blend_mm=0.0)
    >>> round(path.length_mm, 6), path.feed_limit_mm_s([5.0]).tolist(), path.corners_mm.round(9).tolist()
    (25.707963, [10.0], [10.0])
    """
    program = _Program(source=source, blend_mm=blend_mm)
    for number, line in enumerate(text.splitlines(), 1):
        program.line = number
        words = "".join(_COMMENT.sub("", line).split()).upper()
        if words in ("", "%"):
            continue
        if program.take(words):
            break
    if not program.pieces:
        raise FileFormatError(source, None, "the program makes no feed move", "moves such as G1 X10 F600")
    depths = {float(z) for piece in program.pieces for z in (piece.start[2], piece.end[2])}
    return joined(FilePath(source).name, program.pieces, 2 if len(depths) == 1 else 3)


@dataclass
class _Program:
    """The state of the interpreter."""

    source: str
    blend_mm: float
    line: int = 0
    unit_mm: float = 1.0
    absolute: bool = True
    motion: str = ""
    feed_mm_s: float = math.inf
    at: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    pieces: list[Piece] = field(default_factory=list)

    def error(self, problem: str, allowed: str) -> FileFormatError:
        return FileFormatError(self.source, self.line, problem, allowed)

    def take(self, text: str) -> bool:
        """Interpret a line; return whether it ends the program."""
        left = _WORD.sub("", text)
        if left:
            raise self.error(f"{brief(left, 40)!r} is not understood", _ALLOWED)
        codes: set[str] = set()
        words: dict[str, float] = {}
        for letter, number in _WORD.findall(text):
            if letter in "GM":
                codes.add(f"{letter}{float(number):g}")
            elif letter not in "NXYZIJRFP":
                raise self.error(f"{letter}{brief(number, 40)} is not understood", _ALLOWED)
            elif letter in words:
                raise self.error(f"{letter} stands twice", "each letter once in a line")
            else:
                words[letter] = float(number)
        ends = bool(codes & {"M2", "M30"})
        self._set(codes - {"M2", "M30"} - _NEUTRAL, words)
        if words.keys() & set("XYZ") or (self.motion in ("G2", "G3") and words.keys() & set("IJ")):
            self._move(words)
        elif words.keys() & set("IJR"):
            raise self.error("I, J or R without an arc", "it in a line with G2 or G3")
        return ends

    def _set(self, codes: set[str], words: dict[str, float]) -> None:
        for pair in ({"G20", "G21"}, {"G90", "G91"}, {"G61", "G64"}, _MOTIONS):
            if len(pair & codes) > 1:
                raise self.error(f"{' and '.join(sorted(pair & codes))} contradict each other", "one of them")
        if codes & {"G20", "G21"}:
            self.unit_mm = MM_PER_INCH if "G20" in codes else 1.0
        if codes & {"G90", "G91"}:
            self.absolute = "G90" in codes
        self.motion = next(iter(codes & _MOTIONS), self.motion)
        unknown = codes - _MOTIONS - {"G20", "G21", "G90", "G91", "G61", "G64"}
        if unknown:
            raise self.error(f"{min(unknown)} is not understood", _ALLOWED)
        self._set_numbers(codes, words)

    def _set_numbers(self, codes: set[str], words: dict[str, float]) -> None:
        if "G61" in codes:
            self.blend_mm = 0.0
        elif "G64" in codes and "P" in words:
            self.blend_mm = words["P"] * self.unit_mm
            if not 0.0 <= self.blend_mm <= MOST_BLEND_MM:
                raise self.error(f"a tolerance of {self.blend_mm:g} mm", f"0 to {MOST_BLEND_MM:g} mm")
        elif "P" in words:
            raise self.error("P without G64", "G64 P and the tolerance")
        if "F" in words:
            self.feed_mm_s = words["F"] * self.unit_mm / 60.0
            if not 1e-9 <= self.feed_mm_s <= 1e5:
                raise self.error(f"a feed of {self.feed_mm_s:g} mm/s", "1e-9 to 1e5 mm/s")

    def _move(self, words: dict[str, float]) -> None:
        if not self.motion:
            raise self.error("a move before G0, G1, G2 or G3", "one of them first")
        begin = list(self.at)
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                self.at[axis] = words[letter] * self.unit_mm + (0.0 if self.absolute else begin[axis])
                if not abs(self.at[axis]) <= LARGEST_MM:
                    raise self.error(f"{letter} leads to {self.at[axis]:g} mm", f"within {LARGEST_MM:g} mm of zero")
        if self.motion in ("G2", "G3"):
            self._arc(np.array(begin), np.array(self.at), words)
            return
        if words.keys() & set("IJR"):
            raise self.error("I, J or R in a straight line", "it with G2 or G3")
        rapid = self.motion == "G0"
        if math.dist(begin, self.at) < SHORTEST_MM:
            self.at = begin
        elif self.pieces or not rapid:
            self._add(Piece(
                start=np.array(begin), end=np.array(self.at), blend_mm=self.blend_mm,
                feed_mm_s=math.inf if rapid else self.feed_mm_s,
            ))  # fmt: skip

    def _add(self, piece: Piece) -> None:
        if len(self.pieces) == MOST_MOVES:
            raise self.error("one move more", f"a program of at most {MOST_MOVES} moves")
        self.pieces.append(piece)

    def _arc(self, begin: Floats, end: Floats, words: dict[str, float]) -> None:
        sign = 1.0 if self.motion == "G3" else -1.0
        chord = end[:2] - begin[:2]
        length = math.hypot(*chord)
        if ("R" in words) == bool(words.keys() & set("IJ")):
            raise self.error("an arc without a centre, or with two", "either I and J or R")
        if "R" in words:
            radius = abs(words["R"]) * self.unit_mm
            if length == 0.0 or radius < length / 2.0 - OFF_CENTRE_MM:
                problem = f"radius {radius:g} mm with ends {length:g} mm apart"
                raise self.error(problem, "R from half the distance of two different ends on, or I and J")
            height = math.sqrt(max(radius**2 - length**2 / 4.0, 0.0)) * sign * (1.0 if words["R"] > 0.0 else -1.0)
        else:
            out = np.array([words.get("I", 0.0), words.get("J", 0.0)]) * self.unit_mm
            radii = math.hypot(*out), math.hypot(*(chord - out))
            if abs(radii[0] - radii[1]) > OFF_CENTRE_MM or min(radii) < 1e-6:
                problem = f"the arc begins with radius {radii[0]:g} mm and ends with {radii[1]:g} mm"
                raise self.error(problem, "a centre (I, J from the beginning) as far from both")
            height = 0.0 if length == 0.0 else float(chord[0] * out[1] - chord[1] * out[0]) / length
        if length > 0.0:  # onto the line of equal distances: both radii become one
            out = chord / 2.0 + height * np.array([-chord[1], chord[0]]) / length
        seen = chord - out
        turn = math.atan2(out[1] * seen[0] - out[0] * seen[1], -out @ seen)
        sweep = sign * (sign * turn % (2.0 * math.pi) if length > 0.0 else 2.0 * math.pi)
        feed, blend = self.feed_mm_s, self.blend_mm
        centre = begin[:2] + out
        self._add(Piece(start=begin, end=end, centre=centre, sweep=sweep, feed_mm_s=feed, blend_mm=blend))
