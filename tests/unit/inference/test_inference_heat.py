"""What heat does to readings over time: which sensors it is named with, and what is held out."""

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.inference.block_choice import chosen_by_blocks
from rtec.inference.diagnose import diagnose
from rtec.inference.results import Verdict
from rtec.metrology import measurement_of_columns

MINUTES = (30, 75, 50, 90, 70, 60, 45, 80, 40, 60)
SPEEDS = np.repeat([0.0, 2000.0, 0.0, 4500.0, 0.0, 3000.0, 0.0, 5000.0, 1500.0, 0.0], MINUTES)
STEP_S = 60.0
LAG_S, SLOW_S = 1200.0, 9000.0
SHIFT_UM_K, SLOW_UM = -8.0, 2.5


def behind(values, lag_s, steps=20):
    """Euler's method for a body that follows a course held from row to row."""
    state, found = values[0], []
    for value in values:
        found.append(state)
        for _ in range(steps):
            state += STEP_S / steps * (value - state) / lag_s
    return np.array(found)


def warm(seed=2, *, without=(), **more):
    """Ten hours of a spindle whose housing and whose slow frame displace it, with noise of 0.3 um."""
    rng = np.random.default_rng(seed)
    heat = (SPEEDS / 1000.0) ** (5 / 3)
    hours = np.arange(SPEEDS.size) * STEP_S / 3600.0
    room = 21.0 + np.sin(hours / 3.0) + np.cumsum(rng.normal(0.0, 0.02, hours.size))
    housing = 21.0 + 0.4 * behind(heat, 700.0) + 0.3 * (room - 21.0)
    motor = 22.0 + 0.9 * behind(heat, 300.0)
    moved = SHIFT_UM_K * behind(housing, LAG_S) + SLOW_UM * behind(heat, SLOW_S)
    columns = {
        "time_s": hours * 3600.0,
        "spindle_rpm": SPEEDS,
        "temperature_housing_degc": np.round(housing / 0.0625) * 0.0625,
        "temperature_motor_degc": np.round(motor / 0.0625) * 0.0625,
        "temperature_room_degc": np.round(room / 0.0625) * 0.0625,
        "ch1_um": moved - moved[0] + rng.normal(0.0, 0.3, hours.size),
        "ch2_um": 0.5 * (moved - moved[0]) + rng.normal(0.0, 0.3, hours.size),
        **more,
    }
    kept = {name: list(values) for name, values in columns.items() if not name.startswith(tuple(without))}
    return load_dataset(measurement_of_columns(kept), observe="ch1")


def followed(found):
    return {term.shape.sensor.removeprefix("temperature_"): term for term in found.model.terms}


def test_two_causes_of_heat_are_found_together_with_their_sensors_and_lags():
    found = diagnose(warm())
    assert found.model.names == ("thermal_shift",)
    terms = followed(found)
    assert set(terms) == {"housing", "spindle"}
    for name, lag_s, amplitude_um in (("housing", LAG_S, SHIFT_UM_K), ("spindle", SLOW_S, SLOW_UM)):
        assert terms[name].shape.lag == pytest.approx(lag_s, rel=0.15)
        assert 1e3 * terms[name].amplitudes[0] == pytest.approx(amplitude_um, rel=0.1)
    assert found.rms_heldout < 0.05 * found.rms_heldout_before


def test_without_its_sensors_the_speed_is_named_and_without_it_nothing():
    found = diagnose(warm(without=("temperature",)))
    assert found.model.names[0] == "thermal_shift"
    assert found.model.terms[0].shape.sensor == "spindle"
    bare = diagnose(warm(without=("temperature", "spindle")))
    assert (bare.verdict, bare.model.names) == (Verdict.INCONCLUSIVE, ())


def test_what_comes_in_time_has_no_name_while_the_spindle_changes_its_speed():
    reasons = dict(diagnose(warm()).not_testable)
    for name in ("cyclic", "warm_up", "lost_counts"):
        assert reasons[name] == "the spindle changes its speed: what comes in time may come of that"
    assert "warm_up" not in dict(diagnose(warm(without=("spindle",))).not_testable)


def test_blocks_of_one_speed_are_held_out_and_single_rows_beside_them():
    found = diagnose(warm())
    assert found.heldout_by == "block"
    assert np.unique(found.dataset.block).size == 10
    assert found.rms_heldout_rows < found.rms_heldout
    steady = diagnose(warm(without=("spindle",)))
    assert (steady.heldout_by, steady.rms_heldout_rows) == ("stretch", None)


def test_columns_are_chosen_by_what_blocks_left_out_say():
    """Against refits by least squares, one for each block and trial."""
    rng = np.random.default_rng(3)
    fold = np.repeat(np.arange(5), 12)
    columns = rng.normal(size=(6, 60)).cumsum(axis=1)
    observed = columns[2] - 0.5 * columns[5] + rng.normal(size=60)

    def error(chosen):
        table = np.vstack([np.ones(60), *(columns[k] for k in chosen)]).T
        left = 0.0
        for number in range(5):
            out = fold == number
            numbers = np.linalg.lstsq(table[~out], observed[~out], rcond=None)[0]
            left += float(np.sum((observed[out] - table[out] @ numbers) ** 2))
        return left

    tried, expected = [], []
    for _ in range(6):
        trials = {k: error([*tried, k]) for k in range(6) if k not in tried}
        tried.append(min(trials, key=lambda k: trials[k]))
        if error(tried) < 0.95**2 * error(expected):
            expected = list(tried)
    assert chosen_by_blocks(np.ones((1, 60)), columns, observed, fold, most=6) == expected
    apart = chosen_by_blocks(np.ones((1, 60)), columns, observed, fold, 6, lambda chosen, new: new not in (2, 5))
    assert not {2, 5} & set(apart)


@pytest.mark.parametrize("observe", ["deviation", "ch1"])
def test_temperatures_without_position_or_time_are_enough(observe):
    rng = np.random.default_rng(5)
    bed, air = 20.0 + 5.0 * rng.random((2, 40))
    moved = 4.0 * (bed - 20.0) + rng.normal(size=40)
    columns = {"temperature_bed_degc": bed, "temperature_air_degc": air, f"{observe}_um": moved}
    data = load_dataset(
        measurement_of_columns({name: list(values) for name, values in columns.items()}), observe=observe
    )
    found = diagnose(data)
    assert (found.verdict, found.model.names) == (Verdict.LIKELY, ("thermal_shift",))
    (term,) = found.model.terms
    assert (term.shape.sensor, term.shape.lag) == ("temperature_bed", 0.0)
    assert 1e3 * term.amplitudes[0] == pytest.approx(4.0, abs=0.4)
