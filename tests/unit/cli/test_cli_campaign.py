"""rtec campaign: plans from the command line, exit codes, and a coordinator that is stopped."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from rtec.cli import main
from rtec.cli._words import CAMPAIGNS
from rtec.verify.campaign.plan import BUILT_IN


@pytest.fixture(autouse=True)
def plan(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(
        'job = "tests.campaign_jobs:KIND"\nruns = 40\n[try]\nfate = ["pass", "fail", "idle", "raise", "never"]\n'
        'wait = "0 s"\n'
    )


def said(capsys, *words):
    code = main(["campaign", *words])
    return code, *capsys.readouterr()


def test_a_campaign_says_what_was_tried_and_repeats_any_job(capsys):
    words = ("mine.toml", "--workers", "1", "--only", "pass,fail,idle", "--runs", "3")
    code, out, _ = said(capsys, *words, "--csv", "a.csv", "--junit", "a.xml")
    assert code == 1
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert lines[1].startswith("pass 3 0 < 0.63 0")
    assert lines[3] == "idle 0 0 - 3"
    assert "9 of 9 jobs done: 3 passed, 3 failed, 0 exempt, 3 not activated." in lines
    again = next(line for line in lines if line.startswith("failed: ")).partition("again: rtec campaign ")[2]
    code, out, _ = said(capsys, *again.split())
    document = json.loads(out)
    assert (code, document["fate"], document["as_stored"]) == (0, "fail", True)
    code, out, _ = said(capsys, *words, "--json")
    document = json.loads(out)
    assert [document[key] for key in ("jobs", "done", "failed", "not_activated")] == [9, 9, 3, 3]
    assert [row["fate"] for row in document["rows"]] == ["pass", "fail", "idle"]
    assert document["holes"] == [{"fate": "idle"}]


def test_a_campaign_in_which_all_is_well_exits_with_0(capsys):
    assert said(capsys, "mine.toml", "--workers", "1", "--only", "pass")[0] == 0
    code, out, _ = said(capsys, "mine.toml", "--only", "pass,fail", "--count", "--json")
    assert (code, json.loads(out)) == (0, {"plan": "mine", "jobs": 80, "done": 40})


def test_records_are_counted_by_any_parameters(capsys):
    words = ("mine.toml", "--only", "pass,fail", "--runs", "2", "--workers", "1", "--json")
    rows = [json.loads(said(capsys, *words, "--by", by)[1])["rows"] for by in ("wait, fate", "level")]
    assert [(row["wait_s"], row["fate"], row["jobs"]) for row in rows[0]] == [(0.0, "pass", 2), (0.0, "fail", 2)]
    assert [(row["level"], row["passed"], row["failed"]) for row in rows[1]] == [(0, 2, 2)]


def test_a_record_that_cannot_be_repeated_is_told(capsys):
    said(capsys, "mine.toml", "--workers", "1", "--only", "pass", "--runs", "1", "--store", "s.db")
    with sqlite3.connect("s.db") as connection:
        address = connection.execute("SELECT address FROM records").fetchone()[0]
        connection.execute("UPDATE records SET record = ?", ('{"result": "passed", "value": 3}',))
    code, out, err = said(capsys, "mine.toml", "--job", address, "--store", "s.db")
    assert (code, json.loads(out)["as_stored"]) == (2, False)
    assert "gives another record than the one in s.db" in err


def test_stores_of_two_machines_are_merged(capsys):
    said(capsys, "mine.toml", "--workers", "1", "--only", "pass", "--store", "a.db")
    code, _, err = said(capsys, "mine.toml", "--workers", "1", "--only", "pass", "--store", "b.db", "--merge", "a.db")
    assert (code, "40 records taken over from a.db" in err) == (0, True)


def test_plans_are_listed_and_shown(capsys, tmp_path):
    assert CAMPAIGNS == BUILT_IN
    code, out, _ = said(capsys, "--list")
    assert (code, [line.split()[0] for line in out.splitlines()]) == (0, list(BUILT_IN))
    assert [one["plan"] for one in json.loads(said(capsys, "--list", "--json")[1])["plans"]] == list(BUILT_IN)
    code, out, _ = said(capsys, "--show", "motions")
    (tmp_path / "own.toml").write_text(out)
    counts = [json.loads(said(capsys, name, "--count", "--json")[1])["jobs"] for name in ("motions", "own.toml")]
    assert counts[0] == counts[1] > 1000


@pytest.mark.parametrize(
    ("words", "said_"),
    [
        ([], "PLAN is missing"),
        (["safet"], "did you mean 'safety'"),
        (["safety", "--only", "glich"], "did you mean 'glitches"),
        (
            ["safety", "--runs", "1000"],
            "2112000 jobs is a large product; use at most 100000 jobs, or --yes",
        ),
        (
            ["mine.toml", "--only", "never"],
            "no job of it can prove anything; use other values; it never",
        ),
        (["mine.toml", "--only", "level=zero"], "--only level"),
        (["mine.toml", "--job", "xyz"], "--job: 'xyz' is no job of this plan"),
        (["mine.toml", "--store", "mine.toml"], "mine.toml: file is not a database"),
        (
            ["mine.toml", "--scheduler", "tcp://127.0.0.1:1", "--workers", "2"],
            "--workers does not go with --scheduler",
        ),
        (["mine.toml", "--csv", "a.txt"], ".csv"),
        (
            ["mine.toml", "--by", "fates"],
            "'fates' is not a parameter; use one of fate, size, wait, level; did you mean",
        ),
        (["mine.toml", "--store", "none/s.db"], "none/s.db: unable to open database file; name a file in a folder"),
    ],
)
def test_what_is_refused(capsys, words, said_):
    code, out, err = said(capsys, *words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said_ in err
    assert not list(Path().glob("*.db*"))


def begun(*words):
    """A campaign in a process of its own."""
    path = os.pathsep.join([*filter(None, sys.path), os.environ.get("PYTHONPATH", "")])
    code = "import sys; from rtec.cli import main; sys.exit(main())"
    return subprocess.Popen(
        [sys.executable, "-c", code, "campaign", "slow.toml", "--store", "s.db", *words],
        env=os.environ | {"PYTHONPATH": path}, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip


def stored():
    with sqlite3.connect("s.db") as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        return connection.execute("SELECT count(*), count(DISTINCT address) FROM records").fetchone()


def slow_plan(tmp_path, runs, wait):
    (tmp_path / "slow.toml").write_text(
        f'job = "tests.campaign_jobs:KIND"\nruns = {runs}\n[try]\nwait = "{wait}"\nfate = "pass"\n'
    )


def wait_for_some():
    for _ in range(600):
        try:
            if stored()[0]:
                return
        except sqlite3.OperationalError:
            pass
        time.sleep(0.02)
    raise AssertionError("nothing was stored within 12 s")


def test_ctrl_c_says_how_to_go_on_and_the_same_command_does(capsys, tmp_path):
    slow_plan(tmp_path, 60, "50 ms")
    process = begun("--workers", "1")
    wait_for_some()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "what is done is in s.db; the same command goes on with the rest" in err
    before = stored()[0]
    assert 0 < before < 60
    code, out, _ = said(capsys, "slow.toml", "--store", "s.db", "--workers", "1", "--json")
    assert (code, json.loads(out)["done"], stored()) == (0, 60, (60, 60))


def test_two_commands_at_once_share_the_work_and_count_each_job_once(capsys, tmp_path):
    slow_plan(tmp_path, 100, "20 ms")
    both = [begun("--workers", "1", "--json") for _ in range(2)]
    for process in both:
        out, err = process.communicate(timeout=60)
        assert (process.returncode, json.loads(out)["passed"]) == (0, 100), err
    assert stored() == (100, 100)


@pytest.mark.sweep
def test_kill_9_at_100_moments_loses_and_doubles_nothing(capsys, tmp_path):
    slow_plan(tmp_path, 3000, "2 ms")
    moments, last = np.random.default_rng(4), 0
    for _ in range(100):
        process = begun("--workers", "1")
        time.sleep(moments.uniform(0.0, 2.0))
        process.kill()
        process.communicate()
        try:
            number, different = stored()
        except sqlite3.OperationalError:  # it had not made the tables yet
            continue
        assert number == different >= last
        last = number
    code, out, _ = said(capsys, "slow.toml", "--store", "s.db", "--workers", "2", "--json")
    assert (code, json.loads(out)["done"], stored()) == (0, 3000, (3000, 3000))
