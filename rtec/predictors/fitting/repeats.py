"""Repeats of one motion as one record with less noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import make_smoothing_spline

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.sequences import Sequences

SMOOTHING = 19.0
"""Of `averaged`: as MATLAB's ``csaps`` with p = 0.05 on sample numbers, (1 - p) / p. At 1 kHz half of what has 76 Hz
passes."""


def averaged(runs: Sequence[Sequences], *, smoothing: float = SMOOTHING) -> Sequences:
    """Return the mean of repeats, its output smoothed by a cubic spline.

    Parameters
    ----------
    runs
        Repeats of the same motion, each from its first sample on.
    smoothing
        Weight of the squared second derivative over sample numbers; 0 smooths nothing.

    Raises
    ------
    ArgumentError
        No run, repeats of other lengths or inputs, or less than five samples to smooth.

    References
    ----------
    Erwinski et al. 2016: ten repeats averaged and smoothed. The paper does not say in what unit the abscissa was; in
    seconds nothing would be left.

    Examples
    --------
    >>> outputs = np.array([[1.0] * 5, [2.0] * 5])
    >>> runs = [Sequences(inputs=np.ones((5, 1)), output=y, names=("u",), period_s=1e-3) for y in outputs]
    >>> averaged(runs).output.round(12).tolist()
    [1.5, 1.5, 1.5, 1.5, 1.5]
    """
    if not runs:
        raise ArgumentError("runs", None, "one repeat or more")
    first = runs[0]
    for run in runs[1:]:
        for name in ("names", "period_s", "unit", "starts"):
            if getattr(run, name) != getattr(first, name):
                raise ArgumentError("runs", "repeats that differ", f"the same {name}")
        if len(run) != len(first):
            raise ArgumentError("runs", f"{len(run)} and {len(first)} samples", "repeats of the same length")
    if not 0.0 <= smoothing < np.inf:
        raise ArgumentError("smoothing", f"{smoothing:g}", "a weight from 0")
    mean = replace(
        first,
        inputs=np.mean([run.inputs for run in runs], axis=0),
        output=np.mean([run.output for run in runs], axis=0),
    )
    return replace(mean, output=np.concatenate([_smooth(run.output, smoothing) for run in mean.runs()]))


def _smooth(output: Floats, smoothing: float) -> Floats:
    if smoothing == 0.0:
        return output
    if output.size < 5:
        raise ArgumentError("runs", f"{output.size} samples", "5 or more, to be smoothed")
    at = np.arange(output.size, dtype=np.float64)
    return np.asarray(make_smoothing_spline(at, output, lam=smoothing)(at))
