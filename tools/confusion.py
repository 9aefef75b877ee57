"""Play the hidden-effect game many times on every line that is published; print docs/confusion.md and its tables.

Every game is appended to the file of ``--resume`` as it ends: the same command goes on where it was stopped.

Example::

    python -m tools.confusion --trials 200 --resume games.jsonl -o docs/confusion.md
    python -m tools.confusion --trials 6 --only 0 --only 7
    python -m tools.confusion --resume games.jsonl --compare before.jsonl
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from rtec.blind import tables
from rtec.blind.confusion import Confusion, confusion
from rtec.blind.judged import judged, refitted
from rtec.blind.line import Line
from rtec.blind.lines import the_lines
from rtec.blind.scored import Game, LineScore
from rtec.errors import RtecError
from rtec.report.rendering import markdown_page
from tools.evidence import evidence
from tools.record import appending, comparison, going_on, paired, read_games

TRIALS = 200
PATIENCE = 4
"""Where games can be too weak to count, so many times the trials are played until as many count as are asked for."""
WORKERS = 2
_MOST_MISSES = 12
_BELOW, _BAD = 1, 2

TEMPLATE = Path(__file__).with_name("confusion.md.j2")


def page(result: Confusion, *, seconds: float) -> str:
    """Return the page as Markdown."""
    missed = [
        (score.line.title, len(wrong), score.trials, _answers(wrong))
        for score in result.scores
        if (wrong := [game for game in score.games if game.right is False])
    ]
    return markdown_page(
        TEMPLATE,
        result=result,
        seed="" if result.seed == 0 else f" --seed {result.seed}",
        scores="\n".join(tables.scores(result.scores, result.pools)),
        evidence="\n".join(evidence([game for score in result.scores for game in score.games])).strip(),
        most=_MOST_MISSES,
        missed=missed,
        duration=f"{seconds / 60.0:.0f} minutes" if seconds >= 120.0 else f"{seconds:.0f} seconds",
    )


def _answers(wrong: Sequence[Game]) -> str:
    """Return what was answered, of as many games as are listed."""
    counts = Counter(f"{game.hidden} → {game.said}" for game in wrong[:_MOST_MISSES])
    return ", ".join(f"{what} ({count})" if count > 1 else what for what, count in counts.items())


def matrices(scores: Sequence[LineScore]) -> Iterator[tuple[str, ...]]:
    """Yield the cells of every line that are not empty."""
    yield "line", "row", "column", "games"
    for score in scores:
        for verdict, count in tables.verdicts(score):
            yield score.line.title, "verdict", verdict, str(count)
        (_, *columns), *rows = tables.grid(score)
        for row, *cells in rows:
            yield from ((score.line.title, row, *cell) for cell in zip(columns, cells, strict=True) if cell[1])


def wrong_games(scores: Sequence[LineScore]) -> Iterator[tuple[str, ...]]:
    """Yield the games that went wrong, as many of each line as are listed."""
    yield "line", "trial", "seed", "plan", "hidden", "answered", "named"
    for score in scores:
        for game in [game for game in score.games if game.right is False][:_MOST_MISSES]:
            named = " + ".join(sorted(game.effects))
            yield score.line.title, str(game.trial), str(game.seed), game.plan, game.hidden, game.said, named


def write_rows(path: Path, rows: Iterable[tuple[str, ...]]) -> None:
    """Write a CSV file."""
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def main() -> int:
    """Play, and write the page; the exit code is 1 where a line lies below its bar, 2 where a file is wrong."""
    given = _arguments().parse_args()
    lines = the_lines() if given.only is None else tuple(the_lines()[number] for number in given.only)
    try:
        if given.compare is not None:
            return _compare(lines, given)
        result, seconds = _played(lines, given)
    except RtecError as error:
        sys.stderr.write(f"{error}\n")
        return _BAD
    text = page(result, seconds=seconds)
    if given.output is None:
        sys.stdout.write(text)
    else:
        given.output.write_text(text, encoding="utf-8")
        write_rows(given.output.with_suffix(".csv"), matrices(result.scores))
        write_rows(given.output.with_name(f"{given.output.stem}-games.csv"), wrong_games(result.scores))
    reached = all(line.reached for line in result.scores) and all(pool.reached for pool in result.pools)
    return 0 if reached else _BELOW


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Regenerate the confusion matrix of docs/confusion.md.")
    parser.add_argument("--trials", type=int, default=TRIALS, help="games that count on each line")
    parser.add_argument("--seed", type=int, default=0, help="of all games")
    parser.add_argument(
        "--only", type=int, action="append", help="number of a line, from 0; may be given several times"
    )
    parser.add_argument("--workers", type=int, default=WORKERS, help="processes that play at the same time")
    parser.add_argument("--resume", type=Path, metavar="FILE.jsonl", help="games played before; new ones go there")
    parser.add_argument(
        "--compare", type=Path, metavar="OTHER.jsonl", help="play nothing, compare with the games of --resume"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        help="file to write the page to, instead of stdout; its tables go beside it as CSV",
    )
    return parser


def _played(lines: tuple[Line, ...], given: argparse.Namespace) -> tuple[Confusion, float]:
    """Play what is not known yet; return the outcome and how long it took."""
    begun = time.monotonic()
    told: set[str] = set()

    def tell(title: str, share: float) -> None:
        if title not in told:
            told.add(title)
            sys.stderr.write(f"{time.monotonic() - begun:6.0f} s  {title}\n")

    result = confusion(
        lines,
        given.trials,
        judged,
        given.seed,
        tell,
        refit=refitted,
        workers=given.workers,
        patience=PATIENCE,
        play=going_on({})
        if given.resume is None
        else going_on(read_games(given.resume, given.seed), appending(given.resume)),
    )
    return result, time.monotonic() - begun


def _compare(lines: tuple[Line, ...], given: argparse.Namespace) -> int:
    """Print McNemar's test line by line; the exit code is 2 where there is nothing to compare with."""
    if given.resume is None:
        sys.stderr.write("--compare needs the games of this side: give them with --resume\n")
        return _BAD
    here, there = (read_games(path, given.seed) for path in (given.resume, given.compare))
    rows = comparison(paired(here, there, [line.title for line in lines]))
    sys.stdout.write(f"Here: {given.resume}; there: {given.compare}.\n\n" + "\n".join(rows) + "\n")
    return 0


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of the players: more threads than cores only wait
    sys.exit(main())
