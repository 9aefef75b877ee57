"""Readings that belong to nothing: found, listed by their rows, and harmless."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured

from rtec.blind.game import play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.dataset.load import load_dataset
from rtec.dataset.outliers import FAR, at_turns, far, far_from_neighbours
from rtec.inference.diagnose import diagnose
from rtec.inference.results import Verdict

TILTED = lambda x, way, t, run: 5e-5 * x + 0.004 * way


def spoilt(data, *rows, by=0.088):
    observed = data.observed.copy()
    observed[list(rows)] += by
    return replace(data, observed=observed)


def test_what_lies_far_beyond_the_others_is_far():
    away = np.random.default_rng(0).normal(size=500)
    assert not far(away).any()
    scale = 1.4826 * np.median(np.abs(away - np.median(away)))
    away[7], away[8] = 1.05 * FAR * scale, 0.9 * FAR * scale
    assert np.flatnonzero(far(away)).tolist() == [7]
    away[7] = -away[7]
    assert np.flatnonzero(far(away)).tolist() == [7]


def test_many_are_heavy_tails_and_belong_to_the_noise():
    away = np.random.default_rng(0).normal(size=500)
    away[:10] = 50.0  # 2 %
    assert far(away).sum() == 10
    away[10] = 50.0
    assert not far(away).any()
    few = np.append(np.random.default_rng(1).normal(size=10), 50.0)
    assert np.flatnonzero(far(few)).tolist() == [10], "one is always allowed"


def test_equal_readings_have_no_outliers_and_no_division_by_zero():
    assert not far(np.zeros(20)).any()
    step = np.append(np.zeros(99), 1.0)  # a median deviation of zero
    assert np.flatnonzero(far(step)).tolist() == [99]


@pytest.mark.parametrize("runs", [1, 2, 5])
def test_one_reading_far_off_is_found_and_no_other(runs):
    data = measured(TILTED, runs=runs)
    assert not far_from_neighbours(data).any()
    for row in (0, 1, 17, data.rows // 2, data.rows - 1):
        assert np.flatnonzero(far_from_neighbours(spoilt(data, row))).tolist() == [row]


def test_a_step_or_a_reversal_is_no_outlier():
    for error in (
        lambda x, way, t, run: 0.2 * way,
        lambda x, way, t, run: np.where(t > 300.0, 0.3, 0.0),
        lambda x, way, t, run: 0.05 * np.abs(x - 150.0),
        lambda x, way, t, run: 0.1 * run,
    ):
        for runs in (1, 3, 5):
            assert not far_from_neighbours(measured(error, runs=runs)).any()


@pytest.mark.parametrize(("row", "runs"), [(0, 2), pytest.param(60, 5, marks=pytest.mark.sweep)])
def test_an_outlier_of_88_um_hides_nothing_and_is_listed(row, runs):
    """Forty-four standard deviations."""
    data = spoilt(measured(TILTED, runs=runs, timed=False), row)
    result = diagnose(data)
    assert set(result.effects) == {"scale", "backlash"}
    assert [(one.row, one.value) for one in result.outliers] == [(row + 1, data.observed[row])]
    assert result.dataset.rows == data.rows - 1
    assert any(f"outliers, far from their neighbours: readings {row + 1}" in note for note in result.notes)
    assert result.rms_after == pytest.approx(SIGMA, rel=0.25)


def test_what_only_the_model_shows_to_be_far_off_is_left_out_too():
    """Between targets of a fast wave a reading lies among its neighbours, and far from what the wave says."""
    wave = lambda x, way, t, run: 0.1 * np.sin(2 * np.pi * x / 33.0)
    data = spoilt(measured(wave, runs=1, targets=61, timed=False), 40, by=0.05)
    assert not far_from_neighbours(data).any()
    result = diagnose(data)
    assert result.effects == ("cyclic",)
    assert [one.row for one in result.outliers] == [41]
    assert result.rms_after == pytest.approx(SIGMA, rel=0.2)


def test_readings_without_repeats_are_compared_with_their_own_kind():
    # repeats scatter by the noise, neighbours by the wave between them: one spread for both called crests outliers
    wave = lambda x, way, t, run: 0.03 * np.sin(2 * np.pi * x / 41.0)
    data = measured(wave, runs=5, targets=41)
    cell = data.cell.copy()
    cell[np.isin(cell, np.unique(cell)[::6])] = -1
    data = replace(data, cell=cell)
    assert not far_from_neighbours(data).any()
    row = int(np.flatnonzero(cell < 0)[7])
    assert np.flatnonzero(far_from_neighbours(spoilt(data, row, by=0.5))).tolist() == [row]


@pytest.mark.parametrize("alone", [3, 6, 10])
def test_a_few_readings_without_repeats_have_no_spread_of_their_own(alone):
    for seed in range(40):
        data = measured(runs=5, targets=11, seed=seed)
        cell = data.cell.copy()
        cell[np.random.default_rng(seed).choice(data.rows, alone, replace=False)] = -1
        assert not far_from_neighbours(replace(data, cell=cell)).any(), seed


def test_readings_at_which_an_axis_turns_round_belong_to_neither_direction():
    data = load_dataset(play(Scenario(names=("backlash",), strength_sigma=10.0, plan=PLANS["moving"]), 3)[0])
    turns = at_turns(data)
    way = data.conditions.direction
    assert set(np.flatnonzero(turns)) >= set(np.flatnonzero(way[1:] != way[:-1]) + 1)
    assert 0 < turns.sum() < 0.05 * data.rows
    result = diagnose(data)
    assert result.verdict in (Verdict.NAMED, Verdict.TIED)
    assert any(f"{turns.sum()} readings at reversals are left out" in note for note in result.notes)


def test_where_noise_makes_the_direction_every_reading_stays():
    data = load_dataset(play(Scenario(plan=PLANS["moving"]), 3)[0])
    since = np.where(np.arange(data.rows) % 5 == 0, 0.0, data.conditions.since_reversal)
    assert not at_turns(replace(data, conditions=replace(data.conditions, since_reversal=since))).any()
    assert not at_turns(measured(TILTED)).any()


@pytest.mark.parametrize("runs", [2, 3, 5])
def test_a_tenth_of_repeated_readings_may_be_spoilt(runs):
    data = measured(TILTED, runs=runs, timed=False)
    bad = list(range(3, data.rows, 11))  # never two of the same place
    assert np.flatnonzero(far_from_neighbours(spoilt(data, *bad))).tolist() == bad


def test_a_run_that_differs_is_no_set_of_outliers():
    step = lambda x, way, t, run: np.where(run == 10, 0.3, 0.0)
    assert not far_from_neighbours(measured(step, runs=10)).any()
