"""Playing many times: how often a judge is right, with its interval, and what it said instead."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rtec.blind import tables
from rtec.blind.answer import Answer, Judge, Rule, is_right, label_of, truth_label
from rtec.blind.draws import Draw
from rtec.blind.game import play
from rtec.blind.harder_lines import the_pools
from rtec.blind.hidden import Secret
from rtec.blind.line import Line
from rtec.blind.scored import Game, LineScore
from rtec.checks import whole_within
from rtec.errors import ArgumentError
from rtec.inference.compare import AT_THE_FLOOR
from rtec.jobs import JobPool
from rtec.metrology import Measurement

Progress = Callable[[str, float], None]
Refit = Callable[[Measurement, tuple[str, ...]], tuple[float, float]]
"""Adds effects to an empty model, refits; returns held-out RMS and noise floor in the same unit."""
Play = Callable[[JobPool, Sequence["GameJob"]], Iterator[Game]]
"""Plays games of one line, in the order of their trials."""
MOST_TRIALS = 100_000
MOST_WORKERS = 64
MOST_PATIENCE = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class Confusion:
    """How a judge did on all lines."""

    scores: tuple[LineScore, ...]
    """By line."""
    trials: int
    """Games played on each line."""
    seed: int
    """Of all games."""

    @property
    def pools(self) -> tuple[LineScore, ...]:
        """Lines that share a bar, counted together where all of them were played."""
        by_title = {score.line.title: score for score in self.scores}
        return tuple(
            LineScore(line=pool, games=tuple(game for title in pool.members for game in by_title[title].games))
            for pool in the_pools()
            if set(pool.members) <= set(by_title)
        )

    def as_markdown(self) -> str:
        """Return the scores and a confusion matrix for each line, as Markdown."""
        matrices = [text for score in self.scores for text in ("", *tables.section(score))]
        intro = f"{self.trials} games a line, seed {self.seed}; the interval is Wilson's."
        return "\n".join([intro, "", *tables.scores(self.scores, self.pools), *matrices]) + "\n"


def confusion(
    lines: Sequence[Line],
    trials: int,
    judge: Judge,
    seed: int = 0,
    progress: Progress | None = None,
    *,
    refit: Refit | None = None,
    workers: int = 1,
    patience: int = 1,
    play: Play = JobPool.results,
) -> Confusion:
    """Play each line ``trials`` times and count the right answers.

    Parameters
    ----------
    lines
        What is played; those with `Rule.FLOOR` only where ``refit`` is given.
    trials
        Games on each line, 1 to 100 000; its scenarios take turns.
    judge
        Looks at a measurement and answers.
    seed
        Of all games: the same seed plays the same games, whatever the other lines.
    progress
        Called with the line's title and the share of the whole that is done.
    refit
        Adds the true effects and says what is left.
    workers
        Processes that play at the same time, 1 to 64; the result does not depend on it. With more than one,
        ``judge`` and ``refit`` have to be functions of a module.
    patience
        Where games can be left out as too weak, up to so many times ``trials`` are played until ``trials`` count.
    play
        Plays the games; it may know some of them already.

    Raises
    ------
    ArgumentError
        A number outside its range, or no line to play.

    Examples
    --------
    >>> from rtec.blind.lines import the_lines
    >>> silent = confusion(the_lines()[:1], 2, lambda measurement: ("NONE", ()))
    >>> silent.scores[0].right, silent.scores[0].cells
    (2, (('nothing', 'NONE', 2),))
    """
    whole_within("trials", trials, 1, MOST_TRIALS)
    whole_within("seed", seed, 0, 1 << 32)
    whole_within("workers", workers, 1, MOST_WORKERS)
    whole_within("patience", patience, 1, MOST_PATIENCE)
    played = [line for line in lines if line.rule is not Rule.FLOOR or refit is not None]
    if not played:
        raise ArgumentError("lines", "none that can be played", "one or more; those of the noise floor need refit")
    tell = progress or (lambda title, share: None)
    scores = []
    with JobPool(workers, processes=True) as pool:
        for number, line in enumerate(played):
            job = partial(GameJob, line=line, seed=seed, judge=judge, refit=refit)
            most = trials * (patience if line.above_detectable else 1)
            games: list[Game] = []
            counted = 0
            while counted < trials and len(games) < most:
                tell(line.title, (number + counted / trials) / len(played))
                batch = range(len(games), min(len(games) + trials - counted, most))
                for game in play(pool, [job(trial=trial) for trial in batch]):
                    games.append(game)
                    counted += game.right is not None
                    tell(line.title, (number + counted / trials) / len(played))
            tell(line.title, (number + 1.0) / len(played))
            scores.append(LineScore(line=line, games=tuple(games)))
    return Confusion(scores=tuple(scores), trials=trials, seed=seed)


@dataclass(frozen=True, slots=True, kw_only=True)
class GameJob:
    """One game of a line; line, trial and seed are its seed."""

    line: Line
    trial: int
    seed: int
    judge: Judge
    refit: Refit | None

    def run(self) -> Game:
        """Play it."""
        return self.played()[0]

    def played(self) -> tuple[Game, Answer | None, Secret]:
        """Play it; return how the judge did, what it answered where it was asked, and what was hidden."""
        line, trial, refit = self.line, self.trial, self.refit
        own_seed = seed_of(self.seed, line.title, trial)
        scenario = line.scenario(trial, own_seed)
        measurement, secret = play(scenario, own_seed)
        right: bool | None
        answer: Answer | None = None
        if line.rule is Rule.FLOOR and refit is not None:
            right, said = _at_floor(*refit(measurement, secret.names))
        else:
            answer = Answer(*self.judge(measurement))
            plan, said = scenario.plan, label_of(answer)
            right = is_right(line.rule, answer, secret, repeated=plan.repeated, span_mm=plan.span_mm)
            if line.above_detectable and _too_weak(answer, secret):
                right = None
        game = Game(
            trial=trial,
            seed=own_seed,
            plan=scenario.plan.name,
            hidden=truth_label(secret.names),
            said=said,
            right=right,
            effects=answer.effects if answer else (),
            names=secret.names,
            verdict=answer.verdict if answer else "",
        )
        return game, answer, secret


def seed_of(seed: int, title: str, trial: int) -> int:
    """Return the seed of one game, which does not depend on which other lines are played.

    Examples
    --------
    >>> seed_of(0, "a", 1) == seed_of(0, "a", 1), seed_of(0, "a", 1) == seed_of(0, "b", 1)
    (True, False)
    """
    drawn = np.random.SeedSequence([seed, int(Draw.TRIAL), trial, *title.encode()]).generate_state(1, np.uint64)
    return int(drawn[0] >> np.uint64(2))


def _at_floor(heldout: float, floor: float) -> tuple[bool, str]:
    return (True, "at the floor") if heldout <= AT_THE_FLOOR * floor else (False, "above the floor")


def _too_weak(answer: Answer, secret: Secret) -> bool:
    return any(
        hidden.rms_sigma * secret.sigma_um < answer.detectable_um.get(hidden.name, 0.0) for hidden in secret.effects
    )
