"""The physics of what is hidden, against closed forms and a plain integration of its own."""

import functools
import math

import numpy as np
import pytest
from encoder_disc_oracle import deviations

from rtec.blind.circumstances import simulate_heat
from rtec.blind.draws import Draw, stream
from rtec.blind.game import play
from rtec.blind.plan import PITCH_MM, PLANS, draw_course
from rtec.blind.scenario import Scenario
from rtec.blind.static_errors import STATIC, grid_of

BASE = PLANS["base"]
RESOLUTION_MM = 2.1e-5
"""Two readings rounded to 0.01 um, and a coast that differs by a little from target to target."""


def columns(measurement):
    return {quantity: column.values for quantity, column in measurement.columns.items()}


@functools.cache
def nothing_hidden(plan, seed):
    return columns(play(Scenario(plan=PLANS[plan]), seed)[0])


def added(name, plan="base", seed=3, strength=3.0):
    """Return what an effect adds to the readings, the readings, and the effect's numbers."""
    with_it, secret = play(Scenario(names=(name,), strength_sigma=strength, plan=PLANS[plan]), seed)
    read, bare = columns(with_it), nothing_hidden(plan, seed)
    numbers = {p.name: p.value for p in secret.effects[0].parameters}
    return (read["actual"] - read["target"]) - (bare["actual"] - bare["target"]), with_it, numbers


def test_readings_come_in_steps_of_the_laser_and_targets_in_steps_of_the_control():
    read = columns(play(Scenario(), 1)[0])
    assert np.abs(read["actual"] * 1e5 - np.round(read["actual"] * 1e5)).max() < 1e-4
    assert np.abs(read["target"] * 1e3 - np.round(read["target"] * 1e3)).max() < 1e-6
    assert read["time"][0] == 0.0
    assert (np.diff(read["time"]) > 0).all()


def test_targets_meet_every_phase_of_the_screw():
    phases = np.unique(columns(play(Scenario(), 1)[0])["target"]) % PITCH_MM / PITCH_MM
    assert abs(np.exp(2j * np.pi * phases).mean()) < 0.5
    assert np.unique(np.floor(4 * phases)).size == 4


def test_play_leaves_the_slide_behind_whichever_way_it_goes():
    what, measurement, numbers = added("backlash")
    way = columns(measurement)["direction"]
    assert what == pytest.approx(-way * numbers["play"] * 0.5e-3, abs=RESOLUTION_MM)


def test_a_wrong_lead_adds_in_proportion_to_position():
    what, measurement, numbers = added("scale")
    x = columns(measurement)["target"]
    assert what - what[0] == pytest.approx(numbers["scale"] * 1e-6 * (x - x[0]), abs=RESOLUTION_MM)


def test_a_drift_is_linear_in_time():
    what, measurement, numbers = added("drift")
    hours = columns(measurement)["time"] / 3600
    assert what == pytest.approx(numbers["rate"] * 1e-3 * hours, abs=RESOLUTION_MM)


def test_a_warm_up_is_a_first_order_approach():
    what, measurement, numbers = added("warm_up")
    rest = 1 - np.exp(-columns(measurement)["time"] / numbers["time_constant"])
    assert what == pytest.approx(numbers["final"] * 1e-3 * rest, abs=RESOLUTION_MM + 1e-5 * abs(numbers["final"]))


def test_an_axis_heated_in_every_other_run_is_a_body_of_one_time_constant():
    course = draw_course(PLANS["temperature"], np.random.default_rng(4))
    time_s = 30.0 + 12.5 * np.arange(course.run.size)
    found = simulate_heat(course, time_s, np.random.default_rng(9))
    rng = np.random.default_rng(9)  # the same draws again
    room, rise = 20.0 + rng.uniform(-0.5, 0.5), rng.uniform(7.0, 11.0)
    runs = int(course.run[-1])
    hot = np.arange(runs) % 2 == rng.integers(2)
    tau_s = rng.uniform(0.4, 0.8) * time_s[-1] / runs
    ends = [time_s[course.run == run][-1] for run in range(1, runs + 1)]
    step = 0.05
    z, fine = room + (0.0 if hot[0] else 0.7 * rise), []
    for k in range(int(time_s[-1] / step) + 2):
        fine.append(z)
        run = sum(end <= (k + 0.5) * step for end in ends[:-1])
        z += step * (room + rise * hot[run] - z) / tau_s
    expected = np.interp(time_s, np.arange(len(fine)) * step, fine)
    assert [found.at("axis", t) for t in time_s] == pytest.approx(expected.tolist(), abs=2e-3)


