"""The suite of checks: one algorithm held to the contract of a corrector, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

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

_WITHOUT_REQUESTS: tuple[tuple[str, Callable[[Trials], Iterable[Case]]], ...] = (
    ("runs", cases.running),
    ("passes", cases.passing),
)
_WITH_REQUESTS: tuple[tuple[str, Callable[[Trials], Iterable[Case]]], ...] = (
    ("inserts at rest", cases.at_rest),
    ("inserts in motion", cases.in_motion),
    ("reversals", cases.reversing),
    ("dither", cases.dithering),
    ("changing requests", cases.asking),
    ("jitter", cases.jittering),
)


def check_algorithm(
    algorithm: Algorithm,
    contract: Contract,
    *,
    tries: int = TRIES,
    seed: int = 0,
    more: Callable[[Trials], Iterable[Case]] | None = None,
    captured: Callable[[Trials], Iterable[Case]] | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Verdict:
    """Hold an algorithm to the contract of a corrector.

    Parameters
    ----------
    algorithm
        The algorithm, whatever it is written in.
    contract
        What is asked of it.
    tries
        Runs that the hunt for the worst case may make.
    seed
        Of the hunt.
    more
        Makes the caller's own cases, tried as the check ``"motion"`` (`rtec.verify.contract.motions.motion_cases`).
    captured
        Makes the runs of a captured stream, the check ``"capture"`` (`rtec.verify.contract.captured.captured_cases`).
    progress
        Called with the share done.

    Returns
    -------
    Verdict
        Every check, how far the algorithm goes, and the worst case.

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
    suite = _Suite(Trials(algorithm, contract), tries, seed, {"motion": more, "capture": captured}, progress)
    suite.trials.watch = lambda: suite.show(0.0)
    return suite.verdict()


@dataclass(slots=True)
class _Suite:
    trials: Trials
    tries: int
    seed: int
    more: Mapping[str, Callable[[Trials], Iterable[Case]] | None]
    """The caller's own cases by the names of their checks."""
    progress: Callable[[float], None]
    checks: list[Check] = field(default_factory=list)
    endured: dict[str, Endured] = field(default_factory=dict)
    share: float = 0.0
    over: str = ""
    """Why the rest cannot be tried, or ""."""

    def verdict(self) -> Verdict:
        trials = self.trials
        later = (*_WITH_REQUESTS, *((name, make) for name, make in self.more.items() if make is not None))
        parts = len(_WITHOUT_REQUESTS) + len(later) + len(KINDS) + 4
        for name, make in _WITHOUT_REQUESTS:
            self._try(name, make, parts)
        if not self.over:
            self._settle()
        for name, make in later:
            self._try(name, make, parts)
        for kind in KINDS:
            self._endure(kind, parts)
        worst = self._hunt(parts)
        wrong = [check.run for check in self.checks if check.run is not None]
        if wrong:
            shortest = min(wrong, key=lambda run: len(run.case.stream))
            if worst is None or len(shortest.case.stream) < len(worst.case.stream):
                shorter, _ = shrink(trials, shortest)
                worst = shorter if worst is None or len(shorter.case.stream) <= len(worst.case.stream) else worst
        self._margins(wrong)
        if worst is None and trials.margin.separation_in is not None:
            worst = narrowest(trials, trials.margin.separation_in)
        speeds = self._speeds(parts)
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

    def show(self, share: float) -> None:
        """Show the share done, which never falls."""
        self.share = max(self.share, min(share, 1.0))
        self.progress(self.share)

    def _try(self, name: str, make: Callable[[Trials], Iterable[Case]], parts: int) -> None:
        if any(check.name == name for check in self.checks):
            return  # it has failed already, when the time to settle was measured
        if self._cannot_be_tried(name):
            return
        wrong, made = self.trials.first_wrong(make(self.trials))
        if made:
            self._book(name, wrong, f"{made} runs, every count right")
        else:
            reason = (
                "not tried: no insertion at rest changes anything at the controller, so that none can be aimed at"
            )
            self.checks.append(Check(name=name, passed=None, reason=reason))
        self.show(len(self.checks) / parts)

    def _endure(self, kind: Kind, parts: int) -> None:
        if self._cannot_be_tried(kind.name):
            return
        found = self.endured[kind.name] = endure(self.trials, kind)
        self._book(kind.name, found.wrong, f"{found.made} runs up to {kind.text(found.depth)}, every count right")
        self.show(len(self.checks) / parts)

    def _cannot_be_tried(self, name: str) -> bool:
        if self.over:
            self.checks.append(Check(name=name, passed=None, reason=f"not tried: {self.over}"))
        return bool(self.over)

    def _book(self, name: str, wrong: Run | None, good: str) -> None:
        self.checks.append(Check(name=name, passed=wrong is None, reason=str(wrong or good), run=wrong))
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

    def _hunt(self, parts: int) -> Run | None:
        if self._cannot_be_tried("worst case"):
            return None
        done = len(self.checks) / parts
        worst, made = hunt(
            self.trials, tries=self.tries, seed=self.seed, progress=lambda share: self.show(done + share / parts)
        )
        self._book("worst case", worst, f"{made} streams hunted, every count right")
        return worst

    def _margins(self, wrong: list[Run]) -> None:
        """Say of separation and delay how near they came, or which run broke them."""
        margin, contract = self.trials.margin, self.trials.contract
        apart = "no changes" if margin.separation_ps is None else time_text(margin.separation_ps)
        for name, fault, seen in (
            (
                "separation",
                Fault.SEPARATION,
                f"{apart} from A to B at least; {time_text(contract.separation_ps)} asked",
            ),
            ("delay", Fault.DELAY, f"{time_text(margin.delay_ps)} at most; {time_text(contract.delay_ps)} allowed"),
        ):
            self._book(name, next((run for run in wrong if run.fault is fault), None), seen)

    def _speeds(self, parts: int) -> Speeds | None:
        if self.over:
            return None
        done = len(self.checks) / parts
        beyond = Trials(self.trials.algorithm, self.trials.contract)  # what is narrow there is none of the contract's
        beyond.settle_ps = self.trials.settle_ps
        beyond.watch = self.trials.watch
        speeds = measure_speeds(beyond, lambda share: self.show(done + share * (1.0 - done)))
        self.trials.made += beyond.made
        return speeds
