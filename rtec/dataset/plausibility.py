"""Whether a positioning test can be what it seems: mistaken units, directions or signs, outliers, copies, clocks.

What ISO 230-2 asks of targets and runs stands in the warnings of the figures.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.from_measurement import clock_runs_back
from rtec.dataset.kind import is_moving
from rtec.dataset.outliers import FAR, far_from_neighbours, robust_scale
from rtec.dataset.repeats import medians_of_cells, members_of, pair_numbers, place_numbers
from rtec.dataset.run_agreement import Misfit, misfits
from rtec.dataset.unseen import shifted_targets, unseen_periods
from rtec.effects import Floats
from rtec.metrology import Measurement
from rtec.metrology.tables.choices import as_option
from rtec.readable import quantity_text

_FEWEST_REPEATS, _FEWEST_TARGETS = 3, 3
_MOST_SHOWN = 8
_RARELY, _BY_CHANCE = 0.1, 0.01
"""Share of equal repeats where nothing tells it, and the chance of equal passes below which they are copies."""
_NEARLY_ALL = 0.95  # share of steps against the direction above which it is the wrong one
_COARSE = 1e-2  # deviations above this share of the travel are hardly those of an axis
_FINE, _FINEST = 2e-7, {"mm": 1e-4, "deg": 1e-5}  # nor are those below this share that are below this size, too
_SLIPS = {
    "mm": {1e3: "mm among um", 1e-3: "um among mm", 25.4: "inch among mm", 1 / 25.4: "mm among inch"},
    "deg": {3600.0: "deg among arcsec", 1 / 3600.0: "arcsec among deg"},
}
"""By which factor a reading agrees with its repeats where its unit was mistaken."""
_TELLING, _CLOSE = 2.0, 0.4
"""Times what an outlier is off, at least: near zero any reading agrees with the others once it is made small; and up
to which it agrees in its right unit."""
_EXCHANGED = "its directions look exchanged"


def implausible(measurement: Measurement, data: Dataset) -> tuple[str, ...]:
    """Return what speaks against a positioning test, in sentences with line and column.

    ``data`` are the deviations of the measurement row by row, at rest.
    """
    test = _Test(measurement, data)
    if _moves(measurement, data):
        return ("the axis moves while it is read: a log of its motion is no positioning test", *_clock(test))
    odd = misfits(data)
    apart = np.isin(data.conditions.run, [one.run for one in odd])
    slips, slipped = _unit_slips(test, apart)
    checks = (
        _unit_of_all(test, apart) if all(one.outvoted for one in odd) else (),
        _against_direction(test, {one.run for one in odd if None in one.changes}),
        _of_runs(test, odd),
        slips,
        _outliers(test, far_from_neighbours(data) & ~slipped & ~apart),
        _copies(test),
        _clock(test),
        _other_targets(test),
        _sorted(test),
    )
    return tuple(text for check in checks for text in _not_too_many([*check]))


def unseen(measurement: Measurement, data: Dataset) -> tuple[str, ...]:
    """Return that its targets hide periods, and which change would show them."""
    periods = () if _moves(measurement, data) else unseen_periods(data.conditions)
    change = shifted_targets(data.conditions) if periods else None
    even = "; ISO 230-2 asks for uneven steps" if any("/ k" in period for period in periods) else ""
    what = f"these targets cannot show periods of {', '.join(periods)}{even}{f': {change}' if change else ''}"
    return (f"column {measurement.called('target')}: {what}",) if periods else ()


def _not_too_many(texts: list[str]) -> list[str]:
    """Shorten a long list for a message."""
    more = len(texts) - _MOST_SHOWN
    if more <= 0:
        return texts
    return [*texts[: _MOST_SHOWN - 1], f"{texts[_MOST_SHOWN - 1]}; and {more} more of this kind"]


def _moves(measurement: Measurement, data: Dataset) -> bool:
    time_s = measurement.columns["time"].values if "time" in measurement.columns else None
    return is_moving(time_s, data.conditions.position, data.conditions.run, has_velocity=False)


class _Test:
    """The readings with names for people: lines of the file, passes, the column that holds the deviation."""

    def __init__(self, measurement: Measurement, data: Dataset) -> None:
        self.measurement, self.data = measurement, data
        self.unit = data.units.position
        self.column = "deviation" if "deviation" in measurement.columns else "actual"
        self.places = place_numbers(data.conditions.position)
        self.passes = sorted(members_of(self._pass_numbers()), key=lambda rows: int(rows[0]))

    def _pass_numbers(self) -> np.ndarray:
        """Return the pass of each reading: its run and direction; by the order of the rows where nothing states runs.

        Rows may stand in another order than readings were taken in: sorted by target, or both ways at each target.
        """
        run, direction = self.data.conditions.run, self.data.conditions.direction
        if "run" not in self.measurement.columns or direction is None:
            return self.data.passage
        return pair_numbers(run, (direction > 0.0).astype(np.int64))

    def lines(self, rows: Iterable[int]) -> str:
        """Return where rows stand in the file: ``line 7``, ``lines 7 to 12``, ``lines 7, 9, 30``."""
        lines = [self.measurement.line_of(int(row)) for row in rows]
        known = [line for line in lines if line is not None]
        word, numbers = ("line", known) if known else ("reading", [int(row) + 1 for row in rows])
        numbers = sorted(numbers)
        if len(numbers) == 1:
            return f"{word} {numbers[0]}"
        if numbers[-1] - numbers[0] == len(numbers) - 1:
            return f"{word}s {numbers[0]} to {numbers[-1]}"
        more = f" and {len(numbers) - _MOST_SHOWN} more" if len(numbers) > _MOST_SHOWN else ""
        return f"{word}s {', '.join(map(str, numbers[:_MOST_SHOWN]))}{more}"

    def where(self, rows: Iterable[int], quantity: str = "") -> str:
        """Return lines and column of rows; of their deviations, unless another quantity is named."""
        rows = list(rows)
        return f"{self.lines(rows)}, column {self.measurement.called(quantity or self.column, rows)}"

    def way(self, row: int) -> str:
        """Return the direction of approach of a reading."""
        direction = self.data.conditions.direction
        return "" if direction is None else " forward" if direction[row] > 0 else " backward"

    def name(self, number: int) -> str:
        """Return what a pass is called."""
        first = int(self.passes[number][0])
        if "run" not in self.measurement.columns:
            return f"pass {number + 1}{self.way(first)}"
        return f"run {self.data.conditions.run[first]}{self.way(first)}"

    def place(self, row: int) -> str:
        """Return where a reading was taken."""
        return f"{self.data.conditions.position[row]:.9g} {self.unit}"

    def length(self, value: float, digits: int = 4) -> str:
        """Return a deviation in a unit that suits it."""
        small = {"mm": ("um", 1e3), "deg": ("arcsec", 3600.0)}.get(self.unit, (self.unit, 1.0))
        return quantity_text(value * small[1], small[0], digits=digits)


def _unit_of_all(test: _Test, apart: np.ndarray) -> Iterable[str]:
    """Say where the deviations are too large or too small for the travel, but for those of some runs."""
    travel = test.data.conditions.span
    low, high = np.quantile(test.data.observed[~apart], [0.02, 0.98])
    spread = float(high - low)
    if travel <= 0.0 or test.unit not in _SLIPS:
        return
    name = test.measurement.called(test.column)
    what = f"column {name}: the deviations span {test.length(spread)} on a travel of {travel:.6g} {test.unit}"
    too_small, too_large, *_ = _SLIPS[test.unit].values()
    if spread > _COARSE * travel:
        slip = too_large
    elif spread < min(_FINE * travel, _FINEST[test.unit]):
        slip = too_small
    else:
        return
    heading = "" if test.measurement.passes else test.measurement.headings.get(test.column, "")
    right = as_option(heading, f"{test.column}_{slip.split()[0]}")
    yield f"{what}: is the unit right ({slip.replace('among', 'taken for')})? Where it is not: {right}"


def _of_runs(test: _Test, odd: Iterable[Misfit]) -> Iterable[str]:
    """Say which runs agree with the others only once they are changed, and what to do."""
    for one in odd:
        looks, changed, correct = _words_of(one.changes, test.unit)
        how = f"it agrees with the other runs to {test.length(one.after, 2)} instead of {test.length(one.before, 2)}"
        if one.after >= one.before:
            how = "it scatters as the other runs do"
        do = f"correct its {correct}, or leave the run out"
        if not one.outvoted:
            looks = f"disagrees with run {', '.join(map(str, one.others))}, and it is open which of them is wrong"
            do = f"look up which is right, and correct the {correct} of the other"
        where = test.where(np.flatnonzero(test.data.conditions.run == one.run))
        yield f"{where}: run {one.run}: {looks}: {changed} {how}; {do}"


def _words_of(changes: Sequence[float | None], unit: str) -> tuple[str, str, str]:
    """Return how a run looks that has to be changed so, how it is changed, and what of it is to be corrected."""
    change = changes[0]
    if {None, -1.0} <= {*changes}:
        return f"{_EXCHANGED}, or its sign opposite", "with either corrected", "direction column or sign"
    if change is None:
        return _EXCHANGED, "with them exchanged", "direction column"
    if change < 0.0:
        return "its deviations seem to have the opposite sign", "with the other sign", "sign"
    times = f"{change:.4g} times too small" if change > 1.0 else f"{1 / change:.4g} times too large"
    slip = _SLIPS.get(unit, {}).get(change, "")
    return f"its deviations look {times}{slip and f', {slip}'}", f"multiplied by {change:.4g}", "unit"


def _unit_slips(test: _Test, apart: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Say which readings agree with their repeats only in another unit; and return which these are."""
    y, found = test.data.observed, np.zeros(test.data.rows, dtype=np.bool_)
    middle = np.where(apart, np.nan, medians_of_cells(test.data.observed, test.data.cell, _FEWEST_REPEATS))
    known = np.isfinite(middle)
    if not known.any():
        return [], found
    near = FAR * robust_scale((y - middle)[known]) + 1e-9 * np.abs(y)
    away = known & (np.abs(y - middle) > near)
    texts, possible = [], away & (np.abs(middle) > _TELLING * near)
    for factor, what in _SLIPS.get(test.unit, {}).items():
        slipped = possible & ~found & (np.abs(factor * y - middle) <= _CLOSE * near)
        for rows in test.passes:  # a zero that jumped moves many readings, and some of them anywhere
            slipped[rows] &= 2 * np.count_nonzero(slipped[rows]) > np.count_nonzero(away[rows])
        if slipped.any():
            rows = np.flatnonzero(slipped)
            how = f"multiplied by {factor:.4g} it agrees with the other readings at its target"
            texts.append(f"{test.where(rows)}: {how}: {what}?")
        found |= slipped
    return texts, found


