"""Models of a warm machine side by side: what chooses, what judges, and what is said of rows without a figure."""

from dataclasses import replace

import numpy as np
import pytest

from rtec.dataset.warm_log import warm_log
from rtec.effects import Units
from rtec.effects._heat import HeatShape
from rtec.effects.thermal_shift import ThermalShift
from rtec.heat import Duty, warm_machine
from rtec.heat.duty import Piece
from rtec.inference.model import Model, Term
from rtec.metrology.measurement_file import measurement_of_columns
from rtec.predictors.warm.features import Feature
from rtec.training.compare_warm import compare_warm
from rtec.training.warm_effects import features_of
from rtec.training.warm_features import lag_sets
from rtec.training.warm_intervals import calibrated_factor
from rtec.training.warm_methods import warm_methods
from rtec.training.warm_results import WarmKind
from rtec.training.warm_scout import BlockSums
from rtec.training.warm_sensors import updated_hourly

PIECES = tuple(Piece(duration_s=4000.0, spindle_rpm=rpm) for rpm in (3000.0, 0.0, 5000.0, 0.0, 4000.0, 0.0))
PLAIN = [method for method in warm_methods() if method.kind in (WarmKind.NONE, WarmKind.LINEAR)]
LAGS = [method for method in warm_methods() if method.name == "first-order lags"]


