"""The lathe measured, predictors trained on the readings, and the axis measured again with each of them at work.

Everything goes through the closed loop of ``rtec run``: program, servo, encoder, box, controller and laser. How well
readings repeat is added to what the laser sees, so a run without noise serves every draw.
"""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from rtec.dataset.load import load_dataset
from rtec.injector import Design
from rtec.jobs import cores
from rtec.machine import Machine, MeasuringRun, measuring_run, readings_of, run_machine
from rtec.metrology import MeasuringPlan, PositioningFigures, Readings, joined, positioning_figures
from rtec.predictors import BidirectionalTable, NoError, Predictor, UnidirectionalTable
from rtec.predictors.fitting.training import Effort, Limit
from rtec.study import Study, builtin_study
from rtec.study.learning import calibration_measurement
from rtec.training import all_methods
from rtec.training.methods import Task
from rtec.training.parts import parts_of
from rtec.units import MM_PER_INCH

Floats = npt.NDArray[np.float64]
_In, _Out = TypeVar("_In"), TypeVar("_Out")

RUNS = 4
"""Of the thesis's calibration (5.1); its test "is repeated under the exact same setup conditions" (4.4.3)."""
OTHER_STEP_INCH = 0.0261
"""Of the second round, as the search of ``rtec run`` asks for it: places of the turn beside the first ten."""
MANY_INCH = 0.104
"""Of the program for the stack: five times the thesis's targets, at 125 places of the turn."""
STARTS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeatability:
    """How readings of one place differ: normally distributed, independent of each other or drifting.

    Parameters
    ----------
    white_um
        Standard deviation of a reading, each for itself.
    drift_um
        Standard deviation of what the zero has moved after an hour: a random walk, so it grows with the square root.
    """

    white_um: float
    drift_um: float = 0.0

    def draw(self, task: MeasuringRun, seed: tuple[int, ...]) -> Floats:
        """Return what the readings of a run are off, in mm, in the order in which they are taken."""
        rng = np.random.default_rng(seed)
        hours = np.diff(task.begins_ps / 3.6e15, prepend=task.begins_ps[0] / 3.6e15)
        white = self.white_um * rng.normal(size=hours.size)
        walk = np.cumsum(self.drift_um * np.sqrt(hours) * rng.normal(size=hours.size))
        return 1e-3 * (white + walk)


class Lathe:
    """The built-in study's lathe with the thesis's programs.

    ``test`` is the program of the thesis's tests, ``many`` one run at more targets, ``tasks`` the two rounds of the
    calibration.

    Parameters
    ----------
    runs
        Of calibration and test.
    """

    def __init__(self, runs: int = RUNS) -> None:
        study = builtin_study()
        self.study: Study = study
        self.error: Predictor = study.axis_error
        calibration = replace(study.calibration, runs=runs)
        self.test = self._task(replace(study.plan, runs=runs))
        self.many = self._task(replace(study.plan, increment_mm=MANY_INCH * MM_PER_INCH, runs=1))
        self.tasks = (self._task(calibration), self._task(_second_round(calibration)))
        self._seen: dict[int, Floats] = {}
        self._lock = threading.Lock()

    def _task(self, plan: MeasuringPlan) -> MeasuringRun:
        return measuring_run(plan, self.study.limits, shape=self.study.shape)

    def deviation(
        self, belief: Predictor | None = None, design: Design | None = None, *, task: MeasuringRun | None = None
    ) -> Floats:
        """Return what the laser sees without noise, in mm, shape (readings,).

        Parameters
        ----------
        belief
            What corrects; None: nothing does.
        design
            That inserts; None: the controller itself, in fractions of a count.
        task
            Which program; None: the test.
        """
        s = self.study
        parts = (s.encoder, s.servo, s.receiver, s.handshake, s.laser)
        names = ("encoder", "servo", "receiver", "handshake", "laser")
        machine = Machine(axis_error=self.error, **dict(zip(names, parts, strict=True)))
        if design is not None:
            machine = replace(machine, model=belief or NoError(), injector=s.injector(design))
        elif belief is not None:
            machine = replace(machine, own_table=belief)
        program = self.test if task is None else task
        result = run_machine(machine, program)
        if not result.audit:
            raise RuntimeError(f"{design}: the controller's count is off by {result.audit_counts}")
        return readings_of(program, result.deviation_mm).deviation_mm

    def figures(self, readings: Readings) -> PositioningFigures:
        """Return the figures of ISO 230-2 and of the thesis."""
        return positioning_figures(readings, period=self.study.period_mm)

    def tested(
        self, belief: Predictor | None, design: Design | None, repeats: Repeatability, seed: int
    ) -> PositioningFigures:
        """Return the figures of the thesis's test with one draw of its readings' noise."""
        noise = repeats.draw(self.test, (seed, 0, 2))
        return self.figures(readings_of(self.test, self.deviation(belief, design) + noise))

    def calibration(self, repeats: Repeatability, seed: int, *, rounds: int) -> Readings:
        """Return readings of the uncompensated axis, of the first round or of both."""
        taken = []
        for number, task in enumerate(self.tasks[:rounds]):
            with self._lock:
                if number not in self._seen:
                    self._seen[number] = self.deviation(task=task)
            noise = repeats.draw(task, (seed, number, 1))
            taken.append(readings_of(task, self._seen[number] + noise))
        return joined(taken)

    def exact(self, *, rounds: int) -> Readings:
        """Return the true error at the same places: no noise, and no axis that stops beside its target."""
        tasks = self.tasks[:rounds]
        return joined([readings_of(task, self.error.error_mm(task.target_mm, task.direction)) for task in tasks])


