"""``rtec compare LOG --model WARM.toml``: what a model of a warm machine leaves of another log."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli._console import note, print_json

if TYPE_CHECKING:
    from rtec.cli._measured import MeasuredOptions


def is_warm_model(path: Path) -> bool:
    """Return whether a file is a model of a warm machine; what cannot be read is for others to refuse."""
    from rtec.errors import RtecError
    from rtec.predictors.predictor_file import is_warm_file

    try:
        return is_warm_file(path)
    except RtecError:
        return False


def compare_warm(data: Sequence[Path], measured: MeasuredOptions, output: Path | None, *, as_json: bool) -> None:
    """Show the figures of one log.

    Raises
    ------
    RtecError
        Several logs, an option that means nothing here, or a log that the model cannot predict.
    """
    from rtec.predictors.predictor_file import read_warm_model
    from rtec.training.warm_comparison import warm_residual

    measured.refuse_beside("a model of a warm machine", data, output)
    known, model = read_warm_model(measured.model or Path())
    found = warm_residual(model, data[0], choices=measured.columns.choices())
    trained_here = bool(known.source) and Path(found.log.source).name == known.source
    notes = list(found.log.notes)
    if trained_here:
        notes.append("the model was trained on a log of this name: this says nothing of another one")
    if found.unanswered:
        notes.append(f"{found.unanswered} rows for which the model has no answer are left out")
    if found.outside:
        inside = "" if found.rms_inside_um is None else f"; {found.rms_inside_um:.3g} µm RMS in the others"
        notes.append(f"{found.outside} rows are outside of what the model was trained for{inside}")
    if as_json:
        print_json({
            "source": found.log.source,
            "model": known.name,
            "observe": model.observe,
            "unit": "um",
            "rows": found.rows,
            "rms": found.rms_um,
            "rms_heldout": None if trained_here else found.rms_um,
            "mean": found.mean_um,
            "largest": found.largest_um,
            "rms_without": found.spread_um,
            "rows_outside": found.outside,
            "rms_inside": found.rms_inside_um,
            "coverage": found.coverage,
            "noise_floor": None,
            "notes": notes,
        })  # fmt: skip
        return
    for sentence in notes:
        note(sentence)
    typer.echo(
        f"{known.name} leaves {found.rms_um:.3g} µm RMS of {model.observe} over {found.rows} rows, "
        f"{found.mean_um:+.3g} µm on average, {found.largest_um:.3g} µm at most; the log itself changes by "
        f"{found.spread_um:.3g} µm RMS."
    )
    if found.coverage is not None:
        half_um = 1e3 * model.interval_mm
        typer.echo(f"{100.0 * found.coverage:.0f} % lie within its ±{half_um:.3g} µm, which held 90 % in training.")
