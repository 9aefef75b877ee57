"""Hiding effects in the log of a drive: the force that it needs is read at equal times while the axis moves.

A mass is moved, guides and seals rub, a motor pulls at its teeth, an inclined axis weighs on it, a cable chain pulls,
an arm hangs on a joint. The friction is that of bristles that bend before the surfaces slip, not a sign of the
velocity. What is in mm and N for a linear axis is in degrees and N m for a joint.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from rtec.blind.draws import Draw, Occasion, stream
from rtec.blind.hidden import Hidden, Parameter, Recorded, hidden_of
from rtec.blind.in_motion import SAMPLE_S, Log, log_of
from rtec.blind.noise import Readings, noise_of
from rtec.blind.plan import RIGID_MM, Floats, Ints, Plan
from rtec.blind.scenario import Scenario
from rtec.blind.static_errors import wandering
from rtec.metrology import Column
from rtec.units import PS_PER_S

FORCE_STEP_N = 0.01
"""Resolution of the drive's force."""
_FINE = 20
"""Steps of the friction's state from reading to reading."""
_STRIBECK_MM_S = (3.0, 8.0)
"""Speeds at which the surfaces part, below the third of four feeds."""


class _Motion:
    """What the axis does at each reading: position, velocity, acceleration, bent bristles, and the load on it."""

    def __init__(self, log: Log, load_kg: Floats, presliding_mm: float, first: _Motion | None = None) -> None:
        self.time_s, self.run, self.load_kg = log.time_s, log.run, load_kg
        self.position_mm, self.velocity_mm_s, self.acceleration_mm_s2 = (
            log.position_mm,
            log.speed_mm_s,
            log.gain_mm_s2,
        )
        # of the first measurement, by which the numbers of the forces are drawn
        self.first_mm = self.position_mm if first is None else first.position_mm
        fine_s = np.arange(round(log.time_s[-1] / SAMPLE_S) * _FINE + 1) * (SAMPLE_S / _FINE)
        velocity = log.motion.velocity_at(np.round(fine_s * PS_PER_S).astype(np.int64))
        bent = bent_bristles(velocity, SAMPLE_S / _FINE, presliding_mm)
        self.bent = bent[np.round(log.time_s / SAMPLE_S).astype(np.int64) * _FINE]


def bent_bristles(velocity_mm_s: Floats, step_s: float, presliding_mm: float = RIGID_MM) -> Floats:
    """Return how far bristles between two surfaces are bent, from -1 to 1 where they slip, shape (n,).

    They bend over ``presliding_mm`` before the surfaces slip.

    Notes
    -----
    ``s' = (v - |v| s) / presliding`` is solved exactly for the velocity at each step.

    References
    ----------
    P. R. Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14 (1976) 1675; C. Canudas de Wit et
    al., A new model for control of systems with friction, IEEE Trans. Autom. Control 40 (1995) 419.

    Examples
    --------
    >>> bent_bristles(np.array([0.0, 1e-3, 1e-3, -1e-3]), 0.001).round(3).tolist()
    [0.0, 0.632, 0.865, -0.314]
    """
    bent = np.empty(velocity_mm_s.size)
    state = 0.0
    for i, velocity in enumerate(velocity_mm_s.tolist()):
        way = math.copysign(1.0, velocity)
        state = way + (state - way) * math.exp(-abs(velocity) * step_s / presliding_mm)
        bent[i] = state
    return bent


ABOUT_LEVEL = np.radians(30.0)
"""As far as people see it."""

_Part = tuple[Floats, str, tuple[Parameter, ...]]


def _inertia(m: _Motion, plan: Plan, rng: np.random.Generator) -> _Part:
    if plan.rotary:
        number = Parameter("inertia", 1.0, "N*m/(deg/s^2)", scales=True)
        return m.acceleration_mm_s2, "what is turned", (number,)
    # a kilogram needs a newton for each m/s2
    return 1e-3 * m.acceleration_mm_s2, "the mass that is moved", (Parameter("mass", 1.0, "kg", scales=True),)


