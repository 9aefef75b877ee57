"""The safety campaign: no avoidable undetected error, and one that is built in is found."""

import csv
import dataclasses
import io
import re

import numpy as np
import pytest

from rtec.axis.command import Move
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.machine.fault_kinds import INSIDE_BOX, PROCESSOR_HUNG
from rtec.machine.faults import Fault, FaultKind
from rtec.report.figures_safety import safety_figure
from rtec.report.safety_page import faults_csv, grouped, safety_page
from rtec.requester.supervision import SupervisionLimits
from rtec.verify.safety.case import detection_of, make_case, ramp_jobs
from rtec.verify.safety.matrix import MatrixPlan, Outcome, judged, run_matrix
from rtec.verify.safety.monitor import MonitoredCell, Stopper, sinusoidal_table, station_settings
from rtec.verify.safety.phases import Phase, new_cell, run_through, twin_of
from rtec.verify.safety.variants import VARIANTS, impossible

MS, S = 10**9, 10**12
MAIN = (Design.ORIGINAL, Design.A, Design.C)


def outcome_of(faults, design=Design.C, phase=Phase.CUTTING, supervision=None, spoil=None):
    """Return how a run is judged beside its twin."""
    twin = new_cell(phase, design, 0, supervision=supervision)
    run_through(twin, phase)
    harmless = Fault(kind=FaultKind.PROBE_TRIPPED, place=1, from_ps=2 * S)
    cell = new_cell(phase, design, 0, faults=faults or (harmless,), supervision=supervision)
    if spoil is not None:
        cell.monitor(until_ps=2 * S)
        spoil(cell)
    run_through(cell, phase)
    return judged(VARIANTS[0], phase, design, 0, cell, twin)


@pytest.fixture(scope="module")
def matrix():
    return run_matrix(MatrixPlan(designs=(Design.C,), seeds=1))


def test_no_undetected_error_is_avoidable_and_every_fault_takes_effect(matrix):
    assert matrix.avoidable == ()
    fired = {trial.variant.name for trial in matrix.trials if trial.fired}
    assert fired == {variant.name for variant in VARIANTS}
    assert {trial.variant.kind for trial in matrix.trials if trial.fired} == {*FaultKind, *INSIDE_BOX}


def test_what_can_strike_does(matrix):
    """One seed may meet an axis at rest whose lines a fault does not change; everything else trigger."""
    cable = {FaultKind.CABLE_OPEN, FaultKind.LINES_SWAPPED}
    assert all(variant.kind in cable and variant.lasts_ps for variant, _ in matrix.unproven)


def test_what_cannot_strike_does_not(matrix):
    activated = [trial for trial in matrix.trials if impossible(trial.variant, trial.phase) and trial.fired]
    assert [trial for trial in activated if trial.phase in (Phase.START_UP, Phase.AT_REST)] == []


@pytest.mark.parametrize("kind", [FaultKind.PC_KILLED, FaultKind.POWER_LOST, PROCESSOR_HUNG])
def test_a_dead_partner_is_always_detected(matrix, kind):
    trials = [trial for trial in matrix.trials if trial.variant.kind is kind]
    assert {trial.outcome for trial in trials} == {Outcome.SAFE_STOP}
    # the watchdog timeout of 50 ms, a turn of either side
    assert all(trial.detected_s is None or trial.detected_s <= 0.062 for trial in trials)


def test_what_comes_twice_or_in_disorder_never_harms(matrix):
    harmless = (FaultKind.FRAME_DUPLICATED, FaultKind.FRAMES_REORDERED, FaultKind.FRAME_LATE, FaultKind.PROBE_TRIPPED)
    outcomes = {trial.outcome for trial in matrix.trials if trial.variant.kind in harmless}
    assert outcomes <= {Outcome.TOLERATED, Outcome.DELAYED}


# -------------------------------------------------------------- what is built in is found


def test_a_count_lost_at_the_controller_is_undetected():
    def spoil(cell):
        cell._stations[0].receiver.count -= 1

    assert outcome_of((), spoil=spoil).outcome is Outcome.UNDETECTED


def test_a_box_that_lies_about_its_insertions_is_undetected():
    def spoil(cell):
        cell._stations[0].injector.completed += 1

    assert outcome_of((), spoil=spoil).outcome is Outcome.UNDETECTED


def test_without_the_watchdog_a_killed_pc_is_undetected():
    kill = Fault(kind=FaultKind.PC_KILLED, from_ps=2 * S)
    assert outcome_of((kill,)).outcome is Outcome.SAFE_STOP
    broken = SupervisionLimits()
    object.__setattr__(
        broken, "watchdog_ps", 100 * S
    )  # nobody can ask for this: here the watchdog itself is taken out
    assert outcome_of((kill,), supervision=broken).outcome is Outcome.UNDETECTED


@pytest.mark.parametrize("design", Design)
def test_only_a_limit_catches_a_pc_that_runs_away(design):
    none, steps, deviation = (job.run() for job in ramp_jobs(design))
    assert none.outcome is Outcome.UNDETECTED
    assert none.off_mm == pytest.approx(0.180, abs=0.003)  # 60 um/s for 3 s
    assert (steps.outcome, steps.reason) == (Outcome.SAFE_STOP, "box: implausible")
    assert (deviation.outcome, deviation.reason) == (Outcome.SAFE_STOP, "PC: deviation limit")
    # the healthy total was at least -20 um, the limit is 50 um
    assert max(steps.off_mm, deviation.off_mm) < 0.072


# ------------------------------------------------------------------------ the monitor itself


