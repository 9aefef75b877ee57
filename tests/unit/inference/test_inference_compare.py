"""A measurement against a model: what is left, where it is, and which models have no place."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import measured as plan

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Observable, Units, effect_named
from rtec.errors import ArgumentError
from rtec.inference.compare import MOST_BINS, SHOWN_STRETCHES, check_model, compare, residual_by
from rtec.inference.model import Model, Term

UNITS = Units("mm", "mm", "s")
SIGMA = 0.001


def measured(error=lambda x, way, t: 0.0 * x, *, seed=1, sigma=SIGMA, **conditions):
    """Five bidirectional runs of 21 targets with noise of 1 um, and a known error."""
    data = plan(lambda x, way, t, run: error(x, way, t), length=400.0, seed=seed, sigma=sigma, **conditions)
    return replace(data, source="z.csv")


def model(*terms, datum=0.0):
    return Model(observe="deviation", units=UNITS, terms=terms, datum=datum)


def term(name, *amplitudes, **shape):
    effect = effect_named(name)
    return Term(effect=effect, shape=effect.shape_type(**shape), amplitudes=amplitudes or None)


def share(found, quantity):
    return next(where.share for where in found if where.quantity == quantity)


# where the residual lives


def test_a_reversal_error_goes_with_the_direction():
    data = measured(lambda x, way, t: 0.010 * way)
    found = residual_by(data, data.observed)
    first = next(where for where in found if where.quantity == "direction")
    # 10 um either way against 1 um of noise
    assert first.share == pytest.approx(1 - 1 / 101, abs=0.005)
    assert share(found, "position") == pytest.approx(0.0, abs=0.05)
    # every sweep has its own time and its own direction: that is no effect in time
    assert share(found, "time") < 0.01
    assert [stretch.direction for stretch in first.worst] in ([1, -1], [-1, 1])
    assert {stretch.direction: round(stretch.mean, 3) for stretch in first.worst} == {1: 0.01, -1: -0.01}


def test_a_bump_is_found_where_it_is():
    data = measured(lambda x, way, t: 0.020 * np.exp(-(((x - 200.0) / 15.0) ** 2)))
    found = residual_by(data, data.observed)
    assert found[0].quantity in ("position", "position and direction")
    position = next(where for where in found if where.quantity == "position")
    worst = position.worst[0]
    assert len(position.worst) == SHOWN_STRETCHES
    assert abs(worst.low - 200.0) < 10.0
    assert (worst.low, worst.rows, worst.direction) == (worst.high, 10, 0)
    at = np.abs(data.conditions.position - worst.low) < 1e-9
    assert worst.mean == pytest.approx(data.observed[at].mean())
    assert worst.rms == pytest.approx(np.sqrt((data.observed[at] ** 2).mean()))
    means = [abs(stretch.mean) for stretch in position.worst]
    assert means == sorted(means, reverse=True)
    assert (position.unit, share(found, "direction")) == ("mm", pytest.approx(0.0, abs=0.03))


def test_a_drift_goes_with_time_and_run():
    found = residual_by(data := measured(lambda x, way, t: 1e-5 * t, sigma=1e-4), data.observed)
    # 5 steps of a ramp leave 1/25 of its variance inside
    assert share(found, "time") == pytest.approx(0.96, abs=0.03)
    assert share(found, "run") == pytest.approx(0.96, abs=0.03)
    assert {where.quantity for where in found[:2]} == {"time", "run"}
    without = replace(data, conditions=replace(data.conditions, time_s=None))
    assert share(residual_by(without, without.observed), "row order") == pytest.approx(0.96, abs=0.03)


def test_a_drift_of_readings_that_do_not_repeat_goes_with_time():
    data = measured(lambda x, way, t: 1e-5 * t, sigma=1e-4)
    once = replace(data, cell=np.full(data.rows, -1))
    assert share(residual_by(once, once.observed), "time") > 0.98


def test_the_share_is_that_of_an_analysis_of_variance():
    from scipy.stats import f_oneway

    data = measured(lambda x, way, t: 0.001 * np.sin(x / 20.0))
    groups = [data.observed[np.abs(data.conditions.position - place) < 1e-9] for place in data.conditions.places]
    statistic = float(f_oneway(*groups).statistic)
    k, n = len(groups), data.rows
    explained = statistic * (k - 1) / (statistic * (k - 1) + n - k)
    assert share(residual_by(data, data.observed), "position") == pytest.approx(
        1 - (1 - explained) * (n - 1) / (n - k)
    )


def test_columns_of_every_kind_are_looked_at():
    heat = np.linspace(20.0, 24.0, 210)
    data = measured(temperatures={"temperature_nut": heat}, velocity=np.tile([5.0, 50.0], 105))
    data = replace(data, unknown=(("humidity", heat), ("broken", np.full(210, np.nan))))
    found = residual_by(data, 0.01 * (heat - 22.0))
    assert share(found, "temperature_nut") == pytest.approx(0.96, abs=0.03)
    assert share(found, "humidity") > 0.98
    assert {where.quantity for where in found} == {
        "position", "direction", "position and direction", "time", "run", "velocity", "distance since reversal",
        "temperature_nut", "humidity",
    }  # fmt: skip
    assert {where.quantity: where.unit for where in found}["temperature_nut"] == "degC"


def test_many_places_come_in_bins_and_time_may_stand_for_position():
    t = np.arange(1000.0)
    conditions = Conditions(position=t, position_unit="s", run=np.ones(1000, dtype=np.int64), time_s=t)
    data = Dataset(
        source="w.csv",
        observe="deviation",
        observable=Observable.DEVIATION,
        units=Units("deg", "s", "s"),
        observed=np.where(t > 500, 1.0, 0.0),
        conditions=conditions,
        cell=np.full(1000, -1),
    )
    (where,) = residual_by(data, data.observed)
    assert (where.quantity, where.unit) == ("time", "s")
    assert where.share > 0.95
    assert sum(stretch.rows for stretch in where.worst) == pytest.approx(5 * 1000 / MOST_BINS, abs=3)


# the comparison


def test_a_stated_model_is_taken_as_it_is():
    data = measured(lambda x, way, t: 0.006 * way + 2e-5 * x + 0.003)
    found = compare(data, model(term("backlash", 0.012), term("scale", 2e-5), datum=0.003))
    left = data.observed - 0.006 * data.conditions.direction - 2e-5 * data.conditions.position - 0.003
    assert found.residual == pytest.approx(left, abs=1e-15)
    assert found.rms == pytest.approx(np.sqrt((left**2).mean()))
    assert found.rms == pytest.approx(SIGMA, rel=0.15)
    assert found.rms_heldout == pytest.approx(found.rms)  # nothing was fitted
    assert found.noise.floor == pytest.approx(SIGMA, rel=0.15)
    assert found.heldout_by == "stretch"


def test_what_a_model_leaves_open_is_fitted():
    data = measured(lambda x, way, t: 0.006 * way + 0.01 * np.sin(2 * np.pi * x / 37.0))
    found = compare(data, model(term("backlash"), Term(effect=effect_named("cyclic"))))
    backlash, cyclic = found.model.terms
    assert backlash.amplitudes[0] == pytest.approx(0.012, abs=5 * 2 * SIGMA / np.sqrt(210))
    assert cyclic.shape.period == pytest.approx(37.0, rel=0.01)
    assert SIGMA * 0.85 < found.rms < found.rms_heldout < SIGMA * 1.3


def test_the_held_out_file_judges_the_fit_to_the_other():
    data = measured(lambda x, way, t: 0.006 * way)
    other = replace(measured(lambda x, way, t: 0.016 * way, seed=2), source="other.csv")
    found = compare(data, model(term("backlash")), other)
    fitted = found.model.terms[0].amplitudes[0]
    left = other.observed - found.model.datum - fitted / 2 * other.conditions.direction
    assert found.rms_heldout == pytest.approx(np.sqrt((left**2).mean()))
    assert found.rms_heldout == pytest.approx(0.010, rel=0.05)
    assert found.heldout_by == "other.csv"
    assert found.rms == pytest.approx(SIGMA, rel=0.15)


# models without a place


def test_models_of_something_else_are_refused():
    data = measured()
    with pytest.raises(ArgumentError, match=r"model: a model of force; use one of deviation.*z\.csv"):
        check_model(Model(observe="force", units=UNITS), data)
    with pytest.raises(ArgumentError, match="position in deg"):
        check_model(Model(observe="deviation", units=Units("mm", "deg", "s")), data)
    with pytest.raises(ArgumentError, match="observed in deg"):
        check_model(Model(observe="deviation", units=Units("deg", "mm", "s")), data)
    with pytest.raises(ArgumentError, match=r"the effect coulomb.*effects of deviation"):
        check_model(model(term("coulomb", 1.0)), data)


def test_an_effect_that_data_cannot_show_may_still_be_stated():
    # one direction only: nothing to fit a backlash to, yet half of it is there
    data = measured(lambda x, way, t: 0.006 * way)
    forward = data.take(data.conditions.direction > 0)
    with pytest.raises(ArgumentError, match="one direction only"):
        compare(forward, model(term("backlash")))
    assert compare(forward, model(term("backlash", 0.012))).rms == pytest.approx(SIGMA, rel=0.2)


def test_the_held_out_file_must_have_the_columns_too():
    heat = {"temperature": np.linspace(20.0, 25.0, 210)}
    with pytest.raises(ArgumentError, match=r"thermal_growth.*other\.csv can show.*no temperature column"):
        compare(measured(temperatures=heat), model(term("thermal_growth")), replace(measured(), source="other.csv"))


def test_a_stated_effect_without_its_column_is_refused_with_the_reason():
    with pytest.raises(ArgumentError, match=r"model: the effect acceleration_lag.*z\.csv can show.*moving"):
        compare(measured(), model(term("acceleration_lag", 0.001)))


def test_nothing_left_goes_with_nothing():
    data = measured()
    assert {where.share for where in residual_by(data, np.zeros(data.rows))} == {0.0}
