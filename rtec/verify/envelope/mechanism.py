"""What broke in a trial that failed, read off its streams."""

from __future__ import annotations

import enum

import numpy as np

from rtec.signal import ILLEGAL, EdgeStream, count_deltas
from rtec.units import PS_PER_S
from rtec.verify.envelope import _kernels as kernels
from rtec.verify.envelope.bench import IDEAL, Longs
from rtec.verify.envelope.trials import Failure, Limit, Trials

_RAISED = 1.05
"""By so much faster a failing trial is tried with an ideal decoder, to tell the filter's share from the box's."""


class Mechanism(enum.Enum):
    """Why it cannot be faster."""

    WINDOW = "insertion window"
    """A real transition fell between the look and the last change."""
    POLLING = "polling"
    """Two transitions between two looks."""
    LATENCY = "pass-through latency"
    """A copy or a step came after the next transition."""
    FILTER = "decoder filter"
    """Changes at the controller, closer together than its filter can tell apart."""
    GATE = "speed gate"
    """The counts are right, but nothing is inserted any more."""
    NO_ANSWER = "no answer"
    """The program never inserts."""


def mechanism_of(limit: Limit[Failure], trials: Trials) -> Mechanism:
    """Return what broke in the trial just above the limit of some trials."""
    failure, bench = limit.failure, trials.bench
    if failure is None:
        return Mechanism.FILTER if limit.safe else Mechanism.NO_ANSWER
    if failure.verdict == kernels.NOT_COMPLETED:
        return Mechanism.GATE if limit.safe else Mechanism.NO_ANSWER
    bench.play(failure.moment, failure.motion, failure.phase_clocks)
    counts = bench.controller.counts()
    inserted = bench.design.step_counts * bench.words.completed
    if counts.illegal == 0 and counts.net == bench.encoder_counts + inserted:  # whatever the controller made of it
        failing = _with_ideal_decoder(failure, trials)
        if failing is None:
            return Mechanism.FILTER
        failure = failing
        bench.play(failing.moment, failing.motion, failing.phase_clocks)
    sent, seen = bench.encoder, bench.controller
    if np.isin(sent.times_ps, seen.times_ps).mean() <= 0.5:
        return through_processor(sent, seen)
    # at the gates: two transitions within a period of the looks, or one within an insertion
    own = own_changes(sent, seen)
    loop_ps = bench.cycles_ps(trials.loop_cycles)
    if own.size == 0 or PS_PER_S / (4.0 * failure.frequency_hz) <= loop_ps:
        return Mechanism.POLLING
    return Mechanism.WINDOW if np.any(sent.times_ps[1:] <= own[-1]) else Mechanism.POLLING


def _with_ideal_decoder(failure: Failure, trials: Trials) -> Failure | None:
    """Return what fails a little faster even without a filter; None where the filter alone was in the way."""
    before, trials.bench.controller_input = trials.bench.controller_input, IDEAL
    try:
        return trials.fails(failure.frequency_hz * _RAISED)
    finally:
        trials.bench.controller_input = before


def own_changes(sent: EdgeStream, seen: EdgeStream) -> Longs:
    """Return the times at which the controller sees a change that no transition made."""
    return seen.times_ps[~np.isin(seen.times_ps, sent.times_ps)]


def through_processor(sent: EdgeStream, seen: EdgeStream) -> Mechanism:
    """Tell late copies from late looks: was the copy before still under way when the first lost transition came."""
    deltas = count_deltas(seen.levels, seen.initial)
    illegal = np.flatnonzero(deltas == ILLEGAL)
    if illegal.size == 0:
        return Mechanism.POLLING
    k = int(illegal[0])
    copied_ps = seen.times_ps[k - 1] if k else -1
    merged = sent.times_ps[sent.times_ps < seen.times_ps[k]][-2:]
    return Mechanism.LATENCY if merged[0] <= copied_ps else Mechanism.POLLING
