"""``rtec simulate``: the open signal path, at constant speed or in another motion."""

from __future__ import annotations

from contextlib import closing
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli import _console
from rtec.cli._capture import CaptureOptions, refuse_made
from rtec.cli._faults import FaultOptions
from rtec.cli._groups import OptionGroup
from rtec.cli._motion import ACCELERATION, AskedMotion, acceleration, motion
from rtec.cli._parameters import (
    Works,
    apart,
    choice,
    design,
    flag,
    member,
    needs,
    option,
    quantity,
    share,
    time_ps,
    whole,
    whole_number,
    works,
)
from rtec.cli._play_algorithm import AlgorithmOptions, play
from rtec.cli._seen import Seen
from rtec.errors import ArgumentError
from rtec.units import ANGLE, FREQUENCY, parse_in, parse_quantity

if TYPE_CHECKING:
    from rtec.axis import Encoder, Program
    from rtec.controller import IllegalPolicy, Multiplication
    from rtec.injector import Design, InjectorSettings, RealEdges
    from rtec.machine import OpenPath
    from rtec.verify.contract.trials import Trials


_MADE = ("frequency_hz", "cycles", "motion", "acceleration_hz_s", "direction")
"""Options of a made stream, beside the seed: faults have it, too."""
_OF_A_DESIGN = ("timing", "glitch_probability", "glitch_ps")
"""Options that mean nothing for an algorithm, beside those of the box."""


def _sign(name: str, text: str) -> Any:
    return option(name, "+|-", text, default="+", read=lambda said: 1 if choice(said, "+-", name=name) == "+" else -1)


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


@dataclass(frozen=True, slots=True, kw_only=True)
class _BoxOptions(OptionGroup):
    """What of the box is otherwise than the timing has it."""

    PANEL = "The box"

    poll_ps: int | None = time_ps("--poll", "TIME", "Interval of its looks at the lines.")
    poll_offset_ps: int | None = time_ps("--poll-offset", "TIME", "Time of one of them.")
    decide_ps: int | None = time_ps("--decide", "TIME", "From the look to the first change.")
    step_ps: int | None = time_ps("--step", "TIME", "Between changes of one insertion.")
    recover_ps: int | None = time_ps("--recover", "TIME", "After the last change.")
    latency_ps: int | None = time_ps("--latency", "TIME", "Design B: from input to output.")
    rest_ps: int | None = time_ps("--rest", "TIME", "Without an edge so long, the axis rests.")
    gate_margin: float | None = share("--gate-margin", "15%", "Reserve of the speed gate.")
    no_gate: bool = flag("--no-gate", "No speed gate.")
    real_edges: RealEdges = member(
        "--real-edges",
        "rtec.injector:RealEdges",
        "hold|merge",
        "A real edge inside an insertion waits, or merges with it.",
        default="hold",
    )

    def settings(self, design: Design, works: Works) -> InjectorSettings:
        """Return the box with a design in it, and with what works in it."""
        from rtec.injector import InjectorSettings, Timing

        if self.no_gate and self.gate_margin is not None:
            raise apart("--gate-margin", "--no-gate")
        own = {item.name: getattr(self, item.name) for item in fields(Timing) if hasattr(self, item.name)}
        own = {name: value for name, value in own.items() if value is not None}
        if works.microcontroller is not None and (own or self.no_gate):
            hint = "what the program does is timed by its instructions; 8051 and fast can be changed"
            raise apart("no_gate" if self.no_gate else next(iter(own)), "--timing firmware", hint)
        own |= {"gate_margin": None} if self.no_gate else {}
        timing = replace(Timing.of(design, works.processor), **own)
        return InjectorSettings(design=design, timing=timing, real_edges=self.real_edges)


