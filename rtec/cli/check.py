"""``rtec check``: any insertion algorithm held to the contract of a corrector."""

from __future__ import annotations

import shlex
from contextlib import closing
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _console, _measured
from rtec.cli._capture import CaptureOptions
from rtec.cli._groups import OptionGroup
from rtec.cli._motion import AskedMotion, motion
from rtec.cli._parameters import (
    apart,
    design,
    flag,
    force,
    member,
    named,
    option,
    processor,
    quantity,
    share,
    time_ps,
    whole,
    word,
    written,
)
from rtec.cli._verb import said
from rtec.cli._words import PROCESSORS, completing, files_ending
from rtec.io import FIGURES
from rtec.units import FREQUENCY, SWEEP

if TYPE_CHECKING:
    from rtec.board import Microcontroller
    from rtec.cli._check_algorithm import Chosen
    from rtec.injector import Design, Processor, RealEdges
    from rtec.signal.captures import Capture
    from rtec.verify.contract.results import Verdict
    from rtec.verify.contract.streams import Stream
    from rtec.verify.contract.trials import Run

    Clock = tuple[int, int]
    """A period in ps as a ratio."""
    States = tuple[int, ...]
    """Angle states 0 to 3."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ContractOptions(OptionGroup):
    """What is asked of an algorithm; None where nothing was said."""

    PANEL = "The contract"

    design: Design | None = design("Takes step and states from a known design.")
    step_counts: int | None = whole("--step", "Counts of one step.", low=1)
    states: States | None = named(
        "--states",
        "rtec.verify.contract.contract:states_of",
        "00|00,11|all",
        "Levels of A and B in which it inserts at rest; all.",
    )
    frequency_hz: float | None = quantity(
        "--frequency", FREQUENCY, "500kHz", "Up to here every count is right; 500 kHz."
    )
    acceleration_hz_s: float | None = quantity(
        "--acceleration", SWEEP, "'100 MHz/s'", "Of that frequency; 100 MHz/s."
    )
    jitter: float | None = share("--jitter", "10%", "Of the distance of two edges there; 10%.")
    separation_ps: int | None = time_ps("--separation", "60ns", "Between changes at the controller; 60 ns.")
    delay_ps: int | None = time_ps(
        "--delay", "50us", "For so long a count may be wrong; 50 us, of firmware five readings."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class RunnerOptions(OptionGroup):
    """What runs an algorithm; None where nothing was said."""

    PANEL = "What runs it"

    clock_ps: Clock | None = named(
        "--clock",
        "rtec.verify.contract.verilog:clock_of",
        "50MHz",
        "Verilog's clock; a Python class then sees ticks only.",
    )
    pins: Path | None = option("--pins", "P.toml", "Which port of the module is what.")
    processor: Microcontroller | None = processor(f"For machine code: {', '.join(PROCESSORS)}.")
    part: str | None = word("--part", "8051|8052", "For machine code.")
    hold_latch: bool | None = flag(
        "--hold-latch/--no-hold-latch",
        "Machine code: P1.7 works a latch that holds real edges back; it does if not said.",
        show_default=False,
        default=None,
    )
    timing: Processor | None = member(
        "--timing", "rtec.injector:Processor", "8051|fast", "What works in a design of rtec; fast."
    )
    real_edges: RealEdges | None = member(
        "--real-edges", "rtec.injector:RealEdges", "hold|merge", "What a design of rtec does with them; hold."
    )


def _algorithms(incomplete: str) -> list[str]:
    files = files_ending(".py", ".v", ".sv", ".ihx", ".hex")
    return [*completing(("original", "a", "b", "c"))(incomplete), *files(incomplete)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Options(OptionGroup):
    """An algorithm, and what was said of it."""

    algorithm: str = typer.Argument(
        ...,
        metavar="ALGORITHM",
        autocompletion=_algorithms,
        help="file.py:Name, top.v, image.ihx, or original, a, b, c for a design of rtec.",
        show_default=False,
    )
    contract: ContractOptions
    runner: RunnerOptions


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

    figure: Path | None = written(
        "--figure", "FILE.png", "Draw the worst case, or the stream that was played.", endings=FIGURES
    )
    margin_figure: Path | None = written(
        "--margin-figure", "FILE.png", "Draw what it does at which frequency.", endings=FIGURES
    )
    vcd: Path | None = written("--vcd", "FILE.vcd", "The same as waveforms.")
    force: bool = force("Write over files that exist.")


def check(
    context: typer.Context,
    options: Options,
    *,
    motion: AskedMotion | None = motion("One more check, a step at each phase"),
    tries: int = whole("--tries", "Streams of the hunt.", low=16, high=10_000_000, default=3000),
    seed: int = whole("--seed", "Of the hunt and the adversary.", low=0, default=0),
    stream: Stream | None = named(
        "--stream",
        "rtec.verify.contract.streams:Stream.given",
        "TEXT|FILE",
        "Play one stream only, as a failed check prints it.",
    ),
    exhaustive: bool | None = flag(
        "--exhaustive",
        "Search all reachable states instead (a design, or a Python class that says its state).",
        default=None,
    ),
    captured: CaptureOptions,
    files: _Files,
    json: bool = _measured.JSON,
) -> None:
    """Hold any insertion algorithm to the contract of a corrector, and hunt for the stream that breaks it.

    The right counts reach the controller at every speed, in every state, both ways, through reversals, at rest and
    under jitter. Exits with 1 where a check fails. What an algorithm is stands in docs/algorithm.md.

    Example: rtec check mine.py:MyDesign --design c --figure worst.png
    Example: rtec check top.v --step 2 --states all --clock 50MHz --vcd worst.vcd
    Example: rtec check a --capture scope.csv --a CH0 --b CH1
    """
    from rtec.cli._check_algorithm import choose

    words = said(context, *(item.name for group in (ContractOptions, RunnerOptions) for item in fields(group)))
    if stream is not None and files.margin_figure is not None:
        raise apart("--margin-figure", "--stream", "one stream has no margin")
    if stream is not None and motion is not None:
        raise apart("--motion", "--stream", "a stream has its own motion")
    capture = captured.read()
    if stream is not None and capture is not None:
        raise apart("--capture", "--stream", "one stream is played")
    if exhaustive and any(each is not None for each in (stream, motion, capture, files.margin_figure)):
        others = "--stream, --motion, --capture and --margin-figure"
        raise apart("--exhaustive", others, "it takes all streams at once")
    chosen = choose(options)
    with closing(chosen.algorithm):
        if exhaustive:
            passed = _exhaust(words, chosen, files, as_json=json)
        elif stream is not None:
            passed = _play(words, chosen, stream, files, as_json=json)
        else:
            source = said(context, *(item.name for item in fields(CaptureOptions)))
            passed = _hold(words, chosen, motion, capture, source, tries, seed, files, as_json=json)
    if not passed:
        raise typer.Exit(1)


def _hold(
    words: list[str],
    chosen: Chosen,
    motion: AskedMotion | None,
    capture: Capture | None,
    source: list[str],
    tries: int,
    seed: int,
    files: _Files,
    *,
    as_json: bool,
) -> bool:
    """Hold the algorithm to its contract; return whether it passes."""
    from rtec.report.terminal_check import show
    from rtec.verify.contract.captured import captured_cases, captured_stream
    from rtec.verify.contract.motions import motion_cases
    from rtec.verify.contract.streams import why_it_cannot_be
    from rtec.verify.contract.suite import check_algorithm

    more = None if motion is None else motion_cases(motion.kind, program=motion.program, seed=seed)
    recorded = None if capture is None else captured_stream(capture)
    beyond = "" if recorded is None else why_it_cannot_be(recorded, chosen.contract)
    if beyond:
        _console.note(f"the capture goes beyond the contract, and is judged all the same: {beyond}")
    with _console.progress("check", lines="") as progress:
        verdict = check_algorithm(
            chosen.algorithm, chosen.contract, tries=tries, seed=seed, more=more, progress=progress,
            captured=None if recorded is None else captured_cases(recorded),
        )  # fmt: skip
    worst = None if verdict.worst is None else again(chosen.word, words, verdict.worst.case.stream)
    if verdict.worst is not None and why_it_cannot_be(verdict.worst.case.stream, chosen.contract):
        # --stream takes nothing that goes beyond the contract, a capture does
        worst = shlex.join(["rtec", "check", chosen.word, *words, *source])
    made = _write(verdict.worst, verdict.algorithm, files) | _write_margin(verdict, files.margin_figure)
    if as_json:
        beside = {} if recorded is None else {"capture_beyond_contract": beyond or None}
        _console.print_json(verdict.to_dict() | {"worst_case": worst, "note": chosen.note()} | beside | made)
    else:
        show(verdict, worst, chosen.note())
        for name, file in made.items():
            typer.echo(f"{name}: {file}")
    return verdict.passed


def _exhaust(words: list[str], chosen: Chosen, files: _Files, *, as_json: bool) -> bool:
    """Search all states of the algorithm; return whether it is proved to keep its contract."""
    from rtec.verify.contract.exhaustive.prove import MOST_STATES, prove

    with _console.progress("states") as progress:
        found = prove(chosen.algorithm, chosen.contract, progress=lambda states: progress(states / MOST_STATES))
    worst = None if found.worst is None else again(chosen.word, words, found.worst.case.stream)
    made = _write(found.worst, chosen.algorithm.name, files)
    if as_json:
        _console.print_json(found.to_dict() | {"worst_case": worst} | made)
        return found.passed
    typer.echo(f"{found.algorithm}: {found.reason}")
    for line in found.assumptions:
        typer.echo(f"  assumed: {line}")
    if worst is not None:
        typer.echo(f"again: {worst}")
    for name, file in made.items():
        typer.echo(f"{name}: {file}")
    return found.passed


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
    from rtec.errors import ArgumentError
    from rtec.verify.contract.streams import why_it_cannot_be
    from rtec.verify.contract.trials import Case, Trials

    if why := why_it_cannot_be(stream, chosen.contract):
        allowed = "one that it can send, or another --frequency, --jitter or --acceleration"
        raise ArgumentError("--stream", "", allowed, problem=f"is nothing that an encoder sends: {why}")
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
            from rtec.verify.contract.trials import write_run

            write_run(run, file)
        made[kind] = str(file)
    return made
