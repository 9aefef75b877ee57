"""``rtec compare``: what a model leaves of a measurement, and where."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json, progress, warn
from rtec.cli._parameters import folder, force
from rtec.cli._several import names_of, read_each, refuse_with_several, show_several

if TYPE_CHECKING:
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

    What the model leaves open is fitted first. Without a model all that is measured is left. Several measurements,
    such as before and after or axis by axis, stand beside each other.

    Example: rtec compare z_axis.csv --model known.toml
    Example: rtec compare z_axis.csv --model known.toml --heldout check.csv -o report
    Example: rtec compare drive.csv --observe force --json
    """
    from rtec.inference.changes import changes_from_first
    from rtec.inference.compare import compare as compared
    from rtec.io import report_folder
    from rtec.report.diagnosis import comparison_document, comparison_sentence, write_comparison, write_several

    names = names_of(data)
    refuse_with_several(data, heldout=measured.heldout, lock=measured.lock)
    results: dict[str, Comparison] = {}
    with progress(f"comparing {', '.join(names)}"[:60]) as show:
        for name, given in read_each(data, names, measured):
            results[name] = compared(given.dataset, given.model, given.heldout)
            show(0.7 * len(results) / len(data))
        found = changes_from_first(results)
        result = next(iter(results.values()))
        written = {}
        if output is not None:
            with report_folder(output, "comparison") as folder:
                page = write_several(results, found, folder) if found else write_comparison(result, folder)
                written["report"] = str(page)
    if found:
        show_several(results, found, comparison_sentence, written, as_json=json)
    elif json:
        print_json(comparison_document(result) | written)
    else:
        _show(result)
    if written and not json:
        typer.echo(f"Report: {written['report']}")


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
