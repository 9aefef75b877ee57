"""One course of heat: what it does to the axis, to the readings of the laser and to what the PC's model sees."""

import numpy as np
import pytest

from rtec.axis import Dwell, Encoder, Program, plan
from rtec.axis.command import Move
from rtec.errors import ArgumentError
from rtec.heat.course import HeatCourse
from rtec.injector import Design
from rtec.machine import TRACE_COLUMNS, Laser, Machine, measuring_run, run_machine
from rtec.machine.cell import Cell
from rtec.machine.station import StationSettings
from rtec.metrology import MeasuringPlan
from rtec.predictors import StepModel
from tests.machines import LIMITS, box_of

S = 10**12
TIMES = np.array([0.0, 7.3, 11.0, 30.0, 200.0])
COURSE = HeatCourse(
    time_s=TIMES,
    thermometers={"nut": [20.0, 24.0, 24.5, 28.0, 29.0]},
    shift_mm=[0.0, 0.004, -0.003, 0.006, 0.012],
    per_mm=[0.0, 2e-5, 5e-5, 9e-5, 9e-5],
    fixed_mm=50.0,
)
TARGETS = MeasuringPlan(
    start_mm=20.0, end_mm=100.0, increment_mm=40.0, dwell_s=3.0, runs=1, feed_mm_s=20.0, overshoot_mm=2.0
)


def weighted(numbers, inputs, memory, sd):
    total = 0.0
    for k in range(inputs.size):
        total += numbers[k] * inputs[k]
    return total


def linear(**per_input):
    return StepModel(function=weighted, inputs=tuple(per_input), numbers=list(per_input.values()))


def stand(machine, seconds, **options):
    return run_machine(machine, plan(Program(blocks=(Dwell(seconds=seconds),)), LIMITS), **options)


def test_the_laser_reads_an_axis_that_shifts_and_grows():
    task = measuring_run(TARGETS, LIMITS)
    machine = Machine(heat=COURSE, laser=Laser(dwell_s=2.0))
    quick, slow = (run_machine(machine, task, skip_rest=skip).deviation_mm for skip in (True, False))
    assert quick == pytest.approx(slow, abs=2e-8)
    # the mean of the second half of two seconds, which begin as the axis comes within the laser's window
    seen_s = task.begins_ps / S + 1.5
    grown = np.interp(seen_s, TIMES, COURSE.shift_mm) + np.interp(seen_s, TIMES, COURSE.per_mm) * (
        task.target_mm - COURSE.fixed_mm
    )
    assert quick - grown == pytest.approx(np.zeros(task.target_mm.size), abs=0.8e-3)  # the servo's last count
    assert np.ptp(grown) > 0.008


def test_a_machine_without_heat_skips_its_rests_and_one_with_heat_is_read_all_the_same():
    cold = Machine(injector=box_of(Design.B))
    warm = Machine(injector=box_of(Design.B), heat=COURSE, model=linear(temperature_nut=0.001))
    cold_skips, warm_skips = (stand(each, 20.0).ticks_skipped for each in (cold, warm))
    assert cold_skips > 19_000
    assert 10_000 < warm_skips < 19_000
    quick, slow = (stand(warm, 20.0, skip_rest=skip) for skip in (True, False))
    assert quick.exchanges == slow.exchanges
    assert quick.wanted_steps == slow.wanted_steps == round(np.interp(20.0, TIMES, COURSE.thermometers["nut"]))
    assert quick.insertions.completed == slow.insertions.completed == quick.wanted_steps


def test_a_trace_of_a_warm_machine_has_every_row():
    warm = Machine(heat=COURSE)
    rows = stand(warm, 20.0, trace_every=7).trace
    assert rows[:, 0] == pytest.approx(np.arange(rows.shape[0]) * 0.007)
    grown = rows[:, TRACE_COLUMNS.index("true_mm")]
    expected = np.interp(rows[:, 0], TIMES, COURSE.shift_mm) - 50.0 * np.interp(rows[:, 0], TIMES, COURSE.per_mm)
    assert grown == pytest.approx(expected, abs=1e-12)


def test_temperatures_have_no_upper_number_and_the_spindle_is_a_sensor():
    names = [f"t{k}" for k in range(40)]
    course = HeatCourse(
        time_s=[0.0, 1.0, 10.0],
        thermometers={name: [20.0, 20.0 + k, 20.0 + k] for k, name in enumerate(names)},
        spindle_rpm=[0.0, 0.0, 4000.0],
    )
    model = linear(temperature_t39=1e-3, temperature_t7=-1e-3, spindle_speed=1e-6)
    machine = Machine(injector=box_of(Design.B), encoder=Encoder(), model=model, heat=course)
    assert stand(machine, 6.0).wanted_steps == 32  # the speed is held at 0 until 10 s
    assert stand(machine, 12.0).wanted_steps == 36


def test_each_axis_of_a_cell_has_a_course_and_thermometers_of_its_own():
    stations = [StationSettings(axis=1), StationSettings(axis=2)]
    moves = [[Move(target_mm=4.0, speed_mm_s=2.0, rest_s=100.0)]] * 2
    courses = [
        HeatCourse(thermometers={"a": [30.0]}, per_mm=[0.004], fixed_mm=1.0),
        HeatCourse(thermometers={"b": [18.0]}, shift_mm=[-0.008]),
    ]
    models = [linear(temperature_a=0.0004), linear(temperature_b=-0.008 / 18.0)]
    found = Cell(stations, moves, models, heat=courses)
    found.run(until_ps=8 * S)
    found.settle()
    first, second = found.axes
    assert (first.target_steps, second.target_steps) == (3, -2)
    assert first.deviation_mm == pytest.approx(0.0, abs=0.0015)
    assert second.deviation_mm == pytest.approx(0.0, abs=0.0015)
    with pytest.raises(ArgumentError, match="one for all axes, or 2"):
        Cell(stations, moves, models, heat=courses[:1])
    with pytest.raises(ArgumentError, match="temperature_b"):
        Cell(stations, moves, models, heat=courses[0])
