"""``rtec safety``: every fault between PC, box and controller, in every phase of operation."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtec.cli import _console, _measured
from rtec.cli._arguments import option, whole_option
from rtec.cli._words import FAULTS, PHASES, completing
from rtec.errors import ArgumentError
from rtec.io import check_file, write_text
from rtec.units import PS_PER_S

if TYPE_CHECKING:
    from rtec.campaign.safety import SafetyCase
    from rtec.campaign.safety_matrix import MatrixPlan
    from rtec.campaign.soak import SoakPlan

_PS_PER_H = 3600 * PS_PER_S


def safety(
    output: Annotated[
        Path | None,
        option("-o", "--output", metavar="FILE.md", help="Write the page here, and its picture beside it."),
    ] = None,
    fault: Annotated[
        list[str] | None,
        option(
            "--fault",
            metavar="FAULT",
            help="Only this class of faults, or this fault; may be given again.",
            complete=completing(FAULTS),
        ),
    ] = None,
    phase: Annotated[
        list[str] | None,
        option(
            "--phase",
            metavar="PHASE",
            help=f"Only in this: {', '.join(PHASES)}; may be given again.",
            complete=completing(PHASES),
        ),
    ] = None,
    design: Annotated[
        list[str] | None, option("--design", metavar="original|a|b|c", help="Only this design; may be given again.")
    ] = None,
    seeds: Annotated[int, whole_option(low=1, high=1000, help="Runs of each fault in each phase.")] = 3,
    first: Annotated[int, whole_option(low=0, high=999, help="Number of the first of these runs.")] = 0,
    seed: Annotated[int, whole_option(low=0, high=(1 << 32) - 1, help="Of everything that is random.")] = 1,
    soak: Annotated[
        str | None, option("--soak", metavar="100h", help="Also run so many hours of cutting with random faults.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over files that exist.")] = False,
    json: _measured.Json = False,
) -> None:
    """Inject every fault in every phase of operation, and compare what the controller counts in the end.

    Each is tolerated, delayed, a safe stop, or undetected. Exits with 1 where an undetected error could have been
    avoided, or a fault did not take effect, and says which. About two minutes; with --soak 100h about ten on two
    processors. A fault alone, with --fault and --phase, is injected as among all others, also in one run:
    --first 2 --seeds 1. The PC that runs away is tried where neither is given.

    Example: rtec safety -o safety.md
    Example: rtec safety --fault pc-killed --phase cutting --design c --seeds 10
    Example: rtec safety --design b --seeds 1 --json
    """
    picture = None if output is None else output.with_suffix(".png")
    if output is not None and picture is not None:
        check_file("-o", output, force=force, endings=(".md",))
        check_file("-o", picture, force=force)
    hours = None if soak is None else _soak_plan(soak, seed)
    from rtec.campaign.safety import make_case

    options = {"fault": fault or [], "phase": phase or [], "design": design or []}
    plan = _plan(options, seeds, first, seed)
    _console.announce_compilation()
    with _console.progress("safety") as progress:
        case = make_case(plan, hours, progress, ramps=not (fault or phase))
    if output is not None and picture is not None:
        _write(case, output, picture, _command(output, soak, options, seeds, first, seed))
    if json:
        _console.print_json(case.to_dict() | {"page": output and str(output), "figure": picture and str(picture)})
    else:
        from rtec.report.terminal_safety import show

        show(case)
        if output is not None:
            typer.echo(f"Page: {output}, figure: {picture}")
    if not case.good:
        raise typer.Exit(1)


def _plan(options: dict[str, list[str]], seeds: int, first: int, seed: int) -> MatrixPlan:
    """Return what is tried; everything of what no option names.

    Raises
    ------
    ArgumentError
        A name of none.
    """
    from rtec.campaign.safety_matrix import MatrixPlan
    from rtec.campaign.safety_phases import Phase
    from rtec.campaign.safety_variants import variants_named
    from rtec.injector import Design

    designs = tuple(dict.fromkeys(Design.named(name) for name in options["design"])) or tuple(Design)
    chosen: dict[str, Any] = {}
    if options["phase"]:
        chosen["phases"] = tuple(dict.fromkeys(Phase.named(name) for name in options["phase"]))
    if options["fault"]:
        found = dict.fromkeys(variant for name in options["fault"] for variant in variants_named(name))
        chosen["variants"] = tuple(found)
    return MatrixPlan(designs=designs, seeds=seeds, first=first, seed=seed, **chosen)


def _soak_plan(text: str, seed: int) -> SoakPlan:
    """Return what ``--soak`` says.

    Raises
    ------
    ArgumentError
        No time, or one that is out of range.
    """
    from rtec.units import parse_time_ps

    hours = parse_time_ps(text, name="--soak") / _PS_PER_H
    from rtec.campaign.soak import SoakPlan

    try:
        return SoakPlan(hours=hours, seed=seed)
    except ArgumentError as error:
        raise ArgumentError("--soak", text, "a time from 4 s to 100000 h") from error


def _command(output: Path, soak: str | None, options: dict[str, list[str]], seeds: int, first: int, seed: int) -> str:
    """Return the command line that makes the page again."""
    words = ["rtec", "safety", "-o", output.name if output.is_absolute() else output.as_posix()]
    words += [] if soak is None else ["--soak", soak]
    for option_name, values in options.items():
        for value in values:
            words += [f"--{option_name}", value]
    words += [] if seeds == 3 else ["--seeds", str(seeds)]
    words += [] if first == 0 else ["--first", str(first)]
    words += [] if seed == 1 else ["--seed", str(seed)]
    return shlex.join(words)


def _write(case: SafetyCase, output: Path, picture: Path, command: str) -> None:
    """Write page and picture.

    Raises
    ------
    OutputError
        One of them cannot be written.
    """
    from rtec.campaign.safety_document import document
    from rtec.report.figures_safety import write_safety_figure

    write_safety_figure(case.matrix, picture)
    write_text(output, document(case, command=command, picture=picture.name))
