"""What insertions do to a moving axis: carriage, contour error and current in each design, as tables.

Example::

    python benchmarks/contour_insertions.py -o docs/contour.md
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from into_page import print_or_write

from rtec.axis.plants import run_drive
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.predictors import UnidirectionalTable
from rtec.toolpath import circle
from rtec.toolpath.contour_run import DRIVES, ContourRun, Floats
from rtec.toolpath.contouring import run_contour
from rtec.toolpath.pulses import Pulses, run_over_pulses

COUNTS = {"Original, A": 4, "B": 1, "C": 2}
"""Of a step, by design."""
SPEEDS_MM_S = {"ball-screw": 300.0, "linear-motor": 2500.0}
COUNT_MM = {"ball-screw": 0.001, "linear-motor": 0.002}
"""So that the encoder stays below 500 kHz: 75 and 313 kHz."""
_SCALE, _WAVE_MM, _PERIOD_MM = 100e-6, 0.010, 12.0
"""The error that is corrected: of the scale, and a wave."""
_SLOW = 0.1
"""Share of the feed, for the second circle."""
_PLACES_MM = np.linspace(-200.0, 200.0, 4001)
ERROR = UnidirectionalTable(
    positions_mm=_PLACES_MM,
    errors_mm=_SCALE * _PLACES_MM + _WAVE_MM * np.sin(2.0 * np.pi * _PLACES_MM / _PERIOD_MM),
    backlash_mm=0.0,
)


def box_of(design: Design, processor: Processor) -> InjectorSettings:
    """Return a box that holds real edges back while it inserts."""
    return InjectorSettings(design=design, timing=Timing.of(design, processor), real_edges=RealEdges.HOLD)


def one_step(drive: str, step_mm: float) -> tuple[float, float, float]:
    """Return overshoot beyond a step in um, extra current in A, and time to within a tenth in ms, at full speed."""
    kind, speed = DRIVES[drive], SPEEDS_MM_S[drive]
    time_s = np.arange(0.0, 1.0, kind.period_s)
    ramp_s = 2.0 * speed / float(np.max(kind.limits.acceleration_mm_s2))
    share = np.clip(time_s / ramp_s, 0.0, 1.0)
    velocity = speed * share**2 * (3.0 - 2.0 * share)
    place = np.cumsum(velocity) * kind.period_s
    begin_s = 0.7
    plain, moved = (
        run_drive(kind.make(), time_s, place, velocity, corrector=inserted)
        for inserted in (None, lambda t: np.where(t >= begin_s, step_mm, 0.0))
    )
    off = plain.load_mm - moved.load_mm
    after = time_s >= begin_s
    reached = np.abs(off[after] - step_mm) < 0.1 * step_mm
    last = int(np.flatnonzero(~reached).max(initial=-1)) + 1
    current = np.abs(moved.current_a - plain.current_a)[after].max()
    return 1e3 * float(off.max() - step_mm), float(current), 1e3 * last * kind.period_s


def pulses_of(drive: str, box: InjectorSettings | None, *, wrong: bool = True) -> Pulses:
    """Return encoders of a drive with a box, their scales wrong or not."""
    errors = dict.fromkeys("xy", ERROR) if wrong else {}
    return Pulses(count_mm=COUNT_MM[drive], injector=box, errors=errors)


def on_a_circle(drive: str, share: float) -> Iterator[str]:
    """Yield rows of what boxes make of the circle at a share of the drive's speed."""
    speed = share * SPEEDS_MM_S[drive]

    def run(box: InjectorSettings | None, *, wrong: bool = True) -> ContourRun:
        return run_contour(circle(), drive, pulses=pulses_of(drive, box, wrong=wrong), feed_mm_s=speed)

    perfect = run(None, wrong=False)

    def row(name: str, one: ContourRun) -> str:
        error = 1e3 * np.abs(one.contour_mm)
        ends = one.time_s.size
        pairs = [(axis.current_a, perfect.axes[k].current_a[:ends]) for k, axis in one.axes.items()]
        current = max(float(np.abs(a - b).max()) for a, b in pairs)
        loops = one.loops.values()
        inserted = sum(loop.insertions.inserted for loop in loops)
        if one.stopped_s is not None:
            what = f"stopped after {one.stopped_s:.2f} s | | {inserted} | | | no"
            return f"| {drive}, {speed:g} mm/s | {name} | {what} |"
        sound = "yes" if all(loop.audit for loop in loops) else "no"
        figures = f"{error.max():.1f} µm | {np.sqrt(np.mean(error**2)):.2f} µm | {inserted} | {current:.2f} A"
        return f"| {drive}, {speed:g} mm/s | {name} | {figures} | {line_of(one, perfect):.0f} Hz | {sound} |"

    yield row("perfect scales, no box", perfect)
    yield row("no box", run(None))
    for design in Design:
        for processor in (Processor.FAST, Processor.MCS51):
            yield row(f"{design.short}, {processor.value}", run(box_of(design, processor)))


