"""How far a judge's numbers can be trusted, over all games: periods, standard errors, probabilities."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rtec.blind.found import Belief, Figure, Wave
from rtec.blind.scored import Game
from rtec.blind.tables import share_cells

PERIODS_RIGHT = 0.98
MOST_MULTIPLES = 0.01
COVERAGE = (0.90, 0.98)
CALIBRATED = 0.05
FEWEST_CASES = 100
_DECILES = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Decile:
    """Effects that were accepted with a probability within a tenth.

    Parameters
    ----------
    number
        0 for probabilities from 0 to 0.1, 9 for those from 0.9 to 1.
    cases, right
        How many, and how many of them were there.
    mean_probability
        Of the cases.
    """

    number: int
    cases: int
    right: int
    mean_probability: float

    @property
    def calibrated(self) -> bool | None:
        """Whether the share right is within 5 points of the mean probability; None with fewer than 100 cases."""
        if self.cases < FEWEST_CASES:
            return None
        return abs(self.right / self.cases - self.mean_probability) <= CALIBRATED + 1e-12


def deciles_of(beliefs: Iterable[Belief]) -> tuple[Decile, ...]:
    """Return the tenths of probability in which there are cases, ascending.

    Examples
    --------
    >>> found = deciles_of([Belief(effect="drift", probability=p, right=p > 0.9) for p in (0.95, 0.85, 1.0)])
    >>> [(one.number, one.cases, one.right) for one in found]
    [(8, 1, 0), (9, 2, 2)]
    """
    sorted_in: defaultdict[int, list[Belief]] = defaultdict(list)
    for one in beliefs:
        sorted_in[min(int(one.probability * _DECILES), _DECILES - 1)].append(one)
    return tuple(
        Decile(
            number=number,
            cases=len(cases),
            right=sum(one.right for one in cases),
            mean_probability=sum(one.probability for one in cases) / len(cases),
        )
        for number, cases in sorted(sorted_in.items())
    )


def evidence(games: Sequence[Game]) -> list[str]:
    """Return the tables of periods, coverage and calibration as Markdown.

    Periods and numbers are those of right answers; probabilities those of every effect accepted in any game.

    Examples
    --------
    >>> evidence([])[0]
    '## Periods of waves'
    """
    right = [game for game in games if game.right is True]
    waves = [wave for game in right for wave in game.waves]
    figures = [figure for game in right for figure in game.figures]
    beliefs = [belief for game in games for belief in game.beliefs]
    return [*_periods(waves), "", *_coverage(figures), "", *_calibration(beliefs)]


_HEAD = ("| | bar | | share | 95 % interval | |", "|---|---|---|---|---|---|")


def _row(what: str, bar: str, right: int, cases: int, reached: bool) -> str:
    mark = ("reached" if reached else "missed") if cases else "no case"
    return f"| {what} | {bar} | {share_cells(right, cases)} | {mark} |"


def _periods(waves: Sequence[Wave]) -> list[str]:
    good, multiples, cases = sum(w.right for w in waves), sum(w.multiple for w in waves), len(waves)
    return [
        "## Periods of waves",
        "",
        "Of each wave that was hidden and named in a right answer, the period found against the true one: right",
        "within 0.5 %, or within 2.5 of the standard errors printed.",
        "",
        *_HEAD,
        _row("right", f"at least {PERIODS_RIGHT:.0%}", good, cases, good >= PERIODS_RIGHT * cases),
        _row(
            "a multiple of the true one",
            f"at most {MOST_MULTIPLES:.0%}",
            multiples,
            cases,
            multiples <= MOST_MULTIPLES * cases,
        ),
    ]


def _coverage(figures: Sequence[Figure]) -> list[str]:
    by_name: defaultdict[str, list[Figure]] = defaultdict(list)
    for figure in figures:
        by_name[figure.name].append(figure)
    covered, cases = sum(figure.covered for figure in figures), len(figures)
    low, high = COVERAGE
    reached = low * cases <= covered <= high * cases
    return [
        "## Coverage of the standard errors",
        "",
        "How often the true number lies within two of the standard errors printed, after the search, in right",
        "answers.",
        "",
        *_HEAD,
        _row("all numbers", f"{low:.0%} to {high:.0%}", covered, cases, reached),
        *(
            f"| {name} | | {share_cells(sum(one.covered for one in own), len(own))} | |"
            for name, own in sorted(by_name.items())
        ),
    ]


def _calibration(beliefs: Sequence[Belief]) -> list[str]:
    rows = []
    for one in deciles_of(beliefs):
        mark = {True: "reached", False: "missed", None: f"fewer than {FEWEST_CASES} cases"}[one.calibrated]
        span = f"{one.number / _DECILES:.1f} to {(one.number + 1) / _DECILES:.1f}"
        rows.append(f"| {span} | {one.mean_probability:.3f} | {share_cells(one.right, one.cases)} | {mark} |")
    return [
        "## Calibration of the probabilities",
        "",
        "Every effect accepted in any game, whatever the verdict, by the probability that the diagnosis gives it.",
        f"Where there are {FEWEST_CASES} cases or more, the share that was there has to be within 5 points of the",
        "mean probability.",
        "",
        *(
            ["| probability | mean | was there | share | 95 % interval | |", "|---|---|---|---|---|---|", *rows]
            if rows
            else ["The diagnosis gave no probability."]
        ),
    ]
