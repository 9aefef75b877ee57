"""The physical model of a drive, fitted by simulation: what is compared is its free run."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.drive_model import MOTION, NUMBERS, DriveModel
from rtec.predictors.sequences import Sequences

_CUTOFFS = (0.005, 0.01, 0.02, 0.04, 0.08, 0.16)  # of the filter of the regression, of the sampling rate
_WIDTHS = (0.002, 0.02, 0.1)  # of the rounded sign, of the largest speed
_STIFF = (0.03, 0.1, 0.3, 1.0)  # of the sampling rate: loops too fast for the samples, in rad/s
_RATIOS = (0.1, 50.0)  # of damping: a position loop that works
_OTHER_WAY = 0.02  # of the samples in motion that go the other way: fewer tell nothing of it
_ONE_WAY = 1e5  # times as much are offset and asymmetry held down where nothing tells them from friction
_HELD_DOWN = 1e-4  # of the error that friction causes, beside the error that is left
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
    1). A drive that is faster than the samples shows only its steady motion, where the error is
    ``(damping - velocity_forward) / stiffness`` times the velocity, and so on. Of all these beginnings those with the
    best free runs are refined by `least_squares`. Where the command goes one way only, offset and asymmetry stay 0.
    """
    if not set(MOTION) <= set(data.names):
        raise ArgumentError("inputs", ", ".join(data.names), "a commanded velocity and acceleration")
    data = data.part(0, min(len(data), _MOST))
    if len(data) < len(NUMBERS) + len(data.names):
        raise ArgumentError("samples", f"{len(data)} samples", f"{len(NUMBERS) + len(data.names)} or more")
    if start is not None:
        return _refined(start, data, _ROUNDS)[0]
    few = data.part(0, min(len(data), _FEW))
    begin = _beginnings(data, output_per_error)
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


def goes_both_ways(data: Sequences) -> bool:
    """Whether a command moves in both directions: else an offset and an asymmetry are not told from friction."""
    velocity = data.inputs[:, data.names.index(MOTION[0])]
    fast = velocity[np.abs(velocity) > 0.01 * _speed(data)]
    return min(int(np.sum(fast > 0.0)), int(np.sum(fast < 0.0))) > _OTHER_WAY * fast.size


def _beginnings(data: Sequences, output_per_error: float) -> list[DriveModel]:
    """Return what the regressions find: of the equation through all filters, and of steady motion."""
    speed = _speed(data)

    def drive(numbers: Sequence[float], width: float) -> DriveModel:
        stiffness, damping, forward, bend, friction, offset, asymmetry, *gains = numbers
        found = DriveModel(
            names=data.names,
            period_s=data.period_s,
            unit=data.unit,
            output_per_error=output_per_error,
            stiffness=stiffness,
            damping=damping,
            velocity_forward=forward,
            acceleration_forward=bend,
            coulomb=friction,
            width=width,
            offset=offset,
            asymmetry=asymmetry,
            gains=tuple(gains),
        )
        return _working(found, data)

    found = []
    for cutoff, share in itertools.product(_CUTOFFS, _WIDTHS):
        table, wanted = _filtered(data, output_per_error, cutoff, share * speed)
        found.append(drive(_solved(table, wanted), share * speed))
    width = _WIDTHS[1] * speed
    steady = _solved(_steady_columns(data, width), data.output / output_per_error)
    for frequency in (share / data.period_s for share in _STIFF):
        stiffness, damping = frequency**2, 2.0 * frequency
        forward, bend, *others = (stiffness * number for number in steady)
        found.append(drive([stiffness, damping, damping - forward, 1.0 - bend, *others], width))
    return found


def _solved(table: Floats, wanted: Floats) -> list[float]:
    """Return the numbers of a regression whose columns are of very different sizes."""
    scale = np.sqrt(np.mean(table**2, axis=0))
    scale[scale == 0.0] = 1.0
    found: list[float] = (np.linalg.lstsq(table / scale, wanted, rcond=None)[0] / scale).tolist()
    return found


