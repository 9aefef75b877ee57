"""Scoring: intervals, what counts as right, what is counted, and the tables."""

import math
from types import SimpleNamespace

import pytest

from rtec.blind.answer import Answer, Rule, answer_of, is_right, label_of
from rtec.blind.confusion import confusion
from rtec.blind.hidden import Hidden, Secret
from rtec.blind.line import Line
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.blind.scored import wilson
from rtec.effects import Units
from rtec.errors import ArgumentError
from rtec.inference.results import Verdict

POOR = PLANS["single_pass"]


def secret(*names, plan="base", strength=3.0, noise="white"):
    effects = tuple(Hidden(name=name, description="", parameters=(), rms_sigma=strength) for name in names)
    return Secret(effects=effects, noise=noise, sigma_um=2.0, seed=0, plan=plan, outside=())


def line(rule=Rule.NAMED, names=("scale",), share=0.5, **more):
    return Line(title="a line", rule=rule, share=share, scenarios=(Scenario(names=names, plan=POOR),), **more)


@pytest.mark.parametrize("right", [0, 1, 7, 19, 20])
def test_the_bounds_of_an_interval_are_where_the_score_is_its_quantile(right):
    z, n = 1.959963984540054, 20
    for bound in wilson(right, n):
        if bound not in (0.0, 1.0):
            assert abs(right / n - bound) == pytest.approx(z * math.sqrt(bound * (1 - bound) / n), rel=1e-9)
    low, high = wilson(right, n)
    assert 0.0 <= low <= right / n <= high <= 1.0
    assert (low == 0.0) == (right == 0)
    assert (high == 1.0) == (right == n)


def test_no_trials_say_nothing():
    assert wilson(0, 0) == (0.0, 1.0)


RIGHT = [
    (Rule.NOTHING, Answer("NONE"), secret(), True),
    (Rule.NOTHING, Answer("UNKNOWN", ("drift",)), secret(), False),
    (Rule.NOTHING, Answer("TIED"), secret(), False),
    (Rule.NAMED, Answer("NAMED", ("scale",)), secret("scale"), True),
    (Rule.NAMED, Answer("NAMED", ("scale", "drift")), secret("scale"), False),
    (Rule.NAMED, Answer("NAMED", ("drift",)), secret("scale", "drift"), False),
    (Rule.NAMED, Answer("UNKNOWN", ("scale",)), secret("scale"), False),
    (Rule.NAMED, Answer("LIKELY", ("scale",)), secret("scale"), False),
    (Rule.WRONG_NAME, Answer("NONE"), secret(), True),
    (Rule.WRONG_NAME, Answer("NAMED", ("drift",)), secret(), False),
    (Rule.WRONG_NAME, Answer("UNKNOWN", ("drift",)), secret(), True),
    (Rule.WRONG_NAME, Answer("TIED", (), ("scale", "drift")), secret(), False),
    (Rule.WRONG_NAME, Answer("TIED", (), (), accepted=("drift",)), secret(), False),
    (Rule.WRONG_NAME, Answer("NAMED", ("pitch_map",)), secret("moving_bump"), False),
    (Rule.WRONG_NAME, Answer("NAMED", ("drift",)), secret("drift", "scale"), True),
    (Rule.WRONG_NAME, Answer("NAMED", ("run_offset",)), secret(), False),
    (Rule.WRONG_NAME, Answer("NAMED", ("run_offset",)), secret(noise="offsets per run"), True),
    (Rule.UNKNOWN, Answer("UNKNOWN", ("backlash",)), secret("moving_bump"), True),
    (Rule.UNKNOWN, Answer("NAMED", ("pitch_map",)), secret("moving_bump"), False),
    (Rule.TIED, Answer("TIED", (), ("scale", "drift"), "return to the datum"), secret("scale"), True),
    (Rule.TIED, Answer("TIED", (), ("drift", "warm_up"), "return to the datum"), secret("scale"), False),
    (Rule.TIED, Answer("TIED", (), ("scale", "drift"), "use three feeds"), secret("scale"), False),
    (Rule.TIED, Answer("TIED", (), ("backlash", "servo_lag"), "use three Feeds"), secret("backlash"), True),
]


@pytest.mark.parametrize(("rule", "answer", "hidden", "right"), RIGHT)
def test_what_is_right(rule, answer, hidden, right):
    assert is_right(rule, answer, hidden) is right


def test_likely_will_do_where_nothing_is_repeated():
    likely = Answer("LIKELY", ("scale",))
    assert is_right(Rule.NAMED, likely, secret("scale"), repeated=False)
    assert not is_right(Rule.NAMED, likely, secret("drift"), repeated=False)
    assert is_right(Rule.NAMED, Answer("NAMED", ("scale",)), secret("scale"), repeated=False)
    assert confusion([line()], 1, lambda _: ("LIKELY", ("scale",))).scores[0].right == 1  # a single pass
    twice = Line(title="x", rule=Rule.NAMED, share=0.5, scenarios=(Scenario(names=("scale",)),))
    assert confusion([twice], 1, lambda _: ("LIKELY", ("scale",))).scores[0].right == 0


