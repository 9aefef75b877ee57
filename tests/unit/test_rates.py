"""Intervals of rates, against scipy's."""

import pytest
from scipy.stats import binomtest

from rtec.rates import clopper_pearson, never_seen, wilson

COUNTS = [(0, 1), (0, 300), (1, 2), (3, 57), (500, 1000), (12, 12)]


@pytest.mark.parametrize(("hits", "tries"), COUNTS)
@pytest.mark.parametrize("confidence", [0.9, 0.95, 0.999])
@pytest.mark.parametrize(("ours", "method"), [(wilson, "wilson"), (clopper_pearson, "exact")])
def test_intervals_are_those_of_scipy(hits, tries, confidence, ours, method):
    expected = binomtest(hits, tries).proportion_ci(confidence, method=method)
    assert ours(hits, tries, confidence) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_nothing_is_known_from_no_try():
    assert (wilson(0, 0), clopper_pearson(0, 0), never_seen(0)) == ((0.0, 1.0), (0.0, 1.0), 1.0)


@pytest.mark.parametrize("tries", [1, 29, 10_000])
def test_a_rate_at_the_bound_is_missed_by_so_many_tries_one_time_in_twenty(tries):
    assert (1.0 - never_seen(tries)) ** tries == pytest.approx(0.05)
