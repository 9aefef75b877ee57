"""From the log of a machine that warms up to what a model of it learns from: inputs, displacements, and blocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.from_measurement import run_numbers
from rtec.dataset.warm_blocks import FEWEST_BLOCKS, Blocks, blocks_of
from rtec.dataset.warm_rows import FEWEST_ROWS, continued, from_rest, usable_rows
from rtec.effects.conditions import Floats
from rtec.errors import ArgumentError, FileFormatError, nearest, unknown
from rtec.metrology import ColumnChoices, Measurement, read_measurement
from rtec.metrology.columns import axis_of_heading, channel_of_heading, quantity_of_heading
from rtec.metrology.tables.choices import NO_CHOICES
from rtec.predictors.warm.features import SPINDLE_SPEED

SPINDLE = "spindle"
"""Quantity of a measurement that is the speed of a spindle in rev/min."""
_NO_CHANNELS = ("run", "direction", "time", SPINDLE)
UM_PER_MM = 1e3
_MOST_HEADINGS = 200


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmLog:
    """What a model of a warm machine learns from, or is judged by.

    Parameters
    ----------
    source
        The file, for messages.
    time_s
        Ascending within each stretch, shape (rows,).
    outputs
        Displacements in um by channel, shape (rows,) each; NaN where none was measured.
    others
        Displacements that are not observed: they help to choose what all have in common, such as time constants.
    inputs
        ``temperature_NAME`` in degrees Celsius and ``spindle_speed`` in rev/min, shape (rows,) each.
    blocks
        Of constant speed, or whatever else takes their place.
    starts
        Row at which each stretch begins: the log starts, or has a gap, or its time jumps back.
    notes
        What was done, and what was left out, in sentences.
    """

    source: str
    time_s: Floats
    outputs: Mapping[str, Floats]
    inputs: Mapping[str, Floats]
    blocks: Blocks
    starts: tuple[int, ...]
    notes: tuple[str, ...] = ()
    others: Mapping[str, Floats] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.time_s.size)

    @property
    def measured(self) -> NDArray[np.bool_]:
        """In which rows every displacement was measured, shape (rows,)."""
        return np.asarray(
            np.all([np.isfinite(one) for one in (*self.outputs.values(), *self.others.values())], axis=0)
        )

    @property
    def hours(self) -> Floats:
        """Time since the start in hours as it is drawn, shape (rows,): a jump back counts as no time."""
        steps = np.diff(self.time_s, prepend=self.time_s[0])
        return np.cumsum(np.where(steps > 0.0, steps, 0.0)) / 3600.0


def is_warm_log(measurement: Measurement, observe: str | None = None) -> bool:
    """Return whether a measurement is the log of a machine that warms up, and not one of positions.

    It has a time and a temperature or a speed of the spindle, and what is observed is not over positions: there are
    none, or ``observe`` names another column.
    """
    columns = measurement.columns
    heats = any(name == SPINDLE or name.startswith("temperature") for name in columns)
    if "time" not in columns or not heats:
        return False
    if not _is_over_positions(measurement):
        return True
    return observe is not None and _word(observe) in measurement.channels()


def _notes_of(measurement: Measurement) -> list[str]:
    """Return what was guessed of the file, but that a displacement is a position."""
    if _is_over_positions(measurement):
        return list(measurement.notes)
    return [note for note in measurement.notes if not note.endswith("for the actual position")]


def _is_over_positions(measurement: Measurement) -> bool:
    """Return whether a measurement has positions; what was only taken for one, as ``z_um``, is a displacement."""
    actual = "actual" in measurement.columns and "actual" not in measurement.headings
    return actual or "target" in measurement.columns


def warm_log(
    source: str | Path | Measurement,
    *,
    observe: str | None = None,
    blocks: str | None = None,
    like: WarmLog | None = None,
    inputs: Sequence[str] = (),
    fewest_blocks: int = FEWEST_BLOCKS,
    choices: ColumnChoices = NO_CHOICES,
) -> WarmLog:
    r"""Read the log of a machine that warms up.

    Parameters
    ----------
    source
        A file, or what was read from one: a time, temperatures or the speed of a spindle, and displacements.
    observe
        The displacement, as ``ch3`` of a column ``ch3_um``; None: all.
    blocks
        A column whose changes start the blocks; None: see `rtec.dataset.warm_blocks.blocks_of`.
    like
        The log that trains, where this one judges: the same displacements and inputs.
    inputs
        Those of a model that is judged.
    fewest_blocks
        That are needed: others are looked for where the changes of speed make fewer.
    choices
        What the user says of the columns.

    Raises
    ------
    FileFormatError
        No time, no temperature and no speed, no displacement, a column of ``like`` or an input that is missing, or
        too few rows.
    ArgumentError
        A displacement or a column of blocks that the file does not have.

    Notes
    -----
    A sensor that fails (`rtec.dataset.warm_sensors.failures_of`) is left out of a log that trains, or the rows are in
    which it failed (`rtec.dataset.warm_rows.usable_rows`).

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "spindle.csv"
    >>> rows = "\n".join(f"{60 * i},{20 + i / 10},{3 * i}" for i in range(30))
    >>> _ = file.write_text(f"time_s,temperature_nose_degc,axial_um\n{rows}\n")
    >>> log = warm_log(file)
    >>> list(log.outputs), list(log.inputs), log.blocks.by
    (['axial'], ['temperature_nose'], '6 equal parts of the time')
    """
    measurement = source if isinstance(source, Measurement) else read_measurement(source, replace(choices, gaps=True))
    measurement = measurement.in_order_of_time()
    name = measurement.source
    if "time" not in measurement.columns:
        raise FileFormatError(name, None, "no time", "a column time_s, or time with another unit")
    outputs, others, notes = _outputs(measurement, observe, None if like is None else list(like.outputs))
    asked_for = inputs if like is None else tuple(like.inputs)
    sensors = _inputs(measurement, asked_for, "which the model follows" if like is None else f"but in {like.source}")
    time_s, runs = measurement.columns["time"].values, run_numbers(measurement)
    said = None if blocks is None else _column(measurement, blocks)
    fixed, asked = bool(asked_for), observe is not None
    left = usable_rows(time_s, sensors, outputs, others, is_fixed=fixed, asked=asked)
    rows = left.rows
    if rows.size < FEWEST_ROWS:
        raise FileFormatError(name, None, f"{rows.size} rows", f"{FEWEST_ROWS} or more with every value")
    if not left.inputs or not left.outputs:
        what = "sensor" if left.outputs else "displacement"
        raise FileFormatError(name, None, f"no {what} of use: {'; '.join(left.notes)}", "one that works")
    time_s, starts, breaks = continued(time_s[rows], runs[rows], left.inputs)
    named = None if said is None else (str(blocks), said[rows])
    # of a log that is judged, temperatures tell where what lags begins
    warmed, begun = (left.inputs, []) if fixed else from_rest(time_s, starts, left.inputs)
    speed = left.inputs.get(SPINDLE_SPEED, np.zeros(time_s.size))
    heats = [values for name, values in left.inputs.items() if name != SPINDLE_SPEED]
    fewest = 1 if fixed else fewest_blocks
    found = blocks_of(time_s, speed, runs[rows], starts, heats=heats, said=named, fewest=fewest)
    return WarmLog(
        source=name,
        time_s=time_s,
        outputs=left.outputs,
        others=left.others,
        inputs=warmed,
        blocks=found,
        starts=starts,
        notes=(*_notes_of(measurement), *notes, *left.notes, *breaks, *begun, *found.notes),
    )


def _word(said: str) -> str:
    word = said.strip().lower()
    named = quantity_of_heading(word)
    return channel_of_heading(word)[0] if named is None else named[0]


def _channels(measurement: Measurement) -> dict[str, tuple[Floats, str]]:
    """Return what may be observed, with its unit inside: by the name of the column without its unit."""
    found: dict[str, tuple[Floats, str]] = {}
    hidden = (*_NO_CHANNELS, *(("target", "actual", "deviation") if _is_over_positions(measurement) else ()))
    for name, column in measurement.columns.items():
        if name not in hidden and not name.startswith("temperature"):
            guessed = measurement.headings.get(name, name) if name == "actual" else name
            found[channel_of_heading(guessed)[0]] = column.values, column.unit
    for name, heading in measurement.channels().items():
        if axis_of_heading(heading) is None:
            unit = channel_of_heading(heading)[1]
            values = np.asarray(measurement.unknown[heading], dtype=np.float64)
            found.setdefault(name, ((values + unit.offset) * unit.factor, unit.inside))
    return found


def _outputs(
    measurement: Measurement, observe: str | None, wanted: Sequence[str] | None
) -> tuple[dict[str, Floats], dict[str, Floats], list[str]]:
    """Return the displacements that are observed, and the others, in um, and what is to be said of other columns."""
    channels = _channels(measurement)
    lengths = {name: values * UM_PER_MM for name, (values, unit) in channels.items() if unit == "mm"}
    if wanted is not None:
        if missing := [name for name in wanted if name not in lengths]:
            problem = f"no displacement {', '.join(missing)}"
            raise FileFormatError(measurement.source, None, problem, "the displacements of the log that trains")
        return {name: lengths[name] for name in wanted}, {}, []
    if observe is not None:
        word = _word(observe)
        if word not in channels:
            raise unknown("--observe", observe, list(lengths) or list(channels), noun="column of this file")
        if word not in lengths:
            allowed = "a displacement, in a unit of length such as _um"
            raise ArgumentError("--observe", f"{observe} in {channels[word][1]}", allowed)
        return {word: lengths.pop(word)}, lengths, []
    if not lengths:
        headings = ", ".join([*(column.heading for column in measurement.columns.values()), *measurement.unknown])
        problem = f"no displacement in the columns {headings[:_MOST_HEADINGS]!r}"
        raise FileFormatError(measurement.source, None, problem, "a column such as axial_um")
    others = [f"{name} in {unit}" for name, (_, unit) in channels.items() if unit not in ("", "mm")]
    return lengths, {}, [f"not observed, as they are no displacements: {', '.join(others)}"] if others else []


def _inputs(measurement: Measurement, asked_for: Sequence[str], why: str) -> dict[str, Floats]:
    columns = measurement.columns
    found = {
        (f"{name}_1" if name == "temperature" else name): column.values
        for name, column in columns.items()
        if name.startswith("temperature")
    }
    if SPINDLE in columns:
        found[SPINDLE_SPEED] = columns[SPINDLE].values
    if missing := [name for name in asked_for if name not in found]:
        hint = nearest(missing[0], found) if found else ""
        problem = f"no {', '.join(missing)} here, {why}"
        raise FileFormatError(measurement.source, None, problem, "; ".join(filter(None, ("the same sensors", hint))))
    if asked_for:
        return {name: found[name] for name in asked_for}
    if not found:
        allowed = "a column such as temperature_nose_degc or spindle_rpm"
        raise FileFormatError(measurement.source, None, "no temperature and no speed of a spindle", allowed)
    return found


def _column(measurement: Measurement, said: str) -> Floats:
    """Return a column by its name or heading, text as numbers of its values."""
    columns = {name: column.values for name, column in measurement.columns.items()}
    by_word: dict[str, np.ndarray[tuple[int], np.dtype[np.generic]]] = {}
    for heading, values in measurement.unknown.items():
        by_word[heading.lower()] = values
        by_word.setdefault(heading.lower().rpartition("_")[0], values)
    by_word |= columns | {column.heading: column.values for column in measurement.columns.values()}
    word = said.strip().lower()
    if word not in by_word:
        known = [*columns, *(heading.lower() for heading in measurement.unknown)]
        raise unknown("--blocks", said, known, noun="column of this file")
    return np.asarray(np.unique(by_word[word], return_inverse=True)[1], dtype=np.float64)
