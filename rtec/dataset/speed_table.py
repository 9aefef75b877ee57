"""A table of readings at several speeds, with neither time nor position: all are at place 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.passes import passages
from rtec.dataset.repeats import cells_of, condition_numbers, place_numbers
from rtec.dataset.rows import Rows
from rtec.dataset.static_test import runs_of_passes
from rtec.dataset.to_dataset import dataset_of, with_conditions

_SAME_SPEED = 1e-3  # share by which two readings may differ in speed and still be at one speed


def speed_table(rows: Rows) -> Dataset:
    """Return the data set of a table: readings at one speed in one direction repeat each other."""
    velocity = np.asarray(rows.velocity, dtype=np.float64)
    if rows.direction is None:
        note = "no direction column: the direction is the sign of the velocity"
        rows = replace(rows, direction=np.sign(velocity), notes=(note, *rows.notes))
    speed = np.maximum(np.abs(velocity), _SAME_SPEED * np.abs(velocity).max() + 1e-300)
    at_speed = place_numbers(np.log(speed), _SAME_SPEED)  # measured speeds are never quite the same
    numbers = condition_numbers(rows.position, rows.direction, at_speed, rows.other_axes.values())
    if "run" not in rows.measurement.columns:
        rows = runs_of_passes(rows, numbers)
    rows, conditions = with_conditions(rows, moving=False)
    passage = passages(rows.run, rows.direction)
    return dataset_of(rows, conditions, rows.observed, passage, cells_of(numbers, passage))
