"""Whatever file says what the error of an axis is: a trained predictor, or a model of effects."""

from __future__ import annotations

import math
from pathlib import Path

from rtec.effects import Units
from rtec.errors import ArgumentError
from rtec.inference.model import Model
from rtec.inference.model_file import read_model
from rtec.inference.static_predictor import LeftOut, predictor_of_model
from rtec.io import read_toml
from rtec.predictors import Cautious, Predictor, is_predictor_file, read_predictor


def axis_of_file(path: Path) -> int | None:
    """Return the number of the axis that a file says it is of; None where it says none.

    Raises
    ------
    RtecError
        As for `predictor_of_file`.
    """
    return read_predictor(path).axis if is_predictor_file(path) else None


def predictor_of_file(
    path: Path, low_mm: float, high_mm: float, *, cautious: bool = False
) -> tuple[Predictor, tuple[LeftOut, ...]]:
    """Return the predictor of a TOML file.

    Parameters
    ----------
    path
        Written by ``rtec train`` or ``rtec diagnose --save``; the latter states no interval.
    low_mm, high_mm
        A model of effects is tabled over the part of this range that it was fitted to, where it says so.
    cautious
        Whether corrections are reduced to what the predictor's interval supports.

    Returns
    -------
    predictor, left out
        And the effects of a model that it cannot hold.

    Raises
    ------
    RtecError
        A file that cannot be read, a model that predicts no deviation, or caution with a file that has no interval.
    """
    left_out: tuple[LeftOut, ...] = ()
    if is_predictor_file(path):
        known = read_predictor(path)
        predictor, interval_mm = known.predictor, known.interval_mm
    else:
        clock = read_toml(path).get("clock")
        model = read_model(path, Units("mm", "mm", clock if isinstance(clock, str) else "s"))
        predictor, left_out = predictor_of_model(model, *_known_mm(model, low_mm, high_mm))
        interval_mm = math.inf if model.interval is None else model.interval
    if not cautious:
        return predictor, left_out
    if not math.isfinite(interval_mm):
        allowed = "a file with an interval, as rtec train writes it where enough places tell"
        raise ArgumentError("cautious", f"{path} without an interval", allowed)
    return Cautious(predictor=predictor, unsure_mm=interval_mm), left_out


def _known_mm(model: Model, low_mm: float, high_mm: float) -> tuple[float, float]:
    """Return the part of a range in which a model was measured; beyond it a slope or a map would go on for ever."""
    if model.range is None:
        return low_mm, high_mm
    low, high = max(low_mm, model.range[0]), min(high_mm, model.range[1])
    return (low, high) if low < high else model.range
