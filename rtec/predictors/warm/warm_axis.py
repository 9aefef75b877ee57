"""The PC's model of a whole axis that warms: what it is cold, and what heat adds along it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors._columns import LARGEST, Floats
from rtec.predictors.binding import CURVE
from rtec.predictors.motion_file import MM_OF
from rtec.predictors.tables import BidirectionalTable
from rtec.predictors.warm import _axis_kernels as kernels
from rtec.predictors.warm.kinds import kept
from rtec.predictors.warm.warm_model import WarmModel

AXIS_KERNELS: Mapping[str, Callable[..., float]] = {
    "linear": kernels.axis_linear,
    "ls-svm": kernels.axis_ls_svm,
    "fuzzy": kernels.axis_fuzzy,
    "bayes": kernels.axis_bayes,
    "bayes-ls-svm": kernels.axis_bayes_ls_svm,
}
"""The compiled model of an axis, by the kind of its regressors."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmAxis:
    """The error of an axis: its cold table, and what models of heat add to it.

    Parameters
    ----------
    cold
        The error where nothing has grown; held beyond its ends.
    heat
        One model: heat displaces the axis alike everywhere. Two: of what it does at two positions; in between and
        beyond it lies on the line through both, as where a screw or a scale grows.
    at_mm
        These two positions; empty for one model.
    reference
        What the inputs said, and had said for long, when the cold table was measured: there the models add nothing.
        None: what they say is taken as it is.

    Raises
    ------
    ArgumentError
        No model or more than two, positions that are missing or equal, models of different inputs or kinds.

    Examples
    --------
    >>> from rtec.predictors.warm.features import Feature
    >>> from rtec.predictors import NoError
    >>> from rtec.predictors.warm.linear import Linear
    >>> grows = [
    ...     WarmModel(features=(Feature(of="temperature_nut"),), observe=name, regressor=Linear(
    ...         centre=[20.0], intercept=0.0, slopes=[slope])) for name, slope in (("start", 0.0), ("end", 2.0))]
    >>> cold = BidirectionalTable.sampled_from(NoError(), [0.0, 500.0])
    >>> WarmAxis(cold=cold, heat=grows, at_mm=(0.0, 500.0)).inputs
    ('position', 'direction', 'time', 'temperature_nut')
    """

    cold: BidirectionalTable
    heat: Sequence[WarmModel]
    at_mm: Sequence[float] = ()
    reference: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        heat, at_mm = tuple(self.heat), tuple(float(one) for one in self.at_mm)
        object.__setattr__(self, "heat", heat)
        object.__setattr__(self, "at_mm", at_mm)
        if not 1 <= len(heat) <= 2:
            raise ArgumentError("heat", f"{len(heat)} models", "one, or two for two positions")
        if len(at_mm) != 2 * (len(heat) - 1) or len(set(at_mm)) != len(at_mm):
            raise ArgumentError("at_mm", str(at_mm)[:60], "two positions for two models, none for one")
        first, last = heat[0], heat[-1]
        if first.inputs != last.inputs or kept(first.regressor).kind != kept(last.regressor).kind:
            raise ArgumentError("heat", "two models of different inputs or kinds", "two that were fitted alike")
        if first.numbers.size != last.numbers.size or first.memory.size != last.memory.size:
            raise ArgumentError("heat", "two models of different sizes", "two that were fitted alike")

    @property
    def function(self) -> Callable[..., float]:
        """The deviation in mm, compiled."""
        return AXIS_KERNELS[kept(self.heat[0].regressor).kind]

    @property
    def inputs(self) -> tuple[str, ...]:
        """Position and direction, then those of the models."""
        return *CURVE, *self.heat[0].inputs

    @property
    def numbers(self) -> Floats:
        """As `rtec.predictors.warm._axis_kernels` takes them."""
        table, models = self.cold.numbers, [one.numbers for one in self.heat]
        places = self.at_mm or (0.0, 0.0)
        cold_mm = [0.0, 0.0]
        if self.reference is not None:
            cold_mm = [one.sign * MM_OF[one.unit] * one.balanced(self.reference) for one in self.heat]
        cold_mm = [cold_mm[0], cold_mm[-1]]
        head = [len(models), *places, *cold_mm, table.size, models[0].size, self.heat[0].memory.size]
        return np.concatenate([np.array(head, dtype=np.float64), table, *models])

    @property
    def memory(self) -> Floats:
        """What each of the models remembers."""
        return np.concatenate([one.memory for one in self.heat])

    @property
    def range_mm(self) -> tuple[float, float]:
        """Every position: the table is held beyond its ends."""
        return -LARGEST, LARGEST

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Of what each input had in training, in both models."""
        found: dict[str, tuple[float, float]] = {}
        for one in self.heat:
            for name, (low, high) in one.ranges.items():
                known = found.get(name, (low, high))
                found[name] = (max(low, known[0]), min(high, known[1]))
        return found
