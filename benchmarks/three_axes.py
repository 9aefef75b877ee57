"""Three axes measured on a grid, each corrected by where the others stand, and measured again at other places.

Example::

    python benchmarks/three_axes.py
    python benchmarks/three_axes.py -o docs/predictors.md --figure docs/predictors-axes.png
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
from figure_three_axes import axes_figure
from grid_run import GridReadings, measure_grid
from into_page import print_or_write
from volume import drawn_volume, there_and_back

from rtec.axis.encoder import Encoder
from rtec.dataset.load import load_dataset
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine.station_settings import StationSettings
from rtec.metrology.measurement_file import write_measurement
from rtec.predictors import Predictor
from rtec.report.figures_style import write_figure
from rtec.training import all_methods, compare_predictors

SEED, REPEATABILITY_MM, BUDGET_S = 3, 0.0005, 6.0
AXES = (1, 2, 3)
NAMES = ("table bi-directional linear", "squareness", "straightness", "angles", "network 40 lm")


def stations() -> list[StationSettings]:
    """Return three axes with scales of 0.5 µm and boxes of Design C, whose step is 1 µm."""
    box = InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST), real_edges=RealEdges.HOLD)
    return [StationSettings(axis=axis, injector=box, encoder=Encoder(count_mm=0.0005)) for axis in AXES]


def measured(grids_mm: list[npt.NDArray[np.float64]], seed: int, by: list[Predictor] | None = None) -> GridReadings:
    """Return what a tracker sees of the drawn machine on a grid."""
    places = there_and_back(*(grid.tolist() for grid in grids_mm))
    machine = drawn_volume(SEED)
    found = measure_grid(stations(), machine, places, predictor=by, repeatability_mm=REPEATABILITY_MM, seed=seed)
    if found.held or any(axis.off_counts for axis in found.outcomes):
        raise SystemExit("the machine was held, or a count is not accounted for")
    return found


def fitted(calibration: GridReadings, check: GridReadings) -> dict[str, list[Predictor]]:
    """Return the predictors of all axes by their names: fitted to the calibration, as rtec train fits them."""
    found: dict[str, list[Predictor]] = {name: [] for name in NAMES}
    methods = [method for method in all_methods(several_axes=True) if method.name in NAMES]
    with tempfile.TemporaryDirectory() as folder:
        for axis in AXES:
            files = [Path(folder) / name for name in ("grid.csv", "check.csv")]
            for file, readings in zip(files, (calibration, check), strict=True):
                write_measurement(file, readings.of_axis(axis))
            data, judge = (load_dataset(file) for file in files)
            result = compare_predictors(data, judge, methods=methods, budget_s=BUDGET_S)
            for name in NAMES:
                row = result.named(name)
                if row is None or row.predictor is None:
                    raise SystemExit(f"{name}: no predictor")
                found[name].append(row.predictor)
    return found


def left_um() -> dict[str, npt.NDArray[np.float64]]:
    """Return what each correction leaves at the places of the test, in µm, a column for each axis."""
    calibration = measured([np.linspace(-10.0, 310.0, 9)] * 3, 1)
    rng = np.random.default_rng(5)
    check = measured([np.sort(rng.uniform(0.0, 300.0, 5)) for _ in AXES], 2)
    test = [np.array([15.0, 80.0, 150.0, 222.0, 290.0])] * 3
    predictors: dict[str, list[Predictor] | None] = {"uncorrected": None, **fitted(calibration, check)}
    return {name: 1e3 * measured(test, 4, by).deviation_mm for name, by in predictors.items()}


def table(left: dict[str, npt.NDArray[np.float64]]) -> Iterator[str]:
    """Yield the lines of the table."""
    yield "| corrected by | axis 1 | axis 2 | axis 3 | largest |\n|---|---|---|---|---|\n"
    for name, deviation in left.items():
        rms, largest = np.sqrt(np.mean(deviation**2, axis=0)), np.abs(deviation).max()
        yield f"| {name} | " + " | ".join(f"{value:.2f}" for value in (*rms, largest)) + " |\n"
    yield "\n"


def main() -> int:
    """Print the table, or put it into a page."""
    parser = argparse.ArgumentParser(description="Correct three axes by where the others stand.")
    parser.add_argument("-o", "--output", type=Path, help="page in which the table stands between two comments")
    parser.add_argument("--figure", type=Path, help="PNG of the table")
    given = parser.parse_args()

    def made() -> str:
        left = left_um()
        if given.figure is not None:
            write_figure(lambda: axes_figure(left), given.figure)
        return "".join(table(left))

    print_or_write(parser, given.output, "three_axes", made)
    return 0


if __name__ == "__main__":
    sys.exit(main())
