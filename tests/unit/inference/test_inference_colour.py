"""The noise's filter against dense covariances, and the gaps between readings."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import covariance, measured, whitened

from rtec.inference.colour import COLOURS, NEIGHBOURS, Colour, Whitening, gaps_of

UNEVEN = np.array([np.inf, 1, 1, 3, 7, 1, 2, np.inf, 1, 40, 1, 1, np.inf, np.inf, 5, 1, 1, 2, 2, 1], dtype=float)


@pytest.mark.parametrize("columns", [1, 4, 5, 6, 7])
def test_a_direction_is_taken_out_of_every_column(columns):
    matrix = covariance(0.9, 0.3, UNEVEN)
    table = np.random.default_rng(columns).normal(size=(columns + 1, UNEVEN.size))
    expected = whitened(table, matrix)
    without = expected[:1] / np.linalg.norm(expected[0])
    found = Whitening(UNEVEN, Colour(0.9, 0.3)).of(table[1:], 2.5, without)
    assert found == pytest.approx(2.5 * (expected[1:] - (expected[1:] @ without.T) @ without), abs=1e-8)


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


def test_readings_at_rest_are_one_chain_and_those_of_a_log_begin_with_each_run():
    data = measured(runs=3, targets=4)
    assert gaps_of(data).tolist() == [np.inf, *[1.0] * 23]
    moving = replace(data, conditions=replace(data.conditions, moving=True))
    expected = np.ones(24)
    expected[[0, 8, 16]] = np.inf
    assert gaps_of(moving).tolist() == expected.tolist()
    assert gaps_of(data.take(np.array([0, 1, 4, 5, 12]))).tolist() == [np.inf, 1, 3, 1, 7]
