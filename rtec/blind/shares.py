"""A share and its uncertainty."""

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
