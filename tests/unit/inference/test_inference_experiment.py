"""What to measure next."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import measured

from rtec.effects import Observable, Shape, distance_since_reversal, effect_named
from rtec.inference.answer import Rivalry, rivalries
from rtec.inference.experiment import (
    experiment_for_more,
    experiment_for_rivals,
    experiment_for_unknown,
    separating_plan,
)
from rtec.inference.results import Unknown
from rtec.inference.scored import Judge
from rtec.inference.search import Search
from rtec.inference.space import Space

BACKLASH, SCALE = effect_named("backlash"), effect_named("scale")


def at_one_feed():
    data = measured(lambda x, way, t, run: 0.005 * way + 5e-5 * x)
    return replace(data, conditions=replace(data.conditions, velocity=20.0 * data.conditions.direction))


def test_rivals_predict_different_readings_on_the_plan_that_separates_them():
    judge = Judge(Space(at_one_feed()))
    model = judge.score([(SCALE, Shape()), (BACKLASH, Shape())])
    other = judge.score([(SCALE, Shape()), (effect_named("servo_lag"), Shape())])
    rivalry = next(r for r in rivalries(Search(judge), model, 1) if r.rival == "servo_lag")
    assert rivalry.model is other
    found = experiment_for_rivals(judge, model, rivalry)
    assert "three feeds" in found.text
    assert found.rivals == ("backlash", "servo_lag")
    play, lag = found.predictions
    plan = separating_plan(judge.space)
    assert found.abscissa.tolist() == list(range(1, plan.rows + 1))
    assert play == pytest.approx(0.005 * plan.direction, abs=0.0008)
    # a lag of 0.005 mm at 20 mm/s, the reading ahead where the axis comes from below
    assert lag == pytest.approx(0.005 / 20.0 * plan.velocity, abs=0.0008)
    creep = np.abs(plan.velocity) < 2.0
    assert np.abs(lag[creep]).max() < 0.1 * np.abs(play[creep]).min()


def alone(name, data=None):
    judge = Judge(Space(measured() if data is None else data))
    return judge, judge.score([(effect_named(name), Shape())])


@pytest.mark.parametrize(("first", "second"), [("backlash", "servo_lag"), ("servo_lag", "backlash")])
def test_the_words_stand_on_the_card_of_either(first, second):
    found = experiment_for_rivals(*alone(first, at_one_feed()), Rivalry(effect=first, rival=second, cosine=1.0))
    assert "three feeds" in found.text
    assert found.abscissa is None


def test_where_several_are_tied_each_is_told_apart():
    tied = [Rivalry(effect="drift", rival=rival, cosine=1.0) for rival in ("scale", "thermal_shift", "windup")]
    found = experiment_for_rivals(*alone("drift"), tied[0], tied[1:])
    first, second = found.text.split("; then ")
    assert "return to the datum" in first
    assert "cool down again" in second
    assert found.rivals == ("drift", "scale")


def test_rivals_without_a_card_are_told_apart_by_their_needs():
    found = experiment_for_rivals(*alone("backlash"), Rivalry(effect="backlash", rival="warm_up", cosine=1.0))
    assert "a time column" in found.text
    assert "both directions" in found.text


def test_the_plan_varies_what_the_measurement_kept():
    data = at_one_feed()
    heat = np.linspace(20.0, 24.0, data.rows)
    data = replace(data, conditions=replace(data.conditions, temperatures={"screw": heat}, screw_pitch=5.0))
    plan = separating_plan(Space(data))
    c = data.conditions
    assert (plan.position.min(), plan.position.max()) == (c.places[0], c.places[-1])
    assert plan.both_directions
    speeds = np.unique(np.abs(plan.velocity).round(9))
    assert speeds.tolist() == [1.0, 10.0, 20.0]
    assert (np.sign(plan.velocity) == plan.direction).all()
    assert (plan.temperatures["screw"].min(), plan.temperatures["screw"].max()) == (20.0, 24.0)
    assert plan.since_reversal == pytest.approx(distance_since_reversal(plan.position, plan.direction, plan.run))
    # dense points after a reversal: four within a tenth of the span
    assert np.unique(plan.since_reversal[plan.since_reversal < 0.1 * c.span].round(6)).size >= 5
    assert np.unique(np.diff(plan.time_s)).tolist() == [10.0]
    assert (plan.screw_pitch, plan.position_unit) == (5.0, "mm")
    assert plan.acceleration is None


def test_the_plan_is_no_plan_for_drives_clocks_and_single_places():
    data = measured()
    assert separating_plan(Space(replace(data, observable=Observable.DRIVE))) is None
    assert separating_plan(Space(measured(unit="s", bidirectional=False))) is None
    assert separating_plan(Space(measured(at=np.array([10.0])))) is None
    untimed = separating_plan(Space(measured(timed=False)))
    assert (untimed.time_s, untimed.velocity) == (None, None)


def unknown(*depends):
    return Unknown(depends_on=depends, period=None, frequency_hz=None, description="")


def test_what_is_unknown_is_varied_on_purpose():
    text = experiment_for_unknown(unknown("position", "direction", "dwell_s"), measured()).text
    assert "twice as many targets" in text
    assert "dwells before the reversal" in text
    assert "vary dwell_s on purpose" in text
    texts = {experiment_for_unknown(unknown(name), measured()).text for name in ("time", "run")}
    assert len(texts) == 2


def test_a_pitch_that_nobody_stated_is_asked_for_where_it_could_help():
    def asks(data, *depends):
        return "--screw-pitch" in experiment_for_unknown(unknown(*depends), data).text

    data = measured()
    assert data.conditions.screw_pitch is None
    assert asks(data, "position")
    assert not asks(data, "time")
    assert not asks(replace(data, conditions=replace(data.conditions, screw_pitch=5.0)), "position")
    assert not asks(measured(unit="deg"), "position")
    assert not asks(measured(unit="s", bidirectional=False), "position")


def test_more_repeats_where_there_are_none():
    text = experiment_for_more(measured(runs=1), {}, {"scale": 0.001}, None).text
    assert "repeat the same targets" in text
    assert "five times" in text
    shift = experiment_for_more(measured(runs=1), {}, {"scale": 0.001}, "shift the targets by 1.5 mm").text
    assert shift.startswith(text)
    assert shift.endswith("shift the targets by 1.5 mm")


def test_targets_that_hide_periods_are_shifted_first():
    assert experiment_for_more(measured(), {}, {"scale": 0.001}, "shift the targets").text == "shift the targets"


def test_the_hardest_effect_to_see_is_named_with_its_size():
    found = experiment_for_more(measured(), {}, {"scale": 0.001, "windup": 0.0042}, None)
    assert "windup (from 4.2 µm RMS on)" in found.text
    assert "needs" not in found.text


def test_what_cannot_be_tested_says_what_it_needs():
    text = experiment_for_more(measured(), {"thermal_growth": "no temperature column"}, {}, None).text
    assert "thermal_growth needs a temperature column" in text
    assert experiment_for_more(measured(), {}, {}, None).text == "repeat with more targets"


def test_the_plan_that_separates_has_the_air_of_several_days():
    data = measured(runs=2)
    air = replace(data.conditions, pressure_hpa=np.full(data.rows, 1000.0), humidity_percent=np.full(data.rows, 40.0))
    plan = separating_plan(Space(replace(data, conditions=air)))
    assert [plan.pressure_hpa[plan.run == run].mean() for run in (1, 2, 3)] == [1000.0, 985.0, 1015.0]
    assert effect_named("refraction").untestable(plan) is None
    assert separating_plan(Space(data)).pressure_hpa is None
