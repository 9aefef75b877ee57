"""Twice round the loop: measured poorly, diagnosed, measured again by the plan suggested, and named."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from rtec.blind.answer import Answer, answer_of, named
from rtec.blind.confusion import seed_of
from rtec.blind.game import again, play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.blind.shares import wilson
from rtec.dataset.load import load_dataset
from rtec.effects.experiments import Ask
from rtec.errors import ArgumentError
from rtec.inference.diagnose import diagnose
from rtec.inference.suggested_plan import suggested_plan
from rtec.jobs import JobPool
from rtec.metrology import Measurement, read_experiment, write_experiment

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
    """Return the pairs of confounded effects whose separating experiment is carried out.

    Examples
    --------
    >>> [pair.title for pair in the_pairs()][0]
    'growth and shift'
    """
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

    Examples
    --------
    >>> pair = the_pairs()[4]
    >>> two_rounds(pair.games[0], 1, pair.right).solved
    True
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

    Examples
    --------
    >>> [one.hidden for one in played(the_pairs()[4], 2)]
    ['run_offset', 'lost_counts']
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


def rows(results: Sequence[tuple[Pair, Sequence[Rounds]]]) -> list[str]:
    """Return how often each step went through, as rows of Markdown with Wilson's 95 % interval.

    Examples
    --------
    >>> rows([])[0][:7]
    '| pair '
    """
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
