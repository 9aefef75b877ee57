"""The model of a warm axis: a cold table and models of heat at its ends, compiled against the parts by themselves."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors import BidirectionalTable
from rtec.predictors.binding import bound
from rtec.predictors.warm.features import Feature
from rtec.predictors.warm.kinds import REGRESSORS
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.warm_axis import AXIS_KERNELS, WarmAxis
from rtec.predictors.warm.warm_model import WarmModel

COLD = BidirectionalTable(
    forward_positions_mm=[0.0, 100.0, 300.0], forward_errors_mm=[0.0, 0.010, -0.004],
    reverse_positions_mm=[0.0, 300.0], reverse_errors_mm=[0.002, 0.012],
)  # fmt: skip
FEATURES = (
    Feature(of="temperature_nut"), Feature(of="temperature_bed", lag_s=400.0),
    Feature(of="spindle_speed", lag_s=90.0, heat=True),
)  # fmt: skip
AT_MM = (50.0, 250.0)
HEAT = ("temperature_nut", "temperature_bed", "spindle_speed")


def model(slopes, **more):
    regressor = Linear(centre=[20.0, 21.0, 1.0], intercept=1.5, slopes=slopes)
    return WarmModel(features=FEATURES, regressor=regressor, observe="z", unit="um", **more)


START, END = model([2.0, -1.0, 0.5]), model([-3.0, 2.0, 4.0], sign=-1)


def log(rows=80):
    rng = np.random.default_rng(3)
    time_s = np.cumsum(rng.uniform(1.0, 60.0, rows))
    degc = 20.0 + np.cumsum(rng.normal(0.0, 0.4, (2, rows)), axis=1)
    rpm = np.repeat(rng.uniform(0.0, 6000.0, rows // 8), 8)
    return time_s, {"temperature_nut": degc[0], "temperature_bed": degc[1], "spindle_speed": rpm}


def asked(axis, time_s, inputs, position_mm, direction):
    """Return what the compiled function says at each row, in the order of its inputs."""
    numbers, memory, sd = axis.numbers.copy(), axis.memory.copy(), np.zeros(1)
    columns = {"time": time_s, "position": position_mm, "direction": direction, **inputs}
    rows = np.stack([columns[name] for name in axis.inputs], axis=1)
    return np.array([axis.function(numbers, row.copy(), memory, sd) for row in rows])


def test_one_model_adds_the_same_everywhere():
    time_s, inputs = log()
    position, direction = np.linspace(-20.0, 320.0, time_s.size), np.where(np.arange(time_s.size) % 3, 1.0, -1.0)
    axis = WarmAxis(cold=COLD, heat=[START])
    expected = COLD.error_mm(position, direction) + 1e-3 * START.predict(time_s, inputs)[0]
    assert asked(axis, time_s, inputs, position, direction) == pytest.approx(expected, abs=1e-12)


def test_two_models_lie_on_a_line_between_and_beyond_their_positions():
    time_s, inputs = log()
    position, direction = np.linspace(-20.0, 320.0, time_s.size), np.ones(time_s.size)
    axis = WarmAxis(cold=COLD, heat=[START, END], at_mm=AT_MM)
    first, second = 1e-3 * START.predict(time_s, inputs)[0], -1e-3 * END.predict(time_s, inputs)[0]
    share = (position - AT_MM[0]) / (AT_MM[1] - AT_MM[0])
    expected = COLD.error_mm(position, direction) + first + share * (second - first)
    assert asked(axis, time_s, inputs, position, direction) == pytest.approx(expected, abs=1e-12)


def test_where_the_table_was_measured_heat_adds_nothing():
    reference = {"temperature_nut": 23.0, "temperature_bed": 18.5, "spindle_speed": 0.0}
    axis = WarmAxis(cold=COLD, heat=[START, END], at_mm=AT_MM, reference=reference)
    time_s = np.array([0.0, 100.0, 9000.0])
    inputs = {name: np.full(3, value) for name, value in reference.items()}
    position = np.array([10.0, 150.0, 290.0])
    found = asked(axis, time_s, inputs, position, np.ones(3))
    assert found == pytest.approx(COLD.error_mm(position, np.ones(3)), abs=1e-12)


def test_its_ranges_are_those_that_both_models_know():
    axis = WarmAxis(
        cold=COLD,
        heat=[
            model([1.0, 1.0, 1.0], ranges={"temperature_nut": (18.0, 30.0)}),
            model([1.0, 1.0, 1.0], ranges={"temperature_nut": (19.0, 33.0), "spindle_speed": (0.0, 6e3)}),
        ],
        at_mm=AT_MM,
    )
    assert dict(axis.ranges) == {"temperature_nut": (19.0, 30.0), "spindle_speed": (0.0, 6e3)}
    _, _, wanted, low, high, *_ = bound(axis, HEAT)
    assert [(low[k], high[k]) for k in (3, 5)] == [(19.0, 30.0), (0.0, 6e3)]
    assert wanted.size == len(axis.inputs)


def test_every_kind_of_regressor_has_a_kernel():
    assert set(AXIS_KERNELS) == set(REGRESSORS)


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"heat": []}, "one, or two"),
        ({"heat": [START, END]}, "two positions"),
        ({"heat": [START], "at_mm": AT_MM}, "two positions"),
        ({"heat": [START, END], "at_mm": (5.0, 5.0)}, "two positions"),
        ({"heat": [START, WarmModel(features=FEATURES[:1], observe="z", regressor=Linear(
            centre=[20.0], intercept=0.0, slopes=[1.0]))], "at_mm": AT_MM}, "fitted alike"),
    ],
)  # fmt: skip
def test_models_that_do_not_go_together_are_refused(parts, says):
    with pytest.raises(ArgumentError, match=says):
        WarmAxis(cold=COLD, **parts)
