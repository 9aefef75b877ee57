"""The table of rules: every rule says what it asks and why, and says nothing when it is left out."""

import pytest
from inference_oracle import measured

from rtec.effects import CyclicShape, Shape, effect_named
from rtec.inference.forms import left_out
from rtec.inference.noise import noise_floor
from rtec.inference.rules import RULES, Against, objections, signs_of
from rtec.inference.scored import Judge
from rtec.inference.search import Search
from rtec.inference.space import Space

BACKLASH, CYCLIC, DRIFT, SPIKE, WINDUP = map(
    effect_named, ("backlash", "cyclic", "drift", "reversal_spike", "windup")
)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_a_rule_asks_one_question_and_says_what_earned_it_its_place(rule):
    assert rule.asks.endswith("?") and rule.asks.count("?") == 1
    assert rule.earned.endswith(".")
    assert [one.name for one in RULES].count(rule.name) == 1


@pytest.mark.parametrize(
    ("rule", "choices"),
    [
        ("doubtful", [(CYCLIC, CyclicShape(100.0))]),
        ("crowded", [(CYCLIC, CyclicShape(40.0)), (CYCLIC, CyclicShape(39.0))]),
        ("misnamed", [(SPIKE, SPIKE.shape_type(9.0)), (WINDUP, WINDUP.shape_type(9.0))]),
        ("worth", [(DRIFT, Shape())]),
        ("size", [(DRIFT, Shape())]),
        ("held-out gain", [(DRIFT, Shape()), (BACKLASH, Shape())]),
    ],
)
def test_a_rule_objects_until_it_is_left_out(rule, choices):
    search = Search(Judge(Space(measured(lambda x, way, t, run: 0.004 * way))))
    model = search.judge.score(choices)
    against = next(one.against for one in RULES if one.name == rule)

    def said():
        return set(objections(search.gate, model, 0, against))

    every = said()
    with left_out(*(one.name for one in RULES if one.name != rule)):
        own = said()
    with left_out(rule):
        others = said()
    assert own and own <= every
    assert others == every - own


def test_a_sign_that_is_left_out_is_not_seen():
    data = measured(lambda x, way, t, run: 0.004 * way + 4e-7 * (x - 150.0) ** 2)
    search = Search(Judge(Space(data)))
    model = search.judge.score([(BACKLASH, Shape())])
    floor = noise_floor(search.judge, model)
    every = {sign.text for sign in signs_of(search, model, floor, ["cyclic"])}
    assert any("cyclic" in text for text in every) and any("position" in text for text in every)
    for rule in (one for one in RULES if one.against in (Against.RESIDUAL, Against.NAMES)):
        with left_out(rule.name):
            rest = {sign.text for sign in signs_of(search, model, floor, ["cyclic"])}
        assert rest <= every
        assert (rest == every) is (rule.name not in ("approximate", "trend"))
