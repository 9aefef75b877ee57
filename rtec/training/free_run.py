"""What a free run of a model of motion leaves of a log, in figures."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors.fitting.linear_models import free_run_errors
from rtec.predictors.sequences import DynamicModel, Sequences

_STRETCH, _STRETCHES = 500, 8  # samples at least of a stretch that starts anew, and the most of them
_BACK, _NEAR = 1.5, 0.02  # times the usual error, and share of the output, within which a moved start has come back


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


def comes_back(model: DynamicModel, data: Sequences) -> bool:
    """Whether free runs that start from a moved output come back to where the others go.

    A network may have several motions for the same inputs. It then predicts well until something takes it from one to
    another, which a single free run need not show.

    Parameters
    ----------
    model, data
        What was trained, and on what: it is cut into stretches, each of which starts from measured outputs that are
        moved by half their range, up and down.

    Examples
    --------
    >>> from rtec.predictors.linear_models import Arx
    >>> kind = {"names": ("command",), "period_s": 1e-3, "unit": "um"}
    >>> still = Sequences(inputs=np.ones((2000, 1)), output=np.zeros(2000), names=kind["names"], period_s=1e-3)
    >>> tank, integrator = (Arx(**kind, feedback=[pole], forward=[[0.0, 1.0]]) for pole in (0.5, 1.0))
    >>> [comes_back(model, replace(still, output=model.free_run(still))) for model in (tank, integrator)]
    [True, False]
    """
    count = int(np.clip(len(data) // _STRETCH, 1, _STRETCHES))
    begins = sorted({*data.starts, *np.linspace(0, len(data), count, endpoint=False).astype(int).tolist()})
    late = np.zeros(len(data), dtype=np.bool_)
    for begin, end in itertools.pairwise([*begins, len(data)]):
        late[(begin + max(end, begin + 2 * model.lags)) // 2 : end] = True
    cut = replace(data, starts=tuple(begins))
    usual = _rms((data.output - model.free_run(cut))[late])
    half, most = 0.5 * float(np.ptp(data.output)), _BACK * usual + _NEAR * float(np.std(data.output))
    with np.errstate(over="ignore", invalid="ignore"):
        for move in (-half, half):
            moved = data.output.copy()
            for begin in begins:
                moved[begin : begin + model.lags] += move
            if not _rms((data.output - model.free_run(replace(cut, output=moved)))[late]) <= most:
                return False
    return True


def _rms(left: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(left**2)))
