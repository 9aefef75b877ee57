"""Whether a lag is the servo's or the log's: channels of a log are often shifted by a few whole samples.

A delay and a lag of the servo differ by no more than the form at accelerations, and by a number of samples that is
whole. So the shift is tried before the lag counts as the servo's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats, Observable
from rtec.inference.model import Model
from rtec.inference.results import Diagnosis, Experiment, Verdict

LAG, ACCELERATION_LAG = "servo_lag", "acceleration_lag"
SKEW = "skew_of_log"
"""What stands beside a servo lag: no effect of the axis, and no name of the library."""
MOST_SAMPLES = 10
"""By which the channels of a log are shifted; a controller that logs every cycle is a few cycles late."""
WHOLE = 0.15
"""Of a sample, that a shift may leave of a lag: the servo may have a little of its own."""
OF_FIRST_ORDER = 0.75
"""Of the acceleration term that a lag of first order has beyond a delay's, from which on it is no delay."""
_FEWEST = 50
EXPERIMENT = (
    "log the same move at another sampling rate, or with another gain or feed-forward of the position loop: a skew "
    "of the log stays the same number of samples, a lag of the servo follows the loop"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Skew:
    """A shift of the actual position against the command that explains a lag as well."""

    samples: int
    """By which the actual position is late; negative: early."""
    rms_before: float
    """Of the deviation as it was logged, without the other effects, in the observed unit inside."""
    rms_shifted: float
    """The same with the channel shifted back, and no lag."""
    rms_rest: float
    """The same with the lag that is left then."""
    lag_s: float
    """That lag, which is the servo's."""
    rms_lag: float
    """With a lag of the servo, and no shift."""


def tried_as_skew(diagnosis: Diagnosis) -> Diagnosis:
    """Return a diagnosis in which a lag that was found is tied with a skew of the log, where that explains as much.

    What is UNKNOWN stays so, with a note.
    """
    dataset, given = diagnosis.dataset, diagnosis.start.names
    skew = skew_of(dataset, diagnosis.model) if LAG in diagnosis.effects and LAG not in given else None
    if skew is None:
        return diagnosis
    words = f"a shift of the actual channel by {_samples(skew)} explains it as well"
    candidates = tuple(
        replace(one, tied_with=(*one.tied_with, SKEW), reason=f"{one.reason}; {words}")
        if one.effect == LAG and one.accepted
        else one
        for one in diagnosis.candidates
    )
    noted = replace(diagnosis, candidates=candidates, notes=(*diagnosis.notes, _note(skew, dataset)))
    if diagnosis.verdict not in (Verdict.NAMED, Verdict.LIKELY):
        return noted
    return replace(noted, verdict=Verdict.TIED, experiment=Experiment(text=EXPERIMENT, rivals=(LAG, SKEW)))


def skew_of(dataset: Dataset, model: Model) -> Skew | None:
    """Return the shift by whole samples that explains the lag of a model as well as the servo does, or None.

    Notes
    -----
    Behind a delay T the position is ``x(t - T) = x - T v + T² a / 2 - ...``, behind a lag of first order
    ``x - T v + T² a - ...``: nothing but the acceleration tells them apart. With the channel shifted back by N
    samples and every other effect fitted again, the lag left is at most 0.15 of a sample, no more is left than with
    the lag of the servo, and what goes with the acceleration is not that of a lag of first order.
    """
    c = dataset.coordinates
    if not c.moving or c.time_s is None or dataset.coordinate != "target" or dataset.resample is not None:
        return None
    if dataset.observable is not Observable.DEVIATION or c.velocity is None or c.acceleration is None:
        return None
    step_s = float(np.median(np.diff(c.time_s)))
    own = next(term for term in model.terms if term.name == LAG)
    samples = round(float((own.amplitudes or (0.0,))[0]) / step_s) if step_s > 0.0 else 0
    if not 1 <= abs(samples) <= MOST_SAMPLES:
        return None
    here, there = _pairs(c.time_s, c.run, samples, step_s)
    if here.size < _FEWEST:
        return None
    others = [
        dataset.columns(term.effect, term.shape)
        for term in model.terms
        if term.shape is not None and term.name not in (LAG, ACCELERATION_LAG)
    ]
    beside = np.hstack([np.ones((c.rows, 1)), *others])[here]
    lag, acceleration = -c.velocity[here, None], -c.acceleration[here, None]
    logged = dataset.observed[here]
    shifted = c.position[there] + dataset.observed[there] - c.position[here]
    with_lag = _fitted(np.hstack([lag, beside]), logged)
    back = _fitted(np.hstack([lag, beside]), shifted)
    bent = _fitted(np.hstack([acceleration, lag, beside]), shifted)
    of_first_order = (samples * step_s) ** 2 / 2.0
    if (
        back.rms > with_lag.rms
        or abs(back.first) > WHOLE * step_s
        or abs(bent.first) > OF_FIRST_ORDER * of_first_order + 3.0 * bent.error
    ):
        return None
    return Skew(
        samples=samples,
        rms_before=_fitted(beside, logged).rms,
        rms_shifted=_fitted(beside, shifted).rms,
        rms_rest=back.rms,
        lag_s=back.first,
        rms_lag=with_lag.rms,
    )


def _note(skew: Skew, dataset: Dataset) -> str:
    unit, factor = dataset.units.shown
    before, shifted, rest, lag = (
        f"{factor * rms:.3g}" for rms in (skew.rms_before, skew.rms_shifted, skew.rms_rest, skew.rms_lag)
    )
    return (
        f"lag of the servo or skew of the log: a shift of the actual channel by {_samples(skew)} explains it as "
        f"well. It leaves {shifted} of {before} {unit} RMS, and {rest} {unit} beside a lag of "
        f"{1e3 * skew.lag_s:.2g} ms; a lag alone leaves {lag} {unit}"
    )


def _samples(skew: Skew) -> str:
    return f"{skew.samples} sample" + ("s" if abs(skew.samples) > 1 else "")


def _pairs(
    time_s: Floats, run: NDArray[np.int64], samples: int, step_s: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows, and the rows of the same run so many samples later; those that have none are left out."""
    here = np.arange(max(0, -samples), time_s.size - max(0, samples))
    there = here + samples
    near = np.abs(time_s[there] - time_s[here] - samples * step_s) < 0.1 * step_s
    kept = near & (run[here] == run[there])
    return here[kept], there[kept]


@dataclass(frozen=True, slots=True)
class _Fit:
    first: float
    """Of the first column."""
    error: float
    """Its standard error, as of residuals that know their neighbours."""
    rms: float


def _fitted(table: Floats, observed: Floats) -> _Fit:
    scale = np.sqrt((table**2).sum(axis=0))
    scale = np.where(scale > 0.0, scale, 1.0)
    found = np.linalg.lstsq(table / scale, observed, rcond=1e-9)[0]
    left = observed - table / scale @ found
    whole = float(left @ left)
    near = max(float(left[1:] @ left[:-1]) / whole, 0.0) if whole > 0.0 else 0.0
    free = max((observed.size - table.shape[1]) * (1.0 - near) / (1.0 + near), 1.0)
    spread = np.linalg.pinv((table / scale).T @ (table / scale))[0, 0] * observed.size
    error = np.sqrt(whole / observed.size * spread / free) / scale[0]
    return _Fit(float(found[0] / scale[0]), float(error), float(np.sqrt(whole / observed.size)))
