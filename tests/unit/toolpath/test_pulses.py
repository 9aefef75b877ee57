"""Drives whose controllers count pulses: as the drives alone where counts are fine, corrected by a box between."""

import numpy as np
import pytest

from rtec.axis.plants import BallScrew, Feedback, LinearMotor, ScrewRunout, TorqueRipple, run_drive
from rtec.axis.sampled import one_after_another, sampled_command
from rtec.errors import ArgumentError
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.predictors import UnidirectionalTable
from rtec.toolpath import parse_gcode
from rtec.toolpath.contouring import run_contour
from rtec.toolpath.pulses import Pulses, run_over_pulses

PERIOD_S = 1e-3
TIME_S = np.arange(800) * PERIOD_S
THERE_AND_BACK = 3.0 + 10.0 * (1.0 - np.cos(2.0 * np.pi * TIME_S / TIME_S[-1]))
DRIVES = {
    "motor": LinearMotor(cogging_phase_deg=30.0, feedforward_map_a=(0.0, 0.1, 0.0, -0.1)),
    "screw by its scale": BallScrew(once_a_turn=ScrewRunout(phase_deg=40.0)),
    "screw by its encoder": BallScrew(once_a_turn=TorqueRipple(), feedback=Feedback.ROTARY_ENCODER, backlash_um=5.0),
}
SCALE_MM = np.array([-30.0, 0.0, 60.0])


def box(design):
    timing = Timing.of(design, Processor.FAST)
    return InjectorSettings(design=design, timing=timing, real_edges=RealEdges.HOLD)


def scale(per_mm=2e-4, positions_mm=SCALE_MM):
    return UnidirectionalTable(positions_mm=positions_mm, errors_mm=per_mm * positions_mm, backlash_mm=0.0)


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
def test_counts_of_20_nm_drive_as_the_position_itself_does(drive):
    alone = run_drive(drive, TIME_S, THERE_AND_BACK)
    run, loop = run_over_pulses(drive, PERIOD_S, THERE_AND_BACK, Pulses(count_mm=2e-5), "x")
    # the one comes from home, the other begins here: until the integrals agree
    later = TIME_S > 0.2
    assert np.abs(run.load_mm - alone.load_mm)[later].max() < 1e-3
    assert np.sqrt(np.mean((run.load_mm - alone.load_mm)[later] ** 2)) < 2e-4
    assert np.abs(run.velocity_mm_s - alone.velocity_mm_s)[later].max() < 0.5
    assert np.corrcoef(run.current_a[later], alone.current_a[later])[0, 1] > 0.99
    assert np.abs(run.friction_n - alone.friction_n)[later].mean() < 0.05 * np.abs(alone.friction_n).mean()
    assert (loop.audit, loop.insertions.inserted) == (True, 0)
    assert loop.controller_counts == loop.encoder_counts == pytest.approx(run.actual_mm[-1] / 2e-5, abs=50)


@pytest.mark.parametrize("design", Design)
def test_a_box_corrects_the_scale_to_its_step(design):
    path = parse_gcode("G21 G90 G0 X5 Y0\nG1 X35 F1500\n")
    perfect = run_contour(path, "ball-screw", pulses=Pulses(count_mm=1e-3)).axes["x"].load_mm
    without = run_contour(path, "ball-screw", pulses=Pulses(count_mm=1e-3, errors={"x": scale()}))
    pulses = Pulses(count_mm=1e-3, injector=box(design), errors={"x": scale()})
    run = run_contour(path, "ball-screw", pulses=pulses)
    step_mm = 1e-3 * design.step_counts
    assert (without.axes["x"].load_mm - perfect)[-1] == pytest.approx(0.007, abs=1.5e-3)
    assert (run.axes["x"].load_mm - perfect)[-1] == pytest.approx(0.0, abs=0.5 * step_mm + 1.5e-3)
    figures = run.document()["pulses"]
    assert (figures["design"], figures["count_um"]) == (design.key, 1.0)
    x, y = figures["axes"]["x"], figures["axes"]["y"]
    assert x["controller_counts"] - x["encoder_counts"] == pytest.approx(7.0, abs=0.6 * design.step_counts + 1.5)
    assert x["audit"] and y["audit"] and x["corrections_pending"] == y["corrections_inserted"] == 0


def test_a_command_goes_on_where_the_one_before_ends():
    first, then = sampled_command([0.0, 1.0, 2.0], 1e-3), sampled_command([2.0, 2.5], 1e-3)
    both = one_after_another(first, then)
    assert both.position_at([0, first.total_ps, both.total_ps]).tolist() == [0.0, 2.0, 2.5]
    with pytest.raises(ArgumentError, match="from 2 mm on"):
        one_after_another(first, first)


def test_a_controller_stops_where_a_box_loses_the_count():
    timing = Timing.of(Design.B, Processor.MCS51)  # too slow for 75 kHz: the lines pass through it
    lost = InjectorSettings(design=Design.B, timing=timing, real_edges=RealEdges.HOLD)
    path = parse_gcode("G21 G90 G0 X0 Y0\nG1 X200 F18000\n")
    run = run_contour(path, "ball-screw", pulses=Pulses(count_mm=1e-3, injector=lost))
    assert 0.0 < run.stopped_s < run.plan.time_s
    assert not run.limits_held
    assert {axis.time_s.size for axis in run.axes.values()} == {run.contour_mm.size}
    assert not run.document()["pulses"]["axes"]["x"]["audit"]


def test_axes_that_cannot_run():
    path = parse_gcode("G21 G90 G0 X5 Y0\nG1 X35 F1500\n")
    with pytest.raises(ArgumentError, match="known from -30 to 20 mm"):
        run_contour(
            path, "ball-screw", pulses=Pulses(count_mm=1e-3, errors={"x": scale(0.0, np.array([-30.0, 20.0]))})
        )
    with pytest.raises(ArgumentError, match="above 0"):
        Pulses(count_mm=0.0)
    with pytest.raises(ArgumentError, match="mm or more for this path"):
        run_contour(path, "ball-screw", pulses=Pulses(count_mm=1e-8))
    with pytest.raises(ArgumentError, match="30 mm wide in x"):
        run_contour(path, "ball-screw", travel_mm=20.0)
    with pytest.raises(ArgumentError, match="one of them"):
        run_contour(path, "ball-screw", pulses=Pulses(count_mm=1e-3), corrector={})
