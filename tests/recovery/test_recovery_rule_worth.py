"""What a rule is worth: it is left out, what it held back comes through, and the answers are kept."""

import json

import pytest
from inference_oracle import SIGMA, measured

from rtec.effects import Shape, effect_named
from rtec.inference.rules import RULES
from rtec.inference.scored import Judge
from rtec.inference.search import Search
from rtec.inference.space import Space
from rtec.metrology import write_measurement
from tools.rule_worth import by_expectation, by_truth, cases_of, games_of, page, play, rows

HAIR = "a tenth of the noise"


def hair():
    """A backlash of a tenth of the noise, certain after many readings: only its size speaks against it."""
    search = Search(Judge(Space(measured(lambda x, way, t, run: 0.1 * SIGMA * way, runs=200))))
    model = search.judge.score([(effect_named("backlash"), Shape())])
    refused = search.gate.why_not(model, 0) is not None
    return refused, () if refused else ("backlash",), () if refused else ("backlash",)


def nobody():
    raise AssertionError("asked again")


def test_a_rule_that_is_left_out_lets_through_what_it_held_back_and_the_answer_is_kept(tmp_path):
    path = tmp_path / "answers.jsonl"
    without = ["", "size", "misnamed"]
    found = play({"games": [(HAIR, hair)]}, without, path)
    assert [one.right for one in found] == [True, False, True]
    assert "size" in found[0].heard and "misnamed" not in found[0].heard
    assert len(path.read_text().splitlines()) == 2, "without a rule that never objected the answer is the same"
    assert play({"games": [(HAIR, nobody)]}, without, path) == found
    other, (name, *counts, changed, better, worse, new, p) = rows(found, ["games"])
    assert (name, counts, changed, better, worse, new, p) == ("size", ["1 → 0"], "1", "0", "1", "1", "1")
    assert other == ("misnamed", "1 → 1", "0", "0", "0", "0", "1")
    text = page(found, {"games": 1}, "a command")
    assert all(rule.asks in text and rule.earned in text for rule in RULES)


FOUND = {
    "verdict": "NAMED",
    "effects": ["scale", "backlash"],
    "candidates": [],
    "steps": [{"effect": "scale", "rms_train": 1.0, "p_adjusted": 1e-9}],
    "rms_after": 1.0,
}


@pytest.mark.parametrize(
    ("case", "right", "wrong"),
    [
        ({"must": ["scale", "windup|backlash"]}, True, set()),
        ({"must": ["cyclic"]}, False, set()),
        ({"verdicts": ["UNKNOWN"]}, False, set()),
        ({"must": ["scale"], "may": ["offset"]}, False, {"backlash"}),
        ({"never": ["backlash"]}, False, {"backlash"}),
        ({"most_left": 0.9}, False, set()),
    ],
)
def test_an_answer_is_as_expected(case, right, wrong):
    assert by_expectation(FOUND, case) == (right, wrong)


@pytest.mark.parametrize(
    ("effects", "kind", "tolerated", "right", "wrong"),
    [
        (["scale", "backlash"], "known", [], True, set()),
        (["scale"], "known", [], False, {"backlash"}),
        (["scale"], "known", ["backlash"], True, set()),
        (["scale", "backlash", "drift"], "known", [], False, set()),
        (["scale", "backlash", "drift"], "outside", [], True, set()),
    ],
)
def test_an_answer_tells_what_was_planted(effects, kind, tolerated, right, wrong):
    assert by_truth(FOUND, {"effects": effects, "kind": kind, "tolerated": tolerated}) == (right, wrong)


def test_a_step_that_raises_the_error_is_wrong():
    steps = [{"effect": "scale", "rms_train": size, "p_adjusted": 1e-9} for size in (1.0, 1.02)]
    assert by_expectation({**FOUND, "steps": steps}, {}) == (False, set())
    failing = [{"effect": "scale", "rms_train": 1.0, "p_adjusted": 0.02}]
    assert by_expectation({**FOUND, "steps": failing}, {}) == (False, set())


def test_measurements_of_a_folder_and_games_are_asked(tmp_path):
    from rtec.blind.game import play as played
    from rtec.blind.lines import the_lines
    from rtec.blind.scenario import Scenario

    write_measurement(tmp_path / "one.csv", played(Scenario(names=("backlash",), strength_sigma=5.0), seed=2)[0])
    (tmp_path / "truth.json").write_text(
        json.dumps({"one": {"effects": ["backlash"], "kind": "known", "tolerated": []}})
    )
    ((name, ask),) = cases_of(tmp_path)
    assert (name, ask()) == ("one", (True, ["backlash"], []))
    ((name, ask),) = games_of(the_lines()[:1], 1, 0)
    assert (name, ask()) == ("nothing, white noise, 0", (True, [], []))
