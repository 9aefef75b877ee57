"""One run of an algorithm judged: whether every count is right, and what is the first thing that is not."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from rtec._jit import new_record
from rtec.injector import Response, Stimulus
from rtec.readable import printable, time_text
from rtec.signal._kernels import NEVER
from rtec.verify.contract._judge_kernels import SEEN, look
from rtec.verify.contract.contract import Contract

_MOST_COUNTS = 1_000_000


class Fault(enum.Enum):
    """What an algorithm did wrong."""

    BROKEN = "broken"
    """It ended early."""
    POWER_UP = "power-up"
    """At power-up the lines behind it are not those before it."""
    ILLEGAL = "illegal transition"
    """Both lines changed at once."""
    SEPARATION = "separation"
    """A and B change so close to each other that the receiver may see one change of both."""
    COUNT = "count"
    """The controller's count is not the encoder's plus the completed steps, and nothing told the controller so."""
    UNASKED = "unasked"
    """It completed steps that nobody had asked for, or the controller's count went where nothing sent it."""
    UNFINISHED = "unfinished"
    """A request was neither completed nor refused with a reason."""
    DELAY = "delay"
    """The controller's count was wrong for too long before it was right again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """The first point of the contract that a run breaks."""

    fault: Fault
    """Which."""
    time_ps: int
    """When; of a wrong count since when it was never right again."""
    reason: str
    """In words, without the time."""

    def __str__(self) -> str:
        word = "since" if self.fault is Fault.COUNT else "at"
        return f"{self.reason}, {word} {time_text(self.time_ps)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What a run has shown."""

    violation: Violation | None
    """What does not hold, or None."""
    completed: int
    """Steps that the algorithm says it has inserted, at the end."""
    separation_ps: int | None
    """Shortest time from a change of one line at the controller to one of the other; None where there was none."""
    pulse_ps: int | None
    """Shortest time between two changes of one line there, with the other line quiet. A receiver that swallows so
    short a pulse loses no count, as it takes both changes or neither."""
    delay_ps: int
    """Longest time for which the controller's count was behind the encoder's plus the completed steps, or ahead."""

    @property
    def right(self) -> bool:
        """Return whether everything holds."""
        return self.violation is None


