"""How long the box's processor takes: named profiles, and the speed gate that follows from them."""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace

from rtec.checks import number_within, whole_within
from rtec.injector.design import DesignRow
from rtec.units import PS_PER_S

US = 1_000_000
"""Picoseconds in one microsecond: one machine cycle of a 12 MHz 8051."""
NS = 1_000
_LONGEST_PS = PS_PER_S


class Processor(enum.Enum):
    """A named timing profile."""

    MCS51 = "8051"
    """The report's 12 MHz 8051, one machine cycle a microsecond."""
    FAST = "fast"
    """Dedicated logic with steps of about 100 ns, for encoders of 500 kHz."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Times of one design on one processor, in picoseconds.

    Parameters
    ----------
    poll_ps
        The processor looks at the lines at whole multiples of this; 0 for logic that reacts at once.
    poll_offset_ps
        Time of one of these looks.
    decide_ps
        From the look that recognises the moment to the first change of the lines.
    step_ps
        Between the level changes of one insertion.
    recover_ps
        After the last change, until the processor looks again.
    latency_ps
        Design B: from reading the lines to writing them.
    rest_ps
        Without an edge for so long, the axis counts as at rest and an insertion just starts.
    gate_margin
        The speed gate refuses where an insertion, this share longer than at worst, would not end before the next
        edge of a steady motion; None switches the gate off.

    Raises
    ------
    ArgumentError
        A time outside its range.

    Examples
    --------
    The Original on the 8051: the last change comes at worst 9 µs after the transition.

    >>> from rtec.injector import Design
    >>> original = Timing.of(Design.ORIGINAL, Processor.MCS51)
    >>> original.worst_ps(Design.ORIGINAL) / 1e6
    9.0
    >>> round(original.limit_hz(Design.ORIGINAL))
    27778
    """

    poll_ps: int = 0
    poll_offset_ps: int = 0
    decide_ps: int = 100 * NS
    step_ps: int = 100 * NS
    recover_ps: int = 100 * NS
    latency_ps: int = 100 * NS
    rest_ps: int = 1000 * US
    gate_margin: float | None = 0.15

    def __post_init__(self) -> None:
        """Check the ranges."""
        whole_within("poll_ps", self.poll_ps, 0, _LONGEST_PS, unit="ps")
        whole_within("poll_offset_ps", self.poll_offset_ps, 0, max(self.poll_ps - 1, 0), unit="ps (below poll_ps)")
        for name in ("decide_ps", "step_ps", "latency_ps", "rest_ps"):
            whole_within(name, getattr(self, name), 1, _LONGEST_PS, unit="ps")
        whole_within("recover_ps", self.recover_ps, 0, _LONGEST_PS, unit="ps")
        if self.gate_margin is not None:
            number_within("gate_margin", self.gate_margin, 0.0, 100.0)

    @classmethod
    def of(cls, design: DesignRow, processor: Processor) -> Timing:
        """Return the profile of a design on a processor.

        Notes
        -----
        ``8051``, Original: the report's 4 µs from recognising A&B low to the first pulse, level changes 1 µs apart
        (2 µs pulses that overlap by half, 3 µs in all) and 2 µs after them; the looks are a two-cycle polling loop,
        so that the first pulse comes 4 to 6 µs after the edge. The other designs follow from the report's words, in
        machine cycles of 1 µs:

        * A must also find the state: reading the port, masking and a table look-up (4 cycles) more than the Original.
        * B copies the lines in a loop: read and compare (4 cycles a turn), look up and write (5), and as long again
          for an insertion.
        * C tells same from different by the exclusive OR and needs one cycle more to choose the order; it puts out
          two levels instead of four.

        ``fast`` takes 100 ns for each of these steps, 125 ns for Design C.
        """
        if processor is Processor.FAST:
            return cls(decide_ps=design.fast_ns * NS, step_ps=design.fast_ns * NS)
        slow = cls(poll_ps=2 * US, step_ps=1 * US, recover_ps=2 * US, decide_ps=design.decide_cycles * US)
        return replace(slow, poll_ps=4 * US, latency_ps=5 * US) if design.in_path else slow

    def worst_ps(self, design: DesignRow) -> int:
        """Return the time from a real transition to the last change of the insertion after it, at worst."""
        copying_ps = self.latency_ps if design.in_path else 0
        return self.poll_ps + copying_ps + self.decide_ps + (design.step_counts - 1) * self.step_ps

    def limit_hz(self, design: DesignRow) -> float:
        """Return the encoder frequency at which the worst insertion just ends with the next edge."""
        return PS_PER_S / (4 * self.worst_ps(design))

    def gate_ps(self, design: DesignRow) -> int:
        """Return the least interval that the gate lets through; 0 where there is no gate.

        The Original times one whole cycle (from one A&B-low signal to the next), the others half a cycle (the period
        of the exclusive OR).
        """
        if self.gate_margin is None:
            return 0
        return round(design.gate_quarters * self.worst_ps(design) * (1.0 + self.gate_margin))
