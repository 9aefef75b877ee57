"""Playing many times: how often a judge is right, with its interval, and what it said instead."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context

import numpy as np

from rtec.blind.answer import Answer, Judge, Rule, is_right, label_of, truth_label
from rtec.blind.draws import Draw
from rtec.blind.game import play
from rtec.blind.lines import Line
from rtec.blind.secret import Secret
from rtec.checks import whole_within
from rtec.errors import ArgumentError
from rtec.metrology import Measurement

Progress = Callable[[str, float], None]
Refit = Callable[[Measurement, tuple[str, ...]], tuple[float, float]]
"""Adds effects to an empty model, refits; returns held-out RMS and noise floor in the same unit."""
FLOOR_MARGIN = 1.10
"""Held-out error above the noise floor that is still at it."""
MOST_TRIALS = 100_000
MOST_WORKERS = 64
MOST_PATIENCE = 100
_RARE = 0.02
_OTHER = "another"


def wilson(right: int, trials: int, *, z: float = 1.959963984540054) -> tuple[float, float]:
    """Return the Wilson score interval of a share.

    Parameters
    ----------
    right, trials
        Counts.
    z
        Quantile of the normal distribution; 95 % by default.

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
    middle = share + z * z / (2.0 * trials)
    half = z * math.sqrt(share * (1.0 - share) / trials + z * z / (4.0 * trials * trials))
    scale = 1.0 + z * z / trials
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
    """

    trial: int
    seed: int
    plan: str
    hidden: str
    said: str
    right: bool | None
    effects: tuple[str, ...] = ()


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
    left_out: int
    cells: tuple[tuple[str, str, int], ...]
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
        """Whether the share of right answers is at least that of the line."""
        return self.trials > 0 and self.share >= self.line.share


@dataclass(frozen=True, slots=True, kw_only=True)
class Confusion:
    """How a judge did on all lines.

    Parameters
    ----------
    scores
        By line.
    trials
        Games played on each line.
    seed
        Of all games.
    """

    scores: tuple[LineScore, ...]
    trials: int
    seed: int

    def as_markdown(self) -> str:
        """Return the scores and a confusion matrix for each line, as Markdown."""
        head = [
            "| what is hidden | right is | bar | right | share | 95 % interval | |",
            "|---|---|---|---|---|---|---|",
        ]
        rows = [_score_row(score) for score in self.scores]
        matrices = [
            text for score in self.scores for text in ("", f"### {_capital(score.line.title)}", "", *_matrix(score))
        ]
        intro = f"{self.trials} games a line, seed {self.seed}; the interval is Wilson's."
        return "\n".join([intro, "", *head, *rows, *matrices]) + "\n"


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
        Processes that play at the same time, 1 to 64; the result does not depend on it. With more than one, ``judge``
        and ``refit`` have to be functions of a module.
    patience
        Where games can be left out as too weak, up to so many times ``trials`` are played until ``trials`` count.

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
    scores = []
    with ExitStack() as stack:
        each: _Map = map
        if workers > 1:
            # fresh processes: a fork would copy locks that the compiler's threads may hold
            each = stack.enter_context(ProcessPoolExecutor(workers, mp_context=get_context("spawn"))).map
        for number, line in enumerate(played):

            def tell(share: float, number: int = number, line: Line = line) -> None:
                if progress is not None:
                    progress(line.title, (number + share) / len(played))

            game = partial(_play_game, line, seed, judge, refit)
            scores.append(_play_line(line, trials, patience if line.above_detectable else 1, each, game, tell))
    return Confusion(scores=tuple(scores), trials=trials, seed=seed)


_Map = Callable[[Callable[[int], Game], Sequence[int]], Iterator[Game]]


def _play_line(
    line: Line, trials: int, patience: int, each: _Map, game: Callable[[int], Game], tell: Callable[[float], None]
) -> LineScore:
    games: list[Game] = []
    for turn in range(patience):
        counted = sum(one.right is not None for one in games)
        if counted == trials:
            break
        for one in each(game, range(turn * trials, (turn + 1) * trials)):
            if counted == trials:
                continue
            tell(counted / trials)
            games.append(one)
            counted += one.right is not None
    tell(1.0)
    counting = [one for one in games if one.right is not None]
    cells = Counter((one.hidden, one.said) for one in counting)
    return LineScore(
        line=line,
        right=sum(one.right is True for one in counting),
        trials=len(counting),
        left_out=len(games) - len(counting),
        cells=tuple((truth, said, count) for (truth, said), count in sorted(cells.items())),
        games=tuple(games),
    )


def _play_game(line: Line, seed: int, judge: Judge, refit: Refit | None, trial: int) -> Game:
    scenario, own_seed = line.scenarios[trial % len(line.scenarios)], seed_of(seed, line.title, trial)
    measurement, secret = play(scenario, own_seed)
    good: bool | None
    effects: tuple[str, ...] = ()
    if line.rule is Rule.FLOOR and refit is not None:
        good, said = _at_floor(*refit(measurement, secret.names))
    else:
        answer = Answer(*judge(measurement))
        good, said, effects = is_right(line.rule, answer, secret), label_of(answer), answer.effects
        if line.above_detectable and _too_weak(answer, secret):
            good = None
    return Game(
        trial=trial,
        seed=own_seed,
        plan=scenario.plan.name,
        hidden=truth_label(secret.names),
        said=said,
        right=good,
        effects=effects,
    )


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
    return (True, "at the floor") if heldout <= FLOOR_MARGIN * floor else (False, "above the floor")


def _too_weak(answer: Answer, secret: Secret) -> bool:
    return any(
        hidden.rms_sigma * secret.sigma_um < answer.detectable_um.get(hidden.name, 0.0) for hidden in secret.effects
    )


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _score_row(score: LineScore) -> str:
    low, high = score.interval
    line = score.line
    bar = f"at least {line.share:.0%}" if line.rule is not Rule.NOTHING else f"wrong at most {1.0 - line.share:.0%}"
    out = f", {score.left_out} too weak" if score.left_out else ""
    share = "none" if math.isnan(score.share) else f"{score.share:.1%}"
    mark = "reached" if score.reached else "missed"
    return (
        f"| {line.title} | {line.rule.value} | {bar} | {score.right} of {score.trials}{out} | {share} "
        f"| {low:.1%} to {high:.1%} | {mark} |"
    )


def _matrix(score: LineScore) -> list[str]:
    """Return a confusion matrix as rows of Markdown; rare answers that name nothing hidden share a column."""
    if not score.cells:
        return ["No trial counts."]
    truths = sorted({truth for truth, _, _ in score.cells})
    total: Counter[str] = Counter()
    for _, said, count in score.cells:
        total[said] += count
    kept = [said for said in sorted(total) if said in truths or total[said] >= _RARE * score.trials]
    others = any(said not in kept for said in total)
    columns = [*sorted(kept, key=lambda said: (said not in truths, said)), *([_OTHER] if others else [])]
    counts: Counter[tuple[str, str]] = Counter()
    for truth, said, count in score.cells:
        counts[truth, said if said in kept else _OTHER] += count
    rows = [f"| hidden \\ answered | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    rows += [f"| {truth} | {' | '.join(str(counts[truth, said] or '') for said in columns)} |" for truth in truths]
    return rows
