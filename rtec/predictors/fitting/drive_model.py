"""The physical model of a drive, fitted by simulation: what is compared is its free run."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.drive_model import MOTION, NUMBERS, DriveModel
from rtec.predictors.sequences import Sequences

_CUTOFFS = (0.005, 0.01, 0.02, 0.04, 0.08, 0.16)  # of the filter of the regression, of the sampling rate
_WIDTHS = (0.002, 0.02, 0.1)  # of the rounded sign, of the largest speed
_SHORTEST, _ENDS = 60, 20  # samples of a run that is filtered, and those at either end that are not used
_FEW = 5_000  # samples that the first look takes
_MOST = 60_000  # samples that the fit takes: those behind them tell nothing new of nine numbers
_FINALISTS, _FIRST_ROUNDS, _ROUNDS = 3, 12, 60
_FAR = 1e3  # times the output: what is said of a free run that diverges


def fit_drive(
    data: Sequences,
    *,
    output_per_error: float,
    start: DriveModel | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> DriveModel:
    """Return the drive whose free run fits best.

    Parameters
    ----------
    data
        A following error, or a deviation, with velocity and acceleration of the command among the inputs.
    output_per_error
        As of `DriveModel`.
    start
        What to begin with; None: what regressions through several filters find.
    progress
        Told the share that is done.

    Raises
    ------
    ArgumentError
        Velocity or acceleration is none of the inputs, fewer samples than numbers, or no free run that stays finite.

    Notes
    -----
    To begin with, the equation of the drive is a regression: its columns and the acceleration, derived from the
    output, go through the same low pass, which takes the noise of differentiation away and leaves the equation as it
    is (state variable filters; Garnier and Wang, Identification of Continuous-time Models from Sampled Data, chapter
    1). Of several low passes and widths those with the best free runs are refined by `least_squares`.
    """
    if not set(MOTION) <= set(data.names):
        raise ArgumentError("inputs", ", ".join(data.names), "a commanded velocity and acceleration")
    data = data.part(0, min(len(data), _MOST))
    if len(data) < len(NUMBERS) + len(data.names):
        raise ArgumentError("samples", f"{len(data)} samples", f"{len(NUMBERS) + len(data.names)} or more")
    if start is not None:
        return _refined(start, data, _ROUNDS)[0]
    few = data.part(0, min(len(data), _FEW))
    begin = _regressions(data, output_per_error)
    scored = sorted((_squares(drive, few), place) for place, drive in enumerate(begin))
    progress(0.2)
    found = []
    for share, (_, place) in enumerate(scored[:_FINALISTS]):
        found.append(_refined(begin[place], few, _FIRST_ROUNDS))
        progress(0.2 + 0.1 * (share + 1))
    best = min(found, key=lambda each: each[1])
    drive, squares = _refined(best[0], data, _ROUNDS)
    if not squares < _FAR**2 * float(np.sum(data.output**2)):
        raise ArgumentError("drive", "diverged in free run", "a log of a drive under a position controller")
    progress(1.0)
    return drive


def _regressions(data: Sequences, output_per_error: float) -> list[DriveModel]:
    """Return the drives that regressions through all low passes and with all widths find."""
    speed = float(np.abs(data.inputs[:, data.names.index(MOTION[0])]).max()) or 1.0
    ranges = _bounds(data)
    found = []
    for cutoff, width in itertools.product(_CUTOFFS, _WIDTHS):
        table, wanted = _filtered(data, output_per_error, cutoff, width * speed)
        scale = np.sqrt(np.mean(table**2, axis=0))
        scale[scale == 0.0] = 1.0
        numbers = (np.linalg.lstsq(table / scale, wanted, rcond=None)[0] / scale).tolist()
        found.append(
            DriveModel(
                names=data.names,
                period_s=data.period_s,
                unit=data.unit,
                output_per_error=output_per_error,
                stiffness=float(np.clip(numbers[0], *ranges["stiffness"])),
                damping=float(np.clip(numbers[1], *ranges["damping"])),
                velocity_forward=numbers[2],
                acceleration_forward=numbers[3],
                coulomb=numbers[4],
                width=width * speed,
                offset=numbers[5],
                asymmetry=numbers[6],
                gains=tuple(numbers[7:]),
            )
        )
    return found


def _filtered(data: Sequences, output_per_error: float, cutoff: float, width: float) -> tuple[Floats, Floats]:
    """Return the columns of the equation of a drive and its acceleration, all through one low pass."""
    from scipy.signal import butter, sosfiltfilt  # noqa: PLC0415 - 0.5 s, for those who train

    low_pass = butter(3, 2.0 * cutoff, output="sos")
    motion = [data.names.index(name) for name in MOTION]
    others = [place for place in range(len(data.names)) if place not in motion]
    tables, wanted = [], []
    for run in data.runs():
        if len(run) < _SHORTEST:
            continue
        velocity, acceleration, *pushes = (sosfiltfilt(low_pass, run.inputs[:, at]) for at in (*motion, *others))
        error = sosfiltfilt(low_pass, run.output / output_per_error)
        slope = np.gradient(error, data.period_s)
        speed = velocity - slope
        friction = sosfiltfilt(low_pass, np.tanh(speed / width))
        one = np.ones(len(run))
        columns = [error, -speed, velocity, acceleration, -friction, -one, -np.abs(speed), *pushes]
        tables.append(np.stack(columns, axis=1)[_ENDS:-_ENDS])
        wanted.append((acceleration - np.gradient(slope, data.period_s))[_ENDS:-_ENDS])
    if not tables:
        raise ArgumentError("drive", f"runs of fewer than {_SHORTEST} samples", "a longer run without a gap")
    return np.concatenate(tables), np.concatenate(wanted)


def _errors(drive: DriveModel, data: Sequences) -> Floats:
    far = _FAR * float(np.abs(data.output).max())
    return np.clip(np.nan_to_num(drive.free_run(data) - data.output, nan=far), -far, far)


def _squares(drive: DriveModel, data: Sequences) -> float:
    left = _errors(drive, data)
    return float(left @ left)


def _bounds(data: Sequences) -> dict[str, tuple[float, float]]:
    """Return the range of the numbers that are above zero, and fitted by their logarithms."""
    rate = 1.0 / data.period_s
    speed = float(np.abs(data.inputs[:, data.names.index(MOTION[0])]).max()) or 1.0
    return {"stiffness": (1e-4, (10.0 * rate) ** 2), "damping": (1e-2, 40.0 * rate), "width": (1e-4 * speed, speed)}


def _refined(start: DriveModel, data: Sequences, rounds: int) -> tuple[DriveModel, float]:
    """Return the drive that `least_squares` reaches from another one, and its sum of squares."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - 0.5 s, for those who train

    logarithmic = _bounds(data)

    def drive_of(z: Floats) -> DriveModel:
        numbers = [float(np.exp(x) if name in logarithmic else x) for name, x in zip(NUMBERS, z, strict=False)]
        return start.with_numbers(numbers, z[len(NUMBERS) :].tolist())

    begin = [np.log(getattr(start, name)) if name in logarithmic else getattr(start, name) for name in NUMBERS]
    ends = [np.log(logarithmic[name]) if name in logarithmic else (-np.inf, np.inf) for name in NUMBERS]
    low, high = np.array([*ends, *((-np.inf, np.inf) for _ in start.gains)]).T
    with np.errstate(over="ignore"):
        found = least_squares(
            lambda z: _errors(drive_of(z), data),
            np.clip([*begin, *start.gains], low, high),
            bounds=(low, high),
            x_scale="jac",
            max_nfev=rounds,
            ftol=1e-7,
        )
    return drive_of(found.x), 2.0 * float(found.cost)
