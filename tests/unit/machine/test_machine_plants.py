"""The plant has one interface: a slide on a spring, in the loop, the cell and live."""

import math

import numpy as np
import pytest
from scipy import linalg

from rtec.axis import Servo
from rtec.axis.command import Move
from rtec.axis.plant import Plant
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.machine import TRACE_COLUMNS, Ending, Machine, run_machine, straight_pass
from rtec.machine.cell import Cell
from rtec.machine.station import Alarm, Station, StationSettings
from rtec.predictors import UnidirectionalTable
from tests.machines import LIMITS, box_of

S = 10**12
THERE = straight_pass([20.0], 50.0, LIMITS, dwell_s=1.0)
TRUE, ENCODER = (TRACE_COLUMNS.index(name) for name in ("true_mm", "encoder_mm"))
LAG_S, OMEGA, DAMPING = 0.01, 2.0 * math.pi * 8.0, 0.05


def elastic(numbers, inputs, state):
    """A slide on a spring behind a motor with a velocity loop: z'' + 2 d w z' + w^2 z = -a."""
    lag_s, omega, damping = numbers
    wanted, velocity, period_s = inputs[0], inputs[1], inputs[3]
    acceleration = (wanted - velocity) * (1.0 - math.exp(-period_s / lag_s)) / period_s
    steps = 50
    for _ in range(steps):
        pull = -2.0 * damping * omega * state[1] - omega**2 * state[0] - acceleration
        state[1] += pull * period_s / steps
        state[0] += state[1] * period_s / steps
    return acceleration


def lost(numbers, inputs, state):
    return math.nan if inputs[4] > numbers[0] else 0.0


def raising(numbers, inputs, state):
    if inputs[4] >= 0.0:
        raise ValueError("no idea")
    return 0.0


ELASTIC = Plant(function=elastic, numbers=[LAG_S, OMEGA, DAMPING], state=[0.0, 0.0])
SPRUNG = Servo(lag_s=LAG_S, standstill_counts_s=0.0, plant=ELASTIC)


def deflection_of(motor_mm, period_s):
    """The slide's by the exact solution for the accelerations of the motor, tick by tick."""
    velocity = np.zeros(motor_mm.size)
    for k in range(motor_mm.size - 1):
        velocity[k + 1] = 2.0 * (motor_mm[k + 1] - motor_mm[k]) / period_s - velocity[k]
    acceleration = np.diff(velocity) / period_s
    system = np.array([[0.0, 1.0, 0.0], [-(OMEGA**2), -2.0 * DAMPING * OMEGA, -1.0], [0.0, 0.0, 0.0]])
    step = linalg.expm(system * period_s)
    found, state = [0.0], np.zeros(2)
    for a in acceleration:
        state = (step @ np.array([*state, a]))[:2]
        found.append(state[0])
    return np.array(found)


def test_a_slide_on_a_spring_swings_as_its_equation_says():
    result = run_machine(Machine(servo=SPRUNG), THERE, trace_every=1)
    seen = result.trace[:, TRUE] - result.trace[:, ENCODER]
    # a row is what stands at the beginning of a tick; the plant has gone on to its end
    expected = np.append(deflection_of(result.trace[:, ENCODER], 1e-3)[1:], np.nan)[: seen.size]
    peak = np.abs(seen).max()
    assert 0.1 < peak * OMEGA**2 / 500.0 < 4.0
    assert np.nanmax(np.abs(seen - expected)) < 0.02 * peak
    assert (result.ending, result.audit, result.ticks_skipped) == (Ending.FINISHED, True, 0)
    rigid = run_machine(Machine(servo=Servo(lag_s=LAG_S)), THERE, trace_every=1, skip_rest=False)
    assert rigid.trace[:, ENCODER] == pytest.approx(result.trace[:, ENCODER], abs=1e-5)
    assert (rigid.trace[:, TRUE] == rigid.trace[:, ENCODER]).all()


@pytest.mark.parametrize("plant", [Plant(function=lost, numbers=[0.5]), Plant(function=raising)])
def test_a_plant_without_an_answer_is_a_fault(plant):
    result = run_machine(Machine(servo=Servo(plant=plant)), THERE)
    assert result.ending is Ending.FAULTED
    station = Station(StationSettings(servo=Servo(plant=plant)), [Move(target_mm=1.0, speed_mm_s=5.0)])
    station.advance(until_ps=S)
    assert station.view.held
    assert station.view.alarm is Alarm.FOLLOWING


def test_the_cell_moves_it_too_each_axis_by_itself():
    table = UnidirectionalTable(positions_mm=[-1.0, 9.0], errors_mm=[0.0, 0.2], backlash_mm=0.0)
    stations = [StationSettings(axis=axis, servo=SPRUNG) for axis in (1, 2)]
    moves = [[Move(target_mm=to, speed_mm_s=20.0, rest_s=100.0)] for to in (2.0, 4.0)]
    cell = Cell(stations, moves, table)
    most = [0.0, 0.0]
    for k in range(200):
        cell.run(until_ps=(k + 1) * S // 50)
        most = [max(was, abs(float(state.servo.beyond_mm))) for was, state in zip(most, cell._stations, strict=True)]
    cell.settle()
    assert [axis.off_counts for axis in cell.axes] == [0, 0]
    assert min(most) > 0.01
    assert most[0] != most[1]
    with pytest.raises(ArgumentError, match="one plant for all axes"):
        Cell([stations[0], StationSettings(axis=2)], moves, table)


def test_a_corrected_axis_on_a_spring_keeps_its_counts():
    box = box_of(Design.C)
    table = UnidirectionalTable(positions_mm=[-1.0, 30.0], errors_mm=[0.0, 0.1], backlash_mm=0.0)
    result = run_machine(Machine(axis_error=table, model=table, injector=box, servo=SPRUNG), THERE)
    assert result.audit
    assert abs(result.pending_steps) <= 1


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"function": 3}, "a function"),
        ({"state": ()}, "1 to 32"),
        ({"state": [0.0] * 33}, "1 to 32"),
        ({"outputs": ("force_n", "speed_mm_s")}, "at most 0"),
        ({"numbers": [math.inf]}, "finite"),
        ({"numbers": "x"}, "a list of numbers"),
    ],
)
def test_plants_that_cannot_be(wrong, says):
    with pytest.raises(ArgumentError, match=says):
        Plant(**({"function": elastic} | wrong))
