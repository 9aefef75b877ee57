"""All methods side by side: rows with figures or a reason, intervals that hold what they promise, and Ctrl-C."""

import math
import signal
import threading

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.errors import ArgumentError
from rtec.predictors import BidirectionalTable, NoError, UnidirectionalTable
from rtec.predictors.fitting.samples import Samples
from rtec.predictors.fitting.training import Effort
from rtec.training import all_methods, compare_predictors
from rtec.training.compare_predictors import conformal_mm, repeatability_mm
from rtec.training.methods import Fitted, Method, turn_warning
from rtec.training.parts import parts_of
from rtec.training.results import Kind, PredictorComparison, Row

QUICK = Effort(starts=1, epochs=5)


@pytest.fixture(scope="module")
def axis(tmp_path_factory):
    """A bow with backlash, a wave of the screw of 10 mm, and noise of 0.3 µm: 100 targets, two runs."""
    rng = np.random.default_rng(0)
    lines = ["# screw_pitch: 10 mm", "run,direction,target_mm,deviation_um"]
    for run in (1, 2):
        for way in (1, -1):
            for x in (2.0 * np.arange(100))[::way]:
                error = 1e-3 * x * (200.0 - x) + 4.0 * (way < 0) + 3.0 * math.sin(2.0 * math.pi * x / 10.0)
                lines.append(f"{run},{way},{x:g},{error + rng.normal(0.0, 0.3):.4f}")
    file = tmp_path_factory.mktemp("axis") / "axis.csv"
    file.write_text("\n".join([*lines, ""]))
    return load_dataset(file, facts={"screw_pitch": "10 mm"})


def named(*starts):
    return [method for method in all_methods() if method.name.startswith(starts)]


def test_rows_have_the_figures_of_their_own_predictors(axis):
    found = compare_predictors(axis, methods=named("none", "table"), seed=4)
    parts = parts_of(axis, seed=4)
    for row in found.rows:
        off = parts.heldout.error_mm - row.predictor.error_mm(parts.heldout.position_mm, parts.heldout.direction)
        assert row.rms_heldout_mm == pytest.approx(float(np.sqrt(np.mean(off**2))), rel=1e-12)
        assert row.worst_heldout_mm == pytest.approx(float(np.abs(off).max()), rel=1e-12)
        assert row.coverage == pytest.approx(float(np.mean(np.abs(off) <= row.interval_mm)))
        assert row.reason is None
    assert isinstance(found.rows[0].predictor, NoError)
    assert not found.rows[0].works
    assert isinstance(found.named("table uni-directional linear").predictor, UnidirectionalTable)
    assert isinstance(found.named("table bi-directional cubic").predictor, BidirectionalTable)
    assert found.best is found.ranked[0]
    assert found.best.rms_heldout_mm < 0.2 * found.named("none").rms_heldout_mm
    assert found.noise_mm == pytest.approx(3e-4, rel=0.3)
    assert not found.interrupted


def test_a_method_that_cannot_says_why_and_the_others_go_on(axis):
    found = compare_predictors(axis, methods=named("none", "network 40 lm", "network 30-10 lm"), effort=QUICK)
    row = found.named("network 30-10 lm")
    assert "441" in row.reason
    assert not row.works
    assert found.named("none").rms_heldout_mm > 0.0
    assert found.ranked[-1].reason is not None


def test_the_seed_rules_the_whole(axis):
    one, two = (compare_predictors(axis, methods=named("table bi"), seed=7).rows for _ in range(2))
    assert [row.rms_heldout_mm for row in one] == [row.rms_heldout_mm for row in two]
    other = compare_predictors(axis, methods=named("table bi"), seed=8).rows
    assert other[0].rms_heldout_mm != one[0].rms_heldout_mm


def test_progress_goes_from_0_to_1_with_names_and_losses(axis):
    told = []
    methods = [*named("none"), small_network()]
    compare_predictors(axis, methods=methods, effort=Effort(starts=1, epochs=50), progress=lambda *a: told.append(a))
    assert all(0.0 <= share <= 1.0 for _, share in told)
    assert any(what == "none" for what, _ in told)
    assert any("µm" in what for what, _ in told)


def small_network(name="network 3", on_epoch=lambda: None):
    from rtec.predictors.fitting.training import Design, train

    def fit(task):
        def tell(loss_mm):
            on_epoch()
            task.tell(loss_mm)

        found = train(
            Design(hidden=(3,)), task.parts.train, task.parts.choose, task.effort, limit=task.limit, tell=tell
        )
        return Fitted(predictor=found.predictor, parameters=found.weights, courses=found.courses)

    return Method(name=name, kind=Kind.NETWORK, fit=fit)