def _outliers(test: _Test, found: np.ndarray) -> Iterable[str]:
    for row in np.flatnonzero(found).tolist():
        others = "the other readings" if test.data.cell[row] >= 0 else "its neighbours"
        what = f"{test.length(test.data.observed[row])} is far from {others} at {test.place(row)}{test.way(row)}"
        yield f"{test.where([row])}: {what}: an outlier?"


def _copies(test: _Test) -> Iterable[str]:
    """Say which passes hold the same deviations at the same targets as one before them, and not by chance."""
    alike: dict[tuple[int, ...], list[tuple[int, Floats]]] = {}
    for number, rows in enumerate(test.passes):
        ordered = rows[np.argsort(test.places[rows], kind="stable")]
        values = np.round(test.data.observed[ordered], 12)
        alike.setdefault(tuple(test.places[ordered].tolist()), []).append((number, values))
    for places, passes in alike.items():
        table = np.array([values for _, values in passes])
        equal = [np.count_nonzero(table[:later] == values, axis=1) for later, values in enumerate(table)]
        pairs = np.concatenate(equal)
        partly = pairs[pairs < len(places)]
        one_equal = (partly.sum() + _RARELY) / (partly.size * len(places) + 1.0)
        if len(places) < _FEWEST_TARGETS or pairs.size * one_equal ** len(places) > _BY_CHANCE:
            continue
        for (number, _), same in zip(passes, equal, strict=True):
            if (same == len(places)).any():
                before = test.name(passes[int(np.argmax(same))][0])
                what = f"{test.name(number)} has the same {len(places)} deviations as {before}: a copy?"
                yield f"{test.where(test.passes[number])}: {what}"