def test_lost_counts_are_whole_and_stay_lost():
    what, _, numbers = added("lost_counts")
    first = int(numbers["before_reading"]) - 1
    assert what[:first] == pytest.approx(0.0, abs=RESOLUTION_MM)
    assert what[first:] == pytest.approx(numbers["counts"] * 1e-3, abs=2 * RESOLUTION_MM)


def test_lost_counts_move_the_axis_to_where_its_error_is_another():
    steep, _ = play(Scenario(names=("lost_counts", "interpolation"), strength_sigma=(20.0, 5.0)), 3)
    error_only, _ = play(Scenario(names=("interpolation",), strength_sigma=5.0), 3)
    _, _, numbers = added("lost_counts", strength=20.0)
    first = int(numbers["before_reading"]) - 1
    moved = columns(steep)["actual"] - columns(error_only)["actual"]
    # 100 counts are a twentieth of the scale's signal period, over which its error changes by micrometres
    assert np.abs(moved[first:] - numbers["counts"] * 1e-3).max() > 1e-3
    assert moved[:first] == pytest.approx(0.0, abs=RESOLUTION_MM)


def test_growth_follows_the_temperature_that_the_sensor_shows():
    what, measurement, numbers = added("thermal_growth", "temperature")
    read = columns(measurement)
    heat = read["temperature"]
    assert np.ptp(heat) > 3.0
    assert np.abs(heat * 100 - np.round(heat * 100)).max() < 1e-9
    grown = numbers["expansion"] * 1e-6 * read["target"] * (heat - 20.0)
    assert what == pytest.approx(grown, abs=numbers["expansion"] * 1e-6 * 320 * 0.1)  # five sigma of the sensor
    assert np.std(what - grown) > 0  # it is the true temperature that counts, not the one shown
    cold, hot = (heat[read["run"] == run].mean() for run in (1, 2))
    assert abs(hot - cold) > 2.0


def test_a_shift_follows_the_temperature_at_every_target_alike():
    what, measurement, numbers = added("thermal_shift", "temperature")
    heat = columns(measurement)["temperature"]
    assert what == pytest.approx(numbers["shift"] * 1e-3 * (heat - 20.0), abs=abs(numbers["shift"]) * 1e-3 * 0.1)
    assert np.ptp(what) > 3e-3


def twisted(released, distance_mm, course):
    """Return a first-order element along the way from reading to reading, in small steps."""
    far = BASE.start_mm + 0.4 * BASE.span_mm
    stops = [(far, -1)]
    for i, (x, way) in enumerate(zip(course.target_mm, course.direction, strict=True)):
        if i == 0 or way != course.direction[i - 1] or course.run[i] != course.run[i - 1]:
            stops.append((x - way * BASE.overshoot_mm, -1))
        stops.append((x, i))
    z, here, last, out = 0.0, 0.0, 1.0, np.empty(course.target_mm.size)
    for there, reading in stops:
        way = math.copysign(1.0, there - here)
        if way != last and released:
            z = 0.0
        last = way
        steps = max(int(abs(there - here) / 0.02), 1)
        for _ in range(steps):
            z += (way - z) * abs(there - here) / steps / distance_mm
        here = there
        if reading >= 0:
            out[reading] = z
    return out


@pytest.mark.parametrize("seed", [0, 1])
def test_wind_up_is_a_first_order_element_along_the_path(seed):
    what, measurement, numbers = added("windup", seed=seed)
    _, secret = play(Scenario(names=("windup",)), seed)
    released = "from nothing" in secret.effects[0].description
    course = draw_course(BASE, stream(seed, Draw.COURSE))
    assert course.target_mm.tolist() == columns(measurement)["target"].tolist()
    expected = -numbers["final"] * 1e-3 * twisted(released, numbers["distance"], course)
    assert what == pytest.approx(expected, abs=0.01e-3 * numbers["final"])


def test_both_kinds_of_wind_up_occur():
    said = {play(Scenario(names=("windup",)), seed)[1].effects[0].description for seed in range(6)}
    assert len(said) == 2


def test_a_bump_moves_on_from_run_to_run():
    what, measurement, numbers = added("moving_bump")
    read = columns(measurement)
    places = []
    for run in range(1, 6):
        own = read["run"] == run
        weight = np.abs(what[own])
        places.append(float(weight @ read["target"][own] / weight.sum()))
        there, back = (what[own & (read["direction"] == way)] for way in (1.0, -1.0))
        assert there == pytest.approx(back[::-1], abs=RESOLUTION_MM)
    steps = np.diff(places) * np.sign(numbers["to"] - numbers["from"])
    assert (steps > 15.0).all()


