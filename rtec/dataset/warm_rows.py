"""Which rows and columns of a warm machine's log are of use: sensors that fail and cells that are empty go."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.standstill import Ints
from rtec.dataset.warm_blocks import breaks_in
from rtec.dataset.warm_sensors import Failure, failures_of
from rtec.effects.conditions import Floats
from rtec.predictors.warm.features import SPINDLE_SPEED

FEWEST_ROWS = 20
"""That are of use."""
_MOSTLY = 0.5
_ALIKE = 0.05  # share of its range by which a temperature may differ over a break that the machine did not notice
_BEGINNING_S, _MOVES = 600.0, 0.02  # of a stretch, and share of its range by which a temperature moves in it
Columns = Mapping[str, Floats]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UsableRows:
    """What is left of a log.

    Parameters
    ----------
    rows
        Rows in which every sensor that is left has a value, shape (rows,).
    inputs, outputs, others
        Columns at these rows, shape (rows,) each.
    notes
        What was left out, in sentences.
    """

    rows: Ints
    inputs: Columns
    outputs: Columns
    others: Columns
    notes: tuple[str, ...]


def usable_rows(
    time_s: Floats, inputs: Columns, outputs: Columns, others: Columns, *, is_fixed: bool, asked: bool
) -> UsableRows:
    """Leave out sensors that fail, displacements that are hardly there, and rows in which a sensor has no value.

    Parameters
    ----------
    time_s
        Shape (rows,).
    inputs, outputs, others
        Sensors, displacements that are observed, and those that are not, shape (rows,) each; NaN without a value.
    is_fixed
        Whether a model asks for these very sensors: then none is left out.
    asked
        Whether the user named the displacement: then it is not left out.
    """
    failed = failures_of(time_s, inputs)
    inputs, notes = (inputs, _judged_anyway(failed)) if is_fixed else _without(inputs, failed)
    kept = np.ones(time_s.size, dtype=np.bool_)
    for failure in failed:
        if failure.name in inputs and not _is_steady(failure):
            kept &= ~failure.rows
            notes.append(f"{failure}: {np.count_nonzero(failure.rows)} rows are left out")
    good = {}
    for name, values in outputs.items():
        missing = ~np.isfinite(values)
        if missing.mean() > _MOSTLY and not asked and not is_fixed:
            notes.append(
                f"{name} is missing in {np.count_nonzero(missing)} of {missing.size} rows: it is not observed"
            )
            continue
        good[name] = values
        if missing.any():
            first = time_s[np.argmax(missing)]
            notes.append(
                f"{name} is missing in {np.count_nonzero(missing)} rows, first at {first:.6g} s: they are not used"
            )
    rows = np.flatnonzero(kept)
    return UsableRows(
        rows=rows,
        inputs={name: values[rows] for name, values in inputs.items()},
        outputs={name: values[rows] for name, values in good.items()},
        others={name: values[rows] for name, values in others.items() if np.isfinite(values[rows]).all()},
        notes=tuple(notes),
    )


def _is_steady(failure: Failure) -> bool:
    """Return whether a sensor says something in every row, if nothing of use."""
    return failure.what.startswith(("stands still", "jumps", "is "))


def _judged_anyway(failed: list[Failure]) -> list[str]:
    told = [
        one for one in failed if _is_steady(one) and not one.what.startswith("is ")
    ]  # a single speed is no failure
    return [f"{one}: a model that asks for it is judged with what it says" for one in told]


def _without(inputs: Columns, failed: list[Failure]) -> tuple[Columns, list[str]]:
    """Return the inputs without sensors that fail; the last thermometer stays where it works in many rows."""
    notes = []
    left = dict(inputs)
    for failure in (one for one in failed if one.sensor_fails):
        heats = [name for name in left if name != SPINDLE_SPEED]
        works = np.count_nonzero(~failure.rows) >= FEWEST_ROWS
        if heats == [failure.name] and works and not _is_steady(failure):
            continue
        del left[failure.name]
        notes.append(f"{failure}: the sensor is left out")
    return left, notes


def continued(time_s: Floats, run: Ints, inputs: Columns) -> tuple[Floats, tuple[int, ...], list[str]]:
    """Return the times, the rows at which a log starts anew, and what is to be said of its clock.

    The log starts anew where the run changes. Where the time jumps back, or nothing was read for ten intervals and
    ten minutes, it starts anew unless all thermometers together differ by less than 5 % of their ranges: then only
    the clock was set, or the machine stayed as warm, and the time goes on at the usual interval.
    """
    steps, same_run = np.diff(time_s), np.diff(run) == 0
    back, gap, usual_s = breaks_in(time_s)
    stays = _stays_warm(inputs, steps.size)
    closed = (back | gap) & same_run & stays
    notes = []
    kinds = ((back, "the time jumps back"), (gap, "nothing was read for a while"))
    ends = ((closed, "temperatures hardly differ, and the log goes on"), (~closed, "a new stretch begins there"))
    for where, what in kinds:
        for which, then in ends:
            found = np.flatnonzero(where & which & same_run)
            if found.size:
                others = f" and {found.size - 1} more times" if found.size > 1 else ""
                notes.append(f"{what} after {time_s[found[0]]:.6g} s{others}: {then}")
    steps = np.where(closed, usual_s, steps)
    starts = 1 + np.flatnonzero((back | gap | ~same_run) & ~closed)
    return time_s[0] + np.concatenate([[0.0], np.cumsum(steps)]), (0, *starts.tolist()), notes


def from_rest(time_s: Floats, starts: tuple[int, ...], inputs: Columns) -> tuple[Columns, list[str]]:
    """Return inputs in which a stretch that begins with a turning spindle begins at rest, and what is said of it.

    What lags is in balance with its sensor where a stretch begins, as if the spindle had turned for hours. Where the
    temperatures move in the first ten minutes, by 2 % of their ranges on average, it has not: then its speed is 0 in
    the first row, from which it is held for an interval.
    """
    speed = inputs.get(SPINDLE_SPEED)
    if speed is None:
        return inputs, []
    heats = [values for name, values in inputs.items() if name != SPINDLE_SPEED and np.ptp(values) > 0.0]
    begun, ends = [], (*starts[1:], time_s.size)
    for start, end in zip(starts, ends, strict=True):
        later = min(start + int(np.searchsorted(time_s[start:end], time_s[start] + _BEGINNING_S)), end - 1)
        moved = [abs(values[later] - values[start]) / np.ptp(values) for values in heats]
        if speed[start] != 0.0 and (not moved or np.mean(moved) > _MOVES):
            begun.append(start)
    if not begun:
        return inputs, []
    changed = speed.copy()
    changed[begun] = 0.0
    where = f"at {time_s[begun[0]]:.6g} s, where a stretch begins"
    note = f"the spindle turns {where}, and temperatures move: it is taken to have stood before"
    return {**inputs, SPINDLE_SPEED: changed}, [note]


def _stays_warm(inputs: Columns, steps: int) -> NDArray[np.bool_]:
    heats = [values for name, values in inputs.items() if name != SPINDLE_SPEED and np.ptp(values) > 0.0]
    if not heats:
        return np.zeros(steps, dtype=np.bool_)
    moved = np.mean([np.abs(np.diff(values)) / np.ptp(values) for values in heats], axis=0)
    return np.asarray(moved < _ALIKE)
