import json
from pathlib import Path

import numpy as np
import pytest
from iso230_oracle import oracle_figures

from rtec.cli import main
from rtec.errors import ArgumentError
from rtec.metrology import Coordinate, Readings, positioning_figures, read_measurement
from rtec.metrology.cyclic import cyclic_error
from rtec.metrology.readings import RotaryReadings
from rtec.predictors import FORWARD, REVERSE, LatheNetwork

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
"""Measurements of real machines beside the project; they may be absent."""
INCH = 25.4


def bidirectional(target, up, down, runs=1):
    """Readings in mm of equal runs, forward then back."""
    n = len(target)
    return Readings(
        target_mm=np.tile(np.concatenate((target, target[::-1])), runs),
        deviation_mm=np.tile(np.concatenate((up, down[::-1])), runs),
        direction=np.tile(np.repeat([1, -1], n), runs),
        run=np.repeat(np.arange(1, runs + 1), 2 * n),
    )


def by_hand():
    """Two targets, two runs; the figures below were worked out on paper."""
    return Readings(
        target_mm=[0, 10, 10, 0, 0, 10, 10, 0],
        deviation_mm=[1, 4, 9, 5, 3, 4, 11, 5],
        direction=[1, 1, -1, -1] * 2,
        run=[1] * 4 + [2] * 4,
    )


def test_figures_worked_out_by_hand():
    # means up 2, 4; down 5, 10; s up sqrt 2, 0; s down 0, sqrt 2; B_i -3, -6; middle 3.5, 7
    figures = positioning_figures(by_hand()).to_dict("mm")
    root = np.sqrt(2)
    expected = {
        "E": 8, "E_forward": 2, "E_backward": 5, "M": 3.5, "B": 6, "B_mean": -4.5,
        "A_forward": (2 + 2 * root) - (2 - 2 * root), "A_backward": (10 + 2 * root) - 5,
        "A": (10 + 2 * root) - (2 - 2 * root),
        "R_forward": 4 * root, "R_backward": 4 * root, "R": 2 * root + 6,
        "max_average_error": 8, "max_reversal_error": 6, "max_repeat": 7,
        "rms": np.sqrt((1 + 16 + 81 + 25 + 9 + 16 + 121 + 25) / 8), "pp": 10,
    }  # fmt: skip
    assert {key: figures[key] for key in expected} == pytest.approx(expected, rel=1e-12)
    assert figures["at_targets"][1] == pytest.approx(
        {"target_mm": 10, "mean_forward": 4, "mean_backward": 10, "mean": 7, "reversal": -6, "s_forward": 0,
         "s_backward": root, "R_forward": 0, "R_backward": 4 * root, "R": 2 * root + 6,
         "n_forward": 2, "n_backward": 2}
    )  # fmt: skip
    assert figures["runs"] == 2


def test_units():
    figures = positioning_figures(by_hand())
    assert figures.to_dict()["unit"] == "um"
    assert figures.to_dict()["E"] == pytest.approx(8000)
    assert figures.to_dict("µm")["B_mean"] == pytest.approx(-4500)
    assert figures.to_dict("inch")["E"] == pytest.approx(8 / INCH)
    assert figures.to_dict("nm")["at_targets"][0]["mean_forward"] == pytest.approx(2e6)
    with pytest.raises(ArgumentError, match=r"'arcsec'.*um, mm, nm, inch"):
        figures.to_dict("arcsec")


def test_rotary_axis_is_judged_in_seconds_of_arc():
    linear = by_hand()
    rotary = RotaryReadings(
        target_deg=linear.target_mm, deviation_deg=linear.deviation_mm, direction=linear.direction, run=linear.run
    )
    figures = positioning_figures(rotary)
    assert figures.coordinate is Coordinate.ANGULAR
    assert figures.to_dict()["unit"] == "arcsec"
    assert figures.to_dict()["E"] == pytest.approx(8 * 3600)
    assert figures.to_dict("urad")["B"] == pytest.approx(6 * np.pi / 180 * 1e6)
    assert figures.to_dict()["at_targets"][1]["target_deg"] == 10


def test_one_direction_has_no_bidirectional_figures():
    readings = Readings(
        target_mm=[0, 1, 0, 1], deviation_mm=[1, 2, 3, 4], direction=[-1] * 4, run=[1, 1, 2, 2], status=[0, 0, 3, 0]
    )
    figures = positioning_figures(readings).to_dict("mm")
    for key in ("A", "R", "E", "M", "B", "B_mean", "max_average_error", "max_reversal_error", "max_repeat"):
        assert figures[key] is None
    for key in ("A_forward", "R_forward", "E_forward"):
        assert figures[key] is None
    assert figures["E_backward"] == pytest.approx(1)
    assert figures["R_backward"] == pytest.approx(4 * np.sqrt(2))
    warnings = "\n".join(figures["warnings"])
    assert "only the backward direction" in warnings
    assert "1 readings carry a status" in warnings
    json.dumps(figures, allow_nan=False)


