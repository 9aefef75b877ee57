"""The four insertion designs of the report, a row each: what the rest of the house asks of a design stands here."""

from __future__ import annotations

import enum
from typing import NamedTuple

from rtec.errors import ArgumentError, nearest
from rtec.injector import _design_kernels as _codes

ONE_BYTE, TWO_BYTES = 127, 32767
"""Largest totals of steps that the request's word holds: one signed byte, as the report has it; two for Design B,
whose totals it puts "in the hundreds"."""


class _Row(NamedTuple):
    code: int
    title: str
    short: str
    step_counts: int
    word_limit: int
    in_path: bool
    one_state: bool
    gate_quarters: int
    pins: int
    decide_cycles: int
    fast_ns: int


class Design(enum.Enum):
    """An insertion design (NISTIR 4832, sections "The Original RTEC" and "Alternate RTEC" A, B, C).

    Attributes
    ----------
    code
        The number that the kernels use.
    title, short
        What it is called.
    step_counts
        Counts that one insertion adds or takes; also its number of level changes.
    word_limit
        Largest total of steps that the request's word holds.
    in_path
        Whether A and B pass through the processor; else beside it, through gates that the controller powers.
    one_state
        Whether it inserts in state 1 (both lines low) only.
    gate_quarters
        Quarters of a cycle that its speed gate times: from one A&B-low signal to the next, or half a cycle.
    pins
        Bits of port 1 that it inserts with (docs/firmware.md, "Hardware map").
    decide_cycles
        Machine cycles of the 8051 from recognising the moment to the first change (`Timing.of`).
    fast_ns
        The same on fast logic, ns.

    Examples
    --------
    >>> Design.named("c").step_counts, Design.B.word_limit
    (2, 32767)
    """

    ORIGINAL = "original", _Row(
        code=_codes.ORIGINAL, title="Original RTEC", short="Original", step_counts=4, word_limit=ONE_BYTE,
        in_path=False, one_state=True, gate_quarters=4, pins=0x03, decide_cycles=4, fast_ns=100,
    )  # fmt: skip
    """Overlapping pulses OR-ed to A and B, in state 1 (both low) only."""
    A = "a", _Row(
        code=_codes.A, title="Design A", short="A", step_counts=4, word_limit=ONE_BYTE,
        in_path=False, one_state=False, gate_quarters=2, pins=0x0F, decide_cycles=8, fast_ns=100,
    )  # fmt: skip
    """A full cycle from any state, by pulses of either polarity through OR and AND."""
    B = "b", _Row(
        code=_codes.B, title="Design B", short="B", step_counts=1, word_limit=TWO_BYTES,
        in_path=True, one_state=False, gate_quarters=2, pins=0x30, decide_cycles=5, fast_ns=100,
    )  # fmt: skip
    """A and B pass through the processor, which adds single counts."""
    C = "c", _Row(
        code=_codes.C, title="Design C", short="C", step_counts=2, word_limit=ONE_BYTE,
        in_path=False, one_state=False, gate_quarters=2, pins=0x03, decide_cycles=5, fast_ns=125,
    )  # fmt: skip
    """Inverters in A and B, switched one after the other."""

    _value_: str
    code: int
    title: str
    short: str
    step_counts: int
    word_limit: int
    in_path: bool
    one_state: bool
    gate_quarters: int
    pins: int
    decide_cycles: int
    fast_ns: int

    def __new__(cls, name: str, row: _Row) -> Design:
        """Make a member of its row; its value is the name."""
        design = object.__new__(cls)
        design._value_ = name
        for field, value in row._asdict().items():
            setattr(design, field, value)
        return design

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
            raise ArgumentError("design", repr(name), ", ".join(known), nearest(name.lower(), known))
        return known[name.lower()]


BESIDE = tuple(design for design in Design if not design.in_path)
"""Designs whose lines pass beside the processor: a dead box passes A and B unchanged."""
IN_PATH = tuple(design for design in Design if design.in_path)
