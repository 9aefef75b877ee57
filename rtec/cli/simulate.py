"""``rtec simulate``: the open signal path, at constant speed or in another motion."""

from __future__ import annotations

import dataclasses
import re
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtec.cli import _console
from rtec.cli._arguments import choice, counts, member, option, share, what_works, whole
from rtec.cli._motion import DEFAULT_ACCELERATION, MOTION_NAMES, read_motion
from rtec.cli._simulate_files import Seen
from rtec.errors import ArgumentError
from rtec.units import ANGLE, FREQUENCY, parse_quantity, parse_time_ps

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rtec.axis import Program
    from rtec.machine import OpenPath

_BOX, _ENCODER, _CONTROLLER, _OUTPUT = "The box", "The encoder", "The controller's input", "Output"

_OPTIONS = {
    "frequency": "--frequency",
    "poll_ps": "--poll",
    "poll_offset_ps": "--poll-offset",
    "decide_ps": "--decide",
    "step_ps": "--step",
    "recover_ps": "--recover",
    "latency_ps": "--latency",
    "rest_ps": "--rest",
    "gate_margin": "--gate-margin",
    "phase_error_deg": "--phase-error",
    "phase_error_deg with duty errors": "--phase-error with --duty-a and --duty-b",
    "duty_error_a": "--duty-a",
    "duty_error_b": "--duty-b",
    "eccentricity_counts": "--eccentricity",
    "eccentricity_deg": "--eccentricity-phase",
    "counts_per_rev": "--counts-per-rev",
    "jitter": "--jitter",
    "seed": "--seed",
    "home_state": "--home-state",
    "filter_samples": "--filter-samples",
    "counter_bits": "--counter-bits",
    "jitter_ps": "--jitter",
    "glitch_probability": "--glitch-probability",
    "glitch_ps": "--glitch-width",
    "cycles": "--cycles",
    "acceleration": "--acceleration",
    "max_acceleration_mm_s2": "--acceleration",
    "corrections": "--corrections",
    "clock_hz": "--filter-clock",
    "design": "--design",
}
"""The option behind each parameter that a face can refuse."""
_PARAMETER = re.compile(r"\b[a-z]+(?:_[a-z]+)+\b")


def _option(name: str, panel: str | None, metavar: str, text: str) -> Any:
    return option(name, metavar=metavar, help=text, rich_help_panel=panel)


@contextmanager
def _named_as_options() -> Iterator[None]:
    """Name a refused parameter as the option that the user wrote."""
    try:
        yield
    except ArgumentError as error:
        name = _OPTIONS.get(error.name, error.name)
        allowed, hint = (
            _PARAMETER.sub(lambda m: _OPTIONS.get(m[0], m[0]), text) for text in (error.allowed, error.hint)
        )
        raise ArgumentError(name, error.value, allowed, hint) from error


