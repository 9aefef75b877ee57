"""How often chance alone goes so far: upper tails of the distributions that the tests need.

They are those of ``scipy.stats``, which takes half a second to load and, for a call, longer than the function.
What rounding leaves below zero counts as zero.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy import special

from rtec.effects import Floats


def chi_squared(seen: float | Floats, freedom: int) -> Any:
    """Return the probability of a chi-squared of ``freedom`` above ``seen``, of each where there are many.

    Examples
    --------
    >>> f"{chi_squared(5.991, 2):.4f}"
    '0.0500'
    """
    return special.chdtrc(freedom, np.maximum(seen, 0.0))


def f_ratio(seen: float, above: float, below: float) -> float:
    """Return the probability of a ratio of variances, ``above`` over ``below`` degrees of freedom, beyond ``seen``.

    Examples
    --------
    >>> f"{f_ratio(4.10, 2, 10):.3f}"
    '0.050'
    """
    return float(special.fdtrc(above, below, max(seen, 0.0)))


def gamma(seen: float, mean: float, variance: float) -> float:
    """Return the probability of a gamma distribution of this mean and variance above ``seen``.

    Examples
    --------
    >>> f"{gamma(3.0, mean=1.0, variance=1.0):.4f}"  # then it is the exponential distribution
    '0.0498'
    """
    return float(special.gammaincc(mean**2 / variance, max(seen, 0.0) * mean / variance))


def gumbel(seen: float, location: float, scale: float) -> float:
    """Return the probability of Gumbel's distribution, that of the largest of many, above ``seen``.

    Examples
    --------
    >>> f"{gumbel(2.970, 0.0, 1.0):.4f}"
    '0.0500'
    """
    return -math.expm1(-math.exp(min((location - seen) / scale, 700.0)))