def _clock(test: _Test) -> Iterable[str]:
    column = test.measurement.columns.get("time")
    if column is None:
        return
    for row in clock_runs_back(column.values, test.data.conditions.run).tolist():
        what = f"{column.values[row]:g} s after {column.values[row - 1]:g} s"
        yield f"{test.where([row], 'time')}: {what}: the clock runs back"


def _other_targets(test: _Test) -> Iterable[str]:
    """Say which passes were not at the targets that most passes in their direction were at."""
    passes = [frozenset(test.places[rows].tolist()) for rows in test.passes]
    ways = [test.way(int(rows[0])) for rows in test.passes]
    often = Counter(zip(ways, passes, strict=True)).most_common()
    most = {way: places for (way, places), _ in reversed(often)}
    for number, (rows, places, way) in enumerate(zip(test.passes, passes, ways, strict=True)):
        usual = most[way]
        if places == usual:
            continue
        lacking, others = len(usual - places), [row for row in rows.tolist() if test.places[row] not in usual]
        what = [f"lacks {lacking} of {len(usual)} targets of the other runs"] if lacking else []
        what += [f"has {len(others)} that they have not, the first {test.place(others[0])}"] if others else []
        yield f"{test.where(others or rows, 'target')}: {test.name(number)} {' and '.join(what)}"


