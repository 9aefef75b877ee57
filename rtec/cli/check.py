"""``rtec check``: any insertion algorithm held to the contract of a corrector."""

from __future__ import annotations

import shlex
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtec.cli import _console, _measured
from rtec.cli._arguments import option, whole_option
from rtec.cli._motion import MOTION_NAMES, read_motion
from rtec.cli._words import PROCESSORS, completing, files_ending
from rtec.errors import ArgumentError
from rtec.io import FIGURES, check_file

if TYPE_CHECKING:
    from rtec.cli._check_door import Chosen
    from rtec.conformance.results import Verdict
    from rtec.conformance.trials import Run

_CONTRACT, _DOOR, _OUTPUT = "The contract", "What runs it", "Output"


def _option(name: str, panel: str | None, metavar: str, text: str) -> Any:
    return option(name, metavar=metavar, help=text, rich_help_panel=panel, show_default=False)


def _algorithms(incomplete: str) -> list[str]:
    """Complete a design or a file."""
    files = files_ending(".py", ".v", ".sv", ".ihx", ".hex")
    return [*completing(("original", "a", "b", "c"))(incomplete), *files(incomplete)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What the user said about an algorithm and its contract, as text; None where nothing was said."""

    algorithm: str
    design: str | None
    step: int | None
    states: str | None
    frequency: str | None
    acceleration: str | None
    jitter: str | None
    separation: str | None
    delay: str | None
    clock: str | None
    pins: Path | None
    simulator: str | None
    processor: str | None
    part: str | None
    hold_latch: bool | None
    timing: str | None
    real_edges: str | None

    def command(self, stream: str) -> str:
        """Return the command that plays a stream to the same algorithm under the same contract."""
        # a name that begins with a dash would be read as an option
        words = ["rtec", "check", f"./{self.algorithm}" if self.algorithm.startswith("-") else self.algorithm]
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            option = "--" + name.replace("_", "-")
            if name == "algorithm" or value is None:
                continue
            if isinstance(value, bool):
                words.append(option if value else f"--no-{option[2:]}")
            else:
                words += [option, str(value)]
        return shlex.join([*words, "--stream", stream])


def check(
    algorithm: Annotated[
        str,
        typer.Argument(
            metavar="ALGORITHM",
            autocompletion=_algorithms,
            help="file.py:Name, top.v, image.ihx, or original, a, b, c for a design of rtec.",
            show_default=False,
        ),
    ],
    design: Annotated[
        str | None, _option("--design", _CONTRACT, "original|a|b|c", "Takes step and states from a known design.")
    ] = None,
    step: Annotated[
        int | None, whole_option("--step", low=1, help="Counts of one step.", rich_help_panel=_CONTRACT)
    ] = None,
    states: Annotated[
        str | None,
        _option("--states", _CONTRACT, "00|00,11|all", "Levels of A and B in which it inserts at rest; all."),
    ] = None,
    frequency: Annotated[
        str | None, _option("--frequency", _CONTRACT, "500kHz", "Up to here every count is right; 500 kHz.")
    ] = None,
    acceleration: Annotated[
        str | None, _option("--acceleration", _CONTRACT, "'100 MHz/s'", "Of that frequency; 100 MHz/s.")
    ] = None,
    jitter: Annotated[
        str | None, _option("--jitter", _CONTRACT, "10%", "Of the distance of two edges there; 10%.")
    ] = None,
    separation: Annotated[
        str | None, _option("--separation", _CONTRACT, "60ns", "Between changes at the controller; 60 ns.")
    ] = None,
    delay: Annotated[
        str | None,
        _option("--delay", _CONTRACT, "50us", "For so long a count may be wrong; 50 us, of firmware five readings."),
    ] = None,
    clock: Annotated[
        str | None, _option("--clock", _DOOR, "50MHz", "Verilog's clock; a Python class then sees ticks only.")
    ] = None,
    pins: Annotated[Path | None, _option("--pins", _DOOR, "P.toml", "Which port of the module is what.")] = None,
    simulator: Annotated[
        str | None, _option("--simulator", _DOOR, "verilator|icarus", "For Verilog; the first that is installed.")
    ] = None,
    processor: Annotated[
        str | None, _option("--processor", _DOOR, "NAME", "For machine code: " + ", ".join(PROCESSORS) + ".")
    ] = None,
    part: Annotated[str | None, _option("--part", _DOOR, "8051|8052", "For machine code.")] = None,
    hold_latch: Annotated[
        bool | None,
        typer.Option(
            "--hold-latch/--no-hold-latch",
            help="Machine code: P1.7 works a latch that holds real edges back; it does if not said.",
            rich_help_panel=_DOOR,
            show_default=False,
        ),
    ] = None,
    timing: Annotated[
        str | None, _option("--timing", _DOOR, "8051|fast", "What works in a design of rtec; fast.")
    ] = None,
    real_edges: Annotated[
        str | None, _option("--real-edges", _DOOR, "hold|merge", "What a design of rtec does with them; hold.")
    ] = None,
    motion: Annotated[
        str | None, _option("--motion", None, "MOTION", f"One more check, a step at each phase: {MOTION_NAMES}.")
    ] = None,
    tries: Annotated[int, whole_option(low=16, high=10_000_000, help="Streams of the hunt.")] = 3000,
    seed: Annotated[int, whole_option(low=0, help="Of the hunt and the adversary.")] = 0,
    stream: Annotated[
        str | None, _option("--stream", None, "TEXT", "Play one stream only, as a failed check prints it.")
    ] = None,
    figure: Annotated[
        Path | None, _option("--figure", _OUTPUT, "FILE.png", "Draw the worst case, or the stream that was played.")
    ] = None,
    margin_figure: Annotated[
        Path | None, _option("--margin-figure", _OUTPUT, "FILE.png", "Draw what it does at which frequency.")
    ] = None,
    vcd: Annotated[Path | None, _option("--vcd", _OUTPUT, "FILE.vcd", "The same as waveforms.")] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Write over files that exist.", rich_help_panel=_OUTPUT)
    ] = False,
    json: _measured.Json = False,
) -> None:
    """Hold any insertion algorithm to the contract of a corrector, and hunt for the stream that breaks it.

    The right counts reach the controller at every speed, in every state, both ways, through reversals, at rest and
    under jitter. Exits with 1 where a check fails. What an algorithm is stands in docs/algorithm.md.

    Example: rtec check mine.py:MyDesign --design c --figure worst.png
    Example: rtec check top.v --step 2 --states all --clock 50MHz --vcd worst.vcd
    Example: rtec check image.ihx --design original --processor one-clock-25mhz --frequency 100kHz
    """
    from rtec.cli._check_door import choose

    for name, picture in (("--figure", figure), ("--margin-figure", margin_figure)):
        if picture is not None:
            check_file(name, picture, force=force, endings=FIGURES)
    if vcd is not None:
        check_file("--vcd", vcd, force=force)
    options = Options(
        algorithm=algorithm, design=design, step=step, states=states, frequency=frequency, acceleration=acceleration,
        jitter=jitter, separation=separation, delay=delay, clock=clock, pins=pins, simulator=simulator,
        processor=processor, part=part, hold_latch=hold_latch, timing=timing, real_edges=real_edges,
    )  # fmt: skip
    if margin_figure is not None and stream is not None:
        raise ArgumentError(
            "--margin-figure", str(margin_figure), "nothing with --stream", "one stream has no margin"
        )
    more = None if motion is None else _more(motion, stream, seed)
    with ExitStack() as stack:
        played = None if stream is None else _read(stream)
        chosen = choose(options)
        stack.enter_context(closing(chosen.algorithm))
        if played is not None:
            passed = _play(options, chosen, played, figure, vcd, json)
        else:
            passed = _hold(options, chosen, more, tries, seed, figure, vcd, json, margin_figure)
    if not passed:
        raise typer.Exit(1)


def _more(motion: str, stream: str | None, seed: int) -> Any:
    """Return what makes the cases of a motion."""
    from rtec.conformance.motions import motion_cases

    if stream is not None:
        raise ArgumentError("--motion", motion, "nothing with --stream", "a stream has its own motion")
    kind, program, _ = read_motion(motion)
    return motion_cases(kind, program=program, seed=seed)


def _read(text: str) -> Any:
    from rtec.conformance.streams import Stream

    try:
        return Stream.read(text)
    except ArgumentError as error:
        raise ArgumentError("--stream", error.value, error.allowed, error.hint) from error


def _hold(
    options: Options,
    chosen: Chosen,
    more: Any,
    tries: int,
    seed: int,
    figure: Path | None,
    vcd: Path | None,
    json: bool,
    margin_figure: Path | None = None,
) -> bool:
    """Hold the algorithm to its contract; return whether it passes."""
    from rtec.conformance.suite import check_algorithm
    from rtec.report.terminal_check import show

    _console.announce_compilation()
    with _console.progress("check") as progress:
        verdict = check_algorithm(
            chosen.algorithm, chosen.contract, tries=tries, seed=seed, more=more, progress=progress
        )
    worst = None if verdict.worst is None else options.command(str(verdict.worst.case.stream))
    written = _write(verdict.worst, verdict.algorithm, figure, vcd) | _write_margin(verdict, margin_figure)
    if json:
        _console.print_json(verdict.to_dict() | {"worst_case": worst, "note": chosen.note()} | written)
    else:
        show(verdict, worst, chosen.note())
        for name, file in written.items():
            typer.echo(f"{name}: {file}")
    return verdict.passed


def _write_margin(verdict: Verdict, file: Path | None) -> dict[str, str]:
    """Draw how far the algorithm goes where that was asked for; return the file by its name."""
    if file is None:
        return {}
    if verdict.speeds is None:
        _console.note(f"{file} not written: it inserts nothing, so that there is no margin")
        return {}
    from rtec.report.figures_margin import write_margin_figure

    write_margin_figure(verdict, file)
    return {"margin_figure": str(file)}


def _play(options: Options, chosen: Chosen, stream: Any, figure: Path | None, vcd: Path | None, json: bool) -> bool:
    """Play one stream; return whether every count is right."""
    from rtec.conformance.trials import Case, Trials

    must_finish = stream.final_state in chosen.contract.states
    run = Trials(chosen.algorithm, chosen.contract).one(
        Case(title="the stream", stream=stream, must_finish=must_finish)
    )
    violation = run.judgement.violation
    reason = "every count right" if violation is None else str(violation)
    written = _write(run, chosen.algorithm.name, figure, vcd)
    if json:
        seen = {
            "algorithm": chosen.algorithm.name,
            "passed": run.right,
            "checks": [{"name": "stream", "passed": run.right, "reason": reason, "stream": str(stream)}],
            "completed": run.judgement.completed,
            "min_separation_ps": run.judgement.separation_ps,
            "max_delay_ps": run.judgement.delay_ps,
            "worst_case": options.command(str(stream)),
        }
        _console.print_json(seen | written)
    else:
        typer.echo(f"{chosen.algorithm.name}: {'passed' if run.right else 'FAILED'}: {reason}")
        for name, file in written.items():
            typer.echo(f"{name}: {file}")
    return run.right


def _write(run: Run | None, name: str, figure: Path | None, vcd: Path | None) -> dict[str, str]:
    """Write the files that were asked for; return them by their names."""
    written: dict[str, str] = {}
    for kind, file in (("figure", figure), ("vcd", vcd)):
        if file is None:
            continue
        if run is None:
            _console.note(f"{file} not written: no run has come to its end")
            continue
        if kind == "figure":
            from rtec.report.figures_check import write_case_figure

            write_case_figure(run, name, file)
        else:
            from rtec.conformance.waves import write_run

            write_run(run, file)
        written[kind] = str(file)
    return written
