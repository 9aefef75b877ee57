"""Lines: what is published, that the games of a line stay the same, and what shares a bar."""

import hashlib
from collections import Counter

import numpy as np
import pytest

from rtec.blind.answer import Rule
from rtec.blind.confusion import confusion, seed_of
from rtec.blind.game import play
from rtec.blind.harder_lines import the_pools
from rtec.blind.line import Line
from rtec.blind.lines import the_lines
from rtec.blind.scenario import OUTSIDE, Scenario
from rtec.blind.scored import Game, LineScore
from rtec.errors import ArgumentError
from rtec.metrology import Reading

LINES = the_lines()
BY_TITLE = {line.title: line for line in LINES}
FIRST = {
    "nothing, white noise": "633704064aeb34a8",
    "a single effect, 3 sigma, white noise": "85afb7f19d8d0b0b",
    "outside the library, 3 sigma, white noise": "b527bd2611202605",
    "a lag in a moving log, 3 sigma, white noise": "7fe0064ca5ac5661",
    "drives and moving logs, 3 sigma": "69ae0b4545243379",
    "three effects, 3 sigma, drawn plans with repeats, above the detectable amplitude": "f8df6d16f684de0f",
}
"""Digest of the first game of some lines: games that change cannot be compared with those of before."""


def scenarios(title, count=60):
    line = BY_TITLE[title]
    return [line.scenario(trial, seed_of(0, title, trial)) for trial in range(count)]


@pytest.mark.parametrize(("title", "digest"), FIRST.items())
def test_the_games_of_a_line_stay_the_same(title, digest):
    seed = seed_of(0, title, 0)
    measurement, _ = play(BY_TITLE[title].scenario(0, seed), seed)
    found = hashlib.sha256()
    for quantity, column in sorted(measurement.columns.items()):
        found.update(quantity.encode() + column.values.round(9).tobytes())
    assert found.hexdigest()[:16] == digest


def test_every_kind_outside_the_library_is_played_as_often():
    title = next(line.title for line in LINES if line.rule is Rule.WRONG_NAME and "3 sigma, drawn" in line.title)
    drawn = Counter(name for game in scenarios(title, 2 * len(OUTSIDE)) for name in game.names)
    assert drawn == dict.fromkeys(OUTSIDE, 2)


def test_anything_at_all_is_played_at_one_to_five_sigma():
    games = scenarios("one to four effects, 1 to 5 sigma, any drawn plan", 200)
    assert {len(game.names) for game in games} == {1, 2, 3, 4}
    strengths = [strength for game in games for strength in game.strengths]
    assert min(strengths) < 1.2
    assert max(strengths) > 4.8
    assert {game.plan.runs for game in games} == {1, 2, 3, 4, 5}


def test_drives_and_logs_take_turns():
    games = scenarios("drives and moving logs, 3 sigma", 100)
    assert [game.plan.reading for game in games[:2]] == [Reading.MOVING, Reading.DRIVE]
    for game in games:
        assert "stribeck" not in game.names or "coulomb" in game.names
        assert game.plan.reading is Reading.DRIVE or {"servo_lag", "acceleration_lag"} & set(game.names)


def test_a_line_has_scenarios_or_draws_them():
    with pytest.raises(ArgumentError, match="scenarios"):
        Line(title="a", rule=Rule.NAMED, share=0.5)
    with pytest.raises(ArgumentError, match="scenarios"):
        Line(title="a", rule=Rule.NAMED, share=0.5, scenarios=(Scenario(),), draw=lambda trial, seed: Scenario())


def test_a_line_with_too_many_games_left_out_is_missed():
    line = Line(title="a", rule=Rule.NAMED, share=0.5, scenarios=(Scenario(),), most_left_out=0.2)
    right, weak = (Game(trial=0, seed=0, plan="", hidden="", said="", right=how) for how in (True, None))
    assert LineScore(line=line, games=(right,) * 8 + (weak,) * 2).reached
    assert not LineScore(line=line, games=(right,) * 8 + (weak,) * 3).reached


def test_lines_that_share_a_bar_are_counted_together():
    lines = [BY_TITLE[title] for title in the_pools()[0].members]
    answers = iter([("NAMED", ("drift",))] + [("NONE", ())] * 15)
    result = confusion(lines, 2, lambda _: next(answers))
    assert [(one.right, one.trials, one.reached) for one in result.pools] == [(15, 16, False)]
    assert "| nothing, drawn plans, all eight families of noise |" in result.as_markdown()
    assert "wrong at most 2% | 15 of 16 | 93.8% |" in result.as_markdown()
    assert confusion(lines[1:], 1, lambda _: ("NONE", ())).pools == ()
    assert not LineScore(line=the_pools()[0], games=()).reached


def test_drawn_sets_are_tallied_by_effect():
    line = BY_TITLE["one to four effects, 1 to 5 sigma, any drawn plan"]
    hidden = [name for trial in range(2) for name in line.scenario(trial, seed_of(0, line.title, trial)).names]
    result = confusion([line], 2, lambda _: ("NAMED", (hidden[0], "quantisation")))
    text = result.as_markdown()
    assert "Verdicts: NAMED 2." in text
    assert f"| {hidden[0]} | {hidden.count(hidden[0])} | {hidden.count(hidden[0])} |" in text
    assert "| quantisation | 0 | 0 | 2 |" in text
    assert "| none | 0 of 2 | 0.0% |" in text
    assert "| shown |" in text
    assert np.isclose(result.scores[0].share, 0.0)
