"""The play between forward and reverse error: a stay within it, not a jump at a change of sign."""

from dataclasses import replace

import numpy as np
import pytest
from loop_oracle import play

from rtec.axis import Dwell, Move, Program, plan
from rtec.errors import ArgumentError
from rtec.machine import TRACE_COLUMNS, Laser, Machine, MeasuringRun, run_machine
from rtec.predictors import BidirectionalTable, UnidirectionalTable
from tests.machines import LIMITS

POSITIONS = [0.0, 10.0, 20.0, 30.0]
FORWARD = [0.000, 0.030, 0.010, 0.040]
REVERSE = [0.100, 0.110, 0.110, 0.160]
ERROR = BidirectionalTable(
    forward_positions_mm=POSITIONS,
    forward_errors_mm=FORWARD,
    reverse_positions_mm=POSITIONS,
    reverse_errors_mm=REVERSE,
)
ENCODER, TRUE = TRACE_COLUMNS.index("encoder_mm"), TRACE_COLUMNS.index("true_mm")
# reversals inside the play of about 0.1 mm, and beyond it
TARGETS = [8.0, 7.97, 7.99, 7.90, 7.95, 7.50, 7.55, 7.53, 7.80, 15.0, 14.96, 25.0, 24.5, 24.52, 12.0]


def visit(targets, *, read=None):
    """Return a run that stands at each target for 2 s and reads it there, or only at the targets ``read``."""
    blocks = [Dwell(seconds=0.1)]
    for target in targets:
        blocks += [Move(target_mm=target, feed_mm_s=10.0), Dwell(seconds=2.0)]
    motion = plan(Program(blocks=tuple(blocks)), LIMITS)
    read = np.arange(len(targets)) if read is None else np.array(read)
    last = 2 + 2 * read
    count = read.size
    return MeasuringRun(
        motion=motion,
        target_mm=np.array(targets)[read],
        direction=np.ones(count, np.int8),
        run=np.arange(count),
        begins_ps=motion.block_end_ps[last - 1],
        ends_ps=motion.block_end_ps[last],
    )


MACHINE = Machine(axis_error=ERROR, laser=Laser(window_mm=0.005, dwell_s=1.0))


def flank(errors):
    return lambda x_mm: x_mm + np.interp(x_mm, POSITIONS, errors)


def test_readings_follow_the_play_of_the_oracle():
    task = visit(TARGETS)
    readings = run_machine(MACHINE, task).deviation_mm
    path = run_machine(MACHINE, task, trace_every=1).trace  # what is traced has no part in the readings above
    true_mm = np.array(play(path[:, ENCODER], flank(FORWARD), flank(REVERSE)))
    assert path[:, TRUE] == pytest.approx(true_mm, abs=1e-6)  # between ticks it turns at most 1 nm further
    times = path[:, 0] * 1e12
    for index, target in enumerate(task.target_mm):
        standing = np.flatnonzero((times > task.ends_ps[index] - 0.2e12) & (times <= task.ends_ps[index]))
        assert readings[index] == pytest.approx(true_mm[standing[-1]] - target, abs=1e-5)  # it still creeps a little


def test_what_happens_between_two_readings_is_not_forgotten():
    every = run_machine(MACHINE, visit(TARGETS)).deviation_mm
    for index in range(1, len(TARGETS)):
        alone = run_machine(MACHINE, visit(TARGETS, read=[index])).deviation_mm
        assert alone[0] == pytest.approx(every[index], abs=1e-9)


def test_start_lies_within_the_play():
    # at home nothing has moved yet: 0 is the forward flank and stays the true position
    assert run_machine(MACHINE, visit([0.0])).deviation_mm[0] == pytest.approx(0.0, abs=1e-12)
    shifted = replace(ERROR, forward_errors_mm=np.array(FORWARD) + 0.02)
    assert run_machine(replace(MACHINE, axis_error=shifted), visit([0.0])).deviation_mm[0] == pytest.approx(0.02)


def test_reverse_below_forward_is_refused():
    with pytest.raises(ArgumentError, match=r"axis_error: -4.000 µm of play at 0.000 mm.*swap the directions"):
        Machine(axis_error=UnidirectionalTable(positions_mm=[0, 50], errors_mm=[0, 0], backlash_mm=-0.004))


def test_a_dip_between_the_points_of_any_grid_is_refused():
    positions = [0.0, 333.33331, 333.33333, 333.33335, 1000.0]
    narrow = BidirectionalTable(
        forward_positions_mm=positions,
        forward_errors_mm=[0.0] * 5,
        reverse_positions_mm=positions,
        reverse_errors_mm=[0.01, 0.01, 0.00999, 0.01, 0.01],
    )
    Machine(axis_error=narrow)
    with pytest.raises(ArgumentError, match="axis_error"):
        Machine(axis_error=replace(narrow, reverse_errors_mm=[1e-5, 1e-5, -1e-8 - 1e-6, 1e-5, 1e-5]))


def test_an_error_that_falls_as_fast_as_the_axis_moves_is_refused():
    def table(drop):
        return UnidirectionalTable(positions_mm=[0.0, 1.0, 2.0], errors_mm=[0.0, -drop, -drop], backlash_mm=0.0)

    Machine(axis_error=table(0.9))
    with pytest.raises(ArgumentError, match=r"a fall by 1 mm from 0 to 1 mm"):
        Machine(axis_error=table(1.0))
