"""Very large measurements: which part is looked at."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import measured

from rtec.dataset import many_rows as module
from rtec.dataset.drive_signals import Resample
from rtec.dataset.many_rows import ENOUGH_REPEATS, one_of_every, search_sample, shortened
from rtec.effects import effect_named
from rtec.effects.frequency_grid import frequencies


def equal_runs(data):
    """Number of runs and of readings in each, all with the same conditions in the same order."""
    run, cell = data.conditions.run, data.cell
    numbers = np.unique(run)
    first = cell[run == numbers[0]]
    assert all((cell[run == number] == first).all() for number in numbers)
    return numbers.size, first.size


def counts(data):
    return np.bincount(data.cell[data.cell >= 0])


def test_what_is_not_too_large_is_looked_at_as_it_is():
    data = measured()
    assert shortened(data) is data
    assert shortened(data, most=210) is data
    assert shortened(data, most=209) is not data


def test_of_many_runs_whole_ones_are_kept_evenly_spaced():
    data = measured(runs=200, targets=3)
    part = shortened(data, most=300)
    assert part.rows == 300
    assert equal_runs(part) == (50, 6)
    steps = np.diff(np.unique(part.conditions.run))
    assert set(steps.tolist()) <= {4, 5}
    assert (np.unique(part.conditions.run)[[0, -1]] == (1, 200)).all()
    assert part.notes[-1].startswith("300 of 1200 readings are searched, 50 of 200 runs")


def test_of_many_conditions_some_are_drawn_with_all_their_readings():
    data = measured(runs=5, targets=100)
    part = shortened(data, most=200)
    assert equal_runs(part) == (5, 40)
    assert (counts(part) == 5).all()
    slots = np.flatnonzero(np.isin(data.observed, part.observed))[:40]
    assert len(set(np.diff(slots).tolist())) > 2  # not at equal steps
    assert "40 of 200 conditions" in part.notes[-1]


def test_cells_are_numbered_anew_and_those_without_repeats_are_told():
    data = measured(runs=3, targets=60).take(np.arange(250))  # the last run is short
    part = shortened(data, most=60)
    used = counts(part)
    assert (used > 1).all()
    assert used.size == np.unique(part.cell[part.cell >= 0]).size
    for k in range(used.size):
        own = part.cell == k
        assert np.ptp(part.conditions.position[own]) == 0.0
        assert np.ptp(part.conditions.direction[own]) == 0.0


def test_a_cell_read_very_often_in_one_run():
    data = measured(runs=400, targets=5)
    one = replace(data, conditions=replace(data.conditions, run=np.ones(4000, dtype=np.int64)))
    part = shortened(one, most=200)
    assert part.rows <= 200
    assert (counts(part) == ENOUGH_REPEATS).all()


def test_without_repeats_rows_are_drawn_from_all_of_the_file():
    data = measured(runs=1, targets=5000)
    part = shortened(data, most=1000)
    assert part.rows == 1000
    rows = part.conditions.order
    assert (np.floor(rows / 10) == np.arange(1000)).all()
    assert len(set((rows % 10).tolist())) == 10
    assert (shortened(data, most=1000).observed == part.observed).all()  # always the same draw
    assert shortened(data, most=1000, seed=1).observed.tolist() != part.observed.tolist()
    assert (part.observed == data.observed[rows.astype(int)]).all()


@pytest.mark.parametrize(("step", "rows"), [(1, 5), (4, 9), (7, 7), (10, 3)])
def test_one_row_of_every_so_many(step, rows):
    found = one_of_every(step, rows, np.random.default_rng(0))
    assert (found // step == np.arange(-(-rows // step))).all()
    assert found.max() < rows


def test_a_decimated_log_stays_whole():
    data = measured(runs=1, targets=5000)
    whole = Resample(stretches=((0, 10_000),), stages=())
    assert shortened(replace(data, resample=whole), most=100).rows == 10_000


# what a search draws of a long one

CYCLIC = effect_named("cyclic")


def test_whole_cells_are_kept(monkeypatch):
    monkeypatch.setattr(module, "MOST_AT_REST", 200)
    data = measured(runs=6, targets=60)
    part = search_sample(data)
    assert 150 <= part.rows <= 200
    for cell in np.unique(part.cell):
        assert (part.cell == cell).sum() == 6
    assert np.unique(np.diff(np.unique(part.cell))).size > 2, "drawn, not at equal steps"
    assert part.rows < data.rows == 720
    again = search_sample(data)
    assert (again.observed == part.observed).all(), "always the same"
    assert search_sample(data, seed=1).observed.tolist() != part.observed.tolist()


def test_readings_that_nothing_repeats_are_drawn_one_by_one(monkeypatch):
    monkeypatch.setattr(module, "MOST_AT_REST", 200)
    data = measured(runs=6, targets=60)
    data = replace(data, cell=np.where(np.isin(data.cell, np.unique(data.cell)[:60]), -1, data.cell))
    part = search_sample(data)
    assert 100 <= part.rows <= 220
    share = (part.cell < 0).mean()
    assert 0.3 < share < 0.7, "neither all of them nor none"


def test_a_part_resolves_the_periods_that_the_whole_resolves(monkeypatch):
    monkeypatch.setattr(module, "MOST_AT_REST", 80)
    data = measured(runs=2, at=np.linspace(0.0, 300.0, 301) + np.random.default_rng(1).uniform(-0.3, 0.3, 301))
    part = search_sample(data)
    whole = frequencies(data.conditions)
    alone = frequencies(replace(part.conditions, whole=None))
    assert frequencies(part.conditions).tolist() == whole.tolist()
    assert alone[-1] != pytest.approx(whole[-1], rel=0.1)
    shape = CYCLIC.shapes(data.conditions)[-1]
    rows = np.isin(data.observed, part.observed)
    assert (part.columns(CYCLIC, shape) == data.columns(CYCLIC, shape)[rows]).all()


def test_of_a_log_rows_are_drawn_in_order(monkeypatch):
    data = measured(runs=1, targets=2000)
    moving = replace(data, conditions=replace(data.conditions, moving=True))
    part = search_sample(moving)
    assert part.rows == module.MOST_IN_MOTION < moving.rows
    assert (np.diff(part.coordinates.order) > 0).all()
    assert np.unique(np.diff(part.coordinates.order)).size > 5
    monkeypatch.setattr(module, "MOST_AT_REST", 100)
    once = search_sample(replace(measured(runs=1, targets=200), cell=np.full(400, -1)))
    assert once.rows == 100


def test_gaps_between_drawn_readings_are_known():
    from rtec.inference.colour import gaps_of

    data = measured(runs=1, targets=2000)
    moving = replace(data, conditions=replace(data.conditions, moving=True))
    part = search_sample(moving)
    rows = np.searchsorted(moving.coordinates.time_s, part.coordinates.time_s)
    assert gaps_of(part)[1:].tolist() == np.diff(rows).tolist()