def test_the_budget_ends_trainings_that_would_go_on_for_ever(axis):
    endless = Effort(starts=10**6, epochs=10**6, patience=10**6)
    found = compare_predictors(axis, methods=[small_network("a"), small_network("b")], effort=endless, budget_s=0.6)
    assert all(row.works for row in found.rows)
    assert all(row.train_s < 5.0 for row in found.rows)


def test_ctrl_c_keeps_the_best_of_every_row_that_has_begun(axis):
    endless = Effort(starts=10**6, epochs=10**6, patience=10**6)
    once = threading.Event()

    def interrupt():
        if not once.is_set():
            once.set()
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)  # as a terminal does: it wakes a wait

    first = small_network("network 3", on_epoch=interrupt)
    others = [small_network(f"other {number}") for number in range(8)]
    found = compare_predictors(axis, methods=[*named("none"), first, *others], effort=endless, budget_s=None)
    assert once.is_set()
    assert found.interrupted
    assert [row.name for row in found.rows] == ["none", "network 3", *(other.name for other in others)]
    assert found.named("network 3").works
    assert found.named("other 7").reason == "ended before its turn"


def test_ctrl_c_before_the_networks_keeps_what_is_done(axis):
    def interrupted(task):
        raise KeyboardInterrupt

    methods = [*named("none"), Method(name="slow", kind=Kind.TABLE, fit=interrupted), *named("network 40 lm")]
    found = compare_predictors(axis, methods=methods, effort=QUICK)
    assert found.interrupted
    assert found.named("none").works is False
    assert found.named("none").rms_heldout_mm > 0.0
    assert {row.reason for row in found.rows[1:]} == {"ended before its turn"}


def test_conformal_half_widths_hold_nine_readings_of_ten():
    """Over many draws the share held is that of a beta distribution: 90 % up to 90 % and one rank more."""
    for rows in (9, 19, 60):
        held = []
        for seed in range(2000):
            off = np.random.default_rng([rows, seed]).standard_t(3, rows + 1)
            held.append(abs(off[-1]) <= conformal_mm(off[:-1]))
        spread = 3.5 * math.sqrt(0.9 * 0.1 / 2000)
        assert 0.9 - spread <= np.mean(held) <= 0.9 + 1.0 / (rows + 1) + spread, rows
    assert conformal_mm(np.zeros(8)) == math.inf


def test_repeatability_is_the_standard_deviation_within_a_place_and_direction():
    samples = Samples(
        position_mm=[0, 0, 0, 5, 5], direction=[1, 1, -1, -1, -1], error_mm=[0.0, 0.002, 9.0, 0.001, 0.005]
    )
    assert repeatability_mm(samples) == pytest.approx(math.sqrt((2 * 0.001**2 + 2 * 0.002**2) / 2))
    assert repeatability_mm(samples.take(np.array([0, 2, 3]))) is None


def test_too_few_targets_a_turn_are_said(axis):
    parts = parts_of(axis)
    assert turn_warning(parts, 10.0) is None
    assert "too few" in turn_warning(parts, 5.0)
    assert turn_warning(parts, None) is None


def test_a_measurement_that_no_predictor_can_be_made_of_is_one_error(tmp_path):
    file = tmp_path / "few.csv"
    file.write_text("run,direction,target_mm,deviation_um\n" + "".join(f"1,1,{x},0.{x}\n" for x in range(5)))
    with pytest.raises(ArgumentError, match="5 targets"):
        compare_predictors(load_dataset(file))


def test_ranks_put_rows_without_figures_last():
    rows = [Row(name="x", kind=Kind.NETWORK, reason="why"), Row(name="b", kind=Kind.TABLE, rms_heldout_mm=2.0)]
    rows += [Row(name="a", kind=Kind.TABLE, rms_heldout_mm=1.0), Row(name="none", kind=Kind.NONE, rms_heldout_mm=0.5)]
    found = PredictorComparison(
        source="s", parts=None, rows=tuple(rows), pitch_mm=None, noise_mm=None, notes=(), interrupted=False
    )
    assert [row.name for row in found.ranked] == ["none", "a", "b", "x"]
    assert found.best.name == "a"
    assert found.named("y") is None


def test_what_judges_has_no_say_in_what_is_chosen():
    rows = [
        Row(name="lucky", kind=Kind.TABLE, rms_heldout_mm=1.0, rms_sure_mm=3.0),
        Row(name="good", kind=Kind.TABLE, rms_heldout_mm=2.0, rms_sure_mm=2.0),
        Row(name="unsure", kind=Kind.TABLE, rms_heldout_mm=0.5),
        Row(name="none", kind=Kind.NONE, rms_heldout_mm=1.0, rms_sure_mm=1.0),
    ]
    found = PredictorComparison(
        source="s", parts=None, rows=tuple(rows), pitch_mm=None, noise_mm=None, notes=(), interrupted=False
    )
    assert (found.best.name, found.chosen.name) == ("unsure", "good")
