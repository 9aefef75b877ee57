"""Classes of faults of the open signal path: those of the cell that have a meaning there, and some of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rtec.errors import ArgumentError, unknown
from rtec.injector import DesignRow, RealEdges
from rtec.machine import _fault_kernels as _at
from rtec.machine.fault_kinds import CABLE, GLITCHES, ActivatedBy, FaultCategory, FaultKind, FaultPlace, FaultRow
from rtec.units import PS_PER_NS, PS_PER_US

PULSES, MISSED, SHIFTED = _at.PULSES, _at.MISSED, _at.SHIFTED
HUNG, CLOCK, LATCH, REQUEST = _at.HUNG, _at.CLOCK, _at.LATCH, _at.REQUEST
"""What is done, beyond what a cell knows: pulses on the lines, an edge without effect, edges that come late; the
processor stands still, its clock has another rate, the hold latch sticks, a request is wrong."""
LINE_A, LINE_B = 1, 2
"""Lines as bits of a level code."""


@dataclass(frozen=True, eq=False)
class OpenFaultRow(FaultRow):
    """A class of faults that only the open path has; what each number means depends on the code."""

    line: int = 0
    """Lines that are concerned, as a mask."""
    number: int = 0
    """Pulses of a burst (``PULSES``); 1 where the latch sticks closed, 0 where open (``LATCH``)."""
    lasts_ps: tuple[int, int] = (0, 0)
    """Shortest and longest pulse, ps (``PULSES``)."""
    within_ps: int = 0
    """Time in which the pulses of a burst begin, ps."""
    factor: float = 1.0
    """Delay as a share of the shorter interval beside an edge (``SHIFTED``); rate of the clock (``CLOCK``)."""
    falls_only: bool = False
    """Whether only falling edges come late: the high part becomes longer."""

    @property
    def over_at_once(self) -> bool:
        """Return whether it is over as soon as it has begun."""
        return self.code in (PULSES, MISSED, REQUEST)


def _stuck(name: str, line: int, high: bool) -> OpenFaultRow:
    def lines(levels: int, before: int) -> int:
        return levels | line if high else levels & ~line

    level = "high" if high else "low"
    return OpenFaultRow(
        f"{name} stuck {level}", CABLE, _F.ENCODER, _A.CABLE, f"{name} rests {level}, the other line goes on", lines,
        seen_by="a monitor of the differential pair; a speed check, if it lasts; an index",
    )  # fmt: skip


def _glitch(name: str, line: int) -> OpenFaultRow:
    return OpenFaultRow(
        f"glitch on {name}", PULSES, _F.ENCODER, _A.CABLE, f"{name} is inverted for 300 ns, once",
        line=line, number=1, lasts_ps=(300 * PS_PER_NS, 300 * PS_PER_NS), seen_by="a narrower filter; an index",
    )  # fmt: skip


_F, _A = FaultCategory, ActivatedBy

ONLY_OPEN = (
    _stuck("A", LINE_A, high=False),
    _stuck("A", LINE_A, high=True),
    _stuck("B", LINE_B, high=False),
    _stuck("B", LINE_B, high=True),
    _glitch("A", LINE_A),
    _glitch("B", LINE_B),
    OpenFaultRow(
        "noise burst", PULSES, _F.ENCODER, _A.CABLE, "20 pulses of 50 to 300 ns on either line within 20 us",
        line=LINE_A | LINE_B, number=20, lasts_ps=(50 * PS_PER_NS, 300 * PS_PER_NS), within_ps=20 * PS_PER_US,
        seen_by="a narrower filter; an index",
    ),
    OpenFaultRow(
        "missed edge", MISSED, _F.ENCODER, _A.CABLE, "a line misses one edge, and is right again with its next one",
        seen_by="an index",
    ),
    OpenFaultRow(
        "phase error", SHIFTED, _F.ENCODER, _A.CABLE, "B lags by 30 deg more",
        line=LINE_B, factor=1 / 3, seen_by="a look at the phase, as at a capture",
    ),
    OpenFaultRow(
        "duty error", SHIFTED, _F.ENCODER, _A.CABLE, "A is high for 5 % of a cycle longer",
        line=LINE_A, factor=1 / 5, falls_only=True, seen_by="a look at the duty, as at a capture",
    ),
    OpenFaultRow(
        "processor hung", HUNG, _F.POWER, _A.TWIN, "its program stands still, the outputs stay; its end is a restart",
    ),
    OpenFaultRow("clock fast", CLOCK, _F.BOX, _A.TWIN, "the processor runs at twice its rate", factor=2.0),
    OpenFaultRow("clock slow", CLOCK, _F.BOX, _A.TWIN, "the processor runs at half its rate", factor=0.5),
    OpenFaultRow(
        "hold latch stuck closed", LATCH, _F.BOX, _A.TWIN, "A and B rest behind it, for gates and processor",
        number=1,
    ),
    OpenFaultRow("hold latch stuck open", LATCH, _F.BOX, _A.TWIN, "real edges merge with the pulses"),
    OpenFaultRow(
        "request corrupted", REQUEST, _F.TOTAL, _A.BEGUN, "a bit of the next request is wrong, of no other",
    ),
)  # fmt: skip
"""Those that only the open path has."""

SHARED = (
    FaultKind.CABLE_OPEN,
    FaultKind.LINES_SWAPPED,
    FaultKind.LINE_BROKEN,
    FaultKind.GLITCHES,
    FaultKind.POWER_LOST,
    FaultKind.BOX_RESTARTED,
    FaultKind.SWITCH_THROWN,
)
"""Those of the cell that have a meaning in the open path, by the same words."""
OPEN_FAULTS: tuple[FaultRow, ...] = (*SHARED, *ONLY_OPEN)
"""All that can happen in the open path."""
LINE_CODES = (CABLE, GLITCHES, PULSES, MISSED, SHIFTED)
"""Codes of what happens to the lines before the box."""
BOX_CODES = (_at.POWER_OFF, _at.BOX_RESTART, _at.SWITCH_THROWN, HUNG, CLOCK, LATCH)
"""Codes of what happens to the box."""


def word_of(row: FaultRow) -> str:
    """Return what a class of faults is called on a command line.

    Examples
    --------
    >>> word_of(FaultKind.LINES_SWAPPED), word_of(ONLY_OPEN[0])
    ('a-and-b-swapped', 'a-stuck-low')
    """
    return "-".join(row.words.lower().replace(",", " ").split())


def place_of(row: FaultRow) -> str:
    """Return where a fault of the open path happens: at the lines, the box or the request."""
    return "lines" if row.code in LINE_CODES else "box" if row.code in BOX_CODES else "request"


def open_fault_named(text: str, *, name: str = "fault") -> FaultRow:
    """Return the class of faults of the open path that a text names, with spaces or hyphens.

    Raises
    ------
    ArgumentError
        There is none; the nearest is suggested, and one of bus, PC or cell is referred to ``rtec safety``.

    Examples
    --------
    >>> open_fault_named("Power lost").meaning
    'the box is dead; its gates pass A and B on'
    >>> open_fault_named("masquerade")
    Traceback (most recent call last):
    rtec.errors.ArgumentError: fault: 'masquerade' is a fault of the bus; use rtec safety --fault masquerade: the \
