"""Differences between repeats: what repeatable effects leave no trace in."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured

from rtec.effects import effect_named
from rtec.inference.repeat_space import (
    MOST_RUN_SHAPES,
    SHARE_OF_FREEDOM,
    changes_between_repeats,
    contrasts_of,
    equal_runs,
    repeat_space,
    run_starts,
)


@pytest.mark.parametrize("runs", [2, 3, 7])
def test_contrasts_are_orthonormal_and_blind_to_what_repeats(runs):
    slots = 4
    matrix = contrasts_of(np.eye(runs * slots), runs).T  # column by column: the whole linear map
    assert matrix.shape == ((runs - 1) * slots, runs * slots)
    assert matrix @ matrix.T == pytest.approx(np.eye((runs - 1) * slots), abs=1e-12)
    assert matrix @ np.tile(np.random.default_rng(0).normal(size=slots), runs) == pytest.approx(0.0, abs=1e-12)
    # a contrast never mixes readings of different slots, so correlation along a run stays as it is
    mixed = matrix.reshape(runs - 1, slots, runs, slots)
    assert all(np.count_nonzero(mixed[:, i, :, j]) == 0 for i in range(slots) for j in range(slots) if i != j)


def test_contrasts_of_very_many_runs():
    x = np.random.default_rng(0).normal(size=(1, 60_000))
    found = contrasts_of(x, 30_000)
    table = x.reshape(30_000, 2)
    assert (found**2).sum() == pytest.approx(((table - table.mean(axis=0)) ** 2).sum())


def test_equal_runs():
    data = measured(runs=3, targets=5)
    assert equal_runs(data) == (3, 10)
    space = repeat_space(data)
    assert (space.slots, space.runs, space.freedom) == (10, 3, 20)
    assert np.flatnonzero(space.starts).tolist() == [0, 10]
    assert space.observed == pytest.approx(contrasts_of(data.observed[None, :], 3)[0])


@pytest.mark.parametrize(
    "spoilt",
    [
        lambda d: d.take(np.arange(d.rows - 1)),  # a run is shorter
        lambda d: d.take(np.concatenate([np.arange(10), np.arange(19, 9, -1), np.arange(20, 30)])),  # another order
        lambda d: replace(d, cell=np.where(d.cell == 3, -1, d.cell)),  # a cell without repeats
        lambda d: replace(d, cell=np.where(d.cell == 3, 4, d.cell)),  # a cell twice in a run
        lambda d: replace(d, conditions=replace(d.conditions, run=np.ones(30, dtype=np.int64))),  # one run only
    ],
)
def test_runs_that_are_not_equal(spoilt):
    data = spoilt(measured(runs=3, targets=5))
    assert equal_runs(data) is None
    space = repeat_space(data)
    assert space.slots is None
    # deviations from cell means, stretched so that each has the variance of a reading
    member = data.cell >= 0
    assert space.observed.size == member.sum()
    assert space.freedom == member.sum() - len(set(data.cell[member].tolist()))
    for k in set(data.cell[member].tolist()):
        own = data.observed[data.cell == k]
        expected = (own - own.mean()) * np.sqrt(own.size / (own.size - 1))
        assert space.observed[data.cell[member] == k] == pytest.approx(expected)


def test_without_repeats_there_is_no_space():
    assert repeat_space(measured(runs=1)) is None


def test_unequal_differences_have_the_variance_of_a_reading():
    data = measured(runs=4, targets=300, seed=3)
    space = repeat_space(data.take(np.arange(data.rows - 250)))
    assert space.slots is None
    # 2150 readings: 5 standard errors of a variance are 5 sqrt(2 / 1500) = 18 %
    assert np.mean(space.observed**2) == pytest.approx(SIGMA**2, rel=0.18)


def test_starts_of_runs():
    assert run_starts(np.array([4, 4, 2, 2, 2, 4])).tolist() == [True, False, True, False, False, True]


@pytest.mark.parametrize("name", ["offset", "scale", "backlash"])
def test_repeatable_effects_leave_no_trace(name):
    effect = effect_named(name)
    for data in (measured(runs=3), measured(runs=3).take(np.arange(100))):
        columns = data.columns(effect, effect.shape_type()).T
        assert repeat_space(data).of(columns) == pytest.approx(0.0, abs=1e-9)


def test_changes_take_a_third_of_the_differences_at_most():
    for runs in (2, 3, 5, 12):
        for targets in (3, 6, 21):
            data = measured(runs=runs, targets=targets)
            space = repeat_space(data)
            found = changes_between_repeats(data, space)
            assert sum(table.shape[0] for table in found.values()) <= max(space.freedom / SHARE_OF_FREEDOM, 1)
            assert all(table.shape[1] == data.rows for table in found.values())


def test_changes_of_the_reversal_error_are_courses_over_the_runs():
    data = measured(runs=6)
    table = changes_between_repeats(data, repeat_space(data))["direction"]
    assert table.shape[0] == MOST_RUN_SHAPES
    # over the runs: polynomials without a constant, times the direction
    by_run = np.array([(row * data.conditions.direction)[data.conditions.run == 3].tolist() for row in table])
    assert np.ptp(by_run, axis=1) == pytest.approx(np.zeros(MOST_RUN_SHAPES))
    linear = (table[0] * data.conditions.direction).reshape(6, -1)[:, 0]
    assert linear == pytest.approx(np.linspace(-1, 1, 6))


def test_one_direction_has_no_changes_of_the_reversal_error():
    data = measured(runs=6, bidirectional=False)
    assert set(changes_between_repeats(data, repeat_space(data))) == {"time", "position"}


def test_temperatures_come_early_among_what_changes():
    heat = np.sin(np.arange(210) / 30.0)
    data = measured(temperatures={"screw": heat})
    table = changes_between_repeats(data, repeat_space(data))["time"]
    warm = heat - heat.mean()
    assert any(np.corrcoef(row, warm)[0, 1] > 0.999999 for row in table[:2])
    assert any(np.corrcoef(row, warm * (data.conditions.position - 150.0))[0, 1] > 0.99 for row in table[:3])