def _viscous(m: _Motion, plan: Plan, rng: np.random.Generator) -> _Part:
    factor, unit = (1.0, "N*m/(deg/s)") if plan.rotary else (1e-3, "N/(m/s)")
    return factor * m.velocity_mm_s, "oil that is sheared", (Parameter("viscous", 1.0, unit, scales=True),)


def _coulomb(m: _Motion, plan: Plan, rng: np.random.Generator) -> _Part:
    numbers = (Parameter("friction", 1.0, _force(plan), scales=True),)
    if plan.presliding_mm > RIGID_MM:
        over = Parameter("over", plan.presliding_mm, _length(plan))
        return m.bent, "seals that bend and rub", (*numbers, over)
    return m.bent, "guides and seals that rub", numbers


def _stribeck(m: _Motion, plan: Plan, rng: np.random.Generator) -> _Part:
    speed = rng.uniform(*_STRIBECK_MM_S)
    added = m.bent * np.exp(-((m.velocity_mm_s / speed) ** 2))
    numbers = (
        Parameter("speed", speed, f"{_length(plan)}/s"),
        Parameter("friction", 1.0, _force(plan), scales=True),
    )
    return added, "surfaces that touch at creep and part with speed", numbers


def _cogging(m: _Motion, plan: Plan, rng: np.random.Generator) -> _Part:
    period = float(rng.uniform(*plan.wave_shares) * np.ptp(m.first_mm))  # moves need not reach the ends
    angle = 2.0 * np.pi * m.position_mm / period + rng.uniform(0.0, 2.0 * np.pi)
    added = np.sin(angle) + rng.uniform(0.1, 0.4) * np.sin(2.0 * angle + rng.uniform(0.0, 2.0 * np.pi))
    numbers = (Parameter("period", period, _length(plan)), Parameter("amplitude", 1.0, _force(plan), scales=True))
    return added, "magnets that pull at the teeth of the motor", numbers


def _force_offset(m: _Motion, plan: Plan, rng: np.random.Generator) -> _Part:
    sign = float(rng.choice([-1.0, 1.0]))
    return (
        np.full(m.position_mm.size, sign),
        "the zero of the amplifier" if plan.rotary else "the weight of an inclined axis",
        (Parameter("force", sign, _force(plan), scales=True),),
    )


def _gravity(m: _Motion, plan: Plan, rng: np.random.Generator) -> _Part:
    # a plumb line from the axis to the centre of mass, turned by the angle; its horizontal part is the lever
    hangs_at = np.radians(rng.uniform(0.0, 360.0))
    if plan.arm_level:
        quarter = rng.choice([-1.0, 1.0]) * np.pi / 2.0
        hangs_at = np.radians(m.first_mm.mean()) + quarter + rng.uniform(-1.0, 1.0) * ABOUT_LEVEL
    turned = np.radians(m.position_mm)
    lever = np.imag(np.exp(1j * (turned - hangs_at)))
    numbers = (
        Parameter("largest", 1.0, "N*m", scales=True),
        Parameter("hangs_at", float(np.degrees(hangs_at)), "deg"),
    )
    return lever, "the weight of an arm, whose lever changes as it turns", numbers


def _force_map(m: _Motion, plan: Plan, rng: np.random.Generator) -> _Part:
    x = np.linspace(float(m.first_mm.min()), float(m.first_mm.max()), 600)
    # beyond the ends of the first measurement the cables pull as at its ends
    curve, _ = wandering(x, float(np.ptp(x)), (0.12, 0.18), np.mean, rng)
    number = Parameter("peak_to_peak", float(np.ptp(curve)), _force(plan), scales=True)
    return np.interp(m.position_mm, x, curve), "cables and covers that pull along the way", (number,)