def table(duty, seed=3, every=60):
    run = warm_machine(seed=1).run(duty, every_s=10.0, seed=seed)
    rows = slice(None, None, every // 10)
    noise = np.random.default_rng(seed).normal(0.0, 0.2, (run.time_s[rows].size, 2))
    found = {"time_s": run.time_s[rows], "spindle_rpm": run.spindle_rpm[rows]}
    found |= {f"{name}_um": run.displacement_um[name][rows] + noise[:, k] for k, name in enumerate(("y1", "z"))}
    heats = ("front_bearing", "motor", "head_left", "coolant", "room")
    return found | {f"temperature_{name}_degc": run.thermometers[name][rows] for name in heats}


@pytest.fixture(scope="module")
def columns():
    return table(Duty(PIECES))


@pytest.fixture(scope="module")
def log(columns):
    return warm_log(measurement_of_columns(columns))


@pytest.fixture(scope="module")
def result(log):
    return compare_warm(log, methods=[*PLAIN, *LAGS])


def test_the_last_step_and_what_follows_judge(log, result):
    parts = result.parts
    assert log.blocks.names[log.blocks.of_row[parts.judging[0]]] == "4000 rpm"
    assert parts.judging[0] == parts.until and parts.judging[-1] == log.rows - 1
    assert parts.rows.max() < parts.until


def test_nothing_of_the_held_out_part_reaches_what_is_chosen(columns, result):
    until = result.parts.until
    other = {name: np.where(np.arange(values.size) < until, values, values[::-1]) for name, values in columns.items()
             if name.endswith("_um")}  # fmt: skip
    again = compare_warm(warm_log(measurement_of_columns(columns | other)), methods=[*PLAIN, *LAGS])
    assert again.chosen == result.chosen
    for one, two in zip(result.rows, again.rows, strict=True):
        assert one.rms_blocks_um == pytest.approx(two.rms_blocks_um, rel=1e-9)


def test_by_rows_the_error_looks_lower_than_it_is(result):
    row = result.named("first-order lags")
    assert row.rms_rows_um < row.rms_blocks_um
    assert row.rms_heldout_um < 0.5 * result.named("mean").rms_heldout_um


def test_what_needs_a_probe_is_never_chosen(result):
    lowest = result.ranked[0]
    assert (lowest.name, lowest.needs_probe, lowest.rms_hourly_um) == ("persistence", True, None)
    assert result.chosen not in ("persistence", "mean", None)


def test_channels_make_the_figure_of_a_row(result):
    row = result.named(result.chosen)
    each = [one.rms_heldout_um for one in row.channels.values()]
    assert row.rms_heldout_um == pytest.approx(np.sqrt(np.mean(np.square(each))))


def test_the_mean_by_blocks_is_that_of_the_other_blocks(result):
    parts, output = result.parts, result.parts.outputs["z"]
    left = [output[parts.block == k] - output[parts.block != k].mean() for k in np.unique(parts.block)]
    found = result.named("mean").channels["z"].rms_blocks_um
    assert found == pytest.approx(np.sqrt(np.mean(np.square(np.concatenate(left)))))


def test_a_row_worse_than_the_mean_says_so(log, columns):
    warmer = columns | {"temperature_motor_degc": columns["temperature_motor_degc"] + 60.0}
    other = warm_log(measurement_of_columns(warmer), like=log)
    plain = compare_warm(log, other, methods=PLAIN).named("least squares")
    assert any(note.startswith("Worse than the mean on the held-out part") for note in plain.notes)


def test_a_single_block_leaves_the_mean_and_reasons(columns):
    one = warm_log(measurement_of_columns(columns | {"part": np.ones(columns["time_s"].size)}), blocks="part")
    result = compare_warm(one, methods=[*PLAIN, *LAGS])
    assert result.chosen is None and result.sensors == ()
    assert result.named("mean").rms_heldout_um > 0.0
    assert result.named("ridge").reason == "leaving out a block needs two blocks, and 1 trains"


def test_ctrl_c_keeps_the_rows_that_are_finished(log):
    def interrupted(task):
        raise KeyboardInterrupt

    methods = [*PLAIN, replace(LAGS[0], name="slow", fit=interrupted), LAGS[0]]
    result = compare_warm(log, methods=methods)
    assert result.interrupted and result.chosen in ("ridge", "least squares")
    assert result.named("slow").reason == "ended before it was fitted"
    assert result.named("first-order lags").reason == "ended before its turn"


def test_a_budget_that_is_over_says_so(log):
    slow = [one for one in warm_methods() if one.name == "LS-SVM"]
    result = compare_warm(log, methods=[*PLAIN, *slow], budget_s=1e-9)
    assert "--budget gives more" in result.named("LS-SVM").reason
    assert result.chosen is not None


MARKS = {"named effects": pytest.mark.sweep}
"""A diagnosis takes seconds."""
OTHERS = [one.name for one in warm_methods() if one.kind not in (WarmKind.NONE, WarmKind.LINEAR)]


@pytest.mark.parametrize("name", [pytest.param(name, marks=MARKS.get(name, ())) for name in OTHERS])
def test_every_method_has_a_figure_below_the_mean_by_blocks(name):
    log = warm_log(measurement_of_columns(table(Duty(PIECES), every=300)), observe="z")
    methods = [one for one in warm_methods() if one.name in ("mean", name)]
    result = compare_warm(log, methods=methods, budget_s=None)
    row = result.named(name)
    assert row.reason is None
    assert row.rms_train_um < result.named("mean").rms_train_um


def test_sensors_are_chosen_by_blocks_and_all_stand_last(result):
    sizes = [len(row.sensors) for row in result.sensors]
    assert sizes == [1, 2, 3, 4, 5] and result.sensors[-1].is_all
    for row in result.sensors:
        assert set(row.share) == set(row.sensors) and all(0.0 <= share <= 1.0 for share in row.share.values())


def test_the_only_sensor_that_tells_is_found():
    rng = np.random.default_rng(5)
    rows = np.arange(600)
    tells, others = 20.0 + np.cumsum(rng.normal(size=600)) / 5.0, 20.0 + np.cumsum(rng.normal(size=(3, 600)), axis=1)
    given = {"time_s": 60.0 * rows, "run": rows // 100 + 1.0, "z_um": 4.0 * tells}
    given |= {"temperature_tells_degc": tells} | {f"temperature_o{k}_degc": one for k, one in enumerate(others)}
    result = compare_warm(warm_log(measurement_of_columns(given)), methods=PLAIN)
    assert result.sensors[0].sensors == ("temperature_tells",)
    assert result.sensors[0].share == {"temperature_tells": 1.0} and result.sensors[0].same == 1.0


def test_sums_over_blocks_give_what_fitting_again_without_each_block_gives():
    rng = np.random.default_rng(2)
    x, y, block = rng.normal(size=(60, 4)), rng.normal(size=(60, 2)), np.repeat([0, 1, 2], 20)
    found = BlockSums.of(x, y, block).errors([0, 2], 0.3)
    penalty = np.column_stack([np.sqrt(0.3 * 40) * np.eye(2), np.zeros(2)])  # rows that pull slopes to zero
    full = np.column_stack([x[:, [0, 2]], np.ones(60)])
    for number in range(3):
        out = block == number
        rows, wanted = np.vstack([full[~out], penalty]), np.vstack([y[~out], np.zeros((2, 2))])
        left = y[out] - full[out] @ np.linalg.lstsq(rows, wanted, rcond=None)[0]
        assert found[number] == pytest.approx((left**2).sum(axis=0), rel=1e-9)


def test_the_usual_features_come_first_and_follow_the_inputs():
    usual = lag_sets(["temperature_a", "spindle_speed"])[0]
    assert Feature(of="spindle_speed", lag_s=10_000.0, heat=True) in usual and len(usual) == 5
    assert all(one.of == "spindle_speed" for one in lag_sets(["spindle_speed"])[0])
    assert len(lag_sets(["temperature_a"])[0]) == 3


def test_intervals_hold_where_blocks_err_together():
    """Blocks have an offset each, drawn anew: a new block is held in nine of ten cases, whatever their number."""
    rng = np.random.default_rng(7)
    for blocks in (4, 8, 20):
        held = []
        for _ in range(400):
            offsets = rng.normal(size=blocks + 1)
            block = np.repeat(np.arange(blocks), 10)
            factor = calibrated_factor(offsets[block], np.zeros(block.size), block)
            held.append(abs(offsets[-1]) <= factor)
        assert 0.85 < np.mean(held) < 0.95


def test_effects_of_heat_become_features():
    of_screw = Term(effect=ThermalShift(), shape=HeatShape(sensor="temperature_screw", lag=600.0), amplitudes=(1e-3,))
    of_spindle = Term(effect=ThermalShift(), shape=HeatShape(sensor="spindle", lag=60.0), amplitudes=(1e-3,))
    model = Model(observe="z", units=Units("mm", "s", "s"), terms=(of_screw, of_spindle))
    assert features_of(model) == (
        Feature(of="temperature_screw", lag_s=600.0), Feature(of="spindle_speed", lag_s=60.0, heat=True)
    )  # fmt: skip


def test_a_single_block_has_no_interval():
    assert calibrated_factor(np.ones(5), np.zeros(5), np.zeros(5, dtype=np.int64)) is None


def test_a_probe_takes_away_what_stays():
    hours = np.linspace(0.0, 5.0, 51)
    assert np.abs(updated_hourly(np.full(51, 7.0), hours)[1:]).max() == 0.0
    assert np.abs(updated_hourly(2.0 * hours, hours)).max() == pytest.approx(2.0)
