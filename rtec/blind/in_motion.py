"""Hiding effects in a moving log: the laser reads at equal times while the axis moves at several feeds."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtec import axis
from rtec.axis import Encoder, Limits, MotionSegments, ProfileShape, Program, Servo
from rtec.blind.axis_run import COUNT_MM
from rtec.blind.draws import Draw, Occasion, stream
from rtec.blind.hidden import Hidden, Parameter, Recorded, hidden_of, rms
from rtec.blind.noise import Readings, noise_of, resolved
from rtec.blind.plan import PROGRAM_STEP_MM, Floats, Ints, Plan
from rtec.blind.scenario import Scenario
from rtec.blind.slow_errors import SlowError
from rtec.blind.static_errors import table_of
from rtec.blind.strength import hidden_static, static_errors
from rtec.machine import TRACE_COLUMNS, Machine, run_machine
from rtec.metrology import Column, Passes, Strokes
from rtec.units import PS_PER_S

SAMPLE_S = 0.02
"""Between two readings."""
LIMITS = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=400.0, rapid_mm_s=100.0, max_jerk_mm_s3=2000.0)
"""Soft ramps, so that the axis spends a good part of its time accelerating and the drive can follow."""
SERVO_PS = 100_000_000
GAIN_PER_S = 200.0
_SHORTEST_MM = 3.0
_CONTACTS = 40
_MOVE_S = (0.4, 0.8)
_HOME_S = 0.5
_TIME_S, _COMMAND_MM, _TRUE_MM = (TRACE_COLUMNS.index(name) for name in ("time_s", "command_mm", "true_mm"))


class Log(NamedTuple):
    """A log in motion: when it was read, and what was commanded then, shape (n,) each."""

    motion: MotionSegments
    time_s: Floats
    run: Ints
    position_mm: Floats
    speed_mm_s: Floats
    gain_mm_s2: Floats


def log_of(plan: Plan, rng: np.random.Generator) -> Log:
    """Draw the moves of a plan, and return them as they are read."""
    motion, begin_s, repeat_s = moves_of(plan, rng)
    time_s, run = sampled(plan, motion, begin_s, repeat_s)
    at = np.round(time_s * PS_PER_S).astype(np.int64)
    return Log(motion, time_s, run, motion.position_at(at), motion.velocity_at(at), motion.acceleration_at(at))


def measure_in_motion(scenario: Scenario, seed: int, plan: Plan, number: int) -> Recorded:
    """Read the moving axis with what a scenario hides.

    Scenario, seed, plan and number are as in `rtec.blind.at_rest.measure_at_rest`.

    Notes
    -----
    Lags are those of the closed loop: the share of the commanded velocity that the drive does not feed forward makes
    it stay behind in proportion to velocity, the lag of its velocity loop in proportion to acceleration. The true
    position is the encoder's with the static error and its play. All of it happens inside the closed loop; the noise
    is added to the readings.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> scenario = Scenario(names=("servo_lag",), plan=PLANS["moving"])
    >>> record = measure_in_motion(scenario, 1, scenario.plan, 0)
    >>> [column.heading for column in record.columns], list(record.hidden)
    (['run', 'time_s', 'target_mm', 'actual_mm', 'velocity_mm_s'], ['servo_lag'])
    """
    occasion = Occasion(seed=seed, number=number)
    first = log = log_of(scenario.plan, stream(seed, Draw.COURSE))
    if number:
        log = log_of(plan, occasion.stream(Draw.COURSE))
    sigma_mm = scenario.plan.sigma_um * 1e-3
    static = static_errors(scenario, seed, first.position_mm, _way(first.speed_mm_s))
    lags = _lags(scenario, first.speed_mm_s, first.gain_mm_s2)
    machine = Machine(
        axis_error=table_of(scenario.plan, list(static.values())),
        encoder=Encoder(count_mm=COUNT_MM),
        servo=lags.servo,
    )
    way = _way(log.speed_mm_s)
    hidden = hidden_static(scenario, static, log.position_mm, way) | lags.hidden(
        scenario, log.speed_mm_s, log.gain_mm_s2
    )
    trace = _traced(machine, log)
    rows = trace[np.round(log.time_s / SAMPLE_S).astype(np.int64)]
    deviation_mm = rows[:, _TRUE_MM] - rows[:, _COMMAND_MM]
    if "hysteresis" in scenario.names:
        bent = _bent(log, trace, stream(seed, Draw.EFFECT, "hysteresis"))
        told = (
            bent if log is first else _bent(first, _traced(machine, first), stream(seed, Draw.EFFECT, "hysteresis"))
        )
        factor = scenario.wanted["hysteresis"] * sigma_mm / rms(told.added_mm)
        deviation_mm += factor * bent.added_mm
        what = bent.description, bent.parameters, factor, rms(bent.added_mm), sigma_mm
        hidden["hysteresis"] = hidden_of("hysteresis", *what)
    readings = Readings(time_s=log.time_s, position_mm=rows[:, _COMMAND_MM], direction=way, run=log.run)
    deviation_mm += noise_of(scenario.noise, readings, sigma_mm, occasion.stream(Draw.NOISE))
    columns = [
        Column("run", "", log.run.astype(np.float64)),
        Column("time", "s", np.round(log.time_s - log.time_s[0], 3)),
        Column("target", "mm", resolved(rows[:, _COMMAND_MM])),
        Column("actual", "mm", resolved(rows[:, _COMMAND_MM] + deviation_mm)),
        Column("velocity", "mm_s", np.round(log.speed_mm_s, 3)),
    ]
    return Recorded(columns=columns, unknown={}, hidden=hidden)


def _traced(machine: Machine, log: Log) -> Floats:
    """Return what the closed loop did from the beginning, at the times of the readings."""
    every = round(SAMPLE_S * PS_PER_S) // SERVO_PS
    return np.asarray(run_machine(machine, log.motion, trace_every=every, skip_rest=False).trace)


def sampled(plan: Plan, motion: MotionSegments, begin_s: float, repeat_s: float) -> tuple[Floats, Ints]:
    """Return when a log in motion is read, in s, and the number of the repetition then, from 1, shape (n,) each.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> moves = moves_of(PLANS["moving"], np.random.default_rng(0))
    >>> time_s, run = sampled(PLANS["moving"], *moves)
    >>> round(float(time_s[1] - time_s[0]), 6), np.unique(run).tolist()
    (0.02, [1, 2])
    """
    samples = np.arange(math.ceil(begin_s / SAMPLE_S), math.floor(motion.total_ps / PS_PER_S / SAMPLE_S))
    time_s: Floats = samples.astype(np.float64) * SAMPLE_S
    return time_s, np.floor((time_s - begin_s) / repeat_s).clip(0, plan.runs - 1).astype(np.int64) + 1


def moves_of(plan: Plan, rng: np.random.Generator) -> tuple[MotionSegments, float, float]:
    """Return the motion of a moving log, when its first repetition begins and how long each lasts, in s.

    In short strokes the feeds take turns, in moves of about the same time but drawn lengths and ways; else the axis
    goes from end to end and back at each feed. Each repetition is the same. A plan that goes forward only is one move
    from end to end.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> motion, begin_s, repeat_s = moves_of(PLANS["moving"], np.random.default_rng(0))
    >>> round((motion.total_ps / 1e12 - begin_s) / repeat_s, 6)
    2.0
    """
    one = _forward(plan) if plan.passes is Passes.FORWARD else _strokes(plan, rng)
    home: list[axis.Block] = [axis.Dwell(seconds=_HOME_S), axis.Move(target_mm=plan.start_mm, feed_mm_s=20.0)]
    home.append(axis.Dwell(seconds=_HOME_S))
    motion = axis.plan(Program(blocks=tuple(home + one * plan.runs)), LIMITS, ProfileShape.JERK_LIMITED)
    begin_s = float(motion.block_end_ps[len(home) - 1]) / PS_PER_S
    return motion, begin_s, (motion.total_ps / PS_PER_S - begin_s) / plan.runs


def _forward(plan: Plan) -> list[axis.Block]:
    return [axis.Move(target_mm=plan.end_mm, feed_mm_s=float(plan.feeds_mm_s[0]))]


def _strokes(plan: Plan, rng: np.random.Generator) -> list[axis.Block]:
    """Return the moves of one repetition, which ends where it began."""
    if plan.strokes is Strokes.FULL:
        ways = [(place, feed) for feed in plan.feeds_mm_s for place in (plan.end_mm, plan.start_mm)]
        return [axis.Move(target_mm=place, feed_mm_s=float(feed)) for place, feed in ways]
    feeds = np.resize(plan.feeds_mm_s, plan.targets - 1)
    places = [plan.start_mm]
    for feed in feeds:
        length = max(float(feed * rng.uniform(*_MOVE_S)), _SHORTEST_MM)
        below, above = places[-1] - length, places[-1] + length
        fits = [place for place in (below, above) if plan.start_mm <= place <= plan.end_mm]
        place = fits[int(rng.integers(len(fits)))] if fits else plan.start_mm + plan.end_mm - places[-1]
        places.append(float(np.round(place / PROGRAM_STEP_MM) * PROGRAM_STEP_MM))
    back = axis.Move(target_mm=plan.start_mm, feed_mm_s=float(feeds[-1]))
    return [
        *(axis.Move(target_mm=place, feed_mm_s=float(feed)) for place, feed in zip(places[1:], feeds, strict=True)),
        back,
    ]


def _bent(log: Log, trace: Floats, rng: np.random.Generator) -> SlowError:
    """Return what contacts add that bend before they slip, at the times read.

    Contacts between slide and scale, of unlike stiffness and friction, along the whole path from its beginning.
    """
    slips_mm = rng.uniform(4.0, 7.0) * np.exp(rng.normal(0.0, 0.8, _CONTACTS))
    share = rng.dirichlet(np.full(_CONTACTS, 4.0))
    path_mm = trace[:, _TRUE_MM]
    force, held = np.empty(path_mm.size), np.zeros(_CONTACTS)
    for i, step in enumerate(np.diff(path_mm, prepend=path_mm[0]).tolist()):
        held = np.clip(held + step / slips_mm, -1.0, 1.0)
        force[i] = share @ held
    return SlowError(
        added_mm=-0.5e-3 * force[np.round(log.time_s / SAMPLE_S).astype(np.int64)],
        description="contacts bend before they slip, each at a force of its own, and remember where the axis turned",
        parameters=(
            Parameter("slips_over", float(share @ slips_mm), "mm"),
            Parameter("width", -1.0, "um", scales=True),
        ),
    )


def _way(speed_mm_s: Floats) -> Floats:
    """Return the direction of motion, and at rest the one before."""
    sign = np.sign(speed_mm_s)
    moving = np.flatnonzero(sign)
    before = np.searchsorted(moving, np.arange(sign.size), side="right") - 1
    return sign[moving[np.maximum(before, 0)]]


class _Lags(NamedTuple):
    """By how much the axis stays behind in proportion to velocity and to acceleration."""

    delay_s: float
    square_s2: float

    @property
    def servo(self) -> Servo:
        """The servo with these lags.

        Notes
        -----
        With the gain K, the share f of velocity fed forward and the lag T of the velocity loop, the axis stays behind
        by (1 - f)/K v + (T/K - (1 - f)/K^2) a + ...; with T grown by (1 - f)/K the first lag is a pure delay.
        """
        period_s = SERVO_PS / PS_PER_S
        # a tick's share of what the velocity lacks: all of it in one tick where nothing lags
        share = period_s / (period_s + self.delay_s + self.square_s2 * GAIN_PER_S)
        lag_s = -period_s / math.log1p(-share) if share < 1.0 else 0.0
        forward = 1.0 - GAIN_PER_S * self.delay_s
        return Servo(period_ps=SERVO_PS, gain_per_s=GAIN_PER_S, feedforward=forward, lag_s=lag_s)

    def hidden(self, scenario: Scenario, speed: Floats, gain: Floats) -> dict[str, Hidden]:
        """Return what they are to the readings of a log, by name."""
        sigma_mm = scenario.plan.sigma_um * 1e-3
        stays = "the drive stays behind in proportion to"
        delay, lag = Parameter("delay", self.delay_s * 1e3, "ms"), Parameter("lag", self.square_s2 * 1e6, "ms^2")
        both = {
            "servo_lag": (f"{stays} velocity: not all of it is fed forward", delay, self.delay_s * speed),
            "acceleration_lag": (f"{stays} acceleration: its velocity loop lags", lag, self.square_s2 * gain),
        }
        return {
            name: hidden_of(name, words, (number,), 1.0, rms(added), sigma_mm)
            for name, (words, number, added) in both.items()
            if name in scenario.names
        }


def _lags(scenario: Scenario, speed: Floats, gain: Floats) -> _Lags:
    """Return the lags of a scenario; speed and acceleration of the first measurement decide how strong they are."""
    sigma_mm = scenario.plan.sigma_um * 1e-3
    wanted = scenario.wanted
    delay_s = wanted["servo_lag"] * sigma_mm / rms(speed) if "servo_lag" in wanted else 0.0
    square_s2 = wanted["acceleration_lag"] * sigma_mm / rms(gain) if "acceleration_lag" in wanted else 0.0
    return _Lags(delay_s, square_s2)
