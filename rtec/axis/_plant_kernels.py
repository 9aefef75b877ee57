"""Compiled plants: what the position loop moves, where that is more than a rigid axis behind a lag.

A plant is one compiled function ``(numbers, inputs, state) -> acceleration`` in mm/s², called by its address, like a
model of the axis' error (`rtec.predictors._kernels`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from rtec._jit import Record, kernel, step
from rtec.units._time_kernels import PS_PER_S

WANTED, VELOCITY, POSITION, PERIOD, TIME, COUNTED, FEED_ACCELERATION = 0, 1, 2, 3, 4, 5, 6
"""Places of its inputs: mm/s, mm/s, mm, s, s, mm, mm/s²."""
INPUTS = 7
MOST_STATE = 32
FASTEST_MM_S2 = 1e9
"""Of an acceleration: beyond, the plant has no answer."""


@kernel
def no_plant(
    numbers: npt.NDArray[np.float64], inputs: npt.NDArray[np.float64], state: npt.NDArray[np.float64]
) -> float:
    """Stand in the place of a plant where the axis is rigid; it is never asked."""
    return 0.0


@step
def driven(servo: Record, wanted: float, counted: float, speed: float, plant: Any, place: int) -> float:
    """Return the acceleration of a plant in counts/s², asked for a velocity in counts/s; note where its slide is.

    ``counted`` is what the controller has counted, ``speed`` that of the command, both in counts of the encoder.
    ``plant`` is the function with its numbers, room for its inputs, and a state for each ``place`` at which it is.
    One that has no answer has failed: nothing moves any more.
    """
    function, numbers, inputs, states = plant
    state = states[place]
    inputs[WANTED] = wanted * servo.count_mm
    inputs[VELOCITY] = servo.v * servo.count_mm
    inputs[POSITION] = servo.x * servo.count_mm
    inputs[PERIOD] = servo.period_s
    inputs[TIME] = servo.now_ps / PS_PER_S
    inputs[COUNTED] = counted * servo.count_mm
    inputs[FEED_ACCELERATION] = (speed - servo.command_speed) * servo.count_mm / servo.period_s
    servo.command_speed = speed
    acceleration_mm_s2 = function(numbers, inputs, state)
    if not (abs(acceleration_mm_s2) < FASTEST_MM_S2 and abs(state[0]) < FASTEST_MM_S2):
        servo.failed = 1
        servo.v = 0.0
        return 0.0
    servo.beyond_mm = state[0]
    return float(acceleration_mm_s2 / servo.count_mm)
