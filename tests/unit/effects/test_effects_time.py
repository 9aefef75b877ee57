"""Effects of time and temperature, against simulations that know nothing of columns."""

from dataclasses import replace

import numpy as np
import pytest

from rtec.effects import Conditions, HeatShape, Shape, Units
from rtec.effects.drift import Drift
from rtec.effects.lost_counts import LostCounts, StepShape
from rtec.effects.run_offset import RunOffset, RunShape
from rtec.effects.thermal_growth import GrowthShape, ThermalGrowth
from rtec.effects.thermal_shift import ThermalShift
from rtec.effects.warm_up import WarmShape, WarmUp
from rtec.effects.warm_up_growth import WarmGrowthShape, WarmUpGrowth
from rtec.errors import ArgumentError


def test_a_body_that_is_heated_from_the_start(bidirectional):
    c = bidirectional()
    final, constant, steps = 0.012, 300.0, 200
    grown, found = 0.0, [0.0]
    for begin, end in zip(c.time_s[:-1], c.time_s[1:], strict=True):
        for _ in range(steps):
            grown += (end - begin) / steps * (final - grown) / constant
        found.append(grown)
    assert WarmUp().contribution(c, WarmShape(constant), [final]) == pytest.approx(np.array(found), abs=1e-6)


def test_a_refit_of_the_time_constant_ends_with_the_measurement(bidirectional):
    c = bidirectional()
    (free,) = WarmUp().tunables(c, WarmShape(300.0))
    assert (free.low, free.high) == (pytest.approx(200.0), pytest.approx(450.0))
    (ended,) = WarmUp().tunables(c, WarmShape(900.0))
    assert ended.high == c.time_s[-1]


def test_growth_follows_only_sensors_that_change(bidirectional):
    heat = {"screw": np.linspace(20.0, 25.0, 210), "air": np.full(210, 20.0), "bed": np.linspace(20.0, 20.6, 210)}
    c = bidirectional(temperatures=heat)
    assert list(dict.fromkeys(shape.sensor for shape in ThermalGrowth().shapes(c))) == ["screw", "bed"]
    with pytest.raises(ArgumentError, match="did you mean 'screw'"):
        ThermalGrowth().columns(c, GrowthShape("scrw"))


def test_a_counter_that_loses_counts(bidirectional):
    c = bidirectional()
    counter, shown = 0, []
    for index, x in enumerate(c.position):
        if index == 77:
            counter += 4
        shown.append(x + counter * 0.001 - x)
    moment = (c.time_s[76] + c.time_s[77]) / 2
    assert LostCounts().contribution(c, StepShape(moment), [0.004]) == pytest.approx(np.array(shown), abs=1e-12)


def test_a_step_is_looked_for_between_all_readings_but_at_the_ends(bidirectional):
    c = bidirectional()
    after = [int((c.time_s > shape.moment).sum()) for shape in LostCounts().shapes(c)]
    assert after[0] == 208
    assert after[-1] == 2
    assert set(after) == set(range(2, 209))


