"""Figures of docs/warm-machine.md on predictors: ``python -m tools.warm_table [table] [coverage]``.

Table 1 of Yao et al. again on simulated machines, on the rows that were fitted and on another duty cycle; and how
often the 90 % intervals of the chosen row hold on another duty cycle of 20 machines. About ten minutes.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from rtec.dataset.warm_blocks import Blocks
from rtec.dataset.warm_log import WarmLog, warm_log
from rtec.heat import Duty, warm_machine
from rtec.heat.duty import Piece
from rtec.training.compare_warm import compare_warm
from rtec.training.warm_intervals import COVERED
from rtec.training.warm_methods import WarmMethod, warm_methods
from rtec.training.warm_parts import parts_of
from rtec.training.warm_task import WarmTask

NEAR_ZERO_UM = 1.0
"""Rows with a smaller displacement have no percentage: they are left out of the MAPE, and counted."""
NOISE_UM = 0.3
MACHINES = 20
TABLE_MACHINES = 5
RANDOM_PARTS = 10
PAPER_H, PAPER_RPM = 2.5, 4000.0
RADIAL, AXIAL = "y1", "z"
IN_TABLE = (
    "mean", "least squares", "first-order lags", "LS-SVM", "fuzzy network product", "fuzzy network minimum",
    "Bayesian network", "Bayesian network mode", "Bayesian network with LS-SVM",
)  # fmt: skip
QUICK = ("mean", "least squares", "ridge", "first-order lags", "LS-SVM", "fuzzy network minimum", "Bayesian network")


say = sys.stdout.write


def mape(measured: np.ndarray, said: np.ndarray) -> tuple[float, int]:
    """Return equation 13 in percent, and how many rows were too near zero for it."""
    counts = np.abs(measured) >= NEAR_ZERO_UM
    return 100.0 * float(np.mean(np.abs((measured - said)[counts] / measured[counts]))), int((~counts).sum())


def without_cutting(duty: Duty) -> Duty:
    """Return a duty whose feed and force are zero: neither is an input of a model."""
    return Duty(tuple(replace(piece, feed_mm_s=0.0, force_n=0.0) for piece in duty.pieces))


def logs(seed: int, train: Duty, judge: Duty, folder: Path, observe: str | None = None) -> tuple[WarmLog, WarmLog]:
    """Return what was measured on a machine over two duty cycles, a row a minute."""
    machine, files = warm_machine(seed), []
    for place, duty in enumerate((train, judge)):
        files.append(folder / f"{seed}_{place}.csv")
        machine.run(duty, seed=seed).write_csv(files[-1], noise_um=NOISE_UM, seed=10 * seed + place)
    log = warm_log(files[0], observe=observe, fewest_blocks=2)
    return log, warm_log(files[1], like=log)


def table_1(seed: int, channel: str, folder: Path) -> Iterator[tuple[str, list[float]]]:
    """Yield each method with MAPE, rows near zero, RMS and time; then MAPE, rows near zero and RMS elsewhere."""
    running = Duty((Piece(duration_s=3600.0 * PAPER_H, spindle_rpm=PAPER_RPM),))
    log, other = logs(seed, running, without_cutting(Duty.shop(seed)), folder, channel)
    parts_of_rows = np.random.default_rng(seed).permutation(log.rows) % RANDOM_PARTS  # as papers choose settings
    random_rows = Blocks(of_row=parts_of_rows, names=("",) * RANDOM_PARTS, by="random rows")
    log = replace(log, others={}, blocks=random_rows)
    parts = parts_of(log, other)
    task = WarmTask(parts=parts)
    for method in (one for one in warm_methods() if one.name in IN_TABLE):
        begun = time.process_time()
        fit = method.fit(task).channels[channel]
        took = time.process_time() - begun
        figures: list[float] = []
        for measured, columns in (
            (parts.outputs[channel], parts.columns(fit.features)),
            (parts.judged[channel], parts.judging_columns(fit.features)),
        ):
            said = fit.regressor.predict(columns)[0]
            answered = np.isfinite(said)
            error = (measured - said)[answered]
            figures += [*mape(measured[answered], said[answered]), float(np.sqrt(np.mean(error**2)))]
        yield method.name, [*figures[:3], took, *figures[3:]]


def print_table_1(folder: Path) -> None:
    """Print medians over machines, a line for each method."""
    for name, channel in (("axial", AXIAL), ("radial", RADIAL)):
        found: dict[str, list[list[float]]] = {}
        for seed in range(1, TABLE_MACHINES + 1):
            for method, figures in table_1(seed, channel, folder):
                found.setdefault(method, []).append(figures)
        middle = {method: np.median(figures, axis=0) for method, figures in found.items()}
        say(f"\n{name}, {TABLE_MACHINES} machines, medians: fitted rows | another duty cycle\n")
        say("| method | MAPE % | near 0 | RMS um | time / LS-SVM | MAPE % | near 0 | RMS um |\n")
        for method, one in middle.items():
            fitted = f"{one[0]:.2f} | {one[1]:.0f} | {one[2]:.2f} | {one[3] / middle['LS-SVM'][3]:.3g}"
            say(f"| {method} | {fitted} | {one[4]:.1f} | {one[5]:.0f} | {one[6]:.2f} |\n")


def methods() -> tuple[WarmMethod, ...]:
    """Return the methods that take seconds only."""
    return tuple(one for one in warm_methods() if one.name in QUICK)


def print_coverage(folder: Path) -> None:
    """Print how often intervals hold on another duty cycle, and what the chosen row leaves."""
    duties = {
        "steps of four speeds": Duty.steps((1500.0, 3000.0, 4500.0, 6000.0)),
        "a shift": without_cutting(Duty.shop(99, hours=16.0)),
    }
    for words, train in duties.items():
        held, left, chosen = [], [], []
        for seed in range(1, MACHINES + 1):
            log, other = logs(seed, train, without_cutting(Duty.shop(seed)), folder)
            result = compare_warm(log, other, methods=methods(), budget_s=None)
            row = result.named(result.chosen)
            assert row is not None and row.coverage is not None and row.rms_heldout_um is not None
            held.append(row.coverage)
            left.append(row.rms_heldout_um)
            chosen.append(row.name)
        names = ", ".join(f"{name} {chosen.count(name)}" for name in dict.fromkeys(chosen))
        hold = (
            f"{100.0 * COVERED:.0f} % intervals hold {100.0 * np.mean(held):.1f} %, lowest {100.0 * min(held):.0f} %"
        )
        say(f"\ntrained on {words}, judged on another shift, {MACHINES} machines: {hold};")
        say(f" median RMS {np.median(left):.2f} um; chosen: {names}\n")


if __name__ == "__main__":
    asked = sys.argv[1:] or ["table", "coverage"]
    with tempfile.TemporaryDirectory() as temporary:
        if "table" in asked:
            print_table_1(Path(temporary))
        if "coverage" in asked:
            print_coverage(Path(temporary))
