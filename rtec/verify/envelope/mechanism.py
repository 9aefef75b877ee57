"""What broke in a trial that failed, read off its streams."""

from __future__ import annotations

import enum

import numpy as np

from rtec.signal import ILLEGAL, EdgeStream, count_deltas
from rtec.units import PS_PER_S
from rtec.verify.envelope import _kernels as kernels
from rtec.verify.envelope.bench import IDEAL, Longs, PhaseSweepBench, Shown
from rtec.verify.envelope.trials import Bursts, Failure, Streams

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


def mechanism_of(bench: PhaseSweepBench, failure: Failure, trials: Bursts | Streams) -> Mechanism:
    """Return what broke in a failing trial.

    Parameters
    ----------
    bench
        The board.
    failure
        The trial.
    trials
        Those that it is one of.
    """
    if failure.verdict == kernels.NOT_COMPLETED:
        return Mechanism.GATE
    shown = bench.show(failure.moment, failure.motion, failure.shift_ps)
    counts = shown.seen.counts()
    inserted = bench.design.step_counts * shown.completed
    if counts.illegal == 0 and counts.net == shown.sent.counts().net + inserted:  # whatever the controller made of it
        failing = _with_ideal_decoder(bench, failure, trials)
        if failing is None:
            return Mechanism.FILTER
        failure, shown = failing, bench.show(failing.moment, failing.motion, failing.shift_ps)
    through_gates = np.isin(shown.sent.times_ps, shown.seen.times_ps).mean() > 0.5
    if through_gates:
        return _at_gates(bench, failure, shown, trials)
    return through_processor(shown.sent, shown.seen)


def _with_ideal_decoder(bench: PhaseSweepBench, failure: Failure, trials: Bursts | Streams) -> Failure | None:
    """Return what fails a little faster even without a filter; None where the filter alone was in the way."""
    before, bench.controller = bench.controller, IDEAL
    try:
        return trials.fails(failure.frequency_hz * _RAISED)
    finally:
        bench.controller = before


def own_changes(shown: Shown) -> Longs:
    """Return the times at which the controller sees a change that no transition made."""
    return shown.seen.times_ps[~np.isin(shown.seen.times_ps, shown.sent.times_ps)]


def _at_gates(bench: PhaseSweepBench, failure: Failure, shown: Shown, trials: Bursts | Streams) -> Mechanism:
    """Tell the insertion window from polling: two transitions within a period of the looks."""
    own, sent = own_changes(shown), shown.sent.times_ps
    loop_ps = trials.loop_cycles * bench.cycle_ps if isinstance(trials, Bursts) else 0.0
    if own.size == 0 or PS_PER_S / (4.0 * failure.frequency_hz) <= loop_ps:
        return Mechanism.POLLING
    return Mechanism.WINDOW if np.any(sent[1:] <= own[-1]) else Mechanism.POLLING


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