def test_single_run_has_no_spread():
    readings = bidirectional(np.arange(6.0), np.arange(6.0), np.arange(6.0) + 1)
    figures = positioning_figures(readings).to_dict("mm")
    for key in ("A", "A_forward", "A_backward", "R", "R_forward", "R_backward"):
        assert figures[key] is None
    assert (figures["E"], figures["M"], figures["B"], figures["B_mean"]) == (6, 5, 1, -1)
    assert figures["max_repeat"] == 1
    assert any("single run" in warning for warning in figures["warnings"])
    assert any("asks for 5 runs" in warning for warning in figures["warnings"])


def test_five_complete_runs_pass_without_warning_and_four_do_not():
    target, up, down = np.arange(6.0), np.zeros(6), np.ones(6)
    assert positioning_figures(bidirectional(target, up, down, runs=5)).warnings == ()
    (warning,) = positioning_figures(bidirectional(target, up, down, runs=4)).warnings
    assert "read only 4 times" in warning
    assert "the first at 0 mm forward" in warning


@pytest.mark.parametrize(
    ("travel_mm", "targets", "asked"),
    [(400, 4, "at least 5 on 400 mm"), (400, 5, None), (1500, 7, "at least 8 on 1500 mm, 5 a metre"), (1500, 8, None),
     (2000, 10, None), (3000, 11, "at least 12 on 3000 mm, 250 mm apart"), (3000, 12, None)],
)  # fmt: skip
def test_targets_that_a_linear_axis_needs(travel_mm, targets, asked):
    # ISO 230-2:2014: five at least and five a metre; beyond 2 m every 250 mm on average
    place = np.linspace(0.0, travel_mm, targets)
    found = positioning_figures(bidirectional(place, np.zeros(targets), np.ones(targets), runs=5)).warnings
    assert found == () if asked is None else [asked in text for text in found] == [True]


def test_one_run_is_enough_beyond_two_metres():
    place = np.linspace(0.0, 3000.0, 20)
    (warning,) = positioning_figures(bidirectional(place, np.zeros(20), np.ones(20))).warnings
    assert "single run has no standard deviation" in warning


@pytest.mark.parametrize(
    ("travel_deg", "targets", "asked"),
    [(90, 2, 3), (90, 3, None), (180, 4, 5), (180, 5, None), (350, 7, 8), (350, 8, None), (720, 15, 16)],
)
def test_targets_that_a_rotary_axis_needs(travel_deg, targets, asked):
    linear = bidirectional(np.linspace(0.0, travel_deg, targets), np.zeros(targets), np.ones(targets), runs=5)
    rotary = RotaryReadings(
        target_deg=linear.target_mm, deviation_deg=linear.deviation_mm, direction=linear.direction, run=linear.run
    )
    found = positioning_figures(rotary).warnings
    assert found == () if asked is None else f"at least {asked} on" in found[0]


def test_target_without_one_direction_is_left_out_of_what_needs_both():
    readings = Readings(
        target_mm=[0, 1, 2, 1, 0], deviation_mm=[0, 0, 50, 2, 1], direction=[1, 1, 1, -1, -1], run=[1] * 5
    )
    figures = positioning_figures(readings)
    assert figures.iso["B"] == pytest.approx(2)
    assert figures.iso["B_mean"] == pytest.approx(-1.5)
    assert figures.iso["E"] == pytest.approx(50)
    assert any("1 of 3 targets lack one direction" in warning for warning in figures.warnings)


def test_targets_that_were_added_up_are_the_same_target():
    up = np.cumsum(np.full(40, 0.1))
    down = 4.0 - np.cumsum(np.full(40, 0.1)) + 0.1
    assert set(up) != set(down)
    readings = Readings(
        target_mm=np.concatenate((up, down)), deviation_mm=np.repeat([0.0, 1.0], 40),
        direction=np.repeat([1, -1], 40), run=np.ones(80),
    )  # fmt: skip
    assert positioning_figures(readings).at_targets.target.size == 40


@pytest.mark.parametrize(
    ("increment", "average", "reversal"), [(0.025, 0.005176, 0.003892), (0.52, 0.005087, 0.003908)]
)
def test_lathe_of_the_thesis(increment, average, reversal):
    # the figures; the machine itself had 0.005582 and 0.004181 (Table 5-1)
    network = LatheNetwork()
    target = (1 + increment * np.arange(round(39 / increment) + 1)) * INCH
    up, down = (network.error_mm(target, way) for way in (FORWARD, REVERSE))
    figures = positioning_figures(bidirectional(target, up, down), period=0.25 * INCH).to_dict("inch")
    assert figures["max_average_error"] == pytest.approx(average, abs=5e-7)
    assert figures["max_reversal_error"] == pytest.approx(reversal, abs=5e-7)
    # about 0.0013 forward in the network, about 0.00145 on the machine (section 5.1)
    assert figures["cyclic_pp"] == figures["cyclic_pp_forward"]
    assert 0.0011 < figures["cyclic_pp_forward"] < 0.0013
    assert 0.0013 < figures["cyclic_pp_backward"] < 0.0015


