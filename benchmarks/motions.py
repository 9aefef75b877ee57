"""Each design with and without speed gate and hold latch, in every motion: how its insertions end.

python benchmarks/motions.py -o docs/motions.md
"""

from __future__ import annotations

import argparse
import csv
import itertools
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from rtec.axis import Dwell, Move, Program
from rtec.axis.motion import MotionKind
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.readable import hertz_text
from rtec.report.rendering import markdown_page
from rtec.verify.contract import cases
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.motion_outcome import Outcome, outcome_of
from rtec.verify.contract.motions import AIMED, insertion_window, motion_for, stream_of
from rtec.verify.contract.trials import Case, Trials

TOP_HZ = {Processor.FAST: 500e3, Processor.MCS51: 100e3}
HARD_HZ_S = (1e9, 1e10)
"""Accelerations far beyond those of the table."""
STREAMS = {
    MotionKind.STEADY: 1000, MotionKind.RAMP: 200, MotionKind.PROGRAMME: 200, MotionKind.REVERSAL: 1500,
    MotionKind.DITHER: 1000, MotionKind.ADVERSARY: 6000,
}  # fmt: skip
SEED = 15
TEMPLATE = Path(__file__).with_name("motions.md.j2")
PROGRAM = Program(
    blocks=tuple(
        block for x in (1, 2, 3, 4, 5, 6, 7, 7.1, 7, 6, 5, 4, 3, 2, 1, 0.9)
        for block in (Move(target_mm=25.4 * x, feed_mm_s=25.4 * 50 / 60), Dwell(seconds=2.0))
    )
)  # fmt: skip
"""A run of the thesis's measuring program (Figure 4.3)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A box and a motion."""

    processor: Processor
    design: Design
    gate: bool
    latch: RealEdges
    kind: MotionKind


def box_of(design: Design, processor: Processor, gate: bool, latch: RealEdges) -> BuiltIn:
    """Return a design with or without its gate and its latch."""
    timing = Timing.of(design, processor)
    timing = timing if gate else replace(timing, gate_margin=None)
    return BuiltIn(InjectorSettings(design=design, timing=timing, real_edges=latch))


def runs_of(kind: MotionKind, trials: Trials, streams: int) -> Iterator[Case]:
    """Yield runs with one request each: directions, signs and states drawn, speeds or phases swept."""
    rng = np.random.default_rng(SEED)
    window = insertion_window(trials) if kind in AIMED else None
    for i in range(streams):
        direction, sign = (int(way) for way in rng.choice([1, -1], 2))
        state = int(rng.integers(4))
        if kind is MotionKind.STEADY:
            hertz = trials.contract.frequency_hz * (i + 0.5) / streams
            yield cases.step_in_motion(trials, hertz, direction, sign, i * cases.GOLDEN % 1.0)
            continue
        motion = motion_for(
            kind, i, trials.contract, direction=direction, window=window, program=PROGRAM, seed=SEED
        )  # fmt: skip
        yield trials.case(kind.value, stream_of(motion, state, sign))


def counted(share: float) -> dict[Cell, Counter[Outcome]]:
    """Carry all out, a share of the streams."""
    found: dict[Cell, Counter[Outcome]] = {}
    for processor, design, kind in itertools.product(Processor, Design, MotionKind):
        contract = replace(Contract.of(design), frequency_hz=TOP_HZ[processor])
        measured = Trials(box_of(design, processor, True, RealEdges.HOLD), contract)
        if measured.measure_settling() is not None:
            raise RuntimeError(f"{design.title} does not insert at rest")
        runs = list(runs_of(kind, measured, max(round(share * STREAMS[kind]), 1)))
        late_ps = 3 * Timing.of(design, processor).worst_ps(design)
        for gate, latch in itertools.product((True, False), RealEdges):
            trials = Trials(box_of(design, processor, gate, latch), contract)
            trials.settle_ps = measured.settle_ps
            ends = Counter(outcome_of(run, contract, late_ps=late_ps) for run in trials.all_of(runs))
            found[Cell(processor=processor, design=design, gate=gate, latch=latch, kind=kind)] = ends
        sys.stderr.write(f"{processor.value} {design.key} {kind.value}\n")
    return found


def share(count: int, of: int) -> tuple[str, str, str]:
    """Return a share in percent and its 95 % interval (Wilson)."""
    interval = binomtest(count, of).proportion_ci(0.95, method="wilson")
    low, high = max(100.0 * interval.low, 0.0), 100.0 * interval.high
    return f"{100.0 * count / of:.3g}", f"{low:.2g}" if low < 99.0 else f"{low:.4g}", f"{high:.3g}"


