"""Visual Basic's ``Format`` for the number patterns that the measuring macro uses."""

from __future__ import annotations

import math
import re
from decimal import ROUND_HALF_UP, Decimal

from rtec.errors import ArgumentError

_PATTERN = re.compile(r"(?P<left>#*0*)(?P<point>\.(?P<right>0*#*))?")


def vb_format(value: float, pattern: str) -> str:
    """Format a number as Visual Basic 6 does.

    Parameters
    ----------
    value
        Finite, below 1e15.
    pattern
        ``#`` for a digit that appears where it is needed, ``0`` for one that always appears, and one point, which
        appears even where no digit follows it: ``##.#`` turns 50 into ``50.``.

    Returns
    -------
    str
        Rounded half away from zero on the 15 digits that Visual Basic keeps of a double. What rounds to zero loses
        its sign.

    Raises
    ------
    ArgumentError
        A pattern of other signs, or a number that is not finite or too large.

    Examples
    --------
    >>> [vb_format(x, "##0.0###") for x in (1, 0.9, 1.025, 40.1, 0.00004)]
    ['1.0', '0.9', '1.025', '40.1', '0.0']
    >>> [vb_format(x, "##.#") for x in (50, 0.5, 2.25)], vb_format(2.5, "##")
    (['50.', '.5', '2.3'], '3')
    """
    match = _PATTERN.fullmatch(pattern)
    if match is None:
        raise ArgumentError("pattern", repr(pattern), "a pattern of #, 0 and one point, such as ##0.0###")
    if not (math.isfinite(value) and abs(value) < 1e15):
        raise ArgumentError("value", value, "a finite number below 1e15")
    right = match["right"] or ""
    rounded = Decimal(f"{value:.14e}").quantize(Decimal(1).scaleb(-len(right)), rounding=ROUND_HALF_UP)
    whole, _, decimals = f"{abs(rounded):f}".partition(".")
    whole = whole.lstrip("0").rjust(match["left"].count("0"), "0")
    kept = right.count("0")
    decimals = decimals[:kept] + decimals[kept:].rstrip("0")
    sign = "-" if rounded < 0 else ""
    return f"{sign}{whole}{'.' if match['point'] else ''}{decimals}"
