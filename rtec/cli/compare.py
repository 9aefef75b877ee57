"""``rtec compare``: what a model leaves of a measurement, and where."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _measured
from rtec.cli._compare_motion import compare_motion, is_motion_model
from rtec.cli._compare_warm import compare_warm, is_warm_model
from rtec.cli._console import note, print_json, progress, warn
from rtec.cli._parameters import folder, force
from rtec.cli._several import names_of, read_each, refuse_with_several, show_several

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rtec.inference.changes import Change
    from rtec.inference.compare import Comparison


def compare(
    data: list[Path] = _measured.DATA_FILES,
    *,
    measured: _measured.MeasuredOptions,
    output: Path | None = folder("-o --output", "Folder of a report with figures."),
    force: bool = force("Write into a folder that is not empty."),
    json: bool = _measured.JSON,
) -> None:
    """Compare a measurement with a model: what is left, against the noise floor, and where it lives.

    What the model leaves open is fitted first. Without a model all that is measured is left. Of a model that an
    earlier measurement gave it says what has changed since. Several measurements, such as before and after or axis by
    axis, stand beside each other. A model of motion (rtec train --dynamic) predicts a log in free run; one of a warm
    machine predicts a log of temperatures.

    Example: rtec compare z_axis.csv --model known.toml
    Example: rtec compare jan.csv feb.csv mar.csv --model december.toml -o report
    Example: rtec compare drive.csv --model motion.toml --json
    """
    from rtec.inference.changes import changes_from_first, changes_since
    from rtec.inference.compare import compare as compared
    from rtec.io import report_folder
    from rtec.report.diagnosis import (
        change_entries,
        comparison_document,
        comparison_sentence,
        write_comparison,
        write_several,
    )

    if measured.model is not None and is_motion_model(measured.model):
        compare_motion(data, measured, output, as_json=json)
        return
    if measured.model is not None and is_warm_model(measured.model):
        compare_warm(data, measured, output, as_json=json)
        return
    names = names_of(data)
    refuse_with_several(data, heldout=measured.heldout, lock=measured.lock)
    results: dict[str, Comparison] = {}
    with progress(f"comparing {', '.join(names)}"[:60]) as show:
        for name, given in read_each(data, names, measured):
            results[name] = compared(given.dataset, given.model, given.heldout)
            show(0.7 * len(results) / len(data))
        since = {name: changes_since(one) for name, one in results.items()}
        against = str(measured.model) if measured.model is not None and any(since.values()) else ""
        found = {} if len(results) == 1 else since if against else changes_from_first(results)
        result = next(iter(results.values()))
        written = {}
        if output is not None:
            with report_folder(output, "comparison") as folder:
                page = write_several(results, found, folder, against) if found else write_comparison(result, folder)
                written["report"] = str(page)
    if found:
        show_several(results, found, comparison_sentence, written, against=against, as_json=json)
    elif json:
        print_json(comparison_document(result) | {"since": change_entries(since[names[0]])} | written)
    else:
        _show(result)
        if since[names[0]]:
            _show_since(against, names[0], since[names[0]])
    if written and not json:
        typer.echo(f"Report: {written['report']}")


def _show_since(model: str, name: str, found: Sequence[Change]) -> None:
    from rich.console import Console

    from rtec.report.diagnosis import changes_sentence, changes_table

    console = Console(highlight=False)
    console.print(changes_sentence(model, {name: found}), soft_wrap=True, markup=False)
    console.print(changes_table(model, name, found))


def _show(result: Comparison) -> None:
    from rich.console import Console

    from rtec.dataset.dataset import warnings_of
    from rtec.report.diagnosis import comparison_sentence, comparison_table

    for sentence in result.dataset.notes:
        note(sentence)
    warn(warnings_of(result.dataset, result.heldout))
    console = Console(highlight=False)
    console.print(comparison_sentence(result), soft_wrap=True, markup=False)
    console.print(comparison_table(result))
