"""Training a network: several starts, stopped where readings that it does not see are no longer foretold better."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import Floats
from rtec.predictors._kernels import within_turn
from rtec.predictors.binding import axis_name
from rtec.predictors.fitting.algorithms import Algorithm, Problem
from rtec.predictors.fitting.layers import Layers, Shape
from rtec.predictors.fitting.samples import Samples, means_over_turns
from rtec.predictors.layered import TOUCH_MM, LayeredNetwork, TrainedNetworks

FIRST_SHARE = 0.6
"""Of the time, that the first of two networks gets."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """What ends trainings from outside; the best so far is kept."""

    until_s: float = math.inf
    """Time of `time.perf_counter`."""
    stopped: Callable[[], bool] = lambda: False
    """Asked after every epoch."""

    @property
    def reached(self) -> bool:
        """Whether training should end."""
        return time.perf_counter() >= self.until_s or self.stopped()

    def first(self, share: float) -> Limit:
        """Return the limit of the first share of the time from now on."""
        now = time.perf_counter()
        return Limit(until_s=now + share * (self.until_s - now), stopped=self.stopped)


TURN, WAY = "turn", "direction"
_NO_LIMIT = Limit()


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much work a network is worth.

    Raises
    ------
    ArgumentError
        A number that is not above zero; a seed below zero.
    """

    algorithm: Algorithm = Algorithm.LM
    """That lowers the sum of squares."""
    starts: int = 10
    """Trainings from weights drawn anew; the best is kept."""
    epochs: int = 1000
    """Of a training, at most."""
    patience: int = 200
    """Epochs without a lower error on the readings that it does not see, after which a training ends."""
    seed: int = 0
    """Draws the first weights."""

    def __post_init__(self) -> None:
        for name in ("starts", "epochs", "patience"):
            if getattr(self, name) < 1:
                raise ArgumentError(name, getattr(self, name), "1 or more")
        if self.seed < 0:
            raise ArgumentError("seed", self.seed, "0 or more")


