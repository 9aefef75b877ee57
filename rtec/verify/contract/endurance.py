"""Endurance: many steps, long travel, long rests, jumps of the request; as deep as the algorithm's pace allows."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from rtec.injector import Algorithm, Reach
from rtec.readable import time_text
from rtec.units import PS_PER_S
from rtec.verify.contract.cases import GOLDEN, start, steady
from rtec.verify.contract.contract import STATES
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.trials import Case, Run, Trials

MOST_S = 20.0
"""A level that would take longer, by the pace of the one before, is left out, and the data sheet says so."""

STEPS = (300, 3_300, 33_000, 70_000)
"""Past the wraps of a byte at 128 and 256, and of two bytes at 32 768 and 65 536."""
COUNTS = (1_000, 8_000, 70_000)
RESTS_PS = tuple(round(seconds * PS_PER_S) for seconds in (0.006, 0.03, 0.15, 1.1, 5.0, 30.0, 180.0, 1000.0, 4500.0))
JUMPS = (3, 5, 20, 101, 300, 3_300, 33_000)

_WRAPS = (127, 128, 255, 256, 32_767, 32_768, 65_535, 65_536)
"""Totals around which every kind of change comes at every moment."""
_KINDS = ("over an edge", "over and back", "withdrawn", "doubled", "turned round")
_SHARES = (0.1, 0.5, 0.9, 1.0)
"""Moments of an insertion."""
_EVERY = 101
"""In a long walk one step in so many is disturbed, all of them in the shortest."""
_AT_ONCE = 8
_BACK = 300
_APART = 1.5
"""Ratio of two rests."""
_WORDS = tuple(2**bits * unit_ps for bits in (15, 16, 31, 32) for unit_ps in (1, 1_000, 1_000_000))
"""Rests at which a timer of 16 or 32 bits overflows that counts ps, ns or us."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """Cases that go to one depth."""

    depth: int
    """Steps, counts, or ps."""
    cases: Sequence[Case] | Iterator[Case]
    work: float
    """How long it takes, against other levels of the same kind."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Endured:
    """How deep a check of endurance went."""

    wrong: Run | None
    made: int
    depth: int
    """Of the deepest level that was right throughout."""
    limit: str
    """Why it went no deeper, or ""."""

    def text(self, kind: Kind) -> str:
        """Return one line for a data sheet."""
        said = kind.text(self.depth) if self.depth else "nothing"
        if self.wrong is not None:
            return f"fails; right to {said}" if self.depth else "fails"
        return f"{said}; {self.limit}" if self.limit else said


class Refusal(enum.Enum):
    """What a refusal means for a check of endurance."""

    ENDS = "ends"
    """Where one comes, the check has gone as deep as it can."""
    BOUNDS = "bounds"
    """What was completed is as deep as it goes; more has to be refused, too."""
    MEANS_NOTHING = "means nothing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A check of endurance."""

    name: str
    levels: Callable[[Trials], Iterator[Level]]
    text: Callable[[int], str]
    """Writes a depth."""
    key: str
    """Of its depth in JSON."""
    refusal: Refusal = Refusal.MEANS_NOTHING
    """What a refusal with a reason, which is right, means for the depth."""


def reach_of(algorithm: Algorithm) -> Reach:
    """Return what can be asked of an algorithm."""
    reach = getattr(algorithm, "reach", None)
    return reach if isinstance(reach, Reach) else Reach()


def endure(trials: Trials, kind: Kind, *, most_s: float = MOST_S) -> Endured:
    """Go level by level as deep as all is right, the next level takes ``most_s`` at most, and runs may be as long.

    Examples
    --------
    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.verify.contract.contract import Contract
    >>> from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
    >>> fast = Timing.of(Design.C, Processor.FAST)
    >>> box = BuiltIn(InjectorSettings(design=Design.C, timing=fast, real_edges=RealEdges.HOLD))
    >>> trials = Trials(box, Contract.of(Design.C))
    >>> trials.measure_settling(), endure(trials, KINDS[3]).depth
    (None, 33000)
    """
    longest_ps = reach_of(trials.algorithm).longest_ps
    begun_runs, depth, pace, limit = trials.made, 0, 0.0, ""
    wrong: Run | None = None
    for level in kind.levels(trials):
        if pace * level.work > most_s:
            limit = f"{kind.text(level.depth)} would take about {pace * level.work:.0f} s here"
            break
        begun, cases = time.monotonic(), list(level.cases)
        if longest_ps is not None and any(case.stream.until_ps > longest_ps for case in cases):
            limit = f"its output is kept for {time_text(longest_ps)}"
            break
        wrong, went, refused = _level(trials, cases)
        if wrong is not None:
            break
        if refused and kind.refusal is not Refusal.MEANS_NOTHING:
            depth, limit = max(depth, went), f"more is refused: {refused}"
            if kind.refusal is Refusal.ENDS:
                break
        else:
            depth = level.depth
        pace = (time.monotonic() - begun) / level.work
    return Endured(wrong=wrong, made=trials.made - begun_runs, depth=depth, limit=limit)


