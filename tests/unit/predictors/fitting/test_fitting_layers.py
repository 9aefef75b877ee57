"""Networks over their weights: against loops of plain Python, and against the function that goes to work."""

import layers_oracle
import numpy as np
import pytest
from numpy.testing import assert_allclose

from rtec.errors import ArgumentError
from rtec.predictors.fitting.layers import Layers, Shape
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks

SHAPES = [(1, (1,)), (2, (5,)), (3, (4, 3)), (2, (3, 2, 4))]


def case(inputs, hidden, rows=7):
    rng = np.random.default_rng(inputs * 10 + len(hidden))
    shape = Shape(inputs=inputs, hidden=hidden)
    return shape, rng.uniform(-1.0, 1.0, (rows, inputs)), rng.normal(0.0, 1.0, shape.weights)


@pytest.mark.parametrize(("inputs", "hidden"), SHAPES)
def test_output_jacobian_and_gradient_are_those_of_the_loops(inputs, hidden):
    shape, given, weights = case(inputs, hidden)
    net = Layers(shape, given)
    expected = [layers_oracle.output(hidden, weights, row).real for row in given]
    slopes = np.array([layers_oracle.slopes(hidden, weights, row) for row in given]).T
    residual = np.linspace(-1.0, 2.0, len(given))
    assert_allclose(net.output(weights), expected, rtol=0, atol=1e-13)
    assert_allclose(net.jacobian(weights), slopes, rtol=0, atol=1e-13)
    assert_allclose(net.gradient(weights, residual), slopes @ residual, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("inputs", "hidden"), SHAPES)
def test_curvature_along_a_direction_is_that_of_second_differences_of_the_loops(inputs, hidden):
    shape, given, weights = case(inputs, hidden)
    net = Layers(shape, given)
    target = np.linspace(-1.0, 2.0, len(given))
    along = np.random.default_rng(9).normal(0.0, 1.0, shape.weights)

    def half_squares(step):
        here = [layers_oracle.output(hidden, weights + step * along, row).real for row in given]
        return 0.5 * np.sum((np.array(here) - target) ** 2)

    step = 1e-3
    expected = (half_squares(step) - 2.0 * half_squares(0.0) + half_squares(-step)) / step**2
    residual = net.output(weights) - target
    assert_allclose(net.curvature(weights, along, residual), expected, rtol=1e-4)


@pytest.mark.parametrize("hidden", [(5,), (4, 3)])
@pytest.mark.parametrize("sign", [None, 0, 1, 2])
def test_normal_equations_are_products_of_the_jacobian(hidden, sign):
    shape, given, weights = case(3, hidden, rows=40)
    if sign is not None:
        given[:, sign] = np.repeat([-1.0, 1.0], [15, 25])
    net = Layers(shape, given)
    residual = net.output(weights) - np.cos(np.arange(40.0))
    products, slope = net.normal(weights, residual)
    jacobian = net.jacobian(weights)
    assert_allclose(products, jacobian @ jacobian.T, rtol=0, atol=1e-12)
    assert_allclose(slope, jacobian @ residual, rtol=0, atol=1e-12)


@pytest.mark.parametrize("column", [[-1.0, 1.0, -1.0, 1.0], [1.0, 1.0, -1.0, -1.0], [-1.0, -1.0, -1.0, -1.0]])
def test_signs_in_another_order_have_products_of_the_whole_jacobian(column):
    shape, given, weights = case(2, (3,), rows=4)
    given[:, 1] = column
    net = Layers(shape, given)
    products, _ = net.normal(weights, net.output(weights))
    jacobian = net.jacobian(weights)
    assert_allclose(products, jacobian @ jacobian.T, rtol=0, atol=1e-12)


def test_far_outside_a_neuron_is_0_or_1_without_a_warning():
    net = Layers(Shape(inputs=1, hidden=(1,)), np.array([[-1e6], [1e6]]))
    assert net.output(np.array([1e3, 0.0, 2.0, 1.0])).tolist() == [1.0, 3.0]


@pytest.mark.parametrize("hidden", [(6,), (5, 4)])
def test_the_function_that_goes_to_work_says_the_same(hidden):
    shape, _, weights = case(3, hidden)
    rng = np.random.default_rng(3)
    x, way = rng.uniform(10.0, 90.0, 50), np.where(np.arange(50) % 2, 1, -1)
    middle, half = np.array([50.0, 0.5, 2.5]), np.array([40.0, 0.5, 2.5])
    given = (np.stack([x, np.where(way < 0, 1.0, 0.0), x % 5.0], axis=1) - middle) / half
    network = LayeredNetwork(
        inputs=("position", "direction", "turn"),
        middle=middle,
        half=half,
        hidden=hidden,
        weights=weights,
        bias_mm=0.01,
        factor_mm=0.002,
    )
    compiled = TrainedNetworks(networks=(network,), range_mm=(10.0, 90.0), pitch_mm=5.0)
    expected = 0.01 + 0.002 * Layers(shape, given).output(weights)
    assert_allclose(compiled.error_mm(x, way), expected, rtol=0, atol=1e-14)
    expected = [0.01 + 0.002 * layers_oracle.output(hidden, weights, row).real for row in given]
    assert_allclose(compiled.error_mm(x, way), expected, rtol=0, atol=1e-14)


def test_first_weights_spread_the_active_regions_over_the_inputs():
    """Nguyen and Widrow: each neuron is at half its height somewhere within the inputs, and these places differ."""
    shape = Shape(inputs=1, hidden=(12,))
    weights = shape.first_weights(np.random.default_rng(0))
    middles = np.sort(-weights[12:24] / weights[:12])
    assert middles.min() >= -1.0 - 1e-12
    assert middles.max() <= 1.0 + 1e-12
    assert np.diff(middles).max() < 0.4
    assert np.allclose(np.abs(weights[:12]), 4.0 * 0.7 * 12)


@pytest.mark.parametrize(
    ("inputs", "hidden", "name"),
    [(0, (3,), "inputs"), (2, (0,), "hidden"), (2, (65,), "hidden"), (2, (), "hidden"), (1, (1, 1, 1, 1), "hidden")],
)
def test_a_shape_that_cannot_be(inputs, hidden, name):
    with pytest.raises(ArgumentError) as caught:
        Shape(inputs=inputs, hidden=hidden)
    assert caught.value.name == name
