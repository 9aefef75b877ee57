"""The models of motion that compete: what any has to beat, linear ones, physics, networks, and both together."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from rtec.predictors.drive_model import MOTION, DriveModel
from rtec.predictors.fitting.drive_model import fit_drive, goes_both_ways
from rtec.predictors.fitting.linear_models import choose_arx, fit_arx, fit_servo_lag
from rtec.predictors.fitting.narx import NarxFit, NarxStart, fit_narx
from rtec.predictors.linear_models import Held
from rtec.predictors.model_sum import ModelSum, left_by
from rtec.predictors.narx import Narx, NarxShape
from rtec.predictors.sequences import DynamicModel, Sequences, joined
from rtec.training.dynamic_results import DynamicKind
from rtec.training.free_run import comes_back

NEURONS = (4, 8)
"""Sizes that are tried."""
DELAYS = 4
"""Of inputs and output, as in Erwinski et al. 2016: inputs 0 to 3 samples old, outputs 1 to 4."""
_EPOCHS, _EPOCH_S = 330, 2.5e-6
"""Of a training; a sample of an epoch on a usual machine."""
_WHOLE = 0.05
"""Of a sample: a lag so close to whole samples may be a skew of the log."""
_LEAST_SHARE = 5
"""Percent of the samples that a network sees at least."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DynamicTask:
    """What every method gets.

    Parameters
    ----------
    train
        All that may be used.
    fit, validate
        Its first and its last part: what a model is fitted to where the other one chooses.
    output_per_error
        Output for a following error of 1 mm or 1 degree; None where the output is none.
    starts, seed
        Trainings of each size of a network, and what draws their weights.
    until_s
        Time of `time.perf_counter` at which the training of networks ends.
    tell
        Told what is at work, and the lowest root mean square error of the validation part so far.
    drives
        Keeps the drive that was fitted to ``fit``: two methods need it.
    """

    train: Sequences
    fit: Sequences
    validate: Sequences
    output_per_error: float | None
    starts: int = 10
    seed: int = 0
    until_s: float = np.inf
    tell: Callable[[str], None] = lambda what: None
    drives: list[DriveModel] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DynamicFit:
    """What a method gives.

    Parameters
    ----------
    model
        What goes to work.
    judged
        The same fitted without the validation part, which it then shows how good it is.
    notes
        In sentences.
    holds
        Whether it may be chosen: free runs from moved starts come back (`comes_back`).
    interrupted
        Whether Ctrl-C ended it early.
    """

    model: DynamicModel
    judged: DynamicModel
    notes: tuple[str, ...] = ()
    holds: bool = True
    interrupted: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DynamicMethod:
    """One way to a model of motion."""

    name: str
    kind: DynamicKind
    fit: Callable[[DynamicTask], DynamicFit]
    needs_command: bool = False
    """Whether it predicts only errors of an axis whose commanded motion is known."""

    @property
    def is_network(self) -> bool:
        """Whether it takes its time."""
        return self.kind in (DynamicKind.NETWORK, DynamicKind.HYBRID)

    def why_not(self, task: DynamicTask) -> str | None:
        """Return why it cannot be fitted; None where it can."""
        known = task.output_per_error is not None and set(MOTION) <= set(task.train.names)
        return None if known or not self.needs_command else "the output is no error of an axis whose command is known"


def dynamic_methods() -> tuple[DynamicMethod, ...]:
    """Return every method: what is quick first."""
    return (
        DynamicMethod(name="mean", kind=DynamicKind.NONE, fit=_mean),
        DynamicMethod(name="persistence", kind=DynamicKind.NONE, fit=_persistence),
        DynamicMethod(name="servo lag", kind=DynamicKind.LINEAR, fit=_servo_lag, needs_command=True),
        DynamicMethod(name="ARX", kind=DynamicKind.LINEAR, fit=_arx),
        DynamicMethod(name="physical", kind=DynamicKind.PHYSICAL, fit=_physical, needs_command=True),
        DynamicMethod(name="NARX", kind=DynamicKind.NETWORK, fit=_narx),
        DynamicMethod(name="hybrid", kind=DynamicKind.HYBRID, fit=_hybrid, needs_command=True),
    )


def _mean(task: DynamicTask) -> DynamicFit:
    whole, part = (Held(constant=float(data.output.mean())) for data in (task.train, task.fit))
    return DynamicFit(model=whole, judged=part)


def _persistence(task: DynamicTask) -> DynamicFit:
    return DynamicFit(model=Held(), judged=Held(), notes=("the first sample is held: a free run sees no other",))


def _servo_lag(task: DynamicTask) -> DynamicFit:
    found = fit_servo_lag(task.train)
    lag_s = found.per_velocity / (task.output_per_error or 1.0)
    samples = lag_s / task.train.period_s
    note = f"{1e3 * lag_s:.4g} ms ({samples:.3g} samples) behind the velocity"
    if round(samples) != 0 and abs(samples - round(samples)) < _WHOLE:
        note += ": servo lag, or channels of the log that are shifted against each other"
    return DynamicFit(model=found, judged=fit_servo_lag(task.fit), notes=(note,))


