"""Play look-alikes twice round the loop: a poor plan, the experiment suggested, and the same axis measured by it.

Example::

    python -m tools.rounds --games 200 --workers 2
    python -m tools.rounds --games 40 --only 3 -o docs/rounds.md

With ``--hour`` so many games of each pair are played with the best plan for an hour at the machine in place of the
experiment suggested, and as many of what was named at once, to see how much sharper that hour makes it.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rtec.blind.answer import Answer, answer_of, named
from rtec.blind.confusion import seed_of
from rtec.blind.game import again, play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.dataset.load import load_dataset
from rtec.effects.experiments import Ask
from rtec.errors import ArgumentError
from rtec.inference.diagnose import diagnose
from rtec.inference.next_plan import next_plan
from rtec.inference.suggested_plan import suggested_plan
from rtec.jobs import JobPool
from rtec.metrology import Measurement, read_experiment, write_experiment
from rtec.rates import wilson
from rtec.report.rendering import markdown_page

BAR = 0.95
_BELOW = 1

TEMPLATE = Path(__file__).with_name("rounds.md.j2")
STRENGTH = 5.0
OPEN = ("TIED", "INCONCLUSIVE", "LIKELY")
"""Verdicts that ask for another measurement."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Two confounded effects, and what separates them.

    Parameters
    ----------
    title
        Of the two.
    games
        What is hidden, each on a plan too poor to tell it from the other.
    right
        What the right experiment asks for: all of it.
    """

    title: str
    games: tuple[Scenario, ...]
    right: frozenset[Ask]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rounds:
    """How one game went.

    Parameters
    ----------
    hidden, seed
        The effect, and the seed that plays the game again.
    first
        Answer to the first measurement.
    asked
        Whether the experiment suggested there asks for what tells the two apart.
    second
        Answer to the measurement by the plan suggested; None where there was no plan, or the axis could not carry it
        out.
    """

    hidden: str
    seed: int
    first: Answer
    asked: bool
    second: Answer | None

    @property
    def tied(self) -> bool:
        """Whether the first answer was TIED, with the right experiment."""
        return self.first.verdict == "TIED" and self.asked

    @property
    def told_apart(self) -> bool:
        """Whether the second answer names what is hidden, and nothing else."""
        second = self.second
        return second is not None and second.verdict == "NAMED" and named(second) == {self.hidden}

    @property
    def solved(self) -> bool:
        """Whether suggestion, measurement and naming went through."""
        return self.first.verdict in OPEN and self.asked and self.told_apart


def _on(plan: str, *names: str) -> tuple[Scenario, ...]:
    return tuple(Scenario(names=(name,), strength_sigma=STRENGTH, plan=PLANS[plan]) for name in names)


def the_pairs() -> tuple[Pair, ...]:
    """Return the pairs of confounded effects whose separating experiment is carried out."""
    return (
        Pair(
            title="growth and shift",
            games=_on("one_heating", "thermal_growth", "thermal_shift"),
            right=frozenset((Ask.COLD_AND_HOT,)),
        ),
        Pair(
            title="gravity and viscous friction at one speed",
            games=_on("one_pose", "gravity", "viscous"),
            right=frozenset((Ask.SPEEDS, Ask.WHOLE_TURN)),
        ),
        Pair(
            title="spike and wind-up",
            games=_on("one_way", "reversal_spike", "windup"),
            right=frozenset((Ask.AFTER_REVERSALS,)),
        ),
        Pair(
            title="refraction and drift",
            games=_on("one_day", "refraction", "drift"),
            right=frozenset((Ask.OTHER_DAYS,)),
        ),
        Pair(
            title="run offset and lost counts",
            games=_on("two_runs", "run_offset", "lost_counts"),
            right=frozenset((Ask.FIVE_RUNS,)),
        ),
    )


def two_rounds(scenario: Scenario, seed: int, right: frozenset[Ask]) -> Rounds:
    """Play a game twice round the loop, the plan on its way through its file.

    Parameters
    ----------
    scenario
        One effect on a poor plan.
    seed
        Of the game.
    right
        What the experiment has to ask for.
    """
    diagnosis = diagnose(load_dataset(play(scenario, seed)[0]))
    asked = right <= diagnosis.experiment.asks
    plan, _ = suggested_plan(diagnosis)
    second = None
    if plan is not None:
        with TemporaryDirectory() as folder:
            file = Path(folder) / "plan.toml"
            write_experiment(file, plan, diagnosis.experiment.text)
            second = _answer(partial(again, scenario, seed, read_experiment(file)))
    first = answer_of(diagnosis)
    return Rounds(hidden=scenario.names[0], seed=seed, first=first, asked=asked, second=second)


def _answer(measured: Callable[[], tuple[Measurement, object]]) -> Answer | None:
    try:
        measurement, _ = measured()
    except ArgumentError:  # a plan that the axis cannot carry out
        return None
    return answer_of(diagnose(load_dataset(measurement)))


def played(pair: Pair, games: int, seed: int = 0, *, workers: int = 1) -> tuple[Rounds, ...]:
    """Play so many games of a pair, its effects in turn.

    Parameters
    ----------
    pair
        What is played.
    games
        How many.
    seed
        Of all of them.
    workers
        Processes that play at the same time; the result does not depend on it.
    """
    jobs = [
        _Job(scenario=pair.games[trial % len(pair.games)], seed=seed_of(seed, pair.title, trial), right=pair.right)
        for trial in range(games)
    ]
    with JobPool(workers, processes=True) as pool:
        return tuple(pool.results(jobs))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Job:
    scenario: Scenario
    seed: int
    right: frozenset[Ask]

    def run(self) -> Rounds:
        """Play it."""
        return two_rounds(self.scenario, self.seed, self.right)


HOUR_S = 3600.0
NAMED = (
    ("backlash", "scale"),
    ("backlash", "cyclic"),
    ("scale", "windup"),
    ("pitch_map", "backlash"),
    ("drift", "scale"),
)
"""What is named at once, and sharpened by an hour more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hour:
    """What an hour at the machine brought.

    Parameters
    ----------
    tied
        Whether the first answer was TIED.
    told_apart
        Whether the answer after the hour names what is hidden, and nothing else.
    ratios
        Standard errors of what was named over those of repeating the first plan for that hour, in fact.
    """

    tied: bool
    told_apart: bool
    ratios: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _HourJob:
    scenario: Scenario
    seed: int

    def run(self) -> Hour | None:
        """Play it; None where there is no plan, or the axis cannot carry it out."""
        first = diagnose(load_dataset(play(self.scenario, self.seed)[0]))
        planned = next_plan(first, HOUR_S)
        tied = first.verdict.value == "TIED"
        if isinstance(planned, str):
            return None
        try:
            after = diagnose(load_dataset(again(self.scenario, self.seed, planned.plan)[0]))
            if tied:
                answer = answer_of(after)
                told = answer.verdict == "NAMED" and named(answer) == set(self.scenario.names)
                return Hour(tied=True, told_apart=told, ratios=())
            repeated = diagnose(load_dataset(again(self.scenario, self.seed, planned.repeated)[0]))
        except ArgumentError:
            return None
        both = {term.name: [term.errors] for term in repeated.model.terms}
        for term in after.model.terms:
            both.setdefault(term.name, []).append(term.errors)
        pairs = [two for two in both.values() if len(two) == 2 and len(two[0]) == len(two[1])]
        return Hour(
            tied=False,
            told_apart=False,
            ratios=tuple(b / a for one, two in pairs for a, b in zip(one, two, strict=True)),
        )


