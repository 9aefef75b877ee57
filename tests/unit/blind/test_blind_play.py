"""The game's measurements: what is hidden comes out as strong as it should, and by the physics that it claims."""

import functools

import numpy as np
import pytest

from rtec.blind.game import play
from rtec.blind.noise import Noise
from rtec.blind.plan import PLANS
from rtec.blind.scenario import INSIDE, OF_HEAT, OUTSIDE, Scenario, unfit
from rtec.errors import ArgumentError

SIGMA_MM = PLANS["base"].sigma_um * 1e-3


def deviation(measurement):
    return measurement.columns["actual"].values - measurement.columns["target"].values


@functools.cache
def nothing_hidden(plan, seed):
    return deviation(play(Scenario(plan=PLANS[plan]), seed)[0])


def added(names, plan="base", seed=11, strength=3.0):
    """Return what hiding ``names`` adds to the readings: the same game with and without."""
    with_it, secret = play(Scenario(names=names, strength_sigma=strength, plan=PLANS[plan]), seed)
    return with_it, deviation(with_it) - nothing_hidden(plan, seed), secret


CASES = [
    (name, "temperature" if name in OF_HEAT else "base")
    for name in INSIDE + OUTSIDE
    if unfit(name, PLANS["temperature" if name in OF_HEAT else "base"]) is None
]


@pytest.mark.one_in(3)
@pytest.mark.parametrize(("name", "plan"), CASES)
def test_an_effect_is_as_strong_as_its_secret_says(name, plan):
    measurement, what, secret = added((name,), plan)
    assert measurement.rows == 210
    assert secret.names == (name,)
    assert np.std(what) / SIGMA_MM == pytest.approx(secret.effects[0].rms_sigma, rel=0.02)
    assert secret.effects[0].rms_sigma == pytest.approx(3.0, rel=0.04)  # lost counts are whole


def test_nothing_hidden_leaves_noise_of_the_plan():
    readings = np.concatenate([deviation(play(Scenario(), seed)[0]) for seed in range(5)])
    # 1050 readings: 5 % is above two standard errors
    assert np.std(readings) == pytest.approx(SIGMA_MM, rel=0.05)
    assert abs(np.mean(readings)) < 0.1 * SIGMA_MM


def test_correlated_noise_is_correlated_from_reading_to_reading():
    pairs = [deviation(play(Scenario(noise=Noise.CORRELATED), seed)[0]) for seed in range(8)]
    first = np.concatenate([d[:-1] for d in pairs])
    second = np.concatenate([d[1:] for d in pairs])
    assert np.corrcoef(first, second)[0, 1] == pytest.approx(0.9, abs=0.05)
    assert np.sqrt(np.mean(np.square(pairs))) == pytest.approx(SIGMA_MM, rel=0.25)  # some 80 independent readings


def test_an_effect_that_the_plan_cannot_show_is_refused():
    with pytest.raises(ArgumentError, match="needs both directions"):
        Scenario(names=("backlash",), plan=PLANS["single_pass"])
    with pytest.raises(ArgumentError, match="did you mean 'backlash'"):
        Scenario(names=("backlach",))
