"""Sensors of a warm machine that fail: values that none can have, jumps, and a reading that stands still."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.effects.conditions import Floats
from rtec.predictors.warm.features import SPINDLE_SPEED

LOWEST_DEGC, HIGHEST_DEGC = -55.0, 125.0
"""Range of a DS18B20 (Maxim 19-7487, 2019); no machine that cuts is outside of it."""
_POWER_ON_DEGC = 85.0
"""What a DS18B20 says before its first conversion (same source)."""
_JUMP_K, _JUMP_K_S = 5.0, 0.05  # and as much more for each second: no thermometer on metal goes so far
_MOST_BAD = 0.05  # share of rows without which a sensor is still used
_STUCK_ROWS, _STUCK_SHARE = 20, 0.02  # in a row, and of the log
_LONGER = 4.0  # times any other stretch at one reading
_EXPECTED_STEPS = 6.0  # that a sensor which stands still should have made, as others moved


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Failure:
    """A sensor that fails.

    Parameters
    ----------
    name
        Of the input.
    rows
        In which it fails, shape (rows,).
    what
        In words, with the time.
    sensor_fails
        Whether the sensor is of no use; else its bad rows are.
    """

    name: str
    rows: NDArray[np.bool_]
    what: str
    sensor_fails: bool

    def __str__(self) -> str:
        return f"{self.name} {self.what}"


def failures_of(time_s: Floats, inputs: Mapping[str, Floats]) -> list[Failure]:
    """Return the sensors that fail, and those that never change.

    - A value is missing, outside -55 to 125 degC, or 85 degC or a jump for a single row that the rows beside it do
      not have. Where that holds for one row in twenty or more, the sensor fails.
    - A temperature jumps by more than 5 K, and 0.05 K for each second between the rows, and stays there.
    - A temperature stands still, to the last digit, for twenty rows and a fiftieth of the log or longer, and four
      times as long as ever else, while the others moved so far that it should have made six of its steps.

    Parameters
    ----------
    time_s, inputs
        Of each row, shape (rows,).

    Examples
    --------
    >>> time_s = 60.0 * np.arange(200)
    >>> heat = 20.0 + np.arange(200) / 10.0
    >>> broken = np.where(np.arange(200) == 50, 85.0, heat)
    >>> stuck = np.minimum(heat, 30.0)
    >>> inputs = {"temperature_a": heat, "temperature_b": broken, "temperature_c": stuck}
    >>> for failure in failures_of(time_s, inputs):
    ...     print(failure, failure.sensor_fails)
    temperature_b reads 85 degC at 3000 s False
    temperature_c stands still at 30 degC from 6000 s on, while others move True
    """
    found = []
    good = {}
    for name, values in inputs.items():
        bad = _bad(time_s, values) if name != SPINDLE_SPEED else ~np.isfinite(values)
        if bad.any():
            first = int(np.argmax(bad))
            reads = f"reads {values[first]:.4g} degC" if np.isfinite(values[first]) else "has no value"
            more = int(np.count_nonzero(bad)) - 1
            later = f" and in {more} other row{'s' * (more > 1)}" if more else ""
            what = f"{reads} at {time_s[first]:.6g} s{later}"
            fails = np.count_nonzero(bad) > _MOST_BAD * bad.size
            found.append(Failure(name=name, rows=bad, what=what, sensor_fails=bool(fails)))
            if fails:
                continue
        if np.ptp(values[~bad]) == 0.0:
            what = f"is {values[~bad][0]:.6g} in every row"
            found.append(Failure(name=name, rows=np.ones(bad.size, dtype=np.bool_), what=what, sensor_fails=True))
        elif name != SPINDLE_SPEED and not (jumped := _jumped(time_s[~bad], name, values[~bad])):
            good[name] = np.where(bad, np.interp(np.arange(bad.size), np.flatnonzero(~bad), values[~bad]), values)
        elif name != SPINDLE_SPEED:
            found += jumped
    return found + _stuck(time_s, good)


def _bad(time_s: Floats, values: Floats) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore"):
        bad = ~((values >= LOWEST_DEGC) & (values <= HIGHEST_DEGC))
    inside = np.flatnonzero(~bad)
    steps = _far(time_s[inside], values[inside])
    bad[inside[1:-1][steps[:-1] & steps[1:]]] = True
    if inside.size > 1 and steps[0] and values[inside[0]] == _POWER_ON_DEGC:
        bad[inside[0]] = True
    return bad


def _far(time_s: Floats, values: Floats) -> NDArray[np.bool_]:
    """Return which steps from one reading to the next are too large for metal, shape (rows - 1,)."""
    return np.asarray(np.abs(np.diff(values)) > _JUMP_K + _JUMP_K_S * np.abs(np.diff(time_s)))


def _jumped(time_s: Floats, name: str, values: Floats) -> list[Failure]:
    """Return the failure of a sensor whose reading jumps and stays there, as one that came loose does."""
    steps = _far(time_s, values)
    if not steps.any():
        return []
    row = int(np.argmax(steps)) + 1
    what = f"jumps from {values[row - 1]:.4g} to {values[row]:.4g} degC at {time_s[row]:.6g} s"
    return [Failure(name=name, rows=np.arange(values.size) >= row, what=what, sensor_fails=True)]


def _stuck(time_s: Floats, heats: Mapping[str, Floats]) -> list[Failure]:
    found = []
    for name, values in heats.items():
        steps = np.abs(np.diff(values))
        begins = np.concatenate([[0], 1 + np.flatnonzero(steps), [values.size]])
        lengths = np.diff(begins)
        longest = int(np.argmax(lengths))
        first, last = int(begins[longest]), int(begins[longest + 1])
        usual = np.sort(lengths)[-2]
        if last - first < max(_STUCK_ROWS, _STUCK_SHARE * values.size, _LONGER * usual):
            continue
        others = [np.ptp(one[first:last]) / np.ptp(one) for other, one in heats.items() if other != name]
        expected = float(np.median(others)) * np.ptp(values) if others else 0.0
        if expected > _EXPECTED_STEPS * steps[steps > 0.0].min():
            rows = np.zeros(values.size, dtype=np.bool_)
            rows[first:last] = True
            until = "on" if last == values.size else f"to {time_s[last - 1]:.6g} s"
            what = f"stands still at {values[first]:.4g} degC from {time_s[first]:.6g} s {until}, while others move"
            found.append(Failure(name=name, rows=rows, what=what, sensor_fails=True))
    return found
