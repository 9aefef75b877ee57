"""The smallest effect that would be found, against simulated searches."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, covariance, measured, one_chain, whitened

from rtec.effects import Shape, effect_named
from rtec.inference.candidates import ERRORS, IN_TIME, minimum_detectable
from rtec.inference.colour import Colour
from rtec.inference.diagnose import diagnose
from rtec.inference.probes import Probe
from rtec.inference.rules import WORTH
from rtec.inference.scored import Judge
from rtec.inference.space import Space

CYCLIC = effect_named("cyclic")


def least_of(data, colour=None):
    """In units of the noise found."""
    judge = Judge(Space(data))
    model = judge.score([])
    if colour is not None:
        model = replace(model, colour=colour)
    sigma = np.sqrt(judge.fit(model).variance)
    return {name: value / sigma for name, value in minimum_detectable(judge, model).items()}


def found_of_eight(share):
    plan = {"runs": 4, "targets": 8, "timed": False}
    least = least_of(measured(**plan), Colour())["backlash"] * SIGMA
    error = lambda x, way, t, run: share * least * way
    return sum("backlash" in diagnose(measured(error, seed=k, **plan)).effects for k in range(8))


def test_searches_find_most_of_what_should_be_found_and_not_a_third_of_it():
    assert found_of_eight(1.5) >= 6
    assert found_of_eight(0.3) <= 1


def test_energy_price_and_margin_of_a_reversal_error():
    """Balanced readings: beside a constant all of its energy is new, RMS² n / sigma²."""
    data = measured(runs=4)
    judge = Judge(Space(data))
    price = np.log(len(judge.space.library)) + 0.5 * np.log(data.rows - 1)
    root = least_of(data, Colour())["backlash"] * np.sqrt(data.rows)
    assert 0.5 * (root - ERRORS) ** 2 - 0.5 * ERRORS**2 == pytest.approx(WORTH + price)


def test_every_testable_effect_has_one_and_no_other():
    data = measured(runs=4)
    judge = Judge(Space(data))
    found = least_of(data)
    assert set(found) == {effect.name for effect in judge.space.library if not isinstance(effect, Probe)}
    assert all(value > 0 for value in found.values())
    assert "thermal_growth" not in found


def test_the_least_favourable_shape_counts():
    """Beside correlated noise long waves need more than short ones: the energy by dense matrices says how much."""
    data = measured(runs=3, targets=24)
    shapes = CYCLIC.shapes(data.conditions)
    matrix = covariance(0.9, 0.1, one_chain(data.rows))
    constant = whitened(np.ones((1, data.rows)), matrix)[0]
    constant /= np.linalg.norm(constant)
    more = []
    for shape in shapes:
        raw = data.columns(CYCLIC, shape).T
        raw = raw - raw.mean(axis=1, keepdims=True)
        white = whitened(raw, matrix)
        energy = (white**2).sum() - ((white @ constant) ** 2).sum()
        more.append(float((raw**2).sum() / energy))
    assert max(more) > 1.5 * min(more)
    judge = Judge(Space(data))
    price = judge.price((CYCLIC, shapes[0])) + np.log(data.rows - 1)
    root = ERRORS + np.sqrt(ERRORS**2 + 2.0 * (WORTH + price))
    found = least_of(data, Colour(0.9, 0.1))["cyclic"]
    assert found == pytest.approx(root * np.sqrt(max(more) / data.rows), rel=1e-6)


def test_what_changes_in_time_needs_more_beside_slow_noise():
    data = measured()
    white, hardly = least_of(data, Colour()), least_of(data, Colour(1e-9, 0.5))
    assert hardly["scale"] == pytest.approx(white["scale"], rel=1e-6)
    assert hardly["drift"] == pytest.approx(IN_TIME * white["drift"], rel=1e-6)
    assert effect_named("drift").columns(data.conditions, Shape()).shape[1] == 1


def test_of_a_log_amplitudes_are_weighed_alike_but_the_noise_is_that_of_its_colour():
    """People get the amplitudes of plain least squares; how small one may be its noise decides."""
    still = measured(lambda x, way, t, run: 0.003 * np.cumsum(np.sin(np.arange(x.size) ** 2.0)) / 20.0, runs=6)
    moving = replace(still, conditions=replace(still.conditions, moving=True))
    judge = Judge(Space(moving))
    model = replace(judge.score([]), colour=Colour(0.9, 0.3))
    assert minimum_detectable(judge, model)["backlash"] > 0.0
    white, slow = judge.fit(model).variance, judge.fit(model, model.colour).variance
    assert white != pytest.approx(slow, rel=0.02)
    scale = np.sqrt(slow)
    least = minimum_detectable(judge, model)["scale"] / scale
    slope = moving.conditions.position - moving.conditions.position.mean()
    back = judge.space.view(model.colour).whitening.of(slope[None, :])
    ones = judge.space.view(model.colour).constant[0]
    new = back[0] - (back[0] @ ones) * ones
    root = least * np.sqrt(new @ new / (slope @ slope))
    price = np.log(len(judge.space.library)) + 0.5 * np.log(moving.rows - 1)
    expected = (ERRORS + np.sqrt(ERRORS**2 + 2.0 * (WORTH + price))) / np.sqrt(moving.rows)
    assert root == pytest.approx(expected, rel=1e-6)