def cycle(position, period):
    """A double-humped cycle: cos 2t - cos t is 2 at t = pi and -9/8 where cos t = 1/4."""
    t = 2 * np.pi * position / period
    return np.cos(2 * t) - np.cos(t)


CYCLE_PP = 2 + 9 / 8


@pytest.mark.parametrize("increment", [0.025, 0.52])
def test_planted_cyclic_error_is_found_on_a_slow_trend(increment):
    target = np.arange(1, 40.0001, increment)
    slow = 3 * np.sin(target / 9) + 0.1 * target - 0.002 * target**2
    found = cyclic_error(target, slow + cycle(target, 0.25), 0.25)
    assert found.peak_to_peak == pytest.approx(CYCLE_PP, rel=0.01)
    assert found.harmonics >= 2


@pytest.mark.parametrize("increment", [0.25, 0.125])
def test_targets_at_whole_and_half_periods_hide_it(increment):
    target = np.arange(1, 40.0001, increment)
    found = cyclic_error(target, cycle(target, 0.25), 0.25)
    assert found.peak_to_peak is None
    assert "whole or half periods" in found.note


def test_drift_through_the_phases_over_the_whole_travel_is_trend():
    # steps of 1.0004 periods: the cycle shows as a slow wave of two turns, which the trend explains as well
    target = 0.25 * 1.0004 * np.arange(157.0)
    assert cyclic_error(target, cycle(target, 0.25), 0.25).peak_to_peak is None


@pytest.mark.parametrize(
    ("target", "period", "words"),
    [
        (np.arange(10.0), 20.0, "shorter than the period"),
        (np.array([3.0]), 1.0, "shorter than the period"),
        (np.arange(7.0), 3.0, "too few"),
        (np.arange(100.0), 1e-12, "too short for the digits"),
    ],
)
def test_reasons_why_there_is_no_cyclic_error(target, period, words):
    found = cyclic_error(target, np.zeros(target.size), period)
    assert (found.peak_to_peak, found.harmonics) == (None, 0)
    assert words in found.note


@pytest.mark.parametrize("period", [0.0, -1.0, float("nan"), float("inf")])
def test_period_must_be_above_zero(period):
    with pytest.raises(ArgumentError, match="period"):
        cyclic_error(np.arange(9.0), np.zeros(9), period)


needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="the real measurements are not beside the project")


@needs_shared
@pytest.mark.parametrize("name", ["stage_x.csv", "stage_y.csv", "stage_z.csv"])
def test_real_stages_against_the_oracle(name):
    readings = read_measurement(SHARED / name).to_readings()
    figures = positioning_figures(readings).to_dict("mm")
    expected = oracle_figures(
        readings.target_mm.tolist(), readings.deviation_mm.tolist(), readings.direction.tolist()
    )
    assert {key: figures[key] for key in expected} == pytest.approx(expected, rel=1e-9)
    assert figures["warnings"] == []


KEYS = {
    "unit", "targets", "at_targets", "A", "A_forward", "A_backward", "R", "R_forward", "R_backward",
    "E", "E_forward", "E_backward", "M", "B", "B_mean",
    "max_average_error", "max_reversal_error", "max_repeat", "cyclic_pp",
}  # fmt: skip


def test_command_prints_one_json_document(tmp_path, capsys):
    places = [(way, x) for way, xs in ((1, range(0, 40, 2)), (-1, range(38, -2, -2))) for x in xs]
    rows = [f"{run},{way},{x},{x + way + run * 0.1},7\n" for run in range(1, 6) for way, x in places]
    file = tmp_path / "x.csv"
    file.write_text("# screw_pitch: 5 mm\nrun,direction,target_mm,deviation_um,pulse_v\n" + "".join(rows))
    assert main(["iso230", str(file), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document.keys() >= KEYS
    assert document["unit"] == "um"
    assert document["targets"] == len(document["at_targets"]) == 20
    # deviations x + way + 0.1 run in um: means 0.3 above x + way
    assert document["E"] == pytest.approx(40)
    assert document["R_forward"] == pytest.approx(4 * 0.1 * np.sqrt(2.5))
    assert document["cyclic_pp"] == pytest.approx(0, abs=1e-6)
    assert document["unknown_columns"] == ["pulse_v"]
