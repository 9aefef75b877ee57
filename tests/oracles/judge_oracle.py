"""What the contract of a corrector says of one run, written from its words, without compiled code.

The run is a list of instants. After each of them the encoder, the controller and the completed total have a value;
what the words of `rtec.verify.contract.judge.Fault` say is looked up in these lists, however long that takes.
"""

from dataclasses import dataclass
from itertools import pairwise

from rtec.verify.contract.judge import Fault

FORWARD = {0: 1, 1: 3, 3: 2, 2: 0}
"""Levels A + 2 B, and those one count later."""


@dataclass
class Seen:
    """What a run shows."""

    fault: Fault | None
    separation_ps: int | None
    pulse_ps: int | None
    delay_ps: int


def moved(before, after):
    """Return the counts from levels to levels; None where both lines change."""
    if before == after:
        return 0
    if FORWARD[before] == after:
        return 1
    return -1 if FORWARD[after] == before else None


def counted(edges, until_ps):
    """Return the count after each edge as a list of (time, count), and the times at which both lines change."""
    history, illegal, level, count = [(0, 0)], [], edges.initial, 0
    for t, after in zip(edges.times_ps.tolist(), edges.levels.tolist(), strict=True):
        if t >= until_ps:
            break
        step = moved(level, after)
        if step is None:
            illegal.append(t)
        count, level = count + (step or 0), after
        history.append((t, count))
    return history, illegal


def at(history, t_ps):
    """Return the value that holds from a time on."""
    return [value for t, value in history if t <= t_ps][-1]


def asked_until(requests, t_ps):
    return [0, *(n for t, n in zip(requests.times_ps.tolist(), requests.totals.tolist(), strict=True) if t <= t_ps)]


def seen(stimulus, response, contract, *, must_finish=True, may_refuse=True):
    """Judge a run."""
    until, step = stimulus.until_ps, contract.step_counts
    encoder, _ = counted(stimulus.edges, until)
    controller, illegal = counted(response.edges, until)
    pairs = zip(response.completed.times_ps.tolist(), response.completed.totals.tolist(), strict=True)
    done = [(0, 0), *((t, n) for t, n in pairs if t < until)]
    instants = sorted({t for history in (encoder, controller, done) for t, _ in history})
    right = [(t, at(encoder, t) + step * at(done, t)) for t in instants]
    separation, pulse = nearest(response.edges, until)
    delay = longest_delay(right, controller, instants, until)
    asked = stimulus.requests.final
    last_asked = max(stimulus.requests.times_ps.tolist(), default=0)
    refused = may_refuse and any(t >= last_asked for t, _ in response.refusals)
    too_many = [
        t
        for t, n in zip(response.completed.times_ps.tolist(), response.completed.totals.tolist(), strict=True)
        if not min(asked_until(stimulus.requests, t)) <= n <= max(asked_until(stimulus.requests, t))
    ]
    in_turn = (
        (Fault.BROKEN, response.broken is not None),
        (Fault.POWER_UP, response.edges.initial != stimulus.edges.initial),
        (Fault.ILLEGAL, bool(illegal)),
        (Fault.SEPARATION, separation is not None and separation < contract.separation_ps),
        (Fault.COUNT, at(controller, until) != right[-1][1]),
        (Fault.UNASKED, bool(too_many)),
        (Fault.UNFINISHED, must_finish and response.completed.final != asked and not refused),
        (Fault.DELAY, delay > contract.delay_ps),
        (Fault.UNASKED, strays(stimulus, encoder, controller, contract)),
    )
    fault = next((fault for fault, holds in in_turn if holds), None)
    return Seen(fault=fault, separation_ps=separation, pulse_ps=pulse, delay_ps=delay)


def nearest(edges, until_ps):
    """Return the shortest time from a change of one line to one of the other, and between two of one line alone."""
    changes, level = [], edges.initial
    for t, after in zip(edges.times_ps.tolist(), edges.levels.tolist(), strict=True):
        if t < until_ps:
            changes.append((t, level ^ after))
            level = after
    gaps = [(b - a, lines == others) for (a, lines), (b, others) in pairwise(changes)]
    return min((gap for gap, same in gaps if not same), default=None), min(
        (g for g, same in gaps if same), default=None
    )


def longest_delay(right, controller, instants, until_ps):
    """Return the longest time for which the controller shows what is not right, or is right no longer."""
    longest = 0
    for k, t in enumerate(instants):
        shown = at(controller, t)
        end = instants[k + 1] if k + 1 < len(instants) else until_ps
        if shown == at(right, t):
            continue
        wrong_since = t  # since then without a break
        for earlier in reversed(instants[:k]):
            if at(controller, earlier) == at(right, earlier):
                break
            wrong_since = earlier
        # when it was right for the last time, and became wrong since what is right went on
        left = [u for (_, v), (u, w) in pairwise(right) if u <= t and v == shown != w]
        longest = max(longest, end - max([wrong_since, *left]))
    return longest


def strays(stimulus, encoder, controller, contract):
    """Return whether a count of the controller lies outside what the encoder sent lately and what was asked for."""
    for t, shown in controller[1:]:
        asked = asked_until(stimulus.requests, t)
        lately = [at(encoder, t)]
        lately += [v for (_, v), (u, _) in pairwise(encoder) if t - contract.delay_ps < u <= t]
        low, high = (contract.step_counts * total for total in (min(asked), max(asked)))
        if not any(count + low <= shown <= count + high for count in lately):
            return True
    return False