def test_trials_are_counted_and_tabulated():
    answers = iter([("NAMED", ("scale",)), ("NAMED", ("drift",)), ("TIED", ()), ("NAMED", ("scale",))])
    told = []
    result = confusion(
        [line()], 4, lambda _: next(answers), progress=lambda title, share: told.append((title, share))
    )
    score = result.scores[0]
    assert (score.right, score.trials, score.share, score.reached) == (2, 4, 0.5, True)
    assert score.cells == (("scale", "TIED", 1), ("scale", "drift", 1), ("scale", "scale", 2))
    assert told[0] == ("a line", 0.0)
    assert told[-1] == ("a line", 1.0)
    text = result.as_markdown()
    assert "| a line | what was hidden is named, and nothing else | at least 50% | 2 of 4 | 50.0% |" in text
    assert "15.0% to 85.0%" in text
    assert "| hidden \\ answered | scale | TIED | drift |" in text
    assert "| scale | 2 | 1 | 1 |" in text


def test_what_is_weaker_than_the_judge_would_find_does_not_count():
    weak = Answer("NONE", detectable_um={"scale": 6.1})  # three sigma are 6 um
    strong = Answer("NONE", detectable_um={"scale": 5.9})
    score = confusion([line(above_detectable=True)], 3, lambda _: weak).scores[0]
    assert (score.trials, score.left_out) == (0, 3)
    assert math.isnan(score.share)
    assert not score.reached
    score = confusion([line(above_detectable=True)], 3, lambda _: strong).scores[0]
    assert (score.trials, score.left_out) == (3, 0)
    assert confusion([line()], 3, lambda _: weak).scores[0].trials == 3


def test_the_floor_needs_a_refit_and_counts_ten_percent():
    floor = line(Rule.FLOOR)
    with pytest.raises(ArgumentError, match="refit"):
        confusion([floor], 1, lambda _: ("NONE", ()))
    found = iter([(1.09, 1.0), (1.11, 1.0)])
    asked = []

    def refit(measurement, names):
        asked.append((measurement.rows, names))
        return next(found)

    score = confusion([floor], 2, lambda _: ("NONE", ()), refit=refit).scores[0]
    assert (score.right, score.trials) == (1, 2)
    assert asked == [(21, ("scale",))] * 2


def test_games_of_a_line_do_not_depend_on_the_other_lines():
    def seen(lines):
        rows = []
        confusion(lines, 2, lambda m: (rows.append(m.columns["actual"].values.tolist()), ("NONE", ()))[1])
        return rows

    first = line()
    other = Line(title="another", rule=Rule.NOTHING, share=0.9, scenarios=(Scenario(plan=POOR),))
    assert seen([first]) == seen([other, first])[2:]
    assert len({tuple(row) for row in seen([other, first])}) == 4


@pytest.mark.parametrize("trials", [0, 1.5, 100_001])
def test_trials_outside_their_range_are_refused(trials):
    with pytest.raises(ArgumentError, match="trials"):
        confusion([line()], trials, lambda _: ("NONE", ()))


def test_a_diagnosis_gives_its_answer_in_micrometres():
    rivals = [
        SimpleNamespace(effect="scale", tied_with=("drift",), accepted=True),
        SimpleNamespace(effect="drift", tied_with=("scale",), accepted=False),
        SimpleNamespace(effect="cyclic", tied_with=(), accepted=False),
    ]
    diagnosis = SimpleNamespace(
        verdict=Verdict.TIED,
        effects=("scale",),
        candidates=rivals,
        experiment=SimpleNamespace(text="return to the datum"),
        minimum_detectable=(("cyclic", 0.002),),
        dataset=SimpleNamespace(units=Units("mm", "mm", "s")),
        model=SimpleNamespace(terms=()),
    )
    answer = answer_of(diagnosis)
    assert answer == Answer(
        "TIED", ("scale",), ("scale", "drift"), "return to the datum", {"cyclic": 2.0}, accepted=("scale",)
    )
    diagnosis.probability = {"scale": 0.97}
    assert answer_of(diagnosis).probability == {"scale": 0.97}


def test_an_answer_without_a_name_is_labelled_by_its_verdict():
    assert label_of(Answer("INCONCLUSIVE")) == "INCONCLUSIVE"
    assert label_of(Answer("NAMED", ("b", "a"))) == "a + b"
    assert label_of(Answer("LIKELY", ("b", "a"))) == "a + b"
