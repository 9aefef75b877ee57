"""A plan carried out: what is not in the store yet is run, stored, and counted."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from rtec.rates import clopper_pearson, never_seen, wilson
from rtec.verify.campaign.code import code_of
from rtec.verify.campaign.coverage import Coverage
from rtec.verify.campaign.executors import Batch, Carried, Executor, Raised
from rtec.verify.campaign.job import EXEMPT, FAILED, NOT_ACTIVATED, PASSED, Job, Value
from rtec.verify.campaign.own_files import texts_of
from rtec.verify.campaign.plan import Plan
from rtec.verify.campaign.sensitivity import SobolIndex, sensitivity
from rtec.verify.campaign.store import Done, Store

_BATCH_S = 1.0
_MOST_AT_ONCE = 2000
_SHOWN = 100
"""Of the jobs that failed, so many are named."""


@dataclass(slots=True)
class Counts:
    """What came of jobs."""

    passed: int = 0
    failed: int = 0
    exempt: int = 0
    not_activated: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)
    """Of jobs that proved something, in the words of their kind."""

    def take(self, done: Done) -> None:
        """Count a record."""
        result = done.record["result"]
        if result == NOT_ACTIVATED:
            self.not_activated += 1
            return
        self.passed += result == PASSED
        self.failed += result == FAILED
        self.exempt += result == EXEMPT
        self.outcomes[str(done.record.get("outcome", result))] += 1

    @property
    def tried(self) -> int:
        """Return how many proved something: the denominator of the rate."""
        return self.passed + self.failed + self.exempt

    def to_dict(self) -> dict[str, object]:
        """Return counts, rate and intervals of 95 % as plain data."""
        tried = self.tried
        return {
            "jobs": tried + self.not_activated,
            "passed": self.passed,
            "failed": self.failed,
            "exempt": self.exempt,
            "not_activated": self.not_activated,
            "failure_rate": self.failed / tried if tried else None,
            "wilson_95": wilson(self.failed, tried) if tried else None,
            "clopper_pearson_95": clopper_pearson(self.failed, tried) if tried else None,
            "rate_below_95": never_seen(tried) if tried and not self.failed else None,
            "outcomes": dict(self.outcomes),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """A plan and what came of it."""

    plan: Plan
    code: str
    """That carried it out."""
    jobs: int
    """Of the plan, those left out not counted."""
    counts: Counts
    rows: Mapping[tuple[Value, ...], Counts]
    """By the values of ``plan.by``."""
    holes: tuple[Mapping[str, Value], ...]
    """Combinations that the kind of jobs has to prove, and of which none was activated."""
    failing: tuple[Done, ...]
    """The first jobs that failed."""
    raised: tuple[Raised, ...]
    """Jobs that came to no record; they are tried again by the same command."""
    seconds: float
    """That all jobs took together, whenever they were run."""
    sensitivity: tuple[SobolIndex, ...] = ()
    """Where the plan draws for them."""
    coverage: Coverage | None = None
    """Of jobs that observe something."""

    @property
    def by(self) -> list[str]:
        """Return the names of the parameters by whose values the rows are."""
        return [one.name for key in self.plan.by if (one := self.plan.kind.parameter(key)) is not None]

    @property
    def good(self) -> bool:
        """Return whether every job has a record, none failed, and none of what has to be proved is unproved."""
        complete = self.counts.tried + self.counts.not_activated == self.jobs
        return complete and not (self.counts.failed or self.holes)

    def to_dict(self) -> dict[str, object]:
        """Return plain data under the names that scripts rely on."""
        counts = self.counts
        return {
            "plan": self.plan.name,
            "good": self.good,
            "jobs": self.jobs,
            "done": counts.tried + counts.not_activated,
            "passed": counts.passed,
            "failed": counts.failed,
            "exempt": counts.exempt,
            "not_activated": counts.not_activated,
            "seed": self.plan.seed,
            "code": self.code,
            "job_seconds": self.seconds,
            "by": list(self.by),
            "rows": [
                dict(zip(self.by, values, strict=True)) | counted.to_dict() for values, counted in self.rows.items()
            ],
            "total": counts.to_dict(),
            "sensitivity": [index.to_dict() for index in self.sensitivity],
            "coverage": None if self.coverage is None else self.coverage.to_dict(),
            "holes": [dict(hole) for hole in self.holes],
            "failing": [
                {
                    "job": one.address,
                    "requirement": self.plan.requirement_ids(one.job.parameters),
                    **one.job.parameters,
                    "run": one.job.run,
                    **one.record,
                }
                for one in self.failing
            ],
            "errors": [{"job": one.address, "error": one.error} for one in self.raised],
        }


class _Pending:
    """Batches of about a second of the jobs that are not stored yet."""

    def __init__(self, plan: Plan, code: str, store: Store, addresses: list[str], left: int, workers: int) -> None:
        self._jobs = zip(addresses, plan.jobs(), strict=True)
        self._code, self._store, self.left, self._workers = code, store, left, workers
        self._each_s: float | None = None

    def took(self, carried: Carried) -> None:
        """Learn how long a job takes."""
        if number := len(carried.done) + len(carried.raised):
            self._each_s = max(carried.seconds / number, 1e-6)

    def _wanted(self) -> int:
        """Return how many jobs make a second; fewer near the end, so that all workers end together."""
        by_time = 1 if self._each_s is None else int(_BATCH_S / self._each_s)
        return max(1, min(by_time, _MOST_AT_ONCE, -(-self.left // (2 * self._workers))))

    def __iter__(self) -> Iterator[Batch]:
        waiting: list[tuple[str, Job]] = []
        for address, job in self._jobs:
            waiting.append((address, job))
            if len(waiting) >= self._wanted():
                yield from self._new(waiting)
                waiting = []
        yield from self._new(waiting)

    def _new(self, jobs: list[tuple[str, Job]]) -> Iterator[Batch]:
        """Yield a batch of those that are not stored, also not by another coordinator in the meantime."""
        known = self._store.known([address for address, _ in jobs])
        some = [(address, job) for address, job in jobs if address not in known]
        self.left -= len(some)
        if some:
            values = (value for _, job in some for value in job.parameters.values())
            yield Batch(self._code, some, texts_of(values))


def addresses_of(plan: Plan) -> list[str]:
    """Return the addresses of the jobs of a plan, carried out by the code that is here."""
    code = code_of(plan.kind.function)
    return [job.address(code) for job in plan.jobs()]


def run_campaign(
    plan: Plan, store: Store, executor: Executor, progress: Callable[[float, str], None] = lambda share, what: None
) -> Campaign:
    """Carry out what a store lacks of a plan, and count all of it.

    Parameters
    ----------
    plan
        What is tried.
    store
        Where records are, and where new ones go, a transaction a batch.
    executor
        Where jobs are run.
    progress
        Called with the share done and what is being done.

    Raises
    ------
    ArgumentError
        No job of the plan can prove anything.
    OutputError
        The store cannot be written.

    Examples
    --------
    >>> from rtec.verify.campaign.executors import Serial
    >>> from rtec.verify.campaign.plan import read_plan
    >>> plan = read_plan("motions").only(["c", "fast", "dither", "frequency=500 kHz"])
    >>> with Store(":memory:") as store:
    ...     campaign = run_campaign(plan, store, Serial())
    >>> campaign.jobs, campaign.counts.passed, campaign.good
    (10, 10, True)
    """
    code, addresses = code_of(plan.kind.function), addresses_of(plan)
    before = len(store.known(addresses))
    pending = _Pending(plan, code, store, addresses, len(addresses) - before, executor.workers)
    raised: list[Raised] = []
    begun, made = time.monotonic(), 0
    progress(before / len(addresses), f"{before} of {len(addresses)} jobs")
    for carried in executor.run(iter(pending)):
        store.put(carried.done, code=code)
        raised += carried.raised
        pending.took(carried)
        made += len(carried.done) + len(carried.raised)
        left_s = (time.monotonic() - begun) / max(made, 1) * max(len(addresses) - before - made, 0)
        now = before + made
        progress(now / len(addresses), f"{now} of {len(addresses)} jobs, {_left(left_s)} left")
    return counted(plan, code, store, addresses, raised)


def counted(plan: Plan, code: str, store: Store, addresses: list[str], raised: list[Raised]) -> Campaign:
    """Count what a store has of a plan."""
    names = [one.name for key in plan.by if (one := plan.kind.parameter(key)) is not None]
    counts, rows, failing, seconds = Counts(), dict[tuple[Value, ...], Counts](), list[Done](), 0.0
    proved: dict[tuple[Value, ...], bool] = {}
    coverage = Coverage(plan) if plan.kind.observed else None
    for done in store.records(addresses):
        parameters = done.job.parameters
        counts.take(done)
        if coverage is not None:
            coverage.take(done)
        rows.setdefault(tuple(parameters[name] for name in names), Counts()).take(done)
        to_prove = tuple(parameters[name] for name in plan.kind.proves)
        proved[to_prove] = proved.get(to_prove, False) or done.record["result"] != NOT_ACTIVATED
        if done.record["result"] == FAILED and len(failing) < _SHOWN:
            failing.append(done)
        seconds += done.seconds
    holes = [dict(zip(plan.kind.proves, values, strict=True)) for values, some in proved.items() if not some]
    return Campaign(
        plan=plan, code=code, jobs=len(addresses), counts=counts, rows=rows, holes=tuple(holes),
        failing=tuple(failing), raised=tuple(raised), seconds=seconds, coverage=coverage,
        sensitivity=tuple(sensitivity(plan, store.records(addresses))) if plan.sobol else (),
    )  # fmt: skip


def _left(seconds: float) -> str:
    """Return a time that is left as people say it."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
