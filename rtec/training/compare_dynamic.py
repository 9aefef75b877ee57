"""Models of motion side by side: fitted to one part of a log, judged by free runs over another."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from rtec.dataset.dynamic_log import DEVIATION, DynamicLog
from rtec.errors import ArgumentError
from rtec.predictors.fitting.linear_models import free_run_errors, free_run_rms
from rtec.predictors.motion_file import FOLLOWING_ERROR
from rtec.predictors.sequences import DynamicModel, Sequences
from rtec.training.compare_predictors import COVERED
from rtec.training.dynamic_methods import DynamicFit, DynamicMethod, DynamicTask, dynamic_methods
from rtec.training.dynamic_results import DynamicComparison, DynamicKind, DynamicRow
from rtec.training.free_run import free_run_of

VALIDATION = 0.25
"""Share of the training part that chooses between models."""
_FEWEST = 80
"""Samples of a log that trains and judges."""
_NO_WORSE = 1.05
"""Times the lowest validation error: so much worse may be a model with fewer numbers, and be chosen."""
_BOUND = 10.0
"""Times the range of the output in training: a prediction farther out is not stable."""
_BEYOND = 0.02
"""Of the range of an input in training: so much farther out is outside of it."""
_FAR_WORSE = 3.0
"""Times the error of training from which something is wrong with the unseen part."""
_UNITS_OF_INPUTS = {"velocity": "speeds", "acceleration": "accelerations"}
Progress = Callable[[str, float], None]


def compare_dynamic(
    log: DynamicLog,
    heldout: DynamicLog | None = None,
    *,
    starts: int = 10,
    budget_s: float | None = 90.0,
    methods: Sequence[DynamicMethod] | None = None,
    seed: int = 0,
    progress: Progress = lambda what, share: None,
) -> DynamicComparison:
    """Fit every model of motion to a log, and judge all of them by free runs over samples that none has seen.

    Parameters
    ----------
    log
        Its first half trains; all of it where ``heldout`` judges.
    heldout
        Another log with the same inputs and output (`rtec.dataset.dynamic_log.log_like`).
    starts
        Trainings of each size of a network.
    budget_s
        Time that the networks share; None: each trains until its starts are through.
    methods
        Which; None: all.
    seed
        Draws the first weights of networks.
    progress
        Called with what is at work, with its error, and the share done.

    Returns
    -------
    DynamicComparison
        A row for each method. Ctrl-C ends the training; what was found so far is kept.

    Raises
    ------
    ArgumentError
        Fewer than 80 samples.

    Notes
    -----
    The row that is chosen is, of those whose error over the last quarter of the training part is at most 5 % above
    the lowest, the one with the fewest numbers. What is unseen has no say in it.
    """
    data = log.sequences
    if len(data) < _FEWEST:
        raise ArgumentError(log.measurement.source, f"{len(data)} samples", f"{_FEWEST} or more")
    end = len(data) if heldout is not None else len(data) // 2
    train = data.part(0, end)
    unseen = data.part(end, len(data)) if heldout is None else heldout.sequences
    split = round((1.0 - VALIDATION) * end)
    in_mm = 1e3 if data.unit == "um" else 1.0
    per_error = {FOLLOWING_ERROR: in_mm, DEVIATION: -in_mm}.get(log.observe)
    task = DynamicTask(
        train=train,
        fit=train.part(0, split),
        validate=train.part(split, end),
        output_per_error=per_error,
        starts=starts,
        seed=seed,
    )
    with threadpool_limits(1):  # of matrix products as small as these
        rows, interrupted = _rows(task, unseen, methods or dynamic_methods(), budget_s, progress)
    chosen = _chosen(rows)
    return DynamicComparison(
        log=log,
        samples={"train": split, "validation": end - split, "heldout": len(unseen)},
        heldout_by="the second half" if heldout is None else heldout.measurement.source,
        rows=tuple(rows),
        chosen=None if chosen is None else chosen.name,
        notes=(*_of_other_log(heldout, log), *_outside(train, unseen), *_far_worse(chosen)),
        interrupted=interrupted,
    )


def _rows(
    task: DynamicTask,
    unseen: Sequences,
    methods: Sequence[DynamicMethod],
    budget_s: float | None,
    progress: Progress,
) -> tuple[list[DynamicRow], bool]:
    """Return a row for each method, and whether Ctrl-C ended it."""
    rows: list[DynamicRow] = []
    interrupted = False
    networks = sum(method.is_network and method.why_not(task) is None for method in methods)
    spent_s, number = 0.0, 0
    for place, method in enumerate(methods):
        row = DynamicRow(name=method.name, kind=method.kind)
        if interrupted:
            rows.append(replace(row, reason="ended before its turn"))
            continue
        if (reason := method.why_not(task)) is not None:
            rows.append(replace(row, reason=reason))
            continue
        begun, until_s = time.perf_counter(), np.inf
        if method.is_network and budget_s is not None:
            until_s = begun + (budget_s - spent_s) / (networks - number)

        def tell(what: str, share: float = place / len(methods)) -> None:
            progress(what, share)

        tell(method.name)
        try:
            found = method.fit(replace(task, until_s=until_s, tell=tell))
            row = _judged(row, found, task, unseen, time.perf_counter() - begun)
            interrupted = found.interrupted
        except ArgumentError as error:
            row = replace(row, reason=str(error))
        except KeyboardInterrupt:
            row, interrupted = replace(row, reason="ended before it was fitted"), True
        rows.append(row)
        if method.is_network:
            spent_s, number = spent_s + time.perf_counter() - begun, number + 1
    return rows, interrupted


def _judged(row: DynamicRow, found: DynamicFit, task: DynamicTask, unseen: Sequences, train_s: float) -> DynamicRow:
    model = found.model
    row = replace(
        row, model=model, train_s=train_s, parameters=model.parameters, notes=found.notes, holds=found.holds
    )
    off = np.sort(np.abs(free_run_errors(found.judged, task.validate)))
    rank = int(np.ceil(COVERED * (off.size + 1)))  # split-conformal: the quantile with one for the sample to come
    interval = float(off[rank - 1]) if rank <= off.size else None
    run = free_run_of(model, unseen, interval)
    begun = time.perf_counter()
    rms_train = free_run_rms(model, task.train)
    eval_ns = 1e9 * (time.perf_counter() - begun) / len(task.train)
    row = replace(row, rms_train=rms_train, rms_validation=free_run_rms(found.judged, task.validate))
    if not _is_stable(model, task.train, task.train):
        return replace(row, rms_validation=None, reason="its free run over the training part diverges")
    if not _is_stable(model, task.train, unseen):
        return replace(row, reason="its free run over the unseen part diverges")
    return replace(
        row,
        rms_heldout=run.rms,
        rms_first_tenth=run.rms_first_tenth,
        rms_last_tenth=run.rms_last_tenth,
        stable=True,
        eval_ns=eval_ns,
        interval=interval,
        coverage=run.coverage,
    )


def _is_stable(model: DynamicModel, train: Sequences, unseen: Sequences) -> bool:
    low, high = (float(extreme([extreme(part.output) for part in (train, unseen)])) for extreme in (np.min, np.max))
    with np.errstate(over="ignore", invalid="ignore"):
        return bool((np.abs(model.free_run(unseen) - (low + high) / 2.0) <= _BOUND * max(high - low, 1e-300)).all())


def _chosen(rows: Sequence[DynamicRow]) -> DynamicRow | None:
    """Return the row with the fewest numbers of those that are about as good as the best, by the training part."""
    able = [
        (row.rms_validation, row.parameters or 0, row)
        for row in rows
        if row.kind is not DynamicKind.NONE
        and row.holds
        and row.rms_validation is not None
        and np.isfinite(row.rms_validation)
    ]
    if not able:
        return None
    lowest = min(rms for rms, _, _ in able)
    return min((each for each in able if each[0] <= _NO_WORSE * lowest), key=lambda each: (each[1], each[0]))[2]


def _outside(train: Sequences, unseen: Sequences) -> list[str]:
    """Return what is to be said of inputs that go farther in the unseen part than in training."""
    notes = []
    for name, seen, asked in zip(train.names, train.inputs.T, unseen.inputs.T, strict=True):
        low, high = float(seen.min()), float(seen.max())
        beyond = max(float(asked.max()) - high, low - float(asked.min()))
        if beyond > _BEYOND * (high - low):
            what = _UNITS_OF_INPUTS.get(name, f"values of {name}")
            notes.append(
                f"network asked outside its trained {what}: {low:.4g} to {high:.4g} in training, "
                f"{asked.min():.4g} to {asked.max():.4g} in the unseen part"
            )
    if "velocity" in train.names and not any("speeds" in note for note in notes):
        notes.insert(0, "the unseen part stays within the trained speeds")
    return notes


def _of_other_log(heldout: DynamicLog | None, log: DynamicLog) -> list[str]:
    """Return what is to be said of the log that judges, and not of the one that trains."""
    if heldout is None:
        return []
    name = Path(heldout.measurement.source).name
    return [f"{name}: {note}" for note in heldout.notes if note not in log.notes]


def _far_worse(chosen: DynamicRow | None) -> list[str]:
    """Return what is to be said where the unseen part is predicted far worse than the trained one."""
    if chosen is None or chosen.rms_heldout is None or not chosen.rms_train:
        return []
    times = chosen.rms_heldout / chosen.rms_train
    if times < _FAR_WORSE:
        return []
    return [
        f"the unseen part is predicted {times:.3g} times worse than the trained one: it does what training never "
        "showed, or something acts there that is no input, such as an external force or a voltage"
    ]
