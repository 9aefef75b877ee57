"""A screw that turns harder once a turn: the servo gives way, less at high speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rtec.effects._ladders import ladder
from rtec.effects._loop import FASTEST_S, INSIDE, ROOM, SLOWEST_S, STEP, LoopShape, OncePerTurn, loop_of
from rtec.effects.conditions import Conditions, Floats
from rtec.effects.protocol import Card, Quantity, Shape, Tunable, own_shape, parameter

HALF = 2.0
"""Times that the integral of a velocity loop is faster than the position loop, where the scan begins."""


@dataclass(frozen=True, slots=True)
class RippleShape(LoopShape):
    """Also, the integral time of the velocity loop."""

    integral: float = field(default=0.01, metadata=parameter(Quantity.CLOCK, "integral time of the velocity loop"))


class TorqueRipple(OncePerTurn):
    """A torque once a turn of the screw, in the deviation of its drive.

    Notes
    -----
    ``deviation = amplitude G(s) sin(2 pi x / period + phase)`` with ``G`` in proportion to
    ``s / ((s + 1 / integral) (s² + a s + kv a))``, the answer of the loops to a force, and 1 where it is largest. At
    creep the integral holds against the torque, at high speed the masses do.

    Examples
    --------
    >>> from rtec.effects.conditions import Conditions
    >>> t, run = np.arange(4000) * 1e-3, np.ones(4000, dtype=np.int64)
    >>> def left(speed):
    ...     c = Conditions(position=speed * t, position_unit="mm", run=run, time_s=t, moving=True)
    ...     found = TorqueRipple().contribution(c, RippleShape(10.0, 0.02, 1 / 754, 0.01), [0.001, 0.0])
    ...     return round(float(np.abs(found[3000:]).max()), 4)
    >>> left(5.0), left(100.0), left(1000.0)
    (0.0001, 0.001, 0.0002)
    """

    name = "torque_ripple"
    shape_type = RippleShape
    card = Card(
        title="Torque ripple once a turn",
        formula="`amplitude · sin(2π x/period + phase)`, through `s / ((s + 1/integral) (s² + a s + kv a))`",
        needs="a log in motion at several speeds, the travel of a turn of the screw",
        plot=(
            "The following error swings once a turn of the screw: most at a middle speed, less at creep and at high "
            "speed."
        ),
        cause="A screw that turns harder once a turn: bent, out of line, or preloaded unevenly; a motor's ripple.",
        consequence="Waves once a turn on the contour at middle feeds.",
        action="Align the screw; a table of currents over the angle in the drive; more gain of the velocity loop.",
        invariant_to="the place of the encoder: a rotary one and a linear scale both see it.",
        source="Erwinski et al. (2016), section II, read as a torque: the loops' equations.",
    )

    def shapes(self, conditions: Conditions) -> Sequence[LoopShape]:
        """Return gains of the position loop, at the travel of a turn that is stated."""
        pitch = conditions.screw_pitch
        if pitch is None:
            return ()
        loops = ladder(FASTEST_S, SLOWEST_S, STEP)
        return [RippleShape(pitch, loop, loop / INSIDE, loop / HALF) for loop in loops]

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        slow = own_shape(shape, RippleShape).integral
        return (*super().tunables(conditions, shape), Tunable("integral", slow / ROOM, slow * ROOM))

    def filter(self, shape: LoopShape) -> tuple[Floats, Floats]:
        """Return the loops' answer to a force, 1 where it is largest."""
        below: Floats = np.asarray(np.polymul([1.0, 1.0 / own_shape(shape, RippleShape).integral], loop_of(shape)))
        turns = 1j * np.geomspace(0.01 / shape.position_loop, 10.0 / shape.velocity_loop, 400)
        largest = float(np.abs(turns / np.polyval(below, turns)).max())
        return np.array([1.0 / largest, 0.0]), below
