"""How an insertion during a motion ends: in one of four ways."""

from __future__ import annotations

import enum
from dataclasses import replace

from rtec.verify.contract.contract import Contract
from rtec.verify.contract.judge import Fault, judge
from rtec.verify.contract.trials import Run


class Outcome(enum.Enum):
    """How an insertion during a motion ends."""

    CORRECT = "correct"
    """Made in time, every count right."""
    DEFERRED = "deferred"
    """Every count right, but the step was made only after the motion, or not at all."""
    ILLEGAL = "illegal"
    """A and B change at once, or so near to each other that the controller cannot tell which came first."""
    UNDETECTED = "undetected"
    """The controller's count is wrong, and no illegal transition tells it."""


def outcome_of(run: Run, contract: Contract, *, late_ps: int) -> Outcome:
    """Return how the insertion of a run ended.

    Parameters
    ----------
    late_ps
        So long after the last edge and the request an insertion may be booked that was not deferred.

    Notes
    -----
    A wrong count without an illegal transition at an ideal decoder is undetected, however near to each other the
    changes came; of runs with right counts those with changes nearer than the contract's separation are illegal.
    """
    stimulus, seen = run.case.stream.stimulus(), run.judgement
    fault = None if seen.violation is None else seen.violation.fault
    if fault is Fault.SEPARATION:
        ideal = judge(stimulus, run.response, replace(contract, separation_ps=0), must_finish=False).violation
        return Outcome.UNDETECTED if ideal is not None and ideal.fault is Fault.COUNT else Outcome.ILLEGAL
    if fault is Fault.ILLEGAL:
        return Outcome.ILLEGAL
    if fault is Fault.COUNT:
        return Outcome.UNDETECTED
    done = run.response.completed
    if done.final != stimulus.requests.final or int(done.times_ps[-1]) > run.case.stream.last_ps + late_ps:
        return Outcome.DEFERRED
    return Outcome.CORRECT
