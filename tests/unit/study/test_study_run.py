"""A whole study: its rows, its draws, its figures in motion, and what happens where a row cannot be finished."""

from dataclasses import replace

import numpy as np
import pytest

from rtec.board import Microcontroller
from rtec.controller import IllegalPolicy, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.machine import Ending, Laser
from rtec.machine.faults import Fault, FaultKind, Trigger
from rtec.metrology import MeasuringPlan
from rtec.predictors import LatheNetwork
from rtec.report.document import study_document
from rtec.report.folder import write_report
from rtec.requester.settings import HandshakeSettings
from rtec.study import builtin_study, read_study, run_study
from rtec.study.figures import feed_curve, limit_of
from rtec.study.run import machine_of

INCH_MIN = 25.4 / 60.0


def given():
    """Return the built-in study with the printed network as predictor: nothing has to be learned."""
    return replace(builtin_study(), predictor="lathe", model=LatheNetwork())


def small(**changes):
    """Return the built-in study with six targets, next to no figures and the true error as predictor."""
    plan = MeasuringPlan(
        start_mm=25.4,
        end_mm=91.44,
        increment_mm=13.208,
        dwell_s=4,
        runs=1,
        feed_mm_s=50 * 25.4 / 60,
        overshoot_mm=2.54,
    )
    values = {
        "plan": plan, "laser": Laser(dwell_s=2.0), "feeds_mm_s": (50 * INCH_MIN,),
        "hold_growth_mm": 0.01, "hold_time_constant_s": 1.0,
    } | changes  # fmt: skip
    return replace(given(), **values)


@pytest.fixture(scope="module")
def plain():
    return run_study(small())


def without_times(result):
    document = study_document(result)
    del document["wall_s"]
    return document


def test_the_same_study_twice_is_identical(plain):
    again = run_study(small())
    assert without_times(again) == without_times(plain)
    for one, other in zip(plain.rows, again.rows, strict=True):
        assert np.array_equal(one.readings.deviation_mm, other.readings.deviation_mm)
    for one, other in zip(plain.feed_curves, again.feed_curves, strict=True):
        assert np.array_equal(one.reverse_pp_mm, other.reverse_pp_mm)
    for one, other in zip(plain.hold_curves, again.hold_curves, strict=True):
        assert np.array_equal(one.deviation_mm, other.deviation_mm)


def test_every_row_has_the_same_draws(plain):
    quiet = run_study(small(repeatability_mm=0.0))
    noise = [
        noisy.readings.deviation_mm - clean.readings.deviation_mm
        for noisy, clean in zip(plain.rows, quiet.rows, strict=True)
    ]
    assert len(noise) == 6
    for draws in noise[1:]:
        assert draws == pytest.approx(noise[0], abs=1e-12)
    assert 0.0003 < np.std(noise[0]) < 0.002  # 12 draws of 1 µm
    assert noise[0] == pytest.approx(np.random.default_rng(1).normal(0.0, 0.001, 12), abs=1e-12)


def test_rows_and_what_they_say(plain):
    assert [row.name for row in plain.rows] == ["uncompensated", "table", "original", "a", "b", "c"]
    assert plain.good
    for row in plain.rows:
        run = row.run
        assert run.audit
        assert run.ending is Ending.FINISHED
        assert (run.pending_steps, run.received.illegal_transitions, run.refused, run.audit_counts) == (0, 0, 0, 0)
        assert (run.insertions.inserted > 0) == (run.step_counts > 0)
    error = {row.name: row.figures.peak_to_peak for row in plain.rows}
    assert error["uncompensated"] > 0.09
    assert max(value for name, value in error.items() if name != "uncompensated") < 0.012
    keys = {
        "name", "max_average_error_um", "max_reversal_error_um", "iso230", "max_repeat_um", "cyclic_pp_um", "rms_um",
        "pp_um", "corrections_inserted", "corrections_pending", "illegal_transitions", "refused", "audit",
    }  # fmt: skip
    assert keys <= set(study_document(plain)["rows"][0])