def shares(found: dict[Cell, Counter[Outcome]]) -> Iterator[tuple[object, ...]]:
    """Yield the heading and a row for each box and motion."""
    ends = [f"{outcome.name.lower()}_{what}" for outcome in Outcome for what in ("percent", "low", "high")]
    yield "processor", "design", "gate", "latch", "motion", "streams", *ends
    for cell, counts in found.items():
        box = (cell.processor.value, cell.design.key, "on" if cell.gate else "off", cell.latch.value, cell.kind.value)
        total = counts.total()
        yield *box, total, *itertools.chain.from_iterable(share(counts[outcome], total) for outcome in Outcome)


def failing(rows: Sequence[dict[str, str]]) -> list[tuple[str, list[list[str]]]]:
    """Return for each processor the designs and motions in which an insertion went wrong, by gate and latch."""
    tables: dict[str, dict[tuple[str, ...], list[str]]] = {}
    boxes = sorted(rows, key=lambda row: (row["gate"] == "off", row["latch"] != "hold"))
    for row in boxes:
        wrong = f"{row['illegal_percent']} / {row['undetected_percent']}"
        of_processor = tables.setdefault(row["processor"], {})
        of_processor.setdefault((row["design"], row["motion"], row["streams"]), []).append(wrong)
    return [
        (processor, [[*key, *cells] for key, cells in table.items() if set(cells) != {"0 / 0"}])
        for processor, table in tables.items()
    ]


def summary(found: dict[Cell, Counter[Outcome]]) -> str:
    """Return the adversarial streams of all designs that lie beside the lines, by gate and latch."""
    lines = [
        "| processor | gate | latch | adversarial streams | deferred | illegal | undetected | undetected, % |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for processor, gate, latch in itertools.product(Processor, (True, False), RealEdges):
        ends = sum(
            (
                counts
                for cell, counts in found.items()
                if (cell.processor, cell.gate, cell.latch) == (processor, gate, latch)
                and cell.kind is MotionKind.ADVERSARY
                and not cell.design.in_path
            ),
            Counter(),
        )
        counts = " | ".join(str(ends[o]) for o in (Outcome.DEFERRED, Outcome.ILLEGAL, Outcome.UNDETECTED))
        percent, low, high = share(ends[Outcome.UNDETECTED], ends.total())
        undetected = f"{percent} ({low} to {high})"
        on = "on" if gate else "off"
        lines.append(f"| {processor.value} | {on} | {latch.value} | {ends.total()} | {counts} | {undetected} |")
    return "\n".join(lines)


def beyond(share: float) -> str:
    """Return what gate and latch together leave on the 8051 where the axis gains speed much faster."""
    lines = [
        "| acceleration | motion | Design A: illegal | undetected | Design C: illegal | undetected |",
        "|---|---|---|---|---|---|",
    ]
    for gain, kind in itertools.product(HARD_HZ_S, (MotionKind.ADVERSARY, MotionKind.REVERSAL)):
        counts = []
        for design in (Design.A, Design.C):
            contract = replace(Contract.of(design), frequency_hz=TOP_HZ[Processor.MCS51], acceleration_hz_s=gain)
            trials = Trials(box_of(design, Processor.MCS51, True, RealEdges.HOLD), contract)
            trials.measure_settling()
            runs = trials.all_of(list(runs_of(kind, trials, max(round(1000 * share), 1))))
            late_ps = 3 * Timing.of(design, Processor.MCS51).worst_ps(design)
            ends = Counter(outcome_of(run, contract, late_ps=late_ps) for run in runs)
            counts += [ends[Outcome.ILLEGAL], ends[Outcome.UNDETECTED]]
        lines.append(f"| {gain / 1e9:g} GHz/s | {kind.value} | {' | '.join(map(str, counts))} |")
    return "\n".join(lines)


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--share", type=float, default=1.0, help="of the streams, to try it")
    words = parser.parse_args()
    found = counted(words.share)
    with words.output.with_suffix(".csv").open("w+", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(shares(found))
        file.seek(0)
        rows = list(csv.DictReader(file))
    text = markdown_page(
        TEMPLATE,
        summary=summary(found),
        failing=failing(rows),
        beyond=beyond(words.share),
        top={processor.value: hertz_text(hertz) for processor, hertz in TOP_HZ.items()},
    )
    words.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
