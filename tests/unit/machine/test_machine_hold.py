"""The paper's turning case: an axis held at one position while it grows."""

import numpy as np
import pytest

from rtec.axis import Dwell, Encoder, Program, Servo, plan
from rtec.heat.approach import approach
from rtec.injector import Design
from rtec.machine import TRACE_COLUMNS, Machine, run_machine
from rtec.predictors import growth
from tests.machines import LIMITS, box_of

GROWTH_MM = 0.010
COUNT_MM = 0.001
COMMAND, TRUE, COMPLETED = (TRACE_COLUMNS.index(name) for name in ("command_mm", "true_mm", "completed"))


def held(design, state, *, final_mm=GROWTH_MM, servo=None):
    """Return the result of holding an axis in ``state``, and its deviation at the ticks of the last second."""
    box = box_of(design)
    machine = Machine(
        injector=box,
        encoder=Encoder(count_mm=COUNT_MM, home_state=state),
        servo=servo or Servo(),
        heat=approach(shift_mm=final_mm, rise_k={"axis": 5.0}, time_constant_s=1.0),
        model=growth("axis", final_mm / 5.0),
    )
    motion = plan(Program(blocks=(Dwell(seconds=12.0),)), LIMITS)
    result = run_machine(machine, motion, trace_every=1)
    deviation = (result.trace[:, TRUE] - result.trace[:, COMMAND])[-1000:]
    return result, deviation


@pytest.mark.parametrize("growth_mm", [GROWTH_MM, -GROWTH_MM])
@pytest.mark.parametrize("state", [1, 2, 3])
def test_the_original_cannot_insert_outside_state_0(state, growth_mm):
    result, deviation = held(Design.ORIGINAL, state, final_mm=growth_mm)
    assert result.insertions.inserted == 0
    assert deviation == pytest.approx(growth_mm, abs=0.6 * COUNT_MM)  # all of the growth
    assert abs(result.pending_steps) == 2  # 10 µm in steps of 4 µm
    assert result.audit


@pytest.mark.one_in(5)
@pytest.mark.parametrize("growth_mm", [GROWTH_MM, -GROWTH_MM])
@pytest.mark.parametrize("state", [0, 1, 2, 3])
@pytest.mark.parametrize("design", [Design.A, Design.B, Design.C])
def test_the_others_hold_the_axis(design, state, growth_mm):
    result, deviation = held(design, state, final_mm=growth_mm)
    assert np.abs(deviation).max() <= (design.step_counts + 1) * COUNT_MM
    assert result.pending_steps == 0
    assert result.insertions.completed == round(growth_mm / (design.step_counts * COUNT_MM))
    assert result.audit


def test_the_original_holds_the_axis_in_state_0():
    # a step of four counts leads from state 0 back to state 0
    result, deviation = held(Design.ORIGINAL, 0)
    assert np.abs(deviation).max() <= 5 * COUNT_MM
    assert result.insertions.completed == 2
    assert result.audit


def test_dither_that_reaches_state_0_lets_the_original_insert():
    swinging = Servo(dither_counts=8.0, dither_hz=1.0, deadband_counts=0.0)
    result, deviation = held(Design.ORIGINAL, 2, servo=swinging)
    assert result.insertions.completed == 2
    assert abs(float(np.mean(deviation))) <= 3 * COUNT_MM
    assert result.audit


def test_dither_that_does_not_reach_state_0_does_not_help():
    result, deviation = held(Design.ORIGINAL, 2, servo=Servo(dither_counts=0.9, dither_hz=1.0, deadband_counts=0.0))
    assert result.insertions.inserted == 0
    assert float(np.mean(deviation)) == pytest.approx(GROWTH_MM, abs=0.6 * COUNT_MM)


def test_growth_is_a_first_order_approach():
    result, _ = held(Design.ORIGINAL, 2)
    times = result.trace[:, TRACE_COLUMNS.index("time_s")]
    grown = result.trace[:, TRUE] - result.trace[:, TRACE_COLUMNS.index("encoder_mm")]
    assert grown == pytest.approx(GROWTH_MM * (1.0 - np.exp(-times)), abs=1e-9)
