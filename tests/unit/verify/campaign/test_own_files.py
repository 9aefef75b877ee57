"""Algorithms of one's own in plans: the text goes with the job, and an edited file makes other jobs."""

import json
from pathlib import Path

import pytest

import rtec.examples
from rtec.cli import main
from rtec.errors import RtecError
from rtec.verify.campaign import own_files
from rtec.verify.campaign.executors import Processes, Serial
from rtec.verify.campaign.plan import read_plan
from rtec.verify.campaign.run import addresses_of, run_campaign
from rtec.verify.campaign.store import Store

MINE = "from shared import X\nclass Mine:\n    def step(self, t_ps, ab, requested):\n        return ab, X, 0\n"


@pytest.fixture
def plan_of(tmp_path):
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "shared.py").write_text("X = 0\n")

    def read(tried='design = "c"\nalgorithm = "mine.py:Mine"', job="tests.campaign_jobs:OWN"):
        file = tmp_path / "plan.toml"
        file.write_text(f'job = "{job}"\n[try]\n{tried}\n')
        return read_plan(str(file))

    return read


def test_text_and_what_it_imports_reach_a_process_that_cannot_see_the_file(plan_of, tmp_path):
    plan = plan_of()
    for file in ("mine.py", "shared.py"):
        (tmp_path / file).unlink()
    with Store(":memory:") as store:
        found = run_campaign(plan, store, Processes(1))
        record = next(store.records(addresses_of(plan))).record
    assert found.good, found.raised
    assert (record["class"], record["texts"]) == ("Mine", f"mine.py: {MINE}shared.py: X = 0\n")
    assert not Path(record["folder"]).exists()  # it went with its process


def test_an_edited_file_runs_anew_and_the_same_text_elsewhere_does_not(plan_of, tmp_path):
    plan = plan_of()
    (tmp_path / "sub").mkdir()
    for file in ("mine.py", "shared.py"):
        (tmp_path / "sub" / file).write_text((tmp_path / file).read_text())
    there = plan_of('design = "c"\nalgorithm = "sub/mine.py:Mine"')
    (tmp_path / "shared.py").write_text("X = 1\n")
    edited = plan_of()
    with Store(":memory:") as store:
        counted = [run_campaign(each, store, Serial()).counts.passed for each in (plan, there, edited)]
        addresses = [addresses_of(each) for each in (plan, there, edited)]
    assert counted == [1, 1, 1]
    assert addresses[0] == addresses[1] != addresses[2]


def test_a_job_whose_text_did_not_come_is_told(plan_of, monkeypatch):
    job = next(plan_of().jobs())
    monkeypatch.setattr(own_files, "_KNOWN", {})
    own_files.unpacked.cache_clear()
    with pytest.raises(RtecError, match=r"mine.py:Mine: its text did not come with the job"):
        job.carry_out()


def test_several_are_told_apart(plan_of):
    plan = plan_of('design = "c"\nalgorithm = ["none", "mine.py:Mine"]')
    assert [str(job.parameters["algorithm"]).partition("#")[0] for job in plan.jobs()] == ["none", "mine.py:Mine"]
    assert len(list(plan.only(["algorithm=mine.py:Mine"]).jobs())) == 1


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("none.py:Mine", "none.py: there is no such file"),
        ("mine.py:Mune", "a class of the file: Mine; did you mean 'Mine'"),
        ("mine.py", "use mine.py:Mine, mine.ihx or none"),
        ("top.v:Mine", "use mine.py:Mine, mine.ihx or none"),
        ("broken.py:Mine", "broken.py, line 1 is no Python"),
    ],
)
def test_what_is_refused(plan_of, tmp_path, value, said):
    (tmp_path / "broken.py").write_text("class (:\n")
    with pytest.raises(RtecError, match=said):
        plan_of(f'design = "c"\nalgorithm = "{value}"')


def test_it_needs_the_design_whose_step_it_has(plan_of):
    with pytest.raises(RtecError, match="use design beside it: the one whose step and states it has"):
        plan_of('algorithm = "mine.py:Mine"')


def test_faults_and_motions_take_it_and_one_job_is_run_again_by_its_address(plan_of, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (Path(rtec.examples.__file__).parent / "design_c_bug.py").read_text()
    (tmp_path / "mine.py").write_text(text.replace("class DesignC", "class Mine"))
    own = 'design = "c"\nalgorithm = "mine.py:Mine"\n'
    plan_of(own + 'phase = "cutting"\nfault = "pc-killed"', job="fault")
    assert main(["campaign", "plan.toml", "--workers", "1", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["total"]["outcomes"] == {"wrong without any fault": 1}
    plan_of(own + 'frequency = "500 kHz"\nmotion = "adversary"', job="motion")
    assert main(["campaign", "plan.toml", "--workers", "1", "--json", "--seed", "3", "--runs", "8"]) == 1
    failing = json.loads(capsys.readouterr().out)["failing"][0]
    assert (failing["outcome"], failing["algorithm"][:13]) == ("undetected", "mine.py:Mine#")
    words = ["campaign", "plan.toml", "--seed", "3", "--runs", "8", "--job", failing["job"]]
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["as_stored"] is True
