"""The best of many: adjusted probabilities of white noise are uniform, or on the safe side."""

import numpy as np
import pytest
from inference_oracle import SIGMA, measured
from scipy import stats

from rtec.effects import effect_named
from rtec.inference.calibration import adjusted, independent_tests
from rtec.inference.noise import Noise
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Workspace, is_map


def work_of(data, rho=0.0):
    given = Noise(sigma=SIGMA, correlation=Correlation(rho=rho), freedom=1e6, from_repeats=True)
    return Workspace(data, given)


def smallest_p(work, draws):
    """The smallest probability over library and scan grid for each draw, shape (draws, rows), by numpy's QR."""
    smallest = np.ones(len(draws))
    for effect in work.library:
        shapes = work.maps(effect) if is_map(effect) else effect.shapes(work.conditions)
        for shape in shapes:
            columns = np.vstack([work.constant, work.columns(effect, shape)]).T
            basis, triangle = np.linalg.qr(columns)
            basis = basis[:, 1:][:, np.abs(np.diag(triangle))[1:] > 1e-6 * np.abs(triangle).max()]
            if basis.shape[1]:
                fall = ((draws @ basis) ** 2).sum(axis=1)
                smallest = np.minimum(smallest, stats.chi2.sf(fall, basis.shape[1]))
    return smallest


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize("plan", [{"runs": 4, "targets": 8}, {"runs": 1, "targets": 15, "timed": False}])
def test_adjusted_probabilities_of_noise_are_nearly_uniform(plan, rho):
    work = work_of(measured(**plan), rho)
    tests = independent_tests(work, np.random.default_rng(0))
    draws = np.random.default_rng(1).standard_normal((400, work.dataset.rows))
    p = np.array([adjusted(p, tests) for p in smallest_p(work, draws)])
    # 64 draws know the median's probability to 6 %, which the number of tests magnifies: within a factor of 1.6
    assert 0.3 < np.mean(p < 0.5) < 0.68
    assert np.mean(p < 0.01) < 0.03
    assert np.mean(p < 0.1) < 0.2
    assert tests > 5.0


def test_a_larger_library_is_more_tests():
    small, large = work_of(measured(targets=8)), work_of(measured(targets=30))
    count = [independent_tests(work, np.random.default_rng(0)) for work in (small, large)]
    assert count[0] < count[1] < 3000
    alone = work_of(measured(targets=8))
    alone.library = (effect_named("backlash"),)
    assert independent_tests(alone, np.random.default_rng(0), draws=400) == pytest.approx(1.0, abs=0.3)
    alone.library = ()
    assert independent_tests(alone, np.random.default_rng(0)) == 1.0


def test_folding_makes_no_difference():
    """Scans of equal runs are folded; the same draws over an unfolded scan give the same number."""
    data = measured(runs=3, targets=8)
    folded, unfolded = work_of(data), work_of(data)
    unfolded._runs, unfolded._first = 1, None
    rng = [independent_tests(work, np.random.default_rng(5)) for work in (folded, unfolded)]
    assert rng[0] == pytest.approx(rng[1])


@pytest.mark.parametrize("tests", [1.0, 7.3, 5000.0])
@pytest.mark.parametrize("p", [0.0, 1e-30, 1e-8, 0.003, 0.7, 1.0])
def test_adjustment_is_that_of_independent_tests(p, tests):
    found = adjusted(p, tests)
    if p < 1e-12:
        assert found == pytest.approx(p * tests)  # no digits are lost
    elif p < 1.0:
        assert found == pytest.approx(1 - (1 - p) ** tests)
    else:
        assert found == pytest.approx(1.0)
