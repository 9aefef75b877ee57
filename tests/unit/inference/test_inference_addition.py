"""One effect added by name: what it brings, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, covariance, measured, one_chain

from rtec.effects import Shape, effect_named
from rtec.errors import ArgumentError
from rtec.inference.diagnose import add
from rtec.inference.model import Model, Term
from rtec.inference.results import Verdict

SCALE, CYCLIC = (effect_named(n) for n in ("scale", "cyclic"))
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def model(*terms, observe="deviation"):
    return Model(observe=observe, units=measured().units, terms=terms)


def test_an_effect_is_added_and_everything_refitted():
    data = measured(TILTED)
    wrong = Term(effect=SCALE, shape=Shape(), amplitudes=(3e-5,))
    result = add("backlash", data, model(wrong))
    assert result.model.names == ("scale", "backlash")
    assert [step.effect for step in result.steps] == ["backlash"]
    table = np.array([np.ones(210), data.conditions.position, data.conditions.direction / 2]).T
    noise = covariance(result.noise.correlation, result.noise.white_share, one_chain(data.rows))
    root = np.linalg.inv(np.linalg.cholesky(noise))
    numbers, *_ = np.linalg.lstsq(root @ table, root @ data.observed)
    assert result.model.terms[0].amplitudes[0] == pytest.approx(numbers[1], rel=0.01)
    assert result.model.terms[1].amplitudes[0] == pytest.approx(numbers[2], rel=0.01)
    left = data.observed - table @ numbers
    assert result.rms_after == pytest.approx(np.sqrt(np.mean(left**2)), rel=0.01)
    before = table[:, :2]
    without = data.observed - before @ np.linalg.lstsq(before, data.observed)[0]
    # least squares leave the least; beside the reversal error that is missing the noise is taken for slow
    assert 1.0 <= result.rms_before / np.sqrt(np.mean(without**2)) < 1.05
    assert result.steps[0].p_adjusted < 1e-6
    assert result.steps[0].gain > 2 * result.steps[0].gain_error
    assert result.verdict is Verdict.NAMED


def test_what_explains_nothing_is_added_all_the_same_and_judged():
    result = add("scale", measured(lambda x, way, t, run: 0.004 * way))
    assert result.model.names == ("scale",)
    (step,) = result.steps
    assert step.p_adjusted > 0.01
    assert ("not lower" in step.reason) is (step.gain <= 0.0)
    assert result.verdict not in (Verdict.NAMED, Verdict.TIED)
    worse = add("warm_up", measured(runs=2, seed=1)).steps[0]
    assert worse.gain < 0.0
    assert worse.reason.endswith("held-out error not lower with it")


def test_a_shape_is_found_or_taken_as_it_is_said():
    data = measured(lambda x, way, t, run: 0.006 * np.sin(2 * np.pi * x / 47.0))
    assert add("cyclic", data).model.terms[0].shape.period == pytest.approx(47.0, rel=0.01)
    said = CYCLIC.shape_type(50.0, 2)
    assert add("cyclic", data, shape=said).model.terms[0].shape == said


def test_the_other_measurement_scores():
    data, other = measured(TILTED), measured(TILTED, seed=5, runs=3)
    result = add("backlash", data, model(Term(effect=SCALE)), other)
    left = other.observed - result.model.predict(other)
    assert result.rms_heldout == pytest.approx(np.sqrt(np.mean(left**2)))
    assert result.rms_heldout == pytest.approx(SIGMA, rel=0.2)
    assert result.heldout_by == other.source


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("backlas", "backlash"),
        ("scale", "does not hold yet"),
        ("thermal_growth", "no temperature column"),
        ("inertia", "effects of deviation data"),
    ],
)
def test_what_cannot_be_added_is_refused(name, why):
    with pytest.raises(ArgumentError, match=why):
        add(name, measured(TILTED), model(Term(effect=SCALE)))


def test_nothing_is_added_to_what_never_changes():
    data = measured()
    for level in (0.0, 0.003):
        with pytest.raises(ArgumentError, match="never changes"):
            add("backlash", replace(data, observed=np.full(210, level)))


def test_an_added_tie_is_told():
    data = measured(lambda x, way, t, run: 0.006 * way, timed=False)
    data = replace(data, conditions=replace(data.conditions, velocity=20.0 * data.conditions.direction))
    result = add("servo_lag", data)
    assert result.verdict is Verdict.TIED
    assert result.candidates[0].tied_with == ("backlash",)
    assert "three feeds" in result.experiment.text


def test_a_second_one_of_the_same_form_is_refused():
    data = measured(lambda x, way, t, run: 2e-5 * x * (run > 2), timed=False)
    heat = {"temperature": 20.0 + 5.0 * (data.conditions.run > 2)}
    data = replace(data, conditions=replace(data.conditions, temperatures=heat))
    one = add("thermal_growth", data).model.terms[0]
    with pytest.raises(ArgumentError, match="thermal_growth is in the model in the form that explains most"):
        add("thermal_growth", data, model(one))
