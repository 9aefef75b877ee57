"""How often something happens, and what is known of it from so many tries."""

from __future__ import annotations

import math
from statistics import NormalDist


def wilson(hits: int, tries: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the Wilson score interval of a rate.

    Parameters
    ----------
    hits, tries
        How often it happened, in how many tries.
    confidence
        Of the interval.

    Returns
    -------
    tuple of float
        Lower and upper bound, between 0 and 1; all of it where there are no tries.

    Notes
    -----
    The rates p for which ``|hits/tries - p| <= z sqrt(p (1 - p) / tries)``.

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
    if tries == 0:
        return 0.0, 1.0
    z = NormalDist().inv_cdf(0.5 + confidence / 2.0)
    rate = hits / tries
    middle = rate + z * z / (2.0 * tries)
    half = z * math.sqrt(rate * (1.0 - rate) / tries + z * z / (4.0 * tries * tries))
    scale = 1.0 + z * z / tries
    low, high = (middle - half) / scale, (middle + half) / scale
    return low if hits else 0.0, high if hits < tries else 1.0  # rounded, they miss the ends


def clopper_pearson(hits: int, tries: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the exact interval of a rate, which holds it at least so often: for certificates.

    Parameters
    ----------
    hits, tries, confidence
        As of `wilson`.

    References
    ----------
    C. J. Clopper and E. S. Pearson, The use of confidence or fiducial limits illustrated in the case of the binomial,
    Biometrika 26 (1934) 404.

    Examples
    --------
    >>> low, high = clopper_pearson(0, 100)
    >>> low, round(high, 4)
    (0.0, 0.0362)
    """
    from scipy.special import betaincinv  # noqa: PLC0415 - takes a quarter of a second, and most need no such interval

    tail = (1.0 - confidence) / 2.0
    low = float(betaincinv(hits, tries - hits + 1, tail)) if hits else 0.0
    high = float(betaincinv(hits + 1, tries - hits, 1.0 - tail)) if hits < tries else 1.0
    return low, high


def never_seen(tries: int, confidence: float = 0.95) -> float:
    """Return the upper bound of the rate of something that none of so many tries showed: about 3 over their number.

    Examples
    --------
    >>> round(never_seen(1000) * 1000, 3), never_seen(0)
    (2.991, 1.0)
    """
    return 1.0 - (1.0 - confidence) ** (1.0 / tries) if tries else 1.0
