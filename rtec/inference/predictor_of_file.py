"""Whatever file says what the error of an axis is: a trained predictor, or a model of effects."""

from __future__ import annotations

import math
from pathlib import Path

from rtec.effects import Units
from rtec.errors import ArgumentError
from rtec.inference.model_file import read_model
from rtec.inference.static_predictor import LeftOut, predictor_of_model
from rtec.predictors import Cautious, Predictor, is_predictor_file, read_predictor
from rtec.sections import read_toml


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
        Written by ``rtec train`` or ``rtec diagnose --save``.
    low_mm, high_mm
        A model of effects is tabled over this range.
    cautious
        Whether the predictor is believed no more than its interval supports.

    Returns
    -------
    predictor, left out
        And the effects of a model that it cannot hold.

    Raises
    ------
    RtecError
        A file that cannot be read, a model that predicts no deviation, or caution with a file that has no interval.
    """
    if is_predictor_file(path):
        known = read_predictor(path)
        if not cautious:
            return known.predictor, ()
        if math.isfinite(known.interval_mm):
            return Cautious(predictor=known.predictor, unsure_mm=known.interval_mm), ()
    if cautious:
        allowed = "a file with an interval, as rtec train writes it for tables and networks"
        raise ArgumentError("cautious", f"{path} without an interval", allowed)
    clock = read_toml(path).get("clock")
    model = read_model(path, Units("mm", "mm", clock if isinstance(clock, str) else "s"))
    return predictor_of_model(model, low_mm, high_mm)
