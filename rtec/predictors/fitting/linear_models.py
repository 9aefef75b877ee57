"""Linear models of motion by least squares; the orders of ARX by its free run over data that it has not seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.linear_models import Arx, ServoLag
from rtec.predictors.sequences import DynamicModel, Sequences

ORDERS = (1, 2, 3, 4, 6, 8)
"""Delays of the output, and of each input, that are tried."""


def free_run_rms(model: DynamicModel, data: Sequences) -> float:
    """Return the root mean square error of a free run, without the samples that it starts from.

    Infinite where it diverges, not a number where no run is longer than those samples.
    """
    left = free_run_errors(model, data)
    with np.errstate(over="ignore"):
        rms = float(np.sqrt(np.mean(left**2))) if left.size else np.nan
    return rms if np.isfinite(rms) or not left.size else np.inf


def free_run_errors(model: DynamicModel, data: Sequences) -> Floats:
    """Return output less free run, shape (samples that are predicted,)."""
    predicted = np.ones(len(data), dtype=np.bool_)
    for start in data.starts:
        predicted[start : start + model.lags] = False
    left: Floats = (data.output - model.free_run(data))[predicted]
    return left


def fit_servo_lag(data: Sequences) -> ServoLag:
    """Return the lags behind velocity and acceleration that fit an error best.

    Raises
    ------
    ArgumentError
        Velocity or acceleration is none of the inputs.
    """
    bare = ServoLag(names=data.names, period_s=data.period_s, unit=data.unit)
    columns = [data.inputs[:, data.names.index(name)] for name in ("velocity", "acceleration")]
    table = np.stack([np.ones(len(data)), *columns], axis=1)
    found = np.linalg.lstsq(table, data.output, rcond=None)[0].tolist()
    return ServoLag(
        names=bare.names,
        period_s=bare.period_s,
        unit=bare.unit,
        constant=found[0],
        per_velocity=found[1],
        per_acceleration=found[2],
    )


def fit_arx(data: Sequences, feedback: int, forward: int) -> Arx:
    """Return an ARX model with so many delays of the output, and of each input from 0 on.

    Raises
    ------
    ArgumentError
        Fewer samples than numbers to fit.

    Notes
    -----
    Least squares of the prediction from measured outputs (series-parallel), on scaled columns.

    Examples
    --------
    >>> u = np.random.default_rng(0).uniform(-1.0, 1.0, 99)
    >>> y = np.zeros(99)
    >>> for t in range(1, 99):
    ...     y[t] = 0.8 * y[t - 1] + 0.3 * u[t - 1]
    >>> data = Sequences(inputs=u[:, None], output=y, names=("command",), period_s=1e-3)
    >>> found = fit_arx(data, 1, 2)
    >>> found.feedback.round(9), found.forward.round(9) + 0.0
    (array([0.8]), array([[0. , 0.3]]))
    """
    tables, wanted = [], []
    lags, channels = max(feedback, forward - 1), len(data.names)
    for run in data.runs():
        end = len(run)
        if end <= lags:
            continue
        columns = [run.output[lags - delay : end - delay] for delay in range(1, feedback + 1)]
        columns += [
            run.inputs[lags - delay : end - delay, channel] for channel in range(channels) for delay in range(forward)
        ]
        tables.append(np.stack([*columns, np.ones(end - lags)], axis=1))
        wanted.append(run.output[lags:])
    parameters = feedback + channels * forward + 1
    samples = sum(map(len, wanted))
    if samples < parameters:
        raise ArgumentError("samples", f"{samples} samples", f"{parameters} or more, one for each number")
    table = np.concatenate(tables)
    scale = np.sqrt(np.mean(table**2, axis=0))
    scale[scale == 0.0] = 1.0
    found = np.linalg.lstsq(table / scale, np.concatenate(wanted), rcond=None)[0] / scale
    return Arx(
        names=data.names,
        period_s=data.period_s,
        unit=data.unit,
        feedback=found[:feedback],
        forward=found[feedback:-1].reshape(channels, forward),
        constant=float(found[-1]),
    )


def choose_arx(train: Sequences, validate: Sequences, orders: Sequence[int] = ORDERS) -> Arx:
    """Return the ARX model whose free run over other data is best, of all pairs of orders.

    Raises
    ------
    ArgumentError
        No pair of orders has enough samples, or a free run that stays finite.
    """
    best, lowest = None, np.inf
    for feedback in orders:
        for forward in orders:
            try:
                found = fit_arx(train, feedback, forward)
            except ArgumentError:
                continue
            rms = free_run_rms(found, validate)
            if rms < lowest:
                best, lowest = found, rms
    if best is None:
        raise ArgumentError("ARX", "diverged in free run", "a longer log", f"orders {orders} were tried")
    return best
