"""The PC's model has one interface: a temperature, a memory, another axis, in the loop, the cell and live."""

import math
import pickle

import numpy as np
import pytest

from rtec.axis import Dwell, Encoder, Program, plan
from rtec.axis.command import Move
from rtec.errors import ArgumentError
from rtec.heat.approach import approach
from rtec.heat.course import HeatCourse
from rtec.injector import Design
from rtec.machine import TRACE_COLUMNS, Ending, Machine, run_machine
from rtec.machine.cell import Cell
from rtec.machine.station import StationSettings
from rtec.predictors import StepModel
from rtec.requester.settings import PcState
from rtec.requester.supervision import HoldReason
from tests.machines import LIMITS, box_of

S = 10**12
COMMAND, TRUE = (TRACE_COLUMNS.index(name) for name in ("command_mm", "true_mm"))
COLD = HeatCourse()
WARM = approach(rise_k={"screw": 8.0}, time_constant_s=1.0)


def grown(numbers, inputs, memory, sd):
    return numbers[0] * (inputs[0] - 20.0)


def turns(numbers, inputs, memory, sd):
    """A tenth of a step more with every turn of the PC, ten steps at most."""
    memory[0] = min(memory[0] + 0.1, 10.0)
    return numbers[0] * memory[0]


def sag(numbers, inputs, memory, sd):
    """An axis that gives way under another: by as much as that stands out."""
    return numbers[0] * inputs[1]


TEMPERATURE = StepModel(function=grown, inputs=("temperature_screw",), numbers=[0.00125])
MEMORY = StepModel(function=turns, inputs=("position",), numbers=[0.004], memory=[0.0])
OTHER = StepModel(function=sag, inputs=("position", "position_2"), numbers=[0.012])


def machine(model, heat=WARM, **parts):
    design = Design.B
    box = box_of(design)
    return Machine(injector=box, encoder=Encoder(), model=model, heat=heat, **parts)


def stay(parts, seconds, trace_every=1, **options):
    motion = plan(Program(blocks=(Dwell(seconds=seconds),)), LIMITS)
    return run_machine(parts, motion, trace_every=trace_every, **options)


def cell(model, heat=COLD, axes=1, to_mm=2.0):
    stations = [StationSettings(axis=axis) for axis in range(1, axes + 1)]
    moves = [[Move(target_mm=to_mm * axis, speed_mm_s=2.0, rest_s=100.0)] for axis in range(1, axes + 1)]
    found = Cell(stations, moves, model, heat=heat)
    found.run(until_ps=8 * S)
    return found


def test_an_axis_that_grows_is_held_by_what_the_thermometer_says():
    growing = approach(shift_mm=0.010, rise_k={"screw": 8.0}, time_constant_s=1.0)
    result = stay(machine(TEMPERATURE, growing), 12.0)
    assert np.abs((result.trace[:, TRUE] - result.trace[:, COMMAND])[-1000:]).max() <= 0.002
    assert result.insertions.completed == 10
    # the plant's own growth is nothing that the PC could know of
    unseen = approach(shift_mm=0.010, rise_k={"screw": 0.0}, time_constant_s=1.0)
    blind = stay(machine(TEMPERATURE, unseen), 12.0)
    assert blind.insertions.completed == 0
    assert (blind.trace[:, TRUE] - blind.trace[:, COMMAND])[-1] == pytest.approx(0.010, abs=1e-6)


def test_what_a_model_believes_may_change_while_the_axis_stands():
    quick, slow = (stay(machine(MEMORY), 3.0, trace_every=0, skip_rest=skip) for skip in (True, False))
    assert quick.insertions.completed == slow.insertions.completed == 40  # ten steps of 4 counts, in single ones
    assert quick.exchanges == slow.exchanges
    assert 0 < quick.ticks_skipped < 0.9 * quick.ticks  # each turn of the PC is taken


def test_the_cell_reads_thermometers_too():
    axis = cell(TEMPERATURE, WARM).axes[0]
    assert (axis.target_steps, axis.view.completed, axis.off_counts) == (2, 2, 0)  # 10 um in steps of 4 um


