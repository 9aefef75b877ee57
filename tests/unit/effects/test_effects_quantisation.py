"""Rounding as a recording does it."""

import numpy as np
import pytest

from rtec.effects import Conditions, Units
from rtec.effects.quantisation import Quantisation, QuantisationShape, rounding_error

Q = Quantisation()


def test_rounding_is_that_of_a_counter():
    values = np.array([0.0121, -0.0029, 0.0105001, 5.0])
    whole = [0.012, -0.003, 0.011, 5.0]
    assert values + rounding_error(values, 0.001) == pytest.approx(whole)


def test_an_axis_that_rests_at_whole_counts_makes_a_sawtooth():
    targets = np.linspace(0.0, 0.05, 501)
    counts = np.array([int(np.floor(target / 0.004 + 0.5)) for target in targets])
    c = Conditions(position=targets, position_unit="mm", run=np.ones(501, dtype=np.int64))
    inside = np.abs(targets / 0.004 % 1 - 0.5) > 1e-6
    added = Q.contribution(c, QuantisationShape(0.004), [1.0])
    assert added[inside] == pytest.approx((counts * 0.004 - targets)[inside], abs=1e-12)


def test_steps_to_try_are_round_and_seen_by_the_targets():
    targets = np.arange(21) * 19.7031
    c = Conditions(position=targets, position_unit="mm", run=np.ones(21, dtype=np.int64))
    steps = [shape.step for shape in Q.shapes(c)]
    assert any(step == pytest.approx(0.02) for step in steps)
    assert max(steps) <= 19.7031 / 2
    for step in steps:
        assert np.std(Q.columns(c, QuantisationShape(step))) > 0.05 * step
    whole = Conditions(position=np.arange(0.0, 400.0, 20.0), position_unit="mm", run=np.ones(20, dtype=np.int64))
    assert [shape.step for shape in Q.shapes(whole) if shape.step < 10.0 and 20.0 % shape.step < 1e-9] == []


def test_units_of_the_share():
    (share,) = Q.amplitudes(QuantisationShape(), Units("mm", "mm", "s"))
    assert (share.name, share.unit, share.factor) == ("share", "", 1.0)
    assert Q.summary(QuantisationShape(0.001), [1.0], Units("mm", "mm", "s"))[0] == ("step", 0.001, "mm")
