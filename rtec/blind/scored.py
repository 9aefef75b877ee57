"""What came out of many games: each game, each line."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtec.blind.line import Line

_Z = 1.959963984540054
"""Quantile of the normal distribution for an interval of 95 %."""


def wilson(right: int, trials: int) -> tuple[float, float]:
    """Return the Wilson score interval of a share, of 95 %.

    Parameters
    ----------
    right, trials
        Counts.

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
    middle = share + _Z * _Z / (2.0 * trials)
    half = _Z * math.sqrt(share * (1.0 - share) / trials + _Z * _Z / (4.0 * trials * trials))
    scale = 1.0 + _Z * _Z / trials
    return max((middle - half) / scale, 0.0), min((middle + half) / scale, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Game:
    """One game of a line, and how the judge did.

    Parameters
    ----------
    trial, seed
        Number of the trial in its line, and the seed that plays it again.
    plan
        Name of the measuring plan.
    hidden, said
        What was hidden and what was answered, as headings of the confusion matrix.
    right
        None where the game does not count: weaker than what the judge says that it would find.
    effects
        Accepted, whatever the verdict.
    names
        What was hidden, one by one.
    verdict
        Of the judge; empty where none was asked for.
    """

    trial: int
    seed: int
    plan: str
    hidden: str
    said: str
    right: bool | None
    effects: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    verdict: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LineScore:
    """How a judge did on one line.

    Parameters
    ----------
    line
        What was played.
    right, trials
        Right answers, and trials that count.
    left_out
        Trials that do not count: weaker than what the judge says that it would find.
    cells
        (what was hidden, what was answered, how often).
    games
        All of them, in order.
    """

    line: Line
    right: int
    trials: int
    left_out: int = 0
    cells: tuple[tuple[str, str, int], ...] = ()
    games: tuple[Game, ...] = ()

    @property
    def share(self) -> float:
        """Share of right answers; NaN where no trial counts."""
        return self.right / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson 95 % interval of the share."""
        return wilson(self.right, self.trials)

    @property
    def reached(self) -> bool:
        """Whether enough answers are right, and no more games left out than may be."""
        most = self.line.most_left_out * (self.trials + self.left_out)
        return self.trials > 0 and self.share >= self.line.share and self.left_out <= most
