"""The lathe in the closed loop, against the figures that the thesis's network gives on its own."""

import numpy as np
import pytest

from rtec.axis import Encoder, Limits
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine import Ending, Machine, measuring_run, readings_of, run_machine
from rtec.metrology import MeasuringPlan, positioning_figures
from rtec.predictors import BidirectionalTable, LatheNetwork
from rtec.requester.status import Status

LIMITS = Limits(max_speed_mm_s=120.0, max_acceleration_mm_s2=500.0, rapid_mm_s=120.0)
COUNT_INCH = 0.001 / 25.4
PITCH_MM = 6.35


def plan(increment, runs):
    return MeasuringPlan(
        start_mm=25.4,
        end_mm=1016,
        increment_mm=increment * 25.4,
        dwell_s=6,
        runs=runs,
        feed_mm_s=50 * 25.4 / 60,
        overshoot_mm=2.54,
    )


def measured(design, increment, runs, **parts):
    """Return the result, and the figures of its readings."""
    box = None
    if design is not None:
        timing = Timing.of(design, Processor.MCS51)
        box = InjectorSettings(design=design, timing=timing, real_edges=RealEdges.HOLD)
    lathe = LatheNetwork()
    machine = Machine(axis_error=lathe, model=lathe, injector=box, encoder=Encoder(home_state=1), **parts)
    task = measuring_run(plan(increment, runs), LIMITS)
    result = run_machine(machine, task)
    return result, positioning_figures(readings_of(task, result.deviation_mm), period=PITCH_MM)


# the network's own figures on both grids (inch); the axis rests up to half a count beside each target, at both
# readings of a difference
@pytest.mark.parametrize(
    ("increment", "average", "reversal"), [(0.025, 0.005176, 0.003892), (0.52, 0.005087, 0.003908)]
)
def test_uncompensated_lathe_shows_the_networks_error(increment, average, reversal):
    result, figures = measured(None, increment, 1)
    assert figures.max_average_error / 25.4 == pytest.approx(average, abs=COUNT_INCH)
    assert figures.max_reversal_error / 25.4 == pytest.approx(reversal, abs=COUNT_INCH)
    assert result.audit
    assert result.insertions.inserted == 0


@pytest.fixture(scope="module")
def corrected():
    return {design: measured(design, 0.52, 5) for design in Design}


@pytest.mark.parametrize(
    ("design", "limit_um"), [(Design.B, 2.0), (Design.C, 3.0), (Design.A, 5.0), (Design.ORIGINAL, 5.0)]
)
def test_corrected_lathe_at_rest(corrected, design, limit_um):
    result, figures = corrected[design]
    assert figures.peak_to_peak * 1000 <= limit_um
    assert result.ending is Ending.FINISHED
    assert result.deviation_mm.size == 760
    assert result.audit
    assert result.audit_counts == 0
    done = result.insertions
    assert done.ahead_counts == done.completed * result.step_counts  # what the monitor saw is what the box believes
    assert result.controller_counts == result.encoder_counts + done.completed * result.step_counts
    assert result.received.illegal_transitions == done.illegal == 0
    assert result.pending_steps == 0
    assert result.beyond_word_steps == 0
    assert result.refused == 0
    assert result.status is Status.OK


def test_finer_steps_leave_less(corrected):
    rms = {design: figures.rms for design, (_, figures) in corrected.items()}
    assert rms[Design.B] <= rms[Design.C] <= rms[Design.A]
    assert corrected[Design.B][0].insertions.inserted > 100_000  # the reversals of 5 runs, 100 µm each


@pytest.mark.parametrize(("interval_inch", "limit_um"), [(0.025, 9.0), (0.0025, 2.0)])
def test_controllers_own_table_leaves_what_lies_between_its_points(interval_inch, limit_um):
    # the printed network jumps at each whole pitch, which a table cannot; beside that, each reading rounds to a count
    grid = np.linspace(25.4, 40 * 25.4, round(39 / interval_inch) + 1)
    result, figures = measured(None, 0.52, 1, own_table=BidirectionalTable.sampled_from(LatheNetwork(), grid))
    assert figures.peak_to_peak * 1000 < limit_um
    assert result.insertions.inserted == 0


@pytest.mark.sweep
def test_calibration_of_the_thesis_with_design_b():
    result, figures = measured(Design.B, 0.025, 4)
    assert result.deviation_mm.size == 12_488
    assert 19 * 3600 < result.simulated_s < 22 * 3600
    assert figures.peak_to_peak * 1000 <= 2.0
    assert result.audit


def test_a_direction_of_the_calibration_with_design_b():
    result, figures = measured(Design.B, 0.025, 1)
    assert result.deviation_mm.size == 3_122
    assert figures.peak_to_peak * 1000 <= 2.0
    assert result.audit
    assert (result.pending_steps, result.refused) == (0, 0)
