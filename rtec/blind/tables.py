"""Scores and what was answered, as rows of Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from rtec.blind.answer import Rule
from rtec.blind.scored import LineScore
from rtec.rates import wilson

_RARE = 0.02
_OTHER = "another"
_SCORES = (
    "| what is hidden | right is | bar | right | share | 95 % interval | |",
    "|---|---|---|---|---|---|---|",
)
_WRONG = (Rule.NOTHING, Rule.WRONG_NAME)


def scores(of_lines: Sequence[LineScore], of_pools: Sequence[LineScore]) -> list[str]:
    """Return the table of all lines, each pool after the last of its lines."""
    rows = list(_SCORES)
    for score in of_lines:
        rows.append(_score_row(score))
        rows += [_score_row(pool) for pool in of_pools if pool.line.members[-1] == score.line.title]
    return rows


def section(score: LineScore) -> list[str]:
    """Return what was answered on a line under its heading."""
    title = score.line.title
    head, *rows = [f"| {' | '.join(cells)} |" for cells in grid(score)]
    answers = [head, "|---" * len(grid(score)[0]) + "|", *rows]
    said = ", ".join(f"{verdict} {count}" for verdict, count in verdicts(score))
    return [f"### {title[:1].upper()}{title[1:]}", "", *([f"Verdicts: {said}.", ""] if said else []), *answers]


def grid(score: LineScore) -> list[list[str]]:
    """Return a heading and rows: a confusion matrix, or a tally where each game hides another set of effects."""
    if not score.trials:
        return [["No trial counts"]]
    return _tally(score) if _several(score) else _matrix(score)


def verdicts(score: LineScore) -> list[tuple[str, int]]:
    """Return how often each verdict was given, where each game hides another set of effects."""
    return sorted(Counter(game.verdict for game in score.counting).items()) if _several(score) else []


def _several(score: LineScore) -> bool:
    return score.line.draw is not None and score.line.rule is Rule.NAMED


def _score_row(score: LineScore) -> str:
    line = score.line
    bar = _bar(line.share, line.rule in _WRONG)
    if line.most_left_out < 1.0:
        bar += f", at most {line.most_left_out:.0%} too weak"
    out = f", {score.left_out} too weak" if score.left_out else ""
    mark = "shown" if line.share == 0.0 else "reached" if score.reached else "missed"
    return f"| {line.title} | {line.rule.value} | {bar} | {share_cells(score.right, score.trials, out)} | {mark} |"


def _bar(share: float, of_wrong: bool) -> str:
    if share == 0.0:
        return "none"
    return f"wrong at most {1.0 - share:.0%}" if of_wrong else f"at least {share:.0%}"


def share_cells(right: int, trials: int, note: str = "") -> str:
    """Return counts, share and Wilson interval as three cells.

    Examples
    --------
    >>> share_cells(190, 200)
    '190 of 200 | 95.0% | 91.0% to 97.3%'
    """
    low, high = wilson(right, trials)
    share = f"{right / trials:.1%}" if trials else "none"
    return f"{right} of {trials}{note} | {share} | {low:.1%} to {high:.1%}"


def _matrix(score: LineScore) -> list[list[str]]:
    """Return what was hidden against what was answered; rare answers that name nothing hidden share a column."""
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
    head = ["hidden \\ answered", *columns]
    return [head, *([truth, *(str(counts[truth, said] or "") for said in columns)] for truth in truths)]


def _tally(score: LineScore) -> list[list[str]]:
    counting = score.counting
    hidden = Counter(name for game in counting for name in game.names)
    found = Counter(name for game in counting for name in set(game.names) & set(game.effects))
    made_up = Counter(name for game in counting for name in set(game.effects) - set(game.names))
    head = ["effect", "hidden", "accepted where hidden", "accepted elsewhere"]
    rows = sorted({*hidden, *made_up})
    return [head, *([name, str(hidden[name]), str(found[name]), str(made_up[name] or "")] for name in rows)]
