"""How fast may the encoder go, for this design on this processor? Found by trials on the running firmware."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from firmware_model import FirmwareError, Image
from rtec.board import MICROCONTROLLERS, Microcontroller
from rtec.checks import whole_within
from rtec.errors import RtecError
from rtec.injector import Design
from rtec.jobs import Workers
from rtec.verify.bench import Bench
from rtec.verify.contract.frequencies import Does
from rtec.verify.contract.speeds import Speeds
from rtec.verify.envelope import _kernels as kernels
from rtec.verify.envelope.bench import PhaseSweepBench
from rtec.verify.envelope.gate import gate_of
from rtec.verify.envelope.mechanism import Mechanism, mechanism_of
from rtec.verify.envelope.motion import InMotion, limit_in_motion
from rtec.verify.envelope.speeds import passing_alone, speeds_of
from rtec.verify.envelope.trials import Bursts, Failure, Streams, Trials

RAPID_HZ, MODERATE_HZ, GOAL_HZ = 30_000, 100_000, 500_000
"""The demonstration machine's rapid traverse, "moderate by today's standards", and what was "on the horizon"."""

_PHASES, _PHASES_EXHAUSTIVE = 2, 4
"""Phases between program and transitions from which ramps begin."""
_WORDS = {
    kernels.ILLEGAL: "an illegal transition at the controller",
    kernels.WRONG_COUNT: "a wrong count at the controller",
    kernels.NOT_COMPLETED: "what was asked for was not completed",
    kernels.FAULT: "the processor stopped with a fault",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvelopePlan:
    """What is tried.

    Raises
    ------
    ArgumentError
        A jitter below zero or above a millisecond.
    """

    designs: Sequence[Design] = tuple(Design)
    processors: Sequence[Microcontroller] = tuple(MICROCONTROLLERS.values())
    """All pairs of them."""
    image: Path | Image | None = None
    """A user's program in place of the committed ones."""
    hold_latch: bool = False
    """Whether the boards have the latch that holds real transitions back during an insertion."""
    jitter_ps: int = 0
    """Bound of the encoder's jitter, taken at its worst."""
    exhaustive: bool = False
    """Whether the limit found is swept over a whole reading clock by clock."""
    nothing_owed: bool = False
    """Whether nothing is asked for, so that only passing the lines on is tried."""
    motion: InMotion | None = None
    """In which the axis moves, in place of the envelope's own trials; jitter, exhaustive and nothing_owed do not go
    with it."""

    def __post_init__(self) -> None:
        whole_within("jitter_ps", self.jitter_ps, 0, 1_000_000_000, unit="ps")


@dataclass(frozen=True, slots=True, kw_only=True)
class FailingTrial:
    """The trial just above the limit that failed, so that it can be found again."""

    frequency_hz: float
    """Of the encoder's square waves."""
    phase_clocks: int | None = None
    """Clocks of the processor from the beginning of the sweep to the first transition."""
    direction: int | None = None
    sign: int | None = None
    """``direction``, ``sign``: of the motion, +1 or -1, and of the steps owed, 0 for none."""
    behind_state: int | None = None
    """State 1..4 of the report's table behind which the insertion was set off; None in a steady stream."""
    what: str
    """Went wrong."""
    stream: str | None = None
    """In a motion all of it, as ``rtec check --stream`` plays it again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvelopeRow:
    """The envelope of one design on one processor."""

    plan: EnvelopePlan
    """By which it was found."""
    design: Design
    processor: Microcontroller
    """``design``, ``processor``: what was on the board."""
    max_safe_hz: float
    """Largest safe frequency of the encoder's square waves; 0.0 where there is none."""
    limited_by: Mechanism
    """What breaks first."""
    failing: FailingTrial | None
    """The first trial that failed, or None."""
    speeds: Speeds
    """What it does at each frequency, and which jitter and acceleration it stands."""
    trials: int
    """Made in all."""
    gate_hz: float | None = None
    max_acceleration_counts_s2: float | None = None
    """What the speed gate does (`gate_of`)."""
    loop_cycles: int | None = None
    """Period of the waiting loop; None for a program that passes the lines on."""

    @property
    def checked_to_hz(self) -> float | None:
        """Return up to which frequency above the speed gate steady streams were tried; None where to none."""
        above = self._above_gate()
        return above[-1][0] if above else None

    @property
    def counts_right(self) -> bool | None:
        """Return whether every count was right there; None where nothing was tried."""
        above = self._above_gate()
        return all(does is not Does.FAILS for _, does in above) if above else None

    def _above_gate(self) -> list[tuple[float, Does]]:
        if self.gate_hz is None:
            return []
        # lines that pass through the processor are lost above the safe frequency, gate or not
        most_hz = self.max_safe_hz if self.design.in_path else math.inf
        return [row for row in self.speeds.frequencies.rows if self.gate_hz < row[0] <= most_hz]

    @property
    def reaches_500khz(self) -> bool:
        """Return whether it is safe at the frequency that the report sees coming."""
        return self.max_safe_hz >= GOAL_HZ

    def to_dict(self) -> dict[str, object]:
        """Return the row as plain data under the names that scripts rely on."""
        plan, speeds, acceleration = self.plan, self.speeds, self.max_acceleration_counts_s2
        return {
            "design": self.design.value,
            "processor": self.processor.name,
            "clock_hz": self.processor.clock_hz,
            "max_safe_hz": self.max_safe_hz,
            "limited_by": self.limited_by.value,
            "reaches_500khz": self.reaches_500khz,
            "gate_hz": self.gate_hz,
            "counts_right_above_gate": self.counts_right,
            "checked_to_hz": self.checked_to_hz,
            "max_inserting_hz": speeds.frequencies.max_inserting_hz,
            "max_passing_hz": speeds.frequencies.max_passing_hz,
            "at_500khz": speeds.at_top.value,
            "summary": speeds.summary,
            "frequencies": [{"frequency_hz": hertz, "does": does.value} for hertz, does in speeds.frequencies.rows],
            "max_jitter_ps": speeds.max_jitter_ps,
            "max_acceleration_hz_s": speeds.max_acceleration_hz_s,
            "data_sheet": dict(speeds.data_sheet()),
            "max_acceleration_counts_s2": acceleration,
            "max_acceleration_m_s2_at_1um": None if acceleration is None else acceleration * 1e-6,
            "failing": None if self.failing is None else asdict(self.failing),
            "waiting_loop_cycles": self.loop_cycles,
            "trials": self.trials,
            "sweep": "exhaustive" if plan.exhaustive else "short",
            "jitter_ps": plan.jitter_ps,
            "hold_latch": plan.hold_latch,
            "motion": None if plan.motion is None else plan.motion.kind.value,
        }


def find_envelope(plan: EnvelopePlan, progress: Callable[[float], None] = lambda share: None) -> list[EnvelopeRow]:
    """Carry out a plan; return a row for each processor and design.

    Parameters
    ----------
    plan
        What is tried.
    progress
        Called with the share done.

    Raises
    ------
    RtecError
        An image that cannot be read.

    Examples
    --------
    Below the 30 kHz that are marginal by the report, as the program looks once more behind its latch:

    >>> plan = EnvelopePlan(designs=[Design.ORIGINAL], processors=[Microcontroller.named("8051-12mhz")])
    >>> row = find_envelope(plan)[0]
    >>> round(row.max_safe_hz / 1000), row.limited_by.value
    (22, 'insertion window')
    """
    pairs = [(processor, design) for processor in plan.processors for design in plan.designs]
    with Workers(lambda _, share: progress(share), total=max(len(pairs), 1)) as workers:
        rows = [
            workers.start(f"{design.value} on {processor.name}", 1.0, partial(_row, plan, design, processor))
            for processor, design in pairs
        ]
        return [row.result() for row in rows]


def _row(
    plan: EnvelopePlan, design: Design, processor: Microcontroller, progress: Callable[[float], None]
) -> EnvelopeRow:
    row = partial(EnvelopeRow, plan=plan, design=design, processor=processor)
    try:
        if plan.motion is not None:
            watched = Bench(design, processor, plan.image, hold_latch=plan.hold_latch)
            return _in_motion(row, watched, plan.motion, progress)
        bench = PhaseSweepBench(design, processor, plan.image, hold_latch=plan.hold_latch)
    except FirmwareError as error:
        raise RtecError(str(error)) from error
    trials: Trials
    if design.in_path:
        trials = Streams(bench, plan.jitter_ps, asked=not plan.nothing_owed)
    else:
        trials = Bursts(bench, plan.jitter_ps)
    progress(0.1)
    limit = trials.limit(exhaustive=plan.exhaustive)
    progress(0.5)
    limited_by, failure = mechanism_of(limit, trials), limit.failure
    speeds, gate_hz, acceleration = passing_alone(limit.safe, GOAL_HZ), None, None
    if not plan.nothing_owed:
        if limit.safe:
            top_hz = limit.safe if design.in_path else math.inf
            phases = _PHASES_EXHAUSTIVE if plan.exhaustive else _PHASES
            gate_hz, acceleration = gate_of(bench, limit.safe, plan.jitter_ps, top_hz=top_hz, phases=phases)
        progress(0.7)
        most_hz_s = math.inf if acceleration is None else acceleration / 4.0
        speeds = speeds_of(trials, limit.safe, most_hz_s, GOAL_HZ)
    return row(
        max_safe_hz=limit.safe, limited_by=limited_by, failing=None if failure is None else _named(failure),
        speeds=speeds, trials=bench.trials, gate_hz=gate_hz, max_acceleration_counts_s2=acceleration,
        loop_cycles=trials.loop_cycles or None,
    )  # fmt: skip


def _in_motion(
    row: Callable[..., EnvelopeRow], bench: Bench, motion: InMotion, progress: Callable[[float], None]
) -> EnvelopeRow:
    speeds, limited_by, trials = limit_in_motion(bench, motion, GOAL_HZ, progress)
    wrong, failing = speeds.first_wrong, None
    if wrong is not None:
        at_hz = next(hertz for hertz, does in speeds.frequencies.rows if does is Does.FAILS)
        failing = FailingTrial(frequency_hz=at_hz, what=str(wrong.judgement.violation), stream=str(wrong.case.stream))
    safe_hz = speeds.frequencies.max_passing_hz
    return row(max_safe_hz=safe_hz, limited_by=limited_by, failing=failing, speeds=speeds, trials=trials)


def _named(failure: Failure) -> FailingTrial:
    motion = failure.motion
    return FailingTrial(
        frequency_hz=failure.frequency_hz,
        phase_clocks=failure.phase_clocks,
        direction=motion.direction,
        sign=(motion.total > 0) - (motion.total < 0),
        # a steady stream asks on its way, and tells nothing of where it was set off
        behind_state=None if motion.ask_at >= 0 else (failure.moment.state + motion.direction) % 4 + 1,
        what=_WORDS[failure.verdict],
    )
