"""Campaigns: what is missing is run, what is there is not, and everything is counted once."""

import csv
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
import scipy

from rtec.verify.campaign import code
from rtec.verify.campaign.executors import Batch, OtherCodeError, Processes, Serial, carry_out
from rtec.verify.campaign.export import write_csv, write_junit, write_parquet
from rtec.verify.campaign.job import Job
from rtec.verify.campaign.plan import Requirement, read_plan
from rtec.verify.campaign.run import addresses_of, run_campaign
from rtec.verify.campaign.store import Store


@pytest.fixture
def plan(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(
        'job = "tests.campaign_jobs:KIND"\nruns = 20\n'
        '[try]\nfate = ["pass", "fail", "exempt", "idle", "raise", "die"]'
    )
    return read_plan(str(file))


class Counting(Serial):
    """Counts the jobs that it carries out."""

    def __init__(self):
        self.jobs = 0

    def run(self, batches):
        for batch in batches:
            self.jobs += len(batch.jobs)
            yield carry_out(batch)


def test_a_job_that_was_not_activated_is_in_no_denominator(plan):
    with Store(":memory:") as store:
        found = run_campaign(plan.only(["pass", "fail", "exempt", "idle"]), store, Serial())
    counts = found.counts
    assert (counts.passed, counts.failed, counts.exempt, counts.not_activated, counts.tried) == (20, 20, 20, 20, 60)
    assert found.to_dict()["total"]["failure_rate"] == pytest.approx(1 / 3)
    assert {key[0]: row.tried for key, row in found.rows.items()} == {"pass": 20, "fail": 20, "exempt": 20, "idle": 0}
    assert found.holes == ({"fate": "idle"},)
    assert not found.good
    assert {one.job.parameters["fate"] for one in found.failing} == {"fail"}


def test_what_is_stored_is_not_run_again(plan):
    with Store(":memory:") as store:
        small, executor = plan.only(["pass"]), Counting()
        assert run_campaign(replace(small, runs=5), store, executor).jobs == 5
        again = run_campaign(small, store, executor)
        assert (executor.jobs, again.jobs, again.counts.passed, again.good) == (20, 20, 20, True)
        run_campaign(replace(small, seed=2), store, executor)
        assert executor.jobs == 40


def test_another_code_runs_everything_again(plan, monkeypatch):
    small, executor = plan.only(["pass"]), Counting()
    with Store(":memory:") as store:
        run_campaign(small, store, executor)
        for module in ("executors", "run"):
            monkeypatch.setattr(f"rtec.verify.campaign.{module}.code_of", lambda function: "other code")
        run_campaign(small, store, executor)
        assert (executor.jobs, store.of_other_code("other code")) == (40, 20)


def test_the_code_names_the_libraries_that_its_modules_import(monkeypatch):
    lathe, own = "rtec.study.jobs:corrected_axis", "tests.campaign_jobs:ill_fated"
    assert f"numpy {np.__version__}" in code.code_of(own) and "scipy" not in code.code_of(own)
    assert f"scipy {scipy.__version__}" in code.code_of(lathe)  # its modules import it in functions
    monkeypatch.setattr(code.metadata, "version", lambda package: "0.1")
    assert "scipy 0.1" in code.code_of.__wrapped__(lathe)


def test_a_job_that_raises_is_told_and_tried_again(plan):
    with Store(":memory:") as store:
        found = run_campaign(plan.only(["raise", "pass"]), store, Serial())
        assert {one.error for one in found.raised} == {"ValueError: no luck"}
        assert (len(found.raised), found.counts.passed, found.good) == (20, 20, False)
        executor = Counting()
        run_campaign(plan.only(["raise", "pass"]), store, executor)
        assert executor.jobs == 20


def test_processes_give_the_same_records_and_outlive_a_job_that_kills_its_own(plan):
    small = replace(plan.only(["pass", "die", "fail"]), runs=2)
    with Store(":memory:") as store, Store(":memory:") as other:
        found = run_campaign(small, store, Processes(2))
        run_campaign(small.only(["pass", "fail"]), other, Serial())
        same = addresses_of(small.only(["pass", "fail"]))
        assert [one.record for one in store.records(same)] == [one.record for one in other.records(same)]
    assert {one.error for one in found.raised} == {"its process died"}
    assert (len(found.raised), found.counts.passed, found.counts.failed) == (2, 2, 2)


def test_two_coordinators_on_one_store_count_each_job_once(plan, tmp_path):
    small = plan.only(["pass"])
    with Store(tmp_path / "s.db") as first, Store(tmp_path / "s.db") as second:

        class Between(Serial):
            """Lets another coordinator run everything while the first batch is under way."""

            def run(self, batches):
                carried = carry_out(next(batches))
                other = Counting()
                assert run_campaign(small, second, other).counts.passed == 20
                assert other.jobs == 20
                yield carried
                assert not list(batches)

        found = run_campaign(small, first, Between())
    assert (found.jobs, found.counts.passed) == (20, 20)


def test_a_worker_with_other_code_refuses():
    job = Job("tests.campaign_jobs:ill_fated", {"fate": "pass", "size_mm": 1.0, "wait_s": 0.0}, 1, 0)
    assert len(carry_out(Batch(code.code_of(job.function), [("a", job)])).done) == 1
    with pytest.raises(OtherCodeError, match=r"worker .* has other code"):
        carry_out(Batch("older", [("a", job)]))


def test_batches_grow_to_a_second_and_end_together(plan, monkeypatch):
    sizes = []

    class Quick(Serial):
        workers = 2

        def run(self, batches):
            for batch in batches:
                sizes.append(len(batch.jobs))
                yield replace(carry_out(batch), seconds=0.02 * len(batch.jobs))

    with Store(":memory:") as store:
        run_campaign(replace(plan.only(["pass"]), runs=500), store, Quick())
    assert (sizes[0], max(sizes), sum(sizes)) == (1, 50, 500)
    assert sizes[-1] == 1


def test_parquet_holds_the_same_as_csv(plan, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    small = replace(plan.only(["pass", "fail"]), runs=2)
    with Store(":memory:") as store:
        run_campaign(small, store, Serial())
        addresses = addresses_of(small)
        write_csv(tmp_path / "a.csv", lambda: store.records(addresses), "again", small)
        write_parquet(tmp_path / "a.parquet", lambda: store.records(addresses), "again", small)
    table = parquet.read_table(tmp_path / "a.parquet")
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert table.column_names == list(rows[0])
    assert [{name: str(value) for name, value in row.items()} for row in table.to_pylist()] == rows


def test_exports_hold_a_row_for_each_job(plan, tmp_path):
    asked = Requirement(id="SR-1", where={}), Requirement(id="SR-2", where={"fate": ("fail",)})
    small = replace(plan.only(["pass", "fail", "idle"]), name="a & b", runs=2, requirements=asked)
    again = "rtec campaign 'a & b.toml'"
    with Store(":memory:") as store:
        run_campaign(small, store, Serial())
        addresses = addresses_of(small)
        write_csv(tmp_path / "a.csv", lambda: store.records(addresses), again, small)
        write_junit(tmp_path / "a.xml", lambda: store.records(addresses), again, small)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert len(lines) == 7
    assert lines[1].endswith(f"rtec campaign 'a & b.toml' --job {addresses[0]}")
    suite = ET.parse(tmp_path / "a.xml").getroot()[0]  # noqa: S314 - our own
    assert {key: suite.get(key) for key in ("name", "tests", "failures", "skipped")} == {
        "name": "a & b", "tests": "6", "failures": "2", "skipped": "2"
    }  # fmt: skip
    assert [case.find("failure") is not None for case in suite] == [False, True, False] * 2
    properties = {one.get("name"): one.get("value") for one in suite[0].iter("property")}
    assert properties["again"] == f"rtec campaign 'a & b.toml' --job {addresses[0]}"
    assert (properties["fate"], properties["run"], properties["requirement"]) == ("pass", "0", "SR-1")
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["requirement"] for row in rows] == ["SR-1", "SR-1 SR-2", "SR-1"] * 2
    assert {(row["plan"], row["seed"], row["version"]) for row in rows} == {
        ("a & b", "1", code.code_of("tests.campaign_jobs:ill_fated"))
    }
