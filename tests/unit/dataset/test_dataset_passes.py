"""Places passed again, in logs made here with known noise between passes."""

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.dataset.many_rows import locked, shortened
from rtec.metrology import Column, Measurement


def measured(**columns):
    known = {name: Column(name, unit, np.asarray(values, dtype=float)) for name, (unit, values) in columns.items()}
    return Measurement(source="log.csv", facts={}, columns=known, unknown={})


def to_and_fro(speeds, rate=100.0, reach=50.0):
    """Return time, position and velocity of strokes forth and back, one pair for each speed."""
    v = np.concatenate([np.repeat([s, -s], round(reach / s * rate)) for s in speeds])
    return np.arange(v.size) / rate, np.cumsum(v) / rate, v


def deviation_log(speeds=(10.0,) * 5, noise=1e-3, common=0.0, seed=1, **options):
    """Return a log whose passes differ by an offset of their own, beside white noise and an error of position."""
    rng = np.random.default_rng(seed)
    time, x, v = to_and_fro(speeds, **options)
    number = np.concatenate(([0], np.cumsum(np.diff(np.sign(v)) != 0)))
    own = common * rng.standard_normal(number.max() + 1)[number]
    y = 0.05 * np.sin(x / 8.0) + 0.01 * np.sign(v) + own + noise * rng.standard_normal(x.size)
    return load_dataset(measured(time=("s", time), target=("mm", x), deviation=("mm", y)))


def between(data):
    """Return the standard deviation of what passes differ by in their cells, cell by cell."""
    found = []
    for cell in np.unique(data.cell[data.cell >= 0]):
        own = data.cell == cell
        means = [data.observed[own & (data.passage == p)].mean() for p in np.unique(data.passage[own])]
        assert len(means) > 1, "a cell belongs to two passes at least"
        found.append(np.var(means, ddof=1))
    return float(np.sqrt(np.mean(found)))


def test_strokes_over_the_same_places_are_repeats():
    data = deviation_log(common=0.004)
    assert data.has_repeats
    assert (data.cell >= 0).mean() > 0.9
    assert np.unique(data.passage).size == 10
    assert between(data) == pytest.approx(0.004, rel=0.4)
    assert any("places passed again in the same direction" in note for note in data.notes)
    for cell in np.unique(data.cell[data.cell >= 0])[::5]:
        own = data.coordinates.take(data.cell == cell)
        assert np.unique(own.direction).size == 1
        assert np.ptp(own.position) < 50.0 / 8 + 1e-9


def test_bins_are_fine_where_the_error_is_steep_against_the_noise():
    coarse, fine = (deviation_log(noise=n, common=n) for n in (0.05, 0.002))
    assert coarse.cell.max() < fine.cell.max()
    inside = [np.ptp(fine.coordinates.position[fine.cell == k]) for k in range(fine.cell.max() + 1)]
    assert 0.05 / 8.0 * np.median(inside) < 0.02, "the error changes little within a bin"


def test_a_place_passed_once_or_at_other_speeds_is_none():
    assert not deviation_log(speeds=(10.0,)).has_repeats
    assert not deviation_log(speeds=(5.0, 8.0, 13.0, 21.0)).has_repeats
    mixed = deviation_log(speeds=(5.0, 5.2, 20.0, 20.5))
    assert mixed.has_repeats
    for cell in np.unique(mixed.cell[mixed.cell >= 0]):
        fast = np.abs(mixed.conditions.velocity[mixed.cell == cell])
        assert fast.max() <= 1.26 * fast.min()


def test_too_few_places_passed_again_make_no_floor():
    time = np.arange(0.0, 60.0, 0.01)
    v = np.select([time < 50.0, time < 55.0], [10.0, -10.0], 10.0)
    x = np.cumsum(v) * 0.01
    data = load_dataset(measured(time=("s", time), target=("mm", x), deviation=("mm", np.cos(x))))
    assert not data.has_repeats


def test_standstills_and_accelerations_are_apart():
    rng = np.random.default_rng(2)
    time = np.arange(0.0, 60.0, 0.01)
    x = 30.0 * np.sin(2 * np.pi * time / 6.0)
    force = 0.1 * np.sign(np.cos(2 * np.pi * time / 6.0)) - 0.01 * x + 0.02 * rng.standard_normal(time.size)
    data = load_dataset(measured(time=("s", time), actual=("mm", x), force=("n", force)))
    c = data.coordinates
    assert data.has_repeats
    assert (data.cell[c.direction == 0.0] == -1).all()
    strong = 0.3 * np.abs(c.acceleration).max()
    for cell in np.unique(data.cell[data.cell >= 0]):
        a = c.acceleration[data.cell == cell]
        assert not ((a > strong).any() and (a < -strong).any())


def test_a_place_reached_while_braking_is_not_that_of_cruising():
    """Strokes of 30 and 60 mm in turn, at 30 mm/s with 100 mm/s^2: the short ones brake where the long cruise."""
    speed = []
    for reach in (30.0, 60.0) * 6:
        ramp = 30.0 * np.arange(0.0, 1.0, 1 / 30)
        one = np.concatenate([ramp, np.full(round((reach / 30.0 - 0.3) * 100), 30.0), ramp[::-1]])
        speed += [one, -one]
    v = np.concatenate(speed)
    x, time = np.cumsum(v) / 100, np.arange(v.size) / 100
    noise = 0.1 * np.random.default_rng(3).standard_normal(v.size)
    force = np.gradient(v, 0.01) / 10 + noise
    data = load_dataset(measured(time=("s", time), actual=("mm", x), force=("n", force)))
    assert data.has_repeats
    for cell in np.unique(data.cell[data.cell >= 0]):
        a = data.conditions.acceleration[data.cell == cell]
        assert np.ptp(a) < 100.0


def test_parts_of_a_log_keep_their_repeats_between_passes():
    data = deviation_log(common=0.004, rate=1000.0)
    for part in (shortened(data, most=5000), *locked(data)):
        assert part.passage.shape == (part.rows,)
        for cell in np.unique(part.cell[part.cell >= 0]):
            assert np.unique(part.passage[part.cell == cell]).size > 1
    assert locked(data)[0].has_repeats
    part = shortened(data, most=5000)
    assert part.rows <= 5000
    assert np.unique(part.passage).size == 10
    assert part.has_repeats


def test_coming_back_to_a_condition_within_one_run_is_a_repeat(load):
    """Each place is read twice in a row, which repeats nothing; coming back to it does."""
    once = load("time_s,direction,target_mm,deviation_um\n0,1,0,1\n1,1,0,2\n2,1,5,3\n3,1,5,1\n")
    assert not once.has_repeats
    rows = "".join(f"1,{t},{1 - 2 * (t // 2 % 2)},{5},{t % 3}\n" for t in range(12))
    back = load("run,time_s,direction,target_mm,deviation_um\n" + rows)
    assert np.unique(back.coordinates.run).size == 1
    assert back.cell.tolist() == [0, 0, 1, 1] * 3
    assert back.passage.tolist() == np.repeat(np.arange(6), 2).tolist()


def test_a_return_begins_a_pass(load):
    text = "run,direction,target_mm,deviation_um\n" + "1,1,0,1\n1,1,5,2\n1,1,9,2\n" * 3
    data = load(text)
    assert data.passage.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    assert data.cell.tolist() == [0, 1, 2] * 3
