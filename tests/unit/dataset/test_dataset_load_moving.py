from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, decimate, filtfilt

from rtec.dataset.direction import last_direction
from rtec.dataset.drive_signals import even_rate
from rtec.dataset.kind import is_moving, transient_rows
from rtec.dataset.load import load_dataset
from rtec.dataset.observed import unwrapped
from rtec.dataset.standstill import stretches_of
from rtec.effects import Observable
from rtec.errors import FileFormatError
from rtec.metrology import Column, Measurement

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="the measurements of real machines are not there")


def measured(facts=None, **columns):
    """Return a measurement of columns named ``quantity=(unit, values)``."""
    known = {name: Column(name, unit, np.asarray(values, dtype=float)) for name, (unit, values) in columns.items()}
    return Measurement(source="log.csv", facts=facts or {}, columns=known, unknown={})


def there_and_back(rate, seconds=6.0, reach=80.0):
    """Return time, position, velocity and acceleration of a smooth motion there and back."""
    time = np.arange(round(seconds * rate)) / rate
    angle = 2 * np.pi * time / 3.0
    position = reach * (1 - np.cos(angle)) / 2 + 0.1 * reach * np.sin(3 * angle)
    velocity = reach * np.pi / 3 * np.sin(angle) + 0.1 * reach * 2 * np.pi * np.cos(3 * angle)
    acceleration = reach * 2 * np.pi**2 / 9 * np.cos(angle) - 0.1 * reach * 4 * np.pi**2 * np.sin(3 * angle)
    return time, position, velocity, acceleration


def a_test_at_rest(seconds, targets=21, runs=5):
    one = np.linspace(0, 400, targets)
    position = np.tile(np.concatenate([one, one[::-1]]), runs)
    return np.arange(position.size) * seconds, position


MOTION = there_and_back(100.0)


