"""The behavioural box against the firmware: one edge stream into both, and what each effect makes of the difference.

The firmware's trace on the board is the measurement. The model starts as the report's words have it and is given one
effect after the other; after each, every insertion of the model is held against the one that the firmware made.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rtec.board import Board, Microcontroller
from rtec.campaign._behaviour_streams import Exercise, long_run, steady_motion
from rtec.checks import whole_within
from rtec.injector import Design, Effect, Injector, InjectorSettings, Processor, RealEdges, Timing
from rtec.signal import EdgeStream

CLOCKS_PER_US = 12
_US = 1_000_000
_REST_PS = 900 * _US
"""An insertion so long after a transition comes behind none."""

Longs = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """Firmware less model, over the insertions that both made in the same order."""

    insertions: int
    """Insertions of the firmware."""
    unmatched: int
    """Insertions that only one of the two made."""
    worst_clocks: float
    """Largest difference of the time from an insertion's transition to one of its changes."""
    rms_clocks: float
    share_zero: float
    """Share of the firmware's insertions whose every change comes at the same time behind its transition."""
    share_same: float
    """Share that comes behind the same transition."""

    @property
    def none(self) -> bool:
        """Whether model and firmware do the same."""
        return self.insertions > 0 and self.unmatched == 0 and self.share_zero == self.share_same == 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Rung:
    """The model with the effects so far."""

    name: str
    cause: str
    """What the effect last added is, physically."""
    steady: Difference
    """Steady motion at every phase between transition and program, a clock apart."""
    long: Difference
    """A long run of changing speed over many readings."""
    identical: bool
    """Whether every change of the lines, of both runs, is the firmware's to the picosecond."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Behaviour:
    """The staircase of one design."""

    design: str
    hold_latch: bool
    phases: int
    seed: int
    rungs: tuple[Rung, ...]

    @property
    def good(self) -> bool:
        """Whether nothing is left of the difference in the end."""
        last = self.rungs[-1]
        return last.steady.none and last.long.none and last.identical

    def to_dict(self) -> dict[str, object]:
        """Return plain data under stable names."""
        return {
            **dataclasses.asdict(self),
            "rungs": [dataclasses.asdict(rung) for rung in self.rungs],
            "good": self.good,
        }


# --- the effects, one after the other ---
def _report(design: Design, _begin_ps: int) -> Timing:
    return Timing.of(design, Processor.MCS51)


def _sampled(design: Design, begin_ps: int) -> Timing:
    timing = Timing.of(design, Processor.MCS51)
    looks_ps = (begin_ps + 3 * _US // 4) % timing.poll_ps
    if design is Design.B:
        return dataclasses.replace(timing, poll_offset_ps=looks_ps, latency_ps=timing.latency_ps + _US // 4)
    return dataclasses.replace(timing, poll_offset_ps=looks_ps, decide_ps=timing.decide_ps + _US // 4)


def _paths(design: Design, begin_ps: int) -> Timing:
    timing = Timing.of(design, Processor.FIRMWARE)
    return dataclasses.replace(timing, firmware=None, poll_offset_ps=(begin_ps + 3 * _US // 4) % timing.poll_ps)


def timing_with(effects: Effect) -> Callable[[Design, int], Timing]:
    """Return how the firmware's timing with some of its effects follows from a design and the begin of a reading."""

    def timing(design: Design, begin_ps: int) -> Timing:
        full = Timing.of(design, Processor.FIRMWARE)
        assert full.firmware is not None  # noqa: S101 - of this profile, for the type checker
        firmware = dataclasses.replace(full.firmware, start_ps=begin_ps, effects=effects)
        return dataclasses.replace(full, firmware=firmware)

    return timing


STAIRCASE: tuple[tuple[str, str, Callable[[Design, int], Timing]], ...] = (
    ("report", "the report's words: profile 8051", _report),
    ("S5P2", "pins are sampled in S5P2, outputs change in S1P1: a quarter of a cycle more", _sampled),
    ("decision", "cycles of the decision, and of a turn of the waiting loop", _paths),
    ("search", "the grid of looks begins anew with each search; the gate is a timer", timing_with(Effect(0))),
    (
        "arming",
        "two looks before the wait begins, and the edge latch remembers what came between",
        timing_with(Effect.ARMING),
    ),
    (
        "reading",
        "busy with a reading every 1000 cycles, which alone takes a request",
        timing_with(Effect.ARMING | Effect.READINGS),
    ),
    (
        "interrupt",
        "the tick breaks in at the end of an instruction, and the way from there takes cycles",
        timing_with(Effect.READINGS | Effect.ARMING | Effect.INTERRUPT),
    ),
)
"""Name, cause and timing of each rung."""


