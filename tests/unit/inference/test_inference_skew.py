"""A lag of the servo or a skew of the log: delays, lags of first order and fractions of a sample are made."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

import rtec
from rtec.dataset.load import load_dataset
from rtec.effects import effect_named
from rtec.inference import skew
from rtec.inference.fit import fit_model
from rtec.inference.model import Model, Term
from rtec.metrology import measurement_of_columns

STEP_S = 0.004
FINE = 40
"""Points of the emulation in a sample."""
EDGE = Path(__file__).resolve().parents[4] / "shared" / "data" / "logs" / "sinumerik_edge_example.json.gz"


def moved(rows=1500):
    """A smooth motion to and fro, finely sampled."""
    t = np.arange(rows * FINE) * STEP_S / FINE
    return t, 40.0 * np.sin(2 * np.pi * 0.7 * t) + 6.0 * np.sin(2 * np.pi * 2.9 * t + 1.0)


def delayed(command, samples):
    return np.concatenate([np.full(round(samples * FINE), command[0]), command])[: command.size]


def first_order(command, samples):
    share = 1.0 - np.exp(-1.0 / (samples * FINE))
    return lfilter([share], [1.0, share - 1.0], command - command[0]) + command[0]


def log(follow, samples, sigma=0.002):
    t, command = moved()
    actual = follow(command, samples)[::FINE]
    noise = np.random.default_rng(3).normal(0.0, sigma, actual.size)
    return {"time_s": t[::FINE], "target_mm": command[::FINE], "actual_mm": actual + noise}


def skew_found(columns):
    data = load_dataset(measurement_of_columns(columns))
    begun = Model(observe=data.observe, units=data.units).with_terms([Term(effect=effect_named("servo_lag"))])
    return skew.skew_of(data, fit_model(data, begun))


@pytest.mark.parametrize("samples", [1, 3, 7])
def test_a_delay_by_whole_samples_may_be_a_skew_of_the_log(samples):
    found = skew_found(log(delayed, samples))
    assert found.samples == samples
    assert found.rms_shifted == pytest.approx(0.002, rel=0.05)
    assert found.rms_lag > found.rms_rest
    assert abs(found.lag_s) < 0.02 * STEP_S


@pytest.mark.parametrize(
    "follow, samples",
    [(delayed, 0.5), (delayed, 2.5), (delayed, 14), (first_order, 3), (first_order, 7), (first_order, 2.5)],
)
def test_other_lags_are_the_servos(follow, samples):
    """Half a sample, a fraction, more samples than a log is ever shifted by, and a lag of first order."""
    assert skew_found(log(follow, samples)) is None


def test_a_diagnosis_says_both_and_how_to_tell_them_apart():
    found = rtec.diagnose(rtec.read(log(delayed, 3)))
    assert found["verdict"] == "TIED"
    assert [c["tied_with"] for c in found["candidates"] if c["effect"] == "servo_lag"] == [["skew_of_log"]]
    assert any("a shift of the actual channel by 3 samples explains it as well" in note for note in found["notes"])
    assert found["suggested_experiment"] == skew.EXPERIMENT


def test_the_lag_of_a_servo_keeps_its_name():
    found = rtec.diagnose(rtec.read(log(first_order, 3)))
    assert "servo_lag" in found["effects"]
    assert found["verdict"] in ("NAMED", "LIKELY")
    assert not any("skew" in note for note in found["notes"])


@pytest.mark.skipif(not EDGE.exists(), reason="the controller's log is not at hand")
@pytest.mark.parametrize("axis", ["X", "Y"])
def test_a_controllers_log_is_late_by_four_cycles(axis):
    with gzip.open(EDGE) as file:
        found = json.load(file)
    names = [f"{one['Name'].split('|')[0]} {one['Axis']}" for one in found["Header"]["SignalListHFData"]]
    rows = np.array([row for part in found["Payload"] for row in part.get("HFData", [])])
    columns = {
        "time_s": 0.002 * (rows[:, 0] - rows[0, 0]),
        "target_mm": rows[:, names.index(f"DES_POS {axis}1")],
        "actual_mm": rows[:, names.index(f"ENC_POS {axis}1")],
    }
    one = skew_found(columns)
    assert one.samples == 4
    assert one.rms_shifted < 0.04 * one.rms_before
