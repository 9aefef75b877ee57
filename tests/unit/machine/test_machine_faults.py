"""Faults that the loop must show: real edges inside insertions, a controller that faults, words too narrow."""

from dataclasses import replace

import pytest

from rtec.axis import Encoder, Imperfections
from rtec.controller import IllegalPolicy, Multiplication, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import Design, RealEdges
from rtec.machine import Ending, Machine, closed_loop, measuring_run, run_machine, straight_pass
from rtec.metrology import MeasuringPlan
from rtec.predictors import LatheNetwork, UnidirectionalTable
from tests.machines import LIMITS, box_of

LATHE = LatheNetwork()


def creeping(design, real_edges):
    """Run the lathe from target to target: it creeps towards each while the last corrections are inserted."""
    plan = MeasuringPlan(
        start_mm=25.4, end_mm=50.8, increment_mm=1.27, dwell_s=2, runs=2, feed_mm_s=50 * 25.4 / 60, overshoot_mm=2.54
    )
    machine = Machine(axis_error=LATHE, model=LATHE, injector=box_of(design, real_edges))
    return run_machine(machine, measuring_run(plan, LIMITS))


def off_by_hand(result):
    """Return the audit's invariant from the two counters."""
    return result.controller_counts - result.encoder_counts - result.insertions.completed * result.step_counts


def test_a_real_edge_merged_into_an_insertion_costs_counts_and_shows():
    merged = {design: creeping(design, RealEdges.MERGE) for design in (Design.A, Design.C)}
    for result in merged.values():
        assert result.insertions.real_inside > 0
        assert result.audit_counts == off_by_hand(result)
        assert result.audit == (result.audit_counts == 0)
        assert result.received.illegal_transitions == 0  # the controller cannot notice
    off = [result.audit_counts for result in merged.values() if result.audit_counts]
    assert off
    assert all(count % 2 == 0 for count in off)


SLOW_INPUT = ReceiverSettings(filter_samples=1, clock_hz=20_000)
"""Sees the lines every 50 µs; at 20 mm/s there is an edge every 50 µs, and two of them fall between two looks."""


def test_a_controller_too_slow_for_the_feed_faults():
    machine = Machine(receiver=replace(SLOW_INPUT, policy=IllegalPolicy.FAULT))
    result = run_machine(machine, straight_pass([50.0, 0.0], 40.0, LIMITS))
    assert result.ending is Ending.FAULTED
    assert result.received.illegal_transitions == 1
    assert result.received.fault_ps == pytest.approx(result.simulated_s * 1e12, abs=1.1e9)  # within that tick
    assert not result.audit
    assert result.simulated_s < 2.0


def test_without_the_policy_it_goes_astray_and_the_audit_says_by_how_much():
    result = run_machine(Machine(receiver=SLOW_INPUT), straight_pass([50.0, 0.0], 40.0, LIMITS))
    assert result.ending is Ending.FINISHED
    assert result.received.illegal_transitions > 0
    assert not result.audit
    assert result.audit_counts == off_by_hand(result) != 0


@pytest.mark.one_in(5)
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("design", Design)
def test_jitter_keeps_the_order_of_events(design, seed):
    """A jitter much longer than an insertion must not carry an edge past the changes of the box."""
    jittery = Encoder(home_state=1, imperfections=Imperfections(jitter_ps=60_000_000), seed=seed)
    machine = Machine(axis_error=LATHE, model=LATHE, injector=box_of(design), encoder=jittery)
    plan = MeasuringPlan(
        start_mm=25.4, end_mm=76.2, increment_mm=6.35, dwell_s=2, runs=1, feed_mm_s=18 * 25.4 / 60, overshoot_mm=2.54
    )
    result = run_machine(machine, measuring_run(plan, LIMITS))
    assert result.audit
    # changes of one insertion are 1 µs apart, and an edge held back follows a step later; B's writings lie 4 µs apart
    assert result.received.min_separation_ps >= (4_000_000 if design is Design.B else 900_000)


@pytest.mark.parametrize("design", Design)
def test_an_edge_is_never_earlier_than_what_was_done_before_it(design):
    """So slow that insertions come between the edges, at rest: an edge may be due early, but not before them."""
    late = Encoder(imperfections=Imperfections(jitter_ps=700_000_000), seed=5)
    rising = UnidirectionalTable(positions_mm=[0.0, 5.0], errors_mm=[0.0, 0.5], backlash_mm=0.0)
    machine = Machine(axis_error=rising, model=rising, injector=box_of(design), encoder=late)
    result = run_machine(machine, straight_pass([3.0, 0.0, 3.0, 0.0], 0.6, LIMITS))
    assert result.insertions.inserted > 100
    assert result.audit
    assert result.received.min_separation_ps >= 900_000  # as above; the edges themselves stay 0.2 ms apart


