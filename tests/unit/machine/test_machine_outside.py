"""A model outside what it was made for: the machine is held, or the correction stays or goes to zero, as chosen."""

from dataclasses import replace

import numpy as np
import pytest

from rtec.axis import Dwell, Encoder, Program, plan
from rtec.axis.command import Move
from rtec.heat.course import HeatCourse
from rtec.injector import Design
from rtec.machine import TRACE_COLUMNS, Ending, Machine, run_machine
from rtec.machine.cell import Cell
from rtec.machine.station import StationSettings
from rtec.predictors import StepModel
from rtec.requester.settings import HandshakeSettings, Outside, PcState
from rtec.requester.supervision import HoldReason
from tests.machines import LIMITS, box_of

S = 10**12
WINDOW, STEP_MM = 3, 0.001
TIMES, TEMPERATURES = [0.0, 2.0, 6.0, 8.0, 12.0], [20.0, 20.0, 32.0, 32.0, 20.0]
COURSE = HeatCourse(time_s=TIMES, thermometers={"nut": TEMPERATURES})
OUT_S, BACK_S = 2.0 + 4.0 * 10.0 / 12.0, 8.0 + 4.0 * 2.0 / 12.0
"""When it passes 30 degrees on its way up and on its way down."""


def by_degree(numbers, inputs, memory, sd):
    return numbers[0] * (inputs[0] - 20.0)


def up_to_thirty(numbers, inputs, memory, sd):
    return numbers[0] * (inputs[0] - 20.0) if inputs[0] <= 30.0 else np.nan


TRAINED = StepModel(
    function=by_degree, inputs=("temperature_nut", "position"), numbers=[0.001],
    ranges={"temperature_nut": (15.0, 30.0)},
)  # fmt: skip
SILENT = StepModel(function=up_to_thirty, inputs=("temperature_nut",), numbers=[0.001])


def run(outside, model=TRAINED):
    machine = Machine(
        injector=box_of(Design.B),
        encoder=Encoder(),
        model=model,
        heat=COURSE,
        handshake=HandshakeSettings(outside=outside),
    )
    motion = plan(Program(blocks=(Dwell(seconds=14.0),)), LIMITS)
    result = run_machine(machine, motion, trace_every=10)
    time_s, wanted, completed = (
        result.trace[:, TRACE_COLUMNS.index(name)] for name in ("time_s", "wanted", "completed")
    )
    return result, time_s, wanted, completed


def test_by_default_the_machine_is_held_and_the_result_says_by_which_sensor():
    result, *_ = run(Outside.HOLD)
    assert result.ending is Ending.HELD
    assert result.simulated_s == pytest.approx(OUT_S, abs=0.02)
    assert (result.outside_input, result.outside_s) == ("temperature_nut", 0.01)


@pytest.mark.parametrize(("outside", "left"), [(Outside.KEEP, 10), (Outside.ZERO, 0)])
@pytest.mark.parametrize(("model", "said"), [(TRAINED, "temperature_nut"), (SILENT, "no answer within its ranges")])
def test_the_correction_stays_or_goes_to_zero_and_comes_back_with_the_temperature(outside, left, model, said):
    result, time_s, wanted, completed = run(outside, model)
    assert result.ending is Ending.FINISHED
    assert (result.outside_input, result.audit) == (said, True)
    assert result.outside_s == pytest.approx(BACK_S - OUT_S, abs=0.02)
    away = (time_s > OUT_S + 0.2) & (time_s < BACK_S - 0.02)
    assert set(wanted[away]) == set(completed[away]) == {left}
    inside = (time_s < OUT_S - 0.02) | (time_s > BACK_S + 0.2)
    seen = np.interp(time_s, TIMES, TEMPERATURES) - 20.0
    assert np.abs(wanted - seen)[inside].max() <= 0.6
    assert wanted[-1] == 0


def test_to_zero_it_goes_window_by_window():
    _, time_s, _, completed = run(Outside.ZERO)
    falls = (time_s >= OUT_S - 0.01) & (time_s <= OUT_S + 0.2)
    assert np.diff(completed[falls]).min() >= -WINDOW
    assert np.count_nonzero(np.diff(completed[falls])) >= 3


def cell(outside, model=TRAINED, to_mm=2.0):
    handshake = replace(StationSettings().handshake, outside=outside)
    found = Cell([StationSettings(handshake=handshake)], [[Move(target_mm=to_mm, speed_mm_s=2.0, rest_s=100.0)]],
        model, heat=COURSE)  # fmt: skip
    found.run(until_ps=7 * S)
    return found.axes[0]


def test_the_cell_falls_back_alike():
    held, kept, zero = (cell(outside) for outside in Outside)
    assert (held.pc_state, held.pc_reason) == (PcState.HOLD, HoldReason.PREDICTOR_OUT_OF_RANGE)
    assert (kept.pc_state, zero.pc_state) == (PcState.ACTIVE, PcState.ACTIVE)
    assert (kept.view.completed, zero.view.completed) == (2, 0)  # 10 um in steps of 4 um, rounded with a margin
    for axis in (kept, zero):
        assert axis.outside_s == pytest.approx(7.0 - OUT_S, abs=0.02)
        assert axis.outside_input == "temperature_nut"


def test_an_axis_beyond_the_positions_of_its_model_is_held_whatever_was_chosen():
    axis = cell(Outside.KEEP, replace(TRAINED, range_mm=(-1.0, 1.0)))
    assert (axis.pc_state, axis.pc_reason) == (PcState.HOLD, HoldReason.PREDICTOR_OUT_OF_RANGE)
    assert axis.outside_input == ""


def test_a_speed_beyond_the_trained_ones_is_outside_too():
    model = StepModel(function=by_degree, inputs=("velocity",), numbers=[0.0], ranges={"velocity": (-1.0, 1.0)})
    axis = cell(Outside.KEEP, model)
    assert axis.pc_state is PcState.ACTIVE
    assert axis.outside_input == "velocity"
    assert 0.5 < axis.outside_s < 1.5  # 2 mm at 2 mm/s