def _load_friction(m: _Motion, plan: Plan, rng: np.random.Generator) -> _Part:
    number = Parameter("friction", 1.0, f"{_force(plan)}/kg", scales=True)
    return m.bent * m.load_kg, "a guide on which a load presses", (number,)


def _force(plan: Plan) -> str:
    return "N*m" if plan.rotary else "N"


def _length(plan: Plan) -> str:
    return "deg" if plan.rotary else "mm"


_PARTS: Mapping[str, Callable[[_Motion, Plan, np.random.Generator], _Part]] = MappingProxyType(
    {
        draw.__name__[1:]: draw
        for draw in (
            _inertia, _viscous, _coulomb, _stribeck, _cogging, _force_offset, _gravity, _force_map, _load_friction,
        )
    }
)  # fmt: skip


def measure_drive(scenario: Scenario, seed: int, plan: Plan, number: int) -> Recorded:
    """Read the force of the drive while the axis moves, with what a scenario hides.

    Scenario, seed, plan and number are as in `rtec.blind.at_rest.measure_at_rest`.

    Notes
    -----
    The strength of a force is its RMS, and not that about its mean: a drive at rest without a load has the force 0.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> scenario = Scenario(names=("inertia",), plan=PLANS["drive"])
    >>> record = measure_drive(scenario, 1, scenario.plan, 0)
    >>> [column.heading for column in record.columns], list(record.hidden)
    (['run', 'time_s', 'actual_mm', 'velocity_mm_s', 'force_n', 'load_kg'], ['inertia'])
    """
    occasion = Occasion(seed=seed, number=number)
    m = first = _moved(scenario.plan, Occasion(seed=seed))
    if number:
        m = _moved(plan, occasion, first)
    sigma_n = scenario.plan.sigma_n
    readings = Readings(time_s=m.time_s, position_mm=m.position_mm, direction=np.sign(m.velocity_mm_s), run=m.run)
    force_n = noise_of(scenario.noise, readings, sigma_n, occasion.stream(Draw.NOISE))
    hidden: dict[str, Hidden] = {}
    for name, strength in scenario.wanted.items():
        unit, _, _ = _PARTS[name](first, plan, stream(seed, Draw.EFFECT, name))
        factor = strength * sigma_n / _size(unit)
        added, description, parameters = _PARTS[name](m, plan, stream(seed, Draw.EFFECT, name))
        force_n += factor * added
        hidden[name] = hidden_of(name, description, parameters, factor, _size(added), sigma_n)
    length, force = ("deg", Column("torque", "nm", force_n)) if plan.rotary else ("mm", Column("force", "n", force_n))
    columns = [
        Column("run", "", m.run.astype(np.float64)),
        Column("time", "s", np.round(m.time_s - m.time_s[0], 3)),
        Column("actual", length, np.round(m.position_mm, 3)),
        Column("velocity", f"{length}_s", np.round(m.velocity_mm_s, 3)),
        replace(force, values=np.round(np.round(force_n / FORCE_STEP_N) * FORCE_STEP_N, 2)),
        Column("load", "kg", m.load_kg),
    ]
    return Recorded(columns=columns, unknown={}, hidden=hidden)


def _moved(plan: Plan, occasion: Occasion, first: _Motion | None = None) -> _Motion:
    log = log_of(plan, occasion.stream(Draw.COURSE))
    return _Motion(log, _loads_kg(plan, log.run, occasion), plan.presliding_mm, first)


def _size(added: Floats) -> float:
    return float(np.sqrt(np.mean(added**2)))


def _loads_kg(plan: Plan, run: Ints, occasion: Occasion) -> Floats:
    """Return the load on the axis at each reading: in each run another one, unless the plan says which."""
    drawn = occasion.stream(Draw.LOAD).permutation(np.linspace(5.0, 50.0, max(plan.runs, 2)))
    loads = np.resize(plan.loads_kg, plan.runs) if plan.loads_kg else drawn
    return np.round(loads[run - 1], 1)
