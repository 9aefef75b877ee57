"""The drive under its controller: beside an integrator of scipy, and found again from its motion."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rtec.errors import ArgumentError
from rtec.predictors.drive_model import MOTION, DriveModel
from rtec.predictors.fitting.drive_model import fit_drive, goes_both_ways
from rtec.predictors.sequences import Sequences

PERIOD_S = 2e-3
TRUTH = {
    "stiffness": 9000.0, "damping": 120.0, "velocity_forward": 40.0, "acceleration_forward": 0.3, "coulomb": 250.0,
    "width": 3.0, "offset": 40.0, "asymmetry": 2.0,
}  # fmt: skip
NAMES = (*MOTION, "voltage")
GAIN = 300.0


def command(t):
    """Velocity and acceleration of a path that stops and turns, in mm/s."""
    v = 60.0 * np.sin(1.3 * t) + 40.0 * np.sin(4.1 * t + 1.0)
    return v, 78.0 * np.cos(1.3 * t) + 164.0 * np.cos(4.1 * t + 1.0)


def motion(samples, seed=0, begin_s=0.0):
    """Inputs at the samples; a voltage that stays from one to the next."""
    t = begin_s + PERIOD_S * np.arange(samples)
    volt = np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, samples // 50 + 1), 50)[:samples]
    return t, np.stack([*command(t), volt], axis=1)


def integrated(t, inputs):
    """The following error in um, step by step with an integrator that knows nothing of the kernel."""
    p = TRUTH

    def slope(at, state, volt):
        error, speed = state
        v, a = command(at)
        force = p["stiffness"] * error - p["damping"] * speed + p["velocity_forward"] * v
        force += p["acceleration_forward"] * a - p["coulomb"] * np.tanh(speed / p["width"])
        return [v - speed, force - p["offset"] - p["asymmetry"] * abs(speed) + GAIN * volt]

    state, found = [0.5, 0.0], [500.0]
    for k in range(t.size - 1):
        state = solve_ivp(slope, (t[k], t[k + 1]), state, args=(inputs[k, 2],), rtol=1e-7, atol=1e-9).y[:, -1]
        found.append(1e3 * state[0])
    return np.array(found)


@pytest.fixture(scope="module")
def data():
    t, inputs = motion(1500)
    return Sequences(inputs=inputs, output=integrated(t, inputs), names=NAMES, period_s=PERIOD_S)


def drive(**changed):
    known = {"names": NAMES, "period_s": PERIOD_S, "unit": "um", "output_per_error": 1e3, "gains": (GAIN,)}
    return DriveModel(**(known | TRUTH | changed))


def test_a_free_run_is_that_of_another_integrator(data):
    left = drive().free_run(data) - data.output
    assert np.abs(left[:3]).max() == 0.0
    # it starts from three samples, whose differences are its first speed; after 0.2 s that is forgotten
    assert np.abs(left[200:]).max() < 0.05
    assert np.std(data.output) > 300.0


def test_each_run_starts_from_its_own_samples(data):
    twice = Sequences(
        inputs=np.concatenate([data.inputs[:300], data.inputs[:300]]),
        output=np.concatenate([data.output[:300], data.output[:300]]),
        names=NAMES,
        period_s=PERIOD_S,
        starts=(0, 300),
    )
    found = drive().free_run(twice)
    assert np.array_equal(found[:300], found[300:])


def test_a_deviation_is_the_same_with_the_other_sign(data):
    turned = Sequences(inputs=data.inputs, output=-data.output, names=NAMES, period_s=PERIOD_S)
    found = drive(output_per_error=-1e3).free_run(turned)
    assert found == pytest.approx(-drive().free_run(data))


def test_the_drive_is_found_again_from_its_motion(data):
    found = fit_drive(data, output_per_error=1e3)
    assert np.sqrt(np.mean((found.free_run(data) - data.output) ** 2)) < 1.0
    for name, value in TRUTH.items():
        assert getattr(found, name) == pytest.approx(value, rel=0.1, abs=0.02 if value < 1.0 else 0.0), name
    assert found.gains[0] == pytest.approx(GAIN, rel=0.02)
    again = fit_drive(data, output_per_error=1e3, start=found)
    assert again.stiffness == pytest.approx(found.stiffness, rel=1e-2)


def test_friction_that_was_seen_one_way_is_taken_for_the_other_way():
    """Offset and Coulomb friction are the same there; a fit that shared them out would be far off behind a turn."""
    t, inputs = motion(700, begin_s=0.2)
    inputs[:, :2] += [[130.0, 0.0]]
    symmetric = drive(offset=0.0, asymmetry=0.0)
    start = np.zeros(700)
    one_way = Sequences(inputs=inputs, output=start, names=NAMES, period_s=PERIOD_S)
    assert not goes_both_ways(one_way)
    one_way = Sequences(inputs=inputs, output=symmetric.free_run(one_way), names=NAMES, period_s=PERIOD_S)
    found = fit_drive(one_way, output_per_error=1e3)
    assert (found.offset, found.asymmetry) == pytest.approx((0.0, 0.0), abs=0.1)
    turned = Sequences(inputs=-inputs, output=start, names=NAMES, period_s=PERIOD_S)
    assert found.free_run(turned)[50:] == pytest.approx(symmetric.free_run(turned)[50:], abs=5.0)


def test_a_drive_that_diverges_is_no_number_from_there_on(data):
    found = drive(stiffness=-9000.0).free_run(data)
    assert np.isnan(found[-1])
    assert not np.isnan(found[:10]).any()


def test_what_is_no_drive_is_refused(data):
    with pytest.raises(ArgumentError, match="velocity and acceleration"):
        drive(names=("command",), gains=())
    with pytest.raises(ArgumentError, match="gains"):
        drive(gains=())
    with pytest.raises(ArgumentError, match="width"):
        drive(width=0.0)
    with pytest.raises(ArgumentError, match="finite"):
        drive(coulomb=np.nan)
    level = Sequences(inputs=data.inputs[:, :1], output=data.output, names=("command",), period_s=PERIOD_S)
    with pytest.raises(ArgumentError, match="inputs"):
        drive().free_run(level)
    with pytest.raises(ArgumentError, match="commanded velocity"):
        fit_drive(level, output_per_error=1e3)
    with pytest.raises(ArgumentError, match="samples"):
        fit_drive(data.part(0, 9), output_per_error=1e3)
