"""Bayesian networks of warm machines beside other methods, on a duty that none of them was fitted to.

Each method sees a machine at four speeds with rests (4 h each), chooses its settings by leaving out blocks, and
predicts a shift of a workshop. With a log, its last block is predicted from those before.

Example::

    python -m tools.warm_bayes
    python -m tools.warm_bayes spindle.csv
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rtec.heat import Duty, WarmRun, warm_machine
from rtec.predictors.fitting.warm.bayes import fit_bayes
from rtec.predictors.fitting.warm.bayes_lssvm import fit_bayes_ls_svm
from rtec.predictors.fitting.warm.linear import fit_ridge
from rtec.predictors.fitting.warm.lssvm import fit_ls_svm
from rtec.predictors.fitting.warm.rows import rms, thin_by_blocks
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature, columns_of
from rtec.predictors.warm.regressor import RegressorFit

Floats = npt.NDArray[np.float64]
MACHINES = (1, 2, 3)
CHANNELS = ("x1", "y1", "z")
LAGS_S = (1000.0, 10_000.0)
MOST_ROWS = 600
Case = tuple[str, Floats, Floats, npt.NDArray[np.int64], Floats, Floats, tuple[Feature, ...]]


def features_of(names: list[str]) -> tuple[Feature, ...]:
    """Return the sensors as they are and behind by two lags, the speed and its heat behind by both."""
    behind = [Feature(of=name, lag_s=lag_s, heat=name == SPINDLE_SPEED) for name in names for lag_s in LAGS_S]
    return (*(Feature(of=name) for name in names), *behind)


def simulated() -> Iterator[Case]:
    """Yield columns and displacements of training and test, for each machine and channel."""
    for seed in MACHINES:
        machine = warm_machine(seed=seed)
        steps = Duty.steps((1250.0, 2500.0, 3750.0, 5000.0), running_h=4.0, resting_h=4.0)
        runs = [machine.run(duty, seed=1) for duty in (steps, Duty.shop(seed=3, hours=8.0))]
        inputs = [inputs_of(run) for run in runs]
        features = features_of(list(inputs[0]))
        known, asked = (columns_of(features, run.time_s[::60], one) for run, one in zip(runs, inputs, strict=True))
        block = blocks_of(inputs[0][SPINDLE_SPEED])
        for name in CHANNELS:
            trained, judged = (run.displacement_um[name][::60] for run in runs)
            noise = np.random.default_rng(seed).normal(0.0, 0.2, trained.size)
            yield f"machine {seed}, {name}", known, trained + noise, block, asked, judged, features


def inputs_of(run: WarmRun) -> dict[str, Floats]:
    """Return what a log of one row a minute holds."""
    heats = {f"temperature_{name}": values[::60] for name, values in run.thermometers.items()}
    return {**heats, SPINDLE_SPEED: run.spindle_rpm[::60]}


def blocks_of(speed: Floats) -> npt.NDArray[np.int64]:
    """Return the block of each row: a change of speed starts one."""
    return np.cumsum(np.diff(speed, prepend=speed[0]) != 0.0)


def measured(file: Path) -> Iterator[Case]:
    """Yield the same from a log with ``time_s``, ``spindle_rpm``, ``temperature_NAME_c`` and ``NAME_um``."""
    names = file.read_text(encoding="utf-8").splitlines()[0].split(",")
    table = dict(zip(names, np.loadtxt(file, delimiter=",", skiprows=1).T, strict=True))
    heats = {name.removesuffix("_c"): values for name, values in table.items() if name.startswith("temperature_")}
    inputs = {**heats, SPINDLE_SPEED: table["spindle_rpm"]}
    features, block = features_of(list(inputs)), blocks_of(table["spindle_rpm"])
    columns, last = columns_of(features, table["time_s"], inputs), block == block.max()
    for name in (name for name in names if name.endswith("_um")):
        values = table[name]
        yield name, columns[~last], values[~last], block[~last], columns[last], values[last], features


def main() -> int:
    """Print a row for each displacement."""
    parser = argparse.ArgumentParser(description="Bayesian networks of warm machines beside other methods.")
    parser.add_argument("log", nargs="?", type=Path, help="a log of a spindle, instead of simulated machines")
    given = parser.parse_args()
    squares: dict[str, list[float]] = {}
    for name, known, output, block, asked, judged, features in measured(given.log) if given.log else simulated():
        found = errors(known, output, block, asked, judged, features)
        for method, error in found.items():
            squares.setdefault(method, []).append(error**2)
        sys.stdout.write(f"{name}: {', '.join(f'{method} {error:.2f}' for method, error in found.items())} um\n")
    total = {method: float(np.sqrt(np.mean(values))) for method, values in squares.items()}
    sys.stdout.write(f"RMS: {', '.join(f'{method} {error:.2f}' for method, error in total.items())} um\n")
    return 0


def errors(
    known: Floats,
    output: Floats,
    block: npt.NDArray[np.int64],
    asked: Floats,
    judged: Floats,
    features: tuple[Feature, ...],
) -> dict[str, float]:
    """Return the root mean square error of each method on what it was not fitted to."""
    kept = thin_by_blocks(block, most_rows=MOST_ROWS)
    few = known[kept], output[kept], block[kept]
    bells = fit_ls_svm(*few)
    fits: dict[str, Callable[[], RegressorFit]] = {
        "ridge": lambda: fit_ridge(known, output, block),
        "LS-SVM": lambda: bells,
        "Bayesian network": lambda: fit_bayes(known, output, block, features=features),
        "both": lambda: fit_bayes_ls_svm(*few, features=features, alone=bells),
    }
    found = {"mean": rms(judged - output.mean())}
    return found | {name: rms(fit().regressor.predict(asked)[0] - judged) for name, fit in fits.items()}


if __name__ == "__main__":
    sys.exit(main())
