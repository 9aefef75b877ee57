"""Hiding effects in a moving log: the laser reads at equal times while the axis moves at several feeds."""

from __future__ import annotations

import math

import numpy as np

from rtec import axis
from rtec.axis import Encoder, Limits, MotionSegments, ProfileShape, Program, Servo
from rtec.blind.axis_run import COUNT_MM
from rtec.blind.draws import Draw, stream
from rtec.blind.hidden import Hidden, Parameter, hidden_of, rms
from rtec.blind.noise import Readings, noise_of, resolved
from rtec.blind.plan import PROGRAM_STEP_MM, Floats, Ints, Passes, Plan
from rtec.blind.scenario import Scenario
from rtec.blind.static_errors import table_of
from rtec.blind.strength import hide_static
from rtec.machine import TRACE_COLUMNS, Machine, run_machine
from rtec.metrology import Column

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


def measure_in_motion(scenario: Scenario, seed: int) -> tuple[list[Column], dict[str, Floats], dict[str, Hidden]]:
    """Read the moving axis with what a scenario hides.

    Returns
    -------
    list of Column
        Everything that was read.
    dict
        Columns that no known quantity names: none.
    dict
        What was hidden, by name.

    Notes
    -----
    Lags are those of the closed loop: the share of the commanded velocity that the drive does not feed forward makes
    it stay behind in proportion to velocity, the lag of its velocity loop in proportion to acceleration. The true
    position is the encoder's with the static error and its play. All of it happens inside the closed loop; the noise
    is added to the readings.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> columns, _, hidden = measure_in_motion(Scenario(names=("servo_lag",), plan=PLANS["moving"]), 1)
    >>> [column.heading for column in columns], list(hidden)
    (['run', 'time_s', 'target_mm', 'actual_mm', 'velocity_mm_s'], ['servo_lag'])
    """
    plan = scenario.plan
    motion, begin_s, repeat_s = moves_of(plan, stream(seed, Draw.COURSE))
    time_s, run = sampled(plan, motion, begin_s, repeat_s)
    time_ps = np.round(time_s * 1e12).astype(np.int64)
    speed, gain = motion.velocity_at(time_ps), motion.acceleration_at(time_ps)
    sigma_mm = plan.sigma_um * 1e-3
    hidden: dict[str, Hidden] = {}
    static = hide_static(scenario, seed, motion.position_at(time_ps), _way(speed), hidden)
    servo = _lagging(scenario, speed, gain, sigma_mm, hidden)
    machine = Machine(axis_error=table_of(plan, static), encoder=Encoder(count_mm=COUNT_MM), servo=servo)
    every = round(SAMPLE_S * 1e12) // SERVO_PS
    trace = np.asarray(run_machine(machine, motion, trace_every=every, skip_rest=False).trace)
    rows = trace[np.round(time_s / SAMPLE_S).astype(np.int64)]
    deviation_mm = rows[:, _TRUE_MM] - rows[:, _COMMAND_MM]
    if "hysteresis" in scenario.names:
        rng = stream(seed, Draw.EFFECT, "hysteresis")
        deviation_mm += _bent(scenario.wanted["hysteresis"], trace[:, _TRUE_MM], time_s, sigma_mm, rng, hidden)
    readings = Readings(time_s=time_s, position_mm=rows[:, _COMMAND_MM], direction=_way(speed), run=run)
    deviation_mm += noise_of(scenario.noise, readings, sigma_mm, stream(seed, Draw.NOISE))
    columns = [
        Column("run", "", run.astype(np.float64)),
        Column("time", "s", np.round(time_s - time_s[0], 3)),
        Column("target", "mm", resolved(rows[:, _COMMAND_MM])),
        Column("actual", "mm", resolved(rows[:, _COMMAND_MM] + deviation_mm)),
        Column("velocity", "mm_s", np.round(speed, 3)),
    ]
    return columns, {}, hidden


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
    samples = np.arange(math.ceil(begin_s / SAMPLE_S), math.floor(motion.total_ps / 1e12 / SAMPLE_S))
    time_s: Floats = samples.astype(np.float64) * SAMPLE_S
    return time_s, np.floor((time_s - begin_s) / repeat_s).clip(0, plan.runs - 1).astype(np.int64) + 1


