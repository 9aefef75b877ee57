"""The lathe's calibration as a measurement to be diagnosed, and one scan of the whole library done in three ways."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.load import load_dataset
from rtec.effects import Effect, Floats, Shape
from rtec.inference.colour import Colour
from rtec.inference.probes import Probe
from rtec.inference.proposals import beside, falls, falls_of_scan
from rtec.inference.space import Choice, Space
from rtec.metrology import Column, Measurement
from rtec.predictors import LatheNetwork
from rtec.units import MM_PER_INCH

TARGETS = 1561
AGREE = 1e-5
"""Of the largest fall, by which the three ways may differ: the scan is made in single precision."""
WHITE = Colour()


def lathe_calibration(runs: int, noise_um: float, seed: int = 0) -> Measurement:
    """Return the thesis's calibration: 1561 targets every 0.025 inch, both ways, from the printed network.

    Parameters
    ----------
    runs
        Each of 3122 readings; four are the thesis's 12 488.
    noise_um
        Standard deviation of white noise.
    seed
        Of the noise.
    """
    way = (1.0 + 0.025 * np.arange(TARGETS)) * MM_PER_INCH
    target = np.tile(np.concatenate([way, way[::-1]]), runs)
    direction = np.tile(np.repeat([1.0, -1.0], TARGETS), runs)
    error: Floats = LatheNetwork().error_mm(target, direction.astype(np.int64))
    error = error + noise_um * 1e-3 * np.random.default_rng(seed).normal(size=target.size)
    columns = [
        Column("run", "", np.repeat(np.arange(1.0, runs + 1.0), 2 * TARGETS)),
        Column("direction", "", direction),
        Column("target", "mm", target),
        Column("deviation", "mm", error),
    ]
    by_quantity = {column.quantity: column for column in columns}
    return Measurement(source="lathe", facts={"screw_pitch": "0.25 inch"}, columns=by_quantity, unknown={})


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """Processor time of a scan, and the fall of the residual sum of squares by each effect's best shape."""

    seconds: float
    candidates: int
    falls: Floats


def scan_job(runs: int = 4) -> tuple[Dataset, list[Choice]]:
    """Return a calibration and the model beside which the library is scanned: a constant and backlash."""
    dataset = load_dataset(lathe_calibration(runs, 1.0))
    effect = next(effect for effect in Space(dataset).library if effect.name == "backlash")
    return dataset, [(effect, effect.shapes(dataset.conditions)[0])]


def by_scan(dataset: Dataset, model: list[Choice]) -> Scan:
    """Scan as the diagnosis does: the model's columns are taken out once, and nothing is refitted."""
    begun = time.process_time()
    space = Space(dataset)
    back = beside(space, model, WHITE)
    found, count = [], 0
    for effect, shapes in _grid(space, model):
        if effect.is_map:  # its shapes have different numbers of amplitudes
            each = [float(falls(space.white(space.part_of((effect, s)), WHITE)[None], back)[0]) for s in shapes]
        else:
            scans = space.scan(effect, shapes, WHITE)
            each = np.concatenate([falls_of_scan(space, scan, back, WHITE) for scan in scans]).tolist()
        found.append(max(each))
        count += len(shapes)
    return Scan(seconds=time.process_time() - begun, candidates=count, falls=np.array(found))


def by_lstsq(dataset: Dataset, model: list[Choice]) -> Scan:
    """Fit model and candidate together by ``numpy.linalg.lstsq``, each candidate anew."""
    table = _model_columns(dataset, model)
    before = _left(table, dataset.observed)
    begun, falls, count = time.process_time(), [], 0
    for effect, shapes in _grid(Space(dataset), model):
        best = 0.0
        for shape in shapes:
            best = max(best, before - _left(np.hstack([table, dataset.columns(effect, shape)]), dataset.observed))
            count += 1
        falls.append(best)
    return Scan(seconds=time.process_time() - begun, candidates=count, falls=np.array(falls))


def by_lmfit(dataset: Dataset, model: list[Choice]) -> Scan:
    """Refit model and candidate together by lmfit's Levenberg-Marquardt, given the analytic Jacobian."""
    import lmfit

    table = _model_columns(dataset, model)
    before = _left(table, dataset.observed)
    begun, falls, count = time.process_time(), [], 0
    for effect, shapes in _grid(Space(dataset), model):
        best = 0.0
        for shape in shapes:
            columns = np.hstack([table, dataset.columns(effect, shape)])
            jacobian = -columns.T
            start = lmfit.Parameters()
            for number in range(columns.shape[1]):
                start.add(f"amplitude_{number}", value=0.0)

            def residual(now: lmfit.Parameters, columns: Floats = columns) -> Floats:
                left: Floats = dataset.observed - columns @ np.array([p.value for p in now.values()])
                return left

            def slope(now: lmfit.Parameters, jacobian: Floats = jacobian) -> Floats:
                return jacobian

            fitted = lmfit.minimize(residual, start, method="leastsq", Dfun=slope, col_deriv=True)
            best = max(best, before - float(fitted.chisqr))
            count += 1
        falls.append(best)
    return Scan(seconds=time.process_time() - begun, candidates=count, falls=np.array(falls))


def agree(first: Scan, second: Scan) -> bool:
    """Return whether two scans found the same falls."""
    return bool(np.abs(first.falls - second.falls).max() <= AGREE * first.falls.max())


def _grid(space: Space, model: list[Choice]) -> Iterator[tuple[Effect, Sequence[Shape]]]:
    """Yield each effect of the library that is not in the model with the shapes that are tried."""
    held = {effect.name for effect, _ in model}
    for effect in space.library:
        if effect.name not in held and not isinstance(effect, Probe):
            yield effect, space.shapes(effect)[0]


def _model_columns(dataset: Dataset, model: list[Choice]) -> Floats:
    table: Floats = np.hstack(
        [np.ones((dataset.rows, 1)), *(dataset.columns(effect, shape) for effect, shape in model)]
    )
    return table


def _left(table: Floats, observed: Floats) -> float:
    left = observed - table @ np.linalg.lstsq(table, observed, rcond=None)[0]
    return float(left @ left)