def _level(trials: Trials, cases: Sequence[Case]) -> tuple[Run | None, int, str]:
    """Make runs up to the first that is wrong; return it, the largest total completed, and why more was refused."""
    went, refused = 0, ""
    for first in range(0, len(cases), _AT_ONCE):
        for run in trials.all_of(cases[first : first + _AT_ONCE]):
            if not run.right:
                return run, went, refused
            went = max(went, int(np.abs(run.response.completed.totals).max(initial=0)))
            refused = run.response.refusals[-1][1] if run.response.refusals else refused
    return None, went, refused


def _window(trials: Trials, state: int, sign: int) -> tuple[int, int]:
    """Return begin and end of an insertion at rest, from its request on."""
    asked_ps = trials.asked_ps
    _, window = trials.at_rest(state, sign)
    begin_ps, end_ps = window or (asked_ps, asked_ps + 2)
    return max(begin_ps - asked_ps, 1), max(end_ps - asked_ps, 2)


def walking(trials: Trials) -> Iterator[Level]:
    """Yield walks of the total, step by step, both ways; requests and edges come in the middle of insertions."""
    states, reach = trials.contract.states, reach_of(trials.algorithm)
    in_every_state = reach.longest_ps is None  # of machine code a run takes a second
    for number, most in enumerate(sorted({min(steps, reach.total) for steps in STEPS})):
        cases = []
        for index, sign in enumerate((1, -1)):
            one = states[(number + index) % len(states)]
            for state in states if number == 0 and in_every_state else [one]:
                back = 0 if number == 0 else max(most - _BACK, 0)
                totals = [sign * n for n in (*range(1, most + 1), *range(most - 1, back - 1, -1))]
                walks = (walk(trials, state, totals, every) for every in (1 if number == 0 else _EVERY, most + 1, 0))
                # of a record that is too short for all that, the steps alone
                stream = next(
                    (one for one in walks if reach.longest_ps is None or one.until_ps <= reach.longest_ps),
                    None,
                ) or walk(trials, state, totals, 0)  # fmt: skip
                cases.append(Case(title=f"{sign * most:+d} steps, one by one", stream=stream))
        yield Level(depth=most, cases=cases, work=float(sum(len(case.stream) for case in cases)))


