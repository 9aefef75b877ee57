"""``rtec envelope``: how fast the encoder may go, for each design and processor."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _console, _measured
from rtec.cli._motion import AskedMotion, acceleration, motion
from rtec.cli._parameters import (
    apart,
    design,
    flag,
    force,
    needs,
    option,
    processor,
    time_ps,
    whole,
    written,
)
from rtec.cli._words import PROCESSORS, files_ending
from rtec.errors import ArgumentError
from rtec.io import FIGURES

if TYPE_CHECKING:
    from rtec.board import Microcontroller
    from rtec.injector import Design
    from rtec.verify.envelope.motion import InMotion


def envelope(
    design: list[Design] | None = design("Only this design; may be given again."),
    processor: list[Microcontroller] | None = processor(
        f"Only this: {', '.join(PROCESSORS)}, or as 'one-clock 50MHz'; may be given again."
    ),
    image: Path | None = option(
        "--image",
        "MINE.hex",
        "Your program for the one --design, as Intel HEX.",
        complete=files_ending(".hex", ".ihx"),
    ),
    jitter_ps: int = time_ps(
        "--jitter", "5ns", "Bound of the encoder's jitter; its worst within that is tried.", default="0ns"
    ),
    hold_latch: bool = flag("--hold-latch", "Hold real transitions back during an insertion, unlike the report."),
    nothing_owed: bool = flag("--nothing-owed", "Ask for nothing: how fast --design b passes the lines on alone."),
    exhaustive: bool = flag("--exhaustive", "Sweep the limits found over a whole reading, clock by clock."),
    motion: AskedMotion | None = motion("Search its top speed"),
    acceleration_hz_s: float | None = acceleration("Of the frequency, with --motion; 100 MHz/s."),
    seed: int | None = whole("--seed", "Of --motion adversary; 0.", low=0),
    figure: Path | None = written(
        "--figure", "FILE.png", "Draw what each does at which frequency: .png, .svg, .pdf.", endings=FIGURES
    ),
    force: bool = force("Write over a figure that exists."),
    json: bool = _measured.JSON,
) -> None:
    """Find the largest safe encoder frequency of each design on each processor, and what breaks first.

    The firmware runs on the box's circuits. The moment of each transition is moved past the program in steps of one
    clock of the processor, until at some frequency a count is wrong or a transition illegal.

    Example: rtec envelope --design c --processor 8051-12mhz --processor 'one-clock 50MHz'
    Example: rtec envelope --design b --nothing-owed --figure envelope.png
    Example: rtec envelope --design a --image mine.hex --jitter 5ns --json
    """
    from firmware_model import read_hex
    from rtec.board import MICROCONTROLLERS
    from rtec.cli._image import as_bad_input
    from rtec.injector.design import IN_PATH, Design
    from rtec.verify.envelope.rows import EnvelopePlan, find_envelope

    with_motion = {"--acceleration": acceleration_hz_s is not None, "--seed": seed is not None}
    without = {"--jitter": jitter_ps != 0, "--exhaustive": exhaustive, "--nothing-owed": nothing_owed}
    _check_motion(motion, with_motion, without)
    designs = tuple(dict.fromkeys(design or Design))
    if image is not None and (design is None or len(designs) != 1):
        raise ArgumentError("--image", "", "--design once, for that design", problem="is a program for one design")
    if nothing_owed and designs != IN_PATH:
        problem = "is for design b, through whose processor the lines pass"
        raise ArgumentError("--nothing-owed", "", "--design b, and no other", problem=problem)
    moved = None if motion is None else _in_motion(motion, acceleration_hz_s, seed)
    with as_bad_input():
        plan = EnvelopePlan(
            designs=designs,
            processors=tuple(dict.fromkeys(processor or MICROCONTROLLERS.values())),
            image=None if image is None else read_hex(image),
            hold_latch=hold_latch,
            jitter_ps=jitter_ps,
            exhaustive=exhaustive,
            nothing_owed=nothing_owed,
            motion=moved,
        )
    with _console.progress("envelope") as progress:
        rows = find_envelope(plan, progress)
    if figure is not None:
        from rtec.report.figures_envelope import envelope_figure
        from rtec.report.figures_style import write_figure

        write_figure(lambda: envelope_figure(rows), figure)
    if json:
        _console.print_json({"rows": [row.to_dict() for row in rows], "figure": figure and str(figure)})
        return
    from rtec.report.terminal_envelope import show

    show(rows)
    if figure is not None:
        typer.echo(f"Figure: {figure}")


def _check_motion(motion: AskedMotion | None, with_it: Mapping[str, bool], without: Mapping[str, bool]) -> None:
    """Refuse the options given that mean nothing with the motion, or without one."""
    wrong = next((name for name, given in (with_it if motion is None else without).items() if given), None)
    if wrong is not None:
        raise needs(wrong, "--motion") if motion is None else apart(wrong, "--motion")


def _in_motion(motion: AskedMotion, acceleration_hz_s: float | None, seed: int | None) -> InMotion:
    from rtec.axis.motion import ACCELERATION_HZ_S, MotionKind
    from rtec.verify.envelope.motion import InMotion

    if seed is not None and motion.kind is not MotionKind.ADVERSARY:
        raise apart("--seed", f"--motion {motion.kind.value}", "nothing in it is random")
    return InMotion(
        kind=motion.kind,
        program=motion.program,
        acceleration_hz_s=ACCELERATION_HZ_S if acceleration_hz_s is None else acceleration_hz_s,
        seed=seed or 0,
    )
