"""``rtec safety``: every fault between PC, box and controller, in every phase of operation."""

from __future__ import annotations

import shlex
import sys
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli import _console, _measured
from rtec.cli._own_box import OwnOptions
from rtec.cli._parameters import design, force, option, time_ps, whole, written
from rtec.cli._verb import said
from rtec.cli._words import FAULTS, PHASES, completing
from rtec.errors import ArgumentError
from rtec.io import check_file, write_text
from rtec.units import PS_PER_S

if TYPE_CHECKING:
    from rtec.injector import Design
    from rtec.verify.safety.case import SafetyCase
    from rtec.verify.safety.matrix import MatrixPlan
    from rtec.verify.safety.soak import SoakPlan

_PS_PER_H = 3600 * PS_PER_S


def safety(
    context: typer.Context,
    own: OwnOptions,
    output: Path | None = written(
        "-o --output", "FILE.md", "Write the page here, picture and table beside it.", endings=(".md",)
    ),
    fault: list[str] | None = option(
        "--fault",
        "FAULT",
        "Only this class of faults, or this fault; may be given again.",
        complete=completing(FAULTS),
    ),
    phase: list[str] | None = option(
        "--phase", "PHASE", f"Only in this: {', '.join(PHASES)}; may be given again.", complete=completing(PHASES)
    ),
    design: list[Design] | None = design("Only this design; may be given again."),
    seeds: int = whole("--seeds", "Runs of each fault in each phase.", low=1, high=1000, default=3),
    first: int = whole("--first", "Number of the first of these runs.", low=0, high=999, default=0),
    seed: int = whole("--seed", "Of everything that is random.", low=0, high=(1 << 32) - 1, default=1),
    soak_ps: int | None = time_ps("--soak", "100h", "Also run so many hours of cutting with random faults."),
    force: bool = force("Write over files that exist."),
    json: bool = _measured.JSON,
) -> None:
    """Inject every fault in every phase of operation, and compare what the controller counts in the end.

    Each is tolerated, delayed, a safe stop, or undetected. Exits with 1 where an undetected error could have been
    avoided, or a fault did not take effect, and says which. About two minutes; with --soak 100h about ten on two
    processors. A fault alone, with --fault and --phase, is injected as among all others, also in one run:
    --first 2 --seeds 1. The PC that runs away is tried where neither is given. With --algorithm a class of your own
    inserts in the boxes, under the same faults.

    Example: rtec safety -o safety.md
    Example: rtec safety --fault pc-killed --phase cutting --design c --seeds 10
    Example: rtec safety --algorithm mine.py:Mine --design c --json
    """
    picture, table = (None if output is None else output.with_suffix(ending) for ending in (".png", ".csv"))
    for beside in (picture, table):
        if beside is not None:
            check_file("-o", beside, force=force)
    from rtec.verify.safety.case import make_case

    chosen = own.load(context, list(dict.fromkeys(design or [])))
    hours = None if soak_ps is None else _soak_plan(soak_ps, seed)
    plan = _plan(fault or [], phase or [], design or [], seeds=seeds, first=first, seed=seed)
    if chosen is not None:
        algorithm, like = chosen
        plan = replace(plan, algorithm=algorithm, designs=(like,))
        hours = hours and replace(hours, algorithm=algorithm, only=like)
        if note := getattr(algorithm, "note", ""):
            _console.note(f"{algorithm.name} runs as plain Python, slower: {note}")
    words = said(context, "algorithm", "step_counts", "states")
    with _console.progress("safety") as progress, redirect_stdout(sys.stderr):  # what a class of a user's prints
        case = make_case(plan, hours, progress, ramps=not (fault or phase))
    if output is not None and picture is not None and table is not None:
        words += said(context, "soak_ps", "fault", "phase", "design", "seeds", "first", "seed")
        name = output.name if output.is_absolute() else output.as_posix()
        _write(case, (output, picture, table), shlex.join(["rtec", "safety", "-o", name, *words]))
    if json:
        _console.print_json(case.to_dict() | {"page": output and str(output), "figure": picture and str(picture)})
    else:
        from rtec.report.terminal_safety import show

        show(case, said(context, "algorithm"))
        if output is not None:
            typer.echo(f"Page: {output}, figure: {picture}")
    if not case.good:
        raise typer.Exit(1)


def _plan(faults: list[str], phases: list[str], designs: list[Design], **numbers: int) -> MatrixPlan:
    """Return what is tried; everything of what no option names.

    Raises
    ------
    ArgumentError
        A name of none.
    """
    from rtec.injector import Design
    from rtec.verify.safety.matrix import MatrixPlan
    from rtec.verify.safety.phases import Phase
    from rtec.verify.safety.variants import variants_named

    chosen: dict[str, Any] = dict(numbers)
    if phases:
        chosen["phases"] = tuple(dict.fromkeys(Phase.named(name) for name in phases))
    if faults:
        chosen["variants"] = tuple(dict.fromkeys(one for name in faults for one in variants_named(name)))
    return MatrixPlan(designs=tuple(dict.fromkeys(designs)) or tuple(Design), **chosen)


def _soak_plan(soak_ps: int, seed: int) -> SoakPlan:
    """Return what ``--soak`` says.

    Raises
    ------
    ArgumentError
        A time that is out of range.
    """
    from rtec.verify.safety.soak import SoakPlan

    try:
        return SoakPlan(hours=soak_ps / _PS_PER_H, seed=seed)
    except ArgumentError as error:
        raise ArgumentError("--soak", f"{soak_ps / PS_PER_S:g} s", "a time from 4 s to 100000 h") from error


def _write(case: SafetyCase, files: tuple[Path, Path, Path], command: str) -> None:
    """Write page, picture and table.

    Raises
    ------
    OutputError
        One of them cannot be written.
    """
    from rtec.report.figures_safety import safety_figure
    from rtec.report.figures_style import write_figure
    from rtec.report.safety_page import faults_csv, safety_page

    output, picture, table = files
    write_figure(lambda: safety_figure(case.matrix), picture)
    write_text(table, faults_csv(case))
    write_text(output, safety_page(case, command=command, picture=picture.name, table=table.name))