def line_of(run: ContourRun, other: ContourRun) -> float:
    """Return the frequency of the largest line of what one run adds to the way of x in another, in Hz."""
    off = run.axes["x"].load_mm - other.axes["x"].load_mm
    return _largest_line(off, float(np.diff(run.time_s[:2])[0]))


def _largest_line(values: Floats, period_s: float) -> float:
    size = np.abs(np.fft.rfft(np.hanning(values.size) * (values - values.mean())))
    return float(np.fft.rfftfreq(values.size, period_s)[size.argmax()])


def standing(drive: str) -> Iterator[str]:
    """Yield rows of how much a drive moves while it stands for two seconds, by what is counted."""
    kind = DRIVES[drive]
    still = np.full(round(2.0 / kind.period_s), 10.0)
    for count_mm in (1e-4, COUNT_MM[drive], 1e-2):
        for design in (None, Design.C):
            box = None if design is None else box_of(design, Processor.FAST)
            pulses = Pulses(count_mm=count_mm, injector=box, errors={"x": ERROR})
            run, loop = run_over_pulses(kind.make(), kind.period_s, still, pulses, "x")
            half = run.load_mm[still.size // 2 :]
            moves = float(np.ptp(half))
            line = f"{_largest_line(half, kind.period_s):.0f} Hz" if moves > 0.01 * count_mm else "-"
            name = "no box" if design is None else f"{design.short}"
            yield (
                f"| {drive} | {1e3 * count_mm:g} µm | {name} | {1e6 * moves:.1f} nm | {line} "
                f"| {loop.insertions.inserted} |"
            )


def tables() -> str:
    """Return the tables."""
    lines = [
        "| drive at full speed | design | step | carriage overshoots by | extra current | within a tenth after |",
        "|---|---|---|---|---|---|",
    ]
    for drive, speed in SPEEDS_MM_S.items():
        for design, counts in COUNTS.items():
            step = counts * COUNT_MM[drive]
            over, current, lasts = one_step(drive, step)
            at = f"{drive}, {speed:g} mm/s"
            lines.append(
                f"| {at} | {design} | {1e3 * step:g} µm | {over:.2f} µm | {current:.2f} A | {lasts:.1f} ms |"
            )
    lines += [
        "",
        "| circle of 150 mm | box | contour error, worst | RMS | insertions | extra current | largest line in x "
        "| counts right |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for drive in SPEEDS_MM_S:
        for share in (1.0, _SLOW):
            lines += on_a_circle(drive, share)
    lines += ["", "| standing at 10 mm | count | box | moves by | line | insertions |", "|---|---|---|---|---|---|"]
    for drive in SPEEDS_MM_S:
        lines += standing(drive)
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the tables, or write them into a page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, help="page to write the tables into, instead of stdout")
    print_or_write(parser, parser.parse_args().output, "contour_insertions", tables)


if __name__ == "__main__":
    main()