def test_lost_motion_grows_with_the_rest_before_the_reversal():
    what, measurement, numbers = added("dwell_reversal", "dwell")
    dwell = measurement.unknown["dwell_s"]
    lost = numbers["largest"] * (1 - np.exp(-dwell / numbers["time_constant"]))
    assert what == pytest.approx(-0.5e-3 * columns(measurement)["direction"] * lost, abs=RESOLUTION_MM)
    assert np.unique(dwell).size == 5
    base, _ = play(Scenario(), 3)
    assert "dwell_s" not in base.unknown
    order = [
        np.argsort(play(Scenario(plan=PLANS["dwell"]), seed)[0].unknown["dwell_s"][::42]).tolist()
        for seed in range(3)
    ]
    assert len({tuple(one) for one in order}) == 3


@pytest.mark.parametrize("name", ["cyclic", "interpolation"])
@pytest.mark.parametrize("seed", range(2))
def test_a_periodic_error_comes_back_after_its_period(name, seed):
    error = STATIC[name](BASE, stream(seed, Draw.EFFECT, name))
    period = next(p.value for p in error.parameters if p.name == "period")
    x = grid_of(BASE)
    later = np.interp(x + period, x, error.forward_mm)
    inside = x + period < x[-1]
    size = np.ptp(error.forward_mm)
    assert size > 0
    assert later[inside] == pytest.approx(error.forward_mm[inside], abs=0.003 * size)


def test_an_encoder_reads_the_line_that_lies_under_its_head():
    plan = PLANS["turn"]
    error = STATIC["eccentricity"](plan, stream(1, Draw.EFFECT, "eccentricity"))
    rng = stream(1, Draw.EFFECT, "eccentricity")
    off, at = rng.uniform(0.02, 0.15), rng.uniform()
    oval = off * rng.uniform(0.5, 1.5)
    x = grid_of(plan)[::400]
    expected = deviations(np.radians(x), off * np.exp(2j * np.pi * at), oval, np.pi * rng.uniform())
    curve = error.forward_mm[::400]
    slope, level = np.polyfit(expected, curve, 1)
    assert curve == pytest.approx(slope * expected + level, abs=1e-9 * np.ptp(curve))
    assert slope > 0.0
    assert np.array_equal(error.forward_mm, error.reverse_mm)


def test_a_gear_of_a_rotary_axis_turns_whole_times_in_a_turn():
    for seed in range(5):
        error = STATIC["cyclic"](PLANS["turn"], stream(seed, Draw.EFFECT, "cyclic"))
        (period,) = [p for p in error.parameters if p.name == "period"]
        assert period.unit == "deg"
        assert 360.0 / period.value == pytest.approx(round(360.0 / period.value))


@pytest.mark.parametrize("seed", range(2))
def test_a_chirp_has_no_period(seed):
    error = STATIC["chirped_cyclic"](BASE, stream(seed, Draw.EFFECT, "chirped_cyclic"))
    numbers = {p.name: p.value for p in error.parameters}
    x, y = grid_of(BASE), error.forward_mm
    rising = x[1:][(y[:-1] < 0) & (y[1:] >= 0)]
    gaps = np.diff(rising)
    assert gaps[:3].mean() == pytest.approx(numbers["period_at_start"], rel=0.05)
    assert gaps[-3:].mean() == pytest.approx(numbers["period_at_end"], rel=0.05)
    assert max(gaps) / min(gaps) > 1.7


@pytest.mark.parametrize("seed", range(2))
def test_maps_are_what_they_claim(seed):
    x = grid_of(BASE)
    lead = STATIC["pitch_map"](BASE, stream(seed, Draw.EFFECT, "pitch_map"))
    assert np.abs(np.polyfit(x - x.mean(), lead.forward_mm * 1e3, 1)).max() < 1e-9
    assert np.array_equal(lead.forward_mm, lead.reverse_mm)
    at, y = x[::50], lead.forward_mm[::50]
    for period in np.geomspace(0.1, 2.0, 60) * BASE.span_mm:  # no sinusoid explains it
        waves = np.stack([np.ones_like(at), np.sin(2 * np.pi * at / period), np.cos(2 * np.pi * at / period)], axis=1)
        left = y - waves @ np.linalg.lstsq(waves, y, rcond=None)[0]
        assert np.var(left) > 0.23 * np.var(y)
    assert np.abs(np.diff(lead.forward_mm, 2)).max() < 1e-3 * np.ptp(lead.forward_mm)  # smooth
    worn = STATIC["backlash_map"](BASE, stream(seed, Draw.EFFECT, "backlash_map"))
    play_mm = worn.reverse_mm - worn.forward_mm
    assert play_mm.min() >= 0.0
    assert np.std(play_mm) > 0.4 * np.sqrt(np.mean(play_mm**2))
    assert worn.reverse_mm + worn.forward_mm == pytest.approx(0.0, abs=1e-12)
    tabled = STATIC["backlash_map"](PLANS["right_forward"], stream(seed, Draw.EFFECT, "backlash_map"))
    assert not tabled.forward_mm.any()
    assert tabled.reverse_mm == pytest.approx(play_mm)


