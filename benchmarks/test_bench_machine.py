"""Speed of the closed loop, of PC and box exchanging requests, and of a prediction."""

import numpy as np
import pytest
from figures_machine import calibrate, converse

from rtec.predictors import LatheNetwork
from rtec.requester.settings import HandshakeSettings


@pytest.mark.parametrize("skip_rest", [True, False], ids=["rest skipped", "every tick"])
def test_closed_loop_of_one_pass(benchmark, skip_rest):
    _, result = benchmark(calibrate, 0.52, 1, skip_rest=skip_rest)
    assert result.deviation_mm.size == 2 * 76


def test_handshake(benchmark):
    benchmark(converse, 50_050, HandshakeSettings())  # ends half-way up, where a total too small would show


@pytest.mark.parametrize("direction", [1, -1])
def test_prediction_by_network(benchmark, direction):
    position_mm = np.linspace(25.4, 1016.0, 10_000)
    error_mm = benchmark(LatheNetwork().error_mm, position_mm, direction)
    assert 0.010 < error_mm.min() < error_mm.max() < 0.150  # from 12 to 145 µm, as the thesis's curves
