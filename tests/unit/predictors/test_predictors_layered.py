"""Trained networks as predictors: held ends, sums, the place in the turn, and what cannot be."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rtec.errors import ArgumentError
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks

SLOPE = {
    "inputs": ("position",),
    "middle": [50.0],
    "half": [50.0],
    "hidden": (1,),
    "weights": [2.0, 0.0, 1.0, 0.0],
    "bias_mm": 0.001,
    "factor_mm": 0.01,
}
TURN = SLOPE | {"inputs": ("turn", "direction"), "middle": [2.5, 0.5], "half": [2.5, 0.5]}
TURN |= {"weights": [1.5, -0.5, 0.25, 2.0, -1.0]}


def logistic(x):
    return 1.0 / (1.0 + math.exp(-x))


def test_networks_add_up_and_see_position_direction_and_turn():
    predictor = TrainedNetworks(
        networks=(LayeredNetwork(**SLOPE), LayeredNetwork(**TURN)), range_mm=(0.0, 100.0), pitch_mm=5.0
    )
    for x, way in ((12.0, 1), (12.0, -1), (99.0, -1)):
        wide = 0.001 + 0.01 * logistic(2.0 * (x - 50.0) / 50.0)
        given = 1.5 * (x % 5.0 - 2.5) / 2.5 - 0.5 * (1.0 if way < 0 else -1.0) + 0.25
        fine = 0.001 + 0.01 * (2.0 * logistic(given) - 1.0)
        assert float(predictor.error_mm(x, way)) == pytest.approx(wide + fine, abs=1e-15)


def test_the_place_in_the_turn_of_negative_positions_is_within_it():
    predictor = TrainedNetworks(networks=(LayeredNetwork(**TURN),), range_mm=(-100.0, 100.0), pitch_mm=4.0)
    assert_allclose(predictor.error_mm([-1.0, -93.0], 1), predictor.error_mm([3.0, 3.0], 1), rtol=1e-15)
    assert predictor.error_mm(3.0, 1) != predictor.error_mm(1.0, 1)


def test_beyond_its_range_it_holds_the_error_of_the_end():
    predictor = TrainedNetworks(networks=(LayeredNetwork(**SLOPE),), range_mm=(10.0, 90.0))
    assert_allclose(predictor.error_mm(np.array([-500.0, 500.0]), 1), predictor.error_mm(np.array([10.0, 90.0]), 1))
    assert predictor.error_mm(10.0, 1) != predictor.error_mm(11.0, 1)


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"inputs": ("speed",)}, "inputs"),
        ({"inputs": ()}, "inputs"),
        ({"inputs": (["position"],)}, "inputs"),
        ({"hidden": ()}, "hidden"),
        ({"hidden": (10**30,)}, "hidden"),
        ({"middle": [1.0, 2.0]}, "middle"),
        ({"half": [0.0]}, "half"),
        ({"weights": [1.0, 2.0, 3.0]}, "weights"),
        ({"weights": [1.0, 2.0, math.nan, 4.0]}, "weights, row 3"),
        ({"bias_mm": math.inf}, "bias_mm, row 1"),
    ],
)
def test_a_network_that_cannot_be(changed, name):
    with pytest.raises(ArgumentError) as caught:
        LayeredNetwork(**(SLOPE | changed))
    assert caught.value.name == name


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"networks": ()}, "networks"),
        ({"pitch_mm": 0.0}, "pitch_mm"),
        ({"range_mm": (5.0, 5.0)}, "range_mm"),
        ({"range_mm": (5.0, 1e7)}, "range_mm"),
    ],
)
def test_networks_that_cannot_be(changed, name):
    with pytest.raises(ArgumentError) as caught:
        TrainedNetworks(**({"networks": (LayeredNetwork(**SLOPE),), "range_mm": (0.0, 100.0)} | changed))
    assert caught.value.name == name
