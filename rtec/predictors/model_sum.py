"""Models of motion one on top of the other: each predicts what those before it leave."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rtec.predictors._columns import Floats
from rtec.predictors.sequences import DynamicModel, Sequences


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelSum:
    """A sum of models, such as physics and a network for what physics leaves.

    Parameters
    ----------
    parts
        In the order in which they were fitted.

    Examples
    --------
    >>> from rtec.predictors.linear_models import Held
    >>> data = Sequences(inputs=np.zeros((3, 1)), output=[1.0, 2.0, 4.0], names=("command",), period_s=1e-3)
    >>> ModelSum(parts=(Held(constant=0.5), Held())).free_run(data)
    array([1., 1., 1.])
    """

    parts: tuple[DynamicModel, ...]

    @property
    def lags(self) -> int:
        """Samples of a run that have to be measured before it predicts."""
        return max(part.lags for part in self.parts)

    @property
    def parameters(self) -> int:
        """Numbers that were fitted."""
        return sum(part.parameters for part in self.parts)

    def free_run(self, data: Sequences) -> Floats:
        """Return the output predicted from the inputs alone, shape (samples,).

        The first `lags` samples of each run are those that the parts start from.
        """
        found = np.zeros(len(data))
        for part in self.parts:
            found += part.free_run(left_by(found, data))
        return found


def left_by(predicted: Floats, data: Sequences) -> Sequences:
    """Return data whose output is what a prediction leaves of it, 0 where that is not a number."""
    return replace(data, output=np.nan_to_num(data.output - predicted, nan=0.0))