def compare_behaviour(
    design: Design,
    *,
    hold_latch: bool = False,
    phases: int = 72,
    edges: int = 60_000,
    seed: int = 0,
    staircase: tuple[tuple[str, str, Callable[[Design, int], Timing]], ...] = STAIRCASE,
) -> Behaviour:
    """Hold the behavioural box against the firmware, and show the difference fall.

    Parameters
    ----------
    design
        Design whose committed image for the 12 MHz 8051 is the measurement.
    hold_latch
        Whether a latch holds real edges back during an insertion.
    phases
        Phases between transition and program in the steady motion, a clock (1/12 us) apart.
    edges
        Length of the long run.
    seed
        Of the long run.
    staircase
        Timings to be compared.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> found = compare_behaviour(Design.C, phases=2, edges=500, staircase=STAIRCASE[-1:])
    >>> found.good, found.rungs[-1].steady.worst_clocks
    (True, 0.0)
    """
    phases = whole_within("phases", phases, 1, 144)
    edges = whole_within("edges", edges, 100, 10_000_000)
    seed = whole_within("seed", seed, 0, 2**32 - 1)
    steady = _of_firmware(design, steady_motion(design, phases), hold_latch=hold_latch)
    long = _of_firmware(design, [long_run(design, edges, seed)], hold_latch=hold_latch)
    rungs = []
    for name, cause, timing_of in staircase:
        differences, same = [], True
        for trials in (steady, long):
            pairs = []
            for trial in trials:
                timing = timing_of(design, trial.begin_ps)
                modelled = _of_model(design, trial.exercise, timing, hold_latch=hold_latch)
                pairs.append((trial, modelled, timing))
                same = same and np.array_equal(trial.lines.times_ps, modelled.times_ps)
            differences.append(_difference(design, pairs))
        rungs.append(Rung(name=name, cause=cause, steady=differences[0], long=differences[1], identical=same))
    return Behaviour(design=design.value, hold_latch=hold_latch, phases=phases, seed=seed, rungs=tuple(rungs))


# --- both boxes ---
@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """What the firmware made of an exercise."""

    begin_ps: int
    """When the reading began from which the exercise's times count."""
    exercise: Exercise
    lines: EdgeStream
    """What the controller saw."""


def _addresses(microcontroller: Microcontroller, design: Design) -> tuple[int, int]:
    """Return where a reading begins in the committed image, and where it has ended."""
    rows = microcontroller.image(design).with_suffix(".sym").read_text(encoding="ascii").splitlines()
    places = {name: int(address, 16) for address, name in (row.split() for row in rows)}
    return places["tick"], places["work"]


def _next_reading(board: Board, tick: int, work: int) -> int:
    """Run a resting board to the beginning of a reading; return when that is."""
    while board.cpu.pc < work:
        board.idle(until_ps=board.now_ps + 100 * _US)
    waiting_ps = board.now_ps
    while board.cpu.pc >= work:
        waiting_ps = board.now_ps
        board.idle(until_ps=board.now_ps + 100 * _US)
    board.idle(until_ps=waiting_ps + 1000 * _US)  # the next one begins no earlier after the one just seen
    while board.cpu.pc != tick:
        board.idle(until_ps=board.now_ps + _US)
    return board.cpu.cycles * _US


def _of_firmware(design: Design, exercises: list[Exercise], *, hold_latch: bool) -> list[Trial]:
    """Return what the controller sees of each exercise, which begins with a reading of the firmware at rest."""
    microcontroller = Microcontroller.named("8051-12mhz")
    board = Board(design, microcontroller, hold_latch=hold_latch)
    board.start_up()
    tick, work = _addresses(microcontroller, design)
    begin_ps = _next_reading(board, tick, work)
    begun = board.snapshot()  # each exercise alike: what one leaves in the memory does not reach the next
    trials = []
    for relative in exercises:
        board.restore(begun)
        exercise = relative.after(begin_ps)
        lines = _run(exercise, lambda total, _: board.ask(total, large=True), board.process)
        trials.append(Trial(begin_ps=begin_ps, exercise=exercise, lines=lines))
    return trials


def _of_model(design: Design, exercise: Exercise, timing: Timing, *, hold_latch: bool) -> EdgeStream:
    """Return what the controller sees of the exercise behind the behavioural box."""
    edges = RealEdges.HOLD if hold_latch else RealEdges.MERGE
    box = Injector(InjectorSettings(design=design, timing=timing, real_edges=edges), initial=0)
    return _run(exercise, lambda total, at_ps: box.request(total, at_ps=at_ps), box.process)