def simulate(
    design: Annotated[str, _option("--design", None, "original|a|b|c", "Insertion design.")],
    frequency: Annotated[
        str, _option("--frequency", None, "500kHz", "Of the encoder's A (or B) square wave; of a motion the highest.")
    ],
    corrections: Annotated[str, _option("--corrections", None, "N", "Steps asked for.")],
    cycles: Annotated[
        str | None, _option("--cycles", None, "N", "Travel there and back; a cycle is four counts.")
    ] = None,
    motion: Annotated[
        str, _option("--motion", None, "MOTION", f"While corrections are asked for: {MOTION_NAMES}.")
    ] = "steady",
    acceleration: Annotated[
        str, _option("--acceleration", None, "'100 MHz/s'", "Of the frequency, at most; not for steady.")
    ] = DEFAULT_ACCELERATION,
    timing: Annotated[str, _option("--timing", None, "8051|fast|firmware", "What works in the box.")] = "fast",
    direction: Annotated[str, _option("--direction", None, "+|-", "Of the motion.")] = "+",
    sign: Annotated[str, _option("--sign", None, "+|-", "- takes counts away instead of adding them.")] = "+",
    seed: Annotated[str, _option("--seed", None, "N", "Of jitter, glitches and the adversary.")] = "0",
    poll: Annotated[str | None, _option("--poll", _BOX, "TIME", "Interval of its looks at the lines.")] = None,
    poll_offset: Annotated[str | None, _option("--poll-offset", _BOX, "TIME", "Time of one of them.")] = None,
    decide: Annotated[str | None, _option("--decide", _BOX, "TIME", "From the look to the first change.")] = None,
    step: Annotated[str | None, _option("--step", _BOX, "TIME", "Between changes of one insertion.")] = None,
    recover: Annotated[str | None, _option("--recover", _BOX, "TIME", "After the last change.")] = None,
    latency: Annotated[str | None, _option("--latency", _BOX, "TIME", "Design B: from input to output.")] = None,
    rest: Annotated[str | None, _option("--rest", _BOX, "TIME", "Without an edge so long, the axis rests.")] = None,
    gate_margin: Annotated[str | None, _option("--gate-margin", _BOX, "15%", "Reserve of the speed gate.")] = None,
    no_gate: Annotated[bool, typer.Option("--no-gate", help="No speed gate.", rich_help_panel=_BOX)] = False,
    real_edges: Annotated[
        str, _option("--real-edges", _BOX, "hold|merge", "A real edge inside an insertion waits, or merges with it.")
    ] = "hold",
    phase_error: Annotated[str, _option("--phase-error", _ENCODER, "10deg", "B lags A by 90deg plus this.")] = "0deg",
    duty_a: Annotated[str, _option("--duty-a", _ENCODER, "2%", "A is high longer by this share of a cycle.")] = "0%",
    duty_b: Annotated[str, _option("--duty-b", _ENCODER, "2%", "B is high longer by this share of a cycle.")] = "0%",
    jitter: Annotated[str, _option("--jitter", _ENCODER, "5ns", "Bound of the edges' jitter, triangular.")] = "0ns",
    counts_per_rev: Annotated[str, _option("--counts-per-rev", _ENCODER, "N", "Rotary encoder; 0: a scale.")] = "0",
    eccentricity: Annotated[
        str, _option("--eccentricity", _ENCODER, "'2 count'", "Amplitude of the once-per-revolution error.")
    ] = "0 count",
    eccentricity_phase: Annotated[
        str, _option("--eccentricity-phase", _ENCODER, "90deg", "Its phase at count 0.")
    ] = "0deg",
    glitch_probability: Annotated[
        str, _option("--glitch-probability", _ENCODER, "0.1%", "That a glitch follows an edge.")
    ] = "0%",
    glitch_width: Annotated[str, _option("--glitch-width", _ENCODER, "20ns", "Width of a glitch.")] = "20ns",
    home_state: Annotated[
        str, _option("--home-state", _ENCODER, "0..3", "Angle state at the start: 00, 10, 11, 01.")
    ] = "0",
    filter_samples: Annotated[
        str, _option("--filter-samples", _CONTROLLER, "N", "Ticks that must see a level; 0: no filter.")
    ] = "3",
    filter_clock: Annotated[str, _option("--filter-clock", _CONTROLLER, "50MHz", "Clock of the filter.")] = "50MHz",
    multiplication: Annotated[
        str, _option("--multiplication", _CONTROLLER, "1|2|4", "Counts made of one encoder cycle.")
    ] = "4",
    policy: Annotated[
        str, _option("--policy", _CONTROLLER, "ignore|fault|guess", "What an illegal transition does.")
    ] = "ignore",
    counter_bits: Annotated[
        str, _option("--counter-bits", _CONTROLLER, "N", "Width of the counter; 0: never wraps.")
    ] = "32",
    figure: Annotated[
        Path | None,
        _option("--figure", _OUTPUT, "FILE.png", "Draw an insertion, before and after: .png, .svg, .pdf."),
    ] = None,
    figure_state: Annotated[
        str | None,
        _option("--figure-state", _OUTPUT, "00|10|11|01", "A and B when it begins; the first insertion without it."),
    ] = None,
    vcd: Annotated[
        Path | None, _option("--vcd", _OUTPUT, "FILE.vcd", "Write both sides of the box as waveforms.")
    ] = None,
    force: Annotated[
        bool,
        typer.Option("--force", help="Overwrite files; write a VCD above 1 GB.", rich_help_panel=_OUTPUT),
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON document on stdout, nothing else.", rich_help_panel=_OUTPUT)
    ] = False,
) -> None:
    """Send an encoder's edges through the box into the controller, compare the counts, and draw an insertion.

    Exits with 1 where corrections are left over, a transition is illegal or a count is wrong. Times, frequencies and
    angles carry their units. What is not given of the box is that of the --timing: 8051 is the report's words; with
    firmware the design's program runs on a 12 MHz 8051, instruction by instruction. A --motion other than steady ends
    at rest, where the box makes what it still owes; reversal and adversary aim a crossing of a line into each
    insertion. A G-code file has a length of its own: no --cycles; its fastest feed runs at the --frequency.

    Example: rtec simulate --design c --frequency 500kHz --cycles 100000 --corrections 4000 --jitter 5ns
    Example: rtec simulate --design original --frequency 20kHz --cycles 1e3 --corrections 9 --figure insertion.png
    Example: rtec simulate --design a --frequency 100kHz --cycles 1000 --corrections 5 --motion reversal --vcd f.vcd
    """
    from rtec.axis import Encoder, Imperfections
    from rtec.axis.motion import MotionKind
    from rtec.controller import IllegalPolicy, Multiplication, ReceiverSettings
    from rtec.injector import Design, InjectorSettings, RealEdges, Timing
    from rtec.machine import OpenPath, set_in_motion

    with _named_as_options():
        kind, program, gain = read_motion(motion, acceleration)
        if kind is MotionKind.STEADY and acceleration != DEFAULT_ACCELERATION:
            raise ArgumentError("--acceleration", acceleration, "nothing with --motion steady")
        insertion = Design.named(design)
        processor, microcontroller = what_works(timing)
        if microcontroller is not None:
            own = {"--poll": poll, "--poll-offset": poll_offset, "--decide": decide, "--step": step, "--rest": rest,
                   "--recover": recover, "--latency": latency, "--gate-margin": gate_margin}  # fmt: skip
            _refuse_times(own, no_gate)
        profile = Timing.of(insertion, processor)
        box = InjectorSettings(
            design=insertion,
            timing=dataclasses.replace(
                profile,
                poll_ps=_time(poll, profile.poll_ps, "--poll"),
                poll_offset_ps=_time(poll_offset, profile.poll_offset_ps, "--poll-offset"),
                decide_ps=_time(decide, profile.decide_ps, "--decide"),
                step_ps=_time(step, profile.step_ps, "--step"),
                recover_ps=_time(recover, profile.recover_ps, "--recover"),
                latency_ps=_time(latency, profile.latency_ps, "--latency"),
                rest_ps=_time(rest, profile.rest_ps, "--rest"),
                gate_margin=_margin(gate_margin, profile.gate_margin, no_gate),
            ),
            real_edges=member(real_edges, RealEdges, name="--real-edges"),
        )
        flaws = Imperfections(
            phase_error_deg=parse_quantity(phase_error, ANGLE, name="--phase-error"),
            duty_error_a=share(duty_a, name="--duty-a"),
            duty_error_b=share(duty_b, name="--duty-b"),
            eccentricity_counts=counts(eccentricity, name="--eccentricity"),
            eccentricity_deg=parse_quantity(eccentricity_phase, ANGLE, name="--eccentricity-phase"),
            jitter_ps=parse_time_ps(jitter, name="--jitter"),
            glitch_probability=share(glitch_probability, name="--glitch-probability"),
            glitch_ps=parse_time_ps(glitch_width, name="--glitch-width"),
        )
        encoder = Encoder(
            counts_per_rev=whole(counts_per_rev, name="--counts-per-rev"),
            home_state=whole(home_state, name="--home-state"),
            seed=whole(seed, name="--seed"),
            imperfections=flaws,
        )
        receiver = ReceiverSettings(
            filter_samples=whole(filter_samples, name="--filter-samples"),
            clock_hz=_hertz(filter_clock, "--filter-clock"),
            multiplication=member(multiplication, Multiplication, name="--multiplication"),
            policy=member(policy, IllegalPolicy, name="--policy"),
            counter_bits=whole(counter_bits, name="--counter-bits"),
        )
        hertz = parse_quantity(frequency, FREQUENCY, name="--frequency")
        path = OpenPath(
            injector=box,
            encoder=encoder,
            receiver=receiver,
            frequency_hz=hertz,
            cycles=_cycles(cycles, program, hertz),
            corrections=_sign(sign, "--sign") * _steps(corrections, "--corrections"),
            direction=_sign(direction, "--direction"),
            microcontroller=microcontroller,
        )
        whole_path = set_in_motion(path, kind, program=program, acceleration_hz_s=gain, seed=encoder.seed)
        state = _state(figure_state, figure, path)
        _carry_out(whole_path, Seen(figure=figure, state=state, vcd=vcd, force=force), as_json)


