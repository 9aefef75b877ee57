"""How far a judge's numbers can be trusted, over all games: periods, standard errors and probabilities."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from types import MappingProxyType

from rtec.blind.answer import WAVES, Answer, wrong_names
from rtec.blind.confusion import GameJob
from rtec.blind.hidden import Secret
from rtec.blind.scored import Game
from rtec.blind.tables import share_cells
from rtec.inference.results import Value

PERIOD_SHARE = 0.005
"""Of the true period: a period so near is right, however small its standard error."""
PERIOD_ERRORS = 2.5
COVERED_ERRORS = 2.0
_MULTIPLE_SHARE = 0.01
PERIODS_RIGHT = 0.98
MOST_MULTIPLES = 0.01
COVERAGE = (0.90, 0.98)
CALIBRATED = 0.05
FEWEST_CASES = 100
_DECILES = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Wave:
    """The period of a wave that was hidden and named.

    Parameters
    ----------
    effect
        Its name.
    found_mm, error_mm
        What was found, and its standard error; None where none is given.
    truth_mm
        What was hidden.
    """

    effect: str
    found_mm: float
    error_mm: float | None
    truth_mm: float

    @property
    def right(self) -> bool:
        """Whether it is within half a percent, or within 2.5 standard errors."""
        allowed = max(PERIOD_SHARE * self.truth_mm, PERIOD_ERRORS * (self.error_mm or 0.0))
        return abs(self.found_mm - self.truth_mm) <= allowed * (1.0 + 1e-9)

    @property
    def multiple(self) -> bool:
        """Whether it is twice the true period, or another multiple of it."""
        times = self.found_mm / self.truth_mm
        return round(times) > 1 and abs(times - round(times)) <= _MULTIPLE_SHARE * times


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A number of an effect that was hidden and named.

    Parameters
    ----------
    name
        Effect and number, such as ``backlash.backlash``.
    found, error, truth
        What was found, its standard error, what was hidden; in the same unit.
    """

    name: str
    found: float
    error: float
    truth: float

    @property
    def covered(self) -> bool:
        """Whether the truth is within two standard errors."""
        return abs(self.found - self.truth) <= COVERED_ERRORS * self.error


@dataclass(frozen=True, slots=True, kw_only=True)
class Belief:
    """How probable a judge holds an effect that it accepted, and whether it was there."""

    effect: str
    probability: float
    right: bool


TRUTHS: Mapping[tuple[str, str], tuple[str, str, float]] = MappingProxyType(
    {
        ("scale", "scale"): ("um/m", "scale", 1.0),
        # the library's is the shift of the backward readings against the forward ones
        ("backlash", "backlash"): ("um", "play", -1.0),
        ("drift", "rate"): ("um/h", "rate", 1.0),
        ("warm_up", "time_constant"): ("s", "time_constant", 1.0),
        ("warm_up", "final"): ("um", "final", 1.0),
        ("thermal_growth", "expansion"): ("um/m/K", "expansion", 1.0),
        ("thermal_shift", "shift"): ("um/K", "shift", 1.0),
        # the encoder's count is 1 um
        ("lost_counts", "step"): ("um", "counts", 1.0),
        ("inertia", "inertia"): ("kg", "mass", 1.0),
        ("viscous", "viscous"): ("N/(m/s)", "viscous", 1.0),
        ("coulomb", "coulomb"): ("N", "friction", 1.0),
        ("stribeck", "stribeck"): ("N", "friction", 1.0),
        ("force_offset", "force_offset"): ("N", "force", 1.0),
        ("load_friction", "load_friction"): ("N/kg", "friction", 1.0),
        ("warm_up_growth", "time_constant"): ("s", "time_constant", 1.0),
        ("warm_up_growth", "growth"): ("um/m", "growth", 1.0),
        ("refraction", "refraction"): ("", "share", 1.0),
        ("dead_path", "dead_path"): ("mm", "length", 1.0),
    }
)
"""Numbers of the library that the game knows: their unit, the game's own name for them, and the factor from it.

The lags of a moving log are left out: the loop that makes them adds a little of its own.
"""


def waves_of(answer: Answer, secret: Secret) -> tuple[Wave, ...]:
    """Return the waves that were hidden and named, with their periods."""
    found = []
    for hidden in (one for one in secret.effects if one.name in WAVES):
        truth = next(p.value for p in hidden.parameters if p.name == "period")
        for value in _values(answer, hidden.name):
            if value.name == "period" and value.unit == "mm" and isinstance(value.value, float):
                found.append(
                    Wave(effect=hidden.name, found_mm=value.value, error_mm=_finite(value.error), truth_mm=truth)
                )
    return tuple(found)


def figures_of(answer: Answer, secret: Secret) -> tuple[Figure, ...]:
    """Return the numbers of what was hidden and named, as far as both sides know them."""
    found = []
    for hidden in secret.effects:
        truths = {p.name: p.value for p in hidden.parameters}
        for value in _values(answer, hidden.name):
            unit, own, factor = TRUTHS.get((hidden.name, value.name), ("", "", 0.0))
            error = _finite(value.error)
            if own and unit == value.unit and error is not None and isinstance(value.value, float):
                found.append(
                    Figure(
                        name=f"{hidden.name}.{value.name}",
                        found=value.value,
                        error=error,
                        truth=factor * truths[own],
                    )
                )
    return tuple(found)


def beliefs_of(answer: Answer, secret: Secret) -> tuple[Belief, ...]:
    """Return the probabilities of the effects that a judge accepted, whatever its verdict."""
    put_forward = Answer("NAMED", answer.effects)
    wrong = wrong_names(put_forward, secret)
    return tuple(
        Belief(effect=name, probability=float(answer.probability[name]), right=name not in wrong)
        for name in dict.fromkeys(answer.effects)
        if name != "offset" and _finite(answer.probability.get(name)) is not None
    )


def _values(answer: Answer, name: str) -> tuple[Value, ...]:
    return tuple(value for effect, values in answer.values if effect == name for value in values)


def _finite(number: float | None) -> float | None:
    return None if number is None or not math.isfinite(number) else float(number)


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """Periods and numbers of what was hidden and named, and probabilities of all that was accepted."""

    waves: tuple[Wave, ...] = ()
    figures: tuple[Figure, ...] = ()
    beliefs: tuple[Belief, ...] = ()


def evidence_of(answer: Answer, secret: Secret) -> Evidence:
    """Return what an answer says in numbers beside what was hidden."""
    return Evidence(
        waves=waves_of(answer, secret), figures=figures_of(answer, secret), beliefs=beliefs_of(answer, secret)
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ExaminedGame(Game):
    """A game, and what its answer says in numbers."""

    examined: Evidence


@dataclass(frozen=True, slots=True, kw_only=True)
class ExaminedJob:
    """A game that is examined as it is played."""

    job: GameJob

    def run(self) -> ExaminedGame:
        """Play it."""
        game, answer, secret = self.job.played()
        examined = Evidence() if answer is None else evidence_of(answer, secret)
        return ExaminedGame(**{field.name: getattr(game, field.name) for field in fields(Game)}, examined=examined)


def told_by(game: Game) -> Evidence:
    """Return what the answer of a game says in numbers; nothing where it was not examined."""
    return game.examined if isinstance(game, ExaminedGame) else Evidence()


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
    """Return the tenths of probability in which there are cases, ascending."""
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
    """
    right = [game for game in games if game.right is True]
    waves = [wave for game in right for wave in told_by(game).waves]
    figures = [figure for game in right for figure in told_by(game).figures]
    beliefs = [belief for game in games for belief in told_by(game).beliefs]
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
