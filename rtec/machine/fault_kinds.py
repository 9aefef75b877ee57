"""Every class of faults, a row each: what happens, where, of which category, and what shows its activation.

Names, help, records of the kernels, campaigns and the table of docs/how-to-test-your-pc.md follow from the rows.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass

from rtec.errors import ArgumentError
from rtec.link import _bus_kernels as _bus
from rtec.machine import _fault_kernels as _at

CABLE, GLITCHES = _at.CABLE, _at.GLITCHES
"""Codes of faults of the lines before the box: their rows say what the lines show, and how often a glitch comes."""


class FaultPlace(enum.Enum):
    """Where a fault happens."""

    BUS = "bus"
    """To frames of one node or of all."""
    PC = "PC"
    AXIS = "axis"
    """At the box of an axis, or at the encoder before it."""


class FaultCategory(enum.Enum):
    """What a fault is done to."""

    FRAMES = "frames on their way"
    TOTAL = "what the PC asks for"
    BUS = "the bus and its nodes"
    WORD = "the box's position word"
    POWER = "programs and power"
    CLOCK = "the PC's clock"
    ENCODER = "the lines before the box"
    """Box and controller see the same wrong lines."""
    OPERATOR = "switch and probe"
    BOX = "the box's own circuits"


class ActivatedBy(enum.IntEnum):
    """What shows that the fault was activated."""

    BEGUN = _bus.BEGUN
    """That it began."""
    FRAMES = _bus.FRAMES_AFFECTED
    """Frames that it affected."""
    CABLE = _bus.CABLE_AFFECTED
    """Moments at which the levels behind the cable differed from the encoder's."""
    WORD = _bus.WORD_AFFECTED
    """Position words that were not the right ones."""
    GLITCHES = _bus.GLITCHES_MADE
    """Glitches on the lines."""
    EDGES = _bus.EDGES_KEPT
    """Edges of the encoder that did not pass."""
    TWIN = _bus.TWIN_DIFFERS
    """Moments at which lines or completed total differed from those of the run without it; in the open path alone."""


_F, _A = FaultCategory, ActivatedBy

NO_GLITCHES = 0.0, 0


@dataclass(frozen=True, eq=False)
class FaultRow:
    """What is known of a class of faults.

    Those of a cell are the members of `FaultKind`; the open path has some more
    (`rtec.machine.open_fault_kinds`). Lines that go wrong in another way are a row of one's own, which a
    `Fault` takes as well.

    Raises
    ------
    ArgumentError
        Lines that return something else than levels.

    Examples
    --------
    >>> shorted = FaultRow("B shorted to A", CABLE, FaultCategory.ENCODER, ActivatedBy.CABLE, "B shows A",
    ...                    lines=lambda levels, before: 3 * (levels & 1))
    >>> shorted.place.value, shorted.cable == FaultKind.CABLE_OPEN.cable
    ('axis', False)
    """

    words: str
    """What it is called."""
    code: int
    """What is done, as the kernels number it."""
    category: FaultCategory
    """What it is done to."""
    activated_by: ActivatedBy
    """What shows that the fault was activated."""
    meaning: str
    """What happens, in a few words."""
    lines: Callable[[int, int], int] | None = None
    """Of the cable between encoder and box (code ``CABLE``): the levels that the box gets, as ``lines(levels,
    before)`` of those that the encoder gives, and of those that the box got last before the fault; A + 2 B each."""
    glitches: tuple[float, int] = NO_GLITCHES
    """Share of the edges that one follows, and its width in ps (code ``GLITCHES``)."""
    seen_by: str = ""
    """What else than the box could see it."""

    def __post_init__(self) -> None:
        _ = self.cable

    @property
    def cable(self) -> int:
        """Return which levels change on the lines before the box, as the kernels take it."""
        if self.lines is None:
            return 0
        seen = [(levels, self.lines(levels, before)) for before in range(4) for levels in range(4)]
        if not all(level in range(4) for _, level in seen):
            raise ArgumentError("lines", str([level for _, level in seen]), "levels, 0 to 3: A + 2 B")
        return sum((levels ^ level) << (2 * place) for place, (levels, level) in enumerate(seen))

    @property
    def place(self) -> FaultPlace:
        """Return where a fault of this class happens."""
        if self.code <= _bus.LAST_OF_BUS:
            return FaultPlace.BUS
        return FaultPlace.PC if self.code >= _at.PC_KILLED else FaultPlace.AXIS

    @property
    def part(self) -> int:
        """Return a number of what is changed at an axis: of two faults of one part, the end of one would end both."""
        return _at.STALE_WORD if self.code == _at.TORN_WORD else self.code

    @property
    def delayed(self) -> bool:
        """Return whether it takes an amount: a delay of frames, or a jump of the clock."""
        return self.category is FaultCategory.CLOCK or self.code in (_bus.LATE, _bus.DUPLICATED)

    @property
    def among_words(self) -> bool:
        """Return whether it can happen where PC and box exchange words and no frames."""
        return self.place is not FaultPlace.BUS and self.category is not FaultCategory.CLOCK

    @property
    def over_at_once(self) -> bool:
        """Return whether it is over as soon as it has begun."""
        return self.code in (_at.BOX_RESTART, _at.PROBE_TRIP)


