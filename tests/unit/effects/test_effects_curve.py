"""Curves learned of one quantity or two: their nodes, and what they report."""

import numpy as np
import pytest

from rtec.effects import Conditions
from rtec.effects.curve import Curve, CurveShape


def conditions(**more):
    x = np.tile(np.linspace(0.0, 100.0, 21), 4)
    return Conditions(position=x, position_unit="mm", run=np.repeat([1, 2, 3, 4], 21), **more)


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
