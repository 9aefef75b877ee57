"""The logistic function such that the compiler computes it for several neurons at once.

The exponential function of the mathematical library takes one number at a time. Here ``exp(v) = 2^k exp(r)``, ``k``
whole and ``|r| <= ln(2) / 2`` (Cody and Waite 1980); ``exp(r)`` is a Taylor polynomial, ``2^k`` made from its bits.
"""

from __future__ import annotations

import math
from typing import Any

from numba import types
from numba.extending import intrinsic

from rtec._jit import config, fused_step

_PER_LN2 = 1.0 / math.log(2.0)
_LN2_HIGH, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
"""ln(2) in two parts; the first has zeros behind, so that ``k`` times it is exact (Sun's fdlibm, e_exp.c)."""
_WHOLE = 1.5 * 2.0**52
"""Added to a number below 2^51, it leaves its nearest whole number in the lowest bits."""
_FARTHEST = 700.0
"""Beyond it the function is 0 or 1 to 304 digits."""
_C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9, _C10, _C11, _C12 = (1.0 / math.factorial(n) for n in range(2, 13))


def _power_of_two(shifted: float) -> float:
    """Return 2^k of ``k + _WHOLE``, k from -1022 to 1023: the exponent of a float64 is k + 1023, from bit 52 on."""
    return math.ldexp(1.0, int(shifted - _WHOLE)) if math.isfinite(shifted) else math.nan


if not config.DISABLE_JIT:

    @intrinsic
    def _power_of_two(_context: Any, shifted: Any) -> Any:
        def build(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            whole, real = (context.get_value_type(kind) for kind in (types.int64, types.float64))
            exponent = builder.add(builder.bitcast(arguments[0], whole), whole(1023))
            return builder.bitcast(builder.shl(exponent, whole(52)), real)

        return types.float64(types.float64), build


@fused_step
def logistic(x: float) -> float:
    """Return 1 / (1 + exp(-x)) to 4 units in the last place; what is no number stays none."""
    held = _FARTHEST if x > _FARTHEST else x
    v = _FARTHEST if held < -_FARTHEST else -held
    shifted = v * _PER_LN2 + _WHOLE
    k = shifted - _WHOLE
    r = (v - k * _LN2_HIGH) - k * _LN2_LOW
    high = _C7 + r * (_C8 + r * (_C9 + r * (_C10 + r * (_C11 + r * _C12))))
    rising = 1.0 + r * (1.0 + r * (_C2 + r * (_C3 + r * (_C4 + r * (_C5 + r * (_C6 + r * high))))))
    return 1.0 / (1.0 + rising * _power_of_two(shifted))