def judge(
    stimulus: Stimulus,
    response: Response,
    contract: Contract,
    *,
    must_finish: bool = True,
    may_refuse: bool = True,
) -> Judgement:
    """Hold one run to the contract.

    Parameters
    ----------
    must_finish
        Whether the run ends with a rest in a state in which the algorithm inserts, and long enough for it.
    may_refuse
        Whether a request may be refused instead, with a reason.

    Notes
    -----
    At the end ``controller = encoder + completed * step_counts`` has to hold, by ideal x4 decoders on both sides
    (Yee 1992, "Altering the Position Signal"). Of several things that do not hold, the first one in the order of
    `Fault` is told: an illegal transition explains a wrong count, a break everything behind it.

    Examples
    --------
    A pair of wires is no corrector: it passes every edge and inserts nothing.

    >>> from rtec.injector import Totals
    >>> from rtec.signal import EdgeStream
    >>> edges = EdgeStream.from_states([1_000_000, 2_000_000], [1, 2], 0)
    >>> asked = Stimulus(edges=edges, requests=Totals([1_500_000], [1]), until_ps=10_000_000)
    >>> wires = Response(edges=edges, completed=Totals())
    >>> judge(asked, wires, Contract(step_counts=2)).violation.reason
    '+1 step asked for, 0 completed and no reason given'
    """
    record = new_record(SEEN)
    encoder, controller, requests = stimulus.edges, response.edges, stimulus.requests
    # the largest count that completed steps make, as far as a sane algorithm gets
    room = min(contract.step_counts * int(np.abs(response.completed.totals).max(initial=0)), _MOST_COUNTS)
    look(
        record, encoder.times_ps, encoder.levels, encoder.initial, controller.times_ps, controller.levels,
        controller.initial, response.completed.times_ps, response.completed.totals, requests.times_ps,
        requests.totals, contract.step_counts, contract.delay_ps, stimulus.until_ps,
        np.full(2 * (len(encoder) + room) + 3, -1, np.int64),
    )  # fmt: skip
    # plain numbers: each look at a field of a record takes as long as this
    seen = SimpleNamespace(**dict(zip(SEEN.names or (), record.item(), strict=True)))
    asked, done = stimulus.requests.final, response.completed.final
    refused = any(t_ps >= _last_asked_ps(stimulus) for t_ps, _ in response.refusals)
    violation: Violation | None = None
    if response.broken is not None:
        violation = Violation(
            fault=Fault.BROKEN, time_ps=response.broken.time_ps, reason=printable(response.broken.reason)
        )
    elif controller.initial != encoder.initial:
        said = f"levels {_levels(controller.initial)} at power-up, the encoder's are {_levels(encoder.initial)}"
        violation = Violation(fault=Fault.POWER_UP, time_ps=0, reason=said)
    elif seen.illegal:
        reason = "A and B change at once at the controller"
        violation = Violation(fault=Fault.ILLEGAL, time_ps=seen.illegal_ps, reason=reason)
    elif seen.separation_ps < contract.separation_ps:
        apart, least = time_text(seen.separation_ps), time_text(contract.separation_ps)
        reason = f"A and B change within {apart} of each other at the controller; {least} at least"
        violation = Violation(fault=Fault.SEPARATION, time_ps=seen.separation_at_ps, reason=reason)
    elif seen.off_counts:
        reason = _wrong_count(seen.controller_counts, seen.encoder_counts, contract.step_counts, done, asked)
        violation = Violation(fault=Fault.COUNT, time_ps=seen.off_since_ps, reason=reason)
    else:
        violation = _unasked(stimulus, response)
        if violation is None and must_finish and done != asked and not (refused and may_refuse):
            why = f"refused: {printable(response.refusals[-1][1])}" if refused else "no reason given"
            reason = f"{_steps(asked)} asked for, {done:+d} completed and {why}".replace("+0 ", "0 ")
            violation = Violation(fault=Fault.UNFINISHED, time_ps=_last_asked_ps(stimulus), reason=reason)
        elif violation is None and seen.delay_ps > contract.delay_ps:
            late, most = time_text(seen.delay_ps), time_text(contract.delay_ps)
            reason = (
                f"for {late} the controller's count is not the encoder's plus the completed steps; {most} at most"
            )
            violation = Violation(fault=Fault.DELAY, time_ps=seen.delay_at_ps, reason=reason)
        elif violation is None and seen.beyond_counts:
            reason = f"the controller's count goes {seen.beyond_counts:+d} beyond all that was sent and asked for"
            violation = Violation(fault=Fault.UNASKED, time_ps=seen.beyond_ps, reason=reason)
    return Judgement(
        violation=violation,
        completed=done,
        separation_ps=None if seen.separation_ps >= NEVER else seen.separation_ps,
        pulse_ps=None if seen.pulse_ps >= NEVER else seen.pulse_ps,
        delay_ps=seen.delay_ps,
    )


def _last_asked_ps(stimulus: Stimulus) -> int:
    return int(stimulus.requests.times_ps[-1]) if len(stimulus.requests) else 0


def _unasked(stimulus: Stimulus, response: Response) -> Violation | None:
    """Find a completed total beyond all that was asked for until then."""
    asked, done = stimulus.requests, response.completed
    before = asked.times_ps.searchsorted(done.times_ps, side="right")
    totals = np.append(0, asked.totals)
    beyond = (done.totals < np.minimum.accumulate(totals)[before]) | (
        done.totals > np.maximum.accumulate(totals)[before]
    )
    if not beyond.any():
        return None
    at = int(beyond.argmax())
    reason = f"{done.totals[at]:+d} steps completed where {totals[before[at]]:+d} were asked for"
    return Violation(fault=Fault.UNASKED, time_ps=int(done.times_ps[at]), reason=reason)


def _wrong_count(controller: int, encoder: int, step: int, done: int, asked: int) -> str:
    """Say what does not fit: the total where the counts are those of other whole steps, else the counts."""
    inserted = controller - encoder
    if done != asked and inserted % step == 0:
        counts = f"controller {controller:+d}, encoder {encoder:+d}"
        said = f"{_steps(done)} said to be completed where {inserted // step:+d} were inserted ({counts})"
        return said.replace("+0 ", "0 ")
    right = encoder + step * done
    return f"the controller counts {controller:+d} where {right:+d} is right, with no illegal transition to tell it"


def _levels(code: int) -> str:
    return f"{code & 1}{code >> 1}"


def _steps(total: int) -> str:
    return f"{total:+d} step{'s' if abs(total) != 1 else ''}"
