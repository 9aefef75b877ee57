"""Steps read off recorded values, and rounding as the recording did it."""

import numpy as np
import pytest

from rtec.effects import Conditions, Units
from rtec.effects._lattice import lattice_step
from rtec.effects.quantisation import Quantisation, QuantisationShape
from rtec.errors import ArgumentError

Q = Quantisation()


@pytest.mark.parametrize(
    "values, step",
    [
        ([0.012, -0.003, 0.021, 0.009], 0.003),
        ([0.2, 0.4, 1.0], 0.2),
        ([10.001, 10.002, 10.004, 9.998], 0.001),
        ([0.0, 1.0, 2.0, 2.0], 1.0),
        ([6.0, 10.0, 15.0], 1.0),
        ([1e-7, 3e-7, 8e-7], 1e-7),
        ([0.5, 1.5, 2.5, 3.5], 0.5),  # no lattice of 1: zero is not on it
        ([0.0, 360 / 8192, 720 / 8192 * 3], 360 / 8192),
        ([1e6, 1e6 + 1, 1e6 + 2], 1.0),
    ],
)
def test_the_largest_step(values, step):
    assert lattice_step(np.array(values)) == pytest.approx(step, rel=1e-12)


@pytest.mark.parametrize(
    "values", [[], [1.0], [1.0, 2.0, 1.0, 2.0], [0.0, 0.0], [np.nan, 1.0, 2.0], [np.inf, 0.0, 3.0]]
)
def test_less_than_three_values_have_no_step(values):
    assert lattice_step(np.array(values)) is None


def test_values_on_a_continuum_have_no_step():
    rng = np.random.default_rng(7)
    for size in (4, 30, 5000):
        assert lattice_step(rng.normal(size=size)) is None
        assert lattice_step(rng.normal(size=size) * 1e-9 + 400.0) is None


@pytest.mark.parametrize("step, span", [(0.0001, 400.0), (0.001, 0.1), (0.00001, 400.0), (360 / 2**20, 360.0)])
def test_rounded_noise_gives_its_step(step, span):
    rng = np.random.default_rng(8)
    values = np.round(rng.uniform(-span, span, 3000) / step) * step
    assert lattice_step(values) == pytest.approx(step, rel=1e-9)


def test_one_value_beside_the_lattice_breaks_it():
    values = np.arange(50) * 0.25
    assert lattice_step(values) == 0.25
    values[20] += 1e-5
    assert (lattice_step(values) or 0.0) < 0.25


def test_half_a_million_values_are_quick():
    values = np.round(np.random.default_rng(9).normal(size=500_000), 3)
    assert lattice_step(values) == 0.001


def test_rounding_is_that_of_a_counter():
    values = np.array([0.0121, -0.0029, 0.0105001, 5.0])
    whole = [0.012, -0.003, 0.011, 5.0]
    assert Q.rounded(values, 0.001) == pytest.approx(whole)
    assert np.abs(Q.rounded(np.linspace(-3, 3, 1000), 0.7) - np.linspace(-3, 3, 1000)).max() <= 0.35 + 1e-12


@pytest.mark.parametrize("step", [0.0, -1.0, np.nan, np.inf])
def test_a_step_that_is_none_is_refused(step):
    with pytest.raises(ArgumentError, match="finite number above 0"):
        Q.rounded(np.zeros(3), step)


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
