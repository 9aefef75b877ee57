"""A nut that runs ahead and behind once a turn, seen by a linear scale and answered by the position loop."""

from __future__ import annotations

import numpy as np

from rtec.effects._loop import LoopShape, OncePerTurn, loop_of
from rtec.effects.conditions import Floats
from rtec.effects.protocol import Card


class ScrewRunout(OncePerTurn):
    """Runout of a ball screw in the deviation of a drive with a linear scale.

    Notes
    -----
    The nut is off by ``d = amplitude sin(2 pi x / period + phase)``. The loop with the gain kv holds the scale's
    reading as fast as it can: ``deviation = d s (s + a) / (s² + a s + kv a)``, where the velocity loop inside
    answers by ``a / (s + a)``. At creep nothing is left of the runout; above the speed
    ``kv period / (2 pi)`` all of it is.

    Examples
    --------
    A turn in 1/30 s, 188 rad/s, before a loop of 50 1/s: all of it is left, and a little overshoot.

    >>> from rtec.effects.conditions import Conditions
    >>> t = np.arange(2000) * 1e-3
    >>> run = np.ones(2000, dtype=np.int64)
    >>> c = Conditions(position=300.0 * t, position_unit="mm", run=run, time_s=t, moving=True)
    >>> left = ScrewRunout().contribution(c, LoopShape(10.0, 0.02, 1 / 754), [0.003, 0.0])
    >>> round(float(np.abs(left[1000:]).max()), 4)
    0.0031
    """

    name = "screw_runout"
    card = Card(
        title="Runout of the ball screw",
        formula="`amplitude · sin(2π x/period + phase)`, through `s (s + a) / (s² + a s + kv a)`",
        needs="a log in motion at several speeds, the travel of a turn of the screw",
        plot=(
            "The following error of a loop with a linear scale swings once a turn of the screw; at creep hardly, "
            "above the bandwidth of the position loop by the whole runout."
        ),
        cause="A bent or eccentric screw, a nut out of square, an end bearing out of line.",
        consequence="Waves once a turn on the contour at high feeds; at creep the loop takes them away.",
        action=(
            "Straighten or align the screw and its bearings; a table of corrections by position in the command; a "
            "higher gain of the position loop."
        ),
        invariant_to="the load; a rotary encoder on the motor does not see it.",
        source="Erwinski et al. (2016), section II: the main source of mismatch is ball-screw runout.",
    )

    def filter(self, shape: LoopShape) -> tuple[Floats, Floats]:
        """Return ``s (s + a)`` over the loop's ``s² + a s + kv a``."""
        return np.array([1.0, 1.0 / shape.velocity_loop, 0.0]), loop_of(shape)
