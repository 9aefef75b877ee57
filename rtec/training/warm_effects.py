"""Named effects of heat as a model of a warm machine: what ``rtec diagnose`` finds on the training part."""

from __future__ import annotations

import time

import numpy as np

from rtec.dataset.load import load_dataset
from rtec.dataset.warm_log import SPINDLE, UM_PER_MM
from rtec.effects._heat import HeatShape
from rtec.effects.thermal_shift import ThermalShift
from rtec.inference.diagnose import diagnose
from rtec.inference.model import Model
from rtec.metrology import Measurement
from rtec.metrology.measurement import Column
from rtec.predictors.fitting.warm.linear import fit_least_squares
from rtec.predictors.fitting.warm.rows import thin_by_blocks
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature
from rtec.training.warm_features import FeatureSet, described
from rtec.training.warm_parts import Places
from rtec.training.warm_task import NoFigureError, WarmFit, WarmTask, fitted_channel

DIAGNOSED_ROWS = 500
"""That a diagnosis sees; it takes seconds for each channel."""


def fit_effects(task: WarmTask) -> WarmFit:
    """Fit the effects of heat that a diagnosis names, each channel its own; their sizes are fitted by least squares.

    Raises
    ------
    NoFigureError
        The time is over before every channel has had its diagnosis, or one names no effect of heat.
    """
    parts = task.parts
    rows = parts.rows[thin_by_blocks(parts.block, most_rows=min(DIAGNOSED_ROWS, parts.rows.size))]
    channels, notes = {}, []
    for done, name in enumerate(parts.log.outputs):
        if done and time.perf_counter() > task.until_s:
            many = len(parts.log.outputs)
            raise NoFigureError(f"the time was over after {done} of {many} channels: --budget gives more")
        result = diagnose(load_dataset(_measurement(task, name, rows), observe=name))
        features = features_of(result.model)
        others = [term.effect.name for term in result.model.terms if not isinstance(term.effect, ThermalShift)]
        if not features:
            raise NoFigureError(f"{name}: the diagnosis names no effect of heat ({result.verdict.value})")
        channels[name], _ = fitted_channel(task, name, features, parts.rows, fit_least_squares)
        said = f"{name}: {result.verdict.value}, thermal_shift. {described(features)}"
        notes.append(said + (f" Not taken: {', '.join(dict.fromkeys(others))}." if others else ""))
    return WarmFit(channels=channels, notes=tuple(notes))


def features_of(model: Model) -> FeatureSet:
    """Return the features that the effects of heat of a model follow."""
    found = []
    for term in model.terms:
        if isinstance(term.effect, ThermalShift) and isinstance(term.shape, HeatShape):
            turns = term.shape.sensor == SPINDLE
            found.append(Feature(of=SPINDLE_SPEED if turns else term.shape.sensor, lag_s=term.shape.lag, heat=turns))
    return tuple(dict.fromkeys(found))


def _measurement(task: WarmTask, name: str, rows: Places) -> Measurement:
    """Return rows of the training part with one channel, as a file would hold them."""
    log = task.parts.log
    columns = [Column("time", "s", log.time_s[rows]), Column(name, "mm", log.outputs[name][rows] / UM_PER_MM)]
    for of, values in log.inputs.items():
        quantity, unit = (SPINDLE, "rpm") if of == SPINDLE_SPEED else (of, "degc")
        columns.append(Column(quantity, unit, values[rows]))
    stretch = np.searchsorted(np.array(log.starts), rows, side="right").astype(np.float64)
    if len(log.starts) > 1:
        columns.append(Column("run", "", stretch))
    return Measurement(source=log.source, facts={}, columns={one.quantity: one for one in columns}, unknown={})
