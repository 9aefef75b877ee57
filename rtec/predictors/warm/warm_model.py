"""A model of a warm machine: features and a regressor, for logs and as the PC's model of an axis."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import LARGEST, Floats
from rtec.predictors._kernels import NINETY
from rtec.predictors.binding import OF_TEMPERATURE
from rtec.predictors.motion_file import MM_OF
from rtec.predictors.warm import _warm_kernels as kernels
from rtec.predictors.warm.begin import Begin, begun_columns, lagging, seen_at_once
from rtec.predictors.warm.features import HEAT_POWER, SPINDLE_SPEED, Feature, columns_of
from rtec.predictors.warm.kinds import compiled_model
from rtec.predictors.warm.regressor import Regressor

MOST_FEATURES = 1000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmModel:
    """What temperatures and speeds say of one displacement.

    It remembers what lags. At the first reading, and wherever a log begins anew, temperatures tell where that begins;
    without a ``begin`` it is in balance with its sensor, as in a machine that has stood for long.

    Parameters
    ----------
    features
        What the regressor sees, in its order.
    regressor
        Fitted to the columns of these features.
    begin
        What temperatures tell of what lags, at the first reading.
    observe
        The channel that it predicts, as in ``ch3``.
    unit
        Of the channel: ``um`` or ``mm`` for the PC; others predict logs only.
    ranges
        Lowest and highest value of each input in training: outside, the PC holds the machine or falls back.
    interval
        Half width of the interval in which 90 % of readings lie, in ``unit``; None where it is not known.
    sign
        +1 where a positive reading is a positive deviation of the axis, -1 where it is a negative one.
    cautious
        Whether the PC asks for no more than the interval supports.

    Raises
    ------
    ArgumentError
        No features, more or fewer than the regressor takes, a beginning of other features, an input that is no
        temperature or speed, a lag below 0, a range of no input, or caution without an interval.

    Notes
    -----
    Where it is cautious, it tells the PC a standard deviation: that of the regressor, at least that of the interval.
    The PC then asks for the near end of the 90 % interval.

    Examples
    --------
    >>> from rtec.predictors.warm.linear import Linear
    >>> growth = Linear(centre=[20.0], intercept=0.0, slopes=[2.0])
    >>> model = WarmModel(features=(Feature(of="temperature_t1"),), regressor=growth, observe="z", unit="um")
    >>> model.predict(np.array([0.0]), {"temperature_t1": np.array([25.0])})[0].tolist(), model.inputs
    ([10.0], ('time', 'temperature_t1'))
    """

    features: tuple[Feature, ...]
    regressor: Regressor
    observe: str
    unit: str = "um"
    begin: Begin | None = None
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    interval: float | None = None
    sign: int = 1
    cautious: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "features", tuple(self.features))
        _check_features(self.features)
        _check_width(self.regressor, len(self.features))
        if self.begin is not None and self.begin.features != self.features:
            raise ArgumentError("begin", "one of other features", "one of the features of the model")
        if self.sign not in (1, -1):
            raise ArgumentError("sign", repr(self.sign)[:60], "1 or -1")
        if self.interval is not None and not 0.0 <= self.interval < math.inf:
            raise ArgumentError("interval", self.interval, "a finite number from 0")
        if self.cautious and self.interval is None:
            raise ArgumentError("cautious", "a model without an interval", "one with an interval")
        _check_ranges(self.ranges, self.inputs[1:])

    def predict(
        self, time_s: Floats, inputs: Mapping[str, Floats], starts: tuple[int, ...] = (0,)
    ) -> tuple[Floats, Floats]:
        """Return the channel and its standard deviation over a log, shape (rows,) each, in its unit.

        Parameters
        ----------
        time_s, inputs, starts
            As of `columns_of`.

        Raises
        ------
        ArgumentError
            A feature of an input that is not there.
        """
        return self.regressor.predict(begun_columns(self.features, self.begin, time_s, inputs, starts))

    def balanced(self, inputs: Mapping[str, float], since_s: float = math.inf) -> float:
        """Return the channel, in its unit, where all inputs have stood at these values.

        Parameters
        ----------
        inputs
            Value of each.
        since_s
            How long the spindle has run at its speed, from rest; temperatures have stood for ever.
        """
        standing = columns_of(self.features, np.zeros(1), {name: np.full(1, value) for name, value in inputs.items()})
        for k, one in enumerate(self.features):
            if one.of == SPINDLE_SPEED and one.lag_s > 0.0:
                standing[:, k] *= -math.expm1(-since_s / one.lag_s)
        return float(self.regressor.predict(standing)[0][0])

    # what the PC takes

    @property
    def function(self) -> Callable[..., float]:
        """The deviation in mm, compiled."""
        return compiled_model(self.regressor)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The clock, then each input once."""
        return "time", *dict.fromkeys(one.of for one in self.features)

    @property
    def numbers(self) -> Floats:
        """As `rtec.predictors.warm._warm_kernels` takes them; a unit that is no length has none."""
        if self.unit not in MM_OF:
            raise ArgumentError("model", f"of {self.observe} in {self.unit or 'no unit'}", "one in um or mm")
        mm_of_unit = MM_OF[self.unit]
        sure = (mm_of_unit, (self.interval or 0.0) / NINETY) if self.cautious else (0.0, 0.0)
        told = lagging(self.features) if self.begin is not None else []
        seen = seen_at_once(self.features) if told else []
        head = [self.sign * mm_of_unit, *sure, *map(float, (len(self.features), len(told), len(seen)))]
        places = self.inputs
        rows = [
            (places.index(one.of), one.lag_s, HEAT_POWER if one.heat else 0.0, one.of == SPINDLE_SPEED)
            for one in self.features
        ]
        parts = [head, np.ravel(np.array(rows, dtype=np.float64)), np.array([*seen, *told], dtype=np.float64)]
        begin = [] if self.begin is None else [self.begin.numbers.ravel()]
        return np.concatenate([*parts, *begin, self.regressor.numbers])

    @property
    def memory(self) -> Floats:
        """Nothing seen yet, and room for the regressor."""
        return np.zeros(kernels.MEMORY_HEAD + 2 * len(self.features) + self.regressor.room)

    @property
    def range_mm(self) -> tuple[float, float]:
        """Every position: it knows none."""
        return -LARGEST, LARGEST

    @property
    def interval_mm(self) -> float:
        """Half width of the interval in mm, infinite where it is not known."""
        return math.inf if self.interval is None else self.interval * MM_OF.get(self.unit, math.nan)


