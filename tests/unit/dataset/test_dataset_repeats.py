import numpy as np
import pytest

from rtec.dataset.repeats import (
    cells_of,
    condition_numbers,
    one_way_passes,
    place_numbers,
    runs_by_recurrence,
)


def test_places_are_told_apart_by_a_millionth_of_the_span():
    position = np.array([0.0, 1000.0, 500.0, 500.0009, 500.002, 1e-4])
    assert place_numbers(position).tolist() == [0, 3, 1, 1, 2, 0]
    assert place_numbers(np.full(4, 7.0)).tolist() == [0] * 4


def test_conditions_are_numbered_as_they_come():
    position, direction = np.array([9.0, 9, 0, 9, 0]), np.array([1.0, -1, 1, 1, 1])
    assert condition_numbers(position, direction, None).tolist() == [0, 1, 2, 0, 2]
    assert condition_numbers(position, None, None).tolist() == [0, 0, 1, 0, 1]
    speed = np.array([1.0, 1, 2, 5, 2])
    assert condition_numbers(position, direction, speed).tolist() == [0, 1, 2, 3, 2]


@pytest.mark.parametrize("seed", range(5))
def test_cells_against_a_table(seed):
    """Cells as a table of dictionaries finds them."""
    generator = np.random.default_rng(seed)
    conditions = condition_numbers(generator.integers(0, 6, 25).astype(float), None, None)
    run = generator.integers(1, 5, 25) * 7
    visitors: dict[int, set[int]] = {}
    for number, who in zip(conditions.tolist(), run.tolist(), strict=True):
        visitors.setdefault(number, set()).add(who)
    cell = cells_of(conditions, run)
    for number, found in zip(conditions.tolist(), cell.tolist(), strict=True):
        assert (found >= 0) == (len(visitors[number]) > 1)
    pairs = {(a, b) for a, b in zip(conditions.tolist(), cell.tolist(), strict=True) if b >= 0}
    assert len({b for _, b in pairs}) == len(pairs) == len({a for a, _ in pairs})
    assert {b for _, b in pairs} == set(range(len(pairs)))


@pytest.mark.parametrize(
    ("conditions", "runs"),
    [
        ([0, 1, 2, 0, 1, 2], [1, 1, 1, 2, 2, 2]),
        ([0, 1, 2, 2, 1, 0], [1, 1, 1, 2, 2, 2]),
        ([0, 1, 2, 3, 0], [1, 1, 1, 1, 2]),
        ([0, 1, 2, 3, 4, 1, 2, 3, 4], [1, 1, 1, 1, 1, 2, 2, 2, 2]),
        ([0, 1, 2, 3, 4], None),
        ([0, 0, 1, 1, 2, 2], None),
        ([0, 0, 0, 0], None),
        ([0, 1, 2, 3, 4, 0, 1, 0, 1, 2, 3, 4], None),
    ],
)
def test_whole_passes_are_runs(conditions, runs):
    found = runs_by_recurrence(np.array(conditions))
    assert (None if found is None else found.tolist()) == runs


@pytest.mark.parametrize(
    ("position", "runs"),
    [
        ([0, 1, 2, 0, 1, 2, 0, 1], [1, 1, 1, 2, 2, 2, 3, 3]),
        ([2, 1, 0, 2, 1, 0], [1, 1, 1, 2, 2, 2]),
        ([0, 1, 2, 1, 0], None),
        ([0, 1, 2, 0], None),
        ([0, 1, 0, 1], None),
        ([0, 1, 2, 0, 2, 1], None),
        ([5, 5, 5], None),
        ([0, 1, 2, 3], None),
        ([3, 0, 1, 2, 3], None),
    ],
)
def test_passes_in_one_direction(position, runs):
    found = one_way_passes(np.array(position, dtype=float))
    assert (None if found is None else found.tolist()) == runs