def lags(names, seed=2):
    measurement, secret = play(Scenario(names=names, plan=PLANS["moving"]), seed)
    read = columns(measurement)
    speed, time_s = read["velocity"], read["time"]
    design = np.stack([np.ones(time_s.size), -speed, -np.gradient(speed, time_s)], axis=1)
    found = np.linalg.lstsq(design, read["actual"] - read["target"], rcond=None)[0]
    numbers = {p.name: p.value for hidden in secret.effects for p in hidden.parameters}
    return found[1] * 1e3, found[2] * 1e6, numbers  # ms, ms^2


def test_a_moving_log_shows_the_lags_of_the_loop():
    delay_ms, bare_ms2, _ = lags(())
    assert abs(delay_ms) < 0.005
    assert abs(bare_ms2) < 2.0
    delay_ms, lag_ms2, numbers = lags(("servo_lag",))
    assert delay_ms == pytest.approx(numbers["delay"], rel=0.03)
    assert lag_ms2 == pytest.approx(bare_ms2, abs=0.6)  # a pure delay; with the same noise in both
    delay_ms, lag_ms2, numbers = lags(("acceleration_lag",))
    assert abs(delay_ms) < 0.01
    assert lag_ms2 == pytest.approx(numbers["lag"], rel=0.06)


def test_a_moving_log_is_what_the_axis_did():
    measurement, _ = play(Scenario(plan=PLANS["moving"]), 2)
    read = columns(measurement)
    assert set(read) == {"run", "time", "target", "actual", "velocity"}
    assert np.diff(read["time"]) == pytest.approx(0.02, abs=1e-9)
    slope = np.gradient(read["target"], read["time"])
    # a jerk of 2000 mm/s3 within 20 ms; the ends have one neighbour only
    assert slope[1:-1] == pytest.approx(read["velocity"][1:-1], abs=0.15)
    assert {1.0, 2.0} == set(read["run"])
    speeds = np.abs(read["velocity"])
    for feed in (5.0, 20.0, 60.0):
        assert (np.abs(speeds - feed) < 1e-3).mean() > 0.02
    assert np.std(read["actual"] - read["target"]) == pytest.approx(2e-3, rel=0.05)


def test_a_screw_that_warms_up_grows_in_proportion_to_position():
    what, measurement, numbers = added("warm_up_growth")
    read = columns(measurement)
    rest = 1 - np.exp(-read["time"] / numbers["time_constant"])
    grown = numbers["growth"] * 1e-6 * read["target"] * rest
    assert what == pytest.approx(grown, abs=RESOLUTION_MM + 1e-5 * numbers["growth"])


def test_a_reflector_is_clamped_anew_before_each_run():
    what, measurement, numbers = added("run_offset")
    run = columns(measurement)["run"]
    zeros = np.array([what[run == k].mean() for k in np.unique(run)])
    assert np.ptp(zeros) == pytest.approx(1e-3 * numbers["spread"], abs=RESOLUTION_MM)
    assert what == pytest.approx(zeros[run.astype(int) - 1], abs=RESOLUTION_MM)
    assert zeros[0] != zeros[-1]


def test_the_air_of_each_day_lengthens_the_waves():
    what, measurement, numbers = added("refraction", "weather")
    read = columns(measurement)
    # 3.7 hPa are a micrometre a metre, 10 % of humidity 0.1 um
    ppm = (read["pressure"] - 1013.25) / 3.73 - 0.0084 * (read["humidity"] - 50.0)
    assert what == pytest.approx(numbers["share"] * 1e-6 * ppm * read["target"], abs=0.06 * np.abs(what).max())
    assert np.ptp(read["pressure"]) > 20.0
    dead, again, length = added("dead_path", "weather")
    assert dead == pytest.approx(length["length"] * what / numbers["share"] / read["target"], abs=3e-4)
    assert columns(again)["pressure"].tolist() == read["pressure"].tolist()


def test_a_slide_that_sticks_catches_up_behind_each_reversal():
    what, measurement, numbers = added("reversal_spike", "dense")
    read = columns(measurement)
    way, x = read["direction"], read["target"]
    starts = {1.0: x.min() - PLANS["dense"].overshoot_mm, -1.0: x.max() + PLANS["dense"].overshoot_mm}
    gone = np.array([abs(place - starts[d]) for place, d in zip(x, way, strict=True)])
    expected = numbers["spike"] * 0.5e-3 * way * np.exp(-gone / numbers["distance"])
    assert what == pytest.approx(expected, abs=0.02 * abs(numbers["spike"]) * 1e-3)
