"""Compiled feed drives as plants of the closed loop: one control period, from what the controller has counted.

A plant's state begins with what is asked of it (`rtec.axis.plant`): how far the carriage is beyond what the encoder
sees, and its outputs. The position loop is the machine's; velocity and current loop are the drive's.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rtec._jit import fused_kernel, fused_step
from rtec.axis._plant_kernels import COUNTED, FEED_ACCELERATION, PERIOD, POSITION, VELOCITY, WANTED
from rtec.axis.plants._drive_kernels import (
    CONTROL,
    ELEMENTS,
    FRICTION_SIZE,
    MOTOR,
    SCREW,
    current_for,
    friction,
    in_table,
    move_ball_screw,
    move_linear_motor,
)

FloatArray = npt.NDArray[np.float64]
BEYOND, LOAD, SPEED, CURRENT, FRICTION_N, OWN = 0, 1, 2, 3, 4, 5
"""Places in the state: mm, mm, mm/s, A, N; then what only the drive reads."""
LOOPS = CONTROL.itemsize // 8
STEPS = 0
"""Place in the numbers of the steps in a period; then the drive's own."""
_MOTOR_END = 1 + MOTOR.itemsize // 8
_SCREW_END = 1 + SCREW.itemsize // 8
_TURN = 2.0 * math.pi


@fused_step
def put(state: FloatArray, load: float, speed: float, current: float, friction_n: float) -> None:
    """Write the outputs, as they are when the period begins."""
    state[LOAD], state[SPEED], state[CURRENT], state[FRICTION_N] = load, speed, current, friction_n


@fused_step
def towards(inputs: FloatArray, x: float, v: float, later: float) -> float:
    """Return the acceleration that holds for a tick and leads the encoder along the drive's own motion.

    In two ticks it takes away what position and speed are off: both eigenvalues are zero.
    """
    period = inputs[PERIOD]
    off, slip = inputs[POSITION] - x, inputs[VELOCITY] - v
    return float((later - v - off / period - 1.5 * slip) / period)


@fused_kernel
def linear_motor(numbers: FloatArray, inputs: FloatArray, state: FloatArray) -> float:
    """Move a linear motor by one period; numbers are steps, motor, friction, map.

    The state is that of the carriage, its speed, A, loops, memory.
    """
    m = numbers[1:_MOTOR_END].view(MOTOR)[0]
    f = numbers[_MOTOR_END : _MOTOR_END + FRICTION_SIZE]
    own = state[OWN:]
    c = own[3 : 3 + LOOPS].view(CONTROL)[0]
    held = own[3 + LOOPS :]
    x, v, current = own[0], own[1], own[2]
    put(state, x, v, current, friction(f, held, 0.0, v))
    asked = current_for(c, inputs[WANTED], inputs[FEED_ACCELERATION], inputs[COUNTED])
    asked += in_table(numbers[_MOTOR_END + FRICTION_SIZE :], m.per_mm * inputs[COUNTED] / _TURN)
    own[0], own[1], own[2] = move_linear_motor(m, c, f, held, x, v, current, asked, int(numbers[STEPS]))
    return towards(inputs, x, v, own[1])


@fused_kernel
def ball_screw(numbers: FloatArray, inputs: FloatArray, state: FloatArray) -> float:
    """Move a ball screw by one period; numbers are steps, screw, friction of both ends.

    The state is that of motor and carriage, their speeds, A, loops, memory of both ends.
    """
    s = numbers[1:_SCREW_END].view(SCREW)[0]
    f = numbers[_SCREW_END : _SCREW_END + 2 * FRICTION_SIZE].reshape((2, FRICTION_SIZE))
    own = state[OWN:]
    c = own[5 : 5 + LOOPS].view(CONTROL)[0]
    held = own[5 + LOOPS : 5 + LOOPS + 2 * ELEMENTS].reshape((2, ELEMENTS))
    q, x, p, v, current = own[0], own[1], own[2], own[3], own[4]
    put(state, x, v, current, friction(f[0], held[0], 0.0, p) + friction(f[1], held[1], 0.0, v))
    motor = q if s.scale > 0.0 else inputs[COUNTED]
    asked = current_for(c, inputs[WANTED], inputs[FEED_ACCELERATION], motor)
    own[0], own[1], own[2], own[3], own[4] = move_ball_screw(
        s, c, f, held, q, x, p, v, current, asked, int(numbers[STEPS])
    )
    if s.scale > 0.0:
        return towards(inputs, x, v, own[3])
    state[BEYOND] = x - q
    return towards(inputs, q, p, own[2])
