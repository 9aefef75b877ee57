"""What happens after a reversal: spikes against a differential equation, and which name a curve has."""

import numpy as np
import pytest

from rtec.effects import Conditions, ReversalSpike, SpikeShape, Windup, WindupShape, distance_since_reversal


def out_and_back(steps=60, span=300.0, turns=2):
    one = np.concatenate([np.linspace(0.0, span, steps), np.linspace(span, 0.0, steps)])
    position = np.tile(one, turns)
    direction = np.tile(np.repeat([1.0, -1.0], steps), turns)
    run = np.ones(position.size, dtype=np.int64)
    return Conditions(
        position=position,
        position_unit="mm",
        run=run,
        direction=direction,
        since_reversal=distance_since_reversal(position, direction, run),
    )


def test_a_spike_dies_away_along_the_way():
    """z' = -z / distance over the way, set to the direction at each reversal; integrated in small steps."""
    c, distance = out_and_back(), 20.0
    expected, state, begin = np.empty(c.rows), 0.0, 0.0
    for i in range(c.rows):
        if i == 0 or c.direction[i] != c.direction[i - 1]:
            state = c.direction[i]
        else:
            for _ in range(200):
                state -= state / distance * abs(c.position[i] - begin) / 200
        begin = c.position[i]
        expected[i] = state
    found = ReversalSpike().contribution(c, SpikeShape(distance), [-0.02])
    assert found == pytest.approx(-0.01 * expected, abs=2e-5)


def test_a_spike_is_a_backlash_less_a_wind_up():
    c = out_and_back()
    whole = ReversalSpike().columns(c, SpikeShape(15.0)) + Windup().columns(c, WindupShape(15.0))
    assert whole[:, 0] == pytest.approx(c.direction / 2)


@pytest.mark.parametrize(
    ("effect", "shape", "size", "beside", "says"),
    [
        (ReversalSpike(), SpikeShape(15.0), -0.004, {"backlash": [-0.02]}, None),
        (ReversalSpike(), SpikeShape(15.0), 0.004, {"backlash": [-0.02]}, "beside this backlash it is a wind-up"),
        (ReversalSpike(), SpikeShape(15.0), 0.004, {"backlash_map": [-0.02, -0.01]}, "it is a wind-up"),
        (ReversalSpike(), SpikeShape(15.0), 0.004, {"scale": [-0.02]}, None),
        (ReversalSpike(), SpikeShape(15.0), -0.004, {"windup": [-0.02]}, "beside a wind-up it is a backlash"),
        (Windup(), WindupShape(15.0), -0.004, {"backlash": [-0.02]}, None),
        (Windup(), WindupShape(15.0), 0.004, {"backlash": [-0.02]}, "it is a reversal spike"),
        (Windup(), WindupShape(15.0), 0.004, {"reversal_spike": [0.02]}, "beside a reversal spike it is a backlash"),
    ],
)
def test_one_curve_has_one_name(effect, shape, size, beside, says):
    others = {name: np.array(values) for name, values in beside.items()}
    why = effect.misnamed(shape, np.array([size]), others)
    assert why is None if says is None else says in why


def test_a_spike_needs_points_behind_the_reversal():
    sparse = out_and_back(steps=6)
    assert "distances within" in ReversalSpike().untestable(sparse)
    assert ReversalSpike().shapes(out_and_back(steps=3, turns=1)) == []
    assert ReversalSpike().untestable(out_and_back()) is None
    (free,) = ReversalSpike().tunables(out_and_back(), SpikeShape(20.0))
    assert (free.low, free.high) == pytest.approx((20.0 / 1.5, 30.0))
