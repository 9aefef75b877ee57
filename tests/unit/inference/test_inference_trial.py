"""One effect tested for removal: probability, held-out gain, size."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, left_out_residual, measured

from rtec.effects import Shape, effect_named
from rtec.inference.calibration import adjusted
from rtec.inference.heldout import HeldOutGain, folds
from rtec.inference.model import Model
from rtec.inference.noise import Noise, noise_from_repeats
from rtec.inference.trial import Search, Trial, first_noise, refitted, rms_held_out, rms_of, trial_of
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Workspace

SCALE, BACKLASH, OFFSET, DRIFT, CYCLIC, STEP = (
    effect_named(n) for n in ("scale", "backlash", "offset", "drift", "cyclic", "lost_counts")
)
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]


def state_of(data, noise=None, heldout=None, tests=50.0):
    noise = noise or noise_from_repeats(data)
    start = Model(observe="deviation", units=data.units)
    work = Workspace(data, noise)
    return Search(
        dataset=data, heldout=heldout, start=start, workspace=work, rng=np.random.default_rng(0), tests=tests
    )


@pytest.mark.parametrize(
    ("p", "gain", "small", "passes", "word"),
    [
        (0.009, 3.0, False, True, "held-out error falls"),
        (0.010, 3.0, False, False, "not below 0.01"),
        (0.009, 1.9, False, False, "two standard errors"),
        (0.009, 3.0, True, False, "too small to matter"),
    ],
)
def test_an_effect_passes_all_three_tests_or_goes(p, gain, small, passes, word):
    trial = Trial(candidacy=None, p_adjusted=p, held_out=HeldOutGain(gain=gain, error=1.0), small=small)
    assert trial.passes is passes
    assert word in trial.reason


def test_a_real_effect_passes_with_the_numbers_of_full_fits():
    data = measured(TILTED)
    trial = trial_of(state_of(data), BOTH, 1)
    assert trial.passes
    table = np.array([np.ones(210), data.conditions.position, data.conditions.direction / 2]).T
    left = [left_out_residual(part, data.observed, folds(data)) for part in (table[:, :2], table)]
    assert trial.held_out.gain == pytest.approx(np.mean(left[0] ** 2 - left[1] ** 2))
    sigma = noise_from_repeats(data).sigma
    difference = np.linalg.norm(left[0] - left[1])
    assert trial.held_out.error == pytest.approx(2 * sigma * difference / 210)


def test_an_effect_that_is_not_there_goes():
    data = measured(lambda x, way, t, run: 0.004 * way)
    trial = trial_of(state_of(data), BOTH, 0)
    assert not trial.passes
    work = Workspace(data, noise_from_repeats(data))
    p = work.p_value(work.judge(SCALE, Shape(), work.background([(BACKLASH, Shape())])))
    assert trial.p_adjusted == pytest.approx(adjusted(p, 50.0))


def test_an_effect_much_smaller_than_the_noise_does_not_matter():
    data = measured(lambda x, way, t, run: 0.08 * SIGMA * way, runs=60, targets=40, timed=False)
    trial = trial_of(state_of(data), [(BACKLASH, Shape())], 0)
    assert trial.p_adjusted < 0.01
    assert trial.small
    assert not trial.passes


def test_an_effect_much_smaller_than_what_nothing_explains_does_not_matter():
    unexplained = lambda x, way, t, run: 0.03 * np.sign(np.sin(x**1.7 / 90.0)) + 0.0015 * way
    data = measured(unexplained)
    trial = trial_of(state_of(data), [(BACKLASH, Shape())], 0)
    assert trial.p_adjusted < 1e-6  # beside the noise it is plain
    assert trial.small
    assert not trial_of(state_of(measured(lambda x, way, t, run: 0.0015 * way)), [(BACKLASH, Shape())], 0).small


def test_lost_counts_go_where_a_differing_reversal_error_explains_more():
    play = np.array([0.0, 0.004, 0.016, 0.002, 0.011, 0.007])
    data = measured(lambda x, way, t, run: play[run.astype(int)] * way / 2)
    step = (STEP, STEP.shape_type(845.0))
    trial = trial_of(state_of(data), [(BACKLASH, Shape()), step], 1)
    assert trial.outdone
    assert not trial.passes
    passed = replace(trial, p_adjusted=0.0, held_out=HeldOutGain(gain=1.0, error=0.1), small=False)
    assert not passed.passes
    assert "differs from run to run" in passed.reason
    lost = measured(lambda x, way, t, run: np.where(t > 845.0, 0.01, 0.0))
    assert not trial_of(state_of(lost), [step], 0).outdone


def test_a_probability_is_the_mean_over_what_the_noise_may_be():
    data = measured(lambda x, way, t, run: 0.0015 * way, rho=0.9, runs=3)
    noise = noise_from_repeats(data)
    assert len(noise.likely) > 1
    found = trial_of(state_of(data, tests=1.0), [(BACKLASH, Shape())], 0).p_adjusted
    each = [
        share * trial_of(state_of(data, replace(own, likely=()), tests=1.0), [(BACKLASH, Shape())], 0).p_adjusted
        for share, own in noise.likely
    ]
    assert found == pytest.approx(sum(each))


def test_without_repeats_half_a_percent_of_the_rms_matters():
    rng = np.random.default_rng(0)
    for size, small in ((0.05, True), (0.3, False)):
        data = measured(runs=1, targets=3000, timed=False)
        data = replace(data, observed=rng.normal(0, 1, 6000) + size * data.conditions.direction)
        noise = Noise(sigma=1.0, correlation=Correlation(), freedom=6000.0, from_repeats=False)
        assert trial_of(state_of(data, noise), [(BACKLASH, Shape())], 0).small is small


def test_an_offset_is_judged_against_nothing_in_its_place():
    data = measured(lambda x, way, t, run: 0.02 + 0.004 * way)
    trial = trial_of(state_of(data), [(OFFSET, Shape()), (BACKLASH, Shape())], 0)
    assert trial.passes
    # 20 um of constant against none
    assert trial.held_out.gain == pytest.approx(0.02**2, rel=0.1)
    centred = measured(lambda x, way, t, run: 0.004 * way)
    assert not trial_of(state_of(centred), [(OFFSET, Shape()), (BACKLASH, Shape())], 0).passes


def test_the_other_measurement_judges_where_there_is_one():
    data, other = measured(TILTED), measured(lambda x, way, t, run: 5e-5 * x, seed=7)
    found = trial_of(state_of(data, heldout=other), BOTH, 1)
    assert found.p_adjusted < 0.01
    assert found.held_out.gain < 0  # there is no reversal error there
    assert not found.passes
    assert trial_of(state_of(data, heldout=other), BOTH, 0).passes


def test_what_happened_once_is_judged_by_this_measurement():
    data = measured(lambda x, way, t, run: np.where(t > 1005.0, 0.02, 0.0))
    other = measured(seed=7)
    step = [(STEP, STEP.shape_type(1005.0))]
    assert trial_of(state_of(data, heldout=other), step, 0).passes


def test_a_step_in_correlated_noise_has_to_beat_what_noise_feigns():
    """Beside noise that wanders a step is likely by chance; the test of a single candidate does not know."""
    data = measured(rho=0.97, seed=11)
    noise = noise_from_repeats(data)
    assert not noise.correlation.is_white
    state = state_of(data, noise, tests=1.0)
    work = state.workspace
    best = work.best_of_scan(STEP, work.background(()))
    assert trial_of(state, [(STEP, best.shape)], 0).p_adjusted > max(0.01, work.p_value(best))


def test_a_second_family_of_periods_was_chosen_from_more():
    wave = lambda x, way, t, run: 0.004 * np.sin(x / 9.0) + 0.0012 * np.sin(x / 5.7)
    data = measured(wave, targets=40, timed=False)
    state = state_of(data, tests=1.0)
    first, second = (CYCLIC, CYCLIC.shape_type(18 * np.pi)), (CYCLIC, CYCLIC.shape_type(11.4 * np.pi))
    alone, both = trial_of(state, [first], 0), trial_of(state, [first, second], 1)
    grid = len(CYCLIC.shapes(data.conditions))
    strict = state.workspace.strict
    p = strict.p_value(strict.judge(*second, strict.background([first])))
    assert both.p_adjusted == pytest.approx(adjusted(p, grid))
    assert alone.p_adjusted == pytest.approx(strict.p_value(strict.judge(*first, strict.background([]))))


def test_the_first_noise_is_that_of_repeats_or_of_what_the_given_effects_leave():
    data = measured(TILTED)
    assert first_noise(data, []) == noise_from_repeats(data)
    once = measured(TILTED, runs=1)
    table = np.array([np.ones(42), once.conditions.position, once.conditions.direction]).T
    left = once.observed - table @ np.linalg.lstsq(table, once.observed)[0]
    found = first_noise(once, BOTH)
    assert not found.from_repeats
    assert found.sigma == pytest.approx(np.sqrt(left @ left / 39), rel=1e-6)
    assert first_noise(once, []).sigma > 2 * found.sigma


def test_a_refit_takes_the_stated_period_where_it_does_as_well():
    wave = lambda x, way, t, run: 0.004 * np.sin(2 * np.pi * x / 20.0)
    data = measured(wave, targets=60, screw_pitch=20.0, timed=False)
    work = Workspace(data, noise_from_repeats(data))
    found = refitted(work, [(CYCLIC, CYCLIC.shape_type(20.02))])
    assert found[0][1].period == pytest.approx(20.0, rel=2e-3)


def test_the_held_out_rms_is_that_of_the_other_file_where_there_is_one():
    data, other = measured(TILTED), measured(TILTED, seed=7)
    state = state_of(data, heldout=other)
    fitted = state.model(BOTH)
    left = other.observed - fitted.predict(other.conditions)
    assert rms_held_out(state, BOTH, fitted) == pytest.approx(np.sqrt(np.mean(left**2)))
    alone = state_of(data)
    table = np.array([np.ones(210), data.conditions.position, data.conditions.direction]).T
    expected = rms_of(left_out_residual(table, data.observed, folds(data)))
    assert rms_held_out(alone, BOTH, fitted) == pytest.approx(expected)


def test_the_root_mean_square():
    assert rms_of(np.array([3.0, 4.0, 0.0, 0.0])) == 2.5


def test_the_model_of_a_search_has_its_datum():
    data = measured(lambda x, way, t, run: 0.03 + 0.004 * way)
    fitted = state_of(data).model([(BACKLASH, Shape())])
    assert fitted.datum == pytest.approx(0.03, abs=5 * SIGMA / np.sqrt(210))
    assert state_of(data).model([(OFFSET, Shape())]).datum == 0.0
    assert state_of(data).model([]).datum == 0.0
    assert DRIFT.name not in fitted.names
