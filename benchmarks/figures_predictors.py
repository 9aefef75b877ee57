"""What the predictors cost at work, and the command that fits them."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from children import ChildFailedError, measure, rtec
from diagnosis_job import lathe_calibration
from figures import Bar, Figure, Setting, Spread, on_cores
from figures_machine import lathe
from open_path_job import WrongResultError

from rtec.dataset.load import load_dataset
from rtec.injector import Design
from rtec.machine import MeasuringRun, measuring_run, run_machine
from rtec.predictors import Predictor
from rtec.predictors.curve import Cautious
from rtec.study import Study, builtin_study
from rtec.training import all_methods, compare_predictors

THIS = "python benchmarks/measure.py --only"
TABLE, CAUTIOUS = "table bi-directional linear", "network 30 + 8 lm"
_BUDGET_S = 6.0


def predictors(setting: Setting) -> Iterator[Figure]:
    """Measure the calibration in closed loop with each kind of predictor at work in the PC."""
    study = builtin_study()
    plan = study.plan if setting.quick else replace(study.plan, increment_mm=0.635, runs=4)
    task = measuring_run(plan, study.limits)
    kinds = _fitted()
    for predictor in kinds.values():
        _calibration_s(study, task, predictor)
    seconds: dict[str, list[float]] = {name: [] for name in kinds}
    for _ in range(setting.of(9, 5)):
        for name, predictor in kinds.items():
            seconds[name].append(_calibration_s(study, task, predictor))
    spreads = {name: Spread(tuple(each)) for name, each in seconds.items()}
    table = spreads.pop(TABLE)
    for name, spread in spreads.items():
        yield Figure(
            what=f"With {name}",
            measured=f"{spread.text(_s)}, {table.text(_s)}: {spread.best / table.best:.2f} x",
            value=spread.best / table.best,
            bar=Bar(value=1.5, unit="x the table", at_most=True),
            command=f"{THIS} predictors",
        )


def _s(seconds: float) -> str:
    return f"{seconds:.3g} s"


def _fitted() -> dict[str, Predictor]:
    """Return a predictor of each kind, fitted to the lathe's calibration, and one that is believed with caution."""
    methods = [method for method in all_methods() if method.name.endswith(("linear", "cubic", "effects", " lm"))]
    found = compare_predictors(load_dataset(lathe_calibration(4, 1.0)), budget_s=_BUDGET_S, methods=methods)
    kinds: dict[str, Predictor] = {}
    for row in found.rows:
        if row.predictor is None or row.interval_mm is None:
            raise WrongResultError(f"{row.name}: {row.reason}")
        kinds[row.name] = row.predictor
        if row.name == CAUTIOUS:
            kinds[f"{row.name}, cautious"] = Cautious(predictor=row.predictor, unsure_mm=row.interval_mm)
    return kinds


def _calibration_s(study: Study, task: MeasuringRun, predictor: Predictor) -> float:
    """Return the processor time of the programme, every reading taken and every count accounted for."""
    machine = replace(lathe(Design.B, study), model=predictor)
    begun = time.process_time()
    result = run_machine(machine, task)
    seconds = time.process_time() - begun
    if not result.audit or result.deviation_mm.size != task.target_mm.size or result.pending_steps:
        raise WrongResultError(f"calibration: audit {result.audit}, {result.pending_steps} steps pending")
    return seconds


def train_command(setting: Setting) -> Iterator[Figure]:
    """Measure ``rtec train`` on the calibration of ``rtec run``, as a user types it, on two cores."""
    with tempfile.TemporaryDirectory() as name, on_cores({setting.core, setting.second_core}):
        folder = Path(name)
        measure([rtec(), "run", "-o", "lathe"], folder)
        calibration, others = (f"lathe/readings/{file}.csv" for file in ("calibration", "uncompensated"))
        for words in ([calibration], [calibration, "--heldout", others]):
            child = measure([rtec(), "train", *words, "--json"], folder)
            command = " ".join(["rtec", "train", *words])
            rows = {row["name"]: row for row in json.loads(child.out)["rows"]}
            empty = [f"{row['name']}: {row['reason']}" for row in rows.values() if row["rms_heldout_um"] is None]
            if empty or set(rows) != {method.name for method in all_methods()}:
                raise ChildFailedError(f"{command}: rows {', '.join(rows)}; without a figure: {empty}")
            judged = "at other targets" if len(words) > 1 else "of the places held out"
            yield Figure(
                what=f"All {len(rows)} rows, judged by readings {judged}",
                measured=f"{child.wall_s:.1f} s",
                value=child.wall_s,
                bar=Bar(value=120.0, unit="s", at_most=True),
                command=command,
            )
            best = min((row for row in rows.values() if row["name"] != "none"), key=lambda row: row["rms_heldout_um"])
            physical = rows["effects"]["rms_heldout_um"]
            yield Figure(
                what=f"The best row of them, {best['name']}, beside the physical model",
                measured=f"{best['rms_heldout_um']:.3g} µm, {physical:.3g} µm",
                value=best["rms_heldout_um"] / physical,
                bar=Bar(value=1.1, unit="x its root mean square", at_most=True),
                command=command,
            )
