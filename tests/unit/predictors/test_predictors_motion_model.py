"""A NARX network as the PC's model: its steps are those of the network, and a corrected axis follows it."""

import numpy as np
import pytest

from rtec.axis import Encoder, Servo
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.machine import TRACE_COLUMNS, Machine, run_machine, straight_pass
from rtec.predictors.binding import bound
from rtec.predictors.motion_file import KnownMotion, head_of
from rtec.predictors.motion_model import MotionModel
from rtec.predictors.narx import Narx, NarxShape
from rtec.predictors.step_model import StepModel
from rtec.requester.settings import HandshakeSettings
from tests.machines import LIMITS, box_of

PERIOD_S = 0.01
NAMES = ("acceleration", "velocity")


def network(**changes):
    rng = np.random.default_rng(4)
    shape = NarxShape(channels=2, neurons=3, input_delays=(0, 2), feedback_delays=(1, 3))
    weights = 0.2 * rng.standard_normal(shape.weights)
    given = {
        "shape": shape,
        "names": NAMES,
        "period_s": PERIOD_S,
        "middle": [0.0, 0.0, 1.0],
        "half": [900.0, 50.0, 8.0],
    }
    return Narx(**(given | {"weights": weights} | changes))


def model(narx, observe="deviation", **more):
    return MotionModel(known=KnownMotion(model=narx, head=head_of(narx, observe), name="NARX"), **more)


def asked(made, times_s, speeds):
    """Call the compiled function as the PC does."""
    _, numbers, _, _, _, inputs, memory, _, sd, *_ = bound(made)
    found = []
    for inputs[1], inputs[0] in zip(times_s, speeds, strict=True):
        found.append(made.function(numbers, inputs, memory, sd))
    return np.array(found)


def test_it_steps_as_the_network_itself_does():
    narx = network()
    times = PERIOD_S * np.arange(200)
    speeds = 30.0 * np.sin(3.0 * times)
    state = narx.at_rest([0.0, speeds[0]], 0.0)
    expected = [0.0]
    for k in range(1, 200):
        expected.append(1e-3 * narx.step(state, [(speeds[k] - speeds[k - 1]) / PERIOD_S, speeds[k]]))
    assert asked(model(narx), times, speeds) == pytest.approx(np.array(expected), abs=1e-12)
    assert np.ptp(expected) > 1e-3


def test_a_reading_too_many_changes_nothing_and_missed_ones_are_made_up_for():
    narx = network()
    times = PERIOD_S * np.arange(60)
    speeds = 20.0 * times  # a constant acceleration: what lies between two readings is known
    every = asked(model(narx), times, speeds)
    twice = asked(model(narx), np.sort([*times, *(times + 1e-4)]), np.sort([*speeds, *speeds]))
    assert twice[1::2] == pytest.approx(every, abs=1e-6)
    third = asked(model(narx), times[::3], speeds[::3])
    assert third == pytest.approx(every[::3], abs=1e-12)


def test_a_corrected_axis_goes_where_the_network_says_it_errs():
    shape = NarxShape(channels=1, neurons=1, input_delays=(0,), feedback_delays=(1,))
    # in the end 2 x 1.25 x 8 um at 50 mm/s: 8 um at 20 mm/s
    low_pass = [0.0, 0.0, 0.0, 0.0, 0.0, 1.25, 0.5]
    narx = Narx(
        shape=shape, names=("velocity",), period_s=PERIOD_S, middle=[0.0, 0.0], half=[50.0, 8.0], weights=low_pass
    )
    there = straight_pass([60.0], 20.0, LIMITS, dwell_s=1.0)
    machine = Machine(
        injector=box_of(Design.B), model=model(narx), encoder=Encoder(), servo=Servo(),
        handshake=HandshakeSettings(pc_period_ps=10**10),
    )  # fmt: skip
    result = run_machine(machine, there, trace_every=100)
    time_s, done = (result.trace[:, TRACE_COLUMNS.index(name)] for name in ("time_s", "completed"))
    count_mm = machine.encoder.count_mm
    steady = done[(time_s > 2.0) & (time_s < 3.0)] * count_mm
    assert 1e3 * steady == pytest.approx(8.0, abs=1.1)
    assert done[-1] == 0
    assert result.audit


def test_a_model_that_is_unsure_is_followed_to_the_near_end_of_its_interval():
    def far_off(numbers, inputs, memory, sd):
        sd[0] = numbers[1]
        return numbers[0]

    def done(error_mm, sd_mm):
        guess = StepModel(function=far_off, numbers=[error_mm, sd_mm])
        machine = Machine(injector=box_of(Design.B), model=guess)
        result = run_machine(machine, straight_pass([5.0], 20.0, LIMITS))
        return result.insertions.completed * machine.encoder.count_mm

    assert done(0.020, 0.0) == pytest.approx(0.020, abs=1e-3)
    assert done(0.020, 0.005) == pytest.approx(0.020 - 1.645 * 0.005, abs=1e-3)
    assert done(-0.020, 0.020) == 0.0


def test_what_the_pc_cannot_be_given():
    with pytest.raises(ArgumentError, match="one of the deviation"):
        model(network(), observe="following_error")
    with pytest.raises(ArgumentError, match="with the input current"):
        model(network(names=("current", "velocity")))
    assert model(network()).ranges["velocity"] == pytest.approx((-52.0, 52.0))
