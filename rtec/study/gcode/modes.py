"""What lines of G-code set for those behind them, and what cannot be followed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from rtec.errors import FileFormatError
from rtec.study.gcode.arcs import PLANES
from rtec.study.gcode.words import Line
from rtec.units import MM_PER_INCH

LINEAR, ROTARY = "XYZUVW", "ABC"
FEEDS = ("G1", "G2", "G3")
CYCLE = "cycle"
_NORMAL = {"G17": "Z", "G18": "Y", "G19": "X"}
_CYCLES = frozenset({"G73", *(f"G{n}" for n in range(81, 90))})
_OFFSETS = frozenset({*(f"G{n}" for n in range(54, 60)), *(f"G59.{n}" for n in range(1, 4)), "G54.1"})
_AWAY = frozenset({"G28", "G28.1", "G30", "G30.1", "G31", "G53", *(f"G38.{n}" for n in range(2, 6))})
_ZEROS = frozenset({"G10", "G50", "G52", "G92", "G92.1", "G92.2", "G92.3"})
_UNFOLLOWED = {
    **dict.fromkeys(("G5", "G5.1", "G5.2", "G5.3", "G6.2"), "a spline"),
    **dict.fromkeys(("G32", "G33", "G33.1", "G34", "G35", "G36", "G76"), "a thread"),
    **dict.fromkeys(("G12", "G12.1", "G13", "G16", "G107", "G112"), "positions that are not those of the axes"),
    **dict.fromkeys(("G51", "G51.1", "G68", "G68.1", "G68.2"), "positions that are scaled, mirrored or turned"),
    **dict.fromkeys(("G65", "G66", "G66.1"), "a macro, whose moves are not in the file"),
    **dict.fromkeys(("G70", "G71", "G72", "G74", "G75", "G77", "G78", "G79"), "what controls read in several ways"),
    "G7": "an axis in diameters",
    "G90.1": "centres of arcs as positions",
}
_HARMLESS = frozenset({
    "G0", "G1", "G2", "G3", "G4", "G8", "G9", "G15", "G20", "G21", "G40", "G49", "G50.1", "G60", "G61", "G61.1",
    "G64", "G67", "G69", "G80", "G90", "G91", "G91.1", "G93", "G94", "G95", "G96", "G97", "G98", "G99",
})  # fmt: skip
_NOTED = {
    "G41": "the radius of the tool is corrected by the control: positions are those of the contour, not of the axis",
    "G43": "the length of the tool is corrected by the control: positions are those of its tip, not of the axis",
}
_NOTED["G42"] = _NOTED["G41"]
_CALLS = frozenset({97.0, 98.0})
_STEPS = {"X": "U", "Y": "V", "Z": "W"}
"""What lathes read as a step of an axis."""
_FLOW = frozenset({
    "GOTO", "GOTOF", "GOTOB", "IF", "WHILE", "DO", "FOR", "LOOP", "REPEAT", "UNTIL", "CALL", "MCALL", "EXTCALL",
    "SUB", "PROC", "TRANS", "ATRANS", "ROT", "AROT", "SCALE", "ASCALE", "MIRROR", "AMIRROR", "CYCLE", "DIAMON",
})  # fmt: skip


@dataclass(slots=True)
class Modes:
    """Modes of a program, as far as the moves of one axis depend on them."""

    source: str
    axis: str
    unit_mm: float = 1.0
    absolute: bool = True
    plane: str = "G17"
    motion: str = ""
    inverse_time: bool = False
    offset: str = ""
    number: int = 0
    """Of the line."""
    notes: dict[str, int] = field(default_factory=dict)
    """What was left as it is, and the line where it stands first."""

    def error(self, problem: str, allowed: str) -> FileFormatError:
        """Return the refusal of a line."""
        return FileFormatError(self.source, self.number, problem, allowed)

    def note(self, sentence: str) -> None:
        """Keep a note."""
        self.notes.setdefault(sentence, self.number)

    @property
    def normal(self) -> str:
        """Axis along which holes are drilled."""
        return _NORMAL[self.plane]

    def unit_of(self, letter: str) -> float:
        """Return mm, or degrees, in a unit of the words of an axis."""
        return self.unit_mm if letter in LINEAR else 1.0

    def take(self, line: Line) -> bool:
        """Set what a line sets; return whether it moves axes in a way that is followed."""
        moves = bool(line.letters & set(LINEAR + ROTARY))
        self._check(line, moves)
        for code in line.codes:
            _SETS.get(code, _nothing)(self, code)
            if code in _CYCLES:
                self.motion = CYCLE
            if code in _OFFSETS:
                self._work_offset(line)
            if code in _NOTED:
                self.note(_NOTED[code])
        return "G4" not in line.codes and not _AWAY & set(line.codes) and not _ZEROS & set(line.codes)

    def left_behind(self, line: Line) -> set[str]:
        """Return the axes whose places nobody knows behind a line that is not followed; of the corrected one say so.

        A move to nowhere leaves those that it names, all where it names none; a new zero those that it names.
        """
        named = line.letters & set(LINEAR + ROTARY) | {one for one, step in _STEPS.items() if step in line.letters}
        away = sorted(_AWAY & set(line.codes))
        if not away:
            return named if _ZEROS & set(line.codes) else set()
        gone = named or set(LINEAR + ROTARY)
        if self.axis in gone:
            self.note(f"{away[0]} is left as it is; from there {self.axis} comes from an unknown place")
        return gone

    def _check(self, line: Line, moves: bool) -> None:
        for code in line.codes:
            if code in _UNFOLLOWED:
                raise self.error(f"{code}: {_UNFOLLOWED[code]}", "a program of straight moves, arcs and cycles")
            if code in _ZEROS and self.axis in line.letters:
                raise self.error(f"{code} moves the zero of {self.axis}", "one zero for the whole program")
        if any(word.letter == "M" and word.value in _CALLS for word in line.words):
            raise self.error("a call of a subprogram", "a program with its moves written out")
        if sum(word.letter == self.axis for word in line.words) > 1:
            raise self.error(f"{self.axis} stands twice", f"{self.axis} once in a line")
        if (step := _STEPS.get(self.axis)) in line.letters and not _AWAY & set(line.codes):
            raise self.error(f"{step}, which may be a step of {self.axis}", f"moves in {self.axis}")
        flow = [word for word in line.keywords if word.rstrip("0123456789") in _FLOW]
        if flow:
            raise self.error(f"{flow[0]} is not followed", "a program with its moves written out")
        self._check_unknown(line, moves)

    def _check_unknown(self, line: Line, moves: bool) -> None:
        own = self.axis in line.letters
        if (line.computed or line.keywords) and moves and "G4" not in line.codes:
            raise self.error(f"a move with something computed: {line.text.strip()[:40]!r}", "moves in numbers")
        if line.computed:
            self.note("what is computed is left as it is")
        for keyword in line.keywords:
            self.note(f"{keyword[:40]} is not known, and left as it is")
        if line.optional and moves:
            raise self.error("a move that may be skipped", "a program without / before moves")
        for code in line.codes:
            if code in _KNOWN:
                continue
            if own:
                raise self.error(f"{code} with {self.axis} is not known", "moves of G0 to G3 and drilling cycles")
            self.note(f"{code} is not known, and left as it is")

    def _work_offset(self, line: Line) -> None:
        codes = sorted(_OFFSETS & set(line.codes))
        place = line.word("P")
        found = f"{codes[0]} P{place.value:g}" if codes[0] == "G54.1" and place is not None else codes[0]
        if self.offset not in ("", found):
            raise self.error(
                f"{found} after {self.offset}: another zero of {self.axis}", "one zero for the whole program"
            )
        self.offset = found


def _nothing(modes: Modes, code: str) -> None: ...


def _motion(modes: Modes, code: str) -> None:
    modes.motion = code


def _plane(modes: Modes, code: str) -> None:
    modes.plane = code


def _set(**values: object) -> Callable[[Modes, str], None]:
    def sets(modes: Modes, code: str) -> None:
        for name, value in values.items():
            setattr(modes, name, value)

    return sets


_SETS: dict[str, Callable[[Modes, str], None]] = {
    **dict.fromkeys(("G0", *FEEDS), _motion),
    **dict.fromkeys(PLANES, _plane),
    "G80": _set(motion=""),
    "G20": _set(unit_mm=MM_PER_INCH),
    "G21": _set(unit_mm=1.0),
    "G90": _set(absolute=True),
    "G91": _set(absolute=False),
    "G93": _set(inverse_time=True),
    **dict.fromkeys(("G94", "G95"), _set(inverse_time=False)),
}
_KNOWN = _HARMLESS | _CYCLES | _OFFSETS | _AWAY | _ZEROS | set(PLANES) | set(_NOTED)
