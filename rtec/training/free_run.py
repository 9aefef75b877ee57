"""What a free run of a model of motion leaves of a log, in figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors.fitting.linear_models import free_run_errors
from rtec.predictors.sequences import DynamicModel, Sequences


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeRun:
    """Errors of a free run, in the unit of the output.

    Parameters
    ----------
    samples
        That were predicted.
    rms, rms_first_tenth, rms_last_tenth
        Root mean square error of all of them, of the first and of the last tenth: whether errors grow.
    largest
        Largest error.
    coverage
        Share of the errors within the interval that was asked about, None where none was.
    """

    samples: int
    rms: float
    rms_first_tenth: float
    rms_last_tenth: float
    largest: float
    coverage: float | None

    @property
    def stable(self) -> bool:
        """Whether it came to its end with numbers."""
        return bool(np.isfinite(self.rms))


def free_run_of(model: DynamicModel, data: Sequences, interval: float | None = None) -> FreeRun:
    """Return the figures of a free run, without the samples that it starts from.

    Parameters
    ----------
    model, data
        What predicts, and what it is held against.
    interval
        Half width, for the coverage.

    Raises
    ------
    ArgumentError
        No run is longer than the samples that the model starts from, or the log is not of its kind.

    Examples
    --------
    >>> from rtec.predictors.linear_models import Held
    >>> data = Sequences(inputs=np.zeros((20, 1)), output=np.arange(20.0), names=("command",), period_s=1e-3)
    >>> run = free_run_of(Held(constant=9.5), data, interval=5.0)
    >>> run.rms_first_tenth, run.largest, run.coverage
    (9.013878188659973, 9.5, 0.5)
    """
    left = free_run_errors(model, data)
    if not left.size:
        problem = f"{len(data)} samples in {len(data.starts)} runs"
        raise ArgumentError("log", problem, f"a run of more than {model.lags} samples, from which the model starts")
    tenth = max(1, left.size // 10)
    with np.errstate(over="ignore"):
        return FreeRun(
            samples=int(left.size),
            rms=_rms(left),
            rms_first_tenth=_rms(left[:tenth]),
            rms_last_tenth=_rms(left[-tenth:]),
            largest=float(np.abs(left).max()),
            coverage=None if interval is None else float(np.mean(np.abs(left) <= interval)),
        )


def _rms(left: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(left**2)))
