"""Errors of the emulated axis that a player wrote: effects made by ``@rtec.effect``, hidden as slow errors are.

The function of such an effect is all the physics there is: the game calls it with the true conditions of the
readings.
"""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from rtec.blind.circumstances import REFERENCE_DEGC, Circumstances
from rtec.blind.hidden import Parameter, rms
from rtec.blind.plan import PITCH_MM, SIGNAL_PERIOD_MM, Floats, Plan
from rtec.blind.slow_errors import SlowError
from rtec.effects.conditions import Conditions, distance_since_reversal
from rtec.effects.own import FunctionEffect
from rtec.effects.protocol import Effect, Shape
from rtec.effects.quantities import meant
from rtec.errors import ArgumentError
from rtec.metrology import Reading

_DRAWN, _LEAST_SHARE = 30, 0.3
"""Settings of the parameters that are drawn, and the share of the largest RMS among them that shows well enough."""
_LEAST_CHANGE = 1e-9
"""Share of its size by which a contribution has to change over the readings to be seen."""
_COLUMN_OF = MappingProxyType({
    "position": None, "run": None, "phase_of_pitch": None, "phase_of_signal": None, "direction": "direction",
    "since_reversal": "direction", "velocity": "feed", "time": "time", "temperature": "temperature",
    "pressure": "pressure", "humidity": "humidity", "dwell_s": "dwell",
})  # fmt: skip
"""Column of a plan that records a quantity; None: every plan records it. What is missing here, no plan records."""


def unfit_own(effect: Effect, plan: Plan) -> str | None:
    """Return why an effect of a player's own cannot be hidden in a plan, or None where it can.

    Examples
    --------
    >>> from rtec.blind.plan import PLANS
    >>> from rtec.effects.own import effect
    >>> @effect
    ... def lean(temperature):
    ...     return temperature**2
    >>> unfit_own(lean, PLANS["drive"])
    'own effects are hidden in readings at rest'
    >>> unfit_own(lean, PLANS["base"])
    'the plan does not record one temperature column'
    """
    if not isinstance(effect, FunctionEffect):
        return "own effects are hidden where @rtec.effect made them of a function"
    if plan.reading is not Reading.AT_REST:
        return "own effects are hidden in readings at rest"
    if plan.rotary:
        return "own effects are hidden in a linear axis"
    for name in effect.quantities:
        column = _COLUMN_OF.get(name, "")
        if column is not None and column not in plan.columns:
            return f"the plan does not record {meant(name)}"
    return None


def draw_own(effect: FunctionEffect, c: Circumstances, rng: np.random.Generator) -> SlowError:
    """Return an own effect of one µm, with parameters drawn within their bounds.

    Notes
    -----
    Of 30 settings the first is taken whose RMS over the readings of the first measurement is at least 0.3 of the
    largest: a bump between two targets could not be found.

    Raises
    ------
    ArgumentError
        The function fails, or is the same at every reading, whatever its parameters.
    """
    sign = 1.0 if effect.not_negative else float(rng.choice([-1.0, 1.0]))
    origin = conditions_of(c.origin)
    drawn = [
        effect.shape_type(**{name: within.at(rng.uniform()) for name, within in effect.bounds.items()})
        for _ in range(_DRAWN if effect.bounds else 1)
    ]
    columns = [_column(effect, origin, shape) for shape in drawn]
    spreads = [rms(column) for column in columns]
    largest = int(np.argmax(spreads))
    if spreads[largest] <= _LEAST_CHANGE * float(np.abs(columns[largest]).max()):
        allowed = "an effect that changes over its readings, or another plan"
        problem = f"cannot be seen with the plan {c.plan.name}: it is the same at every reading"
        raise ArgumentError(f"effect {effect.name}", "", allowed, problem=problem)
    shape = next(one for one, spread in zip(drawn, spreads, strict=True) if spread >= _LEAST_SHARE * spreads[largest])
    numbers = (Parameter(name, float(getattr(shape, name)), w.inside[2]) for name, w in effect.bounds.items())
    return SlowError(
        added_mm=sign * 1e-3 * _column(effect, conditions_of(c), shape),
        description=effect.card.title,
        parameters=(Parameter(effect.name, sign, "um", scales=True), *numbers),
    )


def _column(effect: FunctionEffect, conditions: Conditions, shape: Shape) -> Floats:
    return effect.columns(conditions, shape)[:, 0]


def conditions_of(c: Circumstances) -> Conditions:
    """Return the true conditions of each reading, under the names by which a measurement file gives them."""
    course = c.course
    return Conditions(
        position=course.target_mm,
        position_unit="mm",
        run=course.run,
        direction=c.direction,
        time_s=c.measured.time_s,
        velocity=c.direction * course.feed_mm_s,
        since_reversal=distance_since_reversal(course.target_mm, c.direction, course.run),
        temperatures=MappingProxyType({"temperature": c.temperature_degc}),
        pressure_hpa=c.air.pressure_hpa,
        humidity_percent=c.air.humidity_percent,
        others=MappingProxyType({"dwell_s": course.turn_dwell_s}),
        reference_temperature_degc=REFERENCE_DEGC,
        screw_pitch=PITCH_MM,
        signal_period=SIGNAL_PERIOD_MM,
    )
