"""Slow, readable counterparts of parts of the closed loop, in plain Python: the play, and the servo without a box.

``play`` follows a densely sampled path of the encoder's position with a true position that lies between two curves.
``servo_path`` integrates the position loop tick by tick, the encoder being a rounding to whole counts.
"""

import math


def play(path_mm, low, high, start_mm=0.0):
    """Return the true position after each point of ``path_mm``.

    ``low`` and ``high`` give the true position that the axis has when it is pushed forward or backward to a place.
    It stays where it is as long as it lies between the two.
    """
    true_mm = start_mm
    out = []
    for x_mm in path_mm:
        if true_mm < low(x_mm):
            true_mm = low(x_mm)
        elif true_mm > high(x_mm):
            true_mm = high(x_mm)
        out.append(true_mm)
    return out


def servo_path(commands, *, period_s, gain_per_s, lag_s, feedforward=0.0, deadband=0.5, standstill=0.01):
    """Return the positions at each tick of an axis that is given ``commands``: positions and speeds, counts.

    The loop multiplies its following error, of whole counts, by the gain; the drive gains of the velocity it lacks
    the share that a first-order lag gains in one period, at constant acceleration.
    """
    share = 1.0 - math.exp(-period_s / lag_s) if lag_s > 0 else 1.0
    x = v = 0.0
    path = []
    for command, speed in commands:
        path.append(x)
        error = command - math.floor(x + 0.5)
        wanted = feedforward * speed + (gain_per_s * error if abs(error) > deadband else 0.0)
        if wanted == 0.0 and abs(v) < standstill:
            v = 0.0
            continue
        a = (wanted - v) * share / period_s
        x += v * period_s + a * period_s**2 / 2
        v += a * period_s
    return path
