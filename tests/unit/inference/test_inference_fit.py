"""Fits and their errors: against dense generalised least squares, and against Monte Carlo."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, covariance, measured, one_chain

from rtec.effects import CyclicShape, MapShape, Observable, Shape, effect_named
from rtec.errors import ArgumentError
from rtec.inference.colour import Colour
from rtec.inference.fit import fit_model, fitted_terms, opened_model, shapes_found, values_of
from rtec.inference.model import Model, Term
from rtec.inference.scored import Judge
from rtec.inference.search import Search
from rtec.inference.space import Space

SCALE, BACKLASH, CYCLIC, DRIFT = (effect_named(n) for n in ("scale", "backlash", "cyclic", "drift"))
TILTED = lambda x, way, t, run: 0.010 + 5e-5 * x + 0.004 * way
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]


def model(*names, data=None, **shapes):
    terms = tuple(Term(effect=effect_named(n), shape=shapes.get(n)) for n in names)
    return Model(observe="deviation", units=(data or measured()).units, terms=terms)


def scored(judge, choices, colour):
    """A model under a given noise."""
    return replace(judge.score(choices), colour=colour, colours=((colour, 0.0),))


@pytest.mark.parametrize("colour", [Colour(), Colour(0.9, 0.3), Colour(0.99, 0.01)])
def test_amplitudes_and_errors_are_those_of_dense_generalised_least_squares(colour):
    data = measured(TILTED, runs=3, targets=9)
    judge = Judge(Space(data))
    terms, datum = fitted_terms(judge, scored(judge, BOTH, colour))
    inverse = np.linalg.inv(covariance(colour.rho, colour.white, one_chain(data.rows)))
    table = np.array([data.conditions.position, data.conditions.direction / 2, np.ones(data.rows)]).T
    information = table.T @ inverse @ table
    expected = np.linalg.solve(information, table.T @ inverse @ data.observed)
    left = data.observed - table @ expected
    errors = np.sqrt(left @ inverse @ left / (data.rows - 3) * np.diag(np.linalg.inv(information)))
    assert [term.amplitudes[0] for term in terms] == pytest.approx(expected[:2])
    assert datum == pytest.approx(expected[2])
    assert [term.errors[0] for term in terms] == pytest.approx(errors[:2])


@pytest.mark.parametrize("colour", [Colour(0.9, 0.3), Colour(0.99, 0.6)])
def test_of_a_log_amplitudes_are_those_of_least_squares_and_errors_those_of_the_sandwich(colour):
    """(A'A)^-1 A'SA (A'A)^-1: the noise is weighed in the errors, not in the fit."""
    data = measured(TILTED, runs=2, targets=9)
    moving = replace(data.conditions, moving=True, velocity=data.conditions.direction)
    data = replace(data, conditions=moving)
    judge = Judge(Space(data))
    terms, datum = fitted_terms(judge, scored(judge, BOTH, colour))
    gap = one_chain(data.rows)
    gap[18] = np.inf
    matrix = covariance(colour.rho, colour.white, gap)
    table = np.array([data.conditions.position, data.conditions.direction / 2, np.ones(data.rows)]).T
    expected = np.linalg.lstsq(table, data.observed)[0]
    left = data.observed - table @ expected
    variance = left @ np.linalg.inv(matrix) @ left / (data.rows - 3)
    bread = np.linalg.inv(table.T @ table)
    errors = np.sqrt(variance * np.diag(bread @ table.T @ matrix @ table @ bread))
    assert [*(term.amplitudes[0] for term in terms), datum] == pytest.approx(expected)
    assert [term.errors[0] for term in terms] == pytest.approx(errors[:2])


def covered(error, choices, truth, *, rho, white, count, **plan):
    """Share of draws whose amplitudes lie within two standard errors of the truth, for each of them."""
    hits, errors = [], []
    for seed in range(count):
        data = measured(error, seed=seed, at=np.linspace(0.0, 300.0, 21), rho=rho, white=white, **plan)
        judge = Judge(Space(data))
        fitted = Search(judge).exchanges.reshaped(judge.score(choices))  # shapes have to be found, too
        terms, _ = fitted_terms(judge, fitted)
        found = np.array([v for term in terms for v in term.amplitudes])
        error_of = np.array([e for term in terms for e in term.errors])
        hits.append(np.abs(found - truth) <= 2.0 * error_of)
        errors.append(found - truth)
    return np.mean(hits, axis=0), np.mean(errors, axis=0) / np.std(errors, axis=0)


CASES = {
    "tilted": (TILTED, BOTH, (5e-5, 0.008)),
    "in time": (
        lambda x, way, t, run: 4e-6 * t + 0.004 * way,
        [(DRIFT, Shape()), (BACKLASH, Shape())],
        (4e-6, 0.008),
    ),
    "wave": (
        lambda x, way, t, run: 0.004 * np.sin(2 * np.pi * x / 47.0) + 0.002 * np.cos(2 * np.pi * x / 47.0),
        [(CYCLIC, CYCLIC.shape_type(47.0))],
        (0.004, 0.002),
    ),
}


NOISES = ((0.0, 0.0), (0.9, 0.3))


@pytest.mark.one_in(5)
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(("rho", "white"), NOISES, ids=["white", "correlated"])
def test_two_standard_errors_cover_the_truth(case, rho, white):
    error, choices, truth = CASES[case]
    share, bias = covered(error, choices, truth, rho=rho, white=white, count=20)
    # 95.4 % of 20 draws, 4.7 % either way
    assert share.min() > 0.82
    assert np.abs(bias).max() < 4.0 / np.sqrt(20)


@pytest.mark.sweep
def test_two_standard_errors_cover_the_truth_in_93_to_97_of_100():
    """1000 draws of each case in white and in correlated noise."""
    found = [covered(*case, rho=rho, white=white, count=1000) for case in CASES.values() for rho, white in NOISES]
    shares = np.concatenate([share for share, _ in found])
    assert 0.93 <= np.mean(shares) <= 0.97
    assert shares.min() > 0.9  # 0.917 of a scale in correlated noise
    assert shares.max() < 0.995  # 0.989 of a drift in white noise, which may as well be correlated
    assert max(np.abs(bias).max() for _, bias in found) < 4.0 / np.sqrt(1000)


def test_errors_hold_what_is_not_known_of_the_noise():
    """The law of total variance over two colours, each as likely."""
    data = measured(lambda x, way, t, run: 4e-6 * t, runs=3, targets=9)
    judge = Judge(Space(data))
    drift = [(DRIFT, Shape())]
    colours = (Colour(), Colour(0.95, 0.1))
    one, other = (fitted_terms(judge, scored(judge, drift, colour))[0][0] for colour in colours)
    mixed = replace(scored(judge, drift, colours[0]), colours=tuple((colour, -3.0) for colour in colours))
    both = fitted_terms(judge, mixed)[0][0]
    assert both.amplitudes == one.amplitudes
    moved = other.amplitudes[0] - one.amplitudes[0]
    expected = 0.5 * one.errors[0] ** 2 + 0.5 * (other.errors[0] ** 2 + moved**2)
    assert both.errors[0] == pytest.approx(np.sqrt(expected))
    assert both.errors[0] > 1.2 * one.errors[0]


def test_errors_hold_what_coarse_rounding_hides():
    """A current of two levels is off by as much as its step, in the same way at each of its readings."""
    rng, friction = np.random.default_rng(5), effect_named("coulomb")
    data, covered = measured(runs=1, targets=100), []
    way = np.where(np.arange(200) % 40 < 20, 1.0, -1.0)
    conditions = replace(data.conditions, direction=way, velocity=way, moving=True)
    data = replace(data, observable=Observable.DRIVE, conditions=conditions, rounding=2.0)
    for true in rng.uniform(3.0, 9.0, 60):
        force = np.round((true * way + rng.normal(0.0, 0.4, 200)) / 2.0) * 2.0
        judge = Judge(Space(replace(data, observed=force)))
        terms, _ = fitted_terms(judge, scored(judge, [(friction, friction.shape_type())], Colour()))
        covered.append(abs(terms[0].amplitudes[0] - true) < 2.0 * terms[0].errors[0])
    assert 0.9 <= np.mean(covered)


def test_amplitudes_that_cannot_be_negative_stay_at_zero():
    friction, inertia = effect_named("viscous"), effect_named("inertia")
    rng = np.random.default_rng(0)
    speed, push = rng.normal(size=200), rng.normal(size=200)
    data = measured(runs=1, targets=100)
    conditions = replace(data.conditions, velocity=speed, acceleration=push, moving=True)
    observed = -2.0 * speed + 3.0 * push
    data = replace(data, observable=Observable.DRIVE, conditions=conditions, observed=observed)
    judge = Judge(Space(data))
    terms, datum = fitted_terms(judge, judge.score([(friction, friction.shape_type()), (inertia, Shape())]))
    # with the friction at its bound, the rest is the fit of the inertia alone
    assert terms[0].amplitudes[0] == pytest.approx(0.0, abs=1e-12)
    assert terms[1].amplitudes[0] == pytest.approx(float(push @ observed / (push @ push)), rel=1e-6)
    assert datum == 0.0


def test_what_a_model_states_stays_and_the_rest_is_fitted_to_what_is_left():
    data = measured(TILTED, sigma=1e-7)
    stated = Term(effect=SCALE, shape=Shape(), amplitudes=(4e-5,))
    partly = replace(model("backlash"), terms=(stated, Term(effect=BACKLASH)))
    fitted = fit_model(data, partly)
    assert fitted.terms[0] is stated
    again = fit_model(data, partly, all_open=True)
    assert again.terms[0].amplitudes[0] == pytest.approx(5e-5, rel=1e-4)
    assert again.terms[1].amplitudes[0] == pytest.approx(0.008, rel=1e-4)
    assert again.datum == pytest.approx(0.010, rel=1e-3)
    whole = replace(partly, terms=(stated,))
    assert fit_model(data, whole) is whole
    assert opened_model(data, whole) is None


def test_shapes_that_are_open_are_found_and_stated_ones_kept():
    wave = lambda x, way, t, run: 0.01 * np.sin(2 * np.pi * x / 47.0) + 0.02 * way
    fitted = fit_model(measured(wave), model("cyclic", "backlash"))
    assert fitted.terms[0].shape.period == pytest.approx(47.0, rel=0.01)
    assert np.hypot(*fitted.terms[0].amplitudes[:2]) == pytest.approx(0.01, abs=5 * SIGMA * np.sqrt(2 / 210))
    kept = shapes_found(Judge(Space(measured(wave))), [Term(effect=CYCLIC, shape=CYCLIC.shape_type(10.0))])
    assert kept.choices == ((CYCLIC, CYCLIC.shape_type(10.0)),)


def test_a_shape_is_looked_for_again_once_the_others_are_known():
    # what grows with the travel hides the weak wave until it is known, which it is not while the wave is looked for
    bent = lambda x, way, t, run: 0.006 * np.sin(2 * np.pi * x / 47.0) + 0.08 * (x / 300.0) ** 3
    for order in (("cyclic", "pitch_map"), ("pitch_map", "cyclic")):
        fitted = fit_model(measured(bent, targets=41), model(*order))
        period = next(term.shape.period for term in fitted.terms if term.effect is CYCLIC)
        assert period == pytest.approx(47.0, rel=0.02)


def test_values_are_shown_in_the_units_people_use_with_their_errors():
    data = measured(lambda x, way, t, run: 0.008 / 2 * way + 0.01 * np.sin(2 * np.pi * x / 47.0))
    fitted = fit_model(data, model("backlash", "cyclic"))
    backlash = values_of(fitted.terms[0], fitted)
    assert [(v.name, v.unit) for v in backlash] == [("backlash", "um")]
    assert backlash[0].value == pytest.approx(fitted.terms[0].amplitudes[0] * 1e3)
    # two groups of 105 readings
    assert backlash[0].error == pytest.approx(2.0 * np.sqrt(2 / 105), rel=0.3)
    period = next(v for v in values_of(fitted.terms[1], fitted) if v.name == "period")
    assert (period.unit, period.error) == ("mm", dict(fitted.terms[1].shape_errors)["period"])
    assert values_of(Term(effect=SCALE), fitted) == ()


def test_a_map_holds_the_datum_and_says_its_mean_and_range():
    """A constant of 40 um is no part of any other number: without it the map would show as 5 um about nothing."""
    data = measured(lambda x, way, t, run: 0.04 + 0.005 * np.sin(np.pi * x / x.max()))
    fitted = fit_model(data, model("pitch_map"))
    read = {value.name: value for value in values_of(fitted.terms[0], fitted)}
    assert fitted.datum == 0.0
    assert read["mean"].value == pytest.approx(40.0 + 5.0 * 2.0 / np.pi, abs=0.3)
    assert read["least"].value == pytest.approx(40.0, abs=1.0)
    assert read["largest"].value == pytest.approx(45.0, abs=1.0)
    assert read["peak_to_peak"].value == pytest.approx(read["largest"].value - read["least"].value)
    assert 0.0 < read["mean"].error < read["largest"].error


def test_errors_of_an_amplitude_and_its_phase_against_monte_carlo():
    """Sine and cosine of a wave of free period go against each other: as independent ones they give 1.5 and 0.7."""
    wave = lambda x, way, t, run: 0.004 * np.sin(2 * np.pi * x / 47.0 + np.pi / 4)
    seen = []
    for seed in range(40):
        fitted = fit_model(measured(wave, at=np.linspace(0, 300, 21), seed=seed, timed=False), model("cyclic"))
        seen.append({value.name: value for value in values_of(fitted.terms[0], fitted)})
    for name in ("period", "amplitude_1", "phase_1"):
        found = [one[name] for one in seen if name in one]
        assert len(found) > 35
        scatter = np.std([value.value for value in found])
        assert np.mean([value.error for value in found]) == pytest.approx(scatter, rel=0.25), name


def test_a_map_that_holds_the_datum_has_the_covariance_of_both():
    """By dense least squares: the constant is part of the map, however the fit has split it."""
    data = measured(lambda x, way, t, run: 0.04 + 0.005 * np.sin(np.pi * x / x.max()), runs=3)
    judge, effect, shape = Judge(Space(data)), effect_named("pitch_map"), MapShape((0.0, 100.0, 200.0, 300.0))
    terms, _ = fitted_terms(judge, scored(judge, [(effect, shape)], Colour()))
    table = effect.columns(data.conditions, shape)
    left = data.observed - table @ np.linalg.lstsq(table, data.observed, rcond=None)[0]
    variance = left @ left / (data.rows - 5)  # four nodes and the datum
    assert np.array(terms[0].covariance) == pytest.approx(variance * np.linalg.inv(table.T @ table), rel=1e-6)
    assert terms[0].errors == pytest.approx(np.sqrt(np.diag(terms[0].covariance)))


@pytest.mark.parametrize("phase", [0.3, np.pi - 1e-4])  # the second one passes from 180 to -180 deg within its error
def test_a_phase_at_half_a_turn_has_the_error_of_any_other(phase):
    amplitudes = (5.0 * np.cos(phase), 5.0 * np.sin(phase))
    wave = Term(effect=CYCLIC, shape=CyclicShape(47.0, 1, False), amplitudes=amplitudes, errors=(0.1, 0.1))
    found = {value.name: value.error for value in values_of(wave, model())}
    assert found["phase_1"] == pytest.approx(np.degrees(0.1 / 5.0), rel=1e-3)


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
    """A step after the very end of a log: no division by a length of zero."""
    step = effect_named("lost_counts")
    judge = Judge(Space(measured(TILTED, runs=1)))
    terms, _ = fitted_terms(judge, judge.score([(step, step.shape_type(1e6))]))
    assert (terms[0].amplitudes, terms[0].errors) == ((0.0,), (0.0,))


def test_a_term_that_is_not_fitted_is_named():
    with pytest.raises(ValueError, match="backlash is not fitted"):
        Term(effect=BACKLASH, shape=Shape()).component(measured())
