"""``rtec check``: any insertion algorithm held to the contract of a corrector."""

from __future__ import annotations

import shlex
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rtec.cli import _console, _measured
from rtec.cli._check_options import Options
from rtec.cli._kinds import Clock, Design, Microcontroller, Processor, RealEdges, States, Stream
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
    said,
    share,
    time_ps,
    whole,
    word,
    written,
)
from rtec.cli._words import PROCESSORS, completing, files_ending
from rtec.io import FIGURES
from rtec.units import FREQUENCY, SWEEP

if TYPE_CHECKING:
    from rtec.cli._check_algorithm import Chosen
    from rtec.conformance.results import Verdict
    from rtec.conformance.trials import Run

_CONTRACT, _DOOR, _OUTPUT = "The contract", "What runs it", "Output"


def _algorithms(incomplete: str) -> list[str]:
    files = files_ending(".py", ".v", ".sv", ".ihx", ".hex")
    return [*completing(("original", "a", "b", "c"))(incomplete), *files(incomplete)]


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


def check(
    context: typer.Context,
    algorithm: Annotated[
        str,
        typer.Argument(
            metavar="ALGORITHM",
            autocompletion=_algorithms,
            help="file.py:Name, top.v, image.ihx, or original, a, b, c for a design of rtec.",
            show_default=False,
        ),
    ],
    design: Annotated[Design | None, design("Takes step and states from a known design.", panel=_CONTRACT)] = None,
    step_counts: Annotated[int | None, whole("--step", "Counts of one step.", low=1, panel=_CONTRACT)] = None,
    states: Annotated[
        States | None,
        named(
            "--states",
            "rtec.conformance.contract:states_of",
            "00|00,11|all",
            "Levels of A and B in which it inserts at rest; all.",
            panel=_CONTRACT,
        ),
    ] = None,
    frequency_hz: Annotated[
        float | None,
        quantity("--frequency", FREQUENCY, "500kHz", "Up to here every count is right; 500 kHz.", panel=_CONTRACT),
    ] = None,
    acceleration_hz_s: Annotated[
        float | None,
        quantity("--acceleration", SWEEP, "'100 MHz/s'", "Of that frequency; 100 MHz/s.", panel=_CONTRACT),
    ] = None,
    jitter: Annotated[
        float | None, share("--jitter", "10%", "Of the distance of two edges there; 10%.", panel=_CONTRACT)
    ] = None,
    separation_ps: Annotated[
        int | None, time_ps("--separation", "60ns", "Between changes at the controller; 60 ns.", panel=_CONTRACT)
    ] = None,
    delay_ps: Annotated[
        int | None,
        time_ps(
            "--delay", "50us", "For so long a count may be wrong; 50 us, of firmware five readings.", panel=_CONTRACT
        ),
    ] = None,
    clock_ps: Annotated[
        Clock | None,
        named(
            "--clock",
            "rtec.conformance.verilog:clock_of",
            "50MHz",
            "Verilog's clock; a Python class then sees ticks only.",
            panel=_DOOR,
        ),
    ] = None,
    pins: Annotated[Path | None, option("--pins", "P.toml", "Which port of the module is what.", panel=_DOOR)] = None,
    simulator: Annotated[
        str | None,
        option("--simulator", "verilator|icarus", "For Verilog; the first that is installed.", panel=_DOOR),
    ] = None,
    processor: Annotated[
        Microcontroller | None, processor(f"For machine code: {', '.join(PROCESSORS)}.", panel=_DOOR)
    ] = None,
    part: Annotated[str | None, word("--part", "8051|8052", "For machine code.", panel=_DOOR)] = None,
    hold_latch: Annotated[
        bool | None,
        flag(
            "--hold-latch/--no-hold-latch",
            "Machine code: P1.7 works a latch that holds real edges back; it does if not said.",
            panel=_DOOR,
            show_default=False,
        ),
    ] = None,
    timing: Annotated[
        Processor | None,
        member(
            "--timing", "rtec.injector:Processor", "8051|fast", "What works in a design of rtec; fast.", panel=_DOOR
        ),
    ] = None,
    real_edges: Annotated[
        RealEdges | None,
        member(
            "--real-edges",
            "rtec.injector:RealEdges",
            "hold|merge",
            "What a design of rtec does with them; hold.",
            panel=_DOOR,
        ),
    ] = None,
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
    figure: Annotated[
        Path | None,
        written(
            "--figure",
            "FILE.png",
            "Draw the worst case, or the stream that was played.",
            endings=FIGURES,
            panel=_OUTPUT,
        ),
    ] = None,
    margin_figure: Annotated[
        Path | None,
        written(
            "--margin-figure", "FILE.png", "Draw what it does at which frequency.", endings=FIGURES, panel=_OUTPUT
        ),
    ] = None,
    vcd: Annotated[Path | None, written("--vcd", "FILE.vcd", "The same as waveforms.", panel=_OUTPUT)] = None,
    force: Annotated[bool, force("Write over files that exist.", panel=_OUTPUT)] = False,
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

    options = Options(
        algorithm=algorithm, design=design, step_counts=step_counts, states=states, frequency_hz=frequency_hz,
        acceleration_hz_s=acceleration_hz_s, jitter=jitter, separation_ps=separation_ps, delay_ps=delay_ps,
        clock_ps=clock_ps, pins=pins, simulator=simulator, processor=processor, part=part, hold_latch=hold_latch,
        timing=timing, real_edges=real_edges,
    )  # fmt: skip
    words = said(context, *(name for name in Options.__dataclass_fields__ if name != "algorithm"))
    files = _Files(figure=figure, vcd=vcd, margin=margin_figure, json=json)
    if stream is not None and margin_figure is not None:
        raise apart("--margin-figure", "--stream", "one stream has no margin")
    if stream is not None and motion is not None:
        raise apart("--motion", "--stream", "a stream has its own motion")
    chosen = choose(options)
    with closing(chosen.algorithm):
        if stream is not None:
            passed = _play(words, chosen, stream, files)
        else:
            passed = _hold(words, chosen, motion, tries, seed, files)
    if not passed:
        raise typer.Exit(1)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Files:
    """What is to be written, and whether the result is a JSON document."""

    figure: Path | None
    vcd: Path | None
    margin: Path | None
    json: bool


def _hold(words: list[str], chosen: Chosen, motion: AskedMotion | None, tries: int, seed: int, files: _Files) -> bool:
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
    made = _write(verdict.worst, verdict.algorithm, files) | _write_margin(verdict, files.margin)
    if files.json:
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


def _play(words: list[str], chosen: Chosen, stream: Stream, files: _Files) -> bool:
    from rtec.conformance.trials import Case, Trials

    must_finish = stream.final_state in chosen.contract.states
    run = Trials(chosen.algorithm, chosen.contract).one(
        Case(title="the stream", stream=stream, must_finish=must_finish)
    )
    violation = run.judgement.violation
    reason = "every count right" if violation is None else str(violation)
    made = _write(run, chosen.algorithm.name, files)
    if files.json:
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
            from rtec.conformance.waves import write_run

            write_run(run, file)
        made[kind] = str(file)
    return made
