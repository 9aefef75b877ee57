"""Forces that depend on position or load: against mechanics, and scipy's splines."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from rtec.effects import BuildUpShape, Conditions, MapShape, Shape, Units
from rtec.effects.force_map import ForceMap
from rtec.effects.force_offset import ForceOffset
from rtec.effects.gravity import Gravity, GravityShape
from rtec.effects.load_friction import LoadFriction


def at(position, unit="mm", **more):
    return Conditions(position=position, position_unit=unit, run=np.ones(position.size, dtype=np.int64), **more)


def test_the_torque_of_a_weight_is_the_slope_of_its_energy():
    """An arm of 0.4 m with 3 kg that hangs at 25 deg, and a second joint with 2 kg that turns by the same angle."""
    q = np.linspace(-170.0, 170.0, 2001)
    arm, whole = np.radians(q - 25.0), np.radians(q)
    energy = -9.81 * (3.0 * 0.4 * np.cos(arm) + 2.0 * 0.3 * np.cos(2.0 * whole))
    torque = np.gradient(energy, whole)
    first = 9.81 * 1.2
    amplitudes = [first * np.cos(np.radians(25.0)), -first * np.sin(np.radians(25.0)), 2.0 * 9.81 * 0.6, 0.0]
    found = Gravity().contribution(at(q, "deg"), GravityShape(2), amplitudes)
    assert found[1:-1] == pytest.approx(torque[1:-1], abs=1e-3)
    shown = {
        name: value for name, value, _ in Gravity().summary(GravityShape(2), amplitudes, Units("nm", "deg", "s"))
    }
    assert shown["amplitude_1"] == pytest.approx(first)
    assert shown["phase_1"] == pytest.approx(-25.0), "sin(angle - 25 deg) is zero where the arm hangs"


def test_a_weight_on_a_linear_axis_is_a_constant():
    """A slide of 5 kg on a slope of 30 deg: the drive holds the part of its weight along the way, wherever it is."""
    c = at(np.linspace(0.0, 300.0, 7))
    (shape,) = Gravity().shapes(c)
    held = 5.0 * 9.81 * np.sin(np.radians(30.0))
    energy = held * 1e-3 * c.position
    assert Gravity().contribution(c, shape, [held]) == pytest.approx(np.gradient(energy, 1e-3 * c.position))
    assert Gravity().summary(shape, [held], Units("n", "mm", "s")) == (("weight", held, "N"),)
    assert np.array_equal(Gravity().columns(c, shape), ForceOffset().columns(c, Shape()))


@pytest.mark.parametrize(
    ("conditions", "why"),
    [
        (at(np.linspace(0.0, 100.0, 9)), None),
        (at(np.linspace(0.0, 100.0, 9), "s"), "no angles"),
        (at(np.linspace(0.0, 4.0, 9), "deg"), "the axis turns by 4 deg only: 5 needed"),
        (at(np.linspace(0.0, 90.0, 9), "deg"), None),
    ],
)
def test_a_weight_shows_where_the_axis_turns(conditions, why):
    assert Gravity().untestable(conditions) == why


def test_a_second_wave_needs_a_wide_range():
    narrow, wide = at(np.linspace(0.0, 150.0, 9), "deg"), at(np.linspace(0.0, 300.0, 9), "deg")
    assert [shape.harmonics for shape in Gravity().variants(narrow, GravityShape())] == [1]
    assert [shape.harmonics for shape in Gravity().variants(wide, GravityShape())] == [1, 2]
    assert (Gravity().tried(narrow, GravityShape()), Gravity().tried(wide, GravityShape())) == (1.0, 2.0)


def test_a_map_of_forces_is_a_natural_spline():
    nodes, values = (0.0, 30.0, 60.0, 100.0), [5.0, -2.0, 1.0, 4.0]
    x = np.linspace(0.0, 100.0, 41)
    expected = CubicSpline(nodes, values, bc_type="natural")(x)
    assert ForceMap().contribution(at(x), MapShape(nodes), values) == pytest.approx(expected)


def test_over_one_turn_a_smooth_force_comes_back():
    c = at(np.linspace(0.0, 350.0, 36), "deg", revolution=360.0)
    assert "comes back every turn (gravity, cogging)" in ForceMap().untestable(c)
    assert ForceMap().untestable(at(np.arange(20.0), "s")) == "no positions: time stands for them"


def test_friction_is_a_share_of_the_load_that_presses():
    load, way = np.array([10.0, 10.0, 40.0, 40.0, 40.0]), np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    c = at(np.zeros(5), load=load, direction=way)
    assert LoadFriction().contribution(c, BuildUpShape(), [0.2]).tolist() == [2.0, -2.0, 8.0, -8.0, 0.0]
    assert LoadFriction().amplitudes(BuildUpShape(), Units("n", "mm", "s", "kg"))[0].unit == "N/kg"
    assert LoadFriction().untestable(c) is None
    assert LoadFriction().untestable(at(np.zeros(5), direction=way)) == "no load column"
    assert LoadFriction().untestable(at(np.zeros(5), load=load, direction=np.ones(5))) == "one direction only"
    steady = at(np.zeros(5), load=np.linspace(40.0, 41.0, 5), direction=way)
    assert LoadFriction().untestable(steady) == "the load changes by 1 of 41 only"
