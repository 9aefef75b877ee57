"""Models of one's own: what is checked before they run, and how they are compiled."""

import math

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors import NoError, StepModel
from rtec.predictors._kernels import SD
from rtec.predictors.binding import bound, bound_curve, rests, sensor_names


def slope(numbers, inputs, memory, sd):
    return numbers[0] * inputs[0]


def words(numbers, inputs, memory, sd):
    return "much"


def not_compiled(numbers, inputs, memory, sd):
    return open("x").read() + numbers[0]


MODEL = StepModel(function=slope, inputs=("position",), numbers=[0.001])


def test_what_rests_with_the_axis():
    assert rests(NoError())
    assert rests(MODEL)
    assert not rests(StepModel(function=slope, inputs=("time",), numbers=[1.0]))
    assert not rests(StepModel(function=slope, inputs=("position",), numbers=[1.0], memory=[0.0]))


def test_what_is_bound_has_room_of_its_own():
    one, other = bound(MODEL), bound(MODEL)
    assert one[5] is not other[5]
    assert one[6] is not other[6]
    assert np.isnan(one[SD]).all()
    assert one[SD] is not other[SD]
    assert one[-1] is not other[-1]


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"inputs": ()}, "one or more sensors"),
        ({"inputs": ("position", "position")}, "each once"),
        ({"numbers": [1.0, math.nan]}, "finite numbers"),
        ({"numbers": "many"}, "a list of numbers"),
        ({"memory": [math.inf]}, "finite numbers"),
        ({"ranges": {"velocity": (0.0, 1.0)}}, "velocity is not valid"),
        ({"range_mm": (5.0, 5.0)}, "a length above 0"),
        ({"ranges": {"position": (1.0, 5.0)}}, "positions have range_mm"),
        ({"ranges": {"time": (5.0, 1.0)}, "inputs": ("time",)}, "a length above 0"),
        ({"ranges": None}, "by the name of an input"),
        ({"range_mm": 5.0}, "its lower and its upper end"),
        ({"range_mm": ("a", "b")}, "its lower and its upper end"),
        ({"inputs": None}, "one or more sensors"),
        ({"inputs": (1, 2)}, "one or more sensors"),
        ({"function": 3}, "a function"),
    ],
)
def test_what_is_wrong_is_said_at_once(wrong, says):
    with pytest.raises(ArgumentError, match=says):
        StepModel(**({"function": slope, "inputs": ("position",)} | wrong))


@pytest.mark.parametrize(
    ("model", "says"),
    [
        (StepModel(function=words), "could not convert string to float"),
        (StepModel(function=not_compiled), "numba can compile"),
        (StepModel(function=lambda numbers: 0.0), "numba can compile"),
        (StepModel(function=math.sin), "numba can compile"),
        (StepModel(function=slope, inputs=("speed",)), "did you mean|what is sensed"),
        (StepModel(function=slope, inputs=("position_16",)), "what is sensed"),
        (StepModel(function=slope, inputs=("temperature_bed",)), "what is sensed"),
    ],
)
def test_what_cannot_be_bound_says_why(model, says):
    with pytest.raises(ArgumentError, match=says):
        bound(model)


def test_a_curve_is_of_position_and_direction_alone():
    assert bound_curve(NoError())[2].tolist() == [0, 1]
    for wrong in (MODEL, StepModel(function=slope, numbers=[1.0], memory=[0.0])):
        with pytest.raises(ArgumentError, match="of position and direction alone"):
            bound_curve(wrong)


@pytest.mark.parametrize("names", [["bed", "bed"], ["Bed"], [3], [""]])
def test_sensors_have_names_of_their_own(names):
    with pytest.raises(ArgumentError, match="temperatures"):
        sensor_names(names)


def test_only_positions_of_axes_that_are_there_are_known():
    other = StepModel(function=slope, inputs=("position_2",), numbers=[1.0])
    assert bound(other, axes=2)[2].tolist() == [5]
    with pytest.raises(ArgumentError, match="time, position_1; did you mean"):
        bound(other, axes=1)
