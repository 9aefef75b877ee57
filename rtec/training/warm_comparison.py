"""What a model of a warm machine leaves of another log."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtec.dataset.warm_log import WarmLog, warm_log
from rtec.effects import Floats
from rtec.errors import ArgumentError
from rtec.metrology import ColumnChoices
from rtec.metrology.tables.choices import NO_CHOICES
from rtec.predictors.motion_file import MM_OF
from rtec.predictors.warm.warm_model import WarmModel

_UM_PER_MM = 1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmResidual:
    """Figures in um, of the rows for which the model has an answer."""

    log: WarmLog
    rows: int
    """With an answer."""
    unanswered: int
    rms_um: float
    mean_um: float
    """Of the residual: the zero of another log may be another one."""
    largest_um: float
    spread_um: float
    """Of the log about its own mean: what is left without a model."""
    outside: int
    """Rows with an input outside its trained range."""
    rms_inside_um: float | None
    """Of the other rows; None where there are none."""
    coverage: float | None
    """Share of the rows within the interval; None where the model states none."""


def warm_residual(model: WarmModel, source: str | Path, *, choices: ColumnChoices = NO_CHOICES) -> WarmResidual:
    """Return what a model leaves of a log, which it follows from the first row of each stretch.

    Parameters
    ----------
    model
        Of a displacement.
    source, choices
        As of `rtec.dataset.warm_log.warm_log`.

    Raises
    ------
    FileFormatError
        A log without the displacement, or without an input of the model.
    ArgumentError
        A model of no displacement, or one that answers nowhere.
    """
    if model.unit not in MM_OF:
        raise ArgumentError("--model", f"of {model.observe} in {model.unit}", "a model of a displacement in um or mm")
    log = warm_log(source, observe=model.observe, inputs=model.inputs[1:], fewest_blocks=1, choices=choices)
    predicted, _ = model.predict(log.time_s, log.inputs, log.starts)
    left = next(iter(log.outputs.values())) - predicted * MM_OF[model.unit] * _UM_PER_MM
    answered = np.isfinite(left)
    if not answered.any():
        raise ArgumentError("--model", "no row with an answer", "a log within what the model was trained for")
    return _figures(model, log, left, answered)


def _figures(model: WarmModel, log: WarmLog, left: Floats, answered: np.ndarray) -> WarmResidual:
    inside = answered.copy()
    for name, (low, high) in model.ranges.items():
        inside &= (log.inputs[name] >= low) & (log.inputs[name] <= high)
    found = left[answered]
    half_um = model.interval_mm * _UM_PER_MM
    return WarmResidual(
        log=log,
        rows=int(found.size),
        unanswered=int(left.size - found.size),
        rms_um=_rms(found),
        mean_um=float(found.mean()),
        largest_um=float(np.abs(found).max()),
        spread_um=float(np.std(next(iter(log.outputs.values())))),
        outside=int((answered & ~inside).sum()),
        rms_inside_um=_rms(left[inside]) if inside.any() else None,
        coverage=None if model.interval is None else float((np.abs(found) <= half_um).mean()),
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