def hours(games: int, seed: int, workers: int) -> list[str]:
    """Return what an hour is worth as a table of Markdown."""
    found = [
        "| game | games | TIED at first | told apart after an hour | errors over those of repeating, median |",
        "|---|---|---|---|---|",
    ]
    lines = [(pair.title, pair.games) for pair in the_pairs()]
    base = [
        Scenario(names=names, strength_sigma=4.0, plan=PLANS["dense" if "windup" in names else "base"])
        for names in NAMED
    ]
    lines.append(("named at once", tuple(base)))
    for title, scenarios in lines:
        jobs = [_HourJob(scenario=scenarios[k % len(scenarios)], seed=seed_of(seed, title, k)) for k in range(games)]
        with JobPool(workers, processes=True) as pool:
            played_ = [one for one in pool.results(jobs) if one is not None]
        tied = [one for one in played_ if one.tied]
        ratios = [ratio for one in played_ for ratio in one.ratios]
        share = _share(sum(one.told_apart for one in tied), len(tied)) if tied else ""
        median = f"{float(np.median(ratios)):.2f}" if ratios else ""
        gone = f"({len(jobs) - len(played_)} without a plan)"
        found.append(f"| {title} | {len(jobs)} {gone} | {len(tied)} | {share} | {median} |")
        sys.stderr.write(found[-1] + "\n")
    return found


