"""The physical model of a drive, fitted by simulation: what is compared is its free run."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.drive_model import MOTION, NUMBERS, DriveModel
from rtec.predictors.sequences import Sequences

_RATIOS = (0.35, 0.7, 1.5, 3.0)  # of damping, to begin with
_FREQUENCIES = 14  # of the position loop, in rad/s, from once in twenty seconds to the sampling rate
_SLOWEST = 0.3
_FEW = 5_000  # samples that the first look takes
_MOST = 60_000  # samples that the fit takes: those behind them tell nothing new of nine numbers
_FINALISTS, _FIRST_ROUNDS, _ROUNDS = 4, 12, 60
_POSITIVE = ("stiffness", "damping", "width")  # fitted by their logarithms
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
        What to begin with; None: the best of a grid of loop gains, with what a drive in steady motion shows.
    progress
        Told the share that is done.

    Raises
    ------
    ArgumentError
        Velocity or acceleration is none of the inputs, fewer samples than numbers, or no free run that stays finite.

    Notes
    -----
    In steady motion the following error is ``(damping - velocity_forward) / stiffness`` times the velocity, and so
    on: for each stiffness and damping of the grid the other numbers follow from a straight regression.
    `least_squares` takes the best four from there.
    """
    if not set(MOTION) <= set(data.names):
        raise ArgumentError("inputs", ", ".join(data.names), "a commanded velocity and acceleration")
    data = data.part(0, min(len(data), _MOST))
    if len(data) < len(NUMBERS) + len(data.names):
        raise ArgumentError("samples", f"{len(data)} samples", f"{len(NUMBERS) + len(data.names)} or more")
    if start is not None:
        return _refined(start, data, _ROUNDS)[0]
    few = data.part(0, min(len(data), _FEW))
    grid = list(_grid(data, output_per_error))
    scored = sorted(((_squares(drive, few), place) for place, drive in enumerate(grid)))
    progress(0.2)
    found = []
    for share, (_, place) in enumerate(scored[:_FINALISTS]):
        found.append(_refined(grid[place], few, _FIRST_ROUNDS))
        progress(0.2 + 0.1 * (share + 1))
    best = min(found, key=lambda each: each[1])
    drive, squares = _refined(best[0], data, _ROUNDS)
    if not squares < _FAR**2 * float(np.sum(data.output**2)):
        raise ArgumentError("drive", "diverged in free run", "a log of a drive under a position controller")
    progress(1.0)
    return drive


def _grid(data: Sequences, output_per_error: float) -> list[DriveModel]:
    velocity, acceleration = (data.inputs[:, data.names.index(name)] for name in MOTION)
    others = [place for place, name in enumerate(data.names) if name not in MOTION]
    speed = float(np.abs(velocity).max()) or 1.0
    width = 0.02 * speed
    columns = [velocity, acceleration, np.tanh(velocity / width), np.ones(len(data)), np.abs(velocity)]
    table = np.stack([*columns, *data.inputs[:, others].T], axis=1)
    scale = np.sqrt(np.mean(table**2, axis=0))
    scale[scale == 0.0] = 1.0
    steady = np.linalg.lstsq(table / scale, data.output / output_per_error, rcond=None)[0] / scale
    found = []
    frequencies = np.geomspace(_SLOWEST, 1.0 / data.period_s, _FREQUENCIES)
    for frequency, ratio in itertools.product(frequencies, _RATIOS):
        stiffness, damping = frequency**2, 2.0 * ratio * frequency
        pulled = stiffness * steady
        found.append(
            DriveModel(
                names=data.names,
                period_s=data.period_s,
                unit=data.unit,
                output_per_error=output_per_error,
                stiffness=stiffness,
                damping=damping,
                velocity_forward=damping - pulled[0],
                acceleration_forward=1.0 - pulled[1],
                coulomb=pulled[2],
                width=width,
                offset=pulled[3],
                asymmetry=pulled[4],
                gains=tuple((-pulled[5:]).tolist()),
            )
        )
    return found


def _errors(drive: DriveModel, data: Sequences) -> Floats:
    far = _FAR * float(np.abs(data.output).max())
    return np.clip(np.nan_to_num(drive.free_run(data) - data.output, nan=far), -far, far)


def _squares(drive: DriveModel, data: Sequences) -> float:
    left = _errors(drive, data)
    return float(left @ left)


def _refined(start: DriveModel, data: Sequences, rounds: int) -> tuple[DriveModel, float]:
    """Return the drive that `least_squares` reaches from another one, and its sum of squares."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - 0.5 s, for those who train

    def drive_of(z: Floats) -> DriveModel:
        numbers = [float(np.exp(x) if name in _POSITIVE else x) for name, x in zip(NUMBERS, z, strict=False)]
        return start.with_numbers(numbers, z[len(NUMBERS) :].tolist())

    begin = [np.log(getattr(start, name)) if name in _POSITIVE else getattr(start, name) for name in NUMBERS]
    with np.errstate(over="ignore"):
        found = least_squares(
            lambda z: _errors(drive_of(np.clip(z, -1e12, 1e12)), data),
            np.array([*begin, *start.gains]),
            x_scale="jac",
            max_nfev=rounds,
            ftol=1e-7,
        )
    return drive_of(found.x), 2.0 * float(found.cost)
