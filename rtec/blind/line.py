"""What a line of the confusion matrix is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rtec.blind.answer import Rule
from rtec.blind.scenario import Scenario
from rtec.errors import ArgumentError


@dataclass(frozen=True, slots=True)
class Line:
    """One line of what must be shown.

    Raises
    ------
    ArgumentError
        No scenario, or both kinds.
    """

    title: str
    """What is hidden."""
    rule: Rule
    """What makes an answer right."""
    share: float
    """Least share of right answers; 0 where the line has no bar and only shows how often."""
    scenarios: tuple[Scenario, ...] = ()
    """Played in turn."""
    above_detectable: bool = False
    """Only those trials count in which the effect is at least as strong as the judge says that it would find."""
    draw: Callable[[int, int], Scenario] | None = None
    """Draws the scenario of a trial from its number and its seed, where they are not played in turn; a function of a
    module, or a partial of one."""
    most_left_out: float = 1.0
    """Largest share of the games that may be left out as too weak."""
    members: tuple[str, ...] = ()
    """Titles of lines whose games are counted together, where it has none of its own."""

    def __post_init__(self) -> None:
        """Check that there is something to play."""
        if not self.members and bool(self.scenarios) is (self.draw is not None):
            raise ArgumentError("scenarios", "both" if self.scenarios else "none", "one or more, or else a draw")

    def scenario(self, trial: int, seed: int) -> Scenario:
        """Return what is hidden in a trial with a seed.

        Examples
        --------
        >>> line = Line(title="two", rule=Rule.NAMED, share=0.9, scenarios=(Scenario(names=("scale",)), Scenario()))
        >>> line.scenario(2, 77).names
        ('scale',)
        """
        return self.scenarios[trial % len(self.scenarios)] if self.draw is None else self.draw(trial, seed)
