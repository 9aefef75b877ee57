"""Play the hidden-effect game many times on every line that is published, and print docs/confusion.md.

Example::

    python -m tests.recovery.confusion --trials 200 -o docs/confusion.md
    python -m tests.recovery.confusion --trials 6 --only 0 --only 7
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

from rtec.blind import Confusion, LineScore, confusion, the_lines
from rtec.blind.judged import judged, refitted

TRIALS = 200
PATIENCE = 4
"""Where games can be too weak to count, so many times the trials are played until as many count as are asked for."""
WORKERS = 2
_MOST_MISSES = 12

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

"Right" is strict: all that was hidden is named, nothing else is, and the verdict is the one asked for.
"""

TAIL = """\

## Games that went wrong

Each can be played again: `rtec.blind.play(scenario, seed)` with the scenario of its line and this seed. At most
{most} of a line are listed.

"""


def page(result: Confusion, *, seconds: float) -> str:
    """Return the page as markdown."""
    seed = "" if result.seed == 0 else f" --seed {result.seed}"
    parts = [HEAD.format(trials=result.trials, seed=seed), "\n", result.as_markdown(), TAIL.format(most=_MOST_MISSES)]
    parts += [_misses(score) for score in result.scores]
    processor = f"{seconds / 60.0:.0f} minutes" if seconds >= 120.0 else f"{seconds:.0f} seconds"
    return "".join(parts) + f"\nPlayed in {processor}.\n"


def _misses(score: LineScore) -> str:
    missed = [game for game in score.games if game.right is False]
    if not missed:
        return ""
    rows = [f"**{score.line.title}**: {len(missed)} of {score.trials}", ""]
    rows += ["| seed | plan | hidden | answered | named |", "|---|---|---|---|---|"]
    rows += [
        f"| {game.seed} | {game.plan} | {game.hidden} | {game.said} | {' + '.join(sorted(game.effects))} |"
        for game in missed[:_MOST_MISSES]
    ]
    return "\n".join(rows) + "\n\n"


def main() -> int:
    """Play, and write the page; the exit code is 1 where a line lies below its bar."""
    parser = argparse.ArgumentParser(description="Regenerate the confusion matrix of docs/confusion.md.")
    parser.add_argument("--trials", type=int, default=TRIALS, help="games that count on each line")
    parser.add_argument("--seed", type=int, default=0, help="of all games")
    parser.add_argument(
        "--only", type=int, action="append", help="number of a line, from 0; may be given several times"
    )
    parser.add_argument("--workers", type=int, default=WORKERS, help="processes that play at the same time")
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
    given = parser.parse_args()
    lines = the_lines() if given.only is None else [the_lines()[number] for number in given.only]
    begun = time.monotonic()
    last: list[str] = []

    def tell(title: str, share: float) -> None:
        if title not in last:
            last.append(title)
            sys.stderr.write(f"{time.monotonic() - begun:6.0f} s  {title}\n")

    result = confusion(
        lines, given.trials, judged, given.seed, tell, refit=refitted, workers=given.workers, patience=PATIENCE
    )
    text = page(result, seconds=time.monotonic() - begun)
    if given.output is None:
        sys.stdout.write(text)
    else:
        given.output.write_text(text)
    return 0 if all(score.reached for score in result.scores) else 1


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of the players: more threads than cores only wait
    sys.exit(main())