def _second_round(plan: MeasuringPlan) -> MeasuringPlan:
    step_mm = OTHER_STEP_INCH * MM_PER_INCH
    steps = math.floor((plan.end_mm - plan.start_mm) / step_mm)
    return replace(plan, end_mm=plan.start_mm + steps * step_mm, increment_mm=step_mm, runs=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """A way from readings to a predictor.

    Parameters
    ----------
    name
        For the tables.
    rounds
        Of the calibration that it is trained on.
    fit
        From its readings.
    """

    name: str
    rounds: int
    fit: Callable[[Readings], Predictor]


def uni_directional(readings: Readings) -> Predictor:
    """Return the thesis's table of one direction and a backlash, a point at each target (3.1.1)."""
    both = bi_directional(readings)
    lost = both.reverse_errors_mm - both.forward_errors_mm
    return UnidirectionalTable(
        positions_mm=both.forward_positions_mm, errors_mm=both.forward_errors_mm, backlash_mm=float(lost.mean())
    )


def bi_directional(readings: Readings) -> BidirectionalTable:
    """Return the thesis's table of both directions, the mean of the readings at each target (5.2)."""
    sides = {way: _means(readings, readings.direction == way) for way in (1, -1)}
    return BidirectionalTable(
        forward_positions_mm=sides[1][0],
        forward_errors_mm=sides[1][1],
        reverse_positions_mm=sides[-1][0],
        reverse_errors_mm=sides[-1][1],
    )


def every_inch(readings: Readings) -> Predictor:
    """Return a table of both directions with a point every inch, as is usual on large machines (5.2)."""
    inches = readings.target_mm / MM_PER_INCH
    rows = np.abs(inches - np.round(inches)) < 1e-6
    target, deviation, way, run = (
        column[rows] for column in (readings.target_mm, readings.deviation_mm, readings.direction, readings.run)
    )
    return bi_directional(Readings(target_mm=target, deviation_mm=deviation, direction=way, run=run))


def _means(readings: Readings, rows: npt.NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Return the distinct targets of some readings, ascending, and the mean deviation at each."""
    targets, at = np.unique(readings.target_mm[rows].round(6), return_inverse=True)
    return targets, np.bincount(at, readings.deviation_mm[rows]) / np.bincount(at)


def at_the_command(readings: Readings) -> Predictor:
    """Return what a table amounts to that is read at the target, not where the screw then stands.

    The correction goes to the target less the error, and its table says there what it said of the target.
    """
    table = bi_directional(readings)
    ways = (
        (table.forward_positions_mm, table.forward_errors_mm),
        (table.reverse_positions_mm, table.reverse_errors_mm),
    )
    (x, up), (y, down) = ways
    return BidirectionalTable(
        forward_positions_mm=x - up, forward_errors_mm=up, reverse_positions_mm=y - down, reverse_errors_mm=down
    )


def trained(name: str, readings: Readings, *, period_mm: float, starts: int = STARTS) -> Predictor:
    """Return the predictor of a row of ``rtec train``."""
    method = next(method for method in all_methods() if method.name == name)
    dataset = load_dataset(calibration_measurement(readings, period_mm))
    task = Task(
        dataset=dataset,
        parts=parts_of(dataset, dataset),  # no place is kept back to judge: the test does that
        pitch_mm=period_mm,
        effort=Effort(starts=starts),
        limit=Limit(),
        tell=lambda loss_mm: None,
    )
    return method.fit(task).predictor


def by_training(name: str, lathe: Lathe, rounds: int, title: str, starts: int = STARTS) -> Recipe:
    """Return the recipe of a row of ``rtec train``."""
    fit = functools.partial(trained, name, period_mm=lathe.study.period_mm, starts=starts)
    return Recipe(name=title, rounds=rounds, fit=fit)


def side_by_side(do: Callable[[_In], _Out], each: Iterable[_In]) -> list[_Out]:
    """Do something to each on all cores; the compiled loops leave the interpreter free."""
    with ThreadPoolExecutor(cores()) as pool:
        return list(pool.map(do, each))
