"""What a position loop with a linear scale leaves of something that comes back with each turn of its screw."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects._harmonics import harmonic_names, harmonic_summary
from rtec.effects._ladders import ladder
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Amplitude, Effect, Quantity, Shape, Tunable, Units, own_shape, parameter

FASTEST_S, SLOWEST_S = 0.004, 0.1
"""1/kv of position loops: kv from 10 to 250 1/s."""
STEP = 1.5
INSIDE = 12.0
"""Times that a velocity loop is faster than the position loop around it, where the scan begins."""
ROOM = 4.0
"""Either way, that the time constant of an inner loop may be moved."""
PERIOD_ROOM = 0.005
FEWEST_TURNS = 3.0
MOST_SAMPLES = 5_000_000


@dataclass(frozen=True, slots=True)
class LoopShape(Shape):
    """Period, and the time constants of the loops: 1/kv, and that of the velocity loop inside."""

    period: float = field(default=1.0, metadata=parameter(Quantity.POSITION, "travel of a turn"))
    position_loop: float = field(default=0.02, metadata=parameter(Quantity.CLOCK, "1/kv of the position loop"))
    velocity_loop: float = field(
        default=0.002, metadata=parameter(Quantity.CLOCK, "time constant of the velocity loop")
    )


class OncePerTurn(Effect):
    """A disturbance once a turn of the screw, as the position loop answers it: a filter in time."""

    shape_type: type[LoopShape] = LoopShape

    def untestable(self, conditions: Conditions) -> str | None:
        if not conditions.moving or conditions.time_s is None or conditions.time_is_coordinate:
            return "no log in motion with positions and a time"
        pitch = conditions.screw_pitch
        if pitch is None:
            return "the travel of a turn of the screw is not stated"
        return None if conditions.span >= FEWEST_TURNS * pitch else f"fewer than {FEWEST_TURNS:g} turns of the screw"

    def shapes(self, conditions: Conditions) -> Sequence[LoopShape]:
        """Return gains of the position loop, at the travel of a turn that is stated."""
        pitch = conditions.screw_pitch
        if pitch is None:
            return ()
        return [self.shape_type(pitch, loop, loop / INSIDE) for loop in ladder(FASTEST_S, SLOWEST_S, STEP)]

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        own = own_shape(shape, self.shape_type)
        fast = own.velocity_loop
        return (
            Tunable("period", own.period * (1.0 - PERIOD_ROOM), own.period * (1.0 + PERIOD_ROOM)),
            Tunable("position_loop", own.position_loop / STEP, own.position_loop * STEP),
            Tunable("velocity_loop", fast / ROOM, min(fast * ROOM, own.position_loop / 2.0)),
        )

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return sine and cosine of the turn behind the loop, shape (rows, 2)."""
        own = own_shape(shape, self.shape_type)
        return filtered_turn(conditions, own.period, *self.filter(own))

    def filter(self, shape: LoopShape) -> tuple[Floats, Floats]:
        """Return numerator and denominator of the loop's answer, highest power of s first."""
        raise NotImplementedError

    def amplitudes(self, shape: Shape, units: Units) -> tuple[Amplitude, ...]:
        return harmonic_names(1, units)

    def summary(self, shape: Shape, amplitudes: Sequence[float], units: Units) -> tuple[tuple[str, float, str], ...]:
        """Return the shape's numbers, amplitude and phase."""
        own = super().summary(shape, amplitudes, units)[: -len(amplitudes)]
        return (*own, *harmonic_summary(amplitudes, units)[:2])


def loop_of(shape: LoopShape) -> Floats:
    """Return ``s² + a s + kv a`` of a position loop kv around a velocity loop a, highest power first."""
    inner = 1.0 / shape.velocity_loop
    return np.array([1.0, inner, inner / shape.position_loop])


def filtered_turn(conditions: Conditions, period: float, numerator: Floats, denominator: Floats) -> Floats:
    """Return sine and cosine of the position's turn through a filter in time, shape (rows, 2).

    Each stretch of motion begins at rest. The filter runs along the whole way on an even grid of times (bilinear
    transform), between rows that are missing by straight lines.
    """
    from scipy.signal import bilinear, lfilter  # noqa: PLC0415 - 0.5 s, for moving logs only

    whole, rows = conditions.path
    time_s = whole.clock
    found = np.zeros((2, whole.rows))
    begins = np.append(np.flatnonzero(whole.motion_begins), whole.rows)
    steps = np.diff(time_s)
    step_s = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 1.0
    b, a = bilinear(numerator, denominator, fs=1.0 / step_s)
    for begin, end in itertools.pairwise(begins.tolist()):
        at = time_s[begin:end]
        samples = min(int((at[-1] - at[0]) / step_s) + 2, MOST_SAMPLES)
        grid = at[0] + step_s * np.arange(samples)
        angle = (2.0 * np.pi / period) * np.interp(grid, at, whole.position[begin:end])
        waves = np.stack([np.sin(angle), np.cos(angle)])
        answer = lfilter(b, a, waves - waves[:, :1])
        found[:, begin:end] = [np.interp(at, grid, one) for one in answer]
    result: Floats = found[:, rows].T
    return result
