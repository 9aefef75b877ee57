"""The smallest effect that would be found, against simulated searches."""

import numpy as np
import pytest
from inference_oracle import SIGMA, covariance, measured, whitened
from scipy import stats

from rtec.effects import effect_named
from rtec.inference.calibration import independent_tests
from rtec.inference.detectable import IN_TIME, POWER, minimum_detectable
from rtec.inference.diagnose import diagnose
from rtec.inference.noise import Noise, noise_from_repeats
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Workspace


def work_of(data, **changes):
    given = {"sigma": SIGMA, "correlation": Correlation(), "freedom": 168.0, "from_repeats": True} | changes
    return Workspace(data, Noise(**given))


@pytest.mark.parametrize("tests", [1.0, 200.0])
def test_an_effect_of_that_size_passes_the_test_so_often(tests):
    work = work_of(measured())
    least = minimum_detectable(work, tests)["backlash"]
    # the energy of a contribution of that RMS, mean removed, and draws of its fall
    fall = (np.sqrt(least**2 * 210) / SIGMA + np.random.default_rng(0).standard_normal(40_000)) ** 2
    level = 1 - (1 - 0.01) ** (1 / tests)
    needed = max(stats.f.isf(level, 1, 168), np.log(210), 16.0)
    assert np.mean(fall > needed) == pytest.approx(POWER, abs=0.005)


def test_searches_find_what_should_be_found_and_not_half_of_it():
    plan = {"runs": 4, "targets": 8, "timed": False}
    data = measured(**plan)
    work = Workspace(data, noise_from_repeats(data))
    least = minimum_detectable(work, independent_tests(work, np.random.default_rng(0)))["backlash"]
    for share, low, high in ((1.0, 9, 12), (0.4, 0, 3)):
        found = [
            "backlash" in diagnose(measured(lambda x, way, t, run, s=share: s * least * way, seed=k, **plan)).effects
            for k in range(12)
        ]
        # of 12 at 95 %: nine or more but for 1 in 5000
        assert low <= sum(found) <= high


def test_it_shrinks_with_the_root_of_the_readings_and_grows_with_the_noise():
    few, many = (minimum_detectable(work_of(measured(runs=runs)), 100.0) for runs in (3, 12))
    for name in ("backlash", "scale", "offset"):
        assert few[name] / many[name] == pytest.approx(2.0, rel=0.02)
    loud = minimum_detectable(work_of(measured(runs=3), sigma=5 * SIGMA), 100.0)
    assert {k: v / 5 for k, v in loud.items()} == pytest.approx(few)


def test_correlated_noise_hides_what_is_slow():
    white = minimum_detectable(work_of(measured()), 100.0)
    slow = minimum_detectable(work_of(measured(), correlation=Correlation(rho=0.9)), 100.0)
    for name in ("offset", "scale", "drift"):
        assert slow[name] > 2 * white[name]


def test_every_testable_effect_has_one_and_no_other():
    work = work_of(measured())
    assert set(minimum_detectable(work, 100.0)) == {effect.name for effect in work.library}
    assert all(value > 0 for value in minimum_detectable(work, 100.0).values())


def test_the_least_favourable_shape_counts():
    """Beside correlated noise long waves need more than short ones: the energy by dense matrices says how much."""
    data, cyclic = measured(runs=4, targets=12), effect_named("cyclic")
    shapes = cyclic.shapes(data.conditions)
    shapes = [shapes[k] for k in np.linspace(0, len(shapes) - 1, 25).astype(int)]
    matrix = covariance(0.9, 0.0, np.arange(data.rows) % 24 == 0)
    constant = whitened(np.ones((1, data.rows)), matrix)[0]
    constant /= np.linalg.norm(constant)
    more = []
    for shape in shapes:
        raw = data.columns(cyclic, shape)
        white = whitened(raw.T, matrix)
        energy = (white**2).sum() - ((white @ constant) ** 2).sum()
        more.append(float(((raw - raw.mean(axis=0)) ** 2).sum() / energy))
    assert max(more) > 2 * min(more)
    slow = minimum_detectable(work_of(data, correlation=Correlation(rho=0.9)), 100.0)["cyclic"]
    assert slow / minimum_detectable(work_of(data), 100.0)["cyclic"] == pytest.approx(np.sqrt(max(more)), rel=1e-6)


def test_what_changes_in_time_needs_more_beside_correlated_noise():
    data = measured()
    alone = work_of(data, correlation=Correlation(rho=1e-9))
    white = minimum_detectable(work_of(data), 100.0)
    nearly_white = minimum_detectable(alone, 100.0)
    assert nearly_white["scale"] == pytest.approx(white["scale"], rel=1e-6)
    assert nearly_white["drift"] == pytest.approx(np.sqrt(IN_TIME) * white["drift"], rel=1e-6)
