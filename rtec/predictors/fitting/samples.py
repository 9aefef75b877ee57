"""Readings as a fit takes them: places, directions and errors, and what a turn of the screw leaves of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats, column
from rtec.predictors.binding import axis_name
from rtec.predictors.protocol import FORWARD, REVERSE, Predictor
from rtec.predictors.tables import SAME_TARGET_MM

Ints = npt.NDArray[np.int64]

FEWEST_POINTS_A_TURN = 4
"""Two harmonics, the double hump of a screw (thesis, Figure 5.2), take two points each."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """Readings of an axis that were taken at known places.

    Raises
    ------
    ArgumentError
        Columns of different lengths, numbers that are not finite, or a direction other than +1 and -1.

    Examples
    --------
    >>> readings = Samples(position_mm=[0, 5, 5, 0], direction=[1, 1, -1, -1], error_mm=[0, 0.002, 0.004, 0.002])
    >>> readings.averaged().rows, readings.span_mm
    (4, (0.0, 5.0))
    """

    position_mm: Floats
    """Target of each reading, shape (n,), in mm."""
    direction: Floats
    """+1 or -1, the direction of approach, shape (n,)."""
    error_mm: Floats
    """Actual minus target, shape (n,), in mm."""
    others_mm: Mapping[int, Floats] = field(default_factory=dict)
    """Where other axes stood, by the number of the axis, each of shape (n,), in mm."""

    def __post_init__(self) -> None:
        rows = column("position_mm", self.position_mm).size
        for name in ("position_mm", "direction", "error_mm"):
            object.__setattr__(self, name, column(name, getattr(self, name), rows=rows))
        others = {axis: column(axis_name(axis), self.others_mm[axis], rows=rows) for axis in sorted(self.others_mm)}
        object.__setattr__(self, "others_mm", others)
        bad = np.flatnonzero(np.abs(self.direction) != 1.0)
        if bad.size:
            row = int(bad[0])
            raise ArgumentError(f"direction, row {row + 1}", f"{self.direction[row]:g}", "+1 or -1")

    @property
    def rows(self) -> int:
        """Number of readings."""
        return int(self.position_mm.size)

    @property
    def span_mm(self) -> tuple[float, float]:
        """Lowest and highest place."""
        return float(self.position_mm.min()), float(self.position_mm.max())

    def seen_by(self, inputs: Sequence[str]) -> dict[str, Floats]:
        """Return what the inputs of a predictor are at each reading, by their names.

        Raises
        ------
        ArgumentError
            One that readings of this kind do not tell.
        """
        known = {"position": self.position_mm, "direction": self.direction}
        known |= {axis_name(axis): values for axis, values in self.others_mm.items()}
        for name in inputs:
            if name not in known:
                raise ArgumentError("readings", f"no {name}", f"where the axes stood: {', '.join(inputs)}")
        return {name: known[name] for name in inputs}

    def left_by(self, predictor: Predictor) -> Floats:
        """Return what a predictor leaves of the readings, in mm, shape (n,)."""
        others = self.seen_by(predictor.inputs[2:]).values()
        return self.error_mm - predictor.error_mm(self.position_mm, self.direction, *others)

    def take(self, rows: npt.NDArray[np.bool_] | Ints) -> Samples:
        """Return some of the readings."""
        return Samples(
            position_mm=self.position_mm[rows],
            direction=self.direction[rows],
            error_mm=self.error_mm[rows],
            others_mm={axis: values[rows] for axis, values in self.others_mm.items()},
        )

    def with_error(self, error_mm: Floats) -> Samples:
        """Return readings of other errors at the same places."""
        return replace(self, error_mm=error_mm)

    def place(self) -> Ints:
        """Return the number of the place of each reading, 0, 1, ... along the axis; both directions have the same.

        Where other axes stood belongs to the place.
        """
        columns = [_steps_of(self.position_mm), *(_steps_of(values) for values in self.others_mm.values())]
        if len(columns) == 1:
            return columns[0]
        return np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)[1].ravel()

    def averaged(self) -> Samples:
        """Return the mean of the readings of each place and direction.

        Averages train, raw readings test (thesis 4.3). They stand in the order of the places, forward before reverse.
        """
        cell = 2 * self.place() + (self.direction < 0.0)
        found, first, number = np.unique(cell, return_index=True, return_inverse=True)
        mean = np.bincount(number, weights=self.error_mm) / np.bincount(number, minlength=found.size)
        return self.take(first).with_error(mean)

    def lines(self) -> Iterator[Samples]:
        """Yield the readings of each direction, and of each place of the other axes, in the order of their places."""
        place = [_steps_of(values) for values in self.others_mm.values()]
        line = np.unique(np.stack([-self.direction, *place], axis=1), axis=0, return_inverse=True)[1].ravel()
        for number in range(int(line.max()) + 1):
            rows = np.flatnonzero(line == number)
            yield self.take(rows[np.argsort(self.position_mm[rows], kind="stable")])

    def ways(self) -> Iterator[tuple[int, Samples]]:
        """Yield each direction that was measured, with its readings in the order of their places."""
        for way in (FORWARD, REVERSE):
            rows = np.flatnonzero(self.direction == way)
            if rows.size:
                yield way, self.take(rows[np.argsort(self.position_mm[rows], kind="stable")])


def _steps_of(values: Floats) -> Ints:
    """Return the number of each value, 0, 1, ... ascending; what is nearly the same has one number."""
    order = np.argsort(values, kind="stable")
    number = np.empty(values.size, dtype=np.int64)
    number[order] = np.cumsum(np.diff(values[order], prepend=values[order[:1]]) > SAME_TARGET_MM)
    return number


def points_a_turn(samples: Samples, pitch_mm: float) -> float:
    """Return how many places lie in a turn of the screw, from the median distance between neighbours.

    Examples
    --------
    >>> points_a_turn(Samples(position_mm=[0, 1, 2, 3], direction=[1, 1, 1, 1], error_mm=[0, 0, 0, 0]), 5.0)
    5.0
    """
    steps = np.diff(np.unique(samples.position_mm))
    steps = steps[steps > SAME_TARGET_MM]
    return float(pitch_mm / np.median(steps)) if steps.size else 0.0


def means_over_turns(averages: Samples, pitch_mm: float) -> Samples:
    """Return the means of the error over whole turns of the screw: what repeats every turn is gone from them.

    The mean is that of straight lines between the readings, so the places need not divide a turn.

    Parameters
    ----------
    averages
        One reading for each place and direction.
    pitch_mm
        Travel of a turn, in mm.

    Returns
    -------
    Samples
        A mean at the middle of each turn.

    Raises
    ------
    ArgumentError
        A direction that was not followed for two turns.

    References
    ----------
    Thesis 5.4: one network for the large errors, one for what is left within a turn.

    Examples
    --------
    >>> x = np.arange(0.0, 4.01, 0.1)
    >>> wave = Samples(position_mm=x, direction=np.ones(x.size), error_mm=0.01 + 0.002 * np.sin(2 * np.pi * x))
    >>> means = means_over_turns(wave, 1.0)
    >>> means.rows, bool(np.allclose(means.error_mm, 0.01, atol=1e-9))
    (4, True)
    """
    parts = []
    for line in averages.lines():
        x, y = line.position_mm, line.error_mm
        turns = float(x[-1] - x[0]) / pitch_mm
        if not turns > 2.0 - 1e-9:
            found = f"{x[-1] - x[0]:g} mm in direction {line.direction[0]:+g}"
            raise ArgumentError("readings", found, f"two turns of the screw or more, {2.0 * pitch_mm:g} mm")
        begin = x[0] + np.arange(math.floor(turns + 1e-9)) * pitch_mm
        area = _areas(x, y, begin + pitch_mm) - _areas(x, y, begin)
        means = line.take(np.zeros(begin.size, dtype=np.int64)).with_error(area / pitch_mm)
        parts.append(replace(means, position_mm=begin + 0.5 * pitch_mm))
    return together(parts)


def together(parts: Sequence[Samples]) -> Samples:
    """Return the readings of several parts, one part after the other.

    Examples
    --------
    >>> one = Samples(position_mm=[1.0], direction=[1], error_mm=[0.001], others_mm={2: [5.0]})
    >>> together([one, one]).others_mm[2].tolist()
    [5.0, 5.0]
    """
    names = ("position_mm", "direction", "error_mm")
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    others = {axis: np.concatenate([part.others_mm[axis] for part in parts]) for axis in parts[0].others_mm}
    return Samples(**columns, others_mm=others)


def _areas(x: Floats, y: Floats, ends: Floats) -> Floats:
    """Return the area below straight lines from the first place up to each end."""
    ends = np.clip(ends, x[0], x[-1])
    whole = np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x))])
    piece = np.clip(np.searchsorted(x, ends, side="right") - 1, 0, x.size - 2)
    into = ends - x[piece]
    slope = (y[piece + 1] - y[piece]) / (x[piece + 1] - x[piece])
    return whole[piece] + into * (y[piece] + 0.5 * slope * into)