def moves_of(plan: Plan, rng: np.random.Generator) -> tuple[MotionSegments, float, float]:
    """Return the motion of a moving log, when its first repetition begins and how long each lasts, in s.

    The feeds take turns, in moves of about the same time but drawn lengths and ways. Each repetition is the same. A
    plan that goes forward only is one move from end to end.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> motion, begin_s, repeat_s = moves_of(PLANS["moving"], np.random.default_rng(0))
    >>> round((motion.total_ps / 1e12 - begin_s) / repeat_s, 6)
    2.0
    """
    feeds = np.resize(plan.feeds_mm_s, plan.targets - 1)
    places = [plan.start_mm]
    for feed in feeds:
        length = max(float(feed * rng.uniform(*_MOVE_S)), _SHORTEST_MM)
        below, above = places[-1] - length, places[-1] + length
        fits = [place for place in (below, above) if plan.start_mm <= place <= plan.end_mm]
        place = fits[int(rng.integers(len(fits)))] if fits else plan.start_mm + plan.end_mm - places[-1]
        places.append(float(np.round(place / PROGRAM_STEP_MM) * PROGRAM_STEP_MM))
    if plan.passes is Passes.FORWARD:
        places, feeds = [plan.start_mm, plan.end_mm], feeds[:1]
    one: list[axis.Block] = [
        axis.Move(target_mm=place, feed_mm_s=float(feed)) for place, feed in zip(places[1:], feeds, strict=True)
    ]
    if plan.passes is Passes.BOTH:
        one.append(axis.Move(target_mm=plan.start_mm, feed_mm_s=float(feeds[-1])))
    home: list[axis.Block] = [axis.Dwell(seconds=_HOME_S), axis.Move(target_mm=plan.start_mm, feed_mm_s=20.0)]
    home.append(axis.Dwell(seconds=_HOME_S))
    motion = axis.plan(Program(blocks=tuple(home + one * plan.runs)), LIMITS, ProfileShape.JERK_LIMITED)
    begin_s = float(motion.block_end_ps[len(home) - 1]) / 1e12
    return motion, begin_s, (motion.total_ps / 1e12 - begin_s) / plan.runs


def _bent(
    strength: float,
    path_mm: Floats,
    time_s: Floats,
    sigma_mm: float,
    rng: np.random.Generator,
    hidden: dict[str, Hidden],
) -> Floats:
    """Return what contacts add that bend before they slip, at the times read, and write down what they are.

    Contacts between slide and scale, of unlike stiffness and friction, along the whole path from its beginning.
    """
    slips_mm = rng.uniform(4.0, 7.0) * np.exp(rng.normal(0.0, 0.8, _CONTACTS))
    share = rng.dirichlet(np.full(_CONTACTS, 4.0))
    force, held = np.empty(path_mm.size), np.zeros(_CONTACTS)
    for i, step in enumerate(np.diff(path_mm, prepend=path_mm[0]).tolist()):
        held = np.clip(held + step / slips_mm, -1.0, 1.0)
        force[i] = share @ held
    added = -0.5e-3 * force[np.round(time_s / SAMPLE_S).astype(np.int64)]
    factor = strength * sigma_mm / rms(added)
    hidden["hysteresis"] = hidden_of(
        "hysteresis",
        "contacts bend before they slip, each at a force of its own, and remember where the axis turned",
        (Parameter("slips_over", float(share @ slips_mm), "mm"), Parameter("width", -1.0, "um", scales=True)),
        factor,
        added,
        sigma_mm,
    )
    return factor * added


def _way(speed_mm_s: Floats) -> Floats:
    """Return the direction of motion, and at rest the one before."""
    sign = np.sign(speed_mm_s)
    moving = np.flatnonzero(sign)
    before = np.searchsorted(moving, np.arange(sign.size), side="right") - 1
    way: Floats = sign[moving[np.maximum(before, 0)]]
    return way


def _lagging(scenario: Scenario, speed: Floats, gain: Floats, sigma_mm: float, hidden: dict[str, Hidden]) -> Servo:
    """Return the servo with the lags of a scenario, and write down what they are.

    Notes
    -----
    With the gain K, the share f of velocity fed forward and the lag T of the velocity loop, the axis stays behind by
    (1 - f)/K v + (T/K - (1 - f)/K^2) a + ...; with T grown by (1 - f)/K the first lag is a pure delay.
    """
    delay_s, square_s2 = 0.0, 0.0
    if "servo_lag" in scenario.names:
        delay_s = scenario.wanted["servo_lag"] * sigma_mm / rms(speed)
        hidden["servo_lag"] = hidden_of(
            "servo_lag",
            "the drive stays behind in proportion to velocity: not all of it is fed forward",
            (Parameter("delay", delay_s * 1e3, "ms"),),
            1.0,
            delay_s * speed,
            sigma_mm,
        )
    if "acceleration_lag" in scenario.names:
        square_s2 = scenario.wanted["acceleration_lag"] * sigma_mm / rms(gain)
        hidden["acceleration_lag"] = hidden_of(
            "acceleration_lag",
            "the drive stays behind in proportion to acceleration: its velocity loop lags",
            (Parameter("lag", square_s2 * 1e6, "ms^2"),),
            1.0,
            square_s2 * gain,
            sigma_mm,
        )
    period_s = SERVO_PS / 1e12
    # a tick's share of what the velocity lacks: all of it in one tick where nothing lags
    share = period_s / (period_s + delay_s + square_s2 * GAIN_PER_S)
    lag_s = -period_s / math.log1p(-share) if share < 1.0 else 0.0
    return Servo(period_ps=SERVO_PS, gain_per_s=GAIN_PER_S, feedforward=1.0 - GAIN_PER_S * delay_s, lag_s=lag_s)
