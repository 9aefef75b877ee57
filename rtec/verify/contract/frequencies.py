"""What an insertion algorithm does at which frequency: inserts, passes or fails; one search, one wording."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

from rtec.readable import hertz_text

CLOSE = 1.03
"""So near to each other are the frequencies between which it changes what it does."""
DIGITS = (1.0, 1.2, 1.5, 1.8, 2.2, 2.7, 3.3, 3.9, 4.7, 5.6, 6.8, 8.2)
_DEEPER = 10.0
"""Where it does not insert at the lowest frequency, lower ones are tried: by this factor."""


class Does(enum.Enum):
    """What an algorithm does at a frequency."""

    INSERTS = "inserts"
    """A step that is asked for is completed during the motion, and every count is right."""
    PASSES = "passes"
    """Every count is right; a step that is asked for waits until the axis is slower."""
    FAILS = "fails"
    """A count is wrong, or another point of the contract does not hold."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """Neighbouring frequencies that were tried, at all of which an algorithm does the same."""

    from_hz: float
    to_hz: float
    does: Does


@dataclass(frozen=True, slots=True, kw_only=True)
class Frequencies:
    """What an algorithm does at each frequency that was tried.

    Notes
    -----
    A limit holds from the lowest frequency up without a gap: what fails at 120 kHz does not pass to 150 kHz, even if
    it passes there, because an axis on its way to 150 kHz is at 120 kHz once.

    Examples
    --------
    >>> tried = Frequencies(rows=((1e3, Does.INSERTS), (25e3, Does.INSERTS), (26e3, Does.PASSES), (1e6, Does.PASSES)))
    >>> tried.max_inserting_hz, tried.max_passing_hz
    (25000.0, 1000000.0)
    >>> tried.summary(500e3)
    '500 kHz: passes; inserts to 25 kHz; passes beyond 1 MHz'
    """

    rows: tuple[tuple[float, Does], ...]
    """Frequency in Hz, rising, and what it does there."""

    @property
    def bands(self) -> tuple[Band, ...]:
        """Return the rows put together, rising."""
        together = [(does, [hertz for hertz, _ in group]) for does, group in groupby(self.rows, lambda row: row[1])]
        return tuple(Band(from_hz=tried[0], to_hz=tried[-1], does=does) for does, tried in together)

    @property
    def max_inserting_hz(self) -> float:
        """Return up to where it inserts at every frequency tried, 0 where it does not at the lowest; to 3 %."""
        return self._up_to(Does.INSERTS)

    @property
    def max_passing_hz(self) -> float:
        """Return up to where every count is right, inserting or not; 0 where it is not at the lowest; to 3 %."""
        return self._up_to(Does.INSERTS, Does.PASSES)

    @property
    def searched_to_hz(self) -> float:
        """Return the highest frequency tried."""
        return self.rows[-1][0]

    def at(self, hertz: float) -> Does:
        """Return what it does at a frequency: the same as at the next one that was tried above, or at the highest."""
        return next((does for tried, does in self.rows if tried >= hertz * (1.0 - 1e-9)), self.rows[-1][1])

    def summary(self, top_hz: float) -> str:
        """Return one line for a data sheet: what it does at ``top_hz``, then in each band, rising."""
        *below, last = self.bands
        said = [f"{band.does.value} to {hertz_text(three_digits(band.to_hz))}" for band in below]
        if last.does is not Does.FAILS or not below:
            said.append(f"{last.does.value} beyond {hertz_text(three_digits(last.to_hz))}")
        return "; ".join([f"{hertz_text(top_hz)}: {self.at(top_hz).value}", *said])

    def _up_to(self, *right: Does) -> float:
        limit = 0.0
        for hertz, does in self.rows:
            if does not in right:
                break
            limit = hertz
        return limit


def search(
    does: Callable[[float], Does],
    top_hz: float,
    *,
    from_hz: float,
    to_hz: float,
    digits: Sequence[float] = DIGITS,
    deeper: int = 2,
    progress: Callable[[float], None] = lambda share: None,
) -> Frequencies:
    """Try a ladder of frequencies, and between two levels that differ find where it changes, to 3 %.

    Parameters
    ----------
    does
        Tries a frequency.
    top_hz
        One more level, of interest to the user.
    digits
        Levels per decade; twelve by default.
    deeper
        Decades that it goes down below its lower end as long as nothing is inserted there.

    Examples
    --------
    >>> def gate(hertz):
    ...     return Does.INSERTS if hertz < 110e3 else Does.PASSES
    >>> search(gate, 500e3, from_hz=1e3, to_hz=2e6).summary(500e3)
    '500 kHz: passes; inserts to 109 kHz; passes beyond 2 MHz'
    """
    levels = ladder(from_hz, to_hz, top_hz, digits=digits)
    seen: dict[float, Does] = {}

    def tried(hertz: float) -> Does:
        if hertz not in seen:
            seen[hertz] = does(hertz)
            progress(min(len(seen) / (len(levels) + 10.0), 1.0))
        return seen[hertz]

    for hertz in levels:
        tried(hertz)
    for decade in range(1, deeper + 1):
        if seen[min(seen)] is Does.INSERTS:
            break
        tried(from_hz / _DEEPER**decade)
    for low, high in list(pairwise(sorted(seen))):
        _between(low, high, tried)
    return Frequencies(rows=tuple(sorted(seen.items())))


def ladder(from_hz: float, to_hz: float, *more_hz: float, digits: Sequence[float] = DIGITS) -> list[float]:
    """Return the frequencies of a search, rising: its ends, twelve a decade between them, and others.

    Examples
    --------
    >>> ladder(1e3, 2e3, 1.6e3)
    [1000.0, 1200.0, 1500.0, 1600.0, 1800.0, 2000.0]
    """
    decades = range(math.floor(math.log10(from_hz)), math.ceil(math.log10(to_hz)) + 1)
    levels = [float(f"{digit}e{decade}") for decade in decades for digit in digits]
    return sorted({from_hz, to_hz, *more_hz, *(hertz for hertz in levels if from_hz < hertz < to_hz)})


def acceleration_text(hertz_s: float, searched_to_hz_s: float) -> str:
    """Return up to which acceleration every count is right, for a data sheet.

    Examples
    --------
    >>> acceleration_text(885e6, 1e12), acceleration_text(1e12, 1e12)
    ('up to 885 MHz/s (3540 m/s² at counts of 1 um)', 'any')
    """
    if hertz_s <= 0.0:
        return "none: slow turns and starts do harm, too"
    if hertz_s >= searched_to_hz_s:
        return "any"
    return f"up to {hertz_text(three_digits(hertz_s))}/s ({float(f'{4e-6 * hertz_s:.3g}'):g} m/s² at counts of 1 um)"


def three_digits(value: float) -> float:
    """Return a value with three digits, rounded down.

    Examples
    --------
    >>> three_digits(24_854.2), three_digits(4e6)
    (24800.0, 4000000.0)
    """
    scale = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.floor(value / scale * (1.0 + 1e-9)) * scale:.3g}")


def _between(low_hz: float, high_hz: float, tried: Callable[[float], Does]) -> None:
    """Try frequencies between two neighbours until those that differ are close to each other."""
    if high_hz / low_hz <= CLOSE or tried(low_hz) is tried(high_hz):
        return
    middle_hz = math.sqrt(low_hz * high_hz)
    tried(middle_hz)
    _between(low_hz, middle_hz, tried)
    _between(middle_hz, high_hz, tried)
