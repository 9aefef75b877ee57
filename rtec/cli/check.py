"""``rtec check``: any insertion algorithm held to the contract of a corrector."""

from __future__ import annotations

import shlex
from contextlib import closing
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rtec.cli import _console, _measured
from rtec.cli._check_options import ContractOptions, Options, RunnerOptions
from rtec.cli._groups import OptionGroup
from rtec.cli._kinds import Stream
from rtec.cli._motion import AskedMotion, motion
from rtec.cli._parameters import apart, force, named, said, whole, written
from rtec.io import FIGURES

if TYPE_CHECKING:
    from rtec.cli._check_algorithm import Chosen
    from rtec.conformance.results import Verdict
    from rtec.conformance.trials import Run


def again(algorithm: str, words: list[str], stream: object) -> str:
    """Return the command that plays a stream to an algorithm under the contract that ``words`` say.

    Examples
    --------
    >>> again("mine.py:Mine", ["--design", "c"], "00 3us:end")
    "rtec check mine.py:Mine --design c --stream '00 3us:end'"
    """
    # a name that begins with a dash would be read as an option
    name = f"./{algorithm}" if algorithm.startswith("-") else algorithm
    return shlex.join(["rtec", "check", name, *words, "--stream", str(stream)])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Files(OptionGroup):
    """Options that name the files to be written."""

    PANEL = "Output"

    figure: Annotated[
        Path | None,
        written("--figure", "FILE.png", "Draw the worst case, or the stream that was played.", endings=FIGURES),
    ] = None
    margin_figure: Annotated[
        Path | None, written("--margin-figure", "FILE.png", "Draw what it does at which frequency.", endings=FIGURES)
    ] = None
    vcd: Annotated[Path | None, written("--vcd", "FILE.vcd", "The same as waveforms.")] = None
    force: Annotated[bool, force("Write over files that exist.")] = False


def check(
    context: typer.Context,
    options: Options,
    *,
    motion: Annotated[AskedMotion | None, motion("One more check, a step at each phase")] = None,
    tries: Annotated[int, whole("--tries", "Streams of the hunt.", low=16, high=10_000_000)] = 3000,
    seed: Annotated[int, whole("--seed", "Of the hunt and the adversary.", low=0)] = 0,
    stream: Annotated[
        Stream | None,
        named(
            "--stream",
            "rtec.conformance.streams:Stream.read",
            "TEXT",
            "Play one stream only, as a failed check prints it.",
        ),
    ] = None,
    files: _Files,
    json: _measured.Json = False,
) -> None:
    """Hold any insertion algorithm to the contract of a corrector, and hunt for the stream that breaks it.

    The right counts reach the controller at every speed, in every state, both ways, through reversals, at rest and
    under jitter. Exits with 1 where a check fails. What an algorithm is stands in docs/algorithm.md.

    Example: rtec check mine.py:MyDesign --design c --figure worst.png
    Example: rtec check top.v --step 2 --states all --clock 50MHz --vcd worst.vcd
    Example: rtec check image.ihx --design original --processor one-clock-25mhz --frequency 100kHz
    """
    from rtec.cli._check_algorithm import choose

    words = said(context, *(item.name for group in (ContractOptions, RunnerOptions) for item in fields(group)))
    if stream is not None and files.margin_figure is not None:
        raise apart("--margin-figure", "--stream", "one stream has no margin")
    if stream is not None and motion is not None:
        raise apart("--motion", "--stream", "a stream has its own motion")
    chosen = choose(options)
    with closing(chosen.algorithm):
        if stream is not None:
            passed = _play(words, chosen, stream, files, as_json=json)
        else:
            passed = _hold(words, chosen, motion, tries, seed, files, as_json=json)
    if not passed:
        raise typer.Exit(1)


def _hold(
    words: list[str],
    chosen: Chosen,
    motion: AskedMotion | None,
    tries: int,
    seed: int,
    files: _Files,
    *,
    as_json: bool,
) -> bool:
    """Hold the algorithm to its contract; return whether it passes."""
    from rtec.conformance.motions import motion_cases
    from rtec.conformance.suite import check_algorithm
    from rtec.report.terminal_check import show

    more = None if motion is None else motion_cases(motion.kind, program=motion.program, seed=seed)
    _console.announce_compilation()
    with _console.progress("check") as progress:
        verdict = check_algorithm(
            chosen.algorithm, chosen.contract, tries=tries, seed=seed, more=more, progress=progress
        )
    worst = None if verdict.worst is None else again(chosen.word, words, verdict.worst.case.stream)
    made = _write(verdict.worst, verdict.algorithm, files) | _write_margin(verdict, files.margin_figure)
    if as_json:
        _console.print_json(verdict.to_dict() | {"worst_case": worst, "note": chosen.note()} | made)
    else:
        show(verdict, worst, chosen.note())
        for name, file in made.items():
            typer.echo(f"{name}: {file}")
    return verdict.passed


def _write_margin(verdict: Verdict, file: Path | None) -> dict[str, str]:
    """Draw how far the algorithm goes where that was asked for; return the file by its name."""
    if file is None:
        return {}
    if verdict.speeds is None:
        _console.note(f"{file} not written: it inserts nothing, so that there is no margin")
        return {}
    from rtec.report.figures_margin import margin_figure
    from rtec.report.figures_style import write_figure

    write_figure(lambda: margin_figure(verdict), file)
    return {"margin_figure": str(file)}


def _play(words: list[str], chosen: Chosen, stream: Stream, files: _Files, *, as_json: bool) -> bool:
    from rtec.conformance.trials import Case, Trials

    must_finish = stream.final_state in chosen.contract.states
    run = Trials(chosen.algorithm, chosen.contract).one(
        Case(title="the stream", stream=stream, must_finish=must_finish)
    )
    violation = run.judgement.violation
    reason = "every count right" if violation is None else str(violation)
    made = _write(run, chosen.algorithm.name, files)
    if as_json:
        seen = {
            "algorithm": chosen.algorithm.name,
            "passed": run.right,
            "checks": [{"name": "stream", "passed": run.right, "reason": reason, "stream": str(stream)}],
            "completed": run.judgement.completed,
            "min_separation_ps": run.judgement.separation_ps,
            "max_delay_ps": run.judgement.delay_ps,
            "worst_case": again(chosen.word, words, stream),
        }
        _console.print_json(seen | made)
    else:
        typer.echo(f"{chosen.algorithm.name}: {'passed' if run.right else 'FAILED'}: {reason}")
        for name, file in made.items():
            typer.echo(f"{name}: {file}")
    return run.right


def _write(run: Run | None, name: str, files: _Files) -> dict[str, str]:
    made: dict[str, str] = {}
    for kind, file in (("figure", files.figure), ("vcd", files.vcd)):
        if file is None:
            continue
        if run is None:
            _console.note(f"{file} not written: no run has come to its end")
            continue
        if kind == "figure":
            from rtec.report.figures_check import case_figure
            from rtec.report.figures_style import write_figure

            write_figure(partial(case_figure, run, name), file)
        else:
            from rtec.conformance.trials import write_run

            write_run(run, file)
        made[kind] = str(file)
    return made
