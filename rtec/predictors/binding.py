"""A model bound to the sensors of a machine: what the compiled loops take."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from rtec.compiled import address_of_function
from rtec.errors import ArgumentError, nearest
from rtec.heat.course import HeatCourse
from rtec.link._frame_kernels import MOST_AXES
from rtec.predictors import _kernels
from rtec.predictors.protocol import Model
from rtec.predictors.warm.features import SPINDLE_SPEED

CURVE = ("position", "direction")
"""Inputs of a curve over the position, one for each direction."""
OF_AXIS, OF_TEMPERATURE = "position_", "temperature_"


def axis_name(axis: int) -> str:
    """Return the name of the input that is the position of an axis.

    Examples
    --------
    >>> axis_name(2)
    'position_2'
    """
    return f"{OF_AXIS}{axis}"


_PLACES = {
    "position": _kernels.POSITION,
    "direction": _kernels.DIRECTION,
    "velocity": _kernels.VELOCITY,
    "time": _kernels.TIME,
}
_AXIS = re.compile(rf"{OF_AXIS}([1-9][0-9]?)", re.ASCII)
_NAME = re.compile(r"[a-z][a-z0-9_]{0,31}", re.ASCII)


def is_other_axis(name: object) -> bool:
    """Return whether an input is the position of an axis by its number.

    Examples
    --------
    >>> is_other_axis("position_15"), is_other_axis("position_16"), is_other_axis("position")
    (True, False, False)
    """
    found = _AXIS.fullmatch(name) if isinstance(name, str) else None
    return found is not None and int(found[1]) <= MOST_AXES


def bound(
    model: Model,
    heat: Sequence[str] = (),
    *,
    axes: int = MOST_AXES,
    margin_mm: float = 0.0,
) -> tuple[Any, ...]:
    """Return a model as the kernels take it, with room of its own for inputs and memory.

    A model with an ``unsure_mm`` is reduced by so much (`rtec.predictors.Cautious`).

    Parameters
    ----------
    model
        The model of an axis.
    heat
        Inputs that sensors of heat give, in the order in which they are read (`heat_inputs`).
    axes
        Number of axes whose positions the PC knows.
    margin_mm
        How far beyond the ends of its positions a model is still asked. A curve holds its ends.

    Raises
    ------
    ArgumentError
        An input that no sensor gives, or a function that cannot be compiled.

    Examples
    --------
    >>> from rtec.predictors import NoError
    >>> _, _, wanted, *_ = bound(NoError())
    >>> wanted.tolist()
    [0, 1]
    """
    names = tuple(model.inputs)
    known = _PLACES | {axis_name(axis + 1): _kernels.AXES + axis for axis in range(axes)}
    known |= {name: k for k, name in enumerate(heat, _kernels.SENSORS)}
    for name in names:
        if name not in known:
            several = axis_name(1) + (f" to {axis_name(axes)}" if axes > 1 else "")
            allowed = f"what is sensed: {', '.join([*_PLACES, several, *heat])}"
            raise ArgumentError("model", f"an input {name!r}"[:80], allowed, nearest(name, known))
    ranges = dict(model.ranges)
    if not hasattr(model, "error_mm"):
        low_mm, high_mm = model.range_mm
        ranges["position"] = low_mm - margin_mm, high_mm + margin_mm
    low, high = np.array([ranges.get(name, (-np.inf, np.inf)) for name in names], dtype=np.float64).reshape(-1, 2).T
    numbers, memory = (np.array(values, dtype=np.float64) for values in (model.numbers, model.memory))
    return (
        address_of_function(model.function, ("numbers", "inputs", "memory", "sd"), "the error in mm"),
        numbers,
        np.array([known[name] for name in names], dtype=np.int64),
        low.copy(),
        high.copy(),
        np.zeros(len(names)),
        memory,
        float(getattr(model, "unsure_mm", 0.0)),
        np.full(1, np.nan),
        np.full(len(heat), np.nan),
        np.full(1, _kernels.INSIDE),
    )


def outside_input(model: Model, place: int) -> str:
    """Return what an input that was outside its range is called; empty where none was.

    Examples
    --------
    >>> from rtec.predictors import growth
    >>> model = growth("screw", 0.002)
    >>> outside_input(model, 0), outside_input(model, -1), outside_input(model, 1)
    ('temperature_screw', '', 'no answer within its ranges')
    """
    if place == _kernels.INSIDE:
        return ""
    return (*model.inputs, "no answer within its ranges")[place]


def check_axis(model: Model, axis: int) -> None:
    """Refuse a predictor for an axis that it takes for another one.

    Raises
    ------
    ArgumentError
        Its position is given by its number, too: then it was made for another axis.
    """
    if hasattr(model, "error_mm") and axis_name(axis) in model.inputs:
        found = f"a predictor that looks at {axis_name(axis)}"
        raise ArgumentError(f"model of axis {axis}", found, "one that was made for this axis, which is its position")


def bound_curve(curve: Model, name: str = "curve") -> tuple[Any, ...]:
    """Return a curve as the kernels take it: a model of position and direction alone, which remembers nothing.

    ``name`` is what an error message calls it.
    """
    check_curve(curve, name)
    return bound(curve)


def check_curve(curve: Model, name: str, *, hint: str = "") -> None:
    """Refuse a model that looks at more than position and direction, or remembers.

    Raises
    ------
    ArgumentError
        Called ``name``, with a hint what to do.
    """
    if tuple(curve.inputs) != CURVE or np.size(curve.memory):
        found = f"a model of {', '.join(curve.inputs)}" + (" with a memory" if np.size(curve.memory) else "")
        raise ArgumentError(name, found[:200], f"a curve: of {' and '.join(CURVE)} alone", hint)


def rests(model: Model) -> bool:
    """Return whether a model says the same as long as the axis stands still."""
    return set(model.inputs) <= set(CURVE) and np.size(model.memory) == 0


def sees_axes(model: Model) -> bool:
    """Return whether a model looks at positions of axes by their numbers."""
    return any(name.startswith(OF_AXIS) for name in model.inputs)


def sensor_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of temperature sensors.

    Raises
    ------
    ArgumentError
        One twice, or one that is no name.

    Examples
    --------
    >>> sensor_names(["screw", "bed"])
    ('screw', 'bed')
    """
    found = (names,) if isinstance(names, str) else tuple(names)
    for name in found:
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise ArgumentError("temperatures", repr(name)[:60], "1 to 32 small letters, digits and underscores")
    if len(set(found)) != len(found):
        raise ArgumentError("temperatures", ", ".join(found)[:200], "each name once")
    return found


def heat_inputs(course: HeatCourse) -> tuple[str, ...]:
    """Return the inputs that a course of heat gives to models, in the order in which the PC reads them.

    Raises
    ------
    ArgumentError
        A thermometer with a name that is none.

    Examples
    --------
    >>> heat_inputs(HeatCourse(thermometers={"screw": [20.0], "bed": [20.0]}))
    ('spindle_speed', 'temperature_screw', 'temperature_bed')
    """
    return (SPINDLE_SPEED, *(OF_TEMPERATURE + name for name in sensor_names(tuple(course.thermometers))))
