"""Readings as pictures show them: by direction, against what they may depend on, few enough to draw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import SAME, Conditions, Floats
from rtec.inference.model import Model
from rtec.report.palette import FORWARD, NEUTRAL, REVERSE
from rtec.units import symbol

ALL, BACKWARD, AT_REST = "readings", "backward", "at rest"
"""Labels of all readings, where there is one group, and of those in one direction, or in none in a moving log."""
MOST_DOTS = 1200
"""Readings that a panel draws; of more, so many are chosen at random, the same in every run."""
FEWEST_FOR_MEANS = 15
"""Readings of a direction; of fewer no mean over neighbours is drawn."""
_IN_FIGURES = frozenset("µ°±−²³·–…")
Rows = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Way:
    """The readings of one direction and how they are drawn."""

    label: str
    colour: str
    marker: str
    dash: str
    rows: Mask


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Abscissa:
    """Something that the residual may depend on, with a label that carries its unit."""

    name: str
    label: str
    values: Floats


def residual(dataset: Dataset, model: Model) -> Floats:
    """Return what a model leaves, shape (rows,); about the mean where the model is not fitted."""
    if all(term.fitted for term in model.terms) and (model.terms or model.datum):
        return dataset.observed - model.predict(dataset)
    return dataset.observed - float(np.mean(dataset.observed))


def ways(conditions: Conditions) -> list[Way]:
    """Return the readings by direction; in one group where directions are not known or only one occurs."""
    everything = np.ones(conditions.rows, dtype=np.bool_)
    if not conditions.both_directions or conditions.direction is None:
        return [Way(label=ALL, colour=FORWARD, marker="o", dash="-", rows=everything)]
    found = [
        Way(label="forward", colour=FORWARD, marker="^", dash="-", rows=conditions.direction > 0),
        Way(label=BACKWARD, colour=REVERSE, marker="v", dash="--", rows=conditions.direction < 0),
        Way(label=AT_REST, colour=NEUTRAL, marker="o", dash=":", rows=conditions.direction == 0),
    ]
    return [way for way in found if way.rows.any()]


def figure_text(text: str, most: int = 40) -> str:
    r"""Return text that a figure can show as it stands: no sign that its font lacks or that means something to it.

    Examples
    --------
    >>> figure_text("temperature_nut"), figure_text("$\\frac{温")
    ('temperature_nut', '__frac{_')
    """
    known = (s if (s.isascii() and s.isprintable() and s not in "$\\") or s in _IN_FIGURES else "_" for s in text)
    kept = "".join(known)
    return kept if len(kept) <= most else kept[: most - 1] + "…"


def position_label(conditions: Conditions) -> str:
    """Return the label of the axis of positions, which is time where the file has no position."""
    name = "time" if conditions.time_is_coordinate else "position"
    return f"{name} ({symbol(conditions.position_unit)})"


def per_time(unit: str, power: int = 1) -> str:
    """Return a unit divided by seconds.

    Examples
    --------
    >>> per_time("mm"), per_time("deg", 2)
    ('mm/s', 'deg/s²')
    """
    return f"{symbol(unit)}/s" + ("²" if power == 2 else "")


def clock(conditions: Conditions) -> Abscissa:
    """Return time in a unit that suits its span, or row order where there is no time."""
    if conditions.time_s is None:
        return Abscissa(name="order", label="row order (no time in the file)", values=conditions.order)
    span = float(np.ptp(conditions.time_s))
    unit, seconds = ("h", 3600.0) if span > 3 * 3600 else ("min", 60.0) if span > 600 else ("s", 1.0)
    return Abscissa(name="time", label=f"time ({unit})", values=conditions.time_s / seconds)


def phase(conditions: Conditions, period: float) -> Abscissa:
    """Return the place within a period, in turns of it."""
    turns = conditions.position / period
    unit = symbol(conditions.position_unit)
    label = f"phase within the period of {period:.5g} {unit} (turns)"
    # what a file rounds to just below a whole turn belongs to its start
    return Abscissa(name="phase", label=label, values=turns - np.floor(turns + SAME))


def abscissas(conditions: Conditions, periods: tuple[float, ...] = ()) -> list[Abscissa]:
    """Return everything that there is a column for: position, velocity, time, temperature, reversal, phase."""
    c, unit = conditions, symbol(conditions.position_unit)
    found = [Abscissa(name="position", label=position_label(c), values=c.position)]
    if not c.time_is_coordinate:
        found.append(clock(c))
    if c.velocity is not None:
        found.append(Abscissa(name="velocity", label=f"velocity ({per_time(unit)})", values=c.velocity))
    if c.acceleration is not None:
        label = f"acceleration ({per_time(unit, 2)})"
        found.append(Abscissa(name="acceleration", label=label, values=c.acceleration))
    for name, values in c.temperatures.items():
        found.append(Abscissa(name=name, label=f"{figure_text(name.replace('_', ' '))} (°C)", values=values))
    if c.spindle_rpm is not None:
        found.append(Abscissa(name="spindle", label="spindle speed (rev/min)", values=c.spindle_rpm))
    if c.since_reversal is not None and c.both_directions:
        label = f"distance since the last reversal ({unit})"
        found.append(Abscissa(name="since_reversal", label=label, values=c.since_reversal))
    found += [phase(c, period) for period in periods if period > 0]
    return [one for one in found if float(np.ptp(one.values)) > 0.0]


def periods_of(model: Model, conditions: Conditions, unknown: float | None, most: int = 2) -> tuple[float, ...]:
    """Return the periods that are worth a look: found ones first, else stated ones, else that of what is unknown."""
    found = [term.period for term in model.terms if term.period is not None]
    stated = [conditions.screw_pitch, conditions.signal_period, conditions.revolution]
    named = [
        period for period in (unknown, *(found or stated)) if period is not None and 0 < period < conditions.span
    ]
    return tuple(dict.fromkeys(named))[:most]


def some_rows(rows: Mask, most: int = MOST_DOTS) -> Rows:
    """Return the numbers of the rows, or of ``most`` of them chosen at random, in order."""
    numbers = np.flatnonzero(rows)
    if numbers.size <= most:
        return numbers
    return np.sort(np.random.default_rng(0).choice(numbers, most, replace=False))