def _run(exercise: Exercise, ask: Callable[..., None], process: Callable[..., EdgeStream]) -> EdgeStream:
    """Send the exercise through a box, stretch by stretch, each but the first with a request at its beginning."""
    times, levels = [], []
    initial, first, done = 0, None, 0
    ends_ps = [*exercise.asked_ps.tolist(), exercise.end_ps]
    for number, until_ps in enumerate(ends_ps):
        if number:
            ask(int(exercise.totals[number - 1]), int(exercise.asked_ps[number - 1]))
        stop = int(np.searchsorted(exercise.times_ps, until_ps))
        part = EdgeStream(exercise.times_ps[done:stop], exercise.levels[done:stop], initial=initial)
        seen = process(part, until_ps=until_ps)
        first = seen.initial if first is None else first
        times.append(seen.times_ps)
        levels.append(seen.levels)
        initial = int(exercise.levels[stop - 1]) if stop > done else initial
        done = stop
    return EdgeStream(np.concatenate(times), np.concatenate(levels), initial=first or 0)


# --- insertions, read off the lines ---
def insertions_of(
    design: Design, exercise: Exercise, lines: EdgeStream, timing: Timing
) -> tuple[Longs, Longs, Longs]:
    """Return transition, stretch, and changes relative to the transition, of each insertion in motion.

    Changes of the lines that are no transitions of the encoder's, a step apart, are an insertion (Original, A, C); of
    Design B it is the change that comes a decision after a copy.
    """
    if design is Design.B:
        at = np.flatnonzero(np.diff(lines.times_ps) == timing.decide_ps)
        changes = lines.times_ps[at[:, None] + np.arange(2)]
        look_ps = changes[:, 0] - timing.latency_ps
    else:
        count = design.step_counts
        own = lines.times_ps[~np.isin(lines.times_ps, exercise.times_ps)]
        starts, i = [], 0
        whole = own[count - 1 :] - own[: max(own.size - count + 1, 0)] == (count - 1) * timing.step_ps
        while i < whole.size:
            starts += [i] if whole[i] else []
            i += count if whole[i] else 1
        changes = own[np.asarray(starts, np.int64)[:, None] + np.arange(count)]
        look_ps = changes[:, 0] - timing.decide_ps
    behind = np.searchsorted(exercise.times_ps, look_ps, side="right") - 1
    stretch = np.searchsorted(exercise.asked_ps, changes[:, 0], side="right") - 1
    moving = (behind >= 0) & (look_ps - exercise.times_ps[np.maximum(behind, 0)] < _REST_PS)
    return behind[moving], stretch[moving], (changes - exercise.times_ps[np.maximum(behind, 0)][:, None])[moving]


def _difference(design: Design, pairs: list[tuple[Trial, EdgeStream, Timing]]) -> Difference:
    """Pair the insertions of each stretch of each trial in their order."""
    profile = Timing.of(design, Processor.FIRMWARE)
    late: list[Longs] = []
    same = made = paired = modelled_too = 0
    for trial, lines, timing in pairs:
        measured = insertions_of(design, trial.exercise, trial.lines, profile)
        modelled = insertions_of(design, trial.exercise, lines, timing)
        one, other = _paired(_places(measured[1]), _places(modelled[1]))
        late.append(measured[2][one] - modelled[2][other])
        same += int(np.count_nonzero(measured[0][one] == modelled[0][other]))
        made += int(measured[0].size)
        modelled_too += int(modelled[0].size)
        paired += int(one.size)
    late_ps = np.concatenate(late)
    clocks = late_ps * (CLOCKS_PER_US / _US)
    return Difference(
        insertions=made,
        unmatched=made + modelled_too - 2 * paired,
        worst_clocks=float(np.max(np.abs(clocks), initial=0.0)),
        rms_clocks=float(np.sqrt(np.mean(clocks**2))) if clocks.size else 0.0,
        share_zero=float(np.count_nonzero(np.all(late_ps == 0, axis=1))) / max(made, 1),
        share_same=same / max(made, 1),
    )


def _paired(one: Longs, other: Longs) -> tuple[Longs, Longs]:
    """Return where the numbers that both have stand in each."""
    return np.flatnonzero(np.isin(one, other)), np.flatnonzero(np.isin(other, one))


def _places(stretch: Longs) -> Longs:
    """Return a number for each insertion: its stretch, and which of the stretch's it is."""
    first = np.searchsorted(stretch, stretch, side="left")
    return stretch * 1_000_000 + np.arange(stretch.size) - first
