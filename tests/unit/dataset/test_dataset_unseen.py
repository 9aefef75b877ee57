"""What targets cannot show, against the rank of the waves at them."""

import re

import numpy as np
import pytest

from rtec.dataset.unseen import other_step, shifted_targets, unseen_periods
from rtec.effects import Conditions


def at(position, runs=1, **facts):
    x = np.tile(np.asarray(position, dtype=float), runs)
    run = np.repeat(np.arange(1, runs + 1), len(position))
    return Conditions(position=x, position_unit=facts.pop("unit", "mm"), run=run, **facts)


def seen(position, period):
    """Return whether constant, sine and cosine can be told apart at these positions."""
    angle = 2 * np.pi * np.asarray(position) / period
    columns = np.stack([np.ones_like(angle), np.sin(angle), np.cos(angle)], axis=1)
    return np.linalg.svd(columns, compute_uv=False)[2] > 0.05 * np.sqrt(angle.size)


GRID = np.arange(0.0, 201.0, 5.0)
GAPS = np.array([0.0, 5.0, 20.0, 25.0, 30.0, 55.0, 60.0, 80.0, 85.0])


@pytest.mark.parametrize("targets", [GRID, GRID + 0.37, -GRID, GAPS, np.round(GRID / 25.4, 9) * 25.4])
def test_a_grid_hides_its_step_and_the_parts_of_it(targets):
    assert unseen_periods(at(targets)) == ("5 mm / k",)
    assert not any(seen(targets, 5.0 / k) for k in (1, 2, 3, 7))
    assert seen(targets, 11.0)


@pytest.mark.parametrize("parts", [1, 2, 3, 4, 5])
def test_the_grid_is_that_of_all_targets_also_where_the_file_rounds_them(parts):
    thirds = 25.4 / 3.0 * np.arange(390)
    targets = np.sort(np.append(thirds, thirds[7] + 25.4 / 3.0 / parts)) if parts > 1 else thirds
    assert unseen_periods(at(np.round(targets, 6))) == (f"{25.4 / 3.0 / parts:.6g} mm / k",)


def test_one_target_beside_the_grid_breaks_it():
    targets = GRID.copy()
    targets[20] += 2e-4
    assert unseen_periods(at(targets)) == ()


@pytest.mark.parametrize("seed", range(5))
def test_irregular_targets_hide_nothing(seed):
    targets = np.sort(np.round(np.random.default_rng(seed).uniform(0, 300, 31), 3))
    assert unseen_periods(at(targets)) == ()
    assert shifted_targets(at(targets)) is None


def test_whole_turns_and_two_phases():
    whole = at(12.7 * np.arange(20), screw_pitch=6.35)
    assert unseen_periods(whole) == ("12.7 mm / k",)
    half = at(GRID, screw_pitch=10.0)
    assert unseen_periods(half) == ("5 mm / k", "10 mm", "3.33333 mm", "2 mm")
    assert not any(seen(GRID, p) for p in (10.0, 10.0 / 3.0, 2.0))
    assert unseen_periods(at(GRID, screw_pitch=12.0)) == ("5 mm / k", "2 mm")  # 2.5 waves a step
    turn = at(np.arange(0.0, 361.0, 30.0), unit="deg", revolution=360.0)
    assert unseen_periods(turn) == ("30 deg / k", "60 deg")


def test_nothing_is_hidden_in_a_log_at_one_place_or_in_time():
    assert unseen_periods(at(GRID, moving=True)) == ()
    assert unseen_periods(at(np.zeros(9))) == ()
    assert unseen_periods(at(GRID, unit="s")) == ()
    assert shifted_targets(at(np.zeros(9))) is None


@pytest.mark.parametrize("facts", [{}, {"screw_pitch": 10.0}, {"screw_pitch": 2.5}])
@pytest.mark.parametrize("runs", [1, 2, 3, 5])
def test_the_suggested_change_shows_what_was_hidden(runs, facts):
    text = shifted_targets(at(GRID, runs, **facts))
    first, second = (float(x) for x in re.findall(r"([\d.]+) mm", text)[:2])
    assert ("run" in text) == (runs > 2)
    changed = np.concatenate([GRID, GRID + first, GRID + second])
    hidden = facts.get("screw_pitch", 5.0)
    for k in (1, 2, 3):
        assert not seen(GRID, hidden / k) or hidden / k == 5.0
        assert seen(changed, hidden / k)


@pytest.mark.parametrize("step", [0.635, 5.0])
def test_many_targets_on_a_grid_are_met_by_another_distance(step):
    grid = np.arange(1561) * step
    assert unseen_periods(at(grid)) == (f"{step:g} mm / k",)
    other = other_step(at(grid))
    assert f"targets {other:.4g} mm apart instead of {step:.4g} mm" in shifted_targets(at(grid))
    vernier = np.arange(0.0, grid[-1], other)
    assert vernier.size < grid.size
    for k in range(1, 20):
        assert not seen(grid, step / k)
        assert seen(vernier, step / k), k
    assert other_step(at(np.concatenate([grid, vernier]))) is None


def test_few_targets_are_shifted():
    assert other_step(at(GRID)) is None
    assert other_step(at(np.zeros(9))) is None
    assert "shift" in shifted_targets(at(GRID, runs=3))
