"""The lathe's calibration as a measurement to be diagnosed, and one scan of the whole library done in three ways."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.load import load_dataset
from rtec.effects import Effect, Floats, Shape
from rtec.inference.noise import Noise
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Choice, Workspace, is_map
from rtec.metrology import Column, Measurement
from rtec.predictors import LatheNetwork
from rtec.units import MM_PER_INCH

TARGETS = 1561
AGREE = 1e-6
"""Of the largest fall, by which the three ways may differ."""


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


def scan_job(runs: int = 4) -> tuple[Dataset, Noise, list[Choice]]:
    """Return a calibration, its noise, and the model beside which the library is scanned: a constant and backlash."""
    dataset = load_dataset(lathe_calibration(runs, 1.0))
    noise = Noise(sigma=1e-3, correlation=Correlation(), freedom=1e4, from_repeats=True)
    effect = next(effect for effect in Workspace(dataset, noise).library if effect.name == "backlash")
    return dataset, noise, [(effect, effect.shapes(dataset.conditions)[0])]


def by_score(dataset: Dataset, noise: Noise, model: list[Choice]) -> Scan:
    """Scan as the diagnosis does: the model's columns are taken out once, and nothing is refitted."""
    begun = time.process_time()
    workspace = Workspace(dataset, noise)
    back = workspace.background(model)
    falls, count = [], 0
    for effect, shapes in _grid(workspace, model):
        if is_map(effect):  # its best shape weighs the fall against the nodes; the largest fall is what is compared
            falls.append(max(workspace.judge(effect, shape, back).gain for shape in shapes))
        else:
            best = workspace.best_of_scan(effect, back)
            falls.append(0.0 if best is None else best.gain)
        count += len(shapes)
    return Scan(seconds=time.process_time() - begun, candidates=count, falls=np.array(falls))


def by_lstsq(dataset: Dataset, noise: Noise, model: list[Choice]) -> Scan:
    """Fit model and candidate together by ``numpy.linalg.lstsq``, each candidate anew."""
    workspace = Workspace(dataset, noise)
    table = _model_columns(dataset, model)
    before = _left(table, dataset.observed)
    begun, falls, count = time.process_time(), [], 0
    for effect, shapes in _grid(workspace, model):
        best = 0.0
        for shape in shapes:
            best = max(best, before - _left(np.hstack([table, dataset.columns(effect, shape)]), dataset.observed))
            count += 1
        falls.append(best)
    return Scan(seconds=time.process_time() - begun, candidates=count, falls=np.array(falls))


def by_lmfit(dataset: Dataset, noise: Noise, model: list[Choice]) -> Scan:
    """Refit model and candidate together by lmfit's Levenberg-Marquardt, given the analytic Jacobian."""
    import lmfit

    workspace = Workspace(dataset, noise)
    table = _model_columns(dataset, model)
    before = _left(table, dataset.observed)
    begun, falls, count = time.process_time(), [], 0
    for effect, shapes in _grid(workspace, model):
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


def _grid(workspace: Workspace, model: list[Choice]) -> Iterator[tuple[Effect, Sequence[Shape]]]:
    """Yield each effect that is not in the model with the shapes that are tried."""
    held = {effect.name for effect, _ in model}
    for effect in workspace.library:
        if effect.name in held or effect.name == "offset":  # the constant is in the model
            continue
        yield effect, workspace.maps(effect) if is_map(effect) else effect.shapes(workspace.conditions)


def _model_columns(dataset: Dataset, model: list[Choice]) -> Floats:
    table: Floats = np.hstack(
        [np.ones((dataset.rows, 1)), *(dataset.columns(effect, shape) for effect, shape in model)]
    )
    return table


def _left(table: Floats, observed: Floats) -> float:
    left = observed - table @ np.linalg.lstsq(table, observed, rcond=None)[0]
    return float(left @ left)
