"""``rtec diagnose``: which physical effect is missing, or that it cannot be told, and why."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json, progress, warn
from rtec.cli._parameters import folder, force, option, written
from rtec.cli._several import names_of, read_each, refuse_with_several, show_several
from rtec.errors import ArgumentError
from rtec.io import check_file
from rtec.units import TIME, parse_quantity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rtec.inference.changes import Change
    from rtec.inference.results import Diagnosis

_LEAST_S, _MOST_S = 60.0, 432_000.0


def _machine_time(said: str) -> float:
    time_s = parse_quantity(said, TIME, name="--next")
    if not _LEAST_S <= time_s <= _MOST_S:
        raise ArgumentError("--next", said, "a time from 1 min to 120 h, such as 1h")
    return time_s


def diagnose(
    data: list[Path] = _measured.DATA_FILES,
    *,
    measured: _measured.MeasuredOptions,
    output: Path | None = folder("-o --output", "Folder of a report with figures."),
    save: Path | None = written("--save", "MODEL.toml", "Write the model with all effects found."),
    suggest: Path | None = written("--suggest", "PLAN.toml", "Write what to measure next as a plan to carry out."),
    next_s: float | None = option(
        "--next",
        "TIME",
        "The best plan for so long at the machine, such as 1h, and what it will show. --suggest writes it, and "
        "beside it as .csv and as G-code (.nc).",
        read=_machine_time,
    ),
    force: bool = force("Write over what is there."),
    seed: int = _measured.SEED,
    json: bool = _measured.JSON,
) -> None:
    """Find which physical effects a measurement shows that the model lacks, one by one, down to the noise floor.

    The verdict is NAMED, LIKELY, TIED, NOT_TESTABLE, INCONCLUSIVE, UNKNOWN or NONE; any of them is an answer. Of
    several measurements, such as before and after or axis by axis, it says what differs from the first.

    Example: rtec diagnose z_axis.csv -o report --save found.toml --suggest plan.toml
    Example: rtec diagnose z_axis.csv --model known.toml --lock
    Example: rtec diagnose drive.csv --observe current --screw-pitch "5 mm" --next 1h --suggest plan.toml
    """
    from rtec.inference.changes import changes_from_first
    from rtec.inference.diagnose import diagnose as diagnosed
    from rtec.report.diagnosis import changes_sentence, verdict_sentence

    names = names_of(data)
    refuse_with_several(data, heldout=measured.heldout, lock=measured.lock, save=save, suggest=suggest, next=next_s)
    if save is not None and suggest is not None and save.resolve() == suggest.resolve():
        raise ArgumentError("--suggest", suggest, "another file", problem="is the file of --save")
    results: dict[str, Diagnosis] = {}
    with progress(f"diagnosing {', '.join(names)}"[:60]) as show:

        def told(share: float) -> None:
            show(0.1 + 0.8 * (len(results) + share) / len(data))

        for name, given in read_each(data, names, measured):
            told(0.0)
            results[name] = diagnosed(
                given.dataset, given.model, given.heldout, locked=given.locked, seed=seed, progress=told
            )
        result, found = next(iter(results.values())), changes_from_first(results)
        made = _write(results, found, output, save, None if next_s is not None else suggest)
    if found:
        show_several(results, found, verdict_sentence, {"seed": seed, **made}, as_json=json)
        if not json:
            typer.echo(changes_sentence(names[0], found))
            _tell(made)
    else:
        planned = {} if next_s is None else _next_hour(result, next_s, suggest, force=force, as_json=json)
        show_diagnosis(result, made | planned, as_json=json, seed=seed)


def _next_hour(result: Diagnosis, time_s: float, path: Path | None, *, force: bool, as_json: bool) -> dict[str, Any]:
    """Return what is said of the best plan for a time at the machine, and write it where a file is named."""
    from rtec.inference.next_plan import next_plan
    from rtec.report.diagnosis.next_hour import next_plan_document, next_plan_sentence, write_next_plan

    found = next_plan(result, time_s)
    if isinstance(found, str):
        note(f"--next: no plan: {found}")
        return {"plan": None} if as_json else {}
    for ending in (".csv", ".nc"):
        if path is not None:
            check_file("--suggest", path.with_suffix(ending), force=force)
    units = result.dataset.units
    files = {} if path is None else write_next_plan(path, found, units)
    return {"plan": next_plan_document(found, units, files) if as_json else next_plan_sentence(found, units)}


def _write(
    results: Mapping[str, Diagnosis],
    found: Mapping[str, Sequence[Change]],
    output: Path | None,
    save: Path | None,
    suggest: Path | None,
) -> dict[str, str]:
    from rtec.inference.model_file import write_model
    from rtec.io import report_folder
    from rtec.report.diagnosis import write_diagnosis, write_several

    made = {}
    result = next(iter(results.values()))
    if output is not None:
        with report_folder(output, "diagnosis") as place:
            page = write_several(results, found, place) if found else write_diagnosis(result, place)
            made["report"] = str(page)
    if save is not None:
        write_model(save, result.model if result.curve is None else result.curve.model)
        if result.curve is not None:
            note(f"{save} holds the learned curve {result.curve.shape.said_of_it} beside the effects found")
        made["model"] = str(save)
    if suggest is not None and _write_plan(suggest, result):
        made["plan"] = str(suggest)
    return made


def _tell(written: Mapping[str, Any]) -> None:
    for what, place in written.items():
        typer.echo(f"{what.capitalize()}: {place}")


def _write_plan(path: Path, result: Diagnosis) -> bool:
    """Write the plan of the experiment that a diagnosis suggests; return whether there is one, and say why not."""
    from rtec.inference.suggested_plan import suggested_plan
    from rtec.metrology import write_experiment

    plan, reason = suggested_plan(result)
    if plan is None:
        note(f"--suggest: no plan was written; {reason}")
        return False
    write_experiment(path, plan, result.experiment.text)
    return True


def show_diagnosis(result: Diagnosis, written: Mapping[str, Any], *, as_json: bool, seed: int) -> None:
    """Print a diagnosis and what was written: one JSON document, or the verdict in a sentence and tables."""
    from rtec.dataset.dataset import warnings_of
    from rtec.report.diagnosis import diagnosis_document, diagnosis_table, verdict_sentence

    if as_json:
        print_json({**diagnosis_document(result), "seed": seed, **written})
        return
    from rich.console import Console

    for sentence in dict.fromkeys((*result.dataset.notes, *result.notes)):
        note(sentence)
    warn(warnings_of(result.dataset, result.heldout))
    console = Console(highlight=False)
    console.print(verdict_sentence(result), soft_wrap=True, markup=False)
    console.print(diagnosis_table(result))
    _tell(written)
