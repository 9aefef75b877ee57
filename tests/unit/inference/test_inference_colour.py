"""The noise's filter against dense covariances, and the gaps between readings."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import covariance, measured, whitened

from rtec.inference.colour import COLOURS, CORRELATIONS, NEIGHBOURS, Colour, Whitening, gaps_of

EVEN = np.append(np.inf, np.ones(39))
UNEVEN = np.array([np.inf, 1, 1, 3, 7, 1, 2, np.inf, 1, 40, 1, 1, np.inf, np.inf, 5, 1, 1, 2, 2, 1], dtype=float)


@pytest.mark.parametrize("gap", [EVEN, UNEVEN], ids=["even", "uneven"])
@pytest.mark.parametrize(("rho", "white"), [(0.0, 1.0), (0.5, 0.01), (0.9, 0.3), (0.999, 0.6), (0.97, 0.0)])
def test_whitening_is_the_inverse_of_the_cholesky_factor(gap, rho, white):
    matrix = covariance(rho, white, gap)
    table = np.random.default_rng(1).normal(size=(11, gap.size))  # more than pass the filter side by side
    filtered = Whitening(gap, Colour(rho, white))
    before = table.copy()
    assert filtered.of(table) == pytest.approx(whitened(table, matrix), rel=1e-7, abs=1e-8)
    assert (table == before).all()
    assert filtered.log_determinant == pytest.approx(np.linalg.slogdet(matrix)[1], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("columns", [1, 4, 5, 6, 7])
def test_a_direction_is_taken_out_of_every_column(columns):
    matrix = covariance(0.9, 0.3, UNEVEN)
    table = np.random.default_rng(columns).normal(size=(columns + 1, UNEVEN.size))
    expected = whitened(table, matrix)
    without = expected[:1] / np.linalg.norm(expected[0])
    found = Whitening(UNEVEN, Colour(0.9, 0.3)).of(table[1:], 2.5, without)
    assert found == pytest.approx(2.5 * (expected[1:] - (expected[1:] @ without.T) @ without), abs=1e-8)


def test_whitened_noise_is_white():
    """20 000 readings of an autoregression beside white noise, simulated step by step."""
    rng, rho, white, n = np.random.default_rng(2), 0.9, 0.3, 20_000
    slow = np.zeros(n)
    slow[0] = rng.normal()
    for i in range(1, n):
        slow[i] = rho * slow[i - 1] + np.sqrt(1 - rho**2) * rng.normal()
    noise = np.sqrt(1 - white) * slow + np.sqrt(white) * rng.normal(size=n)
    found = Whitening(np.append(np.inf, np.ones(n - 1)), Colour(rho, white)).of(noise[None, :])[0]
    assert np.var(found) == pytest.approx(1.0, abs=4 * np.sqrt(2 / n))
    for lag in (1, 2, 5):
        assert abs(np.mean(found[lag:] * found[:-lag])) < 4 / np.sqrt(n)


def test_length():
    assert 0.9 ** Colour(0.9, 0.25).length == pytest.approx(1 / np.e)
    assert Colour().length == 0.0


def test_every_colour_can_be_reached_from_every_other():
    reached, pending = {Colour()}, [Colour()]
    while pending:
        for near in NEIGHBOURS[pending.pop()]:
            if near not in reached:
                reached.add(near)
                pending.append(near)
    assert reached == set(COLOURS)
    assert all(colour in NEIGHBOURS[near] for colour in COLOURS for near in NEIGHBOURS[colour])
    assert len(COLOURS) == 1 + 9 * 5 + 4
    assert {colour.rho for colour in COLOURS if colour.white < 0.01} == {0.98, 0.99, 0.997, 0.999}
    assert max(colour.rho for colour in COLOURS) == CORRELATIONS[-1]
    for colour in COLOURS:
        if colour.rho > CORRELATIONS[1]:
            for near in NEIGHBOURS[colour]:
                steps = abs(CORRELATIONS.index(near.rho) - CORRELATIONS.index(colour.rho))
                aslant = (near.white - colour.white) * (near.rho - colour.rho) < 0.0
                assert (steps == 1) is (near.white == colour.white or aslant)
                assert not aslant or min(near.rho, colour.rho) >= 0.9


def test_readings_at_rest_are_one_chain_and_those_of_a_log_begin_with_each_run():
    data = measured(runs=3, targets=4)
    assert gaps_of(data).tolist() == [np.inf, *[1.0] * 23]
    moving = replace(data, conditions=replace(data.conditions, moving=True))
    expected = np.ones(24)
    expected[[0, 8, 16]] = np.inf
    assert gaps_of(moving).tolist() == expected.tolist()
    assert gaps_of(data.take(np.array([0, 1, 4, 5, 12]))).tolist() == [np.inf, 1, 3, 1, 7]