class FaultKind(FaultRow, enum.Enum):
    """The classes of faults of rtec; a member is its row, its value the words.

    Examples
    --------
    >>> FaultKind("frame lost").place.value, FaultKind.GLITCHES.activated_by.name
    ('bus', 'GLITCHES')
    """

    def __new__(cls, words: str, *_: object) -> FaultKind:
        """Make a member of its row."""
        kind = object.__new__(cls)
        kind._value_ = words
        return kind

    def __repr__(self) -> str:
        return f"<FaultKind.{self.name}>"

    FRAME_LOST = "frame lost", _bus.LOST, _F.FRAMES, _A.FRAMES, "does not arrive"
    FRAME_LATE = "frame late", _bus.LATE, _F.FRAMES, _A.FRAMES, "arrives later by `delay_s`"
    FRAME_DUPLICATED = "frame duplicated", _bus.DUPLICATED, _F.FRAMES, _A.FRAMES, "comes again after `delay_s`"
    FRAMES_REORDERED = "frames reordered", _bus.REORDERED, _F.FRAMES, _A.FRAMES, "two arrive in the wrong order"
    FRAME_CORRUPTED = (
        "frame corrupted, checksum wrong", _bus.CORRUPTED, _F.FRAMES, _A.FRAMES, "a bit is wrong",
    )  # fmt: skip
    FRAME_MASQUERADE = (
        "masquerade", _bus.MASQUERADE, _F.TOTAL, _A.FRAMES, "a field is wrong, the checksum fits it",
    )  # fmt: skip
    TOTAL_BIT_FLIPPED = (
        "bit flipped in the total", _bus.FLIPPED, _F.TOTAL, _A.FRAMES, "a bit of the total, not of its inverse",
    )  # fmt: skip
    REQUEST_STUCK = "request stuck", _bus.STUCK, _F.TOTAL, _A.FRAMES, "the same frame over and over"
    BABBLING_NODE = "babbling node", _bus.BABBLING, _F.BUS, _A.FRAMES, "identifier 0 without a gap"
    BUS_OFF = "bus off", _bus.OFF, _F.BUS, _A.FRAMES, "a node neither sends nor hears"
    STALE_DATA_VALID = "stale data valid", _at.STALE_WORD, _F.WORD, _A.WORD, "an old position, said to be valid"
    TORN_POSITION = (
        "torn position word", _at.TORN_WORD, _F.WORD, _A.WORD, "the upper bytes are those of an earlier reading",
    )  # fmt: skip
    PC_KILLED = "PC killed", _at.PC_KILLED, _F.POWER, _A.BEGUN, "the PC takes no further turn"
    BOX_RESTARTED = "box restarted", _at.BOX_RESTART, _F.POWER, _A.BEGUN, "its program begins anew"
    POWER_LOST = "power lost", _at.POWER_OFF, _F.POWER, _A.BEGUN, "the box is dead; its gates pass A and B on"
    CLOCK_JUMP_FORWARD = (
        "PC clock jumps forward", _at.CLOCK_JUMP_FORWARD, _F.CLOCK, _A.BEGUN, "by `delay_s`",
    )  # fmt: skip
    CLOCK_JUMP_BACK = "PC clock jumps back", _at.CLOCK_JUMP_BACK, _F.CLOCK, _A.BEGUN, "by `delay_s`"
    CABLE_OPEN = (
        "encoder cable open", _at.CABLE, _F.ENCODER, _A.CABLE, "both inputs are pulled up",
        lambda levels, before: 3, NO_GLITCHES,
        "a monitor of the differential pairs; an index; a speed check, if it lasts",
    )  # fmt: skip
    LINES_SWAPPED = (
        "A and B swapped", _at.CABLE, _F.ENCODER, _A.CABLE, "counts go the other way",
        lambda levels, before: levels >> 1 | (levels & 1) << 1, NO_GLITCHES,
        "a speed check, at once: the counts go the other way; an index",
    )  # fmt: skip
    LINE_BROKEN = (
        "one line of a pair broken", _at.CABLE, _F.ENCODER, _A.CABLE, "A rests, B goes on",
        lambda levels, before: levels & 2 | before & 1, NO_GLITCHES,
        "a monitor of the differential pair; a speed check, if it lasts; an index",
    )  # fmt: skip
    GLITCHES = (
        "glitches", _at.GLITCHES, _F.ENCODER, _A.GLITCHES, "one edge in eight is followed by one of 300 ns",
        None, (1 / 8, 300_000),  # wide enough for the controller's filter to see
        "a narrower filter; an index",
    )  # fmt: skip
    SWITCH_THROWN = "disable switch thrown", _at.SWITCH_THROWN, _F.OPERATOR, _A.BEGUN, "corrections are forbidden"
    PROBE_TRIPPED = "probe trip", _at.PROBE_TRIP, _F.OPERATOR, _A.BEGUN, "the position is latched"


PROCESSOR_HUNG = FaultRow(
    "processor hung", _at.HUNG, _F.POWER, _A.BEGUN,
    "the box's program stands still, its outputs stay; its end is a restart",
)  # fmt: skip
LATCH_STUCK = FaultRow(
    "hold latch stuck closed", _at.LATCH, _F.BOX, _A.EDGES, "A and B rest behind it, for gates and processor",
)  # fmt: skip
INSIDE_BOX = PROCESSOR_HUNG, LATCH_STUCK
"""Of a box that is modelled, in a cell; the open path has rows of its own."""

FAULTS_OF_WORDS = tuple(kind for kind in FaultKind if kind.among_words)
"""Those that can happen where PC and box exchange words and no frames."""