def _steady_columns(data: Sequences, width: float) -> Floats:
    """Return what a following error in steady motion is made of, over the stiffness, shape (samples, columns)."""
    velocity, acceleration = (data.inputs[:, data.names.index(name)] for name in MOTION)
    pushes = [-data.inputs[:, place] for place, name in enumerate(data.names) if name not in MOTION]
    told = float(goes_both_ways(data))
    one, size = np.full(len(data), told), told * np.abs(velocity)
    columns = [velocity, acceleration, np.tanh(velocity / width), one, size, *pushes]
    return np.stack(columns, axis=1)


def _filtered(data: Sequences, output_per_error: float, cutoff: float, width: float) -> tuple[Floats, Floats]:
    """Return the columns of the equation of a drive and its acceleration, all through one low pass."""
    from scipy.signal import butter, sosfiltfilt  # noqa: PLC0415 - 0.5 s, for those who train

    low_pass = butter(3, 2.0 * cutoff, output="sos")
    motion = [data.names.index(name) for name in MOTION]
    others = [place for place in range(len(data.names)) if place not in motion]
    told = float(goes_both_ways(data))
    tables, wanted = [], []
    for run in data.runs():
        if len(run) < _SHORTEST:
            continue
        velocity, acceleration, *pushes = (sosfiltfilt(low_pass, run.inputs[:, at]) for at in (*motion, *others))
        error = sosfiltfilt(low_pass, run.output / output_per_error)
        slope = np.gradient(error, data.period_s)
        speed = velocity - slope
        friction = sosfiltfilt(low_pass, np.tanh(speed / width))
        one, size = np.full(len(run), told), told * np.abs(speed)
        columns = [error, -speed, velocity, acceleration, -friction, -one, -size, *pushes]
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


def _working(drive: DriveModel, data: Sequences) -> DriveModel:
    """Return the nearest drive that could work: stable, damped, with friction that brakes."""
    rate, speed = 1.0 / data.period_s, _speed(data)
    stiffness = float(np.clip(drive.stiffness, 1e-4, (10.0 * rate) ** 2))
    ratio = float(np.clip(drive.damping / (2.0 * np.sqrt(stiffness)), *_RATIOS))
    return replace(
        drive,
        stiffness=stiffness,
        damping=2.0 * ratio * float(np.sqrt(stiffness)),
        width=float(np.clip(drive.width, 1e-4 * speed, speed)),
        coulomb=max(drive.coulomb, 0.0),
    )


def _speed(data: Sequences) -> float:
    return float(np.abs(data.inputs[:, data.names.index(MOTION[0])]).max()) or 1.0


def _refined(start: DriveModel, data: Sequences, rounds: int) -> tuple[DriveModel, float]:
    """Return the drive that `least_squares` reaches from another one, and its sum of squares.

    Stiffness, damping ratio and width are fitted by their logarithms. What friction adds to the error is held down
    ever so little, or numbers that cancel each other would grow without end.
    """
    from scipy.optimize import least_squares  # noqa: PLC0415 - 0.5 s, for those who train

    speed = _speed(data)
    weight = _HELD_DOWN * np.sqrt(len(data)) * start.output_per_error * np.ones(3)
    weight[1:] *= 1.0 if goes_both_ways(data) else _ONE_WAY

    def drive_of(z: Floats) -> DriveModel:
        stiffness, ratio, width = np.exp(np.clip(z[:3], -60.0, 60.0)).tolist()
        forward, bend, coulomb, offset, asymmetry, *gains = z[3:].tolist()
        damping = 2.0 * ratio * float(np.sqrt(stiffness))
        numbers = (stiffness, damping, forward, bend, coulomb, width, offset, asymmetry)
        return _working(start.with_numbers(numbers, gains), data)

    def left(z: Floats) -> Floats:
        drive = drive_of(z)
        friction = np.array([drive.coulomb, drive.offset, drive.asymmetry * speed])
        return np.append(_errors(drive, data), weight * friction / drive.stiffness)

    s = _working(start, data)
    begin = np.log([s.stiffness, s.damping / (2.0 * np.sqrt(s.stiffness)), s.width]).tolist()
    begin += [s.velocity_forward, s.acceleration_forward, s.coulomb, s.offset, s.asymmetry, *s.gains]
    with np.errstate(over="ignore"):
        found = least_squares(left, np.array(begin), x_scale="jac", max_nfev=rounds, ftol=1e-7)
    drive = drive_of(found.x)
    return drive, _squares(drive, data)
