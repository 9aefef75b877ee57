"""What a search looks at of a long measurement."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import measured

from rtec.dataset import many_rows as module
from rtec.dataset.many_rows import drawn
from rtec.effects import effect_named
from rtec.effects.frequency_grid import frequencies

CYCLIC = effect_named("cyclic")


def test_what_is_not_long_is_looked_at_as_it_is():
    data = measured()
    assert drawn(data) is data


def test_whole_cells_are_kept(monkeypatch):
    monkeypatch.setattr(module, "MOST_AT_REST", 200)
    data = measured(runs=6, targets=60)
    part = drawn(data)
    assert 150 <= part.rows <= 200
    for cell in np.unique(part.cell):
        assert (part.cell == cell).sum() == 6
    assert np.unique(np.diff(np.unique(part.cell))).size > 2, "drawn, not at equal steps"
    assert part.rows < data.rows == 720
    again = drawn(data)
    assert (again.observed == part.observed).all(), "always the same"
    assert drawn(data, seed=1).observed.tolist() != part.observed.tolist()


def test_readings_that_nothing_repeats_are_drawn_one_by_one(monkeypatch):
    monkeypatch.setattr(module, "MOST_AT_REST", 200)
    data = measured(runs=6, targets=60)
    data = replace(data, cell=np.where(np.isin(data.cell, np.unique(data.cell)[:60]), -1, data.cell))
    part = drawn(data)
    assert 100 <= part.rows <= 220
    share = (part.cell < 0).mean()
    assert 0.3 < share < 0.7, "neither all of them nor none"


def test_a_part_resolves_the_periods_that_the_whole_resolves(monkeypatch):
    monkeypatch.setattr(module, "MOST_AT_REST", 80)
    data = measured(runs=2, at=np.linspace(0.0, 300.0, 301))
    part = drawn(data)
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
    part = drawn(moving)
    assert part.rows == module.MOST_IN_MOTION < moving.rows
    assert (np.diff(part.coordinates.order) > 0).all()
    assert np.unique(np.diff(part.coordinates.order)).size > 5
    monkeypatch.setattr(module, "MOST_AT_REST", 100)
    once = drawn(replace(measured(runs=1, targets=200), cell=np.full(400, -1)))
    assert once.rows == 100


def test_gaps_between_drawn_readings_are_known():
    from rtec.inference.colour import gaps_of

    data = measured(runs=1, targets=2000)
    moving = replace(data, conditions=replace(data.conditions, moving=True))
    part = drawn(moving)
    rows = np.searchsorted(moving.coordinates.time_s, part.coordinates.time_s)
    assert gaps_of(part)[1:].tolist() == np.diff(rows).tolist()
