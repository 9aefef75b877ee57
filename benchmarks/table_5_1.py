"""The thesis's comparison of compensations again, through the closed loop, and what its remaining errors consist of.

Example::

    python benchmarks/table_5_1.py
    python benchmarks/table_5_1.py -o docs/predictors.md --figure docs/predictors-stack.png
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from contributions import CAUSES, Contributions, Stack, root
from corrected_axis import (
    STARTS,
    Lathe,
    Recipe,
    Repeatability,
    at_the_command,
    bi_directional,
    by_training,
    every_inch,
    side_by_side,
    uni_directional,
)
from figure_5_1 import stack_figure
from into_page import print_or_write
from threadpoolctl import threadpool_limits

from rtec.injector import Design
from rtec.metrology import PositioningFigures
from rtec.predictors import Predictor
from rtec.units import MM_PER_INCH

Floats = npt.NDArray[np.float64]

STUDY = Repeatability(white_um=1.0)
"""Of the built-in study."""
ASKED = Repeatability(white_um=3.0, drift_um=8.0)
"""With which the published figures are likely draws."""
MODELS = {"1 µm": STUDY, "5 µm": Repeatability(white_um=5.0), "3 µm, drift of 8 µm/√h": ASKED}
UNCOMPENSATED, BI, NETWORK = "uncompensated", "bi-directional", "network 30 + 8"
PUBLISHED = {
    UNCOMPENSATED: (0.005582, 0.004181, 0.005570, 0.00145),
    BI: (0.000995, 0.000813, 0.001098, 0.0005),
    NETWORK: (0.000933, 0.000614, 0.001043, 0.0005),
}
"""Of Table 5-1, in inches: maximum average error, maximum reversal, maximum repeat, cyclic (approximately)."""
NOTE = (
    "The stack, with 1 µm: roots of mean squares in µm, then how far the sum of the squares is off the whole's"
    " ([all designs](predictors-stack.csv)):"
)
DRAWS, WHITE_DRAWS, WHITE_UM = 10, 5, range(13)


def recipes(lathe: Lathe, starts: int = STARTS) -> dict[str, Recipe]:
    """Return the predictors in the order of the tables: of the thesis's calibration, then of both rounds."""
    first = (
        Recipe(name="uni-directional", rounds=1, fit=uni_directional),
        Recipe(name=BI, rounds=1, fit=bi_directional),
        Recipe(name="bi-directional, read at the target", rounds=1, fit=at_the_command),
        Recipe(name="bi-directional, every inch", rounds=1, fit=every_inch),
        by_training("network 30 + 8 lm", lathe, 1, NETWORK, starts),
    )
    second = (
        by_training("table bi-directional linear", lathe, 2, "two rounds: bi-directional, spacing chosen"),
        by_training("network 30 + 8 lm", lathe, 2, f"two rounds: {NETWORK}", starts),
        by_training("effects", lathe, 2, "two rounds: effects"),
    )
    return {recipe.name: recipe for recipe in (*first, *second)}


STACKED = (
    "uni-directional",
    BI,
    "bi-directional, every inch",
    NETWORK,
    "two rounds: bi-directional, spacing chosen",
    f"two rounds: {NETWORK}",
    "two rounds: effects",
)
DRAWN = {
    "uni-directional": "uni-directional",
    BI: "bi-directional",
    NETWORK: "network 30 + 8,\nthesis's calibration",
    f"two rounds: {NETWORK}": "network 30 + 8,\ntwo rounds of calibration",
}
"""Panels of the picture and their titles."""


def uncompensated(lathe: Lathe, repeats: Repeatability, seed: int) -> PositioningFigures:
    """Return the figures of the thesis's uncompensated measurement: the calibration itself."""
    return lathe.figures(lathe.calibration(repeats, seed, rounds=1))


def title_of(design: Design | None) -> str:
    """Return how a correction gets in."""
    return "ideally" if design is None else design.title


SHOWN = (title_of(None), title_of(Design.ORIGINAL))
"""On the page; the other designs lie between."""


def row(*cells: str) -> str:
    """Return a row of a table, told on the way."""
    sys.stderr.write(f"{' | '.join(cells)}\n")
    return f"| {' | '.join(cells)} |\n"


def head(*cells: str) -> Iterator[str]:
    """Yield the head of a table."""
    yield f"| {' | '.join(cells)} |\n"
    yield f"|{'---|' * len(cells)}\n"


def three(figures: PositioningFigures) -> tuple[float, float, float]:
    """Return maximum average error, maximum reversal and maximum repeat in inches."""
    found = (figures.max_average_error, figures.max_reversal_error, figures.max_repeat)
    average, reversal, repeat = (value / MM_PER_INCH for value in found)
    return average, reversal, repeat


