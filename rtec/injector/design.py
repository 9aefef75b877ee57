"""The four insertion designs of the report."""

from __future__ import annotations

import enum

from rtec.errors import ArgumentError, nearest
from rtec.injector import _design_kernels as _codes


class Design(enum.Enum):
    """An insertion design (NISTIR 4832, sections "The Original RTEC" and "Alternate RTEC" A, B, C).

    Examples
    --------
    >>> Design.named("c").step_counts, Design.B.word_limit
    (2, 32767)
    """

    ORIGINAL = "original"
    """Overlapping pulses OR-ed to A and B, in state 1 (both low) only."""
    A = "a"
    """A full cycle from any state, by pulses of either polarity through OR and AND."""
    B = "b"
    """A and B pass through the processor, which adds single counts."""
    C = "c"
    """Inverters in A and B, switched one after the other."""

    @classmethod
    def named(cls, name: str) -> Design:
        """Return the design called ``name``.

        Raises
        ------
        ArgumentError
            An unknown name; the nearest known one is suggested.
        """
        try:
            return cls(name.lower())
        except ValueError:
            known = [design.value for design in cls]
            raise ArgumentError("design", repr(name), ", ".join(known), nearest(name.lower(), known)) from None

    @property
    def code(self) -> int:
        """Return the number that the kernels use."""
        return {
            Design.ORIGINAL: _codes.ORIGINAL,
            Design.A: _codes.A,
            Design.B: _codes.B,
            Design.C: _codes.C,
        }[self]

    @property
    def step_counts(self) -> int:
        """Return the counts that one insertion adds or takes; also its number of level changes."""
        return {Design.ORIGINAL: 4, Design.A: 4, Design.B: 1, Design.C: 2}[self]

    @property
    def word_limit(self) -> int:
        """Return the largest total of steps that the request's word holds.

        One signed byte, as the report has it; two for Design B, whose totals it puts "in the hundreds".
        """
        return 32767 if self is Design.B else 127