open path has no bus and no PC
    """
    word = "-".join(text.lower().replace(",", " ").replace("_", "-").split())
    known = {word_of(row): row for row in OPEN_FAULTS}
    if word in known:
        return known[word]
    elsewhere = {short: kind for kind in FaultKind for short in (word_of(kind), kind.name.lower().replace("_", "-"))}
    kind = elsewhere.get(word)
    if kind in SHARED:
        return kind
    if kind is not None:
        where = {FaultPlace.BUS: "the bus", FaultPlace.PC: "the PC", FaultPlace.AXIS: "the box's node"}[kind.place]
        raise ArgumentError(
            name, repr(text[:60]), f"rtec safety --fault {word_of(kind)}: the open path has no bus and no PC",
            problem=f"is a fault of {where}",
        )  # fmt: skip
    raise unknown(name, text, known, noun="fault")


def why_not(row: FaultRow, design: DesignRow, real_edges: RealEdges) -> str | None:
    """Return why a fault cannot happen to a box; None: it can.

    Examples
    --------
    >>> from rtec.injector import Design
    >>> why_not(open_fault_named("hold latch stuck open"), Design.B, RealEdges.HOLD)
    'the lines of Design B pass through its processor, without a hold latch'
    """
    if row.code != LATCH:
        return None
    if design.in_path:
        return f"the lines of {design.title} pass through its processor, without a hold latch"
    return None if real_edges is RealEdges.HOLD else "real edges that merge pass no hold latch"


def check_beside_box(row: FaultRow, *, name: str = "fault") -> None:
    """Check that a fault needs no box of a design.

    Raises
    ------
    ArgumentError
        It happens to the box.
    """
    if row.code in BOX_CODES:
        allowed = "a fault of the lines or of a request with an algorithm"
        raise ArgumentError(name, word_of(row), allowed, problem="is of the box of a design")


def check_pair(rows: Sequence[FaultRow], *, name: str = "fault") -> None:
    """Check that one fault, or two different ones, are to happen.

    Raises
    ------
    ArgumentError
        More than two, or the same twice.
    """
    if len(rows) > 2:
        raise ArgumentError(name, f"{len(rows)} faults", "one, or a combination of two")
    if len(rows) == 2 and rows[0] is rows[1]:
        raise ArgumentError(name, repr(word_of(rows[0])), "two different faults", problem="is given twice")