def inches(figures: PositioningFigures) -> tuple[str, ...]:
    """Return the four figures as cells; cyclic forward and reverse."""
    both = (figures.cyclic_forward.peak_to_peak, figures.cyclic_backward.peak_to_peak)
    cyclic = ", ".join(f"{value / MM_PER_INCH:.5f}" for value in both)
    return (*(f"{value:.6f}" for value in three(figures)), cyclic)


FIGURES = ("max. average error", "max. reversal", "max. repeat", "cyclic, forward and reverse")


def thesis_row(name: str, *before: str) -> str:
    """Return the published figures of a row."""
    average, reversal, repeat, cyclic = PUBLISHED[name]
    figures = (f"{average:.6f}", f"{reversal:.6f}", f"{repeat:.6f}", f"about {cyclic}")
    return row(f"*thesis: {name}*", *before, *(f"*{figure}*" for figure in figures))


def thesis_table(lathe: Lathe, real: dict[str, Predictor]) -> Iterator[str]:
    """Yield Table 5-1 with every predictor ideally applied."""
    yield "In inches, corrections applied without steps:\n\n"
    yield from head("compensation", *FIGURES)
    yield row(f"{UNCOMPENSATED}, every 0.025 inch", *inches(uncompensated(lathe, STUDY, 0)))
    yield row(f"{UNCOMPENSATED}, every 0.52 inch", *inches(lathe.tested(None, None, STUDY, 0)))
    yield thesis_row(UNCOMPENSATED)
    for name, predictor in (*real.items(), ("the true error", lathe.error)):
        yield row(name, *inches(lathe.tested(predictor, None, STUDY, 0)))
        if name in PUBLISHED:
            yield thesis_row(name)
    yield "\n"


def design_rows(lathe: Lathe, real: dict[str, Predictor]) -> list[tuple[str, ...]]:
    """Return the figures of each predictor through each design, below their headings."""
    jobs = [
        (name, design) for name in ("uni-directional", BI, NETWORK, f"two rounds: {NETWORK}") for design in Design
    ]
    found = side_by_side(lambda job: lathe.tested(real[job[0]], job[1], STUDY, 0), jobs)
    rows = [(name, design.title, *inches(figures)) for (name, design), figures in zip(jobs, found, strict=True)]
    return [("compensation", "inserted by", *FIGURES), *rows]


