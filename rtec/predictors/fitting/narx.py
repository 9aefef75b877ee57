"""NARX networks trained to predict for long: first from measured outputs, then from their own.

Series-parallel training gives the network the measured outputs of the past; it is quick, and nothing says that the
network holds when it sees its own outputs instead. Parallel training does that, with the exact gradient through the
recurrence: the slopes of each output over the weights are its own, and those of the outputs that it was made from.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors.fitting.bayesian import Evidence, bayesian_regularisation
from rtec.predictors.fitting.free_run import FreeRunSquares, cut, first_weights
from rtec.predictors.narx import Narx, NarxShape, stretches_of
from rtec.predictors.sequences import Sequences


class Stages(Enum):
    """Which training is done."""

    OPEN = "series-parallel"
    CLOSED = "parallel"
    BOTH = "series-parallel, then parallel"


@dataclass(frozen=True, slots=True, kw_only=True)
class NarxEffort:
    """How long a start is trained.

    Parameters
    ----------
    open_epochs, closed_epochs
        Most epochs of series-parallel and of parallel training.
    horizons
        Parallel training begins with stretches of so many samples, each of which starts from measured outputs; the
        whole runs come last.
    horizon_epochs
        Most epochs of each of these.
    patience
        Epochs without a fall by `enough` after which a stage ends.
    enough
        Share by which the error has to fall for that.
    """

    open_epochs: int = 100
    closed_epochs: int = 200
    horizons: tuple[int, ...] = (20, 200)
    horizon_epochs: int = 15
    patience: int = 20
    enough: float = 0.002


@dataclass(slots=True, kw_only=True, eq=False)
class NarxStart:
    """One training from weights that were drawn.

    Parameters
    ----------
    shape
        Of the network.
    number
        Of the start, from 0.
    history
        Of each epoch: what was trained, and the root mean square error over what it predicted, in the unit of the
        output.
    weights
        The best by free run over the validation part.
    rms_validation
        Of these, in the unit of the output; infinite where each free run diverges.
    gamma
        Effective number of parameters at the end.
    reason
        Why it was given up; None where it was not.
    """

    shape: NarxShape
    number: int
    history: list[tuple[str, float]] = field(default_factory=list)
    weights: Floats | None = None
    rms_validation: float = np.inf
    gamma: float = np.nan
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NarxFit:
    """A trained network, and how it came about."""

    narx: Narx
    start: NarxStart
    """The one that was chosen by its free run over the validation part."""
    starts: tuple[NarxStart, ...]
    interrupted: bool
    """Whether Ctrl-C ended the training early."""


Progress = Callable[[NarxStart], None]
"""Shown a start after each of its epochs."""


def fit_narx(
    data: Sequences,
    *,
    neurons: int | Sequence[int] = 8,
    input_delays: Iterable[int] = range(4),
    feedback_delays: Iterable[int] = range(1, 5),
    orders: Sequence[int] = (),
    linear: bool = True,
    starts: int = 5,
    seed: int = 0,
    validation: float = 0.25,
    stages: Stages = Stages.BOTH,
    effort: NarxEffort | None = None,
    progress: Progress | None = None,
) -> NarxFit:
    """Train NARX networks from several starts, and choose one by its free run over the last part of the data.

    Parameters
    ----------
    data
        What it is trained on; of these, the last share `validation` only chooses.
    neurons
        Size of the hidden layer, or several sizes to choose from.
    input_delays, feedback_delays
        Samples by which inputs and outputs that the network sees are old.
    orders
        Several lengths of memory to choose from instead: of order n are the last n inputs and the n outputs before.
    linear
        Whether each of them adds to the output directly, beside the neurons.
    starts
        Trainings of each size.
    seed
        Draws the first weights.
    validation
        Share of the data.
    stages
        Series-parallel, parallel, or both.
    effort
        How long each start is trained.
    progress
        Called after each epoch.

    Returns
    -------
    NarxFit
        Of the start that is best over the validation part; after Ctrl-C, of the best so far. A start that diverges
        says so and is not chosen unless all do.

    Raises
    ------
    ArgumentError
        Fewer samples than weights, or an input or an output that never moves.
    KeyboardInterrupt
        Ctrl-C before the first epoch.

    References
    ----------
    Erwinski et al. 2016 and 2019, section 4: series-parallel training first, then parallel.

    Examples
    --------
    >>> u = np.random.default_rng(0).uniform(-1.0, 1.0, 600)
    >>> y = np.zeros(600)
    >>> for t in range(1, 600):
    ...     y[t] = 0.8 * y[t - 1] + 0.3 * np.tanh(2.0 * u[t - 1])
    >>> data = Sequences(inputs=u[:, None], output=y, names=("command",), period_s=1e-3)
    >>> found = fit_narx(data, neurons=3, input_delays=(1,), feedback_delays=(1,), starts=1)
    >>> bool(found.start.rms_validation < 1e-3 * y.std())
    True
    """
    sizes = (neurons,) if isinstance(neurons, int) else tuple(neurons)
    memories: list[tuple[Sequence[int], Sequence[int]]] = [(range(n), range(1, n + 1)) for n in orders]
    shapes = [
        NarxShape(channels=len(data.names), neurons=size, input_delays=inputs, feedback_delays=outputs, linear=linear)
        for inputs, outputs in memories or [(tuple(input_delays), tuple(feedback_delays))]
        for size in sizes
    ]
    if not shapes or starts < 1:
        raise ArgumentError("starts", starts, "1 or more of 1 size or more")
    if not 0.0 < validation <= 0.9:
        raise ArgumentError("validation", f"{validation:g}", "a share above 0, up to 0.9")
    split = round((1.0 - validation) * len(data))
    training = _Training(data, split, shapes, stages, effort or NarxEffort(), progress)
    return training.run(starts, seed)


class _Training:
    """All starts over the same data."""

    def __init__(
        self,
        data: Sequences,
        split: int,
        shapes: list[NarxShape],
        stages: Stages,
        effort: NarxEffort,
        progress: Progress | None,
    ) -> None:
        self.data, self.shapes, self.stages, self.effort, self.progress = data, shapes, stages, effort, progress
        self.train, self.held = data.part(0, split), data.part(split, len(data))
        low, high = (np.append(of(self.train.inputs, 0), of(self.train.output)) for of in (np.min, np.max))
        self.middle, self.half = 0.5 * (low + high), 0.5 * (high - low)
        self._check()
        self.starts: list[NarxStart] = []

    def _check(self) -> None:
        for name, half in zip((*self.data.names, "output"), self.half, strict=True):
            if not half > 0.0:
                raise ArgumentError(name, "", "data in which it moves", problem="never changes in the training part")
        largest = max(self.shapes, key=lambda shape: shape.weights)
        for part, data in (("training", self.train), ("validation", self.held)):
            spans = stretches_of(data, largest.lags)
            samples = int((spans[:, 1] - spans[:, 0]).sum())
            least = largest.weights if part == "training" else 1
            if samples < least:
                hint = f"{largest.neurons} neurons have {largest.weights} weights"
                raise ArgumentError(f"{part} part", f"{samples} samples", f"{least} or more", hint)

    def narx(self, shape: NarxShape, weights: Floats) -> Narx:
        return Narx(
            shape=shape,
            names=self.data.names,
            period_s=self.data.period_s,
            middle=self.middle,
            half=self.half,
            weights=weights,
            unit=self.data.unit,
        )

    def run(self, starts: int, seed: int) -> NarxFit:
        interrupted = False
        try:
            for number in range(starts):
                for shape in self.shapes:
                    rng = np.random.default_rng((seed, number, shape.neurons, shape.lags))
                    start = NarxStart(shape=shape, number=number)
                    self.starts.append(start)
                    _Start(self, start).train(first_weights(shape, rng))
        except KeyboardInterrupt:
            interrupted = True
            if all(start.weights is None for start in self.starts):
                raise
        usable = [(start, start.weights) for start in self.starts if start.weights is not None]
        best, weights = min(usable, key=lambda one: one[0].rms_validation)
        narx = self.narx(best.shape, weights)
        return NarxFit(narx=narx, start=best, starts=tuple(self.starts), interrupted=interrupted)


class _Start:
    """One start: its stages, and what it watches."""

    def __init__(self, training: _Training, start: NarxStart) -> None:
        self.effort, self.stages, self.progress = training.effort, training.stages, training.progress
        self.start, self.unit = start, float(training.half[-1])
        self.shape = shape = start.shape
        scaled = [
            (
                (part.inputs - training.middle[:-1]) / training.half[:-1],
                (part.output - training.middle[-1]) / self.unit,
            )
            for part in (training.train, training.held)
        ]
        self.spans = stretches_of(training.train, shape.lags)
        self.data = scaled[0]
        self.latest: Floats | None = None
        self.held = FreeRunSquares(shape, *scaled[1], stretches_of(training.held, shape.lags), closed=True)

    def train(self, weights: Floats) -> None:
        """Train from these weights on; Ctrl-C leaves the best so far."""
        try:
            self._train(weights)
        except KeyboardInterrupt:
            if self.latest is not None:
                self._judge(self.latest)
            raise

    def _train(self, weights: Floats) -> None:
        effort = self.effort
        if self.stages is not Stages.CLOSED:
            weights = self._stage("series-parallel", weights, self.spans, effort.open_epochs, closed=False)
            self._judge(weights)
        if self.stages is not Stages.OPEN:
            for horizon in effort.horizons:
                if horizon < int((self.spans[:, 1] - self.spans[:, 0]).max()):
                    spans = cut(self.spans, horizon)
                    weights = self._stage(
                        f"parallel over {horizon}", weights, spans, effort.horizon_epochs, closed=True
                    )
            self._stage("parallel", weights, self.spans, effort.closed_epochs, closed=True)
            if not self.start.history or self.start.history[-1][0] != "parallel":
                self.start.reason = "parallel training did not get on from where it began"
        if self.start.rms_validation == np.inf:
            self.start.reason = "the free run over the validation part diverges"

    def _judge(self, weights: Floats) -> float:
        """Keep weights that are better over the validation part; return their root mean square error there."""
        rms = self.unit * float(np.sqrt(self.held.squares(weights) / self.held.samples))
        if self.start.weights is None or rms < self.start.rms_validation:
            self.start.weights, self.start.rms_validation = weights, rms
        return rms

    def _stage(
        self, name: str, weights: Floats, spans: npt.NDArray[np.int64], epochs: int, *, closed: bool
    ) -> Floats:
        problem = FreeRunSquares(self.shape, *self.data, spans, closed=closed)
        history: list[float] = []

        def watch(found: Floats, evidence: Evidence) -> bool:
            self.latest = found
            rms = self.unit * float(np.sqrt(evidence.squares / problem.samples))
            self.start.history.append((name, rms))
            self.start.gamma = evidence.gamma
            judged = self._judge(found) if name == "parallel" else rms
            history.append(judged)
            if self.progress is not None:
                self.progress(self.start)
            before = history[: -self.effort.patience]
            return len(history) < epochs and (not before or min(history) < (1.0 - self.effort.enough) * min(before))

        return bayesian_regularisation(problem, weights, watch)[0]