def _cycles(text: str | None, program: Program | None, frequency_hz: float) -> int:
    """Return the length that is asked for, or that of a programme."""
    from rtec.axis.motion import programme_counts

    if program is not None and text is not None:
        raise ArgumentError("--cycles", text, "nothing with a G-code file", "the programme says how far it goes")
    if text is not None:
        return whole(text, name="--cycles")
    if program is None:
        raise ArgumentError("--cycles", None, "the length of the motion, such as 1000")
    return max(round(programme_counts(program, frequency_hz) / 4.0), 1)


def _state(text: str | None, figure: Path | None, path: OpenPath) -> int | None:
    """Return the state 1..4 in which the insertion of the figure begins, None where nothing is said."""
    if text is not None and figure is None:
        raise ArgumentError("--figure-state", text, "beside --figure", "name the file with --figure")
    if figure is not None and path.corrections == 0:
        raise ArgumentError("--figure", figure, "with --corrections above 0", "without a step there is no insertion")
    levels = ["00", "10", "11", "01"]
    return None if text is None else levels.index(choice(text, levels, name="--figure-state")) + 1


def _refuse_times(given: dict[str, str | None], no_gate: bool) -> None:
    """Refuse times of the box where they are the firmware's own."""
    names = [name for name, text in given.items() if text is not None] + (["--no-gate"] if no_gate else [])
    if names:
        hint = "what the program does is timed by its instructions; 8051 and fast can be changed"
        raise ArgumentError(names[0], given.get(names[0]) or "given", "nothing with --timing firmware", hint)


