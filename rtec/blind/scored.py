"""What came out of many games: each game, each line."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

from rtec.blind.line import Line
from rtec.rates import wilson


@dataclass(frozen=True, slots=True, kw_only=True)
class Game:
    """One game of a line, and how the judge did."""

    trial: int
    seed: int
    """Number of the trial in its line, and the seed that plays it again."""
    plan: str
    """Name of the measuring plan."""
    hidden: str
    said: str
    """What was hidden and what was answered, as headings of the confusion matrix."""
    right: bool | None
    """None where the game does not count: weaker than what the judge says that it would find."""
    effects: tuple[str, ...] = ()
    """Accepted, whatever the verdict."""
    names: tuple[str, ...] = ()
    """What was hidden, one by one."""
    verdict: str = ""
    """Of the judge; empty where none was asked for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LineScore:
    """How a judge did on one line.

    Examples
    --------
    >>> from rtec.blind.answer import Rule
    >>> from rtec.blind.scenario import Scenario
    >>> line = Line(title="a line", rule=Rule.NOTHING, share=0.95, scenarios=(Scenario(),))
    >>> game = Game(trial=0, seed=1, plan="base", hidden="nothing", said="NONE", right=True)
    >>> score = LineScore(line=line, games=(game,))
    >>> score.right, score.trials, score.cells
    (1, 1, (('nothing', 'NONE', 1),))
    """

    line: Line
    """What was played."""
    games: tuple[Game, ...]
    """All of them, in order."""

    @property
    def counting(self) -> list[Game]:
        """Games that count."""
        return [game for game in self.games if game.right is not None]

    @property
    def right(self) -> int:
        """Right answers."""
        return sum(game.right is True for game in self.games)

    @property
    def trials(self) -> int:
        """Games that count."""
        return len(self.counting)

    @property
    def left_out(self) -> int:
        """Games that do not count: weaker than what the judge says that it would find."""
        return len(self.games) - self.trials

    @property
    def cells(self) -> tuple[tuple[str, str, int], ...]:
        """(What was hidden, what was answered, how often)."""
        found = Counter((game.hidden, game.said) for game in self.counting)
        return tuple((truth, said, count) for (truth, said), count in sorted(found.items()))

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
