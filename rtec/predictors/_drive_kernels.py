"""A drive under its position controller, integrated over the samples of a log.

Numbers of a drive, all per unit of mass, in the unit of position (mm or degrees): ``stiffness`` 1/s², ``damping``
1/s, ``velocity_forward`` 1/s, ``acceleration_forward``, ``coulomb`` and ``width`` of its rounded sign (unit/s² and
unit/s), ``offset`` unit/s², ``asymmetry`` 1/s.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rtec._jit import fused_kernel, fused_step
from rtec.predictors._columns import Floats

STIFFNESS, DAMPING, VELOCITY_FORWARD, ACCELERATION_FORWARD, COULOMB, WIDTH, OFFSET, ASYMMETRY = range(8)
LAGS = 3
"""Samples of a run that tell where the drive is and how fast it goes."""
_STEPS = 4
_LOST = 1e9
"""In the unit of position: a drive so far from its command has diverged."""


@fused_step
def _pull(number: Floats, error: float, speed: float, velocity: float, acceleration: float, push: float) -> float:
    """Return the acceleration of the drive."""
    loop = number[STIFFNESS] * error - number[DAMPING] * speed
    forward = number[VELOCITY_FORWARD] * velocity + number[ACCELERATION_FORWARD] * acceleration
    friction = number[COULOMB] * math.tanh(speed / number[WIDTH]) + number[OFFSET] + number[ASYMMETRY] * abs(speed)
    pull: float = loop + forward - friction + push
    return pull


@fused_kernel
def follow(
    runs: npt.NDArray[np.int64],
    number: Floats,
    velocity: Floats,
    acceleration: Floats,
    push: Floats,
    period_s: float,
    error: Floats,
) -> None:
    """Write the following error of each run behind its first LAGS samples, which tell the state to begin with.

    Between samples velocity and acceleration of the command are straight lines, and ``push``, an acceleration by
    whatever else acts, stays. Four steps of Runge and Kutta a sample. What diverges is not a number from there on.
    """
    h = period_s / _STEPS
    for run in range(runs.shape[0]):
        first, end = runs[run, 0], runs[run, 1]
        if end - first <= LAGS:
            continue
        e = error[first + 1]
        speed = velocity[first + 1] - (error[first + 2] - error[first]) / (2.0 * period_s)
        for i in range(first + 1, end - 1):
            slope = (velocity[i + 1] - velocity[i]) / _STEPS
            bend = (acceleration[i + 1] - acceleration[i]) / _STEPS
            for step in range(_STEPS):
                v0, a0 = velocity[i] + step * slope, acceleration[i] + step * bend
                v1, a1 = v0 + 0.5 * slope, a0 + 0.5 * bend
                v2, a2 = v0 + slope, a0 + bend
                p0 = _pull(number, e, speed, v0, a0, push[i])
                e0 = v0 - speed
                s1 = speed + 0.5 * h * p0
                p1 = _pull(number, e + 0.5 * h * e0, s1, v1, a1, push[i])
                s2 = speed + 0.5 * h * p1
                p2 = _pull(number, e + 0.5 * h * (v1 - s1), s2, v1, a1, push[i])
                s3 = speed + h * p2
                p3 = _pull(number, e + h * (v1 - s2), s3, v2, a2, push[i])
                e += h / 6.0 * (e0 + 2.0 * (v1 - s1) + 2.0 * (v1 - s2) + v2 - s3)
                speed += h / 6.0 * (p0 + 2.0 * p1 + 2.0 * p2 + p3)
            if not abs(e) < _LOST:
                error[max(i + 1, first + LAGS) : end] = np.nan
                break
            if i + 1 >= first + LAGS:
                error[i + 1] = e