def test_the_held_axis_of_the_report(plain):
    last = {curve.name: curve.deviation_mm[-1] for curve in plain.hold_curves}
    inserted = {curve.name: curve.inserted for curve in plain.hold_curves}
    assert {curve.state for curve in plain.hold_curves if curve.name == "original"} == {2}
    # the growth that falls into the time on the way may still be corrected
    assert inserted["original"] <= 2
    assert last["original"] > 0.007 - 0.004 * inserted["original"]
    for name, step in (("a", 4), ("b", 1), ("c", 2)):
        assert abs(last[name]) <= (step + 1) * 0.001


def test_progress_never_falls_and_ends_at_the_end():
    told = []
    run_study(small(designs=(Design.B,)), progress=lambda what, share: told.append((what, share)))
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < 0.05
    assert 0.8 <= shares[-1] <= 1.0
    assert all(isinstance(what, str) and what for what, _ in told)


# window * step / period / slope, with the lathe's reverse cyclic slope of 0.048: 14.8, 29.5, 59 inch/min
@pytest.mark.parametrize(("design", "inch_min"), [(Design.B, 14.76), (Design.C, 29.53), (Design.A, 59.06)])
def test_the_feed_up_to_which_a_design_follows(design, inch_min):
    limit = limit_of(given(), design)
    assert limit.follows_up_to_mm_s / INCH_MIN == pytest.approx(inch_min, rel=0.03)


def test_limits_of_gate_and_word():
    by_name = {design: limit_of(given(), design) for design in Design}
    # the Original's last edge comes at worst 9 µs after the transition; 15 % margin; four counts of 1 µm a cycle
    assert by_name[Design.ORIGINAL].gate_refuses_above_mm_s == pytest.approx(0.004 / (4 * 9e-6 * 1.15), rel=1e-6)
    assert by_name[Design.A].word_holds_mm == pytest.approx(0.508)
    assert by_name[Design.C].word_holds_mm == pytest.approx(0.254)
    assert by_name[Design.B].word_holds_mm == pytest.approx(32.767)
    assert by_name[Design.B].largest_error_mm == pytest.approx(0.145, abs=0.002)


@pytest.fixture(scope="module")
def in_motion():
    study = replace(given(), feeds_mm_s=tuple(feed * INCH_MIN for feed in (5, 50)))
    base = machine_of(study)
    return {
        design: feed_curve(study, design.value, replace(base, injector=study.injector(design)), lambda _: None)
        for design in (Design.A, Design.B, Design.C)
    }


def test_slowly_the_finest_step_leaves_the_least(in_motion):
    slowly = {design: curve.reverse_pp_mm[0] for design, curve in in_motion.items()}
    assert slowly[Design.B] < slowly[Design.C] < slowly[Design.A]


def test_at_50_inch_a_minute_the_order_turns_round(in_motion):
    fast = {design: curve.reverse_pp_mm[1] for design, curve in in_motion.items()}
    assert fast[Design.B] > fast[Design.C] > fast[Design.A]
    # B follows up to 15 inch/min: at 50 nearly all of the cyclic error of about 37 µm (0.00145 inch) is left
    assert fast[Design.B] == pytest.approx(0.037, abs=0.004)


def test_an_error_beyond_the_word_is_pending_and_said(tmp_path):
    (tmp_path / "long.csv").write_text("position_mm,forward_um,reverse_um\n0,0,10\n100,700,710\n200,0,10\n")
    path = tmp_path / "long.toml"
    path.write_text(
        'name = "long"\n[axis]\nerror = "long.csv"\n[program]\nend = "3.6 inch"\nruns = 1\ndwell = "4 s"\n'
        '[laser]\ndwell = "2 s"\nrepeatability = "0 um"\n[predictor]\nmodel = "axis"\n'
        '[figures]\nfeeds = ["10 mm/s"]\nhold_time_constant = "0.5 s"\n'
    )
    rows = {row.name: row for row in run_study(read_study(path)).rows}
    # 0.7 mm at 100 mm: at 3.6 inch 640 µm forward, of which 508 fit into a signed byte of 4 µm, 254 into one of 2 µm
    for name, step_um, held_um in (("original", 4, 508), ("a", 4, 508), ("c", 2, 254)):
        left = rows[name].readings.deviation_mm.max() * 1000
        assert left == pytest.approx(640 - held_um, abs=12)
        assert rows[name].run.beyond_word_steps == pytest.approx(
            (668 - held_um) / step_um, abs=2
        )  # reverse, at the overshoot
        assert rows[name].run.audit
    assert rows["b"].run.beyond_word_steps == 0
    assert rows["b"].figures.peak_to_peak < 0.003
    result = run_study(replace(read_study(path), designs=(Design.A,)))
    assert any("word is too small by" in warning for warning in result.warnings)