def test_each_axis_has_a_memory_of_its_own():
    found = cell(StepModel(function=turns, inputs=("position",), numbers=[0.0004], memory=[0.0]), axes=2)
    # some 800 turns each: a memory that both wrote would be full, and so is each alone
    assert [axis.target_steps for axis in found.axes] == [1, 1]
    early = Cell(found.settings, [[Move(target_mm=1.0, speed_mm_s=1.0, rest_s=9.0)]] * 2, MEMORY)
    early.run(until_ps=S)
    took = early.exchanges / 2  # turns of each PC, those before home among them
    assert all(0.08 * took < axis.target_steps <= 0.1 * took + 1 for axis in early.axes)


def test_an_axis_may_depend_on_another():
    first, second = cell(OTHER, axes=2).axes
    assert first.view.position == pytest.approx(2000, abs=60)
    assert first.target_steps == second.target_steps == round(0.012 * 4.0 / 0.004)


def test_outside_what_it_was_made_for_the_machine_is_held():
    model = StepModel(
        function=grown, inputs=("temperature_screw",), numbers=[0.00125], ranges={"temperature_screw": (15.0, 25.0)}
    )  # fmt: skip
    result = stay(machine(model), 12.0)
    assert result.ending is Ending.HELD
    assert result.simulated_s == pytest.approx(math.log(8.0 / 3.0), abs=0.02)  # 25 degrees, 8 K above 20 in the end
    axis = cell(model, WARM).axes[0]
    assert (axis.pc_state, axis.pc_reason) == (PcState.HOLD, HoldReason.PREDICTOR_OUT_OF_RANGE)


def far_off(numbers, inputs, memory, sd):
    return numbers[0]


def raising(numbers, inputs, memory, sd):
    if inputs[0] > 0.5:
        raise ValueError("beyond me")
    return 0.0


def beside(numbers, inputs, memory, sd):
    return memory[3]


@pytest.mark.parametrize(
    "model",
    [
        StepModel(function=far_off, inputs=("time",), numbers=[1e200]),
        StepModel(function=far_off, inputs=("position",), numbers=[-2e3]),
        StepModel(function=raising, inputs=("time",)),
        StepModel(function=beside, inputs=("time",)),
        StepModel(function=turns, inputs=("position",), numbers=[0.0], memory=[0.0], range_mm=(5.0, 9.0)),
    ],
    ids=["too far", "too far below", "raises", "reads beside its memory", "out of range"],
)
def test_a_model_without_an_answer_holds_the_machine(model):
    result = stay(machine(model), 2.0)
    assert result.ending is Ending.HELD
    assert result.insertions.inserted == 0
    axis = cell(model).axes[0]
    assert axis.pc_state is PcState.HOLD
    assert axis.pc_reason in (HoldReason.PREDICTOR_OUT_OF_RANGE, HoldReason.DEVIATION_LIMIT)
    assert axis.view.completed == 0


@pytest.mark.parametrize("part", ["axis_error", "own_table"])
def test_what_is_a_curve_takes_no_other_model(part):
    with pytest.raises(ArgumentError, match=part):
        stay(Machine(**{part: MEMORY}), 1.0)


def test_an_input_that_nobody_senses_is_refused():
    with pytest.raises(ArgumentError, match="what is sensed"):
        stay(machine(OTHER), 1.0)
    with pytest.raises(ArgumentError, match=r"'temperature_scrw'.*temperature_screw"):
        stay(machine(StepModel(function=grown, inputs=("temperature_scrw",), numbers=[1.0])), 1.0)
    with pytest.raises(ArgumentError, match="small letters"):
        machine(TEMPERATURE, HeatCourse(thermometers={"Screw": [20.0]}))


def test_models_travel_to_other_processes():
    again = pickle.loads(pickle.dumps(TEMPERATURE))  # noqa: S301 - made one line above
    assert stay(machine(again), 6.0).insertions.completed == stay(machine(TEMPERATURE), 6.0).insertions.completed
