"""Compiled feed drives: friction with memory, cascade control, and the motion of one and of two masses.

Units are mm, s and N, so a mass is in N s²/mm (a thousandth of a kilogram) and stiffness in N/mm.

Friction is a row of numbers; its memory is the force of each Maxwell element. An element is a spring in series with a
slider: it carries ``held + stiffness * moved``, but no more than its share of what the sliders hold at this speed.
Within a step this is a function of position and velocity alone, so a step is an ordinary one of Runge and Kutta; the
memory is brought up to date at its end.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rtec._jit import Record, fused_kernel, fused_step, helper

ELEMENTS = 4
COULOMB, EXCESS, PER_STRIBECK, VISCOUS, PER_FADE, SHARE, STIFFNESS = 0, 1, 2, 3, 4, 5, 5 + ELEMENTS
"""Places in a row of friction: N, N, s/mm, N s/mm, s/mm, then share of the bound and N/mm of each element."""
FRICTION_SIZE = STIFFNESS + ELEMENTS
GONE = 6.0
"""Multiple of the Stribeck speed beyond which its friction is below the last digit."""
FINE = 8
"""Steps of a control period in which friction or play may change its regime."""
SLIDING = 1.0 - 1e-4
"""Share of the bound above which all elements count as sliding."""
RELEASE = 0.1
"""Share of what the limit cuts off that the integral gives up in a period: without a jump, so that steps converge."""
LOAD, ENCODER, SPEED, CURRENT, FRICTION_N = 0, 1, 2, 3, 4
OUTPUTS = 5

FloatArray = npt.NDArray[np.float64]
CONTROL = np.dtype(
    [(name, np.float64) for name in (
        "period_s", "position_gain", "velocity_feedforward", "acceleration_a", "velocity_gain", "integral_share",
        "filter_share", "limit_a", "lag_s", "integral_a", "speed", "last_mm", "open_loop",
    )], align=True)  # fmt: skip
"""The cascade: gains in 1/s, A s²/mm, A s/mm; then its state, and whether commands are currents."""
MOTOR = np.dtype([(name, np.float64) for name in ("per_mass", "n_per_a", "per_mm", "phase", "cogging_n")], align=True)
SCREW = np.dtype(
    [(name, np.float64) for name in (
        "per_motor", "per_carriage", "n_per_a", "stiffness", "damping", "half_play", "per_mm", "phase",
        "runout_mm", "ripple_n", "scale",
    )], align=True)  # fmt: skip


def new_outputs(commands: FloatArray, every: int) -> FloatArray:
    """Return room for what is recorded, shape (outputs, samples)."""
    return np.empty((OUTPUTS, (commands.shape[1] - 1) // every + 1))


def new_memory(ends: int) -> FloatArray:
    """Return the memory of friction that carries nothing, shape (ends, elements)."""
    return np.zeros((ends, ELEMENTS))


@fused_step
def dry_bound(f: FloatArray, speed: float) -> float:
    """Return the force at which all elements slide, at a speed without sign."""
    ratio = speed * f[PER_STRIBECK]
    return float(f[COULOMB] + (f[EXCESS] * math.exp(-ratio * ratio) if ratio < GONE else 0.0))


@fused_step
def friction(f: FloatArray, held: FloatArray, moved: float, v: float) -> float:
    """Return the force against the motion, so far from where the memory was brought up to date."""
    bound, fade = dry_bound(f, abs(v)), v * f[PER_FADE]
    total = f[VISCOUS] * v / (1.0 + fade * fade)
    for k in range(ELEMENTS):
        most = f[SHARE + k] * bound
        total += min(max(held[k] + f[STIFFNESS + k] * moved, -most), most)
    return float(total)


@fused_step
def remember(f: FloatArray, held: FloatArray, moved: float, v: float) -> None:
    """Bring the memory up to date after a way."""
    bound = dry_bound(f, abs(v))
    for k in range(ELEMENTS):
        most = f[SHARE + k] * bound
        held[k] = min(max(held[k] + f[STIFFNESS + k] * moved, -most), most)


@fused_step
def is_sliding(f: FloatArray, held: FloatArray, v: float, change: float) -> bool:
    """Return whether all elements slide and go on to, where the velocity changes by no more than ``change``."""
    total = 0.0
    for k in range(ELEMENTS):
        total += held[k]
    total = total if v > 0.0 else -total
    return bool(abs(v) > change and total >= SLIDING * dry_bound(f, abs(v)))


@fused_step
def measure_speed(c: Record, motor: float) -> None:
    """Take the speed from two positions of the motor, through the filter."""
    c.speed += c.filter_share * ((motor - c.last_mm) / c.period_s - c.speed)
    c.last_mm = motor


@fused_step
def current_for(c: Record, wanted: float, acceleration: float, motor: float) -> float:
    """Return the current that the velocity loop asks for: ``wanted`` is what the position loop asks of it."""
    measure_speed(c, motor)
    lacking = wanted - c.speed
    asked = c.velocity_gain * lacking + c.integral_a + c.acceleration_a * acceleration
    given = min(max(asked, -c.limit_a), c.limit_a)
    c.integral_a += c.integral_share * lacking + RELEASE * (given - asked)
    return float(given)


@helper
def controlled(c: Record, command: float, speed: float, acceleration: float, position: float, motor: float) -> float:
    """Return the current that the loops ask for: ``position`` closes the outer, ``motor`` the velocity loop."""
    if c.open_loop > 0.0:
        measure_speed(c, motor)
        return float(min(max(command, -c.limit_a), c.limit_a))
    wanted = c.position_gain * (command - position) + c.velocity_feedforward * speed
    return float(current_for(c, wanted, acceleration, motor))


@fused_step
def in_table(table: FloatArray, turns: float) -> float:
    """Return what a periodic table holds at a position in periods; nothing if it is empty."""
    if table.size == 0:
        return 0.0
    place = (turns - math.floor(turns)) * table.size
    below = min(int(place), table.size - 1)
    above = below + 1 if below + 1 < table.size else 0
    return float(table[below] + (place - below) * (table[above] - table[below]))


@fused_step
def turned(sine: float, cosine: float, angle: float) -> float:
    """Return the sine a small angle further; it may be 0.1, where the series is cut at 1e-7."""
    square = angle * angle
    return sine * (1.0 - square * (0.5 - square / 24.0)) + cosine * angle * (1.0 - square / 6.0)


@fused_step
def motor_acceleration(
    m: Record, f: FloatArray, held: FloatArray, sine: float, cosine: float, moved: float, v: float, current: float
) -> float:
    """Return the acceleration of a linear motor, so far from where its place among the magnets is known."""
    cogging = m.cogging_n * turned(sine, cosine, m.per_mm * moved)
    return float((m.n_per_a * current - cogging - friction(f, held, moved, v)) * m.per_mass)


@fused_step
def move_linear_motor(
    m: Record,
    c: Record,
    f: FloatArray,
    held: FloatArray,
    x: float,
    v: float,
    current: float,
    asked: float,
    finer: int,
) -> tuple[float, float, float]:
    """Return position, speed and current a control period later."""
    sine, cosine = math.sin(m.per_mm * x + m.phase), math.cos(m.per_mm * x + m.phase)
    a1 = motor_acceleration(m, f, held, sine, cosine, 0.0, v, current)
    change = 2.0 * c.period_s * (abs(a1) + abs(m.n_per_a * (asked - current)) * m.per_mass)
    steps = finer if is_sliding(f, held, v, change) else FINE * finer
    h = c.period_s / steps
    decay = math.exp(-0.5 * h / c.lag_s)
    for k in range(steps):
        middle = asked + (current - asked) * decay
        end = asked + (middle - asked) * decay
        if k > 0:
            a1 = motor_acceleration(m, f, held, sine, cosine, 0.0, v, current)
        d = 0.5 * h * v
        a2 = motor_acceleration(m, f, held, sine, cosine, d, v + 0.5 * h * a1, middle)
        d += 0.25 * h * h * a1
        a3 = motor_acceleration(m, f, held, sine, cosine, d, v + 0.5 * h * a2, middle)
        d = h * v + 0.5 * h * h * a2
        a4 = motor_acceleration(m, f, held, sine, cosine, d, v + h * a3, end)
        d = h * v + h * h * (a1 + a2 + a3) / 6.0
        x += d
        v += h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        current, turn = end, m.per_mm * d
        sine, cosine = turned(sine, cosine, turn), turned(cosine, -sine, turn)
        remember(f, held, d, v)
    return x, v, current


@fused_kernel
def run_linear_motor(
    m: Record, c: Record, f: FloatArray, held: FloatArray, commands: FloatArray, table: FloatArray, every: int,
    finer: int, out: FloatArray,
) -> None:  # fmt: skip
    """Move a linear motor along commands of shape (position, speed, acceleration, offset; ticks)."""
    x, v, current = commands[0, 0] * (1.0 - c.open_loop) - commands[3, 0], 0.0, 0.0
    c.last_mm = x + commands[3, 0]
    for tick in range(commands.shape[1]):
        seen = x + commands[3, tick]
        if tick % every == 0:
            at = tick // every
            out[LOAD, at], out[ENCODER, at], out[SPEED, at], out[CURRENT, at] = x, seen, v, current
            out[FRICTION_N, at] = friction(f, held, 0.0, v)
        asked = controlled(c, commands[0, tick], commands[1, tick], commands[2, tick], seen, seen)
        asked += in_table(table, m.per_mm * seen / (2.0 * math.pi))
        x, v, current = move_linear_motor(m, c, f, held, x, v, current, asked, finer)


@fused_step
def beyond_play(s: Record, stretch: float) -> float:
    """Return how far screw and nut are stretched."""
    return float(max(stretch - s.half_play, 0.0) + min(stretch + s.half_play, 0.0))


@fused_step
def screw_accelerations(
    s: Record, f: FloatArray, held: FloatArray, sine: float, cosine: float, stretch: float, way_q: float,
    way_x: float, p: float, v: float, current: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the accelerations of motor and carriage with speeds p and v, both ways after the memory's moment.

    ``sine`` and ``cosine`` are of the screw's angle at that moment, ``stretch`` is how far motor and carriage are
    apart.
    """
    turn = s.per_mm * way_q
    wave = turned(sine, cosine, turn)
    ratio = 1.0 + s.runout_mm * s.per_mm * turned(cosine, -sine, turn)
    bent = stretch + way_q - way_x + s.runout_mm * wave
    force = s.stiffness * beyond_play(s, bent) + s.damping * (ratio * p - v)
    motor = s.n_per_a * current - ratio * force - s.ripple_n * wave - friction(f[0], held[0], way_q, p)
    return motor * s.per_motor, (force - friction(f[1], held[1], way_x, v)) * s.per_carriage


