"""Play the hidden-effect game many times on every line that is published, and print docs/confusion.md.

Every game is appended to the file of ``--resume`` as it ends: the same command goes on where it was stopped.

Example::

    python -m tests.recovery.confusion --trials 200 --resume games.jsonl -o docs/confusion.md
    python -m tests.recovery.confusion --trials 6 --only 0 --only 7
    python -m tests.recovery.confusion --resume games.jsonl --compare before.jsonl
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

from rtec.blind import (
    Confusion,
    Line,
    LineScore,
    appending,
    comparison,
    confusion,
    evidence,
    paired,
    read_games,
    the_lines,
)
from rtec.blind.judged import judged, refitted
from rtec.errors import RtecError

TRIALS = 200
PATIENCE = 4
"""Where games can be too weak to count, so many times the trials are played until as many count as are asked for."""
WORKERS = 2
_MOST_MISSES = 12
_BELOW, _BAD = 1, 2

HEAD = """\
# What the diagnosis finds, and what it does not

Written by `python -m tests.recovery.confusion --trials {trials}{seed} -o docs/confusion.md`. The games are those of
`rtec blind score`: the emulated axis, with its closed loop, encoder and measuring program, is measured with something
hidden in it, and `rtec diagnose` is asked what it is, without being told anything else. What is hidden is made as
physics (`rtec/blind`), not from the columns that the diagnosis fits.

The base plan has 5 bidirectional runs of 21 targets, 300 mm long and not commensurate with any period; repeat noise
of 2 µm standard deviation; a time column. Effects that this plan cannot show have their own: wind-up targets close to
the reversals, thermal growth runs that are cold and hot by turns, lags a log in motion. Strength is the RMS
contribution of an effect over the readings, its mean removed, in units of the repeat noise. "Correlated" is noise
correlated at 0.9 from reading to reading. "Above the detectable amplitude": the game counts where the effect is at
least as strong as the amplitude that the diagnosis itself prints as detectable there; weaker games are played, are
counted apart, and are replaced by further ones.

"Drawn plans" differ from game to game: 11 to 161 targets, 1 to 5 runs, in one direction or both, 150 to 600 mm, even
or dense after the reversals, repeat noise of 1 to 4 µm. "With repeats": 21 targets or more in 2 to 5 runs, in both
directions. Waves in them have five cycles or more in the span. The families of noise are those of
`rtec/blind/noise.py`: white, correlated, random walk, correlated by place, by seconds, offsets per run, Student's t
with three degrees of freedom, a level that changes; all but the first two are none that the diagnosis assumes. Noise
correlated by place is played with two runs or more: in a single run it is a map of position, and nothing tells them
apart; a line without a bar shows what is said there. What lies outside the library is made by physics of its own
(`rtec/blind/outside*.py`). A wave of fewer than five cycles whose period nobody stated is right as UNKNOWN or
INCONCLUSIVE, too. Drives are logs of a force with inertia, friction, cogging and weight, at several speeds
both ways.

"Right" is strict: all that was hidden is named, nothing else is, and the verdict is the one asked for; where a plan
repeats nothing, LIKELY is as good as NAMED. A name is wrong where an effect that was not hidden is accepted under
NAMED, LIKELY or TIED, an offset aside, and an offset of each run where that is the noise. Lines without a bar are
shown, not judged.
"""

TAIL = """\

## Games that went wrong

Each can be played again: `rtec.blind.play(line.scenario(trial, seed), seed)` with its line of
`rtec.blind.the_lines()`, this trial and this seed. At most {most} of a line are listed.

"""


def page(result: Confusion, *, seconds: float) -> str:
    """Return the page as markdown."""
    seed = "" if result.seed == 0 else f" --seed {result.seed}"
    parts = [HEAD.format(trials=result.trials, seed=seed), "\n", result.as_markdown(), "\n"]
    parts += ["\n".join(evidence(result.games)), "\n", TAIL.format(most=_MOST_MISSES)]
    parts += [_misses(score) for score in result.scores]
    processor = f"{seconds / 60.0:.0f} minutes" if seconds >= 120.0 else f"{seconds:.0f} seconds"
    return "".join(parts) + f"\nPlayed in {processor}.\n"


def _misses(score: LineScore) -> str:
    missed = [game for game in score.games if game.right is False]
    if not missed:
        return ""
    rows = [f"**{score.line.title}**: {len(missed)} of {score.trials}", ""]
    rows += ["| trial | seed | plan | hidden | answered | named |", "|---|---|---|---|---|---|"]
    rows += [
        f"| {game.trial} | {game.seed} | {game.plan} | {game.hidden} | {game.said} "
        f"| {' + '.join(sorted(game.effects))} |"
        for game in missed[:_MOST_MISSES]
    ]
    return "\n".join(rows) + "\n\n"


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
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
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
        known={} if given.resume is None else read_games(given.resume, given.seed),
        record=None if given.resume is None else appending(given.resume),
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
