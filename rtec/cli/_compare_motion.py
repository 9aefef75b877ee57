"""``rtec compare LOG --model MOTION.toml``: what a trained model of motion leaves of a log in free run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli._console import note, print_json

if TYPE_CHECKING:
    from rtec.cli._measured import MeasuredOptions


def is_motion_model(path: Path) -> bool:
    """Return whether a file is a model of motion; what cannot be read is for others to refuse."""
    from rtec.errors import RtecError
    from rtec.predictors.motion_file import is_motion_file

    try:
        return is_motion_file(path)
    except RtecError:
        return False


def compare_motion(data: Sequence[Path], measured: MeasuredOptions, output: Path | None, *, as_json: bool) -> None:
    """Show the figures of a free run over one log.

    Raises
    ------
    RtecError
        Several logs, an option that means nothing here, or a log that the model cannot predict.
    """
    from rtec.dataset.dynamic_log import log_like
    from rtec.predictors.motion_file import read_motion
    from rtec.training.free_run import free_run_of
    from rtec.units import symbol

    measured.refuse_beside("a model of motion", data, output)
    known = read_motion(measured.model or Path())
    log = log_like(known.head, data[0], measured.columns.choices())
    sequences = log.sequences
    run = free_run_of(known.model, sequences, known.interval)
    trained_here = known.trained_on(log.measurement.source)
    unseen = run
    notes = list(log.notes)
    if trained_here:
        unseen = free_run_of(known.model, sequences.part(len(sequences) // 2, len(sequences)), known.interval)
        notes.append("the model was trained on a log of this name: only its second half counts as held out")
    if as_json:
        print_json(
            {
                "source": log.measurement.source,
                "model": known.name,
                "observe": log.observe,
                "unit": sequences.unit,
                "rows": run.samples,
                "rms": run.rms,
                "rms_heldout": unseen.rms,
                "rms_first_tenth": run.rms_first_tenth,
                "rms_last_tenth": run.rms_last_tenth,
                "largest": run.largest,
                "coverage": run.coverage,
                "stable": run.stable,
                "noise_floor": None,
                "notes": notes,
            }
        )
        return
    for sentence in notes:
        note(sentence)
    unit = symbol(sequences.unit)
    typer.echo(
        f"{known.name} leaves {run.rms:.3g} {unit} RMS of {log.observe.replace('_', ' ')} in free run over "
        f"{run.samples} samples: {run.rms_first_tenth:.3g} in the first tenth, {run.rms_last_tenth:.3g} in the last, "
        f"{run.largest:.3g} at most."
    )
    if run.coverage is not None:
        typer.echo(f"{100.0 * run.coverage:.0f} % lie within its ±{known.interval:.3g} {unit}, which held 90 %.")
