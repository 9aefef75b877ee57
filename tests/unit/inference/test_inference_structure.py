"""What is left: the classical lack-of-fit test, changes between repeats, and what noise feigns."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, covariance, measured, pure_error_test
from scipy import stats

from rtec.effects import LIBRARY, Observable, Shape, effect_named
from rtec.inference.noise import Noise, noise_from_repeats
from rtec.inference.structure import (
    ChanceInTime,
    changes_left,
    lack_of_fit_of_means,
    noise_drawn,
    reversal_changes_instead,
)
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Workspace

SCALE, BACKLASH, DRIFT, STEP = (effect_named(n) for n in ("scale", "backlash", "drift", "lost_counts"))
TILTED = lambda x, way, t, run: 5e-5 * x


def noise(sigma=SIGMA, freedom=100.0, rho=0.0, white=0.0, *, from_repeats=True):
    correlation = Correlation(rho=rho, white=white)
    return Noise(sigma=sigma, correlation=correlation, freedom=freedom, from_repeats=from_repeats)


@pytest.mark.parametrize("broken", [False, True])
@pytest.mark.parametrize("bent", [0.0, 0.004])
def test_lack_of_fit_is_the_classical_test(broken, bent):
    data = measured(lambda x, way, t, run: 5e-5 * x + bent * np.sin(x / 8.0), runs=4, targets=12)
    if broken:
        data = data.take(np.arange(data.rows - 7))
    columns = np.array([np.ones(data.rows), data.conditions.position])
    lack, its_freedom, pure, freedom = pure_error_test(columns, data.observed, data.cell)
    work = Workspace(data, noise(np.sqrt(pure / freedom), freedom))
    found = lack_of_fit_of_means(work, [(SCALE, Shape())])
    expected = stats.f.sf(lack / its_freedom / (pure / freedom), its_freedom, freedom)
    assert found == pytest.approx(expected)
    assert (found < 1e-4) is bool(bent)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_lack_of_fit_of_noise_is_uniform(rho):
    p = []
    for seed in range(80):
        data = measured(TILTED, targets=12, seed=seed, rho=rho, timed=False)
        work = Workspace(data, noise_from_repeats(data))
        p.append(lack_of_fit_of_means(work, [(SCALE, Shape())]))
    assert stats.kstest(p, "uniform").pvalue > 0.001


def test_nothing_to_compare_nothing_lacking():
    data = measured(TILTED, runs=1)
    assert lack_of_fit_of_means(Workspace(data, noise(from_repeats=False)), []) is None
    few = measured(TILTED, runs=3, targets=2, bidirectional=False)
    assert lack_of_fit_of_means(Workspace(few, noise()), [(SCALE, Shape())]) is None  # two means, two parameters


def test_a_model_without_columns_lacks_everything():
    """A drive has no datum, so that the first model has no columns at all."""
    data = replace(measured(lambda x, way, t, run: 0.01 * way, runs=3), observable=Observable.DRIVE)
    assert lack_of_fit_of_means(Workspace(data, noise_from_repeats(data)), []) < 1e-9
    quiet = replace(measured(runs=3), observable=Observable.DRIVE)
    assert lack_of_fit_of_means(Workspace(quiet, noise_from_repeats(quiet)), []) > 0.001


def changes(data, choices=()):
    return changes_left(data, choices, np.random.default_rng(0))


def test_a_reversal_error_that_changes_from_run_to_run_is_seen():
    sizes = np.array([0.0, 0.004, -0.003, 0.006, 0.001])
    found = changes(measured(lambda x, way, t, run: sizes[run - 1] * way))
    assert found["direction"] < 0.001
    assert found["position"] > 0.01


def test_a_map_that_changes_from_run_to_run_is_seen():
    found = changes(measured(lambda x, way, t, run: 0.004 * (run - 3) * np.cos(x / 60.0)))
    assert found["position"] < 0.001
    assert found["direction"] > 0.01


def test_a_drift_is_seen_unless_the_model_has_it():
    data = measured(lambda x, way, t, run: 1e-5 * t)
    assert changes(data)["time"] < 0.001
    assert changes(data, [(DRIFT, Shape())])["time"] > 0.01


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_noise_seldom_changes(rho):
    found = [changes(measured(rho=rho, seed=seed)) for seed in range(25)]
    # Bonferroni over three kinds: one in a hundred each time; four of 25 is beyond 1e-4
    assert sum(min(p.values()) < 0.01 for p in found) < 4
    assert all(0.0 <= p <= 1.0 for kinds in found for p in kinds.values())


def test_too_few_differences_tell_nothing_and_exact_ones_do_not_change():
    assert changes(measured(runs=2, targets=2)) == {}
    exact = measured(lambda x, way, t, run: 0.005 * way, sigma=0.0)
    nearly = replace(exact, observed=exact.observed + np.random.default_rng(0).normal(0, 1e-18, exact.rows))
    for data in (exact, nearly):
        assert changes(data) == {}
    assert changes_left(measured(runs=1), [], np.random.default_rng(0)) == {}


@pytest.mark.parametrize(("rho", "white"), [(0.0, 0.0), (0.9, 0.0), (0.9, 0.4)])
def test_noise_is_drawn_with_its_covariance(rho, white):
    data = measured(runs=2, targets=4)
    rng = np.random.default_rng(0)
    draws = np.array([noise_drawn(data, Correlation(rho=rho, white=white), rng) for _ in range(6000)])
    expected = covariance(rho, white, np.arange(16) % 8 == 0)
    # 5 standard errors of a covariance of normal numbers
    assert np.abs(draws.T @ draws / 6000 - expected).max() < 5 * np.sqrt(2 / 6000)


def test_chance_takes_a_step_for_noise_where_noise_makes_steps():
    library = [e for e in LIBRARY if e.observable is Observable.DEVIATION and e.in_time]
    step = (STEP, STEP.shape_type(1005.0))

    def p_of(data):
        return ChanceInTime(data, [e for e in library if e.untestable(data.conditions) is None], rng()).p_value(
            (), step
        )

    def rng():
        return np.random.default_rng(0)

    jump = lambda x, way, t, run: np.where(t > 1005.0, 0.02, 0.0)
    assert p_of(measured(jump)) < 1e-4
    assert p_of(measured(rho=0.9)) > 0.01
    assert p_of(measured(rho=0.9, seed=3)) > 0.01


def test_chance_is_judged_beside_the_rest_that_changes_in_time():
    data = measured(lambda x, way, t, run: np.where(t > 1005.0, 0.02, 0.0))
    chance = ChanceInTime(data, [DRIFT, STEP], np.random.default_rng(0))
    step = (STEP, STEP.shape_type(1005.0))
    assert chance.p_value((), step) < 1e-4
    assert chance.p_value([(SCALE, Shape())], step) == chance.p_value((), step)  # a scale error repeats
    assert chance.p_value([step, (SCALE, Shape())], step) > 0.01  # once more it explains nothing
    assert ChanceInTime(measured(runs=1), [DRIFT], np.random.default_rng(0)).p_value((), step) == 0.0


def test_lack_of_fit_is_the_mean_over_what_the_noise_may_be():
    data = measured(lambda x, way, t, run: 0.0006 * np.sin(x / 8.0), rho=0.9, runs=3)
    noise = noise_from_repeats(data)
    assert len(noise.likely) > 1
    each = [
        (share, lack_of_fit_of_means(Workspace(data, replace(own, likely=())), [(SCALE, Shape())]))
        for share, own in noise.likely
    ]
    found = lack_of_fit_of_means(Workspace(data, noise), [(SCALE, Shape())])
    assert found == pytest.approx(sum(share * p for share, p in each))
    assert min(p for _, p in each) < found < max(p for _, p in each)


def test_a_mean_run_is_compared_as_it_is():
    data = measured(lambda x, way, t, run: 0.0008 * np.sin(x / 8.0))
    whole = Workspace(data, noise_from_repeats(data))
    choices = [(SCALE, Shape())]
    assert lack_of_fit_of_means(whole.mean_run, choices) == pytest.approx(lack_of_fit_of_means(whole, choices))


LOST = [(STEP, STEP.shape_type(moment)) for moment in (425.0, 845.0)]


def test_counts_are_not_lost_where_the_reversal_error_differs_from_run_to_run():
    play = np.array([0.0, 0.004, 0.016, 0.002, 0.011, 0.007])
    differing = [measured(lambda x, way, t, run: play[run.astype(int)] * way / 2, seed=seed) for seed in range(5)]
    assert all(reversal_changes_instead(data, LOST) for data in differing)
    lost = lambda x, way, t, run: np.where(t > 425.0, 0.01, 0.0) - np.where(t > 845.0, 0.006, 0.0)
    assert not any(reversal_changes_instead(measured(lost, seed=seed), LOST) for seed in range(5))


def test_without_both_directions_no_reversal_error_differs():
    data = measured(lambda x, way, t, run: np.where(t > 425.0, 0.01, 0.0), bidirectional=False)
    assert not reversal_changes_instead(data, LOST)
    assert not reversal_changes_instead(measured(runs=1), LOST)
