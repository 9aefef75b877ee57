"""Play look-alikes twice round the loop: a poor plan, the experiment suggested, and the same axis measured by it.

Example::

    python -m tests.recovery.rounds --games 200 --workers 2
    python -m tests.recovery.rounds --games 40 --only 3 -o docs/rounds.md
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from rtec.blind.rounds import Pair, Rounds, played, rows, the_pairs
from rtec.report.rendering import markdown_page

BAR = 0.95
_BELOW = 1

TEMPLATE = Path(__file__).with_name("rounds.md.j2")


def page(results: list[tuple[Pair, tuple[Rounds, ...]]], games: int, seed: int) -> str:
    """Return the page as Markdown, with the games that did not go through."""
    missed = [one for _, of_pair in results for one in of_pair if not one.solved]
    return markdown_page(
        TEMPLATE,
        games=games,
        seed=f" --seed {seed}" if seed else "",
        pairs="\n".join(rows(results)),
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
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
    given = parser.parse_args()
    pairs = the_pairs() if given.only is None else [the_pairs()[number] for number in given.only]
    results = []
    for pair in pairs:
        results.append((pair, played(pair, given.games, given.seed, workers=given.workers)))
        sys.stderr.write(rows(results)[-1] + "\n")
    text = page(results, given.games, given.seed)
    if given.output is None:
        sys.stdout.write(text)
    else:
        given.output.write_text(text, encoding="utf-8")
    reached = all(sum(one.solved for one in games) >= BAR * len(games) for _, games in results)
    return 0 if reached else _BELOW


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of the players: more threads than cores only wait
    sys.exit(main())
