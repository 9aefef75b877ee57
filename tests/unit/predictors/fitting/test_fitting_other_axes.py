"""Readings that tell where other axes stood, as every fit takes them."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors.fitting.algorithms import Algorithm
from rtec.predictors.fitting.samples import Samples, means_over_turns, together
from rtec.predictors.fitting.training import Design, Effort, train


def plane(rows, seed):
    rng = np.random.default_rng(seed)
    x, y, way = rng.uniform(0.0, 200.0, rows), rng.uniform(-40.0, 60.0, rows), rng.choice([-1.0, 1.0], rows)
    error = 2e-3 * np.sin(x / 60.0) * (1.0 + y / 50.0) + 1e-3 * (way < 0.0)
    return Samples(position_mm=x, direction=way, error_mm=error, others_mm={3: y})


def test_a_place_is_one_of_all_axes():
    samples = Samples(
        position_mm=[0, 5, 0, 5, 0],
        direction=[1, 1, -1, 1, 1],
        error_mm=[1, 2, 3, 4, 6],
        others_mm={2: [0, 0, 0, 9, 0]},
    )
    assert samples.place().tolist() == [0, 1, 0, 2, 0]
    means = samples.averaged()
    assert means.error_mm.tolist() == [3.5, 3.0, 2.0, 4.0]
    assert means.others_mm[2].tolist() == [0.0, 0.0, 0.0, 9.0]


def test_lines_are_those_of_a_direction_and_a_place_of_the_others():
    samples = Samples(
        position_mm=[5, 0, 0, 5], direction=[1, 1, 1, 1], error_mm=[1, 2, 3, 4], others_mm={2: [0, 0, 7, 7]}
    )
    assert [line.error_mm.tolist() for line in samples.lines()] == [[2.0, 1.0], [3.0, 4.0]]


def test_means_over_turns_stay_on_their_line():
    x, way = np.arange(0.0, 20.1, 0.5), np.ones(41)
    one, other = (
        Samples(position_mm=x, direction=way, error_mm=y + np.sin(2 * np.pi * x / 5.0), others_mm={2: y * way})
        for y in (1.0, 3.0)
    )
    means = means_over_turns(together([one, other]), 5.0)
    assert means.others_mm[2].tolist() == [1.0] * 4 + [3.0] * 4
    assert means.error_mm == pytest.approx(means.others_mm[2], abs=1e-12)


def test_a_network_learns_what_another_axis_does():
    trained = train(
        Design(hidden=(12,)), plane(400, 1), plane(200, 2), Effort(algorithm=Algorithm.LM, starts=2, epochs=200)
    )
    assert trained.predictor.inputs == ("position", "direction", "position_3")
    check = plane(300, 3)
    assert np.sqrt(np.mean(check.left_by(trained.predictor) ** 2)) < 5e-5
    alone = Samples(position_mm=check.position_mm, direction=check.direction, error_mm=check.error_mm)
    with pytest.raises(ArgumentError, match="no position_3"):
        alone.left_by(trained.predictor)
