"""``rtec train``: every kind of predictor fitted to a measurement and compared; the best one written to a file."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json, progress, warn
from rtec.cli._parameters import apart, flag, force, needs, option, whole, written
from rtec.cli._train_dynamic import DynamicOptions, train_dynamic
from rtec.cli._words import PREDICTORS, completing
from rtec.errors import ArgumentError, unknown
from rtec.io import FIGURES, check_file
from rtec.units import TIME, parse_quantity

if TYPE_CHECKING:
    from rtec.predictors.fitting.training import Effort
    from rtec.training import PredictorComparison, Row

_INTERRUPTED = 130
_WHOLE_LINES = 1000
_BUDGET_S = 40.0


def _row(said: str) -> str:
    from rtec.training import all_methods

    names = [method.name for method in all_methods(several_axes=True) if method.name != "none"]
    as_one_word = {name.replace(" ", "-"): name for name in names}
    if (word := said.replace(" ", "-")) not in as_one_word:
        raise unknown("--pick", said, names, noun="predictor")
    return as_one_word[word]


def _budget(said: str) -> float:
    budget_s = parse_quantity(said, TIME, name="--budget")
    if not 0.0 < budget_s <= 1e6:
        raise ArgumentError("--budget", said, "a time above 0 s, up to 1e6 s")
    return budget_s


def train(
    data: Path = _measured.DATA,
    *,
    heldout: Path | None = option("--heldout", "FILE", "Another measurement that judges, best at other targets."),
    output: Path | None = written("-o --output", "MODEL.toml", "Write the best predictor.", endings=(".toml",)),
    pick: str | None = option(
        "--pick", "NAME", "Write the predictor of this row instead.", complete=completing(PREDICTORS)
    ),
    dynamic: bool = flag("--dynamic", "DATA is the log of a drive: models of motion, compared in free run."),
    observe: str | None = option(
        "--observe", "QUANTITY", "Output of a model of motion: the following error without it, or any column."
    ),
    figure: Path | None = written(
        "--figure", "F.png", "Errors, sizes and learning curves as a picture.", endings=FIGURES
    ),
    budget_s: float | None = option(
        "--budget", "'2 min'", "Time that all networks share: 40 s, 90 s with --dynamic.", read=_budget
    ),
    starts: int = whole("--starts", "Trainings of a network, from other weights.", low=1, high=1000, default=10),
    thesis: bool = flag("--thesis", "Up to 10 000 epochs a training, no budget and no early end: hours."),
    screw_pitch: str | None = _measured.SCREW_PITCH,
    counts_per_rev: str | None = _measured.COUNTS_PER_REV,
    effects: Path | None = _measured.EFFECTS,
    columns: _measured.ColumnOptions,
    seed: int = whole("--seed", "Draws what is held out, and the first weights.", low=0, default=0),
    force: bool = force("Write over files that exist."),
    json: bool = _measured.JSON,
) -> None:
    """Fit tables, physical effects and networks to one measurement, and compare them by readings that none has seen.

    A fifth of the places is held out, unless --heldout names another measurement. Ctrl-C ends the training and keeps
    the best so far. With --dynamic the first half of a log trains models of motion, and the second half judges them.

    Example: rtec train z_axis.csv --heldout check.csv -o best.toml
    Example: rtec train z_axis.csv --budget "2 min" --figure errors.png
    Example: rtec train --dynamic drive.csv --axis x -o motion.toml --json
    """
    if pick is not None and output is None:
        raise needs("--pick", "-o MODEL.toml")
    if dynamic:
        _refuse_with_dynamic(figure, thesis, screw_pitch, counts_per_rev, effects)
        asked = DynamicOptions(
            observe=observe,
            heldout=heldout,
            output=output,
            pick=pick,
            budget_s=budget_s,
            starts=starts,
            columns=columns,
            seed=seed,
            force=force,
            json=json,
        )
        if train_dynamic(data, asked):
            raise typer.Exit(_INTERRUPTED)
        return
    if observe is not None:
        raise needs("--observe", "--dynamic", "a predictor of positions is one of the deviation")
    pick = None if pick is None else _row(pick)
    from rtec.dataset.dataset import warnings_of
    from rtec.training import compare_predictors

    with progress(f"training on {data.name}") as show:
        axis = _measured.AxisOptions(screw_pitch=screw_pitch, counts_per_rev=counts_per_rev)
        given = _measured.MeasuredOptions(heldout=heldout, effects=effects, axis=axis, columns=columns).read(data)
        result = compare_predictors(
            given.dataset,
            given.heldout,
            effort=_effort(starts, thesis),
            budget_s=None if thesis else _BUDGET_S if budget_s is None else budget_s,
            seed=seed,
            progress=lambda what, share: show(share, what),
        )
    warnings = warnings_of(given.dataset, given.heldout)
    if not json:  # before anything is written: a full disk shall not take the figures with it
        _show(result, given.dataset.notes, warnings)
    made = {} if output is None else _write(output, result, _chosen(result, pick), force=force)
    if figure is not None:
        _draw(figure, result, force=force)
    if json:
        from rtec.report.training import training_document

        print_json(training_document(result) | {"warnings": warnings} | made)
    elif output is not None:
        typer.echo(f"{output}: {made['written']}")
    if result.interrupted:
        raise typer.Exit(_INTERRUPTED)


def _refuse_with_dynamic(
    figure: Path | None, thesis: bool, screw_pitch: str | None, counts_per_rev: str | None, effects: Path | None
) -> None:
    said = {"--figure": figure, "--thesis": thesis, "--screw-pitch": screw_pitch, "--effects": effects}
    for name, value in (said | {"--counts-per-rev": counts_per_rev}).items():
        if value not in (None, False):
            raise apart(name, "--dynamic")


def _effort(starts: int, thesis: bool) -> Effort:
    from rtec.predictors.fitting.training import Effort

    return Effort(starts=starts, epochs=10_000, patience=10_000) if thesis else Effort(starts=starts)


def _chosen(result: PredictorComparison, pick: str | None) -> Row:
    row = result.best if pick is None else result.named(pick)
    if row is None or not row.works:
        why = "no predictor has a figure" if row is None or row.reason is None else row.reason
        if row is None and pick is not None:
            why = "it needs a measurement that tells where other axes stood, in columns such as position_2_mm"
        raise ArgumentError("-o" if pick is None else "--pick", pick or "the best row", "a row with a figure", why)
    return row


def _draw(path: Path, result: PredictorComparison, *, force: bool) -> None:
    from rtec.report.figures_style import write_figure
    from rtec.report.figures_training import training_figure

    check_file("--figure", path, force=force)  # somebody may have written it in the meantime
    write_figure(lambda: training_figure(result), path)


def _write(path: Path, result: PredictorComparison, row: Row, *, force: bool) -> dict[str, str]:
    """Write a predictor: effects as a model that ``rtec compare`` reads, too, all others with their numbers."""
    check_file("-o", path, force=force)  # somebody may have written it in the meantime
    from rtec.inference.model_file import write_model
    from rtec.predictors import KnownPredictor, write_predictor

    interval_mm = math.inf if row.interval_mm is None else row.interval_mm
    if row.model is not None:
        write_model(path, replace(row.model, interval=interval_mm if math.isfinite(interval_mm) else None))
    elif row.predictor is not None:
        source = Path(result.source).name
        known = KnownPredictor(
            predictor=row.predictor, name=row.name, source=source, interval_mm=interval_mm, axis=result.axis
        )
        write_predictor(path, known)
    return {"model": str(path), "written": row.name}


def _show(result: PredictorComparison, notes: tuple[str, ...], warnings: list[str]) -> None:
    from rich.console import Console

    from rtec.report.training import training_sentence, training_table

    for sentence in (*notes, *result.notes):
        note(sentence)
    warn(warnings)
    console = Console(highlight=False)
    if console.is_terminal:
        console.print(training_table(result, console.width))
    else:  # a file or another program gets whole lines
        Console(highlight=False, width=_WHOLE_LINES).print(training_table(result))
    console.print(training_sentence(result), soft_wrap=True, markup=False)
