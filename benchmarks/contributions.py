"""What is left of a corrected axis, as a stack: causes switched on alone, their squares added.

A trained predictor is the true error and three curves besides, so that each of them can be left away and the axis be
measured again::

    predictor = true error + interpolation + shape + training readings

*Training readings*: by how much the predictor differs from the one trained on exact readings. *Shape*: what that one
leaves at the points that it was made at, and straight lines between them. *Interpolation*: what else it leaves
between them. The three are parts of one curve and may go together: twice their *covariance* belongs to the stack.
Insertion has two parts: *rounding* of the correction to whole steps, and *timing*, all that a box with its processor
and link adds. *At rest*: where the servo lets the axis stand, with nothing else at work. *Repeatability*: of the
readings that judge.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from corrected_axis import Lathe, Recipe, Repeatability, side_by_side

from rtec.injector import Design
from rtec.predictors import BidirectionalTable, Predictor, UnidirectionalTable

Floats = npt.NDArray[np.float64]
Curve = tuple[Floats, Floats]
"""A function of the position, forward and reverse, on the grid."""

REPEATABILITY, REST, ROUNDING, TIMING = "repeatability", "at rest", "rounding", "timing"
INTERPOLATION, SHAPE, TRAINING, COVARIANCE = "interpolation", "shape", "training readings", "covariance"
OF_PREDICTOR = (INTERPOLATION, SHAPE, TRAINING)
CAUSES = (REPEATABILITY, *OF_PREDICTOR, COVARIANCE, ROUNDING, TIMING, REST)
PREDICTOR, INSERTION = "predictor", "insertion"
GRID_MM = 0.0127
"""Of the curves; straight lines between its points miss the cyclic error by 1.5 nm."""
_EDGE_MM = 1e-5
"""Length of a step's flank: a table has no jumps."""


def mean_square_um2(deviation_mm: Floats) -> float:
    """Return the mean square about the mean: no figure of the thesis's table depends on where the zero lies."""
    return 1e6 * float(np.var(deviation_mm))


class Split:
    """A predictor as the true error and three curves.

    Parameters
    ----------
    error
        The true error of the axis.
    exact, real
        The predictor trained on readings without error, and as it is.
    targets_mm
        Where the readings were taken.
    """

    def __init__(self, error: Predictor, exact: Predictor, real: Predictor, targets_mm: Floats) -> None:
        points = {way: points_of(exact, way, targets_mm) for way in (1, -1)}
        low, high = targets_mm.min(), targets_mm.max()
        self.grid_mm: Floats = np.linspace(low, high, round((high - low) / GRID_MM) + 1)
        self.real = real
        self._error: list[Floats] = []
        curves: dict[str, list[Floats]] = {name: [] for name in OF_PREDICTOR}
        for way in (1, -1):
            true, clean, found = (p.error_mm(self.grid_mm, way) for p in (error, exact, real))
            at = points[way]
            shape = np.interp(self.grid_mm, at, exact.error_mm(at, way) - error.error_mm(at, way))
            self._error.append(true)
            curves[INTERPOLATION].append(clean - true - shape)
            curves[SHAPE].append(shape)
            curves[TRAINING].append(found - clean)
        self.curves: Mapping[str, Curve] = {name: (up, down) for name, (up, down) in curves.items()}

    def only(self, *causes: str) -> Predictor:
        """Return the true error with some of the curves."""
        up, down = (true + sum(self.curves[cause][side] for cause in causes) for side, true in enumerate(self._error))
        return table(self.grid_mm, up, down)


def points_of(predictor: Predictor, way: int, targets_mm: Floats) -> Floats:
    """Return the points that a predictor was made at: those of a table, else all targets."""
    if isinstance(predictor, UnidirectionalTable):
        return predictor.positions_mm
    if isinstance(predictor, BidirectionalTable):
        return predictor.forward_positions_mm if way > 0 else predictor.reverse_positions_mm
    return np.unique(targets_mm)


def table(grid_mm: Floats, up: Floats, down: Floats) -> BidirectionalTable:
    """Return a predictor that goes through two curves."""
    return BidirectionalTable(
        forward_positions_mm=grid_mm, forward_errors_mm=up, reverse_positions_mm=grid_mm, reverse_errors_mm=down
    )


