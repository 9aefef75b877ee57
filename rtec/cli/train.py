"""``rtec train``: every kind of predictor fitted to a measurement and compared; the best one written to a file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json, progress, warn
from rtec.cli._parameters import apart, flag, force, needs, option, whole, written
from rtec.cli._train_dynamic import train_dynamic
from rtec.cli._train_options import TrainOptions
from rtec.cli._train_warm import is_warm, train_warm
from rtec.cli._words import MOTION_MODELS, PREDICTORS, WARM_MODELS, completing
from rtec.errors import ArgumentError
from rtec.io import FIGURES, check_file
from rtec.units import TIME, parse_quantity

if TYPE_CHECKING:
    from rtec.predictors.fitting.training import Effort
    from rtec.training import PredictorComparison, Row

_INTERRUPTED = 130
_WHOLE_LINES = 1000
_BUDGET_S = 40.0


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
        "--pick",
        "NAME",
        "Write the predictor of this row.",
        complete=completing((*PREDICTORS, *MOTION_MODELS, *WARM_MODELS)),
    ),
    dynamic: bool = flag("--dynamic", "DATA is the log of a drive: models of motion, compared in free run."),
    observe: str | None = option(
        "--observe",
        "QUANTITY",
        "Displacement of a warm machine, as ch3 (all without it); output of a model of motion, with --dynamic.",
    ),
    blocks: str | None = option(
        "--blocks", "COLUMN", "Warm machine: its changes start the blocks that are left out; speed without it."
    ),
    inputs: str | None = option(
        "--inputs",
        "velocity,...",
        "What goes into a model of motion: all that the log has without it; a plan has velocity and acceleration.",
    ),
    figure: Path | None = written(
        "--figure", "F.png", "Errors, sizes and learning curves as a picture.", endings=FIGURES
    ),
    budget_s: float | None = option(
        "--budget", "'2 min'", "Time for all: 40 s; 60 s for a warm machine, 90 s with --dynamic.", read=_budget
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
    A log of displacements over time, with temperatures or spindle_rpm, trains models of a warm machine: its last
    speeds are held out.

    Example: rtec train z_axis.csv --heldout check.csv --budget "2 min" --figure errors.png -o best.toml
    Example: rtec train spindle.csv --observe ch3 --figure spindle.png -o ch3.toml
    Example: rtec train --dynamic drive.csv --axis x -o motion.toml --json
    """
    if pick is not None and output is None:
        raise needs("--pick", "-o MODEL.toml")
    asked = TrainOptions(
        heldout=heldout,
        output=output,
        pick=pick,
        observe=observe,
        blocks=blocks,
        inputs=None if inputs is None else [name.strip() for name in inputs.split(",")],
        figure=figure,
        budget_s=budget_s,
        starts=starts,
        thesis=thesis,
        axis=_measured.AxisOptions(screw_pitch=screw_pitch, counts_per_rev=counts_per_rev),
        effects=effects,
        columns=columns,
        seed=seed,
        force=force,
        json=json,
    )
    if dynamic:
        _refuse_with("--dynamic", asked, {"--figure": figure, "--blocks": blocks})
        interrupted = train_dynamic(data, asked)
    elif inputs is None and is_warm(data, observe, columns):
        _refuse_with("the log of a warm machine", asked, {})
        interrupted = train_warm(data, asked)
    else:
        _refuse_without_dynamic({"--observe": observe, "--inputs": inputs})
        if blocks is not None:
            raise ArgumentError(
                "--blocks", "", "it for the log of a warm machine", problem=f"means nothing for {data}"
            )
        interrupted = _train_positions(data, asked)
    if interrupted:
        raise typer.Exit(_INTERRUPTED)


def _train_positions(data: Path, asked: TrainOptions) -> bool:
    """Fit, compare, show and write predictors of positions; return whether Ctrl-C ended it."""
    from rtec.dataset.dataset import warnings_of
    from rtec.training import all_methods, compare_predictors

    names = [method.name for method in all_methods(several_axes=True) if method.name != "none"]
    pick = asked.row(names, "predictor")
    with progress(f"training on {data.name}") as show:
        given = _measured.MeasuredOptions(
            heldout=asked.heldout, effects=asked.effects, axis=asked.axis, columns=asked.columns
        ).read(data)
        result = compare_predictors(
            given.dataset,
            given.heldout,
            effort=_effort(asked.starts, asked.thesis),
            budget_s=None if asked.thesis else _BUDGET_S if asked.budget_s is None else asked.budget_s,
            seed=asked.seed,
            progress=lambda what, share: show(share, what),
        )
    warnings = warnings_of(given.dataset, given.heldout)
    if not asked.json:  # before anything is written: a full disk shall not take the figures with it
        _show(result, given.dataset.notes, warnings)
    made = {} if asked.output is None else _write(asked.output, result, _chosen(result, pick), force=asked.force)
    if asked.figure is not None:
        _draw(asked.figure, result, force=asked.force)
    if asked.json:
        from rtec.report.training import training_document

        print_json(training_document(result) | {"warnings": warnings} | made)
    elif asked.output is not None:
        typer.echo(f"{asked.output}: {made['written']}")
    return result.interrupted


def _refuse_with(what: str, asked: TrainOptions, more: Mapping[str, object]) -> None:
    """Refuse options that mean something for positions only, and others."""
    said = {"--thesis": asked.thesis, "--screw-pitch": asked.axis.screw_pitch, "--effects": asked.effects}
    for name, value in {**said, "--counts-per-rev": asked.axis.counts_per_rev, **more}.items():
        if value not in (None, False):
            raise apart(name, what)


def _refuse_without_dynamic(said: dict[str, str | None]) -> None:
    for name, value in said.items():
        if value is not None:
            raise needs(name, "--dynamic", "a predictor of positions is one of the deviation")


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
