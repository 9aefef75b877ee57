"""Campaigns on a Dask cluster in processes of this machine."""

import os
from dataclasses import replace

import pytest

from rtec import __version__
from rtec.errors import RtecError
from rtec.verify.campaign import cluster as module
from rtec.verify.campaign.cluster import Cluster
from rtec.verify.campaign.executors import Processes
from rtec.verify.campaign.plan import read_plan
from rtec.verify.campaign.run import addresses_of, run_campaign
from rtec.verify.campaign.store import Store

distributed = pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
FUNCTION = "tests.campaign_jobs:ill_fated"


def cluster_of(workers):
    return distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=":0")


@pytest.fixture(scope="module")
def scheduler():
    with cluster_of(2) as local, distributed.Client(local, set_as_default=False) as client:
        client.run(_find_tests, os.getcwd())
        yield local.scheduler_address


def _find_tests(folder):
    import sys

    if folder not in sys.path:
        sys.path.insert(0, folder)


@pytest.fixture
def plan(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('job = "tests.campaign_jobs:KIND"\nruns = 30\n[try]\nfate = ["pass", "fail", "die"]')
    return read_plan(str(file))


def test_records_are_those_of_processes(scheduler, plan):
    small = plan.only(["pass", "fail"])
    with Store(":memory:") as store, Store(":memory:") as other, Cluster(scheduler, FUNCTION) as cluster:
        assert cluster.workers == 2
        assert run_campaign(small, store, cluster).counts.tried == 60
        run_campaign(small, other, Processes(2))
        addresses = addresses_of(small)
        assert [one.record for one in store.records(addresses)] == [one.record for one in other.records(addresses)]
        workers = {one.worker for one in store.records(addresses)}
        assert 1 <= len(workers) <= 2


def test_the_text_of_an_algorithm_of_ones_own_reaches_the_workers(scheduler, tmp_path):
    (tmp_path / "mine.py").write_text("class Mine: ...\n")
    (tmp_path / "own.toml").write_text(
        'job = "tests.campaign_jobs:OWN"\n[try]\ndesign = "c"\nalgorithm = "mine.py:Mine"\n'
    )
    plan = read_plan(str(tmp_path / "own.toml"))
    (tmp_path / "mine.py").unlink()
    with Store(":memory:") as store, Cluster(scheduler, plan.kind.function) as cluster:
        assert run_campaign(plan, store, cluster).good
        assert next(store.records(addresses_of(plan))).record["texts"] == "mine.py: class Mine: ...\n"


def _age(version):
    from rtec.verify.campaign import code

    code.__version__ = version
    code.code_of.cache_clear()


def test_a_worker_with_other_code_is_refused(scheduler):
    with distributed.Client(scheduler, set_as_default=False) as client:
        client.run(_age, "0.0.1")
        try:
            with pytest.raises(RtecError, match=r"worker tcp://.* has other code: rtec 0.0.1, .*; here: rtec"):
                Cluster(scheduler, FUNCTION)
        finally:
            client.run(_age, __version__)


def test_no_scheduler_is_one_clear_error(monkeypatch):
    monkeypatch.setattr(module, "_ANSWER_S", 0.5)
    with pytest.raises(RtecError, match=r"no Dask scheduler answers at tcp://127.0.0.1:1; start one with"):
        Cluster("tcp://127.0.0.1:1", FUNCTION)


@pytest.mark.sweep
def test_a_job_that_kills_every_worker_is_told_and_the_others_count(scheduler, plan):
    with Store(":memory:") as store, Cluster(scheduler, FUNCTION) as cluster:
        found = run_campaign(replace(plan.only(["pass", "die"]), runs=1), store, cluster)
    assert (found.counts.passed, len(found.raised)) == (1, 1)
    assert "its worker died" in found.raised[0].error


@pytest.mark.sweep
def test_a_lost_scheduler_is_said_and_the_same_plan_resumes(plan):
    small = plan.only(["pass"])
    small = replace(small, grid={**small.grid, "wait_s": (0.2,)})
    with Store(":memory:") as store:
        local = cluster_of(1)
        with distributed.Client(local, set_as_default=False) as client:
            client.run(_find_tests, os.getcwd())
            with (
                pytest.raises(RtecError, match=r"is lost; what is stored is whole, the same command resumes"),
                Cluster(local.scheduler_address, FUNCTION) as cluster,
            ):
                run_campaign(small, store, cluster, lambda share, what: local.close() if share > 0.2 else None)
        stored = len(store.known(addresses_of(small)))
        assert 0 < stored < 30
        assert run_campaign(small, store, Processes(2)).counts.passed == 30
