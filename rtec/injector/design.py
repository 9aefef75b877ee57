"""The four insertion designs of the report, a row each: what the rest of the house asks of a design stands here."""

from __future__ import annotations

import enum
from dataclasses import dataclass, fields

from rtec.errors import ArgumentError, unknown

ONE_BYTE, TWO_BYTES = 127, 32767
"""Largest totals of steps that the request's word holds: one signed byte, as the report has it; two for Design B,
whose totals it puts "in the hundreds"."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignRow:
    """What is known of an insertion design.

    Those of the report are the members of `Design`. Another one is a row of one's own, which boxes, machines, cells
    and boards take as well.

    Parameters
    ----------
    key
        What it is called in commands and files.
    title, short
        What it is called on pages.
    step_counts
        Counts that one insertion adds or takes; also its number of level changes.
    word_limit
        Largest total of steps that the request's word holds.
    in_path
        Whether A and B pass through the processor; else beside it, through gates that the controller powers.
    inverts
        Whether the gates invert a line; else they force it by OR and AND, for as long as the insertion lasts.
    one_state
        Whether it inserts in state 1 (both lines low) only, and its speed gate times from there to there.
    pins
        Bits of port 1 that it inserts with (docs/firmware.md, "Hardware map").
    decide_cycles
        Machine cycles of the 8051 from recognising the moment to the first change (`Timing.of`).
    fast_ns
        The same on fast logic, ns.

    Raises
    ------
    ArgumentError
        Pulses that end elsewhere than they began: the counts would be taken back with them.

    Examples
    --------
    Inverters could as well make a full cycle:

    >>> cycle = DesignRow(key="c4", title="Full cycle by inverters", short="C4", step_counts=4, inverts=True,
    ...                   pins=0x03, decide_cycles=5, fast_ns=125)
    >>> cycle.gate_quarters, cycle.word_limit
    (2, 127)
    """

    key: str
    title: str
    short: str
    step_counts: int
    word_limit: int = ONE_BYTE
    in_path: bool = False
    inverts: bool = False
    one_state: bool = False
    pins: int
    decide_cycles: int
    fast_ns: int

    def __post_init__(self) -> None:
        """Check that the gates can make the step."""
        whole_turns = self.in_path or self.step_counts % (2 if self.inverts else 4) == 0
        if self.step_counts < 1 or not whole_turns:
            allowed = "1 or more in the lines, an even number by inverters, whole cycles of 4 by pulses"
            raise ArgumentError("step_counts", self.step_counts, allowed)

    @property
    def gate_quarters(self) -> int:
        """Return what its speed gate times, in quarters of a cycle: from one A&B-low signal to the next, or half."""
        return 4 if self.one_state else 2


class Design(DesignRow, enum.Enum):
    """An insertion design (Yee 1992, sections "The Original RTEC" and "Alternate RTEC" A, B, C).

    Examples
    --------
    >>> Design.named("c").step_counts, Design.B.word_limit
    (2, 32767)
    """

    ORIGINAL = DesignRow(
        key="original", title="Original RTEC", short="Original", step_counts=4, one_state=True, pins=0x03,
        decide_cycles=4, fast_ns=100,
    )  # fmt: skip
    """Overlapping pulses OR-ed to A and B, in state 1 (both low) only."""
    A = DesignRow(
        key="a", title="Design A", short="A", step_counts=4, pins=0x0F, decide_cycles=8, fast_ns=100,
    )  # fmt: skip
    """A full cycle from any state, by pulses of either polarity through OR and AND."""
    B = DesignRow(
        key="b", title="Design B", short="B", step_counts=1, word_limit=TWO_BYTES, in_path=True, pins=0x30,
        decide_cycles=5, fast_ns=100,
    )  # fmt: skip
    """A and B pass through the processor, which adds single counts."""
    C = DesignRow(
        key="c", title="Design C", short="C", step_counts=2, inverts=True, pins=0x03, decide_cycles=5, fast_ns=125,
    )  # fmt: skip
    """Inverters in A and B, switched one after the other."""

    def __new__(cls, row: DesignRow) -> Design:
        """Make a member of its row; its value is what it is called in commands and files."""
        design = object.__new__(cls)
        design._value_ = row.key
        for field in fields(row):
            object.__setattr__(design, field.name, getattr(row, field.name))
        return design

    def __init__(self, row: DesignRow) -> None:
        """Change nothing: the fields are those of the row."""

    def __repr__(self) -> str:
        return f"<Design.{self.name}>"

    @classmethod
    def named(cls, name: str) -> Design:
        """Return the design called ``name``.

        Raises
        ------
        ArgumentError
            An unknown name; the nearest known one is suggested.
        """
        known = {design.value: design for design in cls}
        if name.lower() not in known:
            raise unknown("design", name, known, noun="design")
        return known[name.lower()]


BESIDE = tuple(design for design in Design if not design.in_path)
"""Designs whose lines pass beside the processor: a dead box passes A and B unchanged."""
IN_PATH = tuple(design for design in Design if design.in_path)
