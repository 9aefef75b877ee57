"""Readings as a fit takes them: averages, places, and means over whole turns of the screw."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid

from rtec.errors import ArgumentError
from rtec.predictors.fitting.samples import Samples, means_over_turns, points_a_turn


def test_averages_are_those_of_loops_over_places():
    rng = np.random.default_rng(0)
    position = rng.choice([0.0, 2.0, 7.0, 7.5], 60)
    way, error = rng.choice([-1.0, 1.0], 60), rng.normal(0.0, 1e-3, 60)
    found = Samples(position_mm=position, direction=way, error_mm=error).averaged()
    expected = [
        (x, w, np.mean([e for p, v, e in zip(position, way, error, strict=True) if (p, v) == (x, w)]))
        for x in (0.0, 2.0, 7.0, 7.5)
        for w in (1.0, -1.0)
    ]
    assert_allclose(np.stack([found.position_mm, found.direction, found.error_mm], axis=1), expected, atol=1e-15)


def test_places_number_targets_along_the_axis():
    samples = Samples(position_mm=[5, 0, 5, 9, 0], direction=[1, 1, -1, 1, -1], error_mm=np.zeros(5))
    assert samples.place().tolist() == [1, 0, 1, 2, 0]


def test_means_over_turns_are_exact_for_straight_lines():
    x = np.array([0.0, 0.9, 2.2, 3.1, 4.4, 6.0, 7.7, 9.0, 10.5])
    y = np.array([0.0, 3.0, -1.0, 2.0, 5.0, 4.0, 4.5, 0.0, 1.0]) * 1e-3
    means = means_over_turns(Samples(position_mm=x, direction=np.ones(9), error_mm=y), 2.5)
    fine = np.linspace(0.0, 10.0, 400_001)
    curve = np.interp(fine, x, y)
    expected = [trapezoid(curve[n * 100_000 : (n + 1) * 100_000 + 1], dx=2.5e-5) / 2.5 for n in range(4)]
    assert_allclose(means.error_mm, expected, rtol=0, atol=1e-9)


def test_a_direction_with_less_than_two_turns_is_refused():
    short = Samples(position_mm=np.arange(10.0), direction=np.ones(10), error_mm=np.zeros(10))
    with pytest.raises(ArgumentError, match="9 mm in direction") as caught:
        means_over_turns(short, 5.0)
    assert "10 mm" in str(caught.value)
    assert means_over_turns(short, 4.5).rows == 2
    longer = np.concatenate([np.arange(20.0), [0.0, 4.0]])
    way = np.concatenate([np.ones(20), [-1.0, -1.0]])
    with pytest.raises(ArgumentError, match="direction -1"):
        means_over_turns(Samples(position_mm=longer, direction=way, error_mm=np.zeros(22)), 5.0)


def test_points_a_turn_are_counted_from_the_usual_distance():
    x = np.concatenate([np.arange(0.0, 10.0, 0.5), [30.0]])
    samples = Samples(position_mm=np.tile(x, 2), direction=np.repeat([1, -1], x.size), error_mm=np.zeros(2 * x.size))
    assert points_a_turn(samples, 6.0) == pytest.approx(12.0)
    assert points_a_turn(Samples(position_mm=[1, 1], direction=[1, -1], error_mm=[0, 0]), 6.0) == 0.0


@pytest.mark.parametrize(
    ("columns", "name"),
    [
        ({"direction": [1.0, 0.0]}, "direction, row 2"),
        ({"direction": [1.0, 1.0, 1.0]}, "direction"),
        ({"error_mm": [0.0, np.nan]}, "error_mm, row 2"),
        ({"position_mm": [np.inf, 1.0]}, "position_mm, row 1"),
    ],
)
def test_readings_that_cannot_be(columns, name):
    good = {"position_mm": [0.0, 1.0], "direction": [1.0, -1.0], "error_mm": [0.0, 0.0]}
    with pytest.raises(ArgumentError) as caught:
        Samples(**(good | columns))
    assert caught.value.name == name
