"""A published positioning test, figures of VDI/DGQ 3441, and the uncertainty of both kinds of axis."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.metrology import Readings, UncertaintyInputs, positioning_figures, positioning_uncertainty, vdi_figures
from rtec.metrology.figures import Coordinate
from rtec.metrology.readings import RotaryReadings
from tests.oracles.iso230_oracle import oracle_figures
from tests.oracles.vdi3441_oracle import oracle_vdi

# Readings of a slit of the BIFROST instrument of the European Spallation Source, and the figures that were published
# with them: A. Sandstrom, ecmccomgui, tools/iso230-2/example_report_ISO230_2.md (2 November 2021, commit a258c9d),
# https://github.com/anderssandstrom/ecmccomgui
TARGETS = (15.0, 25.0, 35.0, 45.0, 55.0)
UP = (
    (15.00067, 15.00169, 15.0021, 15.00393, 15.00332),
    (24.99964, 24.99964, 24.99862, 25.00005, 24.99924),
    (35.00025, 34.99291, 34.99719, 34.99964, 34.99536),
    (44.9978, 44.99943, 44.9982, 44.99881, 44.99657),
    (55.00289, 55.00085, 55.00717, 55.00819, 55.00044),
)
DOWN = (
    (15.00475, 15.00475, 15.00495, 15.00638, 15.00679),
    (24.9974, 24.99842, 24.9974, 24.99822, 24.99862),
    (34.98965, 34.9925, 34.99332, 34.99413, 34.99332),
    (44.9978, 44.99841, 44.99881, 44.99841, 45.00024),
    (55.00268, 55.00289, 55.00696, 55.00574, 55.00289),
)
PUBLISHED_MM = {
    "A": 0.02197, "A_forward": 0.02008, "A_backward": 0.0191,
    "R": 0.01434, "R_forward": 0.01434, "R_backward": 0.00794,
    "E_forward": 0.00684, "E_backward": 0.01294, "M": 0.00924, "B": 0.00449, "B_mean": 0.00037,
}  # fmt: skip
PUBLISHED_MEANS_MM = (0.00234, -0.00056, -0.00293, -0.00184, 0.0039), (0.00552, -0.00199, -0.00742, -0.00127, 0.00423)
PUBLISHED_R_MM = 0.00775, 0.00366, 0.01404, 0.00457, 0.01434
ROUNDING_MM = 1.001e-5
"""Of what is published: the last of five decimals; A takes in several rounded numbers."""


def published():
    """Return the readings, forward and backward in turn."""
    target, deviation, direction, run = [], [], [], []
    for cycle in range(5):
        for way, table in ((1, UP), (-1, DOWN)):
            for index in range(5) if way > 0 else range(4, -1, -1):
                target.append(TARGETS[index])
                deviation.append(table[index][cycle] - TARGETS[index])
                direction.append(way)
                run.append(cycle + 1)
    return Readings(target_mm=target, deviation_mm=deviation, direction=direction, run=run)


def test_published_readings_give_the_published_figures():
    figures = positioning_figures(published()).to_dict("mm")
    assert {key: figures[key] for key in PUBLISHED_MM} == pytest.approx(PUBLISHED_MM, abs=ROUNDING_MM)
    up, down = PUBLISHED_MEANS_MM
    at = figures["at_targets"]
    assert [row["mean_forward"] for row in at] == pytest.approx(up, abs=ROUNDING_MM)
    assert [row["mean_backward"] for row in at] == pytest.approx(down, abs=ROUNDING_MM)
    assert [row["R"] for row in at] == pytest.approx(PUBLISHED_R_MM, abs=ROUNDING_MM)
    # the E that is printed there, 0.00845, is not the range of the printed means; clause 3 asks for that range
    assert figures["E"] == pytest.approx(max(up + down) - min(up + down), abs=ROUNDING_MM)


def test_published_readings_against_plain_sums():
    readings = published()
    columns = readings.target_mm.tolist(), readings.deviation_mm.tolist(), readings.direction.tolist()
    figures = positioning_figures(readings)
    expected = oracle_figures(*columns)
    assert {key: figures.to_dict("mm")[key] for key in expected} == pytest.approx(expected, rel=1e-9)
    vdi = vdi_figures(figures)
    assert vdi.to_dict(1.0) == pytest.approx(oracle_vdi(*columns), rel=1e-9)


def test_vdi_figures_of_random_readings_against_plain_sums():
    rng = np.random.default_rng(3)
    for runs, targets in ((2, 2), (5, 11), (7, 3)):
        place = np.arange(targets) * 12.5
        target = np.tile(np.concatenate((place, place[::-1])), runs)
        readings = Readings(
            target_mm=target,
            deviation_mm=rng.normal(0.0, 0.01, target.size) + 0.003 * np.sin(target),
            direction=np.tile(np.repeat([1, -1], targets), runs),
            run=np.repeat(np.arange(1, runs + 1), 2 * targets),
        )
        expected = oracle_vdi(target.tolist(), readings.deviation_mm.tolist(), readings.direction.tolist())
        assert vdi_figures(positioning_figures(readings)).to_dict(1.0) == pytest.approx(expected, rel=1e-9)


def test_one_direction_or_one_run_has_no_vdi_figures():
    one_way = Readings(target_mm=[0, 1, 0, 1], deviation_mm=[1, 2, 3, 4], direction=[1] * 4, run=[1, 1, 2, 2])
    one_run = Readings(target_mm=[0, 1, 1, 0], deviation_mm=[1, 2, 3, 4], direction=[1, 1, -1, -1], run=[1] * 4)
    assert vdi_figures(positioning_figures(one_way)) is None
    assert vdi_figures(positioning_figures(one_run)) is None


def test_uncertainty_worked_out_by_hand():
    # travel 40 mm, five runs; all in mm
    inputs = UncertaintyInputs.read(
        {
            "device_uncertainty": "0.5 um/m",  # 0.5e-6 * 40
            "misalignment": "1 mm",  # 1 / 80 = 0.0125 at most, rectangular from 0
            "temperature_uncertainty": "0.5 K",
            "expansion": "12 um/m/K",  # 0.5 * 12e-6 * 40 = 2.4e-4, rectangular to both sides
            "expansion_uncertainty": "2 um/m/K",
            "off_reference": "3 K",  # 3 * 2e-6 * 40 = 2.4e-4
            "eve": "1.2 um",
            "axis": "x",
        },
        Coordinate.LINEAR,
    )
    found = positioning_uncertainty(positioning_figures(published()), inputs)
    root = math.sqrt(3)
    parts = {
        "device": 2e-5, "misalignment": 0.0125 / root, "thermometer": 2 * 2.4e-4 / root,
        "expansion": 2 * 2.4e-4 / root, "eve": 1.2e-3 / root,
    }  # fmt: skip
    assert found.contributions == pytest.approx(parts, rel=1e-12)
    length = sum(value**2 for name, value in parts.items() if name != "eve")
    drift = parts["eve"] ** 2
    squares = {
        "B": 2 * drift / 5, "E": length + 2 * drift / 5, "M": length + drift / 5, "R_forward": 4 * drift,
        "R": 4 * drift + 2 * drift / 5, "A": length + 2 * drift / 5 + 4 * drift,
    }  # fmt: skip
    assert {key: found.figures[key] ** 2 for key in squares} == pytest.approx(squares, rel=1e-12)
    assert found.figures["A_backward"] == found.figures["A"]
    assert found.missing == ()
    assert found.spread_share == pytest.approx(1 / math.sqrt(8))


def test_drift_of_the_surroundings_acts_as_the_model_says():
    # readings of a perfect axis in surroundings that shift each of them: U is twice the spread of the figures
    rng, eve, runs = np.random.default_rng(1), 1.0, 5
    target = np.tile([0, 10, 10, 0], runs)
    found = []
    for _ in range(1500):
        readings = Readings(
            target_mm=target, deviation_mm=rng.uniform(-eve / 2, eve / 2, target.size),
            direction=np.tile([1, 1, -1, -1], runs), run=np.repeat(range(runs), 4),
        )  # fmt: skip
        at = positioning_figures(readings).at_targets
        found.append((at.reversal[0], at.mean[1] - at.mean[0], at.mean_forward[1] - at.mean_forward[0]))
    u = positioning_uncertainty(positioning_figures(readings), UncertaintyInputs(eve=eve))
    assert 2 * np.std(found, axis=0) == pytest.approx([u.figures[key] for key in ("B", "M", "E")], rel=0.05)


def test_what_is_not_stated_is_named_and_adds_nothing():
    found = positioning_uncertainty(positioning_figures(published()), UncertaintyInputs(misalignment=1.0))
    assert found.missing == ("device", "thermometer", "expansion", "eve")
    assert found.figures["R"] is None
    assert found.figures["E"] == found.figures["A"] == pytest.approx(0.0125 / math.sqrt(3))
    nothing = positioning_uncertainty(positioning_figures(published()), UncertaintyInputs())
    assert set(nothing.figures.values()) == {None}


def test_rotary_axis_has_a_device_and_a_drift():
    rotary = RotaryReadings(
        target_deg=[0, 90, 90, 0], deviation_deg=[0, 1, 2, 0], direction=[1, 1, -1, -1], run=[1] * 4
    )
    inputs = UncertaintyInputs.read({"device_uncertainty": "0.9 arcsec", "eve": "1.8 arcsec"}, Coordinate.ANGULAR)
    found = positioning_uncertainty(positioning_figures(rotary), inputs)
    assert found.contributions == pytest.approx({"device": 0.9 / 3600, "eve": 1.8 / 3600 / math.sqrt(3)})
    assert found.missing == ()
    assert found.figures["A"] is None  # a single run
    assert found.spread_share is None


@pytest.mark.parametrize(
    ("key", "text", "coordinate", "words"),
    [
        ("misalignment", "1 mm", Coordinate.ANGULAR, "rotary"),
        ("eve", "1 um", Coordinate.ANGULAR, "arcsec"),
        ("eve", "1.2", Coordinate.LINEAR, "unit"),
        ("eve", "-1 um", Coordinate.LINEAR, "at least 0 um"),
        ("device_uncertainty", "1 um", Coordinate.LINEAR, "um/m"),
        ("expansion", "12 um/m", Coordinate.LINEAR, "um/m/K"),
    ],
)
def test_wrong_inputs_are_refused(key, text, coordinate, words):
    with pytest.raises(ArgumentError, match=words):
        UncertaintyInputs.read({key: text}, coordinate)