def test_many_readings_are_scanned_in_part_and_the_rest_is_found_around_the_best(bidirectional):
    rows = 40 * 210
    times = np.arange(rows) * 0.01
    c = bidirectional(runs=200, time_s=times)
    assert c.rows == rows
    shapes = LostCounts().shapes(c)
    assert len(shapes) <= 1200
    best = shapes[len(shapes) // 2]
    near = [shape.moment for shape in LostCounts().variants(c, best)]
    assert best.moment in near
    assert near == sorted(near)
    place = near.index(best.moment)
    assert near[place + 1] - best.moment == pytest.approx(0.01)


def test_the_rate_is_one_an_hour_or_a_reading():
    (hourly,) = Drift().amplitudes(Shape(), Units("mm", "mm", "s"))
    assert (hourly.unit, hourly.factor) == ("um/h", 3.6e6)
    (row,) = Drift().amplitudes(Shape(), Units("mm", "mm", "reading"))
    assert (row.unit, row.factor) == ("um/reading", 1e3)


@pytest.mark.parametrize(
    "effect, change, reason",
    [
        (WarmUp(), {"time_s": None}, "no time column"),
        (WarmUp(), {"time_s": np.tile([0.0, 1.0, 1.0], 70)}, "2 moments only"),
        (LostCounts(), {"time_s": None}, "no time column"),
        (LostCounts(), {"time_s": np.tile([0.0, 1.0, 2.0], 70)}, "3 moments only"),
        (Drift(), {"time_s": np.full(210, 3.0)}, "one moment only"),
        (ThermalGrowth(), {}, "no temperature column"),
        (
            ThermalGrowth(),
            {"temperatures": {"t": np.linspace(20.0, 25.0, 210)}, "position_unit": "s"},
            "no positions: what grows with them cannot be seen",
        ),
        (
            ThermalShift(),
            {"temperatures": {"t": np.linspace(20.0, 20.02, 210)}},
            "the temperature changes by 0.02 degC only: at least 0.5 needed",
        ),
        (
            ThermalGrowth(),
            {"temperatures": {"t": np.linspace(20.0, 25.0, 210)}, "position": np.full(210, 3.0)},
            "one position only",
        ),
    ],
)
def test_what_the_data_cannot_show(bidirectional, effect, change, reason):
    assert reason in effect.untestable(bidirectional(**change))


def test_a_screw_that_warms_up_grows_from_its_fixed_end(bidirectional):
    """Newton's law of heating in small steps, times the length that grows."""
    c, tau = bidirectional(), 900.0
    share, grown = 0.0, []
    at = np.arange(0.0, c.time_s[-1] + 2.0, 0.5)
    for _ in at:
        grown.append(share)
        share += 0.5 * (1.0 - share) / tau
    expected = 2e-5 * c.position * np.interp(c.time_s, at, grown)
    found = WarmUpGrowth().contribution(c, WarmGrowthShape(tau), [2e-5])
    assert found == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())
    assert WarmUpGrowth().amplitudes(WarmGrowthShape(tau), Units("mm", "mm", "s"))[0].unit == "um/m"


def test_the_zero_of_a_run_is_counted_from_that_of_the_first(bidirectional):
    c = bidirectional()
    runs = np.unique(c.run)
    (shape,) = RunOffset().shapes(c)
    assert shape == RunShape(tuple(runs.tolist()))
    zeros = np.linspace(0.003, -0.004, runs.size - 1)
    added = RunOffset().contribution(c, shape, zeros)
    means = np.array([added[c.run == run].mean() for run in runs])
    assert means - means[0] == pytest.approx(np.append(0.0, zeros))
    assert [a.name for a in RunOffset().amplitudes(RunShape((4, 9, 2)), Units("mm", "mm", "s"))] == ["run_9", "run_2"]


def test_offsets_of_runs_need_several_and_not_too_many():
    def runs(count):
        return Conditions(position=np.zeros(count), position_unit="mm", run=np.arange(count))

    assert RunOffset().untestable(runs(1)) == "one run only"
    assert RunOffset().untestable(runs(2)) is None
    assert RunOffset().untestable(runs(40)) is None
    assert "41 runs: at most 40" in RunOffset().untestable(runs(41))


def followed(time_s, heat, lag):
    """A body of one time constant in small steps."""
    at = np.arange(0.0, time_s[-1] + 1.0, 0.05)
    goal, state, found = np.interp(at, time_s, heat), heat[0], []
    for value in goal:
        found.append(state)
        state += 0.05 * (value - state) / lag
    return np.interp(time_s, at, found)


def test_what_grows_may_lag_behind_its_sensor(bidirectional):
    c = bidirectional(temperatures={"screw": 20.0 + 5.0 * np.sin(np.arange(210) / 30.0)})
    lag = 400.0
    body = followed(c.time_s, c.temperatures["screw"], lag) - 20.0
    shift = ThermalShift().contribution(c, HeatShape("screw", lag), [0.004])
    assert shift == pytest.approx(0.004 * body, abs=0.004 * 0.02)
    growth = ThermalGrowth().contribution(c, GrowthShape("screw", lag), [1e-5])
    assert growth == pytest.approx(1e-5 * c.position * body, abs=1e-5 * 400.0 * 0.02)
    with pytest.raises(ArgumentError, match="without a time column"):
        ThermalShift().columns(replace(c, time_s=None), HeatShape("screw", lag))
    part = np.sort(np.random.default_rng(0).choice(210, 60, replace=False))
    drawn = replace(c.take(part), whole=c)
    assert ThermalShift().columns(drawn, HeatShape("screw", lag))[:, 0] == pytest.approx(shift[part] / 0.004)


