"""Feed drives integrated by an implicit solver of scipy, one control period after the other, from the equations.

Nothing is shared with the kernels: plain floats in mm, s and N. Within a period friction is a function of the way
since its memory was brought up to date and of the speed; it is brought up to date each period and wherever an end
turns round, which the solver locates (once a period and end).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

from rtec.axis.plants import Feedback, LinearMotor, ScrewRunout, TorqueRipple


class Elements:
    """Friction of one end."""

    def __init__(self, friction):
        self.f = friction
        share = friction.static_n / len(friction.yield_um)
        self.stiff = [share / (1e-3 * d) for d in friction.yield_um]
        self.held = [0.0] * len(self.stiff)

    def forces(self, moved, v):
        f = self.f
        bound = f.coulomb_n + (f.static_n - f.coulomb_n) * math.exp(-min((v / f.stribeck_mm_s) ** 2, 700.0))
        most = bound / len(self.held)
        return [max(-most, min(most, h + k * moved)) for h, k in zip(self.held, self.stiff, strict=True)]

    def total(self, moved, v):
        f = self.f
        return sum(self.forces(moved, v)) + 1e-3 * f.viscous_n_s_m * v / (1 + (v / f.fade_mm_s) ** 2)


class Motor:
    """A linear motor; state x, v."""

    def __init__(self, drive, start):
        self.drive, self.ends = drive, [Elements(drive.friction)]
        self.mass, self.n_per_a = drive.mass_kg, drive.n_per_a
        self.state = [start, 0.0]

    def rates(self, y, y0, current):
        d = self.drive
        turn = 2 * math.pi * y[0] / d.cogging_period_mm + math.radians(d.cogging_phase_deg)
        force = d.n_per_a * current - d.cogging_n * math.sin(turn) - self.ends[0].total(y[0] - y0[0], y[1])
        return [y[1], 1e3 * force / d.mass_kg]

    def seen(self):
        return self.state[0], self.state[0], True

    def table(self, seen):
        table = self.drive.feedforward_map_a
        if not table:
            return 0.0
        return float(
            np.interp(
                seen / self.drive.cogging_period_mm % 1.0, np.linspace(0, 1, len(table) + 1), [*table, table[0]]
            )
        )


class Screw:
    """A ball screw; state q, v of the motor, x, v of the carriage."""

    def __init__(self, drive, start):
        self.drive, self.ends = drive, [Elements(drive.motor_friction), Elements(drive.carriage_friction)]
        self.motor_kg = drive.motor_inertia_kg_m2 * (2e3 * math.pi / drive.lead_mm) ** 2
        self.n_per_a = drive.nm_per_a * 2e3 * math.pi / drive.lead_mm
        self.mass = self.motor_kg + drive.carriage_kg
        self.state = [start, 0.0, start + self.runout(start)[0], 0.0]

    def runout(self, q):
        one = self.drive.once_a_turn
        if not isinstance(one, ScrewRunout):
            return 0.0, 0.0
        w = 2 * math.pi / self.drive.lead_mm
        turn = w * q + math.radians(one.phase_deg)
        return 1e-3 * one.amplitude_um * math.sin(turn), 1e-3 * one.amplitude_um * w * math.cos(turn)

    def ripple(self, q):
        one = self.drive.once_a_turn
        if not isinstance(one, TorqueRipple):
            return 0.0
        w = 2 * math.pi / self.drive.lead_mm
        return 1e3 * w * one.amplitude_nm * math.sin(w * q + math.radians(one.phase_deg))

    def rates(self, y, y0, current):
        d, (q, p, x, v) = self.drive, y
        ahead, slope = self.runout(q)
        bent, play = q + ahead - x, 0.5e-3 * d.backlash_um
        bent = bent - play if bent > play else bent + play if bent < -play else 0.0
        force = 1e3 * d.stiffness_n_um * bent + 1e-3 * d.damping_n_s_m * ((1 + slope) * p - v)
        motor = self.n_per_a * current - (1 + slope) * force - self.ripple(q) - self.ends[0].total(q - y0[0], p)
        carriage = force - self.ends[1].total(x - y0[2], v)
        return [p, 1e3 * motor / self.motor_kg, v, 1e3 * carriage / d.carriage_kg]

    def seen(self):
        scale = self.drive.feedback is Feedback.LINEAR_SCALE
        return self.state[2 if scale else 0], self.state[0], not scale

    def table(self, seen):
        return 0.0


def reference(drive, commands, *, method="Radau", open_loop=False, rtol=1e-10, atol=1e-12):
    """Positions (periods, ends) at each control period, for commands of shape (4, periods)."""
    c = drive.cascade
    period, lag = 1e-6 * c.period_us, 0.5 / math.pi / c.current_bandwidth_hz
    start = 0.0 if open_loop else commands[0][0] - commands[3][0]
    plant = Motor(drive, start) if isinstance(drive, LinearMotor) else Screw(drive, start)
    gain = 2e-3 * math.pi * c.velocity_bandwidth_hz * plant.mass / plant.n_per_a
    share = 1 - math.exp(-2 * math.pi * c.filter_hz * period)
    current = integral = speed = 0.0
    last, rows = None, []
    for command, feed, pull, offset in zip(*commands, strict=True):
        position, motor, joined = plant.seen()
        rows.append(plant.state[::2])
        motor += offset if joined else 0.0
        position += offset
        speed += share * ((motor - (motor if last is None else last)) / period - speed)
        last = motor
        lacking = c.position_gain_per_s * (command - position) + c.velocity_feedforward * feed - speed
        asked = gain * lacking + integral + c.acceleration_feedforward * 1e-3 * plant.mass / plant.n_per_a * pull
        if open_loop:
            asked = command
        given = min(max(asked, -c.limit_a), c.limit_a)
        if not open_loop:
            integral += gain * period / c.integral_time_s * lacking + 0.1 * (given - asked)
        given += plant.table(position)
        _one_period(plant, given, current - given, period, lag, (method, rtol, atol))
        current = given + (current - given) * math.exp(-period / lag)
    return np.array(rows)


def _one_period(plant, given, off, period, lag, solver):
    method, rtol, atol = solver
    now, places = 0.0, range(1, len(plant.state), 2)
    turns = [lambda t, y, place=place: y[place] for place in places]
    for turn in turns:
        turn.terminal = True
    while period - now > 1e-12:
        y0 = list(plant.state)
        done = solve_ivp(
            lambda t, y, y0=y0: plant.rates(y, y0, given + off * math.exp(-t / lag)),
            (now, period), y0, method=method, rtol=rtol, atol=atol, first_step=(period - now) / 4,
            events=turns or None,
        )  # fmt: skip
        plant.state = [float(value) for value in done.y[:, -1]]
        for end, place in zip(plant.ends, places, strict=True):
            end.held = end.forces(plant.state[place - 1] - y0[place - 1], plant.state[place])
        turns = [turn for turn, at in zip(turns, done.t_events or [], strict=False) if at.size == 0]
        now = float(done.t[-1])