@fused_step
def is_smooth(
    s: Record, f: FloatArray, held: FloatArray, bent: float, p: float, v: float, motor: float, carriage: float,
    period_s: float,
) -> bool:  # fmt: skip
    """Return whether both ends slide and the nut stays where it bears, with accelerations no larger than these."""
    reach = 2.0 * period_s
    bears = s.half_play == 0.0 or abs(bent) - s.half_play > reach * abs(p - v)
    return bears and is_sliding(f[0], held[0], p, reach * motor) and is_sliding(f[1], held[1], v, reach * carriage)


@fused_step
def move_ball_screw(
    s: Record, c: Record, f: FloatArray, held: FloatArray, q: float, x: float, p: float, v: float, current: float,
    asked: float, finer: int,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Return motor, carriage, their speeds and the current a control period later."""
    sine, cosine = math.sin(s.per_mm * q + s.phase), math.cos(s.per_mm * q + s.phase)
    a1, b1 = screw_accelerations(s, f, held, sine, cosine, q - x, 0.0, 0.0, p, v, current)
    change = abs(a1) + abs(s.n_per_a * (asked - current)) * s.per_motor
    smooth = is_smooth(s, f, held, q - x + s.runout_mm * sine, p, v, change, abs(b1), c.period_s)
    steps = finer if smooth else FINE * finer
    h = c.period_s / steps
    decay = math.exp(-0.5 * h / c.lag_s)
    for k in range(steps):
        middle = asked + (current - asked) * decay
        end = asked + (middle - asked) * decay
        half, apart = 0.5 * h, q - x
        if k > 0:
            a1, b1 = screw_accelerations(s, f, held, sine, cosine, apart, 0.0, 0.0, p, v, current)
        p2, v2 = p + half * a1, v + half * b1
        a2, b2 = screw_accelerations(s, f, held, sine, cosine, apart, half * p, half * v, p2, v2, middle)
        p3, v3 = p + half * a2, v + half * b2
        a3, b3 = screw_accelerations(s, f, held, sine, cosine, apart, half * p2, half * v2, p3, v3, middle)
        p4, v4 = p + h * a3, v + h * b3
        a4, b4 = screw_accelerations(s, f, held, sine, cosine, apart, h * p3, h * v3, p4, v4, end)
        way_q = h * (p + 2.0 * p2 + 2.0 * p3 + p4) / 6.0
        way_x = h * (v + 2.0 * v2 + 2.0 * v3 + v4) / 6.0
        q, x = q + way_q, x + way_x
        p += h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        v += h * (b1 + 2.0 * b2 + 2.0 * b3 + b4) / 6.0
        current, turn = end, s.per_mm * way_q
        sine, cosine = turned(sine, cosine, turn), turned(cosine, -sine, turn)
        remember(f[0], held[0], way_q, p)
        remember(f[1], held[1], way_x, v)
    return q, x, p, v, current


@fused_kernel
def run_ball_screw(
    s: Record, c: Record, f: FloatArray, held: FloatArray, commands: FloatArray, every: int, finer: int,
    out: FloatArray,
) -> None:  # fmt: skip
    """Move a ball screw along commands of shape (position, speed, acceleration, offset; ticks)."""
    q, p, v, current = commands[0, 0] * (1.0 - c.open_loop) - commands[3, 0], 0.0, 0.0, 0.0
    x = q + s.runout_mm * math.sin(s.per_mm * q + s.phase)
    by_scale = s.scale > 0.0
    c.last_mm = q if by_scale else q + commands[3, 0]
    for tick in range(commands.shape[1]):
        seen = (x if by_scale else q) + commands[3, tick]
        if tick % every == 0:
            at = tick // every
            out[LOAD, at], out[ENCODER, at], out[SPEED, at], out[CURRENT, at] = x, seen, v, current
            out[FRICTION_N, at] = friction(f[0], held[0], 0.0, p) + friction(f[1], held[1], 0.0, v)
        motor = q if by_scale else seen
        asked = controlled(c, commands[0, tick], commands[1, tick], commands[2, tick], seen, motor)
        q, x, p, v, current = move_ball_screw(s, c, f, held, q, x, p, v, current, asked, finer)


@fused_kernel
def friction_along(f: FloatArray, held: FloatArray, way_mm: FloatArray, speed: FloatArray, out: FloatArray) -> None:
    """Write the force against the motion after each way."""
    for k in range(way_mm.size):
        remember(f, held, way_mm[k], speed[k])
        out[k] = friction(f, held, 0.0, speed[k])
