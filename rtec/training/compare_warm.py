"""Models of a warm machine side by side: chosen by leaving out blocks, judged by blocks that no fit has seen."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from rtec.dataset.warm_log import WarmLog
from rtec.errors import RtecError
from rtec.predictors.fitting.warm.rows import rms
from rtec.training.warm_intervals import calibrated_factor, half_widths
from rtec.training.warm_methods import WarmMethod, warm_methods
from rtec.training.warm_parts import WarmParts, parts_of
from rtec.training.warm_results import ChannelFit, SensorRow, WarmComparison, WarmKind, WarmRow
from rtec.training.warm_sensors import sensor_rows, updated_hourly
from rtec.training.warm_task import ModelFit, WarmTask

NO_WORSE = 1.05
"""Times the lowest error by blocks: so much worse may be a row with fewer numbers, and be chosen."""
NO_WORSE_PHYSICAL = 1.2
"""The same for a physical row: blocks are few, so that no error by blocks is known better than that, and what follows
the heat has a reason to hold at another duty cycle."""
PERSISTENCE = "persistence"
BEYOND = 0.02
"""Of the range of an input in training: so much farther out is outside of it."""
Progress = Callable[[str, float], None]


def compare_warm(
    log: WarmLog,
    heldout: WarmLog | None = None,
    *,
    methods: Sequence[WarmMethod] | None = None,
    budget_s: float | None = 60.0,
    seed: int = 0,
    progress: Progress = lambda what, share: None,
) -> WarmComparison:
    """Fit every method to a log of a warm machine, and judge all of them by whole blocks that none has seen.

    Parameters
    ----------
    log
        Its first blocks train, its last ones judge; all of it trains where ``heldout`` judges.
    heldout
        Another log with the same inputs and displacements (`rtec.dataset.warm_log.warm_log` with ``like``).
    methods
        Which; None: all.
    budget_s
        Time in which settings are tried, shared by the methods; None: all are tried.
    seed
        Draws the random rows of the error by rows.
    progress
        Called with what is at work and the share done.

    Returns
    -------
    WarmComparison
        A row for each method. Ctrl-C ends it; the rows that are finished are kept.

    Notes
    -----
    All choices, of features, settings, sensors and of the row, are made by the error of training blocks that are left
    out in turn. Chosen is the best physical row, where its error by blocks is at most a fifth above the lowest; else,
    of the rows at most 5 % above the lowest, the one with the fewest numbers. Rows that need a probe, and those that
    are no better than the mean, are never chosen.
    """
    parts = parts_of(log, heldout)
    chosen_methods = tuple(methods or warm_methods())
    with threadpool_limits(1):  # of systems as small as these
        rows, interrupted = _rows(parts, chosen_methods, budget_s, seed, progress)
        rows = _flagged([rows[0], *_persistence(parts), *rows[1:]])
        chosen = _chosen(rows)
        sensors, ended = _sensors(parts, interrupted, progress)
    return WarmComparison(
        parts=parts,
        rows=tuple(rows),
        chosen=None if chosen is None else chosen.name,
        sensors=sensors,
        notes=tuple(_notes(parts)),
        interrupted=interrupted or ended,
    )


def _rows(
    parts: WarmParts, methods: Sequence[WarmMethod], budget_s: float | None, seed: int, progress: Progress
) -> tuple[list[WarmRow], bool]:
    """Return a row for each method, and whether Ctrl-C ended it."""
    rows: list[WarmRow] = []
    interrupted = False
    ends = np.inf if budget_s is None else time.perf_counter() + budget_s
    task = WarmTask(parts=parts, seed=seed)
    for place, method in enumerate(methods):
        row = WarmRow(name=method.name, kind=method.kind)
        left_s = ends - time.perf_counter()
        reason = None
        if interrupted:
            reason = "ended before its turn"
        elif method.needs_blocks and parts.blocks < 2:
            reason = f"leaving out a block needs two blocks, and {parts.blocks} trains"
        elif left_s <= 0.0 and method.is_slow:
            reason = f"the {budget_s:.3g} s were over before its turn: --budget gives more"
        else:
            progress(method.name, place / len(methods))
            task.until_s = time.perf_counter() + left_s / (len(methods) - place)
            try:
                row = _judged(row, method, task)
            except RtecError as error:
                reason = str(error)
            except np.linalg.LinAlgError:
                reason = "its equations have no answer: too few rows, or columns that say the same"
            except KeyboardInterrupt:
                reason, interrupted = "ended before it was fitted", True
        rows.append(row if reason is None else replace(row, reason=reason))
    return rows, interrupted


def _judged(row: WarmRow, method: WarmMethod, task: WarmTask) -> WarmRow:
    """Fit a method, and return its row with all figures."""
    parts = task.parts
    begun = time.perf_counter()
    fit = method.fit(task)
    train_s = time.perf_counter() - begun
    channels = {name: _channel(name, one, parts) for name, one in fit.channels.items()}
    silent = [~np.isfinite(one.predicted_um) for one in channels.values()]
    if np.any(silent):
        share = 100.0 * float(np.mean(silent))
        why = f"no answer for {share:.3g} % of the held-out rows, which lie beside all that it was trained on"
        return replace(row, train_s=train_s, notes=fit.notes, reason=why)
    first = next(iter(fit.channels.values()))
    return replace(
        _with_figures(row, channels, parts),
        train_s=train_s,
        eval_ns=_eval_ns(first, parts),
        parameters=first.regressor.parameters,
        notes=fit.notes,
    )


def _channel(name: str, one: ModelFit, parts: WarmParts) -> ChannelFit:
    at = np.searchsorted(parts.rows, one.rows)
    output = parts.outputs[name][at]
    said, sd = one.regressor.predict(parts.columns(one.features)[at])
    factor = None if one.left_out is None else calibrated_factor(one.left_out, sd, parts.block[at])
    predicted, unsure = one.regressor.predict(parts.judging_columns(one.features))
    return ChannelFit(
        features=one.features,
        regressor=one.regressor,
        rms_train_um=rms(output - said),
        rms_blocks_um=None if one.left_out is None else rms(one.left_out),
        rms_heldout_um=rms(parts.judged[name] - predicted),
        rms_rows_um=one.rms_rows_um,
        predicted_um=predicted,
        half_um=half_widths(factor, unsure),
    )


def _with_figures(row: WarmRow, channels: Mapping[str, ChannelFit], parts: WarmParts) -> WarmRow:
    """Return a row with what its channels say together."""
    widths = [one.half_um for one in channels.values()]
    off = [parts.judged[name] - one.predicted_um for name, one in channels.items()]
    sure = [(width, error) for width, error in zip(widths, off, strict=True) if width is not None]
    hours = parts.hours
    return replace(
        row,
        channels=channels,
        rms_train_um=_together(one.rms_train_um for one in channels.values()),
        rms_blocks_um=_together(one.rms_blocks_um for one in channels.values()),
        rms_heldout_um=_together(one.rms_heldout_um for one in channels.values()),
        rms_rows_um=_together(one.rms_rows_um for one in channels.values()),
        rms_hourly_um=_together(rms(updated_hourly(error, hours)) for error in off),
        interval_um=_together(rms(width) for width, _ in sure) if sure else None,
        coverage=float(np.mean([np.abs(error) <= width for width, error in sure])) if sure else None,
    )


def _together(figures: Iterable[float | None]) -> float | None:
    """Return the root mean square of figures of channels; None where one has none."""
    found = list(figures)
    known = [one for one in found if one is not None]
    return rms(np.array(known)) if known and len(known) == len(found) else None


def _eval_ns(one: ModelFit, parts: WarmParts) -> float:
    columns = parts.columns(one.features)
    begun = time.perf_counter()
    one.regressor.predict(columns)
    return 1e9 * (time.perf_counter() - begun) / len(columns)


def _persistence(parts: WarmParts) -> list[WarmRow]:
    """Return the row that says what the reading before said: a probe that reads all the time would do that."""
    channels = {}
    starts = np.array(parts.judge.starts)
    for name, values in parts.judge.outputs.items():
        said = np.concatenate([values[:1], values[:-1]])
        steps = np.diff(parts.log.outputs[name][: parts.until])[~np.isin(np.arange(1, parts.until), parts.log.starts)]
        off = (values - said)[parts.judging][~np.isin(parts.judging, starts)]
        steps, off = steps[np.isfinite(steps)], off[np.isfinite(off)]
        channels[name] = ChannelFit(
            rms_train_um=rms(steps),
            rms_blocks_um=rms(steps),
            rms_heldout_um=rms(off) if off.size else 0.0,
            rms_rows_um=rms(steps),
            predicted_um=said[parts.judging],
        )
    note = "It needs a probe that reads all the time: it says the reading before, and is never chosen."
    row = WarmRow(name=PERSISTENCE, kind=WarmKind.NONE, needs_probe=True, parameters=0, train_s=0.0, eval_ns=0.0)
    return [replace(_with_figures(row, channels, parts), rms_hourly_um=None, notes=(note,))]


def _flagged(rows: list[WarmRow]) -> list[WarmRow]:
    """Return rows with a note where they are worse than the mean."""
    mean = rows[0]
    found = []
    for row in rows:
        worse = []
        for figure, words in (("rms_blocks_um", "by blocks"), ("rms_heldout_um", "on the held-out part")):
            mine, least = getattr(row, figure), getattr(mean, figure)
            if row is not mean and mine is not None and least is not None and mine > least:
                worse.append(f"{words} ({mine:.3g} um, the mean {least:.3g} um)")
        flags = [f"Worse than the mean {' and '.join(worse)}."] if worse else []
        found.append(replace(row, notes=(*row.notes, *flags)))
    return found


def _chosen(rows: Sequence[WarmRow]) -> WarmRow | None:
    """Return the row that errors by blocks choose; None where none is better than the mean."""
    mean = rows[0].rms_blocks_um
    able = [(row.rms_blocks_um, row.parameters or 0, row) for row in rows if row.works]
    known = [(error, numbers, row) for error, numbers, row in able if error is not None]
    known = [one for one in known if mean is None or one[0] < mean]
    lowest = min((error for error, *_ in known), default=0.0)
    physical = [one for one in known if one[2].kind is WarmKind.PHYSICAL and one[0] <= NO_WORSE_PHYSICAL * lowest]
    if physical:
        return min(physical, key=lambda one: one[0])[2]
    good = [one for one in known if one[0] <= NO_WORSE * lowest]
    return min(good, key=lambda one: (one[1], one[0]))[2] if good else None


def _sensors(parts: WarmParts, interrupted: bool, progress: Progress) -> tuple[tuple[SensorRow, ...], bool]:
    """Return which sensors to take, and whether Ctrl-C ended that."""
    if interrupted or parts.blocks < 2:
        return (), False
    progress("which sensors", 1.0)
    try:
        return sensor_rows(parts), False
    except KeyboardInterrupt:
        return (), True


def _notes(parts: WarmParts) -> list[str]:
    """Return what is to be said of the parts."""
    log, judge = parts.log, parts.judge
    trained = ", ".join(log.blocks.names[number] for number in np.unique(parts.block))
    notes = [f"blocks by {log.blocks.by}: {parts.blocks} train ({trained})"]
    step = int(parts.rows[1] - parts.rows[0]) if parts.rows.size > 1 else 1
    if step > 1:
        notes.append(f"fits see every {step}th row, {parts.rows.size} of {parts.until}; all rows judge")
    far = []
    for name, values in log.inputs.items():
        seen, asked = values[: parts.until], judge.inputs[name][parts.judging]
        low, high = float(seen.min()), float(seen.max())
        beyond = max(float(asked.max()) - high, low - float(asked.min())) / max(high - low, 1e-12)
        if beyond > BEYOND:
            far.append((beyond, f"{name}: {asked.min():.4g} to {asked.max():.4g}, trained {low:.4g} to {high:.4g}"))
    if far:
        many = f"{len(far)} of {len(log.inputs)} inputs go beyond what trained in the held-out part"
        notes.append(f"{many}, farthest {max(far)[1]}")
    if judge is not log:
        notes += [f"in {Path(judge.source).name}: {note}" for note in judge.notes if note not in log.notes]
    return notes