def walk(trials: Trials, state: int, totals: Sequence[int], every: int) -> Stream:
    """Return a stream that asks for one total after the other at rest, each a step from the one before.

    One step in ``every`` is disturbed, those next to a wrap in every way and at every moment; with 0 none at all.
    """
    gap_ps, turn_ps = trials.settle_ps, trials.contract.turn_ps
    windows = {sign: _window(trials, state, sign) for sign in (1, -1)}
    most = max(abs(total) for total in totals)
    t_ps = trials.contract.quarter_ps + gap_ps
    requests: list[tuple[int, int]] = []
    edges: list[tuple[int, int]] = []
    ways = list(product(_KINDS, _SHARES))
    for index, (before, total) in enumerate(pairwise([0, *totals])):
        sign = total - before
        disturbed: list[tuple[str, float]] = []
        if every and {abs(before), abs(total)} & {*_WRAPS, most}:
            disturbed = ways
        elif every and index % every == 0:
            disturbed = [ways[index // every * 7 % len(ways)]]
        for kind, share in disturbed:
            begin_ps, end_ps = windows[sign]
            at_ps = t_ps + max(round(begin_ps + share * (end_ps - begin_ps)), 1)
            requests.append((t_ps, total))
            other = {"withdrawn": before, "doubled": total + sign, "turned round": before - sign}.get(kind)
            if other is None:
                edges += [(at_ps, sign), (at_ps + (turn_ps if kind == "over and back" else 2 * gap_ps), -sign)]
            elif abs(other) <= most:
                requests.append((at_ps, other))
            t_ps += 3 * gap_ps
            requests.append((t_ps, before))
            t_ps += 2 * gap_ps
        requests.append((t_ps, total))
        t_ps += gap_ps
    return Stream.of(state, edges, requests, t_ps + 2 * gap_ps)


def travelling(trials: Trials) -> Iterator[Level]:
    """Yield long travel each way, at the highest frequency and at one at which an edge leaves room for a step."""
    contract, longest_ps = trials.contract, reach_of(trials.algorithm).longest_ps
    for counts in COUNTS:
        slow_ps = min(max(trials.settle_ps, contract.quarter_ps), 100 * contract.quarter_ps)
        if longest_ps is not None:
            slow_ps = max(min(slow_ps, (longest_ps - 6 * trials.settle_ps) // counts), contract.quarter_ps)
        cases = []
        for direction, apart_ps in product((1, -1), dict.fromkeys((contract.quarter_ps, slow_ps))):
            edges = steady(PS_PER_S / (4.0 * apart_ps), direction, counts, first_ps=apart_ps)
            state = int(contract.states[0] - edges[:, 1].sum()) % 4
            asked = sorted(
                {*range(100, counts, 500)}
                | {at for bits in range(8, 17) for at in range(2**bits - 16, 2**bits + 17, 4) if 0 < at < counts}
            )
            requests = [
                (int(edges[at, 0]) + round(number * GOLDEN % 1.0 * (apart_ps - 1)), (1, 0, -1, 0)[number % 4])
                for number, at in enumerate(asked)
            ]
            until_ps = int(edges[-1, 0]) + 4 * trials.settle_ps
            stream = Stream.of(state, edges, requests, until_ps)
            cases.append(Case(title=f"{direction * counts:+d} counts of travel", stream=stream))
        yield Level(depth=counts, cases=cases, work=float(counts))


def resting(trials: Trials) -> Iterator[Level]:
    """Yield rests, each longer than the last, and what comes behind them: a step, a start, an edge and back."""
    for shorter_ps, longest_ps in pairwise((RESTS_PS[0] // 6, *RESTS_PS)):
        number = int(np.ceil(np.log(longest_ps / shorter_ps) / np.log(_APART)))
        rests = {round(at) for at in np.geomspace(longest_ps, shorter_ps, number, endpoint=False)}
        rests |= {at for at in _WORDS if shorter_ps < at <= longest_ps}
        cases = [
            after_rest(trials, rest_ps, number, behind)
            for number, (rest_ps, behind) in enumerate(product(sorted(rests), range(8)))
        ]
        yield Level(depth=longest_ps, cases=cases, work=float(longest_ps))


def after_rest(trials: Trials, rest_ps: int, number: int, behind: int) -> Case:
    """Return a run with a step and an edge before a rest, in either order, and one of four things behind it."""
    contract, gap_ps = trials.contract, trials.settle_ps
    state = contract.states[number // 8 % len(contract.states)]
    way, sign = (1, -1)[number // 16 % 2], (1, -1)[number % 2]
    first_ps = contract.quarter_ps + gap_ps
    edges = [(first_ps, way), (first_ps + gap_ps, -way)]
    requests = [(first_ps + 2 * gap_ps, sign)]
    if behind % 2:  # the edge comes last
        requests = [(first_ps - gap_ps // 2, sign)]
    last_ps = edges[-1][0] if behind % 2 else requests[-1][0]
    t_ps = last_ps + rest_ps + 1 + round(number * GOLDEN % 1.0 * 1_000_000)
    what = ("a step", "a start", "an edge and back", "a step that waits")[behind // 2]
    if what == "a start":
        leaving = start(contract, way, 12, depth=0.01)
        leaving[:, 0] += t_ps
        edges += [(int(at_ps), way) for at_ps in leaving[:, 0]]
        t_ps = int(leaving[4, 0])
    elif what == "an edge and back":
        edges += [(t_ps + 1_000, way), (t_ps + 1_000 + contract.turn_ps, -way)]
    elif what == "a step that waits":  # in a state without insertions it has waited for all the rest
        edges += [(last_ps + gap_ps, way), (t_ps + gap_ps, -way)]
        t_ps = last_ps + gap_ps + 1
    requests.append((t_ps, 2 * sign if number % 3 else 0))
    stream = Stream.of(state, edges, requests, 1)
    rests = f"{time_text(rest_ps)} of rest, then {what}, in state {STATES[state]}"
    return trials.case(rests, stream)


def jumping(trials: Trials) -> Iterator[Level]:
    """Yield jumps of the request; where one is completed, it also jumps over to the other side, and back to zero."""
    state, first_ps = trials.contract.states[0], trials.contract.quarter_ps
    for most in sorted({min(jump, reach_of(trials.algorithm).total) for jump in JUMPS}):

        def cases(most: int = most) -> Iterator[Case]:
            for sign in (1, -1):
                once = Stream.of(state, (), [(first_ps, sign * most)], 1)
                case = trials.case(f"a jump of the request to {sign * most:+d}", once)
                run = trials.one(case)
                if not run.right or run.response.refusals:
                    yield case
                else:
                    at_ps = first_ps + (most + 1) * trials.settle_ps
                    # the last of them is the one that may be refused
                    for then in (-sign * most, 0):
                        over = once.asking((first_ps, sign * most), (at_ps, then))
                        yield trials.case(f"jumps of the request to {sign * most:+d} and {then:+d}", over)

        yield Level(depth=most, cases=cases(), work=float(most))


def _steps_text(steps: int) -> str:
    return f"{steps} steps each way"


KINDS = (
    Kind(name="many steps", key="steps", levels=walking, text=_steps_text, refusal=Refusal.ENDS),
    Kind(name="long travel", key="travel_counts", levels=travelling, text=lambda counts: f"{counts} counts each way"),
    Kind(name="long rests", key="rest_ps", levels=resting, text=time_text),
    Kind(name="jumps", key="jump_steps", levels=jumping, text=_steps_text, refusal=Refusal.BOUNDS),
)
"""In the order in which they are tried."""
