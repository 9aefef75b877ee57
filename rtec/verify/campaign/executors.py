"""Where jobs are carried out: here one after the other, or in processes of this machine."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing import active_children, get_context
from typing import Protocol

from rtec.errors import RtecError
from rtec.verify.campaign.code import code_of
from rtec.verify.campaign.job import Job
from rtec.verify.campaign.own_files import Texts, offer
from rtec.verify.campaign.store import Done

_AHEAD = 2
"""Batches that wait for each process, so that none is idle while records are stored."""


class OtherCodeError(RtecError):
    """A worker has other code than the coordinator: its records would be of something else."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Jobs that are carried out one after the other, in one process."""

    code: str
    """That has to carry them out."""
    jobs: Sequence[tuple[str, Job]]
    """Each with its address."""
    texts: Mapping[str, Texts] = field(default_factory=dict)
    """Algorithms of the user's that they name (`rtec.verify.campaign.own_files`)."""

    def alone(self) -> list[Batch]:
        """Return a batch for each of the jobs."""
        return [Batch(self.code, [one], self.texts) for one in self.jobs]


@dataclass(frozen=True, slots=True)
class Raised:
    """A job that came to no record."""

    address: str
    job: Job
    error: str


@dataclass(frozen=True, slots=True)
class Carried:
    """What came of a batch."""

    done: list[Done]
    raised: list[Raised]
    seconds: float


class Executor(Protocol):
    """Carries batches out."""

    @property
    def workers(self) -> int:
        """Return how many take part."""

    def run(self, batches: Iterator[Batch]) -> Iterator[Carried]:
        """Yield what comes of each batch as it is done; more are taken only as there is room."""


def carry_out(batch: Batch) -> Carried:
    """Carry out a batch here.

    Raises
    ------
    OtherCodeError
        The code here is another one.
    """
    worker, begun = f"{socket.gethostname()}:{os.getpid()}", time.perf_counter()
    done, raised = [], []
    offer(batch.texts)
    for address, job in batch.jobs:
        here = code_of(job.function)
        if here != batch.code:
            raise OtherCodeError(f"worker {worker} has other code: {here}; the plan was begun by {batch.code}")
        started = time.perf_counter()
        try:
            record = job.carry_out()
        except Exception as error:  # a job is anybody's function: what it raises is told, and the others go on
            raised.append(Raised(address, job, f"{type(error).__name__}: {error}"))
        else:
            done.append(Done(address, job, record, time.perf_counter() - started, worker))
    return Carried(done, raised, time.perf_counter() - begun)


class Serial:
    """Carries out one batch after the other, in this process."""

    workers = 1

    def run(self, batches: Iterator[Batch]) -> Iterator[Carried]:
        """Yield what comes of each batch."""
        return map(carry_out, batches)


def _begin() -> None:
    """Let Ctrl-C end a worker without a word: the coordinator says what there is to say."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class Processes:
    """Fresh processes of this machine.

    A process that dies takes its pool with it. The jobs that were in it are then carried out one at a time, so that
    the one that kills its process is found and told, and the others count.

    Parameters
    ----------
    workers
        How many.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def run(self, batches: Iterator[Batch]) -> Iterator[Carried]:
        """Yield what comes of each batch."""
        while suspects := (yield from self._until_broken(batches)):
            for batch in suspects:
                for one in batch.alone():
                    if (yield from self._until_broken(iter([one]))):
                        address, job = one.jobs[0]
                        yield Carried([], [Raised(address, job, "its process died")], 0.0)

    def _until_broken(self, batches: Iterator[Batch]) -> Generator[Carried, None, list[Batch]]:
        """Yield what comes of batches; return those that were at work or waiting when a process died."""
        others = set(active_children())
        pool = ProcessPoolExecutor(self.workers, mp_context=get_context("spawn"), initializer=_begin)
        waiting: dict[Future[Carried], Batch] = {}
        try:
            while True:
                while len(waiting) < _AHEAD * self.workers and (batch := next(batches, None)) is not None:
                    try:
                        waiting[pool.submit(carry_out, batch)] = batch
                    except BrokenProcessPool:  # a process died since; the batch has been taken, and must not be lost
                        return [*waiting.values(), batch]
                if not waiting:
                    return []
                for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                    carried = future.result()
                    del waiting[future]
                    yield carried
        except BrokenProcessPool:
            return list(waiting.values())
        except BaseException:
            for process in set(active_children()) - others:
                process.terminate()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