@dataclass(frozen=True, slots=True, kw_only=True)
class _EncoderOptions(OptionGroup):
    """What of the encoder is otherwise than of a perfect scale."""

    PANEL = "The encoder"

    phase_error_deg: float = quantity("--phase-error", ANGLE, "10deg", "B lags A by 90deg plus this.", default="0deg")
    duty_error_a: float = share("--duty-a", "2%", "A is high longer by this share of a cycle.", default="0%")
    duty_error_b: float = share("--duty-b", "2%", "B is high longer by this share of a cycle.", default="0%")
    jitter_ps: int = time_ps("--jitter", "5ns", "Bound of the edges' jitter, triangular.", default="0ns")
    counts_per_rev: int = whole("--counts-per-rev", "Rotary encoder; 0: a scale.", default=0)
    eccentricity_counts: float = option(
        "--eccentricity",
        "'2 count'",
        "Amplitude of the once-per-revolution error.",
        read=lambda said: parse_in(said, "count", name="--eccentricity"),
        default="0 count",
    )
    eccentricity_deg: float = quantity(
        "--eccentricity-phase", ANGLE, "90deg", "Its phase at count 0.", default="0deg"
    )
    glitch_probability: float = share("--glitch-probability", "0.1%", "That a glitch follows an edge.", default="0%")
    glitch_ps: int = time_ps("--glitch-width", "20ns", "Width of a glitch.", default="20ns")
    home_state: int = whole("--home-state", "Angle state at the start: 00, 10, 11, 01.", metavar="0..3", default=0)

    def settings(self, seed: int) -> Encoder:
        """Return the encoder; the seed is that of its jitter and glitches."""
        from rtec.axis import Encoder, Imperfections

        flaws = Imperfections(**{item.name: getattr(self, item.name) for item in fields(Imperfections)})
        return Encoder(counts_per_rev=self.counts_per_rev, home_state=self.home_state, seed=seed, imperfections=flaws)


@dataclass(frozen=True, slots=True, kw_only=True)
class _ReceiverOptions(OptionGroup):
    """The controller's input, by the names of `ReceiverSettings`."""

    PANEL = "The controller's input"

    filter_samples: int = whole("--filter-samples", "Ticks that must see a level; 0: no filter.", default=3)
    clock_hz: int = option("--filter-clock", "50MHz", "Clock of the filter.", read=_hertz, default="50MHz")
    multiplication: Multiplication = member(
        "--multiplication",
        "rtec.controller:Multiplication",
        "1|2|4",
        "Counts made of one encoder cycle.",
        default="4",
    )
    policy: IllegalPolicy = member(
        "--policy",
        "rtec.controller:IllegalPolicy",
        "ignore|fault|guess",
        "What an illegal transition does.",
        default="ignore",
    )
    counter_bits: int = whole("--counter-bits", "Width of the counter; 0: never wraps.", default=32)


def simulate(
    context: typer.Context,
    design: Design = design("Insertion design.", default=...),
    frequency_hz: float | None = quantity(
        "--frequency",
        FREQUENCY,
        "500kHz",
        "Of the encoder's A (or B) square wave; of a motion the highest.",
    ),
    corrections: int = option("--corrections", "N", "Steps asked for.", read=_steps, default=...),
    *,
    cycles: int | None = whole("--cycles", "Travel there and back; a cycle is four counts."),
    motion: AskedMotion = motion("While corrections are asked for", default="steady"),
    acceleration_hz_s: float = acceleration("Of the frequency, at most; not for steady.", default=ACCELERATION),
    timing: Works = works("What works in the box.", default="fast"),
    direction: int = _sign("--direction", "Of the motion."),
    sign: int = _sign("--sign", "- takes counts away instead of adding them."),
    seed: int = whole("--seed", "Of jitter, glitches, faults and the adversary.", default=0),
    box: _BoxOptions,
    encoder: _EncoderOptions,
    captured: CaptureOptions,
    own: AlgorithmOptions,
    wrong: FaultOptions,
    receiver: _ReceiverOptions,
    seen: Seen,
    as_json: bool = flag("--json", "One JSON document on stdout, nothing else.", panel=Seen.PANEL),
) -> None:
    """Send an encoder's edges through the box into the controller, compare the counts, and draw an insertion.

    Exits with 1 where corrections are left over, a transition is illegal or a count is wrong. Times, frequencies and
    angles carry their units. What is not given of the box is that of the --timing: 8051 is the report's words; with
    firmware the design's program runs on a 12 MHz 8051, instruction by instruction. A --motion other than steady ends
    at rest, where the box makes what it still owes; reversal and adversary aim a crossing of a line into each
    insertion. A G-code file has a length of its own: no --cycles; its fastest feed runs at the --frequency. The edges
    of a --capture come at their measured times: options of motion and encoder do not go with it. A --fault proves
    that it took effect, or the command exits with 1, too.

    Example: rtec simulate --design c --frequency 500kHz --cycles 100000 --corrections 4000 --jitter 5ns
    Example: rtec simulate --design c --algorithm mine.py:Mine --frequency 100kHz --cycles 1000 --corrections 5
    Example: rtec simulate --design original --capture scope.csv --corrections 9 --fault "missed edge@2 ms"
    """
    from rtec.controller import ReceiverSettings
    from rtec.machine import OpenPath, on_capture

    if seen.figure_state is not None and seen.figure is None:
        raise needs("--figure-state", "--figure")
    if seen.figure is not None and corrections == 0:
        raise needs("--figure", "--corrections above 0", "without a step there is no insertion")
    if own.algorithm is not None:
        wrong.refuse_box()
    injector, input_ = box.settings(design, timing), ReceiverSettings(**asdict(receiver))
    capture = captured.read()
    if capture is not None:
        refuse_made(
            context, (*_MADE, *(() if wrong.fault else ("seed",)), *(item.name for item in fields(_EncoderOptions)))
        )
        path = on_capture(
            capture,
            injector=injector,
            receiver=input_,
            corrections=sign * corrections,
            microcontroller=timing.microcontroller,
        )
    else:
        hertz = _needed(frequency_hz)
        path = OpenPath(
            injector=injector,
            encoder=encoder.settings(seed),
            receiver=input_,
            frequency_hz=hertz,
            cycles=_cycles(cycles, motion.program, hertz),
            corrections=sign * corrections,
            direction=direction,
            microcontroller=timing.microcontroller,
        )
    moved = partial(_in_motion, path, None if capture is not None else motion, acceleration_hz_s, seed)
    chosen = own.choose(context, design, (*_OF_A_DESIGN, *(item.name for item in fields(_BoxOptions))))
    if chosen is None:
        _carry_out(moved(), wrong, seed, seen, as_json)
    else:
        with closing(chosen.algorithm):
            play(chosen, moved, wrong, seed, seen, as_json=as_json)