def _arx(task: DynamicTask) -> DynamicFit:
    found = choose_arx(task.fit, task.validate)
    feedback, forward = found.feedback.size, found.forward.shape[1]
    note = f"{feedback} delays of the output, {forward} of each input, the present one among them"
    return DynamicFit(model=fit_arx(task.train, feedback, forward), judged=found, notes=(note,))


def _physical(task: DynamicTask) -> DynamicFit:
    per_error = task.output_per_error or 1.0
    judged = _drive(task)
    found = fit_drive(task.train, output_per_error=per_error, start=judged)
    stiffness, damping = found.stiffness, found.damping
    notes = [
        f"position loop {np.sqrt(stiffness) / (2.0 * np.pi):.3g} Hz, damping ratio "
        f"{damping / (2.0 * np.sqrt(stiffness)):.2g}, friction {found.coulomb:.3g} and offset {found.offset:.3g} "
        "(unit of position/s²: per unit of mass)"
    ]
    if not goes_both_ways(task.train):
        notes.append("the training part goes one way only: friction is taken to be the same the other way")
    return DynamicFit(model=found, judged=judged, notes=tuple(notes))


def _drive(task: DynamicTask) -> DriveModel:
    """Return the drive that fits the first part, fitted once."""
    if not task.drives:
        task.drives.append(fit_drive(task.fit, output_per_error=task.output_per_error or 1.0))
    return task.drives[0]


@dataclass(slots=True)
class _Clock:
    """Ends the training of a network when its time is over, as Ctrl-C would: the best so far is kept."""

    task: DynamicTask
    name: str
    rings: bool = False
    lowest: float = field(default=np.inf)

    def watch(self, start: NarxStart) -> None:
        """Be told of an epoch."""
        self.lowest = min(self.lowest, start.rms_validation)
        self.task.tell(f"{self.name}: {self.lowest:.3g} {self.task.train.unit}")
        if time.perf_counter() >= self.task.until_s:
            self.rings = True
            raise KeyboardInterrupt


def _network(task: DynamicTask, data: Sequences, name: str) -> _Network:
    """Return a network trained on data that are as long as the training part."""
    shapes = [
        NarxShape(
            channels=len(data.names),
            neurons=neurons,
            input_delays=tuple(range(DELAYS)),
            feedback_delays=tuple(range(1, DELAYS + 1)),
        )
        for neurons in NEURONS
    ]
    sizes = [shape.neurons for shape in shapes if shape.weights <= len(task.fit)] or [NEURONS[0]]
    clock = _Clock(task, name)
    used, notes = _affordable(task, data)
    found = fit_narx(
        used,
        neurons=sizes,
        input_delays=range(DELAYS),
        feedback_delays=range(1, DELAYS + 1),
        starts=task.starts,
        seed=task.seed,
        validation=len(task.validate) / len(used),
        progress=clock.watch,
    )
    started = [start for start in found.starts if start.weights is not None]
    started.sort(key=lambda start: start.rms_validation)
    best, narx, holds = _that_holds(found, started, used)
    notes.insert(
        0,
        f"{best.shape.neurons} neurons, the best of {len(started)} trainings; delays 0 to 3 of inputs, 1 to 4 of the "
        "output",
    )
    if not holds:
        notes.append("it does not come back from a moved start, and may leave the motion that it learnt: not chosen")
    if best.history[-1][0] != "parallel":
        notes.append("--budget ended its training before it learnt from its own outputs over the whole log")
    return _Network(narx, tuple(notes), holds, found.interrupted and not clock.rings)


@dataclass(frozen=True, slots=True)
class _Network:
    """A trained network, what is to be said of it, whether it holds, and whether Ctrl-C came."""

    narx: Narx
    notes: tuple[str, ...]
    holds: bool
    interrupted: bool


def _that_holds(found: NarxFit, started: list[NarxStart], data: Sequences) -> tuple[NarxStart, Narx, bool]:
    """Return the best start whose network comes back from moved outputs, else the best of all."""
    for start in started:
        if start.weights is not None and comes_back(
            narx := replace(found.narx, shape=start.shape, weights=start.weights), data
        ):
            return start, narx, True
    return found.start, found.narx, False


def _affordable(task: DynamicTask, data: Sequences) -> tuple[Sequences, list[str]]:
    """Return no more of the first part than a training gets through within its time, and the validation part."""
    most = (task.until_s - time.perf_counter()) / (_EPOCHS * _EPOCH_S)
    whole = len(task.fit)
    if not 0.0 < most < whole:
        return data, []
    some = max(int(most), _LEAST_SHARE * whole // 100)
    note = f"--budget lets a network see the first {some} of {whole} samples; a larger one shows more"
    return joined([data.part(0, some), data.part(whole, len(data))]), [note]


def _narx(task: DynamicTask) -> DynamicFit:
    found = _network(task, task.train, "NARX")
    return _fit_of(found.narx, found)


def _hybrid(task: DynamicTask) -> DynamicFit:
    drive = _drive(task)
    left = left_by(drive.free_run(task.train), task.train)
    found = _network(task, left, "hybrid")
    return _fit_of(ModelSum(parts=(drive, found.narx)), found, "the physical model, and a network for what it leaves")


def _fit_of(model: DynamicModel, network: _Network, *notes: str) -> DynamicFit:
    return DynamicFit(
        model=model,
        judged=model,
        notes=(*notes, *network.notes),
        holds=network.holds,
        interrupted=network.interrupted,
    )
