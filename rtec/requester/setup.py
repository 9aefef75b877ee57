"""Setup of a box or a PC: what must be equal at both, otherwise corrections are wrong by the ratio of their steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from rtec.checks import number_within, whole_within
from rtec.injector import Design
from rtec.link._frame_kernels import design_cycle_step
from rtec.units import PS_PER_S

OTHER_DESIGN = 15
"""In the message: a design that is not one of the report's."""

_PS_PER_US = 10**6
_STEPS_PER_MM = 10**7
"""Unit of a step in the message: 0.1 nm."""
_LARGEST_STEP = (1 << 24) - 1
_NUMBERS = {design.key: number for number, design in enumerate(Design)}
_STEP_COUNTS = {design.key: design.step_counts for design in Design}
_KEYS = {number: key for key, number in _NUMBERS.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """Design, step and cycle of a box, or those that a PC expects.

    Raises
    ------
    ArgumentError
        A step or a cycle that no machine has.

    Notes
    -----
    The message holds the cycle in µs and the step in 0.1 nm, up to 1.6777215 mm; a longer step counts as that one.

    Examples
    --------
    >>> box = Setup(design="a", step_mm=0.004, cycle_ps=10**10)
    >>> pc = Setup(design="c", step_mm=0.002, cycle_ps=10**10)
    >>> str(box), Setup.of_word(box.word) == box
    ('design a, step 4 µm, cycle 10 ms', True)
    >>> box.options_that_differ(pc)
    '--design'
    """

    design: str
    """What the design is called in commands; any other word is a design of one's own."""
    step_mm: float
    """Travel of one step: counts of the design times the travel of a count."""
    cycle_ps: int
    """Between two frames of one kind, on the clock of the bus."""

    def __post_init__(self) -> None:
        number_within("step_mm", self.step_mm, 0.0, 1e9, unit="mm")
        whole_within("cycle_ps", self.cycle_ps, 1, PS_PER_S, unit="ps")

    @property
    def word(self) -> int:
        """Return the word that the message carries."""
        step = min(round(self.step_mm * _STEPS_PER_MM), _LARGEST_STEP)
        number = _NUMBERS.get(self.design, OTHER_DESIGN)
        return int(design_cycle_step(number, round(self.cycle_ps / _PS_PER_US), step))

    @classmethod
    def of_word(cls, word: int) -> Self | None:
        """Return the setup in a message; None for a message that was never received or is not valid."""
        cycle_us = word >> 4 & 0xFFFFF
        if not 0 < cycle_us <= 10**6:
            return None
        design = _KEYS.get(word & 0xF, "of its own")
        return cls(design=design, step_mm=(word >> 24) / _STEPS_PER_MM, cycle_ps=cycle_us * _PS_PER_US)

    def options_that_differ(self, other: Setup) -> str:
        """Return the options that make two commands agree; empty where they agree.

        A step differs by its design or, where that is the same, by the travel of a count.
        """
        found = ["--design"] * (self.design != other.design)
        counts = [_STEP_COUNTS.get(side.design) for side in (self, other)]
        steps = [self.step_mm, other.step_mm]
        if None not in counts:
            steps = [step / (count or 1) for step, count in zip(steps, counts, strict=True)]
        if not math.isclose(*steps, rel_tol=1e-3):
            found.append("--count")
        if self.cycle_ps != other.cycle_ps:
            found.append("--cycle")
        return " and ".join([", ".join(found[:-1]), found[-1]] if len(found) > 1 else found)

    def __str__(self) -> str:
        return f"design {self.design}, step {self.step_mm * 1000:.6g} µm, cycle {self.cycle_ps / 1e9:g} ms"