def _needed(frequency_hz: float | None) -> float:
    if frequency_hz is None:
        raise ArgumentError("--frequency", None, "such as 500kHz, or --capture FILE")
    return frequency_hz


def _in_motion(
    path: OpenPath, motion: AskedMotion | None, acceleration_hz_s: float, seed: int, own: Trials | None = None
) -> OpenPath:
    """Set a path in motion, if it is not a captured one; crossings are aimed at insertions of its own algorithm."""
    from rtec.axis.motion import ACCELERATION_HZ_S, MotionKind
    from rtec.machine import with_motion

    if motion is None:
        return path
    if motion.kind is MotionKind.STEADY and acceleration_hz_s != ACCELERATION_HZ_S:
        raise apart("--acceleration", "--motion steady")
    window = None
    if own is not None:
        from rtec.verify.contract.motions import AIMED, insertion_window

        window = insertion_window(own) if motion.kind in AIMED else None
        if window is None and motion.kind in AIMED:
            raise ArgumentError("--motion", motion.kind.value, "an algorithm that inserts at rest")
    return with_motion(
        path, motion.kind, program=motion.program, acceleration_hz_s=acceleration_hz_s, seed=seed, window=window
    )


def _cycles(cycles: int | None, program: Program | None, frequency_hz: float) -> int:
    from rtec.axis.motion import programme_counts

    if program is not None and cycles is not None:
        raise apart("--cycles", "a G-code file", "the programme says how far it goes")
    if cycles is not None:
        return cycles
    if program is None:
        raise ArgumentError("--cycles", None, "the length of the motion, such as 1000")
    return max(round(programme_counts(program, frequency_hz) / 4.0), 1)


def _carry_out(path: OpenPath, wrong: FaultOptions, seed: int, seen: Seen, as_json: bool) -> None:
    from rtec.machine import simulate as run
    from rtec.report.terminal_simulate import show, show_outcome

    faults = wrong.at(path, seed)
    capture = seen.check(path)
    with _console.progress(f"design {path.injector.design.key}") as progress:
        if faults:
            from rtec.machine.open_faults import simulate_faults

            faulty = simulate_faults(path, faults, vcd=seen.vcd, seen=capture, progress=progress)
            result, outcome = faulty.result, faulty.outcome
        else:
            result, outcome = run(path, vcd=seen.vcd, seen=capture, progress=progress), None
    written = seen.written(path, capture)
    if as_json:
        found = {} if outcome is None else outcome.to_dict()
        _console.print_json(result.to_dict() | {"seed": seed} | found | written)
    else:
        show(path, result)
        if outcome is not None:
            show_outcome(outcome)
        seen.say(written)
    if not result.good or (outcome is not None and not outcome.activated):
        raise typer.Exit(1)
