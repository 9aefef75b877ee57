"""Concurrent work: jobs that are values with a seed, and parts of one task that report their progress.

Compiled loops leave the interpreter free for each other, so threads do; processes are for work in Python itself.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from types import TracebackType
from typing import Protocol, TypeVar

_T = TypeVar("_T")
_Result_co = TypeVar("_Result_co", covariant=True)
Report = Callable[[float], None]
Progress = Callable[[str, float], None]
MOST = 8
"""Threads; a study has no more long parts than that."""


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Job(Protocol[_Result_co]):
    """A picklable value with all that it needs, its seed included: wherever it is run, it gives the same record."""

    def run(self) -> _Result_co:
        """Do it."""


def _run(job: Job[_T]) -> _T:
    return job.run()


class JobPool:
    """A pool of threads or processes that run jobs; the results come in the order of the jobs.

    As a context it ends with every one of them: where it is left by an error, Ctrl-C included, jobs that have
    not begun are dropped.

    Parameters
    ----------
    workers
        How many; None: as many as there are cores. With one, jobs are run where they are asked for.
    processes
        Fresh processes in place of threads.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Draw:
    ...     seed: int
    ...     def run(self) -> int:
    ...         return 3 * self.seed
    >>> with JobPool(2) as pool:
    ...     list(pool.results(Draw(seed) for seed in range(4)))
    [0, 3, 6, 9]
    """

    def __init__(self, workers: int | None = None, *, processes: bool = False) -> None:
        """Start none yet."""
        number = cores() if workers is None else workers
        self._pool: Executor | None = None
        if number > 1 and processes:
            # fresh ones: a fork would copy locks that the compiler's threads may hold
            self._pool = ProcessPoolExecutor(number, mp_context=get_context("spawn"))
        elif number > 1:
            self._pool = ThreadPoolExecutor(number, thread_name_prefix="rtec-job")

    def __enter__(self) -> JobPool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=kind is not None)

    def results(self, jobs: Iterable[Job[_T]]) -> Iterator[_T]:
        """Run jobs and return what each gives, in their order."""
        return map(_run, jobs) if self._pool is None else self._pool.map(_run, jobs)


class Workers:
    """Threads that carry out jobs and report their joint progress.

    As a context it ends with every thread: where the context is left by an error, Ctrl-C included, jobs that have not
    begun are dropped, and those at work break off the next time they report progress.

    Parameters
    ----------
    progress
        Called with what is being done and the share of the whole that is; from any thread, one at a time.
    total
        Sum of the weights of all jobs, those of ``reporter`` alone included.

    Examples
    --------
    >>> shares = []
    >>> with Workers(lambda what, share: shares.append(share), total=4.0) as workers:
    ...     job = workers.start("squares", 4.0, lambda report: [report(k / 2) or k * k for k in range(3)])
    ...     job.result()
    [0, 1, 4]
    >>> shares
    [0.0, 0.5, 1.0]
    """

    def __init__(self, progress: Progress | None, *, total: float) -> None:
        """Start no thread yet."""
        self._progress, self._total = progress, total
        self._done: dict[int, float] = {}
        self._told = -1.0
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._pool = ThreadPoolExecutor(max_workers=min(cores(), MOST), thread_name_prefix="rtec-study")

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if kind is not None:
            self._ended.set()
        self._pool.shutdown(wait=True, cancel_futures=kind is not None)

    def start(self, what: str, weight: float, job: Callable[[Report], _T]) -> Future[_T]:
        """Carry out a job in a thread as soon as one is free."""
        report = self.reporter(what, weight)

        def carry_out() -> _T:
            report(0.0)
            result = job(report)
            report(1.0)
            return result

        return self._pool.submit(carry_out)

    def reporter(self, what: str, weight: float) -> Report:
        """Return what a job calls now and then with its share done, 0..1."""
        number = len(self._done)
        self._done[number] = 0.0

        def report(share: float) -> None:
            if self._ended.is_set():
                raise CancelledError
            with self._lock:
                self._done[number] = max(self._done[number], weight * min(share, 1.0))
                whole = min(sum(self._done.values()) / self._total, 1.0)
                if self._progress is not None and whole > self._told:
                    self._told = whole
                    self._progress(what, whole)

        return report
