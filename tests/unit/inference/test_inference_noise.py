"""The noise floor from repeats, and whether what a model leaves repeats: against textbook formulas."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured, pure_error_test
from scipy import stats

from rtec.effects import Observable, Shape, effect_named
from rtec.inference.colour import Colour
from rtec.inference.noise import lack_of_fit, noise_floor, within_cells
from rtec.inference.scored import Judge
from rtec.inference.space import Space

SCALE, BACKLASH, DRIFT = (effect_named(n) for n in ("scale", "backlash", "drift"))
BOTH = [(SCALE, Shape()), (BACKLASH, Shape())]
TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def floor_of(data, choices=()):
    judge = Judge(Space(data))
    return noise_floor(judge, judge.score(choices))


def fit_test(data, choices=()):
    judge = Judge(Space(data))
    return lack_of_fit(judge, judge.score(choices))


def test_noise_within_cells_is_that_of_pooled_variances():
    data = measured(TILTED, runs=4, targets=6).take(np.arange(43))  # the last cells have three
    pooled, dof = 0.0, 0
    for k in range(12):
        own = data.observed[data.cell == k]
        pooled, dof = pooled + np.var(own, ddof=1) * (own.size - 1), dof + own.size - 1
    sigma, count = within_cells(data.observed, data.cell)
    assert sigma == pytest.approx(np.sqrt(pooled / dof))
    assert count == dof


@pytest.mark.parametrize(("rho", "white"), [(0.0, 0.0), (0.9, 0.3)])
def test_the_floor_does_not_see_what_repeats_and_is_unbiased(rho, white):
    errors = lambda x, way, t, run: 0.02 * way + 0.05 * np.sin(x)
    found = [floor_of(measured(errors, seed=seed, rho=rho, white=white, runs=6)) for seed in range(20)]
    # of a correlated noise each of the 210 differences counts less: some 60 are independent
    error = np.sqrt(2 / (60 if rho else 210) / 20)
    assert np.mean([f.sigma**2 for f in found]) / SIGMA**2 == pytest.approx(1.0, abs=4 * error)
    assert all(f.from_repeats and f.floor == f.sigma for f in found)


IN_TIME = {
    "drift": lambda x, way, t, run: 4e-6 * t + 0.004 * way,
    "warm-up": lambda x, way, t, run: -0.02 * np.exp(-t / 1200.0),
    "growth": lambda x, way, t, run: -1e-4 * x * np.exp(-t / 1200.0),
    "lost counts": lambda x, way, t, run: 0.01 * (t > 2000.0),
    "a run of its own": lambda x, way, t, run: 0.02 * (run == 3),
}


@pytest.mark.parametrize("what", IN_TIME)
def test_a_file_has_one_floor_whatever_changes_in_time_and_whatever_the_model(what):
    for seed in range(3):
        data = measured(IN_TIME[what], runs=6, seed=seed)
        alone, beside = floor_of(data), floor_of(data, [(DRIFT, Shape()), (BACKLASH, Shape())])
        assert within_cells(data.observed, data.cell)[0] > 1.3 * alone.sigma
        assert alone.sigma == pytest.approx(SIGMA, rel=0.15)
        assert (beside.sigma, beside.degrees_of_freedom) == (alone.sigma, alone.degrees_of_freedom)


def test_an_outlier_does_not_raise_the_floor():
    data = measured(IN_TIME["warm-up"], runs=6)
    data.observed[70] += 0.2
    assert floor_of(data).sigma == pytest.approx(SIGMA, rel=0.15)


def test_adjacent_repeats_hardly_see_what_changes_slowly():
    data = measured(lambda x, way, t, run: 0.001 * run, runs=8, targets=6)
    steps = np.concatenate([np.diff(data.observed[data.cell == k]) for k in range(12)])
    floor = floor_of(data)
    assert floor.sigma_adjacent == pytest.approx(np.sqrt(0.5 * np.mean(steps**2)))
    assert floor.sigma_adjacent < 0.9 * within_cells(data.observed, data.cell)[0]


def test_without_repeats_there_is_no_floor():
    data = measured(runs=1)
    floor = floor_of(data)
    assert (floor.from_repeats, floor.floor, floor.sigma_adjacent) == (False, None, None)
    assert floor.sigma == pytest.approx(data.observed.std(), rel=0.05)
    assert floor.degrees_of_freedom == 41.0
    with_scale = floor_of(data, [(SCALE, Shape())])
    assert with_scale.degrees_of_freedom == 40.0


def test_correlated_noise_is_called_so():
    white = [floor_of(measured(seed=seed)) for seed in range(10)]
    slow = [floor_of(measured(seed=seed, rho=0.95, white=0.1)) for seed in range(10)]
    assert np.median([f.correlation * (1 - f.white_share) for f in white]) < 0.15
    assert np.median([f.correlation * (1 - f.white_share) for f in slow]) > 0.7


@pytest.mark.parametrize("bent", [0.0, 0.002])
def test_lack_of_fit_of_white_noise_is_that_of_draper_and_smith(bent):
    data = measured(lambda x, way, t, run: TILTED(x, way, t, run) + bent * np.sin(x / 9.0), runs=4, seed=3)
    judge = Judge(Space(data))
    model = judge.score(BOTH)
    columns = np.vstack([np.ones(data.rows), data.conditions.position, data.conditions.direction])
    lack, above, pure, below = pure_error_test(columns, data.observed, data.cell)
    expected = stats.f.sf(lack / above / (pure / below), above, below)
    p, beyond, _ = lack_of_fit(judge, model)
    # the amplitudes are held a little towards zero, and the noise may be taken as slightly correlated
    assert p == pytest.approx(expected, abs=0.05)
    assert (p < 1e-4) is (bent > 0.0)
    if bent:
        assert beyond == pytest.approx(bent / np.sqrt(2.0), rel=0.2)


def test_lack_of_fit_seldom_rejects_the_true_model():
    for rho in (0.0, 0.9):
        p = [fit_test(measured(TILTED, seed=seed, rho=rho, white=0.3), BOTH)[0] for seed in range(40)]
        # one in a hundred at 0.01: three of forty would be 1 in 130
        assert sum(value < 0.01 for value in p) <= 2
        if not rho:
            assert np.mean(p) == pytest.approx(0.5, abs=4 * 0.29 / np.sqrt(40))


def test_lack_of_fit_needs_places_that_come_again():
    assert fit_test(measured(runs=1, bidirectional=False)) is None
    assert fit_test(measured(runs=1, targets=4)) is None, "too few of them"


def test_a_place_passed_from_both_sides_is_there_twice():
    """Without repeats the oracle is the variance of half the sums over that of half the differences."""
    bent = lambda x, way, t, run: 0.004 * np.sin(x / 9.0) + 0.003 * way
    data = measured(bent, runs=1)
    judge = Judge(Space(data))
    p, beyond, within = lack_of_fit(judge, replace(judge.score([(BACKLASH, Shape())]), colour=Colour()))
    left = data.observed - np.where(data.conditions.direction > 0, 1, -1) * 0.003
    forth, back = left[:21], left[21:][::-1]
    assert p < 1e-4
    assert within == pytest.approx(np.sqrt(((forth - back) ** 2).sum() / 2.0 / 21.0), rel=0.1)
    assert beyond == pytest.approx(np.std(0.004 * np.sin(data.conditions.position / 9.0)), rel=0.2)
    right = [(effect_named("pitch_map"), s) for s in effect_named("pitch_map").shapes(data.conditions)][-1:]
    assert fit_test(data, [(BACKLASH, Shape()), *right])[0] > p


def test_where_a_constant_is_an_effect_what_repeats_has_no_mean_to_spare():
    data = replace(measured(lambda x, way, t, run: 0.01 + 0.0 * x, runs=4), observable=Observable.DRIVE)
    judge = Judge(Space(data))
    p, beyond, _ = lack_of_fit(judge, replace(judge.score([]), colour=Colour()))  # else it may pass for slow noise
    assert p < 1e-9
    assert beyond == pytest.approx(0.01, rel=0.1)


def test_zeros_of_runs_do_not_hide_what_repeats():
    """Beside slow noise the zeros may be anywhere; a reversal error that no effect explains is as large as it is."""
    data = measured(lambda x, way, t, run: 0.006 * way + 5e-5 * x)
    judge = Judge(Space(data))
    model = judge.score([(SCALE, Shape())])
    for places in (model.places, np.append(model.places[:1], 4)):
        p, beyond, _ = lack_of_fit(judge, replace(model, places=places, colour=Colour(0.997, 0.01)))
        assert p < 1e-9
        assert beyond == pytest.approx(0.006, rel=0.15)