def test_the_monitor_holds_against_the_table_by_hand():
    """At rest at 2 mm the table has about 20 um * sin(2) = 18.2 um: nine steps of 2 um."""
    moves = [[Move(target_mm=2.0, speed_mm_s=2.0, rest_s=100.0)]]
    cell = MonitoredCell([station_settings(1, Design.C)], moves, sinusoidal_table())
    cell.monitor(until_ps=3 * S)
    axis = cell.monitored[0]
    true_mm = cell.true_count(1) * 0.001
    assert cell.axes[0].view.requested == 9
    table_um = np.interp(true_mm, [1.5, 2.0], 20.0 * np.sin([1.5, 2.0]))  # a line from 0.5 mm to 0.5 mm
    assert axis.asked_counts == pytest.approx(18.0 - table_um, abs=1e-6)
    assert (axis.off_counts, axis.uninserted_counts, axis.stopped_by) == (0, 0, Stopper.NOBODY)
    assert axis.checks > 1000


@pytest.mark.one_in(5)
@pytest.mark.parametrize("phase", Phase)
@pytest.mark.parametrize("design", MAIN)
def test_each_phase_is_what_it_says(phase, design):
    twin = twin_of(phase, design, 1)
    axes = twin.cell.monitored
    assert all(axis.off_counts == 0 and abs(axis.asked_counts) <= axis.bound_counts for axis in axes)
    assert all(axis.stop_ps is None for axis in axes)
    cell = new_cell(phase, design, 1)
    run_through(cell, phase, until_ps=twin.moment_ps + max(twin.span_ps // 2, MS))
    station = cell.axes[0].view
    moving = abs(station.speed_mm_s)
    if phase is Phase.START_UP:
        assert not cell.running
    elif phase in (Phase.AT_REST, Phase.LARGE):
        assert moving < 0.5
    elif phase is Phase.RAPID:
        assert moving > 100.0
        assert station.counters.gate_refused > 0
    elif phase is Phase.REVERSAL:
        assert moving < 1.0
    elif phase is Phase.PROBING:
        assert station.probing
        assert moving > 1.9 or moving == 0.0
    else:
        assert moving == pytest.approx(2.0, abs=0.3)
    if phase is Phase.INSERTION:
        assert cell.sent_steps(1) != new_total_before(phase, design, twin.moment_ps)


def new_total_before(phase, design, moment_ps):
    cell = new_cell(phase, design, 1)
    run_through(cell, phase, until_ps=moment_ps)
    return cell.sent_steps(1)


# ------------------------------------------------------------------------- page and figure


@pytest.fixture(scope="module")
def case():
    some = tuple(v for v in VARIANTS if v.kind in (FaultKind.PC_KILLED, FaultKind.FRAME_LOST, FaultKind.LINE_BROKEN))
    return make_case(MatrixPlan(designs=(Design.B, Design.C), phases=(Phase.CUTTING,), variants=some, seeds=1))


def test_the_page_says_what_was_found(case):
    page = safety_page(case, command="rtec safety", picture="safety.png", table="safety.csv")
    assert re.search(r"^\| (?:[^|]*; )?PC killed(?:; [^|]*)? \| safe stop \|", page, re.M)
    assert re.search(r"^\| one line of a pair broken, for 50 ms \| \*\*undetected\*\* \|", page, re.M)
    assert "safety.png" in page
    assert "(safety.csv)" in page
    assert case.good


def test_the_table_beside_the_page_has_every_fault_that_stopped_or_delayed(case):
    rows = {row["fault"]: row for row in csv.DictReader(io.StringIO(faults_csv(case)))}
    killed = rows["PC killed"]
    assert (killed["safe stop"], killed["delayed"]) == ("2 of 2", "0")
    assert killed["who said so"].startswith("box: link lost")
    assert 0 < float(killed["median, ms"]) <= float(killed["longest, ms"]) < 100
    told = (Outcome.SAFE_STOP, Outcome.DELAYED)
    assert set(rows) == {trial.variant.name for trial in case.matrix.trials if trial.outcome in told}


def test_faults_that_end_alike_share_a_row():
    rows = grouped({"a": {"rest": "x", "feed": "x", "rapid": "y"}, "b": {"rest": "x", "feed": "x", "rapid": "y"}})
    assert rows == [("a; b", "x", "y: rapid")]


def test_an_avoidable_undetected_error_is_told(case):
    trial = next(trial for trial in case.matrix.trials if trial.design is Design.C)
    undetected = dataclasses.replace(trial, outcome=Outcome.UNDETECTED, variant=VARIANTS[0], fired=1)
    bad = dataclasses.replace(case, matrix=dataclasses.replace(case.matrix, trials=(*case.matrix.trials, undetected)))
    assert not bad.good
    assert bad.matrix.avoidable == (undetected,)
    assert "Also undetected" in safety_page(bad, command="rtec safety", picture="safety.png", table="safety.csv")


def test_detection_is_measured_from_the_first_effect(case):
    killed = [trial for trial in case.matrix.trials if trial.variant.kind is FaultKind.PC_KILLED]
    found = detection_of(killed)
    assert found.reasons == ("box: link lost",)
    assert found.held == 2
    assert 0.040 <= found.median_s <= found.longest_s <= 0.052


def test_the_figure_has_a_mark_for_each_fault_and_phase(case):
    figure = safety_figure(case.matrix)
    words = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert len(words) == 2 * len(case.matrix.plan.variants)
    assert set(words) <= {"t", "d", "s", "u", "U", "–"}


@pytest.mark.parametrize("changes", [{"seeds": 0}, {"seed": -1}])
def test_a_plan_that_is_none_is_refused(changes):
    with pytest.raises(ArgumentError, match=next(iter(changes))):
        MatrixPlan(**changes)
