"""``rtec run``: the main job, from a measured error to four designs and a report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json, progress
from rtec.cli._parameters import flag, folder, force, needs, processor, quantity, whole, written
from rtec.cli._words import PROCESSORS
from rtec.units import LENGTH

if TYPE_CHECKING:
    from rtec.board import Microcontroller
    from rtec.report.drawn import Illustration
    from rtec.study.results import StudyResult

_DONE = 0
_FAILS = 1


def run(
    study: Path | None = typer.Argument(
        None, metavar="[STUDY.toml|lathe|warm]", help="Study to run, a file or a built-in one; lathe without it."
    ),
    output: Path | None = folder("-o --output", "Folder of the report; a new one without it."),
    force: bool = force("Write into a folder or over a file that exists."),
    repeatability_mm: float | None = quantity(
        "--repeatability", LENGTH, "1um", "Standard deviation of a reading; 0um for readings without noise."
    ),
    seed: int | None = whole("--seed", "Seed of the readings' noise.", low=0),
    firmware: bool = flag("--firmware", "Run the box's real machine code in place of the behavioural model."),
    processor: Microcontroller | None = processor(
        f"Of --firmware: {', '.join(PROCESSORS)}, or as 'one-clock 50MHz'."
    ),
    effects: Path | None = _measured.EFFECTS,
    write_study: Path | None = written(
        "--write-study", "FILE", "Write the built-in study that is named to FILE for you to change, and stop."
    ),
    json: bool = flag("--json", "One JSON document on stdout."),
) -> None:
    """Calibrate an axis, find what is wrong with it, correct it with each insertion design, and report it all.

    Exit code 1: a count at the controller is not accounted for, or a run was held.

    With --firmware each design's box is an emulated 8051 that runs the images of `rtec firmware list`, pin by pin.

    Example: rtec run --repeatability 0um -o before-after
    Example: rtec run warm --write-study mine.toml && rtec run mine.toml
    Example: rtec run mine.toml --firmware --processor one-clock-100mhz --json
    """
    builtin = "lathe" if study is None else str(study) if str(study) in ("lathe", "warm") else None
    if write_study is not None:
        _write_builtin(write_study, builtin or "lathe")
        return
    from dataclasses import replace

    from rtec.board import Microcontroller
    from rtec.effects.own_file import library_of_file
    from rtec.io import report_folder
    from rtec.report.document import study_document
    from rtec.report.folder import write_report
    from rtec.report.search import search_figures
    from rtec.study import builtin_study, read_study, run_study
    from rtec.study.compiling import compile_beside
    from rtec.study.definition import checked_repeatability

    library = library_of_file(effects)
    if study is not None and (builtin is None or study.exists()):
        what = read_study(study, library)
    else:
        what = replace(builtin_study(builtin or "lathe"), library=library)
    if repeatability_mm is not None:
        what = replace(what, repeatability_mm=checked_repeatability(repeatability_mm))
    if seed is not None:
        what = replace(what, seed=seed)
    if firmware:
        what = replace(what, firmware=processor or Microcontroller.named("8051-12mhz"))
    elif processor is not None:
        raise needs("--processor", "--firmware")
    found: list[Illustration] = []
    if what.firmware is None:
        compile_beside()
    with progress(f"study {what.name}") as show:
        result = run_study(
            what,
            progress=lambda _, share: show(0.9 * share),
            meanwhile=lambda learned: found.extend(search_figures(learned)),
        )
        with report_folder(output, what.name) as folder:
            page = write_report(result, folder, found=found)
        show(1.0)
    if json:
        print_json({**study_document(result), "report": str(page)})
    else:
        _show(result)
        typer.echo(f"Report: {page}")
    raise typer.Exit(_DONE if result.good else _FAILS)


def _show(result: StudyResult) -> None:
    from rich.console import Console

    from rtec.report.diagnosis import found_table, verdict_sentence
    from rtec.report.search import rounds_sentence
    from rtec.report.shift import shift_table
    from rtec.report.terminal import staircase_table, terminal_table

    console = Console(highlight=False)
    if result.learned is not None:
        console.print(verdict_sentence(result.learned.diagnosis), markup=False, soft_wrap=True)
        console.print(found_table(result.learned.diagnosis.model))
        console.print(staircase_table(result.learned))
        if gained := rounds_sentence(result.learned):
            console.print(gained, markup=False, soft_wrap=True)
    console.print(terminal_table(result))
    if result.shift is not None:
        console.print(shift_table(result))
    for warning in result.warnings:
        note(f"warning: {warning}")


def _write_builtin(file: Path, name: str) -> None:
    from rtec.io import write_text
    from rtec.study import builtin_text

    write_text(file, builtin_text(name))
    typer.echo(f"Wrote {file}; change it and run: rtec run {file}")