@pytest.mark.parametrize(("design", "held_um"), [(Design.ORIGINAL, 508), (Design.A, 508), (Design.C, 254)])
def test_what_a_word_cannot_hold_is_pending_and_never_wraps(design, held_um):
    error = UnidirectionalTable(positions_mm=[0.0, 5.0, 10.0], errors_mm=[0.0, 0.0, 0.6], backlash_mm=0.0)
    machine = Machine(axis_error=error, model=error, injector=box_of(design))
    result = run_machine(machine, straight_pass([10.0], 10.0, LIMITS, dwell_s=4.0))
    step = design.step_counts
    # at the end the axis stands where encoder and controller differ by what was inserted
    assert result.insertions.completed * step == held_um
    assert result.insertions.completed == 127
    assert result.pending_steps == result.beyond_word_steps == result.wanted_steps - 127 > 0
    assert (result.refused, result.audit) == (0, True)


@pytest.mark.parametrize("sign", [1, -1])
def test_two_bytes_of_design_b_hold_it(sign):
    table = UnidirectionalTable(positions_mm=[0.0, 5.0, 10.0], errors_mm=[0.0, 0.0, sign * 0.6], backlash_mm=0.0)
    machine = Machine(axis_error=table, model=table, injector=box_of(Design.B))
    result = run_machine(machine, straight_pass([10.0], 10.0, LIMITS, dwell_s=6.0))
    assert result.beyond_word_steps == result.pending_steps == 0
    # at the end x + e(x) = 10 mm: with e = 0.12 (x - 5) at x = 5 + 5 / 1.12, or beyond the table
    assert result.insertions.completed == pytest.approx(535.7 if sign > 0 else -600, abs=1.6)
    assert result.audit


def test_coarser_decoders_only_without_a_box():
    coarse = ReceiverSettings(multiplication=Multiplication.X1)
    with pytest.raises(ArgumentError, match=r"multiplication: 1.*x4"):
        run_machine(Machine(injector=box_of(Design.B), receiver=coarse), straight_pass([1.0], 10.0, LIMITS))


@pytest.mark.one_in(7)
@pytest.mark.parametrize("home_state", [0, 1, 2, 3])
@pytest.mark.parametrize("target_mm", [10.0, 10.001, 10.002, -10.003])
@pytest.mark.parametrize("multiplication", Multiplication)
def test_coarser_decoders_are_audited_too(multiplication, target_mm, home_state):
    machine = Machine(
        encoder=Encoder(home_state=home_state), receiver=ReceiverSettings(multiplication=multiplication)
    )  # fmt: skip
    result = run_machine(machine, straight_pass([target_mm], 10.0, LIMITS, dwell_s=2.0))
    assert result.controller_counts == pytest.approx(target_mm * 1000 * multiplication.value / 4, abs=1)
    assert result.audit


def test_runs_beyond_the_kernels_time_are_refused():
    motion = straight_pass([1.0], 10.0, LIMITS, dwell_s=51 * 86_400.0)
    with pytest.raises(ArgumentError, match=r"task: 51.0 days; use a run of at most 50 days"):
        run_machine(Machine(), motion)


def test_a_dwell_of_days_costs_next_to_nothing():
    motion = straight_pass([1.0, 0.0], 10.0, LIMITS, dwell_s=86_400.0)
    machine = Machine(axis_error=LATHE, model=LATHE, injector=box_of(Design.C))
    result = run_machine(machine, motion)
    assert result.audit
    assert result.ticks > 170_000_000
    assert result.ticks - result.ticks_skipped < 10_000
    assert result.exchanges == pytest.approx(result.simulated_s * 100, abs=2)


def test_more_edges_than_anyone_waits_for_are_refused():
    fine = Machine(encoder=Encoder(count_mm=1e-9))
    with pytest.raises(ArgumentError, match=r"count_mm: 1e-09.*1e\+11 edges"):
        run_machine(fine, straight_pass([900.0], 100.0, LIMITS))


@pytest.mark.parametrize("slices", [1, 7, 5_000])
def test_parts_do_not_change_the_result(monkeypatch, slices):
    motion = straight_pass([30.0, 27.0], 20.0, LIMITS, dwell_s=1.0)
    machine = Machine(axis_error=LATHE, model=LATHE, injector=box_of(Design.C))
    plain = run_machine(machine, motion)
    monkeypatch.setattr(closed_loop, "_slices", lambda *_: slices)
    other = run_machine(machine, motion)
    same = ("insertions", "received", "encoder_counts", "controller_counts", "exchanges", "not_valid", "ticks")
    assert all(getattr(plain, name) == getattr(other, name) for name in same)


def test_a_trace_that_fills_the_memory_is_refused():
    motion = straight_pass([1.0], 10.0, LIMITS, dwell_s=30_000.0)
    with pytest.raises(ArgumentError, match="trace_every"):
        run_machine(Machine(), motion, trace_every=1)


def test_ctrl_c_ends_a_run_in_the_middle():
    def press(share):
        if share > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_machine(Machine(), straight_pass([5.0], 10.0, LIMITS), progress=press)
