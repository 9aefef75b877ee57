"""What a model of motion leaves of a log, as a measurement that the effects of the library may explain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.dynamic_log import DEVIATION, DynamicLog, dynamic_residual, log_like
from rtec.dataset.load import load_dataset
from rtec.effects import LIBRARY, Library
from rtec.effects.library import OF_LOOP
from rtec.errors import ArgumentError
from rtec.metrology import Column, ColumnChoices, Measurement
from rtec.metrology.tables.choices import NO_CHOICES
from rtec.predictors.motion_file import FOLLOWING_ERROR, KnownMotion

_KEPT = ("run", "time", "target")


def residual_dataset(
    known: KnownMotion,
    source: str | Path | Measurement,
    *,
    facts: Mapping[str, str] | None = None,
    choices: ColumnChoices = NO_CHOICES,
    library: Library = LIBRARY,
    like: Dataset | None = None,
) -> Dataset:
    """Return what a model of a position error leaves in free run, as a deviation over the motion that it predicts.

    Parameters
    ----------
    known
        A model of the following error, or of the deviation.
    source, facts, choices, library, like
        As of `rtec.dataset.load.load_dataset`. The effects of a position loop are looked for as well.

    Raises
    ------
    ArgumentError
        A model of another output.
    FileFormatError
        A log without a commanded position, or one that the model cannot predict.

    Notes
    -----
    What comes back with the position is no input of such a model, and is left. Of the log that trained it, where it
    may have followed that by chance, the first half is left out, and so are the samples from which a free run starts.
    Place, speed and acceleration are those of the position that the model predicts, which is where the axis is but
    for what is left.
    """
    if known.head.observe not in (FOLLOWING_ERROR, DEVIATION):
        allowed = f"a model of {FOLLOWING_ERROR} or {DEVIATION}"
        raise ArgumentError("model", f"one of {known.head.observe}", allowed)
    log = log_like(known.head, source, choices)
    trained_here = known.trained_on(log.measurement.source)
    measurement = _left_by(known, log, len(log.sequences) // 2 if trained_here else 0)
    found = load_dataset(measurement, observe=DEVIATION, facts=facts, library=library.with_own(OF_LOOP), like=like)
    notes = [f"explained is what {known.name} leaves of the {known.head.observe.replace('_', ' ')} in free run"]
    if trained_here:
        notes.append("the model was trained on the first half of a log of this name: the second half is explained")
    return replace(found, notes=(*notes, *found.notes))


def _left_by(known: KnownMotion, log: DynamicLog, first: int) -> Measurement:
    left = dynamic_residual(known.model, log)
    seen = np.isfinite(left) & (np.arange(left.size) >= first)
    rows, measured = log.rows[seen], log.measurement
    if "target" not in measured.columns:
        raise ArgumentError("model", "a log without a commanded position", "one with it: effects depend on the place")
    kept = {name: measured.columns[name] for name in _KEPT if name in measured.columns}
    columns = {name: replace(column, values=column.values[rows]) for name, column in kept.items()}
    to_deviation = (-1.0 if known.head.observe == FOLLOWING_ERROR else 1.0) * (
        1e-3 if known.head.unit == "um" else 1.0
    )
    target = columns["target"]
    predicted = target.values + to_deviation * (log.sequences.output - left)[seen]
    columns["target"] = replace(target, values=predicted)
    columns[DEVIATION] = Column(DEVIATION, target.unit, to_deviation * left[seen])
    return replace(
        measured,
        columns=columns,
        unknown={},
        lines=None if measured.lines is None else [measured.lines[row] for row in rows],
        headings={},
    )
