"""From the log of a drive to sequences that dynamic models are trained on: what went in, what came out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rtec.dataset.drive_signals import cutoff_of, low_pass, step_of
from rtec.dataset.even_runs import EvenRuns, even_runs
from rtec.dataset.from_measurement import run_numbers
from rtec.dataset.load import measurement_of
from rtec.dataset.observed import observed_of, without_wraps
from rtec.dataset.standstill import Ints, stretches_where
from rtec.effects.conditions import Floats
from rtec.errors import FileFormatError, unknown
from rtec.metrology import AxisFacts, ColumnChoices, Measurement, Positions
from rtec.metrology.columns import quantity_of_heading
from rtec.metrology.tables.choices import NO_CHOICES
from rtec.predictors.motion_file import FOLLOWING_ERROR, MotionHead
from rtec.predictors.sequences import DynamicModel, Sequences

DEVIATION, COMMAND = "deviation", "command"
INPUTS = (COMMAND, "velocity", "current", "voltage")
"""Quantities that go into a dynamic model; velocity and acceleration are derived from a commanded position. Where no
motion is commanded, force and torque do, too."""
_ERRORS = (FOLLOWING_ERROR, DEVIATION)
_SHOWN = {"mm": "um", "v": "V", "a": "A", "n": "N", "nm": "Nm"}  # units of outputs, as answers show them
_MOSTLY_ROUNDING = 0.02  # of the spread of an acceleration may be rounding of the command
_SAME_PERIOD = 0.01  # by which periods of two logs may differ
_AT_LIMIT, _HELD = 0.005, 5  # share of samples at the largest value, and samples in a row, that show saturation


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DynamicLog:
    """A log as a dynamic model sees it.

    Parameters
    ----------
    measurement
        What was read.
    sequences
        Inputs and output at one period. Errors and positions in mm are in um there.
    observe
        The output: ``following_error`` (command less actual), ``deviation`` (actual less command), or a column.
    rows
        Row of the measurement that each sample comes from, shape (samples,); the nearest where it was resampled.
    notes
        What was done, and what was left out, in sentences.
    """

    measurement: Measurement
    sequences: Sequences
    observe: str
    rows: Ints
    notes: tuple[str, ...]

    @property
    def head(self) -> MotionHead:
        """What a model that is trained on it predicts, and from what."""
        data = self.sequences
        return MotionHead(observe=self.observe, unit=data.unit, names=data.names, period_s=data.period_s)


def dynamic_log(
    source: str | Path | Measurement,
    *,
    observe: str | None = None,
    inputs: Sequence[str] | None = None,
    choices: ColumnChoices = NO_CHOICES,
) -> DynamicLog:
    r"""Read the log of a drive, or of anything else that has inputs and an output.

    Parameters
    ----------
    source
        A file, or what was read from one. It needs a time.
    observe
        The output; None: the following error.
    inputs
        Names of the inputs that a trained model asks for; None: all that the log has and that move.
    choices
        What the user says of the columns.

    Raises
    ------
    FileFormatError
        No time, a clock that cannot be made even (`even_runs`), no input, or an input that is asked for and missing.
    ArgumentError
        An output that the log does not have.

    Notes
    -----
    Velocity and acceleration are central differences of the command: a controller knows it in advance. Where the
    command is so coarse that its second difference is mostly rounding, a low pass without phase goes before.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "x.csv"
    >>> rows = "\n".join(f"{i},{i * i},{i * i - i}" for i in range(30))
    >>> _ = file.write_text(f"time_ms,command_um,actual_um\n{rows}\n")
    >>> log = dynamic_log(file)
    >>> log.sequences.names, log.sequences.unit, log.sequences.output[:3].tolist()
    (('velocity', 'acceleration'), 'um', [0.0, 1.0, 2.0])
    >>> log.sequences.inputs[5].round(6).tolist()  # mm/s and mm/s²
    [10.0, 2000.0]
    """
    measurement = measurement_of(source, choices).in_order_of_time()
    columns = measurement.columns
    if "time" not in columns:
        raise FileFormatError(measurement.source, None, "no time", "a column time_s, or time with another unit")
    positions = without_wraps(measurement.positions(AxisFacts(source=measurement.source, said=measurement.facts)))
    quantity, values, unit = _output(measurement, positions, observe)
    runs = even_runs(columns["time"].values, run_numbers(measurement), measurement.source, measurement.lines)
    channels, notes = _channels(measurement, positions, quantity, runs)
    channels, left_out = _chosen(channels, inputs, measurement)
    output = np.concatenate(runs.sampled(values * (1e3 if unit == "mm" else 1.0)))
    if inputs is None and np.ptp(output) == 0.0:
        raise FileFormatError(measurement.source, None, f"{quantity} never changes", "a log in which it does")
    sequences = Sequences(
        inputs=np.stack(list(channels.values()), axis=1),
        output=output,
        names=tuple(channels),
        period_s=runs.period_s,
        unit=_SHOWN.get(unit, unit.replace("_s", "/s")),
        starts=tuple(np.cumsum([0, *(part.size for part in runs.sampled(values))])[:-1].tolist()),
    )
    notes = [*measurement.notes, *positions.notes, *runs.notes, *notes, *left_out]
    notes += _saturated(channels) + _unused(measurement, quantity, channels)
    return DynamicLog(
        measurement=measurement, sequences=sequences, observe=quantity, rows=runs.rows, notes=tuple(notes)
    )


def dynamic_residual(model: DynamicModel, log: DynamicLog) -> Floats:
    """Return what a dynamic model leaves of a log in free run, in the unit of its output, shape (samples,).

    The first `DynamicModel.lags` samples of each run, from which the model starts, are NaN. ``log.rows`` tells the
    row of the measurement of each sample.

    Raises
    ------
    ArgumentError
        Inputs, period or unit are not those of the model: `log_like` reads a log that has them.
    """
    data = log.sequences
    left = data.output - model.free_run(data)
    for start in data.starts:
        left[start : start + model.lags] = np.nan
    return left


def _output(measurement: Measurement, positions: Positions, observe: str | None) -> tuple[str, Floats, str]:
    """Return the name of the output, its values, shape (rows,), and its unit inside."""
    have, columns = positions.values, measurement.columns
    others = [name for name in columns if name not in ("run", "direction", "time", *positions.values)]
    others += [name for name in have if name == "actual"]
    stems = {heading.rpartition("_")[0] or heading: heading for heading in _numeric(measurement)}
    possible = [*(_ERRORS if {"actual", "target"} <= have.keys() or "deviation" in have else ()), *others, *stems]
    if observe is None:
        if not possible or possible[0] not in _ERRORS:
            problem = f"no command with an actual position in {_headings(measurement)}"
            allowed = " or ".join(f"--observe {name}" for name in possible) or "a column of an output"
            raise FileFormatError(measurement.source, None, problem, allowed)
        observe = FOLLOWING_ERROR
    word = observe.strip().lower().replace(" ", "_").replace("-", "_")
    named = quantity_of_heading(word)
    by_heading = {heading.lower(): stem for stem, heading in stems.items()}
    word = by_heading.get(word, word) if named is None else named[0]
    lower = {name.lower(): name for name in possible}
    if word not in lower:
        raise unknown("--observe", observe, possible)
    name = lower[word]
    if name in _ERRORS:
        values, unit = observed_of(measurement, positions, DEVIATION)
        return name, 0.0 - values if name == FOLLOWING_ERROR else values, unit
    if name in columns:
        values, unit = observed_of(measurement, positions, name)
        return name, values, unit
    heading = stems[name]
    return name, _numeric(measurement)[heading], heading.rpartition("_")[2].lower() if "_" in heading else ""


def _numeric(measurement: Measurement) -> dict[str, Floats]:
    """Return the columns of no known quantity that hold numbers, by heading."""
    return {
        heading: values.astype(np.float64)
        for heading, values in measurement.unknown.items()
        if values.dtype.kind == "f"
    }


def _headings(measurement: Measurement) -> str:
    every = ", ".join([*(column.heading for column in measurement.columns.values()), *measurement.unknown])
    return repr(every if len(every) <= 200 else every[:197] + "...")


def _channels(
    measurement: Measurement, positions: Positions, observe: str, runs: EvenRuns
) -> tuple[dict[str, Floats], list[str]]:
    """Return all inputs of a log by name, each at the samples, shape (samples,), with notes."""
    found, notes = _motion(measurement, positions, observe, runs)
    columns = measurement.columns
    of_drive = ("current", "voltage") if found else ("current", "voltage", "force", "torque")
    for name in of_drive:
        if name in columns and name != observe:
            found[name] = np.concatenate(runs.sampled(columns[name].values))
    for heading, values in _numeric(measurement).items():
        stem = heading.lower().rpartition("_")[0] or heading.lower()
        if stem in INPUTS and stem not in found and stem != observe:
            found[stem] = np.concatenate(runs.sampled(values))
    return found, notes


def _motion(
    measurement: Measurement, positions: Positions, observe: str, runs: EvenRuns
) -> tuple[dict[str, Floats], list[str]]:
    """Return the commanded motion: the position itself where the actual one is the output, else its derivatives."""
    target = positions.values.get("target")
    velocity = None if observe == "velocity" else measurement.columns.get("velocity")
    notes, found = [], {}
    if velocity is not None and target is not None and _is_measured(velocity.values, positions, runs):
        notes.append(f"{velocity.heading} follows the actual position, not the command: it is no input")
        velocity = None
    if target is not None and observe == "actual":
        found[COMMAND] = np.concatenate(runs.sampled(target))
    elif target is not None:
        of_command, smoothed = _derivatives(runs.sampled(target), runs.period_s, step_of(target))
        notes += smoothed
        found = dict(zip(("velocity", "acceleration"), of_command, strict=True))
    if velocity is not None:
        found["velocity"] = np.concatenate(runs.sampled(velocity.values))
        if target is None and observe in _ERRORS:
            slopes = [np.gradient(part, runs.period_s) for part in runs.sampled(velocity.values)]
            found["acceleration"] = np.concatenate(slopes)
    return found, notes


def _is_measured(velocity: Floats, positions: Positions, runs: EvenRuns) -> bool:
    """Whether a velocity is closer to the slope of the actual position than to that of the command."""
    have = positions.values
    actual = have["actual"] if "actual" in have else have["target"] + have.get("deviation", 0.0)
    off = [
        sum(float(np.sum((np.gradient(x, runs.period_s) - v) ** 2)) for x, v in zip(
            runs.sampled(place), runs.sampled(velocity), strict=True))
        for place in (actual, have["target"])
    ]  # fmt: skip
    return off[0] < off[1]


def _derivatives(parts: list[Floats], period_s: float, step: float) -> tuple[list[Floats], list[str]]:
    """Return velocity and acceleration of a command in runs, each of shape (samples,), with notes."""
    velocity, acceleration = _differences(parts, period_s)
    rounding = step / np.sqrt(2.0) / period_s**2  # of the second difference of a step's uniform error
    if rounding <= _MOSTLY_ROUNDING * float(np.std(acceleration)):
        return [velocity, acceleration], []
    cutoff_hz = cutoff_of(parts, 1.0 / period_s, step, commanded=True)
    smooth = _differences([low_pass(part, 1.0 / period_s, cutoff_hz) for part in parts], period_s)
    note = f"the command is rounded to {step:.3g}: low pass at {cutoff_hz:.3g} Hz (no phase) before its differences"
    return smooth, [note]


def _differences(parts: list[Floats], period_s: float) -> list[Floats]:
    """Return first and second central differences of runs; at their ends, where those lead."""
    first = [np.gradient(part, period_s, edge_order=2) for part in parts]
    second = []
    for part in parts:
        bends = np.diff(part, 2) / period_s**2
        second.append(np.concatenate([[2.0 * bends[0] - bends[1]], bends, [2.0 * bends[-1] - bends[-2]]]))
    return [np.concatenate(first), np.concatenate(second)]


def _chosen(
    channels: dict[str, Floats], inputs: Sequence[str] | None, measurement: Measurement
) -> tuple[dict[str, Floats], list[str]]:
    """Return the inputs that a model asks for, or those that move, with notes on the others."""
    if inputs is not None:
        for name in inputs:
            if name not in channels:
                problem = f"no input {name!r} in {_headings(measurement)}"
                raise FileFormatError(measurement.source, None, problem, "a log with the inputs of the model")
        return {name: channels[name] for name in inputs}, []
    still = [name for name, values in channels.items() if np.ptp(values) == 0.0]
    moving = {name: values for name, values in channels.items() if name not in still}
    if not moving:
        problem = f"the input {still[0]!r} never moves" if still else f"no input in {_headings(measurement)}"
        allowed = f"a column of one of {', '.join(INPUTS)} that moves; --map 'HEADING=voltage_v' makes one of another"
        raise FileFormatError(measurement.source, None, problem, allowed)
    return moving, [f"the input {name!r} never moves: it is left out" for name in still]


def _saturated(channels: dict[str, Floats]) -> list[str]:
    """Return what is to be said of currents and voltages that stay at their limit."""
    notes = []
    for name in {"current", "voltage"} & channels.keys():
        size = np.abs(channels[name])
        at_limit = size >= (1.0 - 1e-6) * size.max()
        held = sum(end - begin for begin, end in stretches_where(at_limit) if end - begin >= _HELD)
        if held > _AT_LIMIT * size.size and np.unique(size).size > _HELD:
            share = 100.0 * held / size.size
            notes.append(f"{name} stays at its largest value, {size.max():.4g}, in {share:.1f} % of the samples: "
                         "it is saturated, and no model sees what was asked for there")  # fmt: skip
    return notes


def _unused(measurement: Measurement, observe: str, channels: dict[str, Floats]) -> list[str]:
    """Return what is to be said of columns that are neither input nor output."""
    known = {"run", "time", "direction", "target", "actual", "deviation", observe, *channels}
    headings = [column.heading for name, column in measurement.columns.items() if name not in known]
    stems = {heading: heading.lower().rpartition("_")[0] or heading.lower() for heading in measurement.unknown}
    others = [heading for heading, stem in stems.items() if stem not in {observe.lower(), *channels}]
    if not headings and not others:
        return []
    electrical = next((heading for heading in others if heading.lower().endswith("_v")), None)
    hint = "" if electrical is None else f"; --map '{electrical}=voltage_v' makes {electrical} an input"
    return [f"neither input nor output: {', '.join([*headings, *others])}{hint}"]


def log_like(head: MotionHead, source: str | Path | Measurement, choices: ColumnChoices = NO_CHOICES) -> DynamicLog:
    """Read a log for a model that was trained on another one: with its inputs, its output, and its period.

    Parameters
    ----------
    head
        Of the model (`rtec.predictors.motion_file.read_motion`), or of the log that trains (`DynamicLog.head`).
    source, choices
        As of `dynamic_log`.

    Raises
    ------
    FileFormatError
        A period that differs by more than a percent, another unit, or an input that is missing.
    ArgumentError
        The log does not have the output.
    """
    log = dynamic_log(source, observe=head.observe, inputs=head.names, choices=choices)
    data = log.sequences
    if abs(data.period_s / head.period_s - 1.0) > _SAME_PERIOD:
        problem = f"sampled every {1e3 * data.period_s:.4g} ms"
        allowed = f"a log sampled every {1e3 * head.period_s:.4g} ms, as the one that trains"
        raise FileFormatError(log.measurement.source, None, problem, allowed)
    if data.unit != head.unit:
        problem = f"{head.observe} in {data.unit}"
        raise FileFormatError(log.measurement.source, None, problem, f"{head.unit}, as in the log that trains")
    return replace(log, sequences=replace(data, period_s=head.period_s))
