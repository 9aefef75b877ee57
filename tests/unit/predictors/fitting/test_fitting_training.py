"""Training from readings to a predictor: when it ends, what it keeps, and what cannot be trained."""

import math
import time

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rtec.errors import ArgumentError
from rtec.predictors.fitting import training
from rtec.predictors.fitting.algorithms import Algorithm
from rtec.predictors.fitting.samples import Samples
from rtec.predictors.fitting.training import Design, Effort, Limit, train

PITCH_MM = 5.0
SMALL = Design(hidden=(4,))


def bow(x, way):
    return 1e-5 * (x - 30.0) ** 2 / 3.0 + 0.004 * (way < 0)


def readings(error=bow, noise_mm=0.0, offset_mm=0.0, step_mm=1.0, seed=0):
    x = np.arange(offset_mm, 60.1, step_mm)
    position, way = np.tile(x, 2), np.repeat([1.0, -1.0], x.size)
    noise = np.random.default_rng(seed).normal(0.0, noise_mm, position.size)
    return Samples(position_mm=position, direction=way, error_mm=error(position, way) + noise)


@pytest.mark.parametrize("algorithm", Algorithm)
def test_each_algorithm_finds_a_bow_with_backlash(algorithm):
    epochs = 300 if algorithm in (Algorithm.LM, Algorithm.BFGS) else 1500
    effort = Effort(algorithm=algorithm, starts=2, epochs=epochs, patience=epochs)
    found = train(SMALL, readings(), readings(offset_mm=0.5), effort)
    held = readings(offset_mm=0.25)
    off = held.error_mm - found.predictor.error_mm(held.position_mm, held.direction)
    assert np.sqrt(np.mean(off**2)) < 0.05 * held.error_mm.std()
    assert found.weights == 4 * 3 + 5


def test_two_networks_share_the_long_error_and_that_of_the_turn():
    def error(x, way):
        return bow(x, way) + 0.002 * np.sin(2.0 * np.pi * x / PITCH_MM) * way

    design = Design(hidden=(2,), within_turn=5)
    effort = Effort(starts=4, epochs=300)
    found = train(design, readings(error, step_mm=0.5), readings(error, offset_mm=0.25), effort, pitch_mm=PITCH_MM)
    held = readings(error, offset_mm=0.6)
    off = held.error_mm - found.predictor.error_mm(held.position_mm, held.direction)
    assert np.sqrt(np.mean(off**2)) < 4e-4
    assert [network.inputs for network in found.predictor.networks] == [
        ("position", "direction"),
        ("turn", "direction"),
    ]
    assert design.name == "2 + 5"
    wide = found.predictor.networks[0]
    assert wide.weights.size == 2 * 3 + 3
    assert len(found.courses) == 2


def test_a_seed_gives_the_same_weights_again_and_another_one_others():
    first, again, other = (
        train(SMALL, readings(noise_mm=1e-3), readings(offset_mm=0.5), Effort(starts=2, epochs=40, seed=seed))
        for seed in (3, 3, 4)
    )
    assert_array_equal(first.predictor.numbers, again.predictor.numbers)
    assert not np.array_equal(first.predictor.numbers, other.predictor.numbers)


def test_more_starts_are_never_worse_and_the_best_is_kept():
    unseen = readings(noise_mm=1e-3, offset_mm=0.5, seed=1)

    def off(starts):
        found = train(SMALL, readings(noise_mm=1e-3), unseen, Effort(starts=starts, epochs=30, seed=1))
        said = found.predictor.error_mm(unseen.position_mm, unseen.direction)
        rms = math.sqrt(np.mean((unseen.error_mm - said) ** 2))
        assert min(found.courses[0].unseen_mm) == pytest.approx(rms, rel=1e-9)
        return rms

    found = [off(starts) for starts in (1, 3, 6)]
    assert found == sorted(found, reverse=True)
    assert found[-1] < found[0]


def test_a_training_ends_where_other_readings_are_foretold_no_better():
    noisy, unseen = readings(noise_mm=5e-3, step_mm=2.0), readings(noise_mm=5e-3, offset_mm=1.0, step_mm=2.0, seed=9)
    effort = Effort(starts=1, epochs=1000, patience=7)
    course = train(Design(hidden=(8,)), noisy, unseen, effort).courses[0]
    best = int(np.argmin(course.unseen_mm))
    assert len(course.unseen_mm) == best + 1 + 7
    assert course.train_mm[-1] < course.train_mm[best]
    assert course.squares_mm2 == pytest.approx(course.train_mm[best] ** 2 * noisy.rows)
    assert len(course.unseen_mm) < 500


def test_epochs_are_counted_over_all_starts():
    course = train(SMALL, readings(), readings(offset_mm=0.5), Effort(starts=3, epochs=10, patience=100)).courses[0]
    assert course.epochs == 3 * 11
    assert len(course.train_mm) == 11


@pytest.mark.parametrize("algorithm", Algorithm)
def test_a_limit_ends_it_with_the_best_so_far(algorithm):
    told = []
    limit = Limit(stopped=lambda: len(told) >= 5)
    effort = Effort(algorithm=algorithm, starts=50, epochs=10**6, patience=10**6)
    found = train(SMALL, readings(), readings(offset_mm=0.5), effort, limit=limit, tell=told.append)
    assert len(told) == 5
    assert told == sorted(told, reverse=True)
    assert min(found.courses[0].unseen_mm) == told[-1]


def test_a_time_limit_ends_it():
    begun = time.perf_counter()
    effort = Effort(starts=10**6, epochs=10**6, patience=10**6)
    train(SMALL, readings(), readings(offset_mm=0.5), effort, limit=Limit(until_s=begun + 0.2))
    assert 0.2 <= time.perf_counter() - begun < 5.0
    now = time.perf_counter()
    assert Limit(until_s=now + 100.0).first(0.25).until_s == pytest.approx(now + 25.0, abs=1.0)


def test_a_training_that_diverges_is_one_error(monkeypatch):
    monkeypatch.setattr(training.Shape, "first_weights", lambda shape, rng: np.full(shape.weights, np.nan))
    with pytest.raises(ArgumentError, match="diverged") as caught:
        train(SMALL, readings(), readings(offset_mm=0.5), Effort(starts=2))
    assert "--seed" in str(caught.value)


def test_fewer_averages_than_weights_are_refused():
    few = readings(step_mm=10.0)
    with pytest.raises(ArgumentError, match="17 or more"):
        train(SMALL, few, few, Effort(starts=1))


def test_a_network_for_the_turn_needs_a_pitch():
    with pytest.raises(ArgumentError, match="screw-pitch"):
        train(Design(hidden=(2,), within_turn=3), readings(), readings(), Effort(starts=1))


@pytest.mark.parametrize(("name", "value"), [("starts", 0), ("epochs", 0), ("patience", -1), ("seed", -1)])
def test_an_effort_that_cannot_be(name, value):
    with pytest.raises(ArgumentError) as caught:
        Effort(**{name: value})
    assert caught.value.name == name