def test_a_fixed_point_elsewhere_is_growth_from_there(bidirectional):
    heat = {"screw": np.linspace(18.0, 26.0, 210)}
    c = bidirectional(temperatures=heat, reference_temperature_degc=19.0)
    shape = GrowthShape("screw", elsewhere=True)
    found = ThermalGrowth().contribution(c, shape, [1.2e-5, -1.2e-5 * 150.0])
    assert found == pytest.approx(1.2e-5 * (c.position - 150.0) * (c.temperatures["screw"] - 19.0))
    read = {n: (v, u) for n, v, u in ThermalGrowth().summary(shape, [1.2e-5, -1.8e-3], Units("mm", "mm", "s"))}
    assert read["fixed_point"] == (pytest.approx(150.0), "mm")
    assert read["expansion"] == (pytest.approx(12.0), "um/m/K")


def test_lags_are_tried_up_to_a_quarter_of_a_timed_measurement(bidirectional):
    c = bidirectional(temperatures={"bed": np.linspace(18.0, 26.0, 210), "head": np.linspace(25.0, 20.0, 210)})
    for effect in (ThermalShift(), ThermalGrowth()):
        tried = {shape.lag for shape in effect.shapes(c) if shape.sensor == "head"}
        assert (min(tried), max(tried)) == (0.0, pytest.approx(0.25 * np.ptp(c.time_s)))
        assert {shape.lag for shape in effect.shapes(replace(c, time_s=None))} == {0.0}
        plain, lagged = (next(s for s in effect.shapes(c) if (s.lag > 0.0) is lags) for lags in (False, True))
        assert effect.tried(c, plain) == 2
        assert effect.tried(c, lagged) >= 2 * len(tried)


def test_what_a_spindle_heats_follows_its_speed(bidirectional):
    """Against a body in small steps, heated by n^(5/3) of the speed that each reading holds until the next."""
    c = bidirectional(spindle_rpm=np.repeat([0.0, -3000.0, 6000.0, 1000.0, 0.0, 0.0], 35))
    lag, step_s = 600.0, 0.5
    at = np.arange(0.0, c.time_s[-1] + step_s, step_s)
    heat = (np.abs(c.spindle_rpm) / 1000.0) ** (5.0 / 3.0)
    held = heat[np.searchsorted(c.time_s, at, side="right") - 1]
    state, body = held[0], []
    for value in held:
        body.append(state)
        state += step_s * (value - state) / lag
    expected = np.interp(c.time_s, at, body)
    shape = HeatShape("spindle", lag)
    assert ThermalShift().contribution(c, shape, [0.002]) == pytest.approx(0.002 * expected, abs=0.002 * 0.02)
    grown = ThermalGrowth().contribution(c, GrowthShape("spindle", lag), [1e-6])
    assert grown == pytest.approx(1e-6 * c.position * expected, abs=1e-6 * 400.0 * 0.02)
    assert ThermalShift().columns(c, HeatShape("spindle"))[:, 0] == pytest.approx(heat)
    assert {shape.sensor for shape in ThermalShift().shapes(c)} == {"spindle"}
    units = Units("mm", "mm", "s")
    (shift,) = ThermalShift().amplitudes(shape, units)
    growth, at_zero = ThermalGrowth().amplitudes(GrowthShape("spindle", elsewhere=True), units)
    assert (shift.name, shift.unit, growth.name, growth.unit, at_zero.unit) == (
        "at_1000_rpm", "um", "at_1000_rpm", "um/m", "um",
    )  # fmt: skip


def test_a_spindle_at_one_speed_shows_no_heat(bidirectional):
    steady = bidirectional(spindle_rpm=np.full(210, 3000.0))
    assert "never changes its speed" in ThermalShift().untestable(steady)
    assert "never changes its speed" in ThermalGrowth().untestable(steady)
    assert WarmUp().untestable(steady) is None  # what warms up at one speed goes to one end
