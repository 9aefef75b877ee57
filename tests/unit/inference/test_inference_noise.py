"""Noise from repeats: the restricted likelihood against dense matrices, estimates against simulated noise."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, coloured, covariance, measured, restricted_likelihood

from rtec.effects import Shape, effect_named
from rtec.inference import noise as module
from rtec.inference.noise import (
    GRID,
    Noise,
    NoiseFit,
    adjacent_sigma,
    noise_floor,
    noise_from_repeats,
    noise_from_residual,
    noise_of,
    pooled_sigma,
)
from rtec.inference.repeat_space import repeat_space
from rtec.inference.whitening import Correlation

STARTS = np.arange(40) % 20 == 0


@pytest.mark.parametrize(("rho", "white"), [(0.0, 0.0), (0.5, 0.0), (0.92, 0.25)])
@pytest.mark.parametrize("nuisances", [0, 3])
def test_the_restricted_likelihood_is_that_of_dense_matrices(rho, white, nuisances):
    rng = np.random.default_rng(nuisances)
    nuisance, y = rng.normal(size=(nuisances, 40)) * 7.0, rng.normal(size=40)
    fit = NoiseFit(nuisance, STARTS, 40)
    value, variance, freedom = fit._likelihood(y, Correlation(rho=rho, white=white))
    expected, its_variance = restricted_likelihood(y, nuisance, covariance(rho, white, STARTS))
    assert value == pytest.approx(expected)
    assert variance == pytest.approx(its_variance)
    assert freedom == 40 - nuisances


def test_the_plain_likelihood_and_what_a_column_adds():
    rng = np.random.default_rng(5)
    nuisance, more, data = rng.normal(size=(2, 40)), rng.normal(size=(3, 40)), rng.normal(size=(2, 40))
    alone, added = NoiseFit(nuisance, STARTS, 40).likelihood_ratios(data, more)
    for y, first, second in zip(data, alone, added, strict=True):
        best, best_with = -np.inf, -np.inf
        for c in GRID:
            matrix = covariance(c.rho, c.white, STARTS)
            root, det = np.linalg.cholesky(matrix), np.linalg.slogdet(matrix)[1]
            for columns in (nuisance, *(np.vstack([nuisance, own]) for own in more)):
                a, b = np.linalg.solve(root, columns.T), np.linalg.solve(root, y)
                rss = float(((b - a @ np.linalg.lstsq(a, b, rcond=None)[0]) ** 2).sum())
                value = -0.5 * (40 * np.log(rss / 40) + det)
                if columns is nuisance:
                    best = max(best, value)
                best_with = max(best_with, value)
        assert first == pytest.approx(best)
        assert second == pytest.approx(best_with - best)


@pytest.mark.parametrize(("rho", "white"), [(0.0, 0.0), (0.9, 0.0), (0.95, 0.5)])
def test_noise_of_repeats_is_unbiased(rho, white):
    """Simulated noise with a drift and a reversal error beside it, which are no noise."""
    sigmas, correlations = [], []
    for seed in range(30):
        data = measured(
            lambda x, way, t, run: 0.02 * way + 1e-5 * t, seed=seed, targets=30, rho=rho, white=white, timed=False
        )
        found = noise_from_repeats(data)
        assert found.from_repeats
        sigmas.append(found.sigma**2)
        correlations.append(found.correlation.to_next)
    # independent differences: 240 for white noise; correlated ones count for about (1 - rho) / (1 + rho) of that,
    # but for REML's knowledge of the correlation
    error = np.sqrt(2 / 240 / 30) if not rho else np.sqrt(2 * (1 + rho**2) / (1 - rho**2) / 240 / 30)
    assert np.mean(sigmas) / SIGMA**2 == pytest.approx(1.0, abs=5 * error)
    assert np.mean(correlations) == pytest.approx(rho * (1 - white), abs=0.06)


def test_white_noise_is_seldom_called_correlated():
    called = [not noise_from_repeats(measured(seed=seed, timed=False)).correlation.is_white for seed in range(60)]
    # three log-likelihood units: 1.4 % for one parameter more
    assert np.mean(called) < 0.1


@pytest.mark.parametrize("timed", [False, True])
@pytest.mark.parametrize("runs", [3, 5])
def test_correlated_noise_keeps_its_slow_part(timed, runs):
    """Nothing but noise: slow courses taken out of it as a matter of course would leave 1.7 of 2 um (rho 0.84)."""
    found = [noise_from_repeats(measured(seed=seed, runs=runs, rho=0.9, timed=timed)) for seed in range(40)]
    # variance of a mean over 40: correlated readings count for (1 - rho²) / (1 + rho²) of their differences
    error = np.sqrt(2 * (1 + 0.9**2) / (1 - 0.9**2) / (42 * (runs - 1)) / 40)
    assert np.mean([n.sigma**2 for n in found]) / SIGMA**2 == pytest.approx(1.0, abs=4 * error)
    bias = (1 + 3 * 0.9) / (42 * (runs - 1))  # of a short series' correlation (Kendall 1954)
    assert np.mean([n.correlation.to_next for n in found]) == pytest.approx(0.9, abs=bias)


@pytest.mark.parametrize(
    "error",
    [
        lambda x, way, t, run: 1.5e-5 * t,
        lambda x, way, t, run: 0.02 * (1.0 - np.exp(-t / 300.0)),
        lambda x, way, t, run: np.where(t > 900.0, 0.01, 0.0) + 1.5e-5 * t,
    ],
    ids=["drift", "warm-up", "step and drift"],
)
def test_what_is_slow_and_large_is_no_noise(error):
    found = [noise_from_repeats(measured(error, seed=seed)) for seed in range(6)]
    assert all(n.correlation.to_next < 0.3 for n in found)
    assert np.mean([n.sigma for n in found]) == pytest.approx(SIGMA, rel=0.1)


def test_few_repeats_leave_the_correlation_open():
    noise = noise_from_repeats(measured(rho=0.9, runs=3))
    shares = [share for share, _ in noise.likely]
    assert sum(shares) == pytest.approx(1.0)
    assert len(shares) > 2
    assert min(n.correlation.rho for _, n in noise.likely) < noise.correlation.rho
    assert max(n.correlation.rho for _, n in noise.likely) > noise.correlation.rho
    # a longer correlation goes with a larger noise
    sigmas = [n.sigma for _, n in sorted(noise.likely, key=lambda pair: pair[1].correlation.rho)]
    assert sigmas == sorted(sigmas)
    assert noise_from_repeats(measured()).likely == ()


def test_how_likely_a_correlation_is():
    data = np.random.default_rng(6).normal(size=(1, 40)) + np.repeat([0.0, 2.0, -2.0, 1.0], 10)
    fit = NoiseFit(np.empty((0, 40)), STARTS, 40)
    kinds, shares = fit.likely(data[0])
    values = [restricted_likelihood(data[0], np.empty((0, 40)), covariance(c.rho, c.white, STARTS))[0] for c in kinds]
    expected = np.exp(values - np.max(values))
    assert shares == pytest.approx(expected / expected.sum())
    assert max(c.rho for c in fit.likely(data[0], longest=0.9)[0]) <= 0.9


def test_a_step_is_no_correlation():
    data = measured(lambda x, way, t, run: np.where(t > 1005.0, 0.012, 0.0), runs=5)
    found = noise_from_repeats(data)
    assert found.correlation.is_white
    assert found.sigma == pytest.approx(SIGMA, rel=0.25)
    # nor is it where nobody recorded the time, but then it cannot be told
    untimed = replace(data, conditions=replace(data.conditions, time_s=None))
    assert noise_from_repeats(untimed).sigma > found.sigma


def test_terms_that_change_in_time_are_no_noise():
    wave = lambda x, way, t, run: 0.02 * np.sin(t / 60.0)
    data = measured(wave, temperatures={"room": np.sin(10.0 * np.arange(210) / 60.0)})
    growth = effect_named("thermal_growth")
    shaped = replace(data, observed=data.observed + data.columns(growth, growth.shape_type("room"))[:, 0] * 1e-4)
    with_term = noise_from_repeats(shaped, [(growth, growth.shape_type("room"))])
    assert with_term.freedom < noise_from_repeats(data).freedom + 1
    # what does not change from repeat to repeat is not taken out once more
    scale = effect_named("scale")
    assert noise_from_repeats(data, [(scale, Shape())]) == noise_from_repeats(data)


def test_without_repeats_there_is_no_noise_from_them():
    data = measured(runs=1)
    assert noise_from_repeats(data) is None
    floor = noise_of(data)
    assert (floor.from_repeats, floor.floor, floor.sigma_adjacent, floor.sigma_pooled) == (False, None, None, None)
    assert floor.sigma == pytest.approx(data.observed.std(ddof=1), rel=1e-6)


def test_noise_of_a_residual_counts_the_parameters():
    y = np.random.default_rng(0).normal(size=400)
    data = replace(measured(runs=1, targets=200), observed=y)
    found = noise_from_residual(data, y, 40)
    assert found.correlation.is_white
    assert (found.from_repeats, found.freedom) == (False, 360.0)
    assert found.sigma == pytest.approx(np.sqrt(y @ y / 360))
    assert noise_from_residual(data, y, 1000).freedom == 1.0


def test_a_correlated_residual_is_seen():
    starts = np.arange(400) == 0
    y = coloured(np.random.default_rng(1), covariance(0.9, 0.0, starts))
    found = noise_from_residual(replace(measured(runs=1, targets=200), observed=y), y, 0)
    assert found.correlation.to_next == pytest.approx(0.9, abs=5 * np.sqrt((1 - 0.81) / 400))


@pytest.mark.parametrize("broken", [False, True])
def test_adjacent_and_pooled_repeats(broken):
    data = measured(lambda x, way, t, run: 0.001 * run, runs=4, targets=6)
    if broken:
        data = data.take(np.arange(data.rows - 5))
    steps, pooled = [], []
    for k in range(12):
        own = data.observed[data.cell == k]
        steps += np.diff(own).tolist()
        pooled += ((own - own.mean()) ** 2).tolist()
    floor = noise_of(data)
    assert floor.sigma_adjacent == pytest.approx(np.sqrt(0.5 * np.mean(np.square(steps))))
    assert adjacent_sigma(data) == floor.sigma_adjacent
    if broken:  # each difference stretched by the number of its repeats
        assert floor.sigma_pooled == pytest.approx(pooled_sigma(data, repeat_space(data)))
    else:
        assert floor.sigma_pooled == pytest.approx(np.sqrt(np.sum(pooled) / (3 * 12)))
    assert floor.sigma_adjacent < floor.sigma_pooled  # a drift: neighbours in time are more alike


def test_the_order_in_time_decides_who_is_adjacent():
    data = measured(lambda x, way, t, run: 0.01 * run, runs=4, targets=6, sigma=1e-5)
    mixed = data.take(np.random.default_rng(0).permutation(data.rows))
    assert adjacent_sigma(mixed) == pytest.approx(adjacent_sigma(data))


def test_no_cell_twice_no_adjacent_repeats():
    data = measured(runs=2, targets=3)
    assert adjacent_sigma(replace(data, cell=np.arange(12))) is None


def test_repeats_to_the_digit_have_a_trifle_of_noise_and_no_correlation():
    data = measured(lambda x, way, t, run: 0.005 * way + 1e-5 * x, sigma=0.0)
    found = noise_from_repeats(data)
    assert found.correlation.is_white
    assert found.sigma == pytest.approx(0.002 * data.observed.std())
    assert found.freedom == 4 * 42
    nearly = replace(data, observed=data.observed + np.random.default_rng(0).normal(0, 1e-17, data.rows))
    assert noise_from_repeats(nearly).sigma == pytest.approx(found.sigma)
    assert noise_from_repeats(nearly).correlation.is_white


def test_noise_below_a_trifle_is_not_believed_but_its_correlation_is():
    data = measured(lambda x, way, t, run: 3.0 * way, rho=0.95, targets=40)
    found = noise_from_repeats(data)
    assert found.sigma == pytest.approx(0.002 * data.observed.std())
    assert found.correlation.to_next > 0.8


def test_few_differences_have_no_correlation():
    data = measured(runs=2, targets=2, rho=0.99)  # four differences
    assert module.FEWEST > 4
    assert noise_from_repeats(data).correlation.is_white


def test_the_floor_as_people_read_it():
    data = measured()
    mixed = Noise(sigma=0.003, correlation=Correlation(rho=0.95, white=0.3), freedom=17.0, from_repeats=True)
    floor = noise_floor(data, mixed)
    assert (floor.sigma, floor.floor, floor.degrees_of_freedom, floor.from_repeats) == (0.003, 0.003, 17.0, True)
    assert (floor.correlation, floor.white_share) == (pytest.approx(0.95 * 0.7), 0.3)
    assert noise_floor(data, replace(mixed, correlation=Correlation())).white_share == 1.0


@pytest.mark.parametrize(("runs", "targets"), [(2, 11), (2, 21), (3, 11)])
def test_few_differences_of_noise_are_seldom_taken_for_changes(monkeypatch, runs, targets):
    taken = []
    plain = module._likely_changes
    monkeypatch.setattr(module, "_likely_changes", lambda *given: taken.append(plain(*given)) or taken[-1])
    for seed in range(40):
        noise_from_repeats(measured(seed=seed, runs=runs, targets=targets, rho=0.9))
    assert sum(changes.size > 0 for changes in taken) <= 4


def test_exact_repeats_leave_no_correlation_open():
    kinds, shares = NoiseFit(np.empty((0, 40)), STARTS, 40).likely(np.zeros(40))
    assert len(kinds) == 1
    assert shares.tolist() == [1.0]
