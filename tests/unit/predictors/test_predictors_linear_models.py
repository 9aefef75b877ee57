"""ARX and the lagging servo: beside a loop, and found again."""

import numpy as np
import pytest
from scipy.signal import dlsim, dlti

from rtec.errors import ArgumentError
from rtec.predictors.fitting.linear_models import choose_arx, fit_arx, fit_servo_lag, free_run_rms
from rtec.predictors.linear_models import Arx, Held, ServoLag
from rtec.predictors.sequences import Sequences

FEEDBACK, FORWARD = [1.6, -0.7], [[0.2, 0.1], [0.05, -0.3]]


def data_of(inputs, output, starts=(0,), names=("velocity", "acceleration")):
    return Sequences(inputs=inputs, output=output, names=names, period_s=1e-3, starts=starts)


def second_order(samples=400, seed=0):
    """Two inputs through one pair of poles, by scipy's own simulation of transfer functions."""
    u = np.random.default_rng(seed).normal(size=(samples, 2))
    y = np.zeros(samples)
    for channel, weights in enumerate(FORWARD):
        system = dlti([*weights, 0.0], [1.0, *(-np.array(FEEDBACK))], dt=1e-3)
        y += dlsim(system, u[:, channel])[1][:, 0]
    return data_of(u, y)


def arx(**changed):
    known = {"names": ("velocity", "acceleration"), "period_s": 1e-3, "unit": "um"}
    return Arx(**(known | {"feedback": FEEDBACK, "forward": FORWARD} | changed))


def test_a_free_run_is_the_simulation_of_a_transfer_function():
    data = second_order()
    assert arx().free_run(data) == pytest.approx(data.output, abs=1e-9)
    assert arx().lags == 2


def test_each_run_starts_from_its_own_samples_and_a_short_one_stays():
    whole = second_order(60)
    parts = (slice(0, 40), slice(10, 30), slice(0, 2))
    data = data_of(
        np.concatenate([whole.inputs[part] for part in parts]),
        np.concatenate([whole.output[part] for part in parts]),
        starts=(0, 40, 60),
    )
    assert arx().free_run(data) == pytest.approx(data.output, abs=1e-9)


def test_the_orders_are_found_by_what_was_not_fitted():
    data = second_order(600)
    found = choose_arx(data.part(0, 400), data.part(400, 600))
    assert free_run_rms(found, data) < 1e-6
    exact = fit_arx(data, 2, 2)
    assert exact.feedback == pytest.approx(FEEDBACK)
    assert exact.forward == pytest.approx(np.array(FORWARD), abs=1e-9)
    assert exact.constant == pytest.approx(0.0, abs=1e-9)
    assert exact.parameters == 7


def test_an_input_without_delay_alone_is_a_regression():
    u = np.random.default_rng(3).normal(size=(50, 1))
    data = data_of(u, 3.0 * u[:, 0] + 2.0, names=("command",))
    found = fit_arx(data, 0, 1)
    assert (found.lags, found.constant) == (0, pytest.approx(2.0))
    assert found.free_run(data) == pytest.approx(data.output)


def test_a_lagging_servo_is_found_with_its_lags():
    rng = np.random.default_rng(1)
    u = rng.normal(size=(300, 2)) * [100.0, 900.0]
    data = data_of(u, 5.0 + 16.0 * u[:, 0] - 0.2 * u[:, 1])
    found = fit_servo_lag(data)
    assert (found.constant, found.per_velocity, found.per_acceleration) == pytest.approx((5.0, 16.0, -0.2))
    assert (found.lags, found.parameters) == (0, 3)


def test_a_free_run_that_grows_beyond_all_numbers_is_infinitely_wrong():
    data = second_order(5000)
    assert free_run_rms(arx(feedback=[1.9, 0.2]), data) == np.inf
    assert np.isnan(free_run_rms(Held(), data.part(0, 1)))


def test_what_does_not_fit_is_refused():
    data = second_order(30)
    with pytest.raises(ArgumentError, match="samples"):
        fit_arx(data.part(0, 6), 2, 2)
    with pytest.raises(ArgumentError, match="ARX"):
        choose_arx(data.part(0, 3), data.part(3, 30))
    with pytest.raises(ArgumentError, match="a row for each of 2 inputs"):
        arx(forward=[[0.1]])
    with pytest.raises(ArgumentError, match="finite"):
        arx(constant=np.inf)
    with pytest.raises(ArgumentError, match="velocity and acceleration"):
        ServoLag(names=("command",), period_s=1e-3, unit="um")
    other = Sequences(inputs=data.inputs, output=data.output, names=data.names, period_s=2e-3)
    with pytest.raises(ArgumentError, match="period_s"):
        arx().free_run(other)
    volts = Sequences(inputs=data.inputs, output=data.output, names=data.names, period_s=1e-3, unit="V")
    with pytest.raises(ArgumentError, match="unit"):
        arx().free_run(volts)
