"""What a curve is like: functions that stay within its band, which are descriptions and no names."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rtec.effects import Floats
from rtec.readable import quantity_text
from rtec.units import symbol

BAND = 2.0
"""Standard errors to either side."""
WITHIN = 0.95
"""Share of the places at which a description has to stay within the band."""
_MOST_DESCRIPTIONS = 3
_CLOSE = 1e-5
"""Share by which a fit may still change: two digits are said."""


@dataclass(frozen=True, slots=True)
class _Form:
    """A family of functions by which curves are described."""

    function: Callable[..., Floats]
    starts: Callable[[Floats, Floats], Iterator[list[float]]]
    words: Callable[[Sequence[float], str, str], str]


def descriptions(
    at: Floats, values: Floats, errors: Floats, weights: Floats, units: tuple[str, str]
) -> tuple[str, ...]:
    """Return which functions stay within the band of a curve, in words, the simplest first.

    Parameters
    ----------
    at, values, errors, weights
        Places, the curve and its standard errors there, and how much each place counts; shape (places,).
    units
        Of places and values.

    Examples
    --------
    >>> x = np.linspace(0.0, 100.0, 101)
    >>> bump = 5.0 * np.exp(-(((x - 40.0) / 10.0) ** 2))
    >>> descriptions(x, bump, np.full(101, 0.1), np.full(101, 1 / 101), ("mm", "um"))
    ('a bump of 5 µm at 40 mm, half as high 8.3 mm away',)
    """
    from scipy.optimize import least_squares  # noqa: PLC0415 - 0.1 s, for curves only

    band = BAND * np.maximum(errors, max(1e-3 * float(np.ptp(values)), 1e-300))
    span, count = float(np.ptp(at)), weights * weights.size
    u = (at - at[0]) / span

    def off(curve: Floats) -> Floats:
        left = curve - values
        found: Floats = (left - np.average(left, weights=weights)) / band
        return np.nan_to_num(found, nan=1e6, posinf=1e6, neginf=-1e6)

    found: list[str] = []
    zero = -float(at[0]) / span
    odd = [_odd(zero)] if 0.1 < zero < 0.9 else []
    plain = (*_FORMS[:_CURVED], *odd, *_FORMS[_CURVED:])
    for form in (*plain, *map(sloping, plain[_CURVED:])):
        if found and form not in plain:
            break
        best = None
        for start in form.starts(u, values):
            with np.errstate(all="ignore"):
                fit = least_squares(
                    lambda p, f=form: off(f.function(u, *p)) * np.sqrt(count),
                    start,
                    method="lm",  # a third of the time
                    xtol=_CLOSE,
                    ftol=_CLOSE,
                    max_nfev=400,
                )
            best = fit if best is None or fit.cost < best.cost else best
        if best is not None and float(weights[np.abs(off(form.function(u, *best.x))) <= 1.0].sum()) >= WITHIN:
            found.append(form.words([*map(float, best.x), float(at[0]), span], *units))
        if len(found) == _MOST_DESCRIPTIONS:
            break
    return tuple(found)


def _odd(zero: float) -> _Form:
    """Return powers of the distance from zero that change their sign there, which lies at a share of the span."""

    def odd(u: Floats, a: float, k: float) -> Floats:
        found: Floats = a * np.sign(u - zero) * np.abs(u - zero) ** np.clip(k, 0.05, 20.0)
        return found

    return _Form(
        odd,
        lambda u, v: _grid(a=_size(v), k=[0.5, 2.0, 3.0]),
        lambda p, x, y: (
            f"a power {min(max(p[1], 0.05), 20.0):.2g} of the distance from zero, of either sign: "
            f"{_of(p[0] * (1.0 - zero) ** min(max(p[1], 0.05), 20.0), y)} at {_of(p[2] + p[3], x)}"
        ),
    )


def sloping(form: _Form) -> _Form:
    """Return a form on a slope."""

    def words(p: Sequence[float], x: str, y: str) -> str:
        return f"{form.words(p[1:], x, y)}, on a slope of {_of(p[0], y)} over {_of(p[-1], x)}"

    return _Form(
        lambda u, slope, *p: slope * u + form.function(u, *p),
        lambda u, v: ([float(v[-1] - v[0]), *start] for start in form.starts(u, v)),
        words,
    )


def _of(value: float, unit: str) -> str:
    return quantity_text(value, symbol(unit) if unit else "", digits=2).strip()


def _grid(**several: Sequence[float]) -> Iterator[list[float]]:
    for values in itertools.product(*several.values()):
        yield list(values)


def _size(v: Floats) -> list[float]:
    return [float(np.ptp(v)), -float(np.ptp(v))]


_FORMS = (
    _Form(
        lambda u, a: a * u,
        lambda u, v: _grid(a=_size(v)),
        lambda p, x, y: f"a straight line: {_of(p[0], y)} over {_of(p[2], x)}",
    ),
    _Form(
        lambda u, a, m: a * (u - m) ** 2,
        lambda u, v: _grid(a=_size(v), m=[0.2, 0.5, 0.8]),
        lambda p, x, y: (
            f"a parabola about {_of(p[2] + p[1] * p[3], x)}: {_of(p[0] / 4.0, y)} at half the span from it"
        ),
    ),
    _Form(
        lambda u, a, k: a * np.abs(u) ** np.clip(k, 0.05, 20.0),
        lambda u, v: _grid(a=_size(v), k=[0.5, 1.5, 3.0]),
        lambda p, x, y: (
            f"a power {min(max(p[1], 0.05), 20.0):.2g} of the distance from {_of(p[2], x)}: {_of(p[0], y)} at the end"
        ),
    ),
    _Form(
        lambda u, a, k: a * np.exp(-u / np.maximum(np.abs(k), 1e-3)),
        lambda u, v: _grid(a=_size(v), k=[0.03, 0.1, 0.3, 1.0]),
        lambda p, x, y: f"{_of(p[0], y)} that decays over {_of(max(abs(p[1]), 1e-3) * p[3], x)}, exponentially",
    ),
    _Form(
        lambda u, a, k: a * u / (u + np.maximum(np.abs(k), 1e-3)),
        lambda u, v: _grid(a=_size(v), k=[0.05, 0.3, 1.0]),
        lambda p, x, y: f"a saturation towards {_of(p[0], y)}, half of it {_of(max(abs(p[1]), 1e-3) * p[3], x)} on",
    ),
    _Form(
        lambda u, a, b, f: a * np.sin(2 * np.pi * f * u) + b * np.cos(2 * np.pi * f * u),
        lambda u, v: _grid(a=[float(np.std(v))], b=[0.1 * float(np.std(v))], f=[0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0]),
        lambda p, x, y: f"a wave of {_of(math.hypot(p[0], p[1]), y)} with a period of {_of(p[4] / abs(p[2]), x)}",
    ),
    _Form(
        lambda u, a, m, w: a * np.exp(-(((u - m) / np.maximum(np.abs(w), 1e-3)) ** 2)),
        lambda u, v: _grid(a=_size(v), m=[float(u[np.argmax(v)]), float(u[np.argmin(v)])], w=[0.03, 0.1, 0.3]),
        lambda p, x, y: (
            f"a bump of {_of(p[0], y)} at {_of(p[3] + p[1] * p[4], x)}, half as high "
            f"{_of(math.sqrt(math.log(2.0)) * max(abs(p[2]), 1e-3) * p[4], x)} away"
        ),
    ),
    _Form(
        lambda u, a, m, w: a * np.tanh((u - m) / np.maximum(np.abs(w), 1e-3)) / 2.0,
        lambda u, v: _grid(a=_size(v), m=[0.25, 0.5, 0.75], w=[0.02, 0.1]),
        lambda p, x, y: (
            f"a step of {_of(p[0], y)} at {_of(p[3] + p[1] * p[4], x)}, over "
            f"{_of(2.0 * max(abs(p[2]), 1e-3) * p[4], x)}"
        ),
    ),
    _Form(
        lambda u, a, b, f, k: (
            np.exp(-np.abs(k) * u) * (a * np.sin(2 * np.pi * f * u) + b * np.cos(2 * np.pi * f * u))
        ),
        lambda u, v: _grid(a=[float(np.std(v))], b=[float(np.std(v))], f=[1.0, 2.0, 4.0], k=[1.0, 4.0]),
        lambda p, x, y: (
            f"a wave of {_of(math.hypot(p[0], p[1]), y)} that dies away over "
            f"{_of(p[5] / max(abs(p[3]), 1e-9), x)}, with a period of {_of(p[5] / abs(p[2]), x)}"
        ),
    ),
)
"""The simplest first; each takes shares of the span, and says its numbers with the begin and the length of that."""
_CURVED = 5
"""Forms before the first that a slope is no part of."""
