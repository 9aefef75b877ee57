import numpy as np
import pytest

import rtec
from rtec.effects import Conditions
from rtec.effects.curve import Curve, CurveShape


def conditions(**more):
    x = np.tile(np.linspace(0.0, 100.0, 21), 4)
    return Conditions(position=x, position_unit="mm", run=np.repeat([1, 2, 3, 4], 21), **more)


@rtec.effect(over="temperature")
def snap(temperature, *, at: rtec.Within(0, 1000, "degC")):
    "A joint that snaps at some temperature."
    return np.where(temperature > at, 1.0, 0.0)


def test_a_scan_finds_what_shows_in_a_small_part_of_the_bounds_only():
    warm = conditions(temperatures={"temperature": np.linspace(20.0, 24.0, 84)})
    places = [shape.at for shape in snap.shapes(warm)]
    assert len(places) >= 20
    assert min(places) < 20.5
    assert max(places) > 23.5


def test_a_scan_ends_where_a_parameter_changes_nothing():
    steady = conditions(temperatures={"temperature": np.full(84, 20.0)})
    assert snap.untestable(steady) == "it is the same at every reading"


def test_a_curve_may_have_a_node_at_each_value_that_is_read_often():
    ladder = [len(shape.nodes) for shape in Curve("position").shapes(conditions())]
    assert max(ladder) == 21
    assert max(len(shape.nodes) for shape in Curve("time").shapes(conditions(time_s=np.arange(84.0)))) < 40


def test_a_curve_over_a_phase_is_a_form_of_few_nodes():
    found = Curve("phase_of_pitch").shapes(conditions(screw_pitch=np.pi))
    assert max(len(shape.nodes) for shape in found) == 12


def test_the_run_has_a_node_each():
    found = Curve("position*run").shapes(conditions())
    assert {shape.nodes_across for shape in found} == {(1.0, 2.0, 3.0, 4.0)}


@pytest.mark.parametrize("by_direction", [False, True])
def test_the_height_of_a_curve_is_that_of_its_values(by_direction):
    c = conditions(direction=np.tile(np.repeat([1.0, -1.0], 21), 2))
    shape = CurveShape("position", by_direction=by_direction, nodes=tuple(np.linspace(0.0, 100.0, 21).tolist()))
    amplitudes = np.random.default_rng(0).normal(size=42 if by_direction else 21)
    values = Curve("position").contribution(c, shape, amplitudes)
    units = type("Units", (), {"shown": ("um", 1.0)})
    assert Curve("position").summary(shape, amplitudes, units)[1][1] == pytest.approx(np.ptp(values))
