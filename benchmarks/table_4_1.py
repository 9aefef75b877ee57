"""The thesis's comparison of training algorithms again, and what its networks reached in training.

Example::

    python benchmarks/table_4_1.py
    python benchmarks/table_4_1.py -o docs/predictors.md --figure docs/predictors-learning.png
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from diagnosis_job import lathe_calibration
from figure_4_1 import learning_figure
from into_page import print_or_write
from threadpoolctl import threadpool_limits

from rtec.predictors.fitting.algorithms import Algorithm, Problem
from rtec.predictors.fitting.layers import Layers, Shape
from rtec.predictors.fitting.samples import Samples, means_over_turns
from rtec.report.figures_style import write_figure
from rtec.units import MM_PER_INCH

Floats = npt.NDArray[np.float64]

GOAL = 4e-8
"""Sum of squares in square inches, thesis 4.3.1."""
STARTS, EPOCHS, RUNS, NOISE_UM = 10, 1000, 4, 1.0
PITCH_MM = 0.25 * MM_PER_INCH
PUBLISHED = {Algorithm.RPROP: (23.4, 4.67e-4), Algorithm.SCG: (44.9, 3.67e-4)}
PUBLISHED |= {Algorithm.BFGS: (54.3, 1.23e-7), Algorithm.LM: (65.8, 4.81e-8)}
"""Seconds and final error of Table 4-1, in its order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Data:
    """What a network is trained on: inputs with the ends of their ranges, and errors in inches."""

    inputs: Floats
    low: Floats
    high: Floats
    error: Floats

    def scaled(self) -> tuple[Floats, Floats, float]:
        """Return inputs from -1 to 1, errors of standard deviation 1, and the inches of one unit of these."""
        unit = float(self.error.std())
        middle, half = 0.5 * (self.high + self.low), 0.5 * (self.high - self.low)
        return (self.inputs - middle) / half, (self.error - self.error.mean()) / unit, unit

    def first_weights(self, shape: Shape, rng: np.random.Generator) -> Floats:
        """Return weights to begin with where inputs are taken as they are, as the thesis's toolbox draws them."""
        weights = shape.first_weights(rng)
        inputs, width = shape.widths[0], shape.widths[1]
        first = weights[: inputs * width].reshape(inputs, width)
        middle, half = 0.5 * (self.high + self.low), 0.5 * (self.high - self.low)
        first /= half[:, None]
        weights[inputs * width : (inputs + 1) * width] -= middle @ first
        return weights


@dataclass(frozen=True, slots=True, kw_only=True)
class Training:
    """One start: processor time, and the sum of squares in square inches at the start and after each epoch."""

    seconds: float
    course: tuple[float, ...]

    @property
    def epochs(self) -> int:
        """Return how many epochs it took."""
        return len(self.course) - 1

    @property
    def squares(self) -> float:
        """Return the sum of squares at its end."""
        return self.course[-1]

    def reached(self, goal: float) -> bool:
        """Return whether it reached a goal."""
        return self.squares <= goal


def averages(noise_um: float = NOISE_UM) -> Samples:
    """Return the means of four runs of the lathe's calibration, 1561 targets in both directions."""
    measured = lathe_calibration(RUNS, noise_um)
    names = {"position_mm": "target", "direction": "direction", "error_mm": "deviation"}
    return Samples(**{name: measured.columns[quantity].values for name, quantity in names.items()}).averaged()


def data_of(samples: Samples, *, turn: bool = False, position: bool = True) -> Data:
    """Return readings as a network takes them: position (inch), direction (0 or 1), place in the turn (inch)."""
    place = np.round(samples.position_mm / MM_PER_INCH, 6)
    columns = [(samples.direction < 0.0).astype(float)]
    ends = [(0.0, 1.0)]
    if position:
        columns.insert(0, place)
        ends.insert(0, (float(place.min()), float(place.max())))
    if turn:
        columns.append(np.round(place % 0.25, 6))
        ends.append((0.0, 0.25))
    order = np.argsort(-samples.direction, kind="stable")
    low, high = np.array(ends).T
    error = samples.error_mm / MM_PER_INCH
    return Data(inputs=np.stack(columns, axis=1)[order], low=low, high=high, error=error[order])


def folded(samples: Samples) -> Samples:
    """Return what means over whole turns leave of readings, averaged over all turns: one turn in both directions."""
    means = means_over_turns(samples, PITCH_MM)
    left = samples.error_mm.copy()
    for way, each in means.ways():
        rows = samples.direction == way
        left[rows] -= np.interp(samples.position_mm[rows], each.position_mm, each.error_mm)
    step = np.rint(samples.position_mm / (0.1 * PITCH_MM)) % 10
    position = step * 0.1 * PITCH_MM
    return Samples(position_mm=position, direction=samples.direction, error_mm=left).averaged()


def train(
    data: Data,
    hidden: tuple[int, ...],
    algorithm: Algorithm,
    seed: int,
    *,
    goal: float = GOAL,
    epochs: int = EPOCHS,
    scaled: bool = True,
) -> Training:
    """Train a network from one start up to the goal or the last epoch."""
    shape = Shape(inputs=data.inputs.shape[1], hidden=hidden)
    rng = np.random.default_rng(seed)
    if scaled:
        inputs, target, unit = data.scaled()
        weights = shape.first_weights(rng)
    else:
        inputs, target, unit = data.inputs, data.error, 1.0
        weights = data.first_weights(shape, rng)
    course: list[float] = []

    def watch(_: Floats, squares: float) -> bool:
        course.append(squares * unit**2)
        return len(course) <= epochs and course[-1] > goal and math.isfinite(squares)

    begun = time.process_time()
    with np.errstate(over="ignore", invalid="ignore"):
        algorithm.train(Problem(Layers(shape, inputs), target), weights, watch)
    return Training(seconds=time.process_time() - begun, course=tuple(course))