def _check_features(features: tuple[Feature, ...]) -> None:
    if not 0 < len(features) <= MOST_FEATURES:
        raise ArgumentError("features", f"{len(features)} features", f"1 to {MOST_FEATURES}")
    for one in features:
        if one.of != SPINDLE_SPEED and not one.of.startswith(OF_TEMPERATURE):
            raise ArgumentError("features", repr(one.of)[:60], f"{OF_TEMPERATURE}NAME or {SPINDLE_SPEED}")
        if not 0.0 <= one.lag_s < math.inf:
            raise ArgumentError("features", f"a lag of {one.lag_s:g} s", "a time from 0")


def _check_width(regressor: Regressor, features: int) -> None:
    try:
        regressor.predict(np.zeros((1, features)))
    except (ValueError, IndexError):
        found = f"one that does not take {features} features"
        raise ArgumentError("regressor", found, "one for as many as there are") from None


def _check_ranges(ranges: Mapping[str, tuple[float, float]], inputs: tuple[str, ...]) -> None:
    for name, ends in ranges.items():
        if name not in inputs:
            raise ArgumentError("ranges", str(name)[:60], f"an input: {', '.join(inputs)}")
        if not (len(ends) == 2 and -math.inf < ends[0] <= ends[1] < math.inf):
            raise ArgumentError(f"range of {name}", repr(ends)[:60], "its lower and its upper end")
