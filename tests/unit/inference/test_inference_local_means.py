"""Means of neighbours against numpy, group by group."""

from __future__ import annotations

import numpy as np
import pytest

from rtec.inference.local_means import neighbour_means


def test_repeated_places_are_averaged_one_by_one():
    rng = np.random.default_rng(1)
    x = rng.permutation(np.repeat([0.0, 5.0, 10.0], 6))
    y = x + rng.normal(0, 0.5, x.size)
    found = neighbour_means(x, y)
    assert found.at == pytest.approx([0.0, 5.0, 10.0])
    assert found.mean == pytest.approx([y[x == place].mean() for place in (0.0, 5.0, 10.0)])
    errors = [y[x == place].std(ddof=1) / np.sqrt(6) for place in (0.0, 5.0, 10.0)]
    assert found.error == pytest.approx(errors)


def test_many_places_are_averaged_in_groups_of_neighbours():
    x = np.linspace(0.0, 1.0, 10_000)
    found = neighbour_means(x, 3.0 * x)
    assert 5 <= found.at.size <= 40
    assert found.mean == pytest.approx(3.0 * found.at)
    assert neighbour_means(x, 3.0 * x, each_place=True).at.size == 10_000
