"""What insertions do to a moving axis: carriage, contour error and current in each design, as tables.

Example::

    python benchmarks/contour_insertions.py -o docs/contour.md
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from into_page import print_or_write

from rtec.axis.plants import DriveRun, run_drive
from rtec.toolpath import circle
from rtec.toolpath.contouring import DRIVES, ContourRun, Floats, run_contour

COUNTS = {"Original, A": 4, "B": 1, "C": 2}
"""Of a step, by design."""
SPEEDS_MM_S = {"ball-screw": 300.0, "linear-motor": 2500.0}
COUNT_MM = {"ball-screw": 0.001, "linear-motor": 0.002}
"""So that the encoder stays below 500 kHz: 75 and 313 kHz."""
_SCALE, _WAVE_MM, _PERIOD_MM = 100e-6, 0.010, 12.0
"""The error that is corrected: of the scale, and a wave."""


def error_at(place_mm: Floats) -> Floats:
    """Return what is to be inserted at places, in mm."""
    return _SCALE * place_mm + _WAVE_MM * np.sin(2.0 * np.pi * place_mm / _PERIOD_MM)


def stepped(values_mm: Floats, step_mm: float) -> Floats:
    """Return values in whole steps: the box inserts when the next step is due."""
    return np.round(values_mm / step_mm) * step_mm


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


def on_a_circle(drive: str) -> Iterator[tuple[str, float, float, float, float]]:
    """Yield design and what its steps add to a smooth correction on a circle: worst and RMS in um, A and Hz."""
    free = run_contour(circle(), drive)
    ways = {letter: (run.time_s, run.command_mm) for letter, run in free.axes.items()}

    def corrector(step_mm: float | None) -> dict[str, Callable[[Floats], Floats]]:
        def of(letter: str) -> Callable[[Floats], Floats]:
            def inserted(time_s: Floats) -> Floats:
                wanted = error_at(np.interp(time_s, *ways[letter]))
                wanted = wanted - wanted[0]
                return wanted if step_mm is None else stepped(wanted, step_mm)

            return inserted

        return {letter: of(letter) for letter in ways}

    smooth = run_contour(circle(), drive, corrector=corrector(None))
    for design, counts in COUNTS.items():
        run = run_contour(circle(), drive, corrector=corrector(counts * COUNT_MM[drive]))
        added = 1e3 * (run.contour_mm - smooth.contour_mm)
        current = max(_peak(run.axes[letter], smooth.axes[letter]) for letter in ways)
        yield design, float(np.abs(added).max()), float(np.sqrt(np.mean(added**2))), current, _line(run, smooth)


def _peak(one: DriveRun, other: DriveRun) -> float:
    return float(np.abs(one.current_a - other.current_a).max())


def _line(run: ContourRun, smooth: ContourRun) -> float:
    """Return the frequency of the largest line of what the steps add to the way of x, in Hz."""
    off = run.axes["x"].load_mm - smooth.axes["x"].load_mm
    size = np.abs(np.fft.rfft(np.hanning(off.size) * (off - off.mean())))
    period = float(np.diff(run.axes["x"].time_s[:2])[0])
    return float(np.fft.rfftfreq(off.size, period)[size.argmax()])


def tables() -> str:
    """Return both tables."""
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
        "| circle of 150 mm | design | step | contour error added, worst | RMS | extra current | largest line of x |",
        "|---|---|---|---|---|---|---|",
    ]
    for drive in SPEEDS_MM_S:
        for design, worst, rms, current, line in on_a_circle(drive):
            step = 1e3 * COUNTS[design] * COUNT_MM[drive]
            figures = f"{worst:.2f} µm | {rms:.2f} µm | {current:.2f} A | {line:.0f} Hz"
            lines.append(f"| {drive} | {design} | {step:g} µm | {figures} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the tables, or write them into a page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, help="page to write the tables into, instead of stdout")
    print_or_write(parser, parser.parse_args().output, "contour_insertions", tables)


if __name__ == "__main__":
    main()
