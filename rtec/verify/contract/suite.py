"""The suite of checks: one algorithm held to the contract of a corrector, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

from rtec.injector import Algorithm
from rtec.readable import time_text
from rtec.verify.contract import cases
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.endurance import KINDS, Endured, Kind, endure
from rtec.verify.contract.hunt import hunt
from rtec.verify.contract.judge import Fault
from rtec.verify.contract.results import Check, Verdict
from rtec.verify.contract.shrink import narrowest, shrink
from rtec.verify.contract.speeds import Speeds, measure_speeds
from rtec.verify.contract.trials import Case, Run, Trials

TRIES = 3000
"""Runs of the hunt where nothing else is said."""

_Make = Callable[[Trials], Iterable[Case]]
_WITHOUT_REQUESTS: tuple[tuple[str, _Make], ...] = (("runs", cases.running), ("passes", cases.passing))
_WITH_REQUESTS: tuple[tuple[str, _Make], ...] = (
    ("inserts at rest", cases.at_rest),
    ("inserts in motion", cases.in_motion),
    ("reversals", cases.reversing),
    ("dither", cases.dithering),
    ("changing requests", cases.asking),
    ("jitter", cases.jittering),
)
_NONE_MADE = "not tried: no insertion at rest changes anything at the controller, so that none can be aimed at"


def check_algorithm(
    algorithm: Algorithm,
    contract: Contract,
    *,
    tries: int = TRIES,
    seed: int = 0,
    more: _Make | None = None,
    captured: _Make | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Verdict:
    """Hold an algorithm to the contract of a corrector.

    Parameters
    ----------
    algorithm, contract
        The algorithm, whatever it is written in, and what is asked of it.
    tries, seed
        Of the hunt for the worst case: how many runs it may make.
    more
        Makes the caller's own cases, tried as the check ``"motion"`` (`rtec.verify.contract.motions.motion_cases`).
    captured
        Makes the runs of a captured stream, the check ``"capture"`` (`rtec.verify.contract.captured.captured_cases`).
    progress
        Called with the share done.

    Examples
    --------
    Bare wires pass every edge and insert nothing:

    >>> from rtec.injector import Response, Totals
    >>> class Wires:
    ...     name = "wires"
    ...     def play(self, stimuli):
    ...         return [Response(edges=stimulus.edges, completed=Totals()) for stimulus in stimuli]
    ...     def close(self):
    ...         pass
    >>> verdict = check_algorithm(Wires(), Contract(step_counts=2))
    >>> verdict.passed, [check.name for check in verdict.checks if check.passed]
    (False, ['runs', 'passes', 'separation', 'delay'])
    """
    own = tuple((name, make) for name, make in (("motion", more), ("capture", captured)) if make is not None)
    suite = _Suite(Trials(algorithm, contract), tries, seed, (*_WITH_REQUESTS, *own), progress)
    suite.trials.watch = lambda: suite.show(0.0)
    return suite.verdict()


@dataclass(slots=True)
class _Suite:
    trials: Trials
    tries: int
    seed: int
    later: Sequence[tuple[str, _Make]]
    """Checks with requests in them, in order."""
    progress: Callable[[float], None]
    checks: list[Check] = field(default_factory=list)
    endured: dict[str, Endured] = field(default_factory=dict)
    share: float = 0.0
    over: str = ""
    """Why the rest cannot be tried, or ""."""

    def verdict(self) -> Verdict:
        trials = self.trials
        for name, make in _WITHOUT_REQUESTS:
            self._check(name, partial(self._cases, make))
        if not self.over:
            self._settle()
        for name, make in self.later:
            self._check(name, partial(self._cases, make))
        for kind in KINDS:
            self._check(kind.name, partial(self._endure, kind))
        self._check("worst case", self._hunt)
        wrong = [check.run for check in self.checks if check.run is not None]
        worst = self.checks[-1].run
        if wrong:
            shortest = min(wrong, key=lambda run: len(run.case.stream))
            if worst is None or len(shortest.case.stream) < len(worst.case.stream):
                shorter, _ = shrink(trials, shortest)
                worst = shorter if worst is None or len(shorter.case.stream) <= len(worst.case.stream) else worst
        self._margins(wrong)
        if worst is None and trials.margin.separation_in is not None:
            worst = narrowest(trials, trials.margin.separation_in)
        speeds = self._speeds()
        return Verdict(
            algorithm=trials.algorithm.name,
            contract=trials.contract,
            checks=tuple(self.checks),
            speeds=speeds,
            worst=worst,
            margin=trials.margin,
            endured=self.endured,
            settle_ps=trials.settle_ps,
            runs=trials.made,
            seed=self.seed,
        )

    @property
    def done(self) -> float:
        """Return the share of the checks that are made; the speeds count as one of them."""
        return len(self.checks) / (len(_WITHOUT_REQUESTS) + len(self.later) + len(KINDS) + 4)

    def show(self, share: float) -> None:
        """Show the share done, which never falls."""
        self.share = max(self.share, min(share, 1.0))
        self.progress(self.share)

    def _check(self, name: str, find: Callable[[], tuple[Run | None, str]]) -> None:
        """Make a check; ``find`` returns the first run that is wrong, and what to say where none is."""
        if any(check.name == name for check in self.checks):
            return  # it has failed already, when the time to settle was measured
        if self.over:
            self.checks.append(Check(name=name, passed=None, reason=f"not tried: {self.over}"))
            return
        self._book(name, *find())
        self.show(self.done)

    def _cases(self, make: _Make) -> tuple[Run | None, str]:
        wrong, made = self.trials.first_wrong(make(self.trials))
        return wrong, f"{made} runs, every count right" if made else _NONE_MADE

    def _endure(self, kind: Kind) -> tuple[Run | None, str]:
        found = self.endured[kind.name] = endure(self.trials, kind)
        return found.wrong, f"{found.made} runs up to {kind.text(found.depth)}, every count right"

    def _hunt(self) -> tuple[Run | None, str]:
        done, part = self.done, self.done / len(self.checks)
        worst, made = hunt(
            self.trials, tries=self.tries, seed=self.seed, progress=lambda share: self.show(done + share * part)
        )
        return worst, f"{made} streams hunted, every count right"

    def _book(self, name: str, wrong: Run | None, good: str) -> None:
        passed = None if wrong is None and good is _NONE_MADE else wrong is None
        self.checks.append(Check(name=name, passed=passed, reason=str(wrong or good), run=wrong))
        broken = None if wrong is None else wrong.response.broken
        # what runs away after thousands of steps is worth a hunt; a process that was ended is not begun again for it
        if broken is not None and (broken.ended or name not in self.endured):
            self.over = "it has ended early"

    def _settle(self) -> None:
        wrong = self.trials.measure_settling()
        if wrong is None:
            return
        self._book("inserts at rest", wrong, "")
        if wrong.fault is Fault.UNFINISHED:
            self.over = "it inserts nothing at rest"

    def _margins(self, wrong: list[Run]) -> None:
        """Say of separation and delay how near they came, or which run broke them."""
        margin, contract = self.trials.margin, self.trials.contract
        apart = "no changes" if margin.separation_ps is None else time_text(margin.separation_ps)
        least, late, most = (time_text(t) for t in (contract.separation_ps, margin.delay_ps, contract.delay_ps))
        for name, fault, seen in (
            ("separation", Fault.SEPARATION, f"{apart} from A to B at least; {least} asked"),
            ("delay", Fault.DELAY, f"{late} at most; {most} allowed"),
        ):
            self._book(name, next((run for run in wrong if run.fault is fault), None), seen)

    def _speeds(self) -> Speeds | None:
        if self.over:
            return None
        done = self.done
        beyond = Trials(self.trials.algorithm, self.trials.contract)  # what is narrow there is none of the contract's
        beyond.settle_ps, beyond.watch = self.trials.settle_ps, self.trials.watch
        speeds = measure_speeds(beyond, lambda share: self.show(done + share * (1.0 - done)))
        self.trials.made += beyond.made
        return speeds
