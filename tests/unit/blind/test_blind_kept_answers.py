"""Answers that are kept beside a game: in order, out of sight, and not to be changed unnoticed."""

import base64
import json
import threading

import pytest

from rtec.blind import kept_answers as module
from rtec.blind.kept_answers import KeptAnswer, answers_path, keep, read_answers
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.blind.sealing import new
from rtec.errors import FileFormatError, OutputError


@pytest.fixture
def data(tmp_path):
    file = tmp_path / "data.csv"
    new(5, file, scenario=Scenario(names=("scale",), plan=PLANS["single_pass"]))
    return file


def answer(by, *words):
    return KeptAnswer(by=by, at="2026-01-01T00:00:00+00:00", words=words)


def test_answers_come_back_in_order(data):
    given = [answer("Ada", "scale=12 um/m"), answer("", "nothing"), answer("Bjørn", "drift", "scale")]
    assert [keep(data, one) for one in given] == [1, 2, 3]
    assert list(read_answers(data)) == given
    assert not any(word in answers_path(data).read_text() for word in ("scale", "drift", "Ada"))


def test_nobody_has_answered_yet(data):
    assert read_answers(data) == ()


def lines(data):
    return answers_path(data).read_text().splitlines()


@pytest.mark.parametrize("change", ["altered", "deleted", "swapped", "resealed"])
def test_a_change_is_noticed(data, change):
    for name in ("backlash", "drift", "scale"):
        keep(data, answer("Ada", name))
    first, second, third = lines(data)
    better = base64.b64encode(json.dumps({"by": "Ada", "at": "", "words": ["scale"]}).encode()).decode()
    changed = {
        "altered": [f"{better} {first.split()[1]}", second, third],
        "deleted": [second, third],
        "swapped": [second, first, third],
        # even with a link of its own that is right, for the next one holds the old one
        "resealed": [f"{better} {module._link(module._first_link(data), better)}", second, third],
    }
    answers_path(data).write_text("\n".join(changed[change]) + "\n")
    with pytest.raises(FileFormatError, match="was changed"):
        read_answers(data)
    with pytest.raises(FileFormatError, match="was changed"):
        keep(data, answer("Ada", "scale"))


def test_answers_of_another_game_are_noticed(data, tmp_path):
    keep(data, answer("Ada", "scale"))
    other = tmp_path / "other.csv"
    new(6, other, scenario=Scenario(names=("scale",), plan=PLANS["single_pass"]))
    answers_path(other).write_bytes(answers_path(data).read_bytes())
    with pytest.raises(FileFormatError, match=r"line 1: .*was changed"):
        read_answers(other)


def test_a_class_answers_at_the_same_moment(data):
    threads = [threading.Thread(target=keep, args=(data, answer(f"student {k}", "scale"))) for k in range(12)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {kept.by for kept in read_answers(data)} == {f"student {k}" for k in range(12)}
    assert not list(data.parent.glob("*.lock"))


def test_a_lock_that_stays_is_named(data, monkeypatch):
    monkeypatch.setattr(module, "_PATIENCE_S", 0.0)
    (data.parent / "data.csv.answers.lock").touch()
    with pytest.raises(OutputError, match=r"delete data\.csv\.answers\.lock"):
        keep(data, answer("Ada", "scale"))