def _time(text: str | None, of_profile_ps: int, name: str) -> int:
    return of_profile_ps if text is None else parse_time_ps(text, name=name)


def _margin(text: str | None, of_profile: float | None, no_gate: bool) -> float | None:
    if no_gate and text is not None:
        raise ArgumentError("--gate-margin", text, "--gate-margin or --no-gate", "leave one of them out")
    if no_gate:
        return None
    return of_profile if text is None else share(text, name="--gate-margin")


def _hertz(text: str, name: str) -> int:
    hertz = parse_quantity(text, FREQUENCY, name=name)
    if hertz != round(hertz):
        raise ArgumentError(name, repr(text), "a whole number of hertz")
    return round(hertz)


def _sign(text: str, name: str) -> int:
    return 1 if choice(text, "+-", name=name) == "+" else -1


def _steps(text: str, name: str) -> int:
    steps = whole(text, name=name)
    if steps < 0:
        raise ArgumentError(name, steps, "a whole number from 0", "counts are taken away with --sign -")
    return steps


def _carry_out(path: OpenPath, seen: Seen, as_json: bool) -> None:
    """Run, show the result and exit with the verdict."""
    from rtec.machine import simulate as run
    from rtec.report.terminal_simulate import show

    seen.check(path)
    to_compile = _console.compilation_ahead()
    path.state()  # a frequency or a jitter that the encoder refuses is said before the compilation is
    if to_compile:
        _console.note(_console.COMPILING)
    with _console.progress(f"design {path.injector.design.key}") as progress:
        result = run(path, vcd=seen.vcd, seen=seen.stretch, progress=progress)
    written = seen.written(path)
    if as_json:
        _console.print_json(result.to_dict() | {"seed": path.encoder.seed} | written)
    else:
        show(path, result)
        for name, file in written.items():
            if file is not None:
                typer.echo(f"{name}: {file}")
    if not result.good:
        raise typer.Exit(1)