@dataclass(slots=True, kw_only=True)
class Course:
    """How a training went."""

    train_mm: list[float] = field(default_factory=list)
    unseen_mm: list[float] = field(default_factory=list)
    """Root mean square after each epoch, of what was trained on and of what was not."""
    seconds: float = 0.0
    """Of all starts together."""
    epochs: int = 0
    """Of all starts together."""
    squares_mm2: float = math.nan
    """Sum of squares of the weights that were kept, over what was trained on."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trained:
    """A predictor of networks, and how each of them was trained."""

    predictor: TrainedNetworks
    courses: tuple[Course, ...]

    @property
    def weights(self) -> int:
        """Number of all weights and biases."""
        return sum(int(network.weights.size) for network in self.predictor.networks)


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """Which networks describe an axis.

    Parameters
    ----------
    hidden
        Neurons of each hidden layer of the network for position, direction and, if ``within_turn`` is not given,
        the place in the turn.
    within_turn
        Neurons of a second network for what repeats every turn; the first one then sees means over whole turns.
    """

    hidden: tuple[int, ...]
    within_turn: int = 0

    @property
    def name(self) -> str:
        """As in the thesis: 40, 30-10, 30 + 8."""
        first = "-".join(map(str, self.hidden))
        return f"{first} + {self.within_turn}" if self.within_turn else first


def train(
    design: Design,
    seen: Samples,
    unseen: Samples,
    effort: Effort,
    *,
    pitch_mm: float | None = None,
    limit: Limit = _NO_LIMIT,
    tell: Callable[[float], None] = lambda loss_mm: None,
) -> Trained:
    """Train networks on averages of readings.

    Parameters
    ----------
    design
        Which networks.
    seen, unseen
        Readings that train, and readings at other places that say when to stop.
    effort
        How often and how long.
    pitch_mm
        Travel of a turn of the screw; without, no network looks at the place in the turn.
    limit
        What ends it from outside.
    tell
        Told the best root mean square of the unseen readings so far, in mm.

    Raises
    ------
    ArgumentError
        A network for the turn without a pitch, or fewer averages than weights.

    References
    ----------
    Thesis 5.4.
    """
    averages, others = seen.averaged(), unseen.averaged()
    elsewhere = tuple(axis_name(axis) for axis in seen.others_mm)
    span = seen.span_mm
    pitch = 1.0 if pitch_mm is None else pitch_mm
    fitted = partial(_trained, effort=effort, span_mm=span, pitch_mm=pitch, tell=tell)
    inputs = ("position", WAY, *elsewhere)
    if not design.within_turn:
        inputs += () if pitch_mm is None else (TURN,)
        network, course = fitted(inputs, design.hidden, averages, others, limit)
        alone = TrainedNetworks(networks=(network,), range_mm=span, pitch_mm=pitch)
        return Trained(predictor=alone, courses=(course,))
    if pitch_mm is None:
        raise ArgumentError("screw_pitch", "nothing", "the travel of a turn", "--screw-pitch states it")
    means = means_over_turns(averages, pitch)
    fifth = np.arange(means.rows) % 5 == 2
    early = limit.first(FIRST_SHARE)
    wide, first = fitted(inputs, design.hidden, means.take(~fifth), means.take(fifth), early)
    alone = TrainedNetworks(networks=(wide,), range_mm=span, pitch_mm=pitch)
    left, left_over = (part.with_error(part.left_by(alone)) for part in (averages, others))
    fine, second = fitted((TURN, WAY), (design.within_turn,), left, left_over, limit)
    both = TrainedNetworks(networks=(wide, fine), range_mm=span, pitch_mm=pitch)
    return Trained(predictor=both, courses=(first, second))


def _trained(
    inputs: tuple[str, ...],
    hidden: tuple[int, ...],
    seen: Samples,
    unseen: Samples,
    limit: Limit,
    *,
    effort: Effort,
    span_mm: tuple[float, float],
    pitch_mm: float,
    tell: Callable[[float], None],
) -> tuple[LayeredNetwork, Course]:
    ends = {"position": span_mm, WAY: (0.0, 1.0), TURN: (0.0, pitch_mm)}
    ends |= {axis_name(axis): (float(x.min()), float(x.max())) for axis, x in seen.others_mm.items()}
    middle, half = (np.array([0.5 * (ends[n][1] + sign * ends[n][0]) for n in inputs]) for sign in (1.0, -1.0))
    shape = Shape(inputs=len(inputs), hidden=hidden)
    if seen.rows < shape.weights:
        raise ArgumentError("readings", f"{seen.rows} averages", f"{shape.weights} or more, one for each weight")
    bias, factor = float(seen.error_mm.mean()), float(seen.error_mm.std()) or 1.0

    def scaled(samples: Samples) -> tuple[Floats, Floats]:
        given = np.stack([seen_by(name, samples, pitch_mm) for name in inputs], axis=1)
        return (given - middle) / half, (samples.error_mm - bias) / factor

    # reverse after forward: a direction in two blocks of rows is what `Layers.normal` makes use of
    given, wanted = scaled(seen.take(np.argsort(-seen.direction, kind="stable")))
    problem = Problem(Layers(shape, given), wanted)
    asked, answer = scaled(unseen)
    best = _Best(Layers(shape, asked), answer, effort, factor, seen.rows, limit, tell)
    rng = np.random.default_rng(effort.seed)
    begun = time.perf_counter()
    for _ in range(effort.starts):
        best.begin()
        with np.errstate(over="ignore", invalid="ignore"):  # a training that diverges is left, not reported
            effort.algorithm.train(problem, shape.first_weights(rng), best.watch)
        if limit.reached:
            break
    course = best.course
    course.seconds = time.perf_counter() - begun
    if best.weights is None:
        raise ArgumentError("training", "diverged", "a sum of squares that falls", "another --seed, or more --starts")
    network = LayeredNetwork(
        inputs=inputs,
        middle=middle,
        half=half,
        hidden=hidden,
        weights=best.weights,
        bias_mm=bias,
        factor_mm=factor,
    )
    return network, course


def seen_by(name: str, samples: Samples, pitch_mm: float) -> Floats:
    """Return what an input of a network is at each reading, shape (n,): as the compiled predictor will have it."""
    if name == WAY:
        return np.where(samples.direction < 0.0, 1.0, 0.0)
    if name == TURN:
        return np.array([within_turn(x, pitch_mm, TOUCH_MM) for x in samples.position_mm])
    return samples.seen_by([name])[name]


@dataclass(slots=True)
class _Best:
    """The best weights of all starts by what they say of unseen readings, and the course of the start they are of."""

    net: Layers
    wanted: Floats
    effort: Effort
    factor_mm: float
    rows: int
    limit: Limit
    tell: Callable[[float], None]
    weights: Floats | None = None
    course: Course = field(default_factory=Course)
    _lowest: float = math.inf
    _epochs: int = 0
    _course: Course = field(default_factory=Course)
    _here: float = math.inf
    _since: int = 0

    def begin(self) -> None:
        """Begin another start."""
        self._course, self._here, self._since = Course(), math.inf, 0

    def watch(self, weights: Floats, squares: float) -> bool:
        """Take note of an epoch; False where it was the last one of this start."""
        off = self.net.output(weights) - self.wanted
        unseen = math.sqrt(float(off @ off) / off.size) * self.factor_mm
        course, effort = self._course, self.effort
        if not math.isfinite(squares) or not math.isfinite(unseen):
            return False
        course.train_mm.append(math.sqrt(squares / self.rows) * self.factor_mm)
        course.unseen_mm.append(unseen)
        self._since = 0 if unseen < self._here else self._since + 1
        self._here = min(self._here, unseen)
        if unseen < self._lowest:
            self._lowest, self.weights = unseen, weights.copy()
            course.squares_mm2 = squares * self.factor_mm**2
            course.epochs = self.course.epochs
            self.course = course
            self.tell(unseen)
        self._epochs += 1
        self.course.epochs = self._epochs
        return len(course.train_mm) <= effort.epochs and self._since < effort.patience and not self.limit.reached