def rows(results: Sequence[tuple[Pair, Sequence[Rounds]]]) -> list[str]:
    """Return how often each step went through, as rows of Markdown with Wilson's 95 % interval."""
    heads = (
        "pair",
        "games",
        "TIED, right experiment",
        "open, right experiment",
        "told apart",
        "both rounds",
    )
    found = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for pair, games in results:
        counts = (
            sum(one.tied for one in games),
            sum(one.first.verdict in OPEN and one.asked for one in games),
            sum(one.told_apart for one in games),
            sum(one.solved for one in games),
        )
        found.append(f"| {pair.title} | {len(games)} | {' | '.join(_share(count, len(games)) for count in counts)} |")
    return found


def _share(count: int, of: int) -> str:
    low, high = wilson(count, of)
    return f"{count} ({count / of:.1%}; {low:.1%} to {high:.1%})"


def page(results: list[tuple[Pair, tuple[Rounds, ...]]], games: int, seed: int, hour: Sequence[str] = ()) -> str:
    """Return the page as Markdown, with the games that did not go through."""
    missed = [one for _, of_pair in results for one in of_pair if not one.solved]
    return markdown_page(
        TEMPLATE,
        games=games,
        seed=f" --seed {seed}" if seed else "",
        pairs="\n".join(rows(results)),
        hour="\n".join(hour),
        missed=[(one.hidden, one.seed, _said(one, 1), _said(one, 2)) for one in missed],
    )


def _said(one: Rounds, number: int) -> str:
    answer = one.first if number == 1 else one.second
    if answer is None:
        return "no plan"
    asked = "" if number == 2 or one.asked else ", another experiment"
    return f"{answer.verdict} {' + '.join(sorted(answer.effects))}".strip() + asked


def main() -> int:
    """Play, and print the page; the exit code is 1 where a pair lies below 95 %."""
    parser = argparse.ArgumentParser(description="Play look-alikes twice round the loop.")
    parser.add_argument("--games", type=int, default=40, help="of each pair")
    parser.add_argument("--seed", type=int, default=0, help="of all games")
    parser.add_argument("--only", type=int, action="append", help="number of a pair, from 0; may be repeated")
    parser.add_argument("--workers", type=int, default=1, help="processes that play at the same time")
    parser.add_argument("--hour", type=int, default=0, help="games of each pair with the best plan for an hour")
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
    given = parser.parse_args()
    pairs = the_pairs() if given.only is None else [the_pairs()[number] for number in given.only]
    results = []
    for pair in pairs if given.games else ():
        results.append((pair, played(pair, given.games, given.seed, workers=given.workers)))
        sys.stderr.write(rows(results)[-1] + "\n")
    hour = hours(given.hour, given.seed, given.workers) if given.hour else []
    text = page(results, given.games, given.seed, hour)
    if given.output is None:
        sys.stdout.write(text)
    else:
        given.output.write_text(text, encoding="utf-8")
    reached = all(sum(one.solved for one in games) >= BAR * len(games) for _, games in results)
    return 0 if reached else _BELOW


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of the players: more threads than cores only wait
    sys.exit(main())
