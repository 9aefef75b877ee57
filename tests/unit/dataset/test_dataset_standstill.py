"""Logs of a drive with standstills, made here sample by sample with known answers."""

import itertools

import numpy as np
import pytest

from rtec.dataset.direction import dead_zone, last_direction
from rtec.dataset.load import load_dataset
from rtec.dataset.standstill import band_of, rest_stretches
from rtec.metrology import Column, Measurement


def measured(**columns):
    known = {name: Column(name, unit, np.asarray(values, dtype=float)) for name, (unit, values) in columns.items()}
    return Measurement(source="log.csv", facts={}, columns=known, unknown={})


def stop_and_go(rate=50.0, seed=1, stand_s=10.0, strokes=6):
    """Return time, position, velocity, true standing rows and force of strokes of 20 mm at several speeds."""
    noise, speed = np.random.default_rng(seed), []
    for stroke in range(strokes):
        pace = (1 - 2 * (stroke % 2)) * (4.0 + 3.0 * (stroke // 2))
        speed += [np.zeros(round(stand_s * rate)), np.full(round(20.0 / abs(pace) * rate), pace)]
    v = np.concatenate([*speed, np.zeros(round(stand_s * rate))])
    time, position = np.arange(v.size) / rate, np.cumsum(v) / rate
    # what the drive holds at rest has nothing to do with the sign of the noise of the velocity
    force = 0.5 * v + np.where(v != 0.0, 8.0 * np.sign(v), 3.0) + 0.2 * noise.standard_normal(v.size)
    return time, position, v, v == 0.0, force


def log_of(time, position, force, velocity=None, name="actual"):
    columns = {"time": ("s", time), name: ("mm", position), "force": ("n", force)}
    return measured(**columns, **({} if velocity is None else {"velocity": ("mm_s", velocity)}))


@pytest.mark.parametrize(
    ("rate", "with_velocity"), [(10.0, True), (50.0, False), (50.0, True), (400.0, False), (400.0, True)]
)
def test_each_standstill_of_a_drive_is_one_row(rate, with_velocity):
    time, position, v, standing, force = stop_and_go(rate)
    noisy = v + 0.1 * np.random.default_rng(2).standard_normal(v.size)
    data = load_dataset(log_of(time, np.round(position, 2), force, noisy if with_velocity else None))
    c = data.conditions
    still = c.direction == 0.0
    assert still.sum() == 7
    assert (c.velocity[still] == 0.0).all()
    assert (c.acceleration[still] == 0.0).all()
    np.testing.assert_allclose(data.observed[still], 3.0, atol=0.2)
    np.testing.assert_allclose(c.position[still], [0, 20, 0, 20, 0, 20, 0], atol=0.6)
    assert data.rows < 1.1 * (~standing).sum() + 7
    assert any("rows at rest became 7" in note for note in data.notes)


def test_a_velocity_gives_the_direction_only_where_it_exceeds_its_noise():
    time, position, v, _, force = stop_and_go()
    noisy = v + 8.0 * np.random.default_rng(3).standard_normal(v.size)
    c = load_dataset(log_of(time, np.round(position, 2), force, noisy)).conditions
    truth = np.interp(c.time_s, time, v)
    assert (c.direction == np.sign(truth))[np.abs(truth) > 1.0].mean() > 0.97
    # a position that lags behind a good velocity does not decide
    time = np.arange(0.0, 60.0, 0.02)
    v = 10.0 * np.sign(np.sin(time)) + 0.1 * np.random.default_rng(4).standard_normal(time.size)
    late = np.roll(np.cumsum(v) * 0.02, 20)[20:]
    c = load_dataset(log_of(time[20:], np.round(late, 2), np.sign(v[20:]), v[20:])).conditions
    assert (c.direction == np.sign(np.sin(c.time_s + 0.4))).mean() > 0.96


def test_the_low_pass_of_a_velocity_turns_no_motion_round():
    # short stops between moves the same way, and back again: at a stop the filtered velocity swings below zero
    rate, ramp = 50.0, 0.5 - 0.5 * np.cos(np.pi * np.arange(6) / 6.0)
    move = np.concatenate([ramp, np.ones(60), ramp[::-1]]) * 8.0 + 0.01
    v = np.tile(np.concatenate([move, move, move, -move, -move, -move]), 6)
    time, position = np.arange(v.size) / rate, (np.cumsum(v) - v / 2) / rate
    c = load_dataset(log_of(time, np.round(position, 3), np.sign(v), np.round(v, 3))).conditions
    assert (np.sign(c.velocity) != np.sign(np.interp(c.time_s, time, v))).sum() > 10, "it does swing"
    moves = c.velocity != 0.0  # it creeps where it turns
    assert (c.direction != np.sign(np.interp(c.time_s, time, v)))[moves].mean() < 0.002


def test_a_decimated_log_has_one_row_for_each_standstill():
    time, position, _, standing, force = stop_and_go(1000.0)
    data = load_dataset(log_of(time, np.round(position, 3), force))
    rows = data.coordinates
    assert data.resample is not None
    assert (~standing).sum() / 10 < data.rows < 1.1 * (~standing).sum() / 10 + 60
    one = np.ones(data.conditions.rows)
    np.testing.assert_allclose(data.resample.apply(one)[10:-10], 0.9886, atol=2e-3)
    longest = np.argsort(np.diff(rows.time_s))[-5:]
    assert (rows.direction[longest] == 0.0).any()
    # a subset of the rows is the same columns
    some = np.arange(0, data.rows, 7)
    whole = data.resample.apply(data.conditions.velocity)
    np.testing.assert_array_equal(data.take(some).resample.apply(data.conditions.velocity), whole[some])


def test_slow_motion_is_no_standstill():
    """A crawl through the steps of a coarse encoder, a reversal, and a stale position are all motion."""
    time = np.arange(0.0, 60.0, 0.01)
    crawl = np.round(0.2 * time / 0.02) * 0.02
    run = np.ones(time.size, dtype=np.int64)
    assert rest_stretches(time, crawl, run, None) == []
    swing = np.round(10.0 * np.sin(time), 3)
    assert sum(b - a for a, b in rest_stretches(time, swing, run, None)) < 0.002 * time.size
    stale = np.repeat((5.0 * np.sin(time))[::8], 8)[: time.size]
    assert sum(b - a for a, b in rest_stretches(time, stale, run, None)) < 0.1 * time.size


def test_a_slow_run_beside_fast_ones_moves():
    """The dead zone is no share of the largest speed: a run at 0.05 mm/s beside one at 100 mm/s is motion."""
    slow, fast = np.arange(0.0, 40.0, 0.01), np.arange(0.0, 2.0, 0.01)
    time, run = np.concatenate([slow, fast]), np.repeat([1, 2], [slow.size, fast.size])
    jitter = 2e-4 * np.random.default_rng(4).standard_normal(time.size)
    position = np.concatenate([-0.05 * slow, 100.0 * fast]) + jitter
    columns = {"time": ("s", time), "actual": ("mm", position), "force": ("n", np.sign(run - 1.5))}
    c = load_dataset(measured(run=("", run), **columns)).conditions
    assert (c.direction[c.run == 1] == -1.0).mean() > 0.97
    assert (c.direction[c.run == 2] == 1.0).mean() > 0.97


def held(places, rows=12, rate=50.0, on_the_way=0):
    """Return time, position and place number of an axis held at each place for some rows."""
    stay = [np.full(rows, x) for x in places]
    way = [np.linspace(a, b, on_the_way + 2)[1:-1] for a, b in itertools.pairwise(places)]
    position = np.concatenate([x for pair in zip(stay, [*way, np.empty(0)], strict=True) for x in pair])
    return np.arange(position.size) / rate, position


@pytest.mark.parametrize("on_the_way", [0, 2])
def test_places_held_forth_and_back(on_the_way):
    up = np.arange(0.0, 30.0, 0.5)
    places = np.concatenate([up, up[::-1][1:]])
    time, position = held(places, on_the_way=on_the_way)
    jitter = 0.01 * np.random.default_rng(5).integers(-1, 2, position.size)
    force = np.sin(position) + np.where(np.arange(position.size) < position.size / 2, 1.0, -1.0)
    data = load_dataset(log_of(time, position + jitter, force))
    c = data.conditions
    assert not c.moving
    assert data.rows == places.size
    np.testing.assert_allclose(c.position, places, atol=0.01)
    np.testing.assert_array_equal(c.direction, np.repeat([1.0, -1.0], [up.size, up.size - 1]))
    assert c.acceleration is None
    assert "direction" in data.notes[0]
    assert any(f"became {places.size}" in note for note in data.notes)


def test_bursts_of_readings_at_each_place():
    """Pauses between the places make it a file of readings at rest: still one row for each place."""
    places = np.concatenate([np.arange(0.0, 40.0), np.arange(39.0, -1.0, -1.0)])
    position = np.repeat(places, 5) + 0.01 * np.random.default_rng(6).integers(-1, 2, 400)
    time = np.repeat(2.0 * np.arange(80), 5) + np.tile(0.01 * np.arange(5), 80)
    data = load_dataset(log_of(time, position, np.cos(position)))
    # the place of the reversal is held twice as long: its readings are one group
    assert data.rows == 79
    assert set(data.conditions.direction[:39].tolist()) == {1.0}
    assert set(data.conditions.direction[40:].tolist()) == {-1.0}


def test_long_standstills_of_a_deviation_are_thinned_not_merged():
    time, position, _, standing, _ = stop_and_go(stand_s=60.0)
    since = np.zeros(time.size)
    for row in range(1, time.size):
        since[row] = since[row - 1] + 0.02 if standing[row] else 0.0
    noise = 1e-4 * np.random.default_rng(7).normal(size=time.size)
    deviation = np.where(standing, 0.02 * np.exp(-since / 1.5), 0.02) + noise
    columns = {"time": ("s", time), "target": ("mm", position), "deviation": ("mm", deviation)}
    data = load_dataset(measured(**columns))
    at = data.conditions.time_s
    first = time[standing][np.flatnonzero(np.diff(time[standing]) > 0.03)[1] + 1]
    settling = (at > first) & (at < first + 4.0)
    assert settling.sum() >= 199, "the settling is there sample by sample"
    later = (at > first + 20.0) & (at < first + 50.0)
    assert 10 < later.sum() < 500
    assert any("long standstills" in note for note in data.notes)


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
def test_dead_zone_of_the_direction(noise):
    t = np.arange(0.0, 100.0, 0.02)
    path = 10.0 * np.abs((t / 20.0) % 2.0 - 1.0)
    x = path + noise * np.random.default_rng(8).standard_normal(t.size)
    run = np.ones(t.size, dtype=np.int64)
    found = last_direction(x, run, dead_zone(x, run, band_of(x, run) / 4.0))
    assert (found == np.sign(np.gradient(path))).mean() > 0.97
    assert np.count_nonzero(np.diff(found)) == 4


def test_near_duplicate_times_do_not_blow_up_the_derivatives():
    noise = np.random.default_rng(9)
    t = np.sort(np.concatenate([np.arange(0.0, 20.0, 0.02), 5.0 + 1e-4 * np.arange(60), noise.uniform(0, 20, 50)]))
    x = 10.0 * np.sin(t) + 0.003 * noise.standard_normal(t.size)
    c = load_dataset(log_of(t, x, np.cos(t))).conditions
    moving = c.direction != 0.0
    assert c.rows > t.size - 60, "a burst on the way is no standstill"
    assert np.abs(c.velocity[moving] - 10.0 * np.cos(c.time_s[moving])).max() < 1.0
    assert np.abs(c.acceleration[moving] + 10.0 * np.sin(c.time_s[moving])).max() < 15.0


def test_rows_that_repeat_the_row_before_are_no_measurements():
    t = np.cumsum(np.random.default_rng(10).uniform(0.002, 0.004, 4000))
    fresh = 8 * (np.arange(t.size) // 8)
    x, v, force = np.round(20 * np.sin(t[fresh]), 3), 20 * np.cos(t[fresh]), np.sign(np.cos(t[fresh])) + t[fresh]
    data = load_dataset(log_of(t, x, force, v))
    assert data.rows <= 500
    assert any("only repeat the row before" in note for note in data.notes)
    assert np.median(np.abs(data.conditions.acceleration + 20 * np.sin(data.conditions.time_s))) < 1.0


@pytest.mark.parametrize(("dwell_s", "dwells"), [(0.0, 0), (0.06, 7), (0.08, 7), (0.3, 7)])
@pytest.mark.parametrize("step", [0.001, 0.05])
def test_a_short_dwell_is_told_from_a_turn(dwell_s, dwells, step):
    ramp, way = np.linspace(0.0, 250.0, 25), 1.0
    parts = []
    for _ in range(8):
        parts += [way * ramp, way * np.full(60, 250.0), way * ramp[::-1], np.zeros(round(dwell_s / 0.004))]
        way = -way
    v = np.concatenate(parts)
    t, x = 0.004 * np.arange(v.size), np.round(np.cumsum(v) * 0.004 / step) * step
    found = rest_stretches(t, x, np.ones(t.size, dtype=np.int64), None)
    assert len(found) in (dwells, dwells + 1)  # the last one ends the log
