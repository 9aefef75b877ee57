"""Tails beside those of scipy.stats."""

import numpy as np
import pytest
from scipy import stats

from rtec.inference import tails

SEEN = [0.0, 1e-9, 0.3, 1.0, 7.5, 60.0, 600.0]


@pytest.mark.parametrize("seen", [-1e-12, *SEEN])
def test_they_are_those_of_the_library(seen):
    assert tails.chi_squared(seen, 3) == pytest.approx(stats.chi2.sf(seen, 3), rel=1e-12)
    assert tails.f_ratio(seen, 2, 31.5) == pytest.approx(stats.f.sf(seen, 2, 31.5), rel=1e-12)
    expected = stats.gamma.sf(seen, 1.7**2 / 0.4, scale=0.4 / 1.7)
    assert tails.gamma(seen, mean=1.7, variance=0.4) == pytest.approx(expected, rel=1e-12)
    assert tails.gumbel(seen, 2.0, 0.7) == pytest.approx(stats.gumbel_r.sf(seen, 2.0, 0.7), rel=1e-12)


def test_many_at_once():
    assert np.allclose(tails.chi_squared(np.array(SEEN), 5), stats.chi2.sf(SEEN, 5), rtol=1e-12, atol=0.0)


def test_far_below_the_largest_of_many_is_certain():
    assert tails.gumbel(-1e6, 0.0, 1.0) == 1.0