def design_table(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the maximum average error of each predictor by design."""
    yield "Maximum average error through each design of the corrector ([all figures](predictors-designs.csv)):\n\n"
    yield from head("compensation", *(design.title for design in Design))
    for name in dict.fromkeys(name for name, *_ in rows[1:]):
        yield row(name, *(average for other, _, average, *_ in rows[1:] if other == name))
    yield "\n"


def stack_rows(stacks: Sequence[Stack]) -> list[tuple[str, ...]]:
    """Return stacks below their headings: roots in µm, and how well squares add up."""
    found = [("predictor", "inserted", *CAUSES, "sum", "whole", "sum off", "by chance", "taken out last")]
    for stack in stacks:
        roots = [_root_cell(stack.alone[cause]) for cause in CAUSES]
        whole = (f"{root(stack.sum):.2f}", f"{root(stack.whole):.2f}", f"{stack.disagreement:+.1%}")
        chance = (f"±{stack.by_chance:.1%}", f"{stack.disagreement_last:.1%}")
        found.append((stack.recipe, title_of(stack.design), *roots, *whole, *chance))
    return found


def stack_table(rows: Sequence[Sequence[str]], note: str) -> Iterator[str]:
    """Yield the rows without steps and with the largest one."""
    yield f"{note}\n\n"
    yield from head(*rows[0])
    yield from (row(*cells) for cells in rows[1:] if cells[1] in SHOWN)
    yield "\n"


def write_rows(path: Path, rows: Sequence[Sequence[str]]) -> None:
    """Write all rows of a table as CSV."""
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def _root_cell(square: float) -> str:
    return f"{root(square):.2f}" if abs(square) >= 0.005**2 else "0"


def white_table(lathe: Lathe, bi: Recipe) -> Iterator[str]:
    """Yield which standard deviation each published figure asks for, if readings are independent of each other."""

    def once(job: tuple[int, int]) -> tuple[float, ...]:
        repeats, seed = Repeatability(white_um=float(job[0])), 100 + job[1]
        table = bi.fit(lathe.calibration(repeats, seed, rounds=1))
        return *three(uncompensated(lathe, repeats, seed)), *three(lathe.tested(table, None, repeats, seed))

    jobs = [(white, draw) for white in WHITE_UM for draw in range(WHITE_DRAWS)]
    found = np.array(side_by_side(once, jobs)).reshape(len(WHITE_UM), WHITE_DRAWS, 6).mean(axis=1)
    found = np.maximum.accumulate(found, axis=0)
    yield "Standard deviation that each published figure asks for, in µm, if readings were independent:\n\n"
    yield from head("compensation", *FIGURES[:3])
    for name, first in ((UNCOMPENSATED, 0), (BI, 3)):
        wanted = PUBLISHED[name][:3]
        cells = [float(np.interp(w, found[:, first + k], WHITE_UM)) for k, w in enumerate(wanted)]
        most = max(WHITE_UM)
        yield row(name, *(f"over {most}" if cell >= most else f"{cell:.1f}" for cell in cells))
    yield "\n"


def model_table(lathe: Lathe, every: dict[str, Recipe], draws: int) -> Iterator[str]:
    """Yield the figures of many draws for each model of repeatability, beside the published ones."""
    yield f"Mean and standard deviation of {draws} calibrations and tests, in inches:\n\n"
    yield from head(
        "repeatability of a reading", "compensation", *FIGURES[:3], "thesis off by, in standard deviations"
    )
    for model, repeats in MODELS.items():

        def once(job: tuple[str, int], repeats: Repeatability = repeats) -> tuple[float, ...]:
            name, seed = job
            if name == UNCOMPENSATED:
                return three(uncompensated(lathe, repeats, seed))
            belief = every[name].fit(lathe.calibration(repeats, seed, rounds=1))
            return three(lathe.tested(belief, None, repeats, seed))

        jobs = [(name, draw) for name in PUBLISHED for draw in range(draws)]
        found = np.array(side_by_side(once, jobs)).reshape(len(PUBLISHED), draws, 3)
        for name, drawn in zip(PUBLISHED, found, strict=True):
            mean, spread = drawn.mean(axis=0), drawn.std(axis=0, ddof=1)
            off = (np.array(PUBLISHED[name][:3]) - mean) / spread
            figures = [f"{m:.6f} ± {s:.6f}" for m, s in zip(mean, spread, strict=True)]
            yield row(model, name, *figures, ", ".join(f"{z:+.1f}" for z in off))
    yield "\n"


def tables(draws: int) -> tuple[str, list[Stack], dict[str, list[tuple[str, ...]]]]:
    """Return the tables of the page, the stacks of the study's repeatability, and whole tables by name."""
    lathe = Lathe()
    every = recipes(lathe)
    measured, asked = Contributions(lathe, STUDY), Contributions(lathe, ASKED, designs=(None, Design.ORIGINAL))
    splits = dict(zip(every, side_by_side(measured.split, every.values()), strict=True))
    real = {name: split.real for name, split in splits.items()}
    stacks = [stack for name in STACKED for stack in measured.stacks(every[name], splits[name])]
    few = (BI, NETWORK)
    others = [stack for name in few for stack in asked.stacks(every[name], asked.split(every[name]))]
    whole = {"designs": design_rows(lathe, real), "stack": stack_rows(stacks)}
    text = [
        *thesis_table(lathe, real),
        *design_table(whole["designs"]),
        *stack_table(whole["stack"], NOTE),
        *stack_table(stack_rows(others), "The same with 3 µm and a drift of 8 µm/√h:"),
        *white_table(lathe, every[BI]),
        *model_table(lathe, every, draws),
    ]
    return "".join(text), stacks, whole


def main() -> int:
    """Print the tables, or put them into a page; draw the stack."""
    parser = argparse.ArgumentParser(description="Make Table 5-1 again, and the stack of what is left.")
    parser.add_argument("--draws", type=int, default=DRAWS, help="calibrations and tests of each repeatability")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        help="page in which the tables stand between two comments; whole tables go beside it as CSV",
    )
    parser.add_argument("--figure", type=Path, help="PNG of the stack")
    given = parser.parse_args()
    if given.draws < 2:
        parser.error(f"argument --draws: {given.draws} have no standard deviation; 2 or more")

    def made() -> str:
        text, stacks, whole = tables(given.draws)
        if given.output is not None:
            for name, rows in whole.items():
                write_rows(given.output.with_name(f"{given.output.stem}-{name}.csv"), rows)
        if given.figure is not None:
            given.figure.write_bytes(stack_figure(stacks, DRAWN))
        return text

    with threadpool_limits(1):
        print_or_write(parser, given.output, "table_5_1", made)
    return 0


if __name__ == "__main__":
    sys.exit(main())
