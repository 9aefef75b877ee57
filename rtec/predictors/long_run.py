"""Whether a model that feeds its own output back holds over a long run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.narx import Narx
from rtec.predictors.sequences import DynamicModel, Sequences

PLACES = 2000
"""Samples of a run at which the recurrence is linearised, evenly spread."""
DISTURBED = 0.01
"""By which share of the output's range a start is moved to see whether that is forgotten."""
MOST_GROWTH = 3.0
"""Of the error from the first tenth of a run to the last, beyond which it is no longer a matter of the motion."""
SMALL = 0.1
"""An error of the last tenth below this share of the output's standard deviation has not grown in any case."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stability:
    """How a free run goes over some data."""

    largest_modulus: float
    """Of the eigenvalues of the linearised recurrence, at the worst place of the run; below 1 each disturbance fades
    there. Not a number for a model that does not say how it depends on its past."""
    growth: float
    """What is left at the end of a disturbance of the start, as its share; infinite where a run diverges."""
    rms_first_tenth: float
    """Error of the free run, in the unit of the output."""
    rms_last_tenth: float

    stable: bool
    """Whether the run comes to its end, forgets how it began, and does not drift away from what was measured: the
    error of the last tenth is at most `MOST_GROWTH` times that of the first, or `SMALL`."""


def stability(model: DynamicModel, data: Sequences) -> Stability:
    """Judge the free run of a model over the longest run of the data.

    Parameters
    ----------
    model
        Trained on data of the same inputs and period.
    data
        At least twenty samples more than the model has lags, in one run.

    Raises
    ------
    ArgumentError
        No run that is long enough.

    Examples
    --------
    >>> from rtec.predictors.narx import NarxShape
    >>> shape = NarxShape(channels=1, neurons=1, input_delays=(0,), feedback_delays=(1,))
    >>> low_pass = Narx(shape=shape, names=("command",), period_s=1e-3, middle=[0.0, 0.0], half=[1.0, 1.0],
    ...                 weights=[0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5])
    >>> steady = Sequences(inputs=np.ones((99, 1)), output=np.ones(99), names=("command",), period_s=1e-3)
    >>> found = stability(low_pass, steady)
    >>> found.stable, found.largest_modulus
    (True, 0.5)
    """
    run = max(data.runs(), key=len)
    if len(run) < model.lags + 20:
        raise ArgumentError("data", f"{len(run)} samples in the longest run", f"{model.lags + 20} or more")
    output = model.free_run(run)
    tenth = (len(run) - model.lags) // 10
    error = output[model.lags :] - run.output[model.lags :]
    first, last = (float(np.sqrt(np.mean(part**2))) for part in (error[:tenth], error[-tenth:]))
    whole = bool(np.isfinite(output).all())
    growth = _growth(model, run, output) if whole else np.inf
    drifted = not last <= max(MOST_GROWTH * first, SMALL * float(run.output.std()))
    return Stability(
        largest_modulus=_largest_modulus(model, run, output) if isinstance(model, Narx) and whole else np.nan,
        growth=growth,
        rms_first_tenth=first,
        rms_last_tenth=last,
        stable=growth < 1.0 and not drifted,
    )


def _growth(model: DynamicModel, run: Sequences, output: Floats) -> float:
    """Return what is left of a start that was moved: of its last tenth, the largest difference."""
    moved = run.output.copy()
    step = DISTURBED * float(np.ptp(run.output))
    moved[: model.lags] += step
    again = model.free_run(
        Sequences(inputs=run.inputs, output=moved, names=run.names, period_s=run.period_s, unit=run.unit)
    )
    tenth = (len(run) - model.lags) // 10
    left = np.abs(again - output)[-tenth:].max() / step if step > 0.0 else 0.0
    return float(left) if np.isfinite(left) else np.inf


def _largest_modulus(narx: Narx, run: Sequences, output: Floats) -> float:
    """Return the largest modulus of the eigenvalues of the companion matrices along a free run."""
    shape = narx.shape
    inputs, _ = narx.scaled(run)
    past = (output - narx.middle[-1]) / narx.half[-1]
    at = np.unique(np.linspace(narx.lags, len(run) - 1, PLACES).astype(np.int64))
    seen = [inputs[at - delay, channel] for channel in range(shape.channels) for delay in shape.input_delays]
    seen += [past[at - delay] for delay in shape.feedback_delays]
    order = shape.feedback_delays[-1]
    companions = np.zeros((at.size, order, order))
    companions[:, 0, np.array(shape.feedback_delays) - 1] = narx.kernel().feedback_slopes(np.stack(seen, axis=1))
    companions[:, np.arange(1, order), np.arange(order - 1)] = 1.0
    return float(np.abs(np.linalg.eigvals(companions)).max())
