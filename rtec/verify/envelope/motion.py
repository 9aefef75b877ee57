"""How fast the axis may go in a motion: the running firmware as an insertion algorithm, judged like any other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from rtec.axis import Program
from rtec.axis.motion import ACCELERATION_HZ_S, MotionKind
from rtec.checks import number_within, whole_within
from rtec.injector import Design
from rtec.verify.bench import Bench
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.frequencies import Does, Frequencies, search
from rtec.verify.contract.judge import Fault
from rtec.verify.contract.motion_outcome import Outcome, outcome_of
from rtec.verify.contract.motions import motion_cases
from rtec.verify.contract.speeds import Speeds
from rtec.verify.contract.trials import Run, Trials
from rtec.verify.envelope.mechanism import Mechanism, own_changes, through_processor
from rtec.verify.envelope.speeds import TO_HZ, passing_alone
from rtec.verify.firmware.algorithm import Firmware

_FROM_HZ = 1.0e3
_LOOP_CYCLES = 2
"""Of a waiting loop, JB to itself."""
_DIGITS = (1.0, 2.0, 5.0)
"""A run of firmware takes a hundred times as long as one of the envelope's own trials: three levels per decade."""
_EVERY = {MotionKind.STEADY: 7, MotionKind.REVERSAL: 7, MotionKind.DITHER: 3, MotionKind.ADVERSARY: 23}
"""Of the runs of a motion one in so many is made: primes, so that directions, signs and states are all met. At the
limit found all are; where one fails, the limit lies lower."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InMotion:
    """The motion in which the envelope is looked for; its top speed is the frequency searched.

    Raises
    ------
    ArgumentError
        A value outside its range.
    """

    kind: MotionKind
    """How the axis moves."""
    program: Program | None = None
    """Of a programme."""
    acceleration_hz_s: float = ACCELERATION_HZ_S
    """Of the encoder's frequency."""
    seed: int = 0
    """Of the adversary."""

    def __post_init__(self) -> None:
        number_within("acceleration_hz_s", self.acceleration_hz_s, 1.0, 1e12, unit="Hz/s")
        whole_within("seed", self.seed, 0, 2**63 - 1)


def limit_in_motion(
    bench: Bench, motion: InMotion, top_hz: float, progress: Callable[[float], None] = lambda share: None
) -> tuple[Speeds, Mechanism, int]:
    """Return what a board does with each frequency as the top speed of a motion, what breaks first, and runs made.

    The board comes from power-up; one that inserts nothing at rest does nothing in any motion.
    """
    board, design = Firmware(bench), bench.design
    contract = replace(Contract.of(design), delay_ps=board.delay_ps, acceleration_hz_s=motion.acceleration_hz_s)
    rest = Trials(board, contract)
    if rest.measure_settling() is not None:
        return passing_alone(0.0, top_hz), Mechanism.NO_ANSWER, 0
    cases = motion_cases(motion.kind, program=motion.program, seed=motion.seed)
    wrong: dict[float, Run] = {}
    made = rest.made

    def does(hertz: float, every: int = _EVERY.get(motion.kind, 1)) -> Does:
        nonlocal made
        trials = Trials(board, replace(contract, frequency_hz=hertz))
        trials.settle_ps = rest.settle_ps
        deferred = False
        for case in islice(cases(trials), 0, None, every):
            run = trials.one(case)
            if not run.right:
                wrong[hertz] = run
                break
            # the program says in the reading behind an insertion what it has inserted
            if not deferred and _moved_on(run, rest.settle_ps):
                deferred = outcome_of(run, contract, late_ps=bench.reading_ps) is Outcome.DEFERRED
        made += trials.made
        return Does.FAILS if hertz in wrong else Does.PASSES if deferred else Does.INSERTS

    found = search(does, top_hz, from_hz=_FROM_HZ, to_hz=TO_HZ, digits=_DIGITS, deeper=0, progress=progress)
    while (limit_hz := found.max_passing_hz) and does(limit_hz, every=1) is Does.FAILS:
        found = Frequencies(rows=tuple((hz, Does.FAILS if hz == limit_hz else what) for hz, what in found.rows))
    first = wrong[min(wrong)] if wrong else None
    limited_by = Mechanism.GATE if first is None else broken_in(first, design, bench.cycles_ps(_LOOP_CYCLES))
    return Speeds(frequencies=found, top_hz=top_hz, first_wrong=first), limited_by, made


def _moved_on(run: Run, settle_ps: int) -> bool:
    """Return whether the axis moved for longer than a step takes once it was asked for."""
    stream = run.case.stream
    return stream.edges_ps.size > 0 and bool(stream.edges_ps[-1] - stream.requests_ps[-1] >= settle_ps)


def broken_in(run: Run, design: Design, loop_ps: float) -> Mechanism:
    """Return what broke in a run that is wrong; ``loop_ps`` is the period of a waiting loop."""
    sent, seen = run.case.stream.stimulus().edges, run.response.edges
    if run.fault is Fault.BROKEN:
        return Mechanism.NO_ANSWER
    if run.fault in (Fault.UNFINISHED, Fault.DELAY):
        return Mechanism.GATE
    if run.fault is Fault.SEPARATION:
        return Mechanism.FILTER
    if design.in_path:
        return through_processor(sent, seen)
    own_ps = own_changes(sent, seen)
    if own_ps.size == 0:
        return Mechanism.POLLING
    last_ps = sent.times_ps[sent.times_ps <= own_ps[-1]][-2:]
    return Mechanism.POLLING if last_ps.size == 2 and np.diff(last_ps)[0] <= loop_ps else Mechanism.WINDOW
