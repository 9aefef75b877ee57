"""Runs of one algorithm, each judged: what the checks, the hunt and the speeds are made of."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from rtec.injector import Algorithm, Response
from rtec.injector.waves import rows_of_streams, write_waves
from rtec.signal import VcdSignal
from rtec.units import PS_PER_S
from rtec.verify.contract.contract import STATES, Contract
from rtec.verify.contract.judge import Fault, Judgement, judge
from rtec.verify.contract.streams import Stream

_FIRST_LOOK_PS, _LONGEST_LOOK_PS = 100_000_000, PS_PER_S
"""How long an insertion at rest is waited for: from 100 us on, tenfold, up to 1 s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One run that is to be made."""

    title: str
    """What is tried, for people."""
    stream: Stream
    """What goes in."""
    must_finish: bool = True
    """Whether what was asked for has to be completed, or refused, at the end."""
    may_refuse: bool = True
    """Whether it may be refused."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """A case with what came out and what is to be said of it."""

    case: Case
    response: Response
    judgement: Judgement

    @property
    def right(self) -> bool:
        """Return whether everything holds."""
        return self.judgement.right

    @property
    def fault(self) -> Fault | None:
        """Return what the algorithm did wrong; None where everything holds."""
        return None if self.judgement.violation is None else self.judgement.violation.fault

    def __str__(self) -> str:
        violation = self.judgement.violation
        return f"{self.case.title}: {'every count right' if violation is None else violation}"


@dataclass(slots=True)
class Margin:
    """The narrowest that was seen in runs in which everything holds, and where."""

    separation_ps: int | None = None
    separation_in: Run | None = None
    pulse_ps: int | None = None
    delay_ps: int = 0

    def take(self, run: Run) -> None:
        """Take a run."""
        seen = run.judgement
        if seen.separation_ps is not None:
            before = self.separation_in
            narrow = seen.separation_ps, len(run.case.stream)
            if before is None or narrow < (self.separation_ps, len(before.case.stream)):
                self.separation_ps, self.separation_in = seen.separation_ps, run
        if seen.pulse_ps is not None:
            self.pulse_ps = min(seen.pulse_ps, self.pulse_ps or seen.pulse_ps)
        self.delay_ps = max(self.delay_ps, seen.delay_ps)


class Trials:
    """An algorithm on the bench.

    Examples
    --------
    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> box = BuiltIn(InjectorSettings(design=Design.C, timing=Timing()))
    >>> trials = Trials(box, Contract.of(Design.C))
    >>> once = Case(title="one step at rest", stream=Stream.read("00 1us:r1 3ms:end"))
    >>> print(trials.one(once), trials.made)
    one step at rest: every count right 1
    """

    def __init__(self, algorithm: Algorithm, contract: Contract) -> None:
        self.algorithm, self.contract = algorithm, contract
        self.margin = Margin()
        self.made = 0
        self._windows: dict[tuple[int, int, int], tuple[int, int] | None] = {}
        self.watch: Callable[[], None] = lambda: None
        """Called now and then while runs are made."""
        self.settle_ps = 2 * _FIRST_LOOK_PS
        """In which a request at rest is completed; measured by `measure_settling`."""

    def one(self, case: Case) -> Run:
        """Make one run."""
        return self.all_of([case])[0]

    def all_of(self, cases: Sequence[Case]) -> list[Run]:
        """Make runs."""
        stimuli = [case.stream.stimulus() for case in cases]
        self.made += len(cases)
        self.watch()
        runs = []
        for case, stimulus, response in zip(cases, stimuli, self.algorithm.play(stimuli), strict=True):
            seen = judge(stimulus, response, self.contract, must_finish=case.must_finish, may_refuse=case.may_refuse)
            run = Run(case=case, response=response, judgement=seen)
            if run.right:
                self.margin.take(run)
            runs.append(run)
        return runs

    def first_wrong(self, cases: Iterable[Case], *, at_once: int = 16) -> tuple[Run | None, int]:
        """Make runs up to the first that is wrong; return it, or None, and how many were made."""
        made, waiting = 0, []
        for case in cases:
            waiting.append(case)
            if len(waiting) == at_once:
                wrong = next((run for run in self.all_of(waiting) if not run.right), None)
                made += len(waiting)
                if wrong is not None:
                    return wrong, made
                waiting = []
        return next((run for run in self.all_of(waiting) if not run.right), None), made + len(waiting)

    def measure_settling(self) -> Run | None:
        """Find how long a step at rest takes in each state; return the first run that is wrong, or none."""
        longest_ps, quarter_ps = 0, self.contract.quarter_ps
        first_wrong: Run | None = None
        for state, sign, direction in product(self.contract.states, (1, -1), (0, 1, -1)):
            # resting since power-up, or just arrived
            came = [(quarter_ps, direction)] if direction else []
            asked_ps = quarter_ps * (1 + 2 * len(came))
            look_ps = _FIRST_LOOK_PS
            while True:
                stream = Stream.of((state - direction) % 4, came, [(asked_ps, sign)], asked_ps + look_ps)
                title = f"{sign:+d} step at rest in state {STATES[state]}"
                run = self.one(Case(title=title, stream=stream, may_refuse=False))
                violation = run.judgement.violation
                if violation is None:
                    break
                # a count that is wrong may be a step that is not booked yet
                if violation.fault not in (Fault.UNFINISHED, Fault.COUNT) or look_ps >= _LONGEST_LOOK_PS:
                    break
                look_ps *= 10
            for times in (run.response.edges.times_ps, run.response.completed.times_ps):
                longest_ps = max(longest_ps, int(times.max(initial=0)) - asked_ps)
            self.settle_ps = 2 * longest_ps + 40 * quarter_ps
            first_wrong = first_wrong or (run if violation is not None else None)
            if violation is not None and violation.fault in (Fault.BROKEN, Fault.UNFINISHED):
                break
        return first_wrong

    def settled(self, stream: Stream) -> Stream:
        """Return a stream with an end at which everything that was asked for can have come."""
        steps = int(np.abs(np.diff(stream.totals, prepend=0)).sum())
        return replace(stream, until_ps=stream.last_ps + (steps + 1) * self.settle_ps)

    def case(self, title: str, stream: Stream) -> Case:
        """Return a case that ends at rest."""
        return Case(title=title, stream=self.settled(stream), must_finish=stream.final_state in self.contract.states)

    @property
    def asked_ps(self) -> int:
        """Return when a request comes in a run that begins at rest."""
        return self.contract.quarter_ps + self.settle_ps

    def at_rest(self, state: int, sign: int) -> tuple[Case, tuple[int, int] | None]:
        """Return a step at rest, and when its insertion begins and ends, measured once; None where there is none."""
        case = self.case("an insertion at rest", Stream.of(state, (), [(self.asked_ps, sign)], 1))
        key = state, sign, self.settle_ps
        if key not in self._windows:
            self._windows[key] = self.window(case)
        return case, self._windows[key]

    def window(self, case: Case) -> tuple[int, int] | None:
        """Return when the last insertion of a case begins and ends; None where there is none.

        It begins where what comes out differs for the first time from what comes out without the last request, and
        ends with the last change before it is booked, or there.
        """
        asked = case.stream
        without = replace(asked, requests_ps=asked.requests_ps[:-1], totals=asked.totals[:-1])
        with_it, reference = (
            run.response for run in self.all_of([case, replace(case, stream=without, must_finish=False)])
        )
        done = with_it.completed.times_ps
        ours, theirs = with_it.edges, reference.edges
        both = min(len(ours), len(theirs))
        differs = (ours.times_ps[:both] != theirs.times_ps[:both]) | (ours.levels[:both] != theirs.levels[:both])
        at = int(np.argmax(differs)) if differs.any() else both
        if done.size == 0 or at >= len(ours):
            return None
        begin_ps, booked_ps = int(ours.times_ps[at]), int(done[-1])
        changes = ours.times_ps[(ours.times_ps >= begin_ps) & (ours.times_ps <= booked_ps)]
        end_ps = int(changes[-1]) if changes.size else booked_ps
        return begin_ps, max(end_ps, begin_ps + 1)


def write_run(run: Run, file: Path) -> None:
    """Write what went in and what came out: lines, states, counts, totals, insertions, and the moment of a fault.

    Raises
    ------
    OutputError
        It cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> trials = Trials(BuiltIn(InjectorSettings(design=Design.C, timing=Timing())), Contract.of(Design.C))
    >>> file = Path(tempfile.mkdtemp()) / "run.vcd"
    >>> write_run(trials.one(Case(title="at rest", stream=Stream.read("00 1us:r1 9ms:end"))), file)
    >>> file.read_text().splitlines()[1]
    '$timescale 100 ns $end'
    """
    stimulus, response, violation = run.case.stream.stimulus(), run.response, run.judgement.violation
    rows = rows_of_streams(stimulus.edges, response.edges, stimulus.requests, response.completed)
    at_ps = np.array([] if violation is None else [violation.time_ps], np.int64)
    failed = VcdSignal(scope="check", name="failed"), at_ps, np.ones(at_ps.size, np.int64)
    initial = stimulus.edges.initial, response.edges.initial
    write_waves(file, rows, initial=initial, end_ps=run.case.stream.until_ps, beside=[failed])
