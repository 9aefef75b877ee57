"""Growth that approaches an end value: a screw or scale that warms up, where no sensor says how warm it is."""

from __future__ import annotations

from collections.abc import Sequence

from rtec.effects.conditions import Conditions, Floats, no_spread
from rtec.effects.protocol import Per, Shape
from rtec.effects.warm_up import WarmUp


class WarmUpGrowth(WarmUp):
    """A first-order approach in time, in proportion to position.

    Notes
    -----
    ``deviation = growth * position * (1 - exp(-t / time_constant))``.

    Examples
    --------
    >>> import numpy as np
    >>> from rtec.effects.warm_up import WarmShape
    >>> t, x = np.array([0.0, 600.0, 6000.0]), np.full(3, 1000.0)
    >>> c = Conditions(position=x, position_unit="mm", run=np.ones(3, dtype=np.int64), time_s=t)
    >>> WarmUpGrowth().contribution(c, WarmShape(600.0), [1e-5]).round(5).tolist()
    [0.0, 0.00632, 0.01]
    """

    name = "warm_up_growth"
    grows_with_position = True
    amplitude = "growth"
    amplitude_per = Per.LENGTH
    contains = frozenset({"scale"})

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why the data cannot show growth in time, or None."""
        return no_spread(conditions) or super().untestable(conditions)

    def scan(self, conditions: Conditions, shapes: Sequence[Shape]) -> Floats:
        """Return the columns of several time constants, shape (shapes, 1, rows)."""
        return super().scan(conditions, shapes) * conditions.position
