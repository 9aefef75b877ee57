"""Fits and their errors: against dense generalised least squares, and against Monte Carlo."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, coloured, covariance, measured, whitened

from rtec.effects import Observable, Shape, effect_named
from rtec.errors import ArgumentError
from rtec.inference.fit import (
    fit_model,
    fitted_terms,
    jointly_refitted,
    needs_datum,
    noise_after,
    opened_model,
    residual_of,
    shapes_found,
    solved,
    values_of,
)
from rtec.inference.model import Model, Term
from rtec.inference.noise import Noise
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Workspace

SCALE, BACKLASH, CYCLIC, OFFSET = (effect_named(n) for n in ("scale", "backlash", "cyclic", "offset"))
TILTED = lambda x, way, t, run: 0.010 + 5e-5 * x + 0.004 * way
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]


def noise(rho=0.0, white=0.0, *, sigma=SIGMA, from_repeats=True):
    correlation = Correlation(rho=rho, white=white)
    return Noise(sigma=sigma, correlation=correlation, freedom=100.0, from_repeats=from_repeats)


def model(*names, data=None, **shapes):
    terms = tuple(Term(effect=effect_named(n), shape=shapes.get(n)) for n in names)
    return Model(observe="deviation", units=(data or measured()).units, terms=terms)


def columns_of(data, choices):
    return np.vstack([*(data.columns(e, s).T for e, s in choices), np.ones((1, data.rows))])


@pytest.mark.parametrize(("rho", "white"), [(0.0, 0.0), (0.9, 0.0), (0.95, 0.3)])
def test_amplitudes_and_errors_are_those_of_dense_generalised_least_squares(rho, white):
    data = measured(TILTED, runs=3, targets=9)
    matrix = covariance(rho, white, np.arange(data.rows) % 18 == 0)
    table = columns_of(data, BOTH).T
    inverse = np.linalg.inv(matrix)
    information = table.T @ inverse @ table
    expected = np.linalg.solve(information, table.T @ inverse @ data.observed)
    errors = SIGMA * np.sqrt(np.diag(np.linalg.inv(information)))
    terms, zero = fitted_terms(Workspace(data, noise(rho, white)), BOTH, datum=True)
    assert [term.amplitudes[0] for term in terms] == pytest.approx(expected[:2])
    assert zero == pytest.approx(expected[2])
    assert [term.errors[0] for term in terms] == pytest.approx(errors[:2])


@pytest.mark.parametrize(("rho", "white"), [(0.9, 0.0), (0.99, 0.0), (0.95, 0.3)])
def test_errors_of_ordinary_least_squares_beside_correlated_noise(rho, white):
    """Without repeats nothing is whitened, and the covariance is the sandwich (A'A)^-1 A'SA (A'A)^-1."""
    data = measured(TILTED, runs=1, targets=30)
    table = columns_of(data, BOTH).T
    bread = np.linalg.inv(table.T @ table)
    spread = bread @ table.T @ covariance(rho, white, np.arange(60) == 0) @ table @ bread
    terms, _ = fitted_terms(Workspace(data, noise(rho, white, from_repeats=False)), BOTH, datum=True)
    found = [term.errors[0] for term in terms]
    assert found == pytest.approx((SIGMA * np.sqrt(np.diag(spread)))[:2], rel=1e-6)
    assert [t.amplitudes[0] for t in terms] == pytest.approx(np.linalg.lstsq(table, data.observed)[0][:2])


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_standard_errors_of_a_whole_fit_against_monte_carlo(rho):
    """Fits to repeats with noise whose size and correlation have to be found, too."""
    truth, found, errors = (5e-5, 0.008), [], []
    for seed in range(100):
        data = measured(TILTED, at=np.linspace(0, 300, 21), rho=rho, seed=seed, timed=False)
        fitted = fit_model(data, model("scale", "backlash"))
        found.append([term.amplitudes[0] for term in fitted.terms])
        errors.append([term.errors[0] for term in fitted.terms])
    # 100 draws know a standard deviation to 7 %
    assert np.std(found, axis=0) / np.mean(errors, axis=0) == pytest.approx(np.ones(2), abs=0.28)
    assert (np.mean(found, axis=0) - truth) / np.std(found, axis=0) * 10 == pytest.approx(np.zeros(2), abs=4.0)


def test_standard_errors_of_a_period_against_monte_carlo():
    periods, amplitudes, errors = [], [], []
    wave = lambda x, way, t, run: 0.004 * np.sin(2 * np.pi * x / 47.0)
    for seed in range(60):
        data = measured(wave, at=np.linspace(0, 300, 21), seed=seed, timed=False)
        work = Workspace(data, noise())
        choices = jointly_refitted(work, [(CYCLIC, CYCLIC.shape_type(47.2))], datum=True)
        terms, _ = fitted_terms(work, choices, datum=True)
        periods.append(choices[0][1].period)
        amplitudes.append(terms[0].amplitudes[0])
        errors.append([dict(terms[0].shape_errors)["period"], terms[0].errors[0]])
    spread = np.array([np.std(periods), np.std(amplitudes)])
    assert spread / np.mean(errors, axis=0) == pytest.approx(np.ones(2), abs=0.35)
    assert np.mean(periods) == pytest.approx(47.0, abs=4 * np.std(periods) / np.sqrt(60))


def test_a_joint_refit_finds_the_least_squares_of_all_shapes_at_once():
    error = lambda x, way, t, run: 0.01 * np.sin(x / 9.0) + 0.006 * np.sin(x / 7.6 + 1)
    data = measured(error, sigma=1e-9, targets=40)
    work = Workspace(data, noise())
    near = [(CYCLIC, CYCLIC.shape_type(18 * np.pi + 0.8)), (CYCLIC, CYCLIC.shape_type(15.2 * np.pi - 0.4))]
    refitted = jointly_refitted(work, near, datum=True)
    periods = [shape.period for _, shape in refitted]
    assert periods == pytest.approx([18 * np.pi, 15.2 * np.pi], rel=1e-5)
    assert work.background(refitted).rss < 1e-10 < work.background(near).rss


def test_a_refit_never_makes_it_worse_and_leaves_what_has_no_shape():
    data = measured(TILTED)
    work = Workspace(data, noise())
    assert jointly_refitted(work, BOTH, datum=True) == BOTH


def test_amplitudes_that_cannot_be_negative_stay_at_zero():
    friction, inertia = effect_named("viscous"), effect_named("inertia")
    rng = np.random.default_rng(0)
    speed, push = rng.normal(size=200), rng.normal(size=200)
    data = measured(runs=1, targets=100)
    conditions = replace(data.conditions, velocity=speed, acceleration=push, moving=True)
    observed = -2.0 * speed + 3.0 * push
    data = replace(data, observable=Observable.DRIVE, conditions=conditions, observed=observed)
    work = Workspace(data, noise(from_repeats=False))
    numbers, zero = solved(work, [(friction, Shape()), (inertia, Shape())], datum=False)
    # with the friction at its bound, the rest is the fit of the inertia alone
    assert numbers[0][0] == pytest.approx(0.0, abs=1e-12)
    assert numbers[1][0] == pytest.approx(float(push @ observed / (push @ push)))
    assert zero == 0.0
    assert solved(work, [], datum=False) == ([], 0.0)


def test_what_a_model_states_stays_and_the_rest_is_fitted_to_what_is_left():
    data = measured(TILTED, sigma=1e-7)
    stated = Term(effect=SCALE, shape=Shape(), amplitudes=(4e-5,))
    partly = replace(model("backlash"), terms=(stated, Term(effect=BACKLASH)))
    fitted = fit_model(data, partly)
    assert fitted.terms[0] is stated
    rest = data.observed - 4e-5 * data.conditions.position
    way = data.conditions.direction / 2
    assert fitted.terms[1].amplitudes[0] == pytest.approx(float(way @ rest / (way @ way)), rel=1e-4)
    again = fit_model(data, partly, all_open=True)
    assert again.terms[0].amplitudes[0] == pytest.approx(5e-5, rel=1e-4)
    assert again.datum == pytest.approx(0.010, rel=1e-3)
    whole = replace(partly, terms=(stated,))
    assert fit_model(data, whole) is whole
    assert opened_model(data, whole) is None


def test_shapes_that_are_open_are_found():
    wave = lambda x, way, t, run: 0.01 * np.sin(2 * np.pi * x / 47.0) + 0.02 * way
    fitted = fit_model(measured(wave), model("cyclic", "backlash"))
    assert fitted.terms[0].shape.period == pytest.approx(47.0, rel=0.01)
    assert np.hypot(*fitted.terms[0].amplitudes[:2]) == pytest.approx(0.01, abs=5 * SIGMA * np.sqrt(2 / 210))
    work = Workspace(measured(wave), noise())
    kept = shapes_found(work, [Term(effect=CYCLIC, shape=CYCLIC.shape_type(10.0))])
    assert kept == [(CYCLIC, CYCLIC.shape_type(10.0))]


def test_a_shape_is_looked_for_again_once_the_others_are_known():
    # what grows with the travel hides the weak wave until it is known, which it is not while the wave is looked for
    bent = lambda x, way, t, run: 0.006 * np.sin(2 * np.pi * x / 47.0) + 0.08 * (x / 300.0) ** 3
    for order in (("cyclic", "pitch_map"), ("pitch_map", "cyclic")):
        fitted = fit_model(measured(bent, targets=41), model(*order))
        period = next(term.shape.period for term in fitted.terms if term.effect is CYCLIC)
        assert period == pytest.approx(47.0, rel=0.02)


def test_the_datum_is_fitted_beside_any_effect_but_a_constant():
    work = Workspace(measured(TILTED), noise())
    assert needs_datum(work, BOTH)
    assert not needs_datum(work, [])
    assert not needs_datum(work, [*BOTH, (OFFSET, Shape())])
    fitted = fit_model(measured(TILTED), model("scale", "offset"))
    assert fitted.datum == 0.0
    assert fitted.terms[1].amplitudes[0] == pytest.approx(0.010, abs=0.002)


def test_the_residual_is_what_the_prediction_leaves():
    data = measured(TILTED)
    fitted = fit_model(data, model("scale", "backlash"))
    assert residual_of(data, fitted) == pytest.approx(data.observed - fitted.predict(data.conditions))
    assert residual_of(data, replace(fitted, terms=())) == pytest.approx(data.observed - fitted.datum)


def test_noise_after_a_model_is_what_the_model_leaves():
    data = measured(TILTED, runs=1, targets=50)
    work = Workspace(data, noise(sigma=1.0, from_repeats=False))
    after = noise_after(work, BOTH, datum=True)
    table = columns_of(data, BOTH).T
    left = data.observed - table @ np.linalg.lstsq(table, data.observed)[0]
    assert after.sigma == pytest.approx(np.sqrt(left @ left / (100 - 3)))
    repeated = measured(TILTED)
    assert noise_after(Workspace(repeated, noise()), BOTH, datum=True).from_repeats


def test_values_are_shown_in_the_units_people_use_with_their_errors():
    data = measured(lambda x, way, t, run: 0.008 / 2 * way + 0.01 * np.sin(2 * np.pi * x / 47.0))
    fitted = fit_model(data, model("backlash", "cyclic"))
    backlash = values_of(fitted.terms[0], fitted)
    assert [(v.name, v.unit) for v in backlash] == [("backlash", "um")]
    assert backlash[0].value == pytest.approx(fitted.terms[0].amplitudes[0] * 1e3)
    # two groups of 105 readings
    assert backlash[0].error == pytest.approx(2.0 * np.sqrt(2 / 105), rel=0.2)
    period = next(v for v in values_of(fitted.terms[1], fitted) if v.name == "period")
    assert (period.unit, period.error) == ("mm", dict(fitted.terms[1].shape_errors)["period"])
    assert values_of(Term(effect=SCALE), fitted) == ()


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("thermal_growth", "no temperature column"),
        ("inertia", "effects of deviation data"),
        ("servo_lag", "velocity"),
    ],
)
def test_what_the_data_cannot_show_is_refused(name, why):
    with pytest.raises(ArgumentError, match=why):
        fit_model(measured(), model(name))


def test_an_effect_that_the_data_show_nothing_of_has_no_error():
    """A step at the very end of a log, held out of the fit: no division by a length of zero."""
    step = effect_named("lost_counts")
    data = measured(TILTED, runs=1)
    terms, _ = fitted_terms(Workspace(data, noise()), [(step, step.shape_type(1e6))], datum=True)
    assert (terms[0].amplitudes, terms[0].errors) == ((0.0,), (0.0,))


def test_whitening_takes_the_noise_of_a_log_to_unit_size():
    starts = np.arange(80) == 0
    y = coloured(np.random.default_rng(0), covariance(0.9, 0.0, starts))
    data = replace(measured(runs=1, targets=40), observed=y)
    strict = Workspace(data, noise(0.9, from_repeats=False)).strict
    assert strict.observed == pytest.approx(whitened(y[None, :], covariance(0.9, 0.0, starts))[0])