def test_a_row_without_any_reading_is_empty_with_its_reason(tmp_path, monkeypatch):
    fill = HandshakeSettings.fill_box

    def narrow(self, box, *, switch_on=True):
        fill(self, box, switch_on=switch_on)
        box.window = 1

    monkeypatch.setattr(HandshakeSettings, "fill_box", narrow)
    result = run_study(small(designs=(Design.B,)))
    row = result.rows[-1]
    assert row.readings is row.figures is None
    assert row.run.ending is Ending.HELD
    assert row.reason.startswith("held by the PC after 0.0")
    assert not result.good
    said = study_document(result)["rows"][-1]
    assert said["reason"] == row.reason
    assert said["rms_um"] is said["iso230"]["A"] is None
    assert said["corrections_inserted"] == row.run.insertions.inserted
    assert any(warning.startswith("Design B: no reading: held by the PC") for warning in result.warnings)
    assert result.rows[0].readings.size > 0
    page = write_report(result, tmp_path)
    assert "no reading: held by the PC" in page.read_text(encoding="utf-8")
    assert not (tmp_path / "readings" / "b.csv").exists()


def test_a_faulting_controller_is_named():
    slow = ReceiverSettings(filter_samples=1, clock_hz=15_000, policy=IllegalPolicy.FAULT)
    result = run_study(small(receiver=slow))
    assert all(row.readings is None for row in result.rows)
    assert {row.run.ending for row in result.rows} == {Ending.FAULTED}
    assert "stopped by the controller after" in result.rows[0].reason
    assert not result.good


def test_counts_lost_at_too_high_a_speed_are_a_row_or_named():
    # at 0.1 µm a count 50 inch/min are 212 000 counts a second: more than Design B's processor can copy
    encoder = replace(builtin_study().encoder, count_mm=1e-4)
    study = small(encoder=encoder, designs=(Design.B,))
    row = run_study(study).rows[-1]
    assert row.readings is None
    assert "never stood at a target" in row.reason
    assert f"off by {row.run.audit_counts}" in row.reason


def test_faults_of_a_study_happen_in_its_rows_and_say_what_they_did():
    faults = (
        Fault(kind=FaultKind.BOX_RESTARTED, place=1, from_ps=20 * 10**12),
        Fault(kind=FaultKind.GLITCHES, place=1, from_ps=10**9 * 10**6, until_ps=10**9 * 10**6 + 1),
    )
    result = run_study(small(designs=(Design.C,), faults=faults[:1], probing=((5 * 10**12, 6 * 10**12),)))
    bare, table, row = result.rows
    assert bare.run.fired == table.run.fired == ()
    assert [(str(fired.fault), fired.times) for fired in row.run.fired] == [("box restarted from 20 s", 1)]
    assert row.run.ending is Ending.HELD
    assert row.reason.startswith("held by the PC after 20.")
    assert 0 < row.readings.target_mm.size < bare.readings.target_mm.size
    assert ("Fault", "box restarted from 20 s") in result.facts
    assert ("Probing", "from 5 s to 6 s: nothing is corrected") in result.facts
    document = study_document(result)
    assert document["rows"][-1]["faults"] == [{"fault": "box restarted from 20 s", "times": 1}]
    late = run_study(small(designs=(Design.C,), faults=faults[1:]))
    assert [row.run.fired[0].times for row in late.rows] == [0, 0, 0]
    assert sum("took no effect" in warning for warning in late.warnings) == 3


def test_what_a_program_cannot_show_is_refused_before_anything_is_measured():
    waits = Fault(kind=FaultKind.POWER_LOST, place=1, from_ps=0, trigger=Trigger.WHILE_INSERTING)
    study = replace(small(faults=(waits,)), firmware=Microcontroller.named("8051-12mhz"))
    told = []
    with pytest.raises(ArgumentError, match="do not tell an insertion"):
        run_study(study, progress=lambda what, share: told.append(what))
    assert told == []
