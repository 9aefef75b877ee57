"""Shares and their uncertainty: an interval for one, and a test for two judges of the same games."""

from __future__ import annotations

import math


def wilson(right: int, trials: int, *, z: float = 1.959963984540054) -> tuple[float, float]:
    """Return the Wilson score interval of a share.

    Parameters
    ----------
    right, trials
        Counts.
    z
        Quantile of the normal distribution; 95 % by default.

    Returns
    -------
    tuple of float
        Lower and upper bound, between 0 and 1; all of it where there are no trials.

    Notes
    -----
    The shares p for which ``|right/trials - p| <= z sqrt(p (1 - p) / trials)``.

    References
    ----------
    E. B. Wilson, Probable inference, the law of succession, and statistical inference, J. Am. Stat. Assoc. 22
    (1927) 209.

    Examples
    --------
    >>> low, high = wilson(190, 200)
    >>> round(low, 4), round(high, 4)
    (0.9104, 0.9726)
    """
    if trials == 0:
        return 0.0, 1.0
    share = right / trials
    middle = share + z * z / (2.0 * trials)
    half = z * math.sqrt(share * (1.0 - share) / trials + z * z / (4.0 * trials * trials))
    scale = 1.0 + z * z / trials
    return max((middle - half) / scale, 0.0), min((middle + half) / scale, 1.0)


def mcnemar(first_only: int, second_only: int) -> float:
    """Return the probability that two judges alike differ by as much on the same games.

    Parameters
    ----------
    first_only, second_only
        Games that only the first, and only the second, got right.

    Notes
    -----
    McNemar's test in its exact form: each game on which they differ is a fair coin, counted on both sides.

    References
    ----------
    Q. McNemar, Note on the sampling error of the difference between correlated proportions or percentages,
    Psychometrika 12 (1947) 153.

    Examples
    --------
    >>> mcnemar(0, 5), mcnemar(3, 3)
    (0.0625, 1.0)
    """
    games, fewer = first_only + second_only, min(first_only, second_only)
    ways = sum(math.comb(games, k) for k in range(fewer + 1))
    return float(min(2 * ways / 2**games, 1.0))