@pytest.mark.parametrize(
    ("time", "position", "velocity", "moving"),
    [
        (*MOTION[:2], False, True),
        (*there_and_back(2.0, 600.0)[:2], False, False),
        (there_and_back(100.0)[0] * 20, MOTION[1], False, True),
        (there_and_back(100.0)[0] * 200, MOTION[1], False, False),
        (None, MOTION[1], False, False),
        (None, MOTION[1], True, True),
        (there_and_back(100.0)[0] * 200, MOTION[1], True, False),
        (MOTION[0], np.zeros(600), False, False),
        (np.arange(30) * 0.04, np.arange(30) * 5.0, False, True),
        (np.arange(30) * 0.06, np.arange(30) * 5.0, False, False),
        (*a_test_at_rest(0.1), False, False),
        (*a_test_at_rest(5.0, targets=1561), False, False),
        (np.sort(np.random.default_rng(1).exponential(1.0, 600).cumsum() * 0.1), MOTION[1], False, True),
        # twelve readings in a tenth of a second at each target
        (np.arange(600) * 0.01 + np.arange(600) // 12 * 5.0, np.arange(600) // 12 * 10.0, False, False),
    ],
)
def test_moving_or_at_rest(time, position, velocity, moving):
    run = np.ones(position.size, dtype=np.int64)
    assert is_moving(time, position, run, velocity) is moving


def test_intervals_count_within_runs_only():
    time, position, *_ = MOTION
    run = np.repeat([1, 2], 300)
    assert is_moving(np.concatenate([time[:300], time[:300]]), position, run, False)
    # one reading a run: nothing is known of intervals
    assert not is_moving(time, position, np.arange(600), False)


def test_wraps_of_a_single_turn_counter():
    angle = np.linspace(0, 1000, 400)
    np.testing.assert_allclose(unwrapped(angle % 360, 360.0), angle)
    np.testing.assert_allclose(unwrapped(-angle % 360, 360.0) - unwrapped(-angle % 360, 360.0)[0], -angle)
    # more than a turn, or no jump: left as it is
    assert unwrapped(angle, 360.0) is angle
    coarse = np.array([0.0, 250.0, 500.0])
    assert unwrapped(coarse, 360.0) is coarse
    short = angle[:40]
    assert unwrapped(short, 360.0) is short


def test_the_axis_has_turned_where_it_really_goes_back():
    run = np.ones(9, dtype=np.int64)
    # 1e-5 of the span is 0.001: less is no turn, and rest keeps the direction of the motion before
    position = np.array([0.0, 0.0, 50.0, 100.0, 99.9995, 100.0, 100.0, 60.0, 0.0])
    assert last_direction(position, run).tolist() == [1] * 7 + [-1] * 2
    assert last_direction(-position, run).tolist() == [-1] * 7 + [1] * 2
    turned = np.array([0.0, 0.0, 50.0, 100.0, 99.9, 99.9, 100.0, 110.0, 120.0])
    assert last_direction(turned, run).tolist() == [1, 1, 1, 1, -1, -1, 1, 1, 1]
    # each run begins anew
    runs = np.array([1, 1, 1, 1, 2, 2, 2, 3, 3])
    assert last_direction(position, runs).tolist() == [1, 1, 1, 1, 0, 0, 0, -1, -1]
    assert not last_direction(np.full(9, 5.0), run).any()


def test_stretches_and_rates():
    time = np.concatenate([np.arange(50), np.arange(50) + 100.0]) * 1e-3
    run = np.repeat([1, 1, 2, 2], 25)
    assert stretches_of(time, run) == [(0, 50), (50, 100)]
    assert stretches_of(time, np.repeat([1, 2, 2, 2], 25)) == [(0, 25), (25, 50), (50, 100)]
    assert even_rate(time, stretches_of(time, run)) == pytest.approx(1000.0)
    uneven = np.cumsum(np.random.default_rng(1).uniform(1, 3, 500)) * 1e-3
    assert even_rate(uneven, [(0, 500)]) is None
    # times rounded to the last digit that is written are even all the same
    exact = np.arange(3000) / 700.0
    assert even_rate(np.round(exact, 3), [(0, 3000)]) == pytest.approx(700.0, rel=1e-3)
    assert even_rate(np.arange(3000) / 500, [(0, 3000)]) == 500.0
    assert even_rate(np.delete(exact, 1500), [(0, 2999)]) is None
    assert even_rate(exact + 0.003 * np.sin(np.arange(3000)), [(0, 3000)]) is None
    assert even_rate(np.zeros(5), [(0, 5)]) is None
    assert even_rate(np.zeros(1), [(0, 1)]) is None


def a_run(homing, speed=100.0, wobble=5.0):
    """Return a run at constant speed with cogging, and at its start a swing that dies down like homing."""
    time = np.cumsum(np.random.default_rng(1).uniform(1.8e-3, 2.8e-3, 4300))
    swing = homing * np.exp(-time / 0.08) * np.cos(2 * np.pi * time / 0.15)
    return time, speed * time + wobble * np.sin(speed * time / 8) + swing


@pytest.mark.parametrize("sign", [1, -1])
def test_homing_is_left_out_until_the_speed_is_usual(sign):
    time, position = a_run(600.0)
    count = transient_rows(time, sign * position)
    # the swing runs at most 600 * 2 pi / 0.15 / 100 = 250 times too fast, and is down to a tenth of that range after
    # 0.08 ln(250 / 0.26) = 0.55 s; a tenth of the time more
    assert 0.4 < time[count] < 0.7
    data = load_dataset(
        measured(time=("s", time), actual=("deg", sign * position), current=("a", np.cos(time))), observe="current"
    )
    assert data.rows == time.size - count
    assert data.conditions.time_s[0] == pytest.approx(time[count] - time[0])
    assert any(f"the first {time[count] - time[0]:.2f} s ({count} rows) are left out" in note for note in data.notes)


def test_what_is_no_homing():
    time, position = a_run(0.0)
    assert transient_rows(time, position) == 0
    # slip as large as later, and an acceleration from rest
    assert transient_rows(*a_run(3.0)) == 0
    ramp = np.where(time < 0.5, 50.0 * time**2 / 0.5, 100.0 * (time - 0.25))
    assert transient_rows(time, ramp) == 0
    # there and back is no run at constant speed, nor is rest
    assert transient_rows(time, 100 * np.sin(time) + 600 * np.exp(-time / 0.05)) == 0
    assert transient_rows(time, 0 * time + 600 * np.exp(-time / 0.05)) == 0
    assert transient_rows(time[:30], position[:30]) == 0


def test_each_run_loses_its_own_homing():
    time, position = a_run(600.0)
    count = transient_rows(time, position)
    columns = {
        "run": ("", np.repeat([1, 2], time.size)),
        "time": ("s", np.tile(time, 2)),
        "actual": ("deg", np.tile(position, 2)),
        "current": ("a", np.ones(2 * time.size)),
    }
    data = load_dataset(measured(**columns))
    assert data.rows == 2 * (time.size - count)
    assert sum("of run" in note for note in data.notes) == 2


def by_hand(position, force, rate=1000.0, cutoff=100.0):
    """Return position, velocity, acceleration and force of a log, all but the last not decimated."""
    b, a = butter(4, cutoff / (rate / 2))
    smooth = filtfilt(b, a, position)
    velocity = np.gradient(smooth, 1 / rate)
    acceleration = np.gradient(velocity, 1 / rate)
    inner = slice(round(0.2 * rate), -round(0.2 * rate))
    return smooth[inner], velocity[inner], acceleration[inner], decimate(force[inner], 10, ftype="iir")


def a_drive(rate=1000.0, seed=1):
    time, position, velocity, acceleration = there_and_back(rate)
    noise = np.random.default_rng(seed)
    force = 0.1 * acceleration + 0.4 * velocity + 20 * np.sign(velocity) + noise.normal(size=time.size)
    return time, np.round(position, 4), force, velocity, acceleration


def test_a_drive_log_is_prepared_as_it_is_by_hand():
    time, position, force, velocity, _ = a_drive()
    data = load_dataset(measured(time=("s", time), actual=("mm", position), force=("n", force)))
    smooth, v, a, decimated = by_hand(position, force)
    found = data.conditions
    for mine, hand in ((found.position, smooth), (found.velocity, v), (found.acceleration, a)):
        np.testing.assert_allclose(mine, hand, rtol=0, atol=1e-8 * np.abs(hand).max())
    np.testing.assert_allclose(data.observed, decimated, atol=1e-9)
    assert found.time_s[0] == pytest.approx(0.2)
    np.testing.assert_allclose(v, velocity[200:-200], atol=0.3)
    assert data.cutoff_hz == 100.0
    both = {"time": ("s", time), "actual": ("mm", position), "force": ("n", force)}
    pulses = Measurement(source="x", facts={}, columns=measured(**both).columns, unknown={"pulse_v": force})
    np.testing.assert_array_equal(load_dataset(pulses).unknown[0][1], data.observed)
    for words in ("Butterworth low pass at 100 Hz", "0.2 s dropped", "decimated by 10", "1000 Hz to 100 Hz"):
        assert any(words in note for note in data.notes)
    assert data.has_repeats  # the motion comes twice
    # the physics comes back out
    columns = np.stack([found.acceleration, found.velocity, found.direction], axis=1)
    fit = np.linalg.lstsq(data.resample.apply(columns.T).T, data.observed, rcond=None)[0]
    np.testing.assert_allclose(fit, [0.1, 0.4, 20.0], rtol=0.02)


@pytest.mark.parametrize(("rate", "cutoff", "factor"), [(400.0, 80.0, 1), (100.0, 20.0, 1), (2000.0, 100.0, 20)])
def test_other_rates(rate, cutoff, factor):
    time, position, force, velocity, _ = a_drive(rate)
    data = load_dataset(measured(time=("s", time), actual=("mm", position), force=("n", force)))
    assert data.cutoff_hz == pytest.approx(cutoff)
    dropped = round(0.2 * rate)
    assert data.conditions.rows == time.size - 2 * dropped
    assert data.rows == -(-data.conditions.rows // factor)
    assert (data.resample is None) == (factor == 1)
    np.testing.assert_allclose(data.conditions.velocity, velocity[dropped:-dropped], atol=0.3)
    np.testing.assert_allclose(data.coordinates.time_s, time[dropped:-dropped:factor], atol=1e-9)


def test_a_deviation_keeps_its_rows_and_the_command():
    time, position, *_, velocity, _ = a_drive()
    late = position - 0.002 * velocity
    data = load_dataset(measured(time=("s", time), target=("mm", position), actual=("mm", late)))
    inner = slice(200, -200)
    np.testing.assert_array_equal(data.conditions.position, position[inner])
    np.testing.assert_allclose(data.observed, -0.002 * velocity[inner], atol=1e-9)
    assert data.resample is None
    assert data.observable is Observable.DEVIATION


def test_direction_at_rest():
    """A friction knows rest; what play has left stays while the axis stands."""
    time = np.arange(0, 8, 1e-3)
    speed = np.select([time < 2, time < 4, time < 6], [0.0, 50.0, 0.0], -50.0)
    position = np.cumsum(speed) * 1e-3
    columns = {"time": ("s", time), "actual": ("mm", position), "force": ("n", speed)}
    drive = load_dataset(measured(**columns)).conditions
    middle = [int(np.argmin(np.abs(drive.time_s - t))) for t in (1, 3, 5, 7)]
    assert drive.direction[middle].tolist() == [0, 1, 0, -1]
    target = {"target": ("mm", position)}
    deviation = load_dataset(measured(**columns, **target)).conditions
    kept = [int(np.argmin(np.abs(deviation.time_s - t))) for t in (1, 3, 5, 7)]
    assert deviation.direction[kept].tolist() == [1, 1, 1, -1]
    for found, rows in ((drive, middle), (deviation, kept)):
        np.testing.assert_allclose(found.since_reversal[rows], [0, 50, 100, 50], atol=0.5)


def test_direction_column_of_a_log():
    time, position, force, *_ = a_drive()
    columns = {"time": ("s", time), "actual": ("mm", position), "force": ("n", force)}
    data = load_dataset(measured(direction=("", -np.ones(time.size)), **columns))
    assert set(data.conditions.direction.tolist()) == {-1.0}


def test_gaps_and_runs_are_differentiated_each_for_itself():
    time, position, force, velocity, _ = a_drive()
    run = np.repeat([1, 2], 3000)
    jump = position + 1000.0 * (run == 2)
    columns = {"actual": ("mm", jump), "force": ("n", force)}
    for first in ({"run": ("", run), "time": ("s", time)}, {"time": ("s", time + 50.0 * (run == 2))}):
        data = load_dataset(measured(**first, **columns))
        assert data.conditions.rows == 2 * (3000 - 400)
        assert data.resample.stretches == ((0, 2600), (2600, 5200))
        inner = np.concatenate([velocity[200:2800], velocity[3200:5800]])
        np.testing.assert_allclose(data.conditions.velocity, inner, atol=0.5)
        assert data.rows == 520
    # each run with a clock of its own
    data = load_dataset(measured(run=("", run), time=("s", np.tile(time[:3000], 2)), **columns))
    np.testing.assert_allclose(data.conditions.velocity, inner, atol=0.5)
    assert any("starts again" in note for note in data.notes)


def test_a_run_that_goes_on_where_the_last_ended_is_no_gap():
    """What remembers needs the whole way, and the way is known where the log never stopped."""
    time, position, force, velocity, _ = a_drive()
    run = np.repeat([1, 2], 3000)
    columns = {"time": ("s", time), "actual": ("mm", position), "force": ("n", force)}
    data = load_dataset(measured(run=("", run), **columns))
    assert data.resample.stretches == ((0, 5600),)
    np.testing.assert_allclose(data.conditions.velocity, velocity[200:5800], atol=0.5)
    assert np.unique(data.conditions.run).tolist() == [1, 2], "the runs stay what they are"


@pytest.mark.parametrize(("late_s", "away_mm"), [(0.002, 0.0), (0.0, 5.0)])
def test_a_run_after_a_pause_or_elsewhere_is_a_new_beginning(late_s, away_mm):
    time, position, force, *_ = a_drive()
    run = np.repeat([1, 2], 3000)
    columns = {"actual": ("mm", position + away_mm * (run == 2)), "force": ("n", force)}
    data = load_dataset(measured(run=("", run), time=("s", time + late_s * (run == 2)), **columns))
    assert data.resample.stretches == ((0, 2600), (2600, 5200))


def test_short_stretches_are_left_out_or_refused():
    time, position, force, *_ = a_drive()
    gap = time + 50.0 * (np.arange(time.size) >= 5800)
    columns = {"actual": ("mm", position), "force": ("n", force)}
    data = load_dataset(measured(time=("s", gap), **columns))
    assert data.conditions.rows == 5800 - 400
    assert "1 stretches too short to be filtered are left out" in data.notes
    short = {name: (unit, values[:400]) for name, (unit, values) in {"time": ("s", time), **columns}.items()}
    with pytest.raises(FileFormatError, match="a log of 400 samples without a gap at 1000 Hz; use at least 428"):
        load_dataset(measured(**short))


def test_an_unevenly_sampled_log_keeps_its_rows():
    generator = np.random.default_rng(5)
    time = np.cumsum(generator.uniform(1.6e-3, 3e-3, 3000))
    angle = 36.0 * time + 2 * np.sin(3 * time)
    data = load_dataset(measured(time=("s", time), actual=("deg", angle), current=("a", np.cos(time))))
    assert data.rows == 3000
    np.testing.assert_array_equal(data.conditions.position, angle)
    np.testing.assert_allclose(data.conditions.velocity, 36 + 6 * np.cos(3 * time), atol=0.02)
    np.testing.assert_allclose(data.conditions.acceleration, -18 * np.sin(3 * time), atol=1.5)
    assert data.cutoff_hz is None
    assert any("on an even grid" in note for note in data.notes)


def test_counts_of_a_single_turn_are_made_continuous():
    time = np.arange(0, 6, 1e-3)
    counts = 4000.0 * time - 1000.0
    facts = {"axis": "8192 counts/rev"}
    columns = {"time": ("s", time), "current": ("a", np.cos(time))}
    data = load_dataset(measured(facts, actual=("count", counts % 8192), **columns))
    speed = 4000 * 360 / 8192
    np.testing.assert_allclose(data.conditions.velocity, speed, rtol=1e-6)
    assert any("single-turn counter" in note for note in data.notes)
    # command and encoder pass zero at different moments
    for start in (0.0, 1020.0):
        target = counts + start
        late = {"target": ("count", target % 8192), "actual": ("count", (target - 40.0) % 8192)}
        data = load_dataset(measured(facts, **late, **columns))
        np.testing.assert_allclose(data.observed, -40 * 360 / 8192, rtol=1e-6)


def test_a_velocity_column_is_taken():
    time, position, force, velocity, acceleration = a_drive()
    columns = {"time": ("s", time), "actual": ("mm", position), "force": ("n", force)}
    data = load_dataset(measured(velocity=("mm_s", 1.1 * velocity), **columns))
    np.testing.assert_allclose(data.conditions.velocity, 1.1 * velocity[200:-200], atol=0.3)
    np.testing.assert_allclose(data.conditions.acceleration, 1.1 * acceleration[200:-200], atol=3.0)
    # speeds take the sign of the motion
    data = load_dataset(measured(velocity=("mm_s", np.abs(velocity)), **columns))
    fast = np.abs(velocity[200:-200]) > 10
    np.testing.assert_allclose(data.conditions.velocity[fast], velocity[200:-200][fast], atol=1.5)
    assert any("never negative" in note for note in data.notes)
    # without a time there is no acceleration
    data = load_dataset(measured(velocity=("mm_s", velocity), actual=("mm", position), force=("n", force)))
    np.testing.assert_array_equal(data.conditions.velocity, velocity)
    assert data.conditions.acceleration is None
    assert data.conditions.moving


def test_a_log_to_score_on_passes_the_same_filter():
    time, position, force, *_ = a_drive(2000.0)
    columns = {"time": ("s", time), "actual": ("mm", position), "force": ("n", force)}
    slow_time, slow_position, slow_force, *_ = a_drive(300.0)
    slow = measured(time=("s", slow_time), actual=("mm", slow_position), force=("n", slow_force))
    train = load_dataset(slow)
    assert load_dataset(measured(**columns), like=train).cutoff_hz == train.cutoff_hz == pytest.approx(60.0)
    uneven = time + np.random.default_rng(1).uniform(0, 4e-4, time.size)
    jittered = load_dataset(measured(**(columns | {"time": ("s", uneven)})))
    assert jittered.cutoff_hz is None
    assert load_dataset(measured(**columns), like=jittered).rows == time.size


def a_sine(rate, step, repeats=1, seed=2):
    """Return time, rounded position, force with noise, velocity and acceleration; 20 kg, 5 N of friction."""
    time = np.arange(0, 20, 1 / rate)
    seen = repeats * (np.arange(time.size) // repeats)
    velocity, acceleration = 60 * np.cos(3 * time), -180 * np.sin(3 * time)
    noise = np.random.default_rng(seed).normal(size=time.size)
    force = 0.02 * acceleration + 5 * np.sign(velocity) + noise
    position = np.round(20 * np.sin(3 * time) / step) * step
    return time, position[seen], force[seen], velocity, acceleration


def inertia_and_friction(data):
    columns = np.stack([data.conditions.acceleration, data.conditions.direction])
    columns = columns if data.resample is None else data.resample.apply(columns)
    return np.linalg.lstsq(columns.T, data.observed, rcond=None)[0]


@pytest.mark.parametrize(("rate", "step"), [(1000.0, 0.2), (250.0, 0.05), (100.0, 0.1), (100.0, 1e-6)])
def test_the_low_pass_follows_the_step_of_the_encoder(rate, step):
    time, position, force, _, acceleration = a_sine(rate, step)
    data = load_dataset(measured(time=("s", time), actual=("mm", position), force=("n", force)))
    within = np.interp(data.conditions.time_s, time, acceleration)
    moves = data.conditions.velocity != 0.0
    assert np.std((data.conditions.acceleration - within)[moves]) < 0.06 * np.std(within)
    np.testing.assert_allclose(inertia_and_friction(data), [0.02, 5.0], rtol=0.06)


def test_a_velocity_full_of_motion_is_no_noise():
    speeds = np.repeat(np.random.default_rng(3).choice([0.0, 5.0, 40.0], 300), 2)
    time, position = np.arange(600) * 0.1, np.cumsum(speeds) * 0.1
    columns = {"time": ("s", time), "actual": ("mm", position), "force": ("n", speeds)}
    assert load_dataset(measured(velocity=("mm_s", speeds), **columns)).cutoff_hz == 2.0


@pytest.mark.parametrize("repeats", [2, 4, 5])
def test_samples_that_a_logger_repeats_are_left_out(repeats):
    time, position, force, *_ = a_sine(500.0, 0.002, repeats)
    data = load_dataset(measured(time=("s", time), actual=("mm", position), force=("n", force)))
    assert any("only repeat the row before" in note for note in data.notes)
    np.testing.assert_allclose(np.diff(data.conditions.time_s), repeats / 500.0)
    np.testing.assert_allclose(inertia_and_friction(data), [0.02, 5.0], rtol=0.06)
    # a force and a position that are both coarse repeat themselves by chance
    time, position, force, *_ = a_sine(500.0, 0.2)
    data = load_dataset(measured(time=("s", time), actual=("mm", position), force=("n", np.round(force / 2) * 2)))
    assert not any("only repeat" in note for note in data.notes)


def test_a_velocity_that_the_drive_filters_is_set_right():
    time, position, force, velocity, _ = a_sine(250.0, 0.002)
    late = 60 * np.cos(3 * (time - 0.04))
    columns = {"time": ("s", time), "actual": ("mm", position), "force": ("n", force)}
    data = load_dataset(measured(velocity=("mm_s", late), **columns))
    assert any("behind the position: set right" in note for note in data.notes)
    np.testing.assert_allclose(data.conditions.velocity, np.interp(data.conditions.time_s, time, velocity), atol=0.6)
    data = load_dataset(measured(velocity=("mm_s", velocity), **columns))
    assert not any("behind the position" in note for note in data.notes)


def test_creep_below_a_count_is_rest():
    """Between two moves the force ramps up for four seconds, and the axis gives by eight counts."""
    time = np.arange(0, 12, 0.004)
    moves = np.clip(time - 1, 0, 2) - np.clip(time - 9, 0, 2)
    position = np.round((50 * moves - 0.08 * np.clip(time - 4, 0, 4)) / 0.04) * 0.04
    force = np.where((time > 4) & (time < 8), -2 * (time - 4), np.sign(np.gradient(moves)))
    data = load_dataset(measured(time=("s", time), actual=("mm", position), force=("n", force)))
    assert ((data.conditions.time_s > 4.3) & (data.conditions.time_s < 7.7)).sum() < 20


@needs_shared
def test_emps_reaches_the_published_figures():
    train = load_dataset(SHARED / "emps_train.csv", observe="force")
    test = load_dataset(SHARED / "emps_pulses.csv", like=train)
    assert (train.rows, test.rows, test.observe) == (2445, 2445, "force")
    assert not any("left out: the axis" in note for note in train.notes + test.notes)

    def columns(data, names):
        c = data.conditions
        every = {
            "inertia": c.acceleration,
            "viscous": c.velocity,
            "coulomb": c.direction,
            "asymmetric": np.abs(c.velocity),
            "offset": np.ones(c.rows),
        }
        return data.resample.apply(np.stack([every[name] for name in names])).T

    for names, held_out in (
        (("inertia", "viscous"), 10.1),
        (("inertia", "viscous", "coulomb"), 4.64),
        (("inertia", "viscous", "coulomb", "offset"), 3.35),
        (("inertia", "viscous", "coulomb", "asymmetric"), 3.01),
    ):
        fit = np.linalg.lstsq(columns(train, names), train.observed, rcond=None)[0]
        left = test.observed - columns(test, names) @ fit
        assert np.sqrt(np.mean(left**2)) == pytest.approx(held_out, rel=0.005)


@needs_shared
def test_the_motor_reaches_its_figure_without_the_homing():
    train = load_dataset(SHARED / "motor_run_slow2_nocomp_0.csv", observe="current")
    test = load_dataset(SHARED / "motor_run_slow2_nocomp_1.csv", like=train)
    assert (train.units.position, train.conditions.revolution) == ("deg", 360.0)
    assert any("the first 0.35 s (146 rows) are left out" in note for note in test.notes)
    assert not any("left out" in note for note in train.notes)
    assert not any("left out" in note for note in load_dataset(SHARED / "motor_run_slow2_comp_0.csv").notes)

    def columns(data):
        turn = 2 * np.pi * data.conditions.position / 360
        lines = [7 * h for h in range(1, 6)] + [12 * h for h in range(1, 4)]
        return np.stack([np.ones(data.rows), *(f(k * turn) for k in lines for f in (np.sin, np.cos))], axis=1)

    fit = np.linalg.lstsq(columns(train), train.observed, rcond=None)[0]
    assert np.std(test.observed) == pytest.approx(0.648, rel=0.002)
    assert np.sqrt(np.mean((test.observed - columns(test) @ fit) ** 2)) == pytest.approx(0.126, rel=0.01)
