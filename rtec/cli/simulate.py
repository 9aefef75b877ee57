"""``rtec simulate``: the open signal path, at constant speed or in another motion."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rtec.cli import _console
from rtec.cli._kinds import Design, IllegalPolicy, Multiplication, RealEdges
from rtec.cli._motion import ACCELERATION, AskedMotion, acceleration, motion
from rtec.cli._parameters import (
    Works,
    apart,
    choice,
    default,
    design,
    flag,
    force,
    member,
    needs,
    option,
    quantity,
    share,
    time_ps,
    whole,
    whole_number,
    works,
    written,
)
from rtec.cli._simulate_files import Seen
from rtec.errors import ArgumentError
from rtec.io import FIGURES
from rtec.units import ANGLE, FREQUENCY, parse_in, parse_quantity

if TYPE_CHECKING:
    from rtec.axis import Program
    from rtec.machine import OpenPath

_BOX, _ENCODER, _CONTROLLER, _OUTPUT = "The box", "The encoder", "The controller's input", "Output"
_LEVELS = ["00", "10", "11", "01"]


def _sign(name: str, text: str) -> Any:
    return option(name, "+|-", text, read=lambda said: 1 if choice(said, "+-", name=name) == "+" else -1)


def _steps(said: str) -> int:
    steps = whole_number(said, name="--corrections")
    if steps < 0:
        raise ArgumentError("--corrections", steps, "0 or more", "counts are taken away with --sign -")
    return steps


def _hertz(said: str) -> int:
    hertz = parse_quantity(said, FREQUENCY, name="--filter-clock")
    if hertz != round(hertz):
        raise ArgumentError("--filter-clock", repr(said), "a whole number of hertz")
    return round(hertz)


def simulate(
    design: Annotated[Design, design("Insertion design.")],
    frequency_hz: Annotated[
        float,
        quantity(
            "--frequency", FREQUENCY, "500kHz", "Of the encoder's A (or B) square wave; of a motion the highest."
        ),
    ],
    corrections: Annotated[int, option("--corrections", "N", "Steps asked for.", read=_steps)],
    cycles: Annotated[int | None, whole("--cycles", "Travel there and back; a cycle is four counts.")] = None,
    motion: Annotated[AskedMotion, motion("While corrections are asked for")] = default("steady"),
    acceleration_hz_s: Annotated[float, acceleration("Of the frequency, at most; not for steady.")] = default(
        ACCELERATION
    ),
    timing: Annotated[Works, works("What works in the box.")] = default("fast"),
    direction: Annotated[int, _sign("--direction", "Of the motion.")] = default("+"),
    sign: Annotated[int, _sign("--sign", "- takes counts away instead of adding them.")] = default("+"),
    seed: Annotated[int, whole("--seed", "Of jitter, glitches and the adversary.")] = 0,
    poll_ps: Annotated[
        int | None, time_ps("--poll", "TIME", "Interval of its looks at the lines.", panel=_BOX)
    ] = None,
    poll_offset_ps: Annotated[
        int | None, time_ps("--poll-offset", "TIME", "Time of one of them.", panel=_BOX)
    ] = None,
    decide_ps: Annotated[
        int | None, time_ps("--decide", "TIME", "From the look to the first change.", panel=_BOX)
    ] = None,
    step_ps: Annotated[int | None, time_ps("--step", "TIME", "Between changes of one insertion.", panel=_BOX)] = None,
    recover_ps: Annotated[int | None, time_ps("--recover", "TIME", "After the last change.", panel=_BOX)] = None,
    latency_ps: Annotated[
        int | None, time_ps("--latency", "TIME", "Design B: from input to output.", panel=_BOX)
    ] = None,
    rest_ps: Annotated[
        int | None, time_ps("--rest", "TIME", "Without an edge so long, the axis rests.", panel=_BOX)
    ] = None,
    gate_margin: Annotated[
        float | None, share("--gate-margin", "15%", "Reserve of the speed gate.", panel=_BOX)
    ] = None,
    no_gate: Annotated[bool, flag("--no-gate", "No speed gate.", panel=_BOX)] = False,
    real_edges: Annotated[
        RealEdges,
        member(
            "--real-edges",
            "rtec.injector:RealEdges",
            "hold|merge",
            "A real edge inside an insertion waits, or merges with it.",
            panel=_BOX,
        ),
    ] = default("hold"),
    phase_error_deg: Annotated[
        float, quantity("--phase-error", ANGLE, "10deg", "B lags A by 90deg plus this.", panel=_ENCODER)
    ] = default("0deg"),
    duty_error_a: Annotated[
        float, share("--duty-a", "2%", "A is high longer by this share of a cycle.", panel=_ENCODER)
    ] = default("0%"),
    duty_error_b: Annotated[
        float, share("--duty-b", "2%", "B is high longer by this share of a cycle.", panel=_ENCODER)
    ] = default("0%"),
    jitter_ps: Annotated[
        int, time_ps("--jitter", "5ns", "Bound of the edges' jitter, triangular.", panel=_ENCODER)
    ] = default("0ns"),
    counts_per_rev: Annotated[int, whole("--counts-per-rev", "Rotary encoder; 0: a scale.", panel=_ENCODER)] = 0,
    eccentricity_counts: Annotated[
        float,
        option(
            "--eccentricity",
            "'2 count'",
            "Amplitude of the once-per-revolution error.",
            panel=_ENCODER,
            read=lambda said: parse_in(said, "count", name="--eccentricity"),
        ),
    ] = default("0 count"),
    eccentricity_deg: Annotated[
        float, quantity("--eccentricity-phase", ANGLE, "90deg", "Its phase at count 0.", panel=_ENCODER)
    ] = default("0deg"),
    glitch_probability: Annotated[
        float, share("--glitch-probability", "0.1%", "That a glitch follows an edge.", panel=_ENCODER)
    ] = default("0%"),
    glitch_ps: Annotated[int, time_ps("--glitch-width", "20ns", "Width of a glitch.", panel=_ENCODER)] = default(
        "20ns"
    ),
    home_state: Annotated[
        int, whole("--home-state", "Angle state at the start: 00, 10, 11, 01.", metavar="0..3", panel=_ENCODER)
    ] = 0,
    filter_samples: Annotated[
        int, whole("--filter-samples", "Ticks that must see a level; 0: no filter.", panel=_CONTROLLER)
    ] = 3,
    clock_hz: Annotated[
        int, option("--filter-clock", "50MHz", "Clock of the filter.", panel=_CONTROLLER, read=_hertz)
    ] = default("50MHz"),
    multiplication: Annotated[
        Multiplication,
        member(
            "--multiplication",
            "rtec.controller:Multiplication",
            "1|2|4",
            "Counts made of one encoder cycle.",
            panel=_CONTROLLER,
        ),
    ] = default("4"),
    policy: Annotated[
        IllegalPolicy,
        member(
            "--policy",
            "rtec.controller:IllegalPolicy",
            "ignore|fault|guess",
            "What an illegal transition does.",
            panel=_CONTROLLER,
        ),
    ] = default("ignore"),
    counter_bits: Annotated[
        int, whole("--counter-bits", "Width of the counter; 0: never wraps.", panel=_CONTROLLER)
    ] = 32,
    figure: Annotated[
        Path | None,
        written(
            "--figure",
            "FILE.png",
            "Draw an insertion, before and after: .png, .svg, .pdf.",
            panel=_OUTPUT,
            endings=FIGURES,
        ),
    ] = None,
    figure_state: Annotated[
        int | None,
        option(
            "--figure-state",
            "00|10|11|01",
            "A and B when it begins; the first insertion without it.",
            panel=_OUTPUT,
            read=lambda said: _LEVELS.index(choice(said, _LEVELS, name="--figure-state")) + 1,
        ),
    ] = None,
    vcd: Annotated[
        Path | None, written("--vcd", "FILE.vcd", "Write both sides of the box as waveforms.", panel=_OUTPUT)
    ] = None,
    force: Annotated[bool, force("Overwrite files; write a VCD above 1 GB.", panel=_OUTPUT)] = False,
    as_json: Annotated[bool, flag("--json", "One JSON document on stdout, nothing else.", panel=_OUTPUT)] = False,
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
    from rtec.axis.motion import ACCELERATION_HZ_S, MotionKind
    from rtec.controller import ReceiverSettings
    from rtec.injector import InjectorSettings, Timing
    from rtec.machine import OpenPath, set_in_motion

    if motion.kind is MotionKind.STEADY and acceleration_hz_s != ACCELERATION_HZ_S:
        raise apart("--acceleration", "--motion steady")
    if no_gate and gate_margin is not None:
        raise apart("--gate-margin", "--no-gate")
    times = {
        "poll_ps": poll_ps, "poll_offset_ps": poll_offset_ps, "decide_ps": decide_ps, "step_ps": step_ps,
        "rest_ps": rest_ps, "recover_ps": recover_ps, "latency_ps": latency_ps, "gate_margin": gate_margin,
    }  # fmt: skip
    own: dict[str, Any] = {name: value for name, value in times.items() if value is not None}
    own |= {"gate_margin": None} if no_gate else {}
    if timing.microcontroller is not None and own:
        hint = "what the program does is timed by its instructions; 8051 and fast can be changed"
        raise apart("no_gate" if no_gate else next(iter(own)), "--timing firmware", hint)
    box = InjectorSettings(
        design=design, timing=dataclasses.replace(Timing.of(design, timing.processor), **own), real_edges=real_edges
    )
    flaws = Imperfections(
        phase_error_deg=phase_error_deg,
        duty_error_a=duty_error_a,
        duty_error_b=duty_error_b,
        eccentricity_counts=eccentricity_counts,
        eccentricity_deg=eccentricity_deg,
        jitter_ps=jitter_ps,
        glitch_probability=glitch_probability,
        glitch_ps=glitch_ps,
    )
    encoder = Encoder(counts_per_rev=counts_per_rev, home_state=home_state, seed=seed, imperfections=flaws)
    receiver = ReceiverSettings(
        filter_samples=filter_samples,
        clock_hz=clock_hz,
        multiplication=multiplication,
        policy=policy,
        counter_bits=counter_bits,
    )
    path = OpenPath(
        injector=box,
        encoder=encoder,
        receiver=receiver,
        frequency_hz=frequency_hz,
        cycles=_cycles(cycles, motion.program, frequency_hz),
        corrections=sign * corrections,
        direction=direction,
        microcontroller=timing.microcontroller,
    )
    whole_path = set_in_motion(
        path, motion.kind, program=motion.program, acceleration_hz_s=acceleration_hz_s, seed=encoder.seed
    )
    if figure_state is not None and figure is None:
        raise needs("--figure-state", "--figure")
    if figure is not None and corrections == 0:
        raise needs("--figure", "--corrections above 0", "without a step there is no insertion")
    _carry_out(whole_path, Seen(figure=figure, state=figure_state, vcd=vcd, force=force), as_json)


def _cycles(cycles: int | None, program: Program | None, frequency_hz: float) -> int:
    from rtec.axis.motion import programme_counts

    if program is not None and cycles is not None:
        raise apart("--cycles", "a G-code file", "the programme says how far it goes")
    if cycles is not None:
        return cycles
    if program is None:
        raise ArgumentError("--cycles", None, "the length of the motion, such as 1000")
    return max(round(programme_counts(program, frequency_hz) / 4.0), 1)


def _carry_out(path: OpenPath, seen: Seen, as_json: bool) -> None:
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