def stairs(error: Predictor, step_mm: float, low_mm: float, high_mm: float) -> BidirectionalTable:
    """Return an error rounded to whole steps: what a box inserts that knows it, and loses no time."""
    grid = np.linspace(low_mm, high_mm, round((high_mm - low_mm) / GRID_MM) + 1)
    sides = []
    for way in (1, -1):
        steps = error.error_mm(grid, way) / step_mm
        level = np.floor(steps + 0.5)
        at = np.flatnonzero(np.diff(level))
        edge = np.maximum(level[at], level[at + 1]) - 0.5
        share = (edge - steps[at]) / (steps[at + 1] - steps[at])
        flank = grid[at] + np.clip(share, 0.01, 0.99) * GRID_MM
        x = np.concatenate([grid, flank - _EDGE_MM / 2, flank + _EDGE_MM / 2])
        y = np.concatenate([level, level[at], level[at + 1]])
        order = np.argsort(x, kind="stable")
        sides.append((x[order], y[order] * step_mm))
    (x, up), (z, down) = sides
    return BidirectionalTable(
        forward_positions_mm=x, forward_errors_mm=up, reverse_positions_mm=z, reverse_errors_mm=down
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stack:
    """What is left with one predictor and one way of inserting, in µm² about the mean.

    Parameters
    ----------
    recipe, design
        What corrects; None inserts fractions of a count.
    whole
        Measured with everything at work.
    alone
        What each cause adds where no other is at work but rest.
    last
        By how much the whole falls without repeatability, with a predictor that knows, and with ideal insertion.
    readings
        How many there are.
    """

    recipe: str
    design: Design | None
    whole: float
    alone: Mapping[str, float]
    last: Mapping[str, float]
    readings: int

    @property
    def sum(self) -> float:
        """All causes, each as it is alone."""
        return sum(self.alone.values())

    @property
    def predictor(self) -> float:
        """What the predictor adds, its parts and what they have in common."""
        return sum(self.alone[cause] for cause in (*OF_PREDICTOR, COVARIANCE))

    @property
    def insertion(self) -> float:
        """What insertion adds."""
        return self.alone[ROUNDING] + self.alone[TIMING]

    @property
    def disagreement(self) -> float:
        """By how much the sum differs from the whole, as a share of the whole."""
        return self.sum / self.whole - 1.0

    @property
    def by_chance(self) -> float:
        """Standard deviation of ``disagreement`` if all causes were independent from reading to reading."""
        groups = (self.alone[REPEATABILITY], self.predictor, self.alone[ROUNDING], self.alone[REST])
        pairs = sum(max(a, 0.0) * max(b, 0.0) for a, b in itertools.combinations(groups, 2))
        return 2.0 * math.sqrt(pairs / self.readings) / self.whole

    @property
    def disagreement_last(self) -> float:
        """The largest difference between a cause alone and the same cause taken away, as a share of the whole."""
        alone = {REPEATABILITY: self.alone[REPEATABILITY], PREDICTOR: self.predictor, INSERTION: self.insertion}
        return max(abs(self.last[cause] - alone[cause]) for cause in alone) / self.whole


class Contributions:
    """Measures stacks: the axis again and again, with other causes at work.

    Parameters
    ----------
    lathe, repeats, seed
        The axis, how its readings repeat, and which draw of it.
    designs
        Ways of inserting; None inserts fractions of a count.
    """

    def __init__(
        self,
        lathe: Lathe,
        repeats: Repeatability,
        seed: int = 0,
        designs: tuple[Design | None, ...] = (None, *Design),
    ) -> None:
        self._lathe, self._repeats, self._seed, self._designs = lathe, repeats, seed, designs
        self.noise_mm = repeats.draw(lathe.many, (seed, 0, 3))
        found = side_by_side(lambda design: self._deviation(lathe.error, design), designs)
        self._known = dict(zip(designs, found, strict=True))
        self.rest_um2 = mean_square_um2(self._known[None])
        self._rounding = {design: self.rounded(design) for design in designs}

    def _deviation(self, belief: Predictor, design: Design | None = None) -> Floats:
        return self._lathe.deviation(belief, design, task=self._lathe.many)

    def rounded(self, design: Design | None) -> float:
        """Return what rounding to the steps of a design adds."""
        if design is None:
            return 0.0
        lathe = self._lathe
        target = lathe.many.target_mm
        step_mm = design.step_counts * lathe.study.encoder.count_mm
        ideal = stairs(lathe.error, step_mm, target.min(), target.max())
        return mean_square_um2(self._deviation(ideal)) - self.rest_um2

    def split(self, recipe: Recipe) -> Split:
        """Train a predictor, on the calibration's readings and on exact ones."""
        lathe = self._lathe
        exact = lathe.exact(rounds=recipe.rounds)
        real = recipe.fit(lathe.calibration(self._repeats, self._seed, rounds=recipe.rounds))
        return Split(lathe.error, recipe.fit(exact), real, exact.target_mm)

    def stacks(self, recipe: Recipe, split: Split) -> list[Stack]:
        """Return the stack of each way of inserting."""
        noise = self.noise_mm
        jobs: list[tuple[Predictor, Design | None]] = [(split.only(cause), None) for cause in OF_PREDICTOR]
        jobs += [(split.real, design) for design in self._designs]
        seen = side_by_side(lambda job: self._deviation(*job), jobs)
        parts, left = seen[: len(OF_PREDICTOR)], dict(zip(self._designs, seen[len(OF_PREDICTOR) :], strict=True))
        alone = {
            cause: mean_square_um2(found) - self.rest_um2 for cause, found in zip(OF_PREDICTOR, parts, strict=True)
        }
        alone[COVARIANCE] = mean_square_um2(left[None]) - self.rest_um2 - sum(alone.values())
        alone |= {REPEATABILITY: mean_square_um2(noise), REST: self.rest_um2}
        stacks = []
        for design in self._designs:
            whole = mean_square_um2(left[design] + noise)
            rounding = self._rounding[design]
            timing = mean_square_um2(self._known[design]) - self.rest_um2 - rounding
            every = alone | {ROUNDING: rounding, TIMING: timing}
            last = {
                REPEATABILITY: whole - mean_square_um2(left[design]),
                PREDICTOR: whole - mean_square_um2(self._known[design] + noise),
                INSERTION: whole - mean_square_um2(left[None] + noise),
            }
            stacks.append(
                Stack(
                    recipe=recipe.name,
                    design=design,
                    whole=whole,
                    alone={cause: every[cause] for cause in CAUSES},
                    last=last,
                    readings=noise.size,
                )
            )
        return stacks


def root(square: float) -> float:
    """Return the root of a mean square; of one below zero that of its size, with its sign."""
    return math.copysign(math.sqrt(abs(square)), square)