def _sorted(test: _Test) -> Iterable[str]:
    """Say where targets that stand in the file one by one, both ways together, tell no direction."""
    places, columns = test.data.conditions.position, test.measurement.columns
    if "direction" not in columns and 2 * np.count_nonzero(np.diff(places) == 0.0) >= places.size - 1:
        what = "the same target stands in rows one after the other, and no column tells the direction of approach"
        yield f"column {test.measurement.called('target')}: {what}: are the rows sorted by target?"


def _against_direction(test: _Test, known: set[int]) -> Iterable[str]:
    """Say where targets fall while the axis is said to go forward, and rise while it is said to go back.

    In all runs or in some; ``known`` are runs of which their deviations tell it.
    """
    run, direction = test.data.conditions.run, test.data.conditions.direction
    if direction is None or "direction" not in test.measurement.columns:
        return
    step = np.diff(test.data.conditions.position) * direction[1:]
    told = (run[1:] == run[:-1]) & (direction[1:] == direction[:-1]) & (step != 0.0)
    step, run_of_step = step[told], run[1:][told]
    what = "targets fall from row to row where it says forward, and rise where it says backward"
    against = {
        int(number): bool(np.mean(step[run_of_step == number] < 0.0) >= _NEARLY_ALL)
        for number, count in zip(*np.unique(run_of_step, return_counts=True), strict=True)
        if count >= _FEWEST_TARGETS
    }
    if step.size >= _FEWEST_TARGETS and np.mean(step < 0.0) >= _NEARLY_ALL:
        column = f"column {test.measurement.called('direction')}"
        yield f"{column}: {what}: are the directions exchanged? If so, exchange them in that column"
        return
    along = step[[not against.get(int(number), True) for number in run_of_step]]
    if along.size and np.mean(along > 0.0) >= _NEARLY_ALL:
        for number in (number for number, wrong in against.items() if wrong and number not in known):
            where = test.where(np.flatnonzero(run == number), "direction")
            do = "correct its direction column, or leave the run out"
            yield f"{where}: run {number}: {what}, unlike in other runs: {_EXCHANGED}; {do}"
