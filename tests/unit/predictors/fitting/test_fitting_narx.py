"""Training NARX networks: the gradient through the recurrence, and what comes out of it."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from rtec.errors import ArgumentError
from rtec.predictors import NarxShape, Sequences
from rtec.predictors.fitting.free_run import FreeRunSquares, cut, first_weights
from rtec.predictors.fitting.narx import NarxEffort, Stages, fit_narx

SPANS = np.array([[3, 40], [40, 41], [45, 180]])


def problem(*, linear, closed, spans=SPANS, neurons=5, scale=0.4):
    shape = NarxShape(channels=2, neurons=neurons, input_delays=(0, 2), feedback_delays=(1, 3), linear=linear)
    draw = np.random.default_rng(7)
    inputs, measured = draw.uniform(-1.0, 1.0, (200, 2)), draw.uniform(-1.0, 1.0, 200)
    weights = draw.normal(0.0, scale, shape.weights)
    return FreeRunSquares(shape, inputs, measured, spans, closed=closed), shape, inputs, measured, weights


def plain_errors(shape, inputs, measured, spans, weights, closed):
    """Return the errors by the definition; with complex weights, so that a derivative is an imaginary part."""
    begin = shape.neurons * (shape.taps + 1)
    hidden = weights[:begin].reshape(-1, shape.neurons)
    outer, bias, direct = (
        weights[begin : begin + shape.neurons],
        weights[begin + shape.neurons],
        weights[begin + 1 + shape.neurons :],
    )
    errors = []
    for first, end in spans:
        past = measured.astype(weights.dtype)
        for t in range(first, end):
            seen = [inputs[t - d, c] for c in range(shape.channels) for d in shape.input_delays]
            seen = np.array([*seen, *(past[t - d] for d in shape.feedback_delays)])
            found = bias + outer @ np.tanh(seen @ hidden[:-1] + hidden[-1]) + (direct @ seen if direct.size else 0.0)
            errors.append(found - measured[t])
            if closed:
                past[t] = found
    return np.array(errors)


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("closed", [True, False])
def test_the_jacobian_is_that_of_complex_steps(linear, closed):
    squares, shape, inputs, measured, weights = problem(linear=linear, closed=closed)
    blocks = [(rows.copy(), error.copy()) for rows, error in squares.blocks(weights)]
    rows, errors = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    steps = 1e-30j * np.eye(weights.size)
    expected = [plain_errors(shape, inputs, measured, SPANS, weights + step, closed).imag / 1e-30 for step in steps]
    assert errors == pytest.approx(plain_errors(shape, inputs, measured, SPANS, weights, closed), abs=1e-12)
    assert rows == pytest.approx(np.array(expected).T, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("closed", [True, False])
def test_products_over_many_blocks_are_those_of_differences(linear, closed):
    shape = NarxShape(channels=1, neurons=9, input_delays=(0, 1), feedback_delays=(1, 2), linear=linear)
    draw = np.random.default_rng(8)
    inputs, measured = draw.uniform(-1.0, 1.0, (5000, 1)), draw.uniform(-1.0, 1.0, 5000)
    squares = FreeRunSquares(shape, inputs, measured, np.array([[2, 3000], [3005, 5000]]), closed=closed)
    weights = draw.normal(0.0, 0.3, shape.weights)
    total, products, slope = squares.normal(weights)
    step = 1e-6
    differences = [
        (squares.squares(weights + step * one) - squares.squares(weights - step * one)) / (4.0 * step)
        for one in np.eye(weights.size)
    ]
    assert total == pytest.approx(squares.squares(weights), rel=1e-12)
    assert slope == pytest.approx(np.array(differences), abs=1e-6 * np.abs(slope).max())
    rows = np.concatenate([rows.copy() for rows, _ in squares.blocks(weights)])
    assert rows.shape == (4993, shape.weights) == (squares.samples, shape.weights)
    assert products == pytest.approx(rows.T @ rows, rel=1e-9, abs=1e-9)


def test_what_diverges_has_an_infinite_sum_of_squares():
    squares, *_, weights = problem(linear=True, closed=True)
    weights[-2] = 3.0
    assert squares.squares(weights) == np.inf
    assert squares.normal(weights)[0] == np.inf


def test_stretches_are_cut_without_loss():
    pieces = cut(SPANS, 10)
    samples = [t for first, end in pieces for t in range(first, end)]
    assert samples == [t for first, end in SPANS for t in range(first, end)]
    assert (pieces[:, 1] - pieces[:, 0]).max() == 10


def system(samples=1500, noise=0.0, seed=1, runs=1):
    """Return a log of a lag with an input that saturates."""
    draw = np.random.default_rng(seed)
    u = np.repeat(draw.uniform(-1.0, 1.0, samples // 5), 5)[:, None]
    y = np.zeros(samples)
    for t in range(2, samples):
        y[t] = 1.4 * y[t - 1] - 0.5 * y[t - 2] + 0.3 * np.tanh(2.0 * u[t - 1, 0])
    y += noise * draw.normal(size=samples)
    starts = tuple(range(0, samples, samples // runs))
    return Sequences(inputs=u, output=100.0 * y, names=("velocity",), period_s=1e-3, starts=starts)


FEW = {"neurons": 3, "input_delays": (0, 1), "feedback_delays": (1, 2), "starts": 2}


def test_a_noiseless_system_is_found_and_runs_on_its_own():
    found = fit_narx(system(), **FEW)
    test = system(seed=2)
    error = found.narx.free_run(test) - test.output
    assert np.sqrt(np.mean(error**2)) < 1e-3 * test.output.std()
    assert found.start is min(found.starts, key=lambda start: start.rms_validation)
    assert 0.0 < found.start.gamma <= found.narx.parameters
    assert not found.interrupted


def test_parallel_training_runs_better_where_readings_are_noisy():
    data, test = system(noise=0.2, runs=3), system(seed=2)
    rms = {}
    for stages in Stages:
        found = fit_narx(data, **FEW, stages=stages)
        rms[stages] = np.sqrt(np.mean((found.narx.free_run(test) - test.output)[20:] ** 2))
    assert rms[Stages.BOTH] < 0.6 * rms[Stages.OPEN]
    names = [name for name, _ in found.start.history]
    assert list(dict.fromkeys(names)) == ["series-parallel", "parallel over 20", "parallel over 200", "parallel"]


def test_parallel_training_reaches_the_least_squares_of_scipy():
    data = system(noise=0.05, samples=600)
    found = fit_narx(data, **FEW | {"starts": 1}, effort=NarxEffort(closed_epochs=400, patience=400))
    narx, part = found.narx, data.part(0, 450)
    inputs, measured = narx.scaled(part)
    spans = np.array([[narx.lags, 450]])
    best = least_squares(  # a few iterations from where ours ended
        lambda weights: plain_errors(narx.shape, inputs, measured, spans, weights, True),
        narx.weights,
        method="lm",
        max_nfev=10,
    )
    ours = FreeRunSquares(narx.shape, inputs, measured, spans, closed=True).squares(narx.weights)
    assert ours < 1.1 * 2.0 * best.cost


def test_several_sizes_are_tried_and_a_seed_repeats_them():
    args = FEW | {"neurons": (1, 4), "effort": NarxEffort(open_epochs=5, horizons=(), closed_epochs=5)}
    one, two = (fit_narx(system(600), **args, seed=5) for _ in range(2))
    assert [(start.shape.neurons, start.number) for start in one.starts] == [(1, 0), (4, 0), (1, 1), (4, 1)]
    assert np.array_equal(one.narx.weights, two.narx.weights)
    other = fit_narx(system(600), **args, seed=6)
    assert not np.array_equal(one.narx.weights, other.narx.weights)


def test_the_length_of_the_memory_is_chosen_where_several_are_given():
    effort = NarxEffort(open_epochs=30, horizons=(), closed_epochs=30)
    found = fit_narx(system(), neurons=3, orders=(1, 2), starts=1, effort=effort)
    assert [start.shape.feedback_delays for start in found.starts] == [(1,), (1, 2)]
    assert found.narx.shape.feedback_delays == (1, 2)  # the system has two poles
    assert found.narx.shape.input_delays == (0, 1)


@pytest.mark.parametrize("epochs", [2, 25])
def test_ctrl_c_keeps_the_best_so_far(epochs):
    seen = []

    def stop(start):
        seen.append(start)
        if len(seen) == epochs:
            raise KeyboardInterrupt

    found = fit_narx(system(600), **FEW, effort=NarxEffort(open_epochs=10, horizons=()), progress=stop)
    assert found.interrupted
    assert len(found.starts) == 1
    assert found.start.rms_validation < np.inf
    assert len(found.start.history) == epochs


def test_starts_that_diverge_say_so():
    # short runs of something that grows, and then a long one: the network grows on
    growing = np.concatenate([1e-3 * draw * 1.5 ** np.arange(20.0) for draw in np.linspace(-1.0, 1.0, 20)])
    output = np.concatenate([growing, 1e-3 * np.ones(300)])
    inputs = np.random.default_rng(0).uniform(-1.0, 1.0, (700, 1))
    data = Sequences(
        inputs=inputs, output=output, names=("velocity",), period_s=1e-3, starts=(*range(0, 400, 20), 400)
    )
    args = {"neurons": 1, "input_delays": (0,), "feedback_delays": (1,), "starts": 2, "validation": 3 / 7}
    found = fit_narx(data, **args, stages=Stages.OPEN)
    assert [start.reason for start in found.starts] == ["the free run over the validation part diverges"] * 2


@pytest.mark.parametrize(
    ("change", "args", "said"),
    [
        ({"inputs": np.ones((1500, 1))}, {}, "velocity never changes"),
        ({"output": np.zeros(1500)}, {}, "output never changes"),
        ({}, {"neurons": 64, "validation": 0.85}, "64 neurons have"),
        ({}, {"validation": 0.0}, "validation"),
        ({}, {"validation": 0.001}, "validation part"),
        ({}, {"starts": 0}, "starts"),
        ({}, {"neurons": ()}, "starts"),
        ({}, {"neurons": 0}, "neurons"),
        ({}, {"feedback_delays": (0, 1)}, "feedback_delays"),
        ({}, {"input_delays": (2, 1)}, "input_delays"),
    ],
)
def test_what_cannot_be_trained_is_refused(change, args, said):
    data = system()
    given = {name: getattr(data, name) for name in ("inputs", "output", "names", "period_s")}
    with pytest.raises(ArgumentError, match=said):
        fit_narx(Sequences(**(given | change)), **(FEW | args))


def test_first_weights_spread_the_neurons():
    shape = NarxShape(channels=1, neurons=6, input_delays=(0, 1), feedback_delays=(1, 2), linear=True)
    weights = first_weights(shape, np.random.default_rng(0))
    inner = weights[: 6 * 4].reshape(4, 6)
    assert np.linalg.norm(inner, axis=0) == pytest.approx(np.full(6, 0.7 * 6**0.25))
    assert weights[-4:].tolist() == [0.0] * 4
