"""``rtec compare``: what a model leaves of a measurement, and where."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rtec.cli import _measured
from rtec.cli._console import announce_compilation, note, print_json, progress


def compare(
    data: _measured.Data,
    model: _measured.ModelFile = None,
    heldout: _measured.HeldOut = None,
    lock: _measured.Lock = False,
    observe: _measured.Observe = None,
    screw_pitch: _measured.ScrewPitch = None,
    signal_period: _measured.SignalPeriod = None,
    counts_per_rev: _measured.CountsPerRev = None,
    reference_temperature: _measured.ReferenceTemperature = None,
    maps: _measured.Maps = None,
    sheet: _measured.Sheet = None,
    decimal: _measured.Decimal = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Folder of a report with figures.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write into a folder that is not empty.")] = False,
    json: _measured.Json = False,
) -> None:
    """Compare a measurement with a model: what is left, against the noise floor, and where it lives.

    What the model leaves open is fitted first. Without a model all that is measured is left.

    Example: rtec compare z_axis.csv --model known.toml
    """
    from rtec.inference.compare import compare as compared
    from rtec.report.destination import check_folder, report_folder
    from rtec.report.diagnosis import (
        comparison_document,
        comparison_sentence,
        comparison_table,
        write_comparison,
    )

    if output is not None:
        check_folder(output, force=force)
    facts = _measured.facts_of(screw_pitch, signal_period, counts_per_rev, reference_temperature)
    choices = _measured.choices_of(maps, sheet, decimal)
    with progress(f"comparing {data.name}") as show:
        given = _measured.read_inputs(
            data, model=model, heldout=heldout, lock=lock, observe=observe, facts=facts, choices=choices
        )
        announce_compilation()
        show(0.2)
        result = compared(given.dataset, given.model, given.heldout)
        show(0.7)
        page = None
        if output is not None:
            with report_folder(output, "comparison") as folder:
                page = write_comparison(result, folder)
    if json:
        print_json(comparison_document(result) | ({} if page is None else {"report": str(page)}))
        return
    from rich.console import Console

    for sentence in given.dataset.notes:
        note(sentence)
    console = Console(highlight=False)
    console.print(comparison_sentence(result), soft_wrap=True, markup=False)
    console.print(comparison_table(result))
    if page is not None:
        typer.echo(f"Report: {page}")
