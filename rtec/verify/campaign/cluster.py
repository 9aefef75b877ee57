"""Jobs on a Dask cluster; the store is the only truth, so a worker or a scheduler that is lost costs a batch."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from concurrent.futures import CancelledError
from types import TracebackType
from typing import Any

from rtec.errors import RtecError
from rtec.verify.campaign.code import code_of
from rtec.verify.campaign.executors import Batch, Carried, OtherCodeError, Raised, carry_out

_ANSWER_S, _WORKERS_S = 10.0, 30.0
"""How long the scheduler may take to answer, and how long the first worker is waited for."""
_AHEAD = 2


class Cluster:
    """The workers of a Dask scheduler; a context.

    Parameters
    ----------
    address
        Of the scheduler, as in ``tcp://host:8786``.
    function
        Of the jobs: every worker has to have the same code for it.

    Raises
    ------
    RtecError
        Dask is not installed, no scheduler answers, it has no workers, or one of them has other code.
    """

    def __init__(self, address: str, function: str) -> None:
        try:
            import distributed  # noqa: PLC0415 - an extra, and a second to load
        except ImportError as error:
            raise RtecError("--scheduler needs Dask; python -m pip install 'rtec[cluster]' brings it") from error
        self._dask: Any = distributed
        self._address = address
        try:
            self._client = distributed.Client(address, timeout=_ANSWER_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise RtecError(
                f"--scheduler: no Dask scheduler answers at {address[:80]}; start one with: dask scheduler, "
                f"and workers with: dask worker {address[:80]} --nthreads 1"
            ) from error
        try:
            self._client.wait_for_workers(1, timeout=_WORKERS_S)
            self._check(function)
        except (TimeoutError, self._dask.TimeoutError) as error:
            self._client.close()
            raise RtecError(
                f"--scheduler: {address} has no workers; start some with: dask worker {address} --nthreads 1"
            ) from error
        except BaseException:
            self._client.close()
            raise

    def __enter__(self) -> Cluster:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._client.close()

    @property
    def workers(self) -> int:
        """Return how many jobs they run at once, at present."""
        threads: dict[str, int] = self._client.nthreads()
        return max(sum(threads.values()), 1)

    def _check(self, function: str) -> None:
        here = code_of(function)
        for worker, there in self._client.run(code_of, function, on_error="return").items():
            if there != here:
                raise OtherCodeError(f"--scheduler: worker {worker} has other code: {there}; here: {here}")

    def run(self, batches: Iterator[Batch]) -> Iterator[Carried]:
        """Yield what comes of each batch; one whose worker dies again and again is tried job by job.

        Raises
        ------
        RtecError
            The scheduler is lost, or a worker that came later has other code.
        """
        running: dict[Any, Batch] = {}
        completed = self._dask.as_completed(loop=self._client.loop)

        def submit(batch: Batch) -> None:
            addresses = "".join(address for address, _ in batch.jobs)
            key = f"rtec-{hashlib.sha256(addresses.encode()).hexdigest()[:24]}"
            future = self._client.submit(carry_out, batch, key=key, pure=False)
            running[future] = batch
            completed.add(future)

        try:
            while True:
                room = _AHEAD * self.workers - len(running)
                while room > 0 and (batch := next(batches, None)) is not None:
                    submit(batch)
                    room -= 1
                if not running:
                    return
                future = next(completed)
                batch = running.pop(future)
                try:
                    carried = future.result()
                except self._dask.scheduler.KilledWorker as error:
                    future.release()
                    if len(batch.jobs) == 1:
                        address, job = batch.jobs[0]
                        yield Carried([], [Raised(address, job, f"its worker died: {error}")], 0.0)
                    else:
                        for one in batch.alone():
                            submit(one)
                    continue
                future.release()  # a record that stays on a worker dies with it
                yield carried
        except (OSError, TimeoutError, CancelledError) as error:
            raise RtecError(
                f"--scheduler: {self._address} is lost; what is stored is whole, the same command resumes"
            ) from error