def trainings(data: Data, starts: int, *, scaled: bool) -> dict[Algorithm, list[Training]]:
    """Return the starts of each algorithm of Table 4-1."""
    return {
        algorithm: [train(data, (30,), algorithm, seed, scaled=scaled) for seed in range(starts)]
        for algorithm in PUBLISHED
    }


def table(trained: dict[Algorithm, list[Training]], note: str) -> Iterator[str]:
    """Yield Table 4-1 as markdown."""
    yield f"{note}:\n\n"
    yield "| algorithm | time, mean | epochs, mean | reached goal | SSE, mean | SSE, lowest | thesis: time | SSE |\n"
    yield "|---|---|---|---|---|---|---|---|\n"
    for algorithm, found in trained.items():
        seconds, squares = PUBLISHED[algorithm]
        ends = [one.squares for one in found]
        cells = (
            algorithm.title,
            f"{np.mean([one.seconds for one in found]):.2f} s",
            f"{np.mean([one.epochs for one in found]):.0f}",
            f"{sum(one.reached(GOAL) for one in found)} of {len(found)}",
            f"{np.mean(ends):.2e}",
            f"{min(ends):.2e}",
            f"{seconds} s",
            f"{squares:.2e}",
        )
        yield _row(cells)
    yield "\n"


def _row(cells: Sequence[str]) -> str:
    sys.stderr.write(f"{' | '.join(cells)}\n")
    return f"| {' | '.join(cells)} |\n"


def chapter_5(starts: int) -> Iterator[str]:
    """Yield as markdown what the networks of section 5.4 reach by Levenberg-Marquardt."""
    noisy, exact = averages(), averages(0.0)
    means = data_of(means_over_turns(noisy, PITCH_MM))
    one_turn = data_of(folded(noisy), turn=True, position=False)
    every, every_exact = (data_of(samples, turn=True) for samples in (noisy, exact))
    yield "| network, trained on | thesis | goal | reached | epochs | SSE, lowest | noise in it | time, mean |\n"
    yield "|---|---|---|---|---|---|---|---|\n"
    some = max(1, starts // 5)
    for what, data, hidden, published, goal, epochs, times, parts in (
        ("30, means over turns", means, (30,), "4e-8 in 600", 4e-8, 600, starts, 10),
        ("8, residue folded over the turn", one_turn, (8,), "9e-9 in 300", 9e-9, 300, starts, 156),
        ("40, every average", every, (40,), "7.00e-7 in 7500", 7e-7, 7500, some, 1),
        ("40, every average, without noise", every_exact, (40,), "7.00e-7 in 7500", 7e-7, 7500, some, 0),
        ("30-10, every average", every, (30, 10), "7.00e-7 in 3200", 7e-7, 3200, some, 1),
        ("30-10, every average, without noise", every_exact, (30, 10), "7.00e-7 in 3200", 7e-7, 3200, some, 0),
    ):
        found = [train(data, hidden, Algorithm.LM, seed, goal=goal, epochs=epochs) for seed in range(times)]
        least, most = min(one.epochs for one in found), max(one.epochs for one in found)
        rows = data.error.size
        noise = rows * (NOISE_UM * 1e-3 / MM_PER_INCH) ** 2 / RUNS / parts if parts else 0.0
        cells = (
            f"{what}: {rows}",
            published,
            f"{goal:.0e}",
            f"{sum(one.reached(goal) for one in found)} of {times}",
            f"{least} to {most}" if least < most else f"{most}",
            f"{min(one.squares for one in found):.2e}",
            f"{noise:.1e}" if noise else "none",
            f"{np.mean([one.seconds for one in found]):.1f} s",
        )
        yield _row(cells)
    yield "\n"


def tables(starts: int, figure: Path | None) -> str:
    """Return all tables as markdown, and draw the learning curves of the first two."""
    means = data_of(means_over_turns(averages(), PITCH_MM))
    notes = {
        "Inputs from -1 to 1, errors of standard deviation 1": True,
        "Inputs and errors in inches, as in Appendix C": False,
    }
    found = {note: trainings(means, starts, scaled=scaled) for note, scaled in notes.items()}
    if figure is not None:
        courses = {
            note: {algorithm: [one.course for one in every] for algorithm, every in trained.items()}
            for note, trained in found.items()
        }
        ends = {algorithm: squares for algorithm, (_, squares) in PUBLISHED.items()}
        write_figure(lambda: learning_figure(courses, goal=GOAL, published=ends), figure)
    return "".join([*(line for note, trained in found.items() for line in table(trained, note)), *chapter_5(starts)])


def main() -> int:
    """Print the tables, or put them into a page."""
    parser = argparse.ArgumentParser(description="Make Table 4-1 and the figures of section 5.4 again.")
    parser.add_argument("--starts", type=int, default=STARTS, help="trainings of each algorithm")
    parser.add_argument("-o", "--output", type=Path, help="page in which the tables stand between two comments")
    parser.add_argument("--figure", type=Path, help="PNG of the learning curves of Table 4-1")
    given = parser.parse_args()
    with threadpool_limits(1):
        print_or_write(parser, given.output, "table_4_1", lambda: tables(given.starts, given.figure))
    return 0


if __name__ == "__main__":
    sys.exit(main())
