"""Jobs side by side: their order, what they tell, and how they end."""

import os
import threading
import time
from dataclasses import dataclass

import pytest

from rtec.jobs import JobPool, Workers, cores


def test_jobs_give_their_results_and_tell_the_share_of_the_whole():
    told = []
    with Workers(lambda what, share: told.append((what, share)), total=10.0) as workers:
        jobs = [workers.start(f"job {k}", 2.0, lambda tell, k=k: [tell(0.5), k][1]) for k in range(4)]
        here = workers.reporter("here", 2.0)
        here(0.5)
        here(1.0)
        assert [job.result() for job in jobs] == [0, 1, 2, 3]
    shares = [share for _, share in told]
    assert shares == sorted(set(shares))
    assert shares[-1] == pytest.approx(1.0)
    assert {what for what, _ in told} >= {"here"}


def test_without_anyone_to_tell_the_results_are_the_same():
    with Workers(None, total=1.0) as workers:
        assert workers.start("quiet", 1.0, lambda tell: tell(0.3) or 7).result() == 7


def test_jobs_are_at_work_at_the_same_time():
    if cores() < 2:
        pytest.skip("one core")
    meeting = threading.Barrier(2, timeout=10)
    with Workers(None, total=2.0) as workers:
        jobs = [workers.start("meets the other", 1.0, lambda tell: meeting.wait()) for _ in range(2)]
        assert sorted(job.result() for job in jobs) == [0, 1]


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_error_breaks_jobs_off_where_they_next_tell_and_drops_the_rest(error):
    begun = []

    def endless(tell):
        begun.append(1)
        while True:
            time.sleep(0.001)
            tell(0.1)

    def leave():
        with Workers(None, total=20.0) as workers:
            for _ in range(20):
                workers.start("endless", 1.0, endless)
            while not begun:
                time.sleep(0.001)
            raise error

    with pytest.raises(error):
        leave()
    assert 1 <= len(begun) < 20


def test_the_error_of_a_job_is_that_of_its_result():
    def fails(tell):
        raise ValueError("row b")

    with Workers(None, total=1.0) as workers:
        job = workers.start("fails", 1.0, fails)
        with pytest.raises(ValueError, match="row b"):
            job.result()


@dataclass(frozen=True)
class Noted:
    """A job that writes down where it ran."""

    number: int

    def run(self):
        return self.number, threading.current_thread().name, os.getpid()


@pytest.mark.parametrize(("workers", "processes"), [(1, False), (3, False), (2, True)])
def test_results_come_in_the_order_of_the_jobs(workers, processes):
    with JobPool(workers, processes=processes) as pool:
        results = list(pool.results([Noted(n) for n in range(6)]))
    assert [number for number, _, _ in results] == list(range(6))
    elsewhere = {pid != os.getpid() for _, _, pid in results}
    assert elsewhere == {processes}
    assert all(name.startswith("rtec-job") == (workers == 3) for _, name, _ in results)


def test_an_error_of_a_job_ends_the_pool_and_drops_what_has_not_begun():
    begun = []

    @dataclass(frozen=True)
    class Slow:
        number: int

        def run(self):
            begun.append(self.number)
            if self.number == 0:
                raise ValueError("the first")
            threading.Event().wait(0.02)

    def run_all():
        with JobPool(2) as pool:
            list(pool.results([Slow(n) for n in range(200)]))

    with pytest.raises(ValueError, match="the first"):
        run_all()
    assert len(begun) < 100
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("rtec-job")]
