"""``rtec train`` on the log of a warm machine: methods that predict it, and which thermometers to buy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli._console import note, print_json, progress
from rtec.errors import ArgumentError, RtecError
from rtec.io import check_file

if TYPE_CHECKING:
    from rtec.cli._measured import ColumnOptions
    from rtec.cli._train_options import TrainOptions
    from rtec.training.warm_results import WarmComparison, WarmRow

_BUDGET_S = 60.0
_WHOLE_LINES = 1000


def is_warm(data: Path, observe: str | None, columns: ColumnOptions) -> bool:
    """Return whether a file is the log of a warm machine; one that cannot be read is for others to refuse."""
    from rtec.dataset.warm_log import is_warm_log
    from rtec.metrology import read_measurement

    try:
        return is_warm_log(read_measurement(data, replace(columns.choices(), gaps=True)), observe)
    except RtecError:
        return False


def train_warm(data: Path, asked: TrainOptions) -> bool:
    """Fit, compare, show and write; return whether Ctrl-C ended it.

    Raises
    ------
    RtecError
        A log that cannot be read, or an option that does not fit it.
    """
    from rtec.dataset.warm_blocks import FEWEST_BLOCKS
    from rtec.dataset.warm_log import warm_log
    from rtec.training.compare_warm import compare_warm
    from rtec.training.warm_methods import warm_methods
    from rtec.training.warm_results import WarmKind

    pick = asked.row([one.name for one in warm_methods() if one.kind is not WarmKind.NONE], "model of a warm machine")
    asked.refuse_itself(data, "the last blocks judge")
    heldout = asked.heldout
    with progress(f"training on {data.name}", lines="") as show:
        choices = asked.columns.choices()
        fewest = FEWEST_BLOCKS if heldout is None else FEWEST_BLOCKS - 1
        log = warm_log(data, observe=asked.observe, blocks=asked.blocks, fewest_blocks=fewest, choices=choices)
        if asked.output is not None and len(log.outputs) > 1:
            allowed = f"--observe with one of {', '.join(log.outputs)}"
            raise ArgumentError("-o", asked.output, allowed, problem="holds the model of one displacement")
        result = compare_warm(
            log,
            None if heldout is None else warm_log(heldout, like=log, choices=choices),
            budget_s=_BUDGET_S if asked.budget_s is None else asked.budget_s,
            seed=asked.seed,
            progress=lambda what, share: show(share, what),
        )
    if not asked.json:  # before anything is written: a full disk shall not take the figures with it
        _show(result)
    made = {} if asked.output is None else _write(asked.output, result, pick, force=asked.force)
    if asked.figure is not None:
        _draw(asked.figure, result, force=asked.force)
    if asked.json:
        from rtec.report.warm_training import warm_document

        print_json(warm_document(result) | made)
    elif asked.output is not None:
        typer.echo(f"{asked.output}: {made['written']}")
    return result.interrupted


def _show(result: WarmComparison) -> None:
    from rich.console import Console

    from rtec.report.warm_training import sensor_sentence, sensor_table, warm_sentence, warm_table

    for sentence in result.parts.log.notes:
        note(sentence)
    console = Console(highlight=False)
    narrow = console.width if console.is_terminal else None
    wide = console if console.is_terminal else Console(highlight=False, width=_WHOLE_LINES)
    wide.print(warm_table(result, narrow))
    console.print(warm_sentence(result), soft_wrap=True, markup=False)
    if result.sensors:
        console.print()
        wide.print(sensor_table(result, narrow))
        console.print(sensor_sentence(result), soft_wrap=True, markup=False)


def _draw(path: Path, result: WarmComparison, *, force: bool) -> None:
    from rtec.report.figures_style import write_figure
    from rtec.report.figures_warm import warm_figure

    check_file("--figure", path, force=force)  # somebody may have written it in the meantime
    write_figure(lambda: warm_figure(result), path)


def _write(path: Path, result: WarmComparison, pick: str | None, *, force: bool) -> dict[str, str]:
    """Write the model of a row, the chosen one where none is named."""
    check_file("-o", path, force=force)  # somebody may have written it in the meantime
    row: WarmRow | None = result.named(result.chosen if pick is None else pick)
    if row is None or not row.works:
        why = "no row is chosen" if row is None or row.reason is None else row.reason
        raise ArgumentError("-o" if pick is None else "--pick", pick or "the chosen row", "a row with a figure", why)
    from rtec.predictors import KnownPredictor, write_predictor
    from rtec.training.warm_file import model_of

    (observe,) = row.channels
    known = KnownPredictor(
        predictor=model_of(row.channels[observe], observe, result.parts),
        name=row.name,
        source=Path(result.parts.log.source).name,
    )
    write_predictor(path, known)
    return {"model": str(path), "written": row.name}
