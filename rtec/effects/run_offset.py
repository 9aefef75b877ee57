"""A zero of its own for each run: what is set anew, or has moved, between one run and the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Card, Effect, Over, Quantity, Shape, Units, own_shape, parameter

MOST_RUNS = 40
"""Runs, at most, that may each have a zero of their own: with more, such a zero is one more kind of slow noise."""


@dataclass(frozen=True, slots=True)
class RunShape(Shape):
    """Which runs there are; the first is the one from which the others differ."""

    runs: tuple[int, ...] = field(default=(), metadata=parameter(Quantity.COUNT, "runs"))


class RunOffset(Effect):
    """A constant for each run.

    Notes
    -----
    ``deviation = zero of the run less that of the first``.

    Examples
    --------
    >>> c = Conditions(position=np.zeros(3), position_unit="mm", run=np.array([1, 2, 3]))
    >>> RunOffset().contribution(c, RunShape((1, 2, 3)), [0.004, -0.002]).tolist()
    [0.0, 0.004, -0.002]
    """

    name = "run_offset"
    over = Over.RUN
    shape_type = RunShape
    in_time = True
    card = Card(
        title="Offset of each run",
        formula="`run_k` in run k, 0 in the first",
        needs="several runs, 40 at most",
        plot="The curves of the runs are parallel, shifted by amounts without an order.",
        cause="Something is set anew before each run: instrument zero, homing switch, clamping of part or reflector.",
        consequence="Each set-up has a zero of its own.",
        action="Home on the index mark, check clamping and instrument zero, reference the part after each set-up.",
        invariant_to="position, direction, feed, and time within a run.",
        source="ISO 230-2, clause 4: the zero of a run is free and no repeatability of the axis.",
    )

    def untestable(self, conditions: Conditions) -> str | None:
        count = np.unique(conditions.run).size
        if count == 1:
            return "one run only"
        return None if count <= MOST_RUNS else f"{count} runs: at most {MOST_RUNS}, more are one more kind of noise"

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        return [RunShape(tuple(np.unique(conditions.run).tolist()))]

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return 1 in each run but the first, and 0 in the others, shape (rows, runs - 1)."""
        others = np.array(own_shape(shape, RunShape).runs[1:])
        found: Floats = (conditions.run[:, None] == others).astype(np.float64)
        return found

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        return tuple(Amplitude(f"run_{run}", *units.shown) for run in own_shape(shape, RunShape).runs[1:])
