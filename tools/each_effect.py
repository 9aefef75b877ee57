"""Hide each effect alone, three times the noise, on a plan that suits it, and count how often it is named.

Example::

    python -m tools.each_effect --games 200 --workers 2 -o docs/each-effect.md
    python -m tools.each_effect --games 40 --only gravity
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from rtec.blind.answer import Rule
from rtec.blind.confusion import confusion
from rtec.blind.judged import judged
from rtec.blind.line import Line
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.blind.scored import LineScore

STRENGTH = 3.0
BAR = 0.95
SUITED = {
    "thermal_growth": "temperature",
    "thermal_shift": "temperature",
    "warm_up_growth": "base",
    "run_offset": "base",
    "backlash_map": "right_forward",
    "reversal_spike": "dense",
    "windup": "dense",
    "hysteresis": "moving",
    "refraction": "weather",
    "dead_path": "weather",
    "eccentricity": "turn",
    "gravity": "joint",
    "force_map": "drive",
    "load_friction": "loads",
    "coulomb": "soft_drive",
}
"""Effects that other makers' measurements asked for, and forms of older ones, by the plan that suits them."""
_BELOW = 1

HEAD = """\
# Each newer effect on a plan that suits it

Written by `python -m tools.each_effect --games {games} -o docs/each-effect.md`. Each game hides one effect
in the emulated axis as physics, its contribution three times the noise, and asks `rtec diagnose`. Right: it is named,
and nothing else is. The plans stand in `rtec/blind/plan.py`; on plans that do not suit, the same effects are played
in [twice round the loop](rounds.md) and in the lines of look-alikes of [what the diagnosis finds](confusion.md).

| effect | plan | right | 95 % interval | answered otherwise |
|---|---|---|---|---|
"""


def line_of(name: str) -> Line:
    """Return the line of an effect."""
    scenario = Scenario(names=(name,), strength_sigma=STRENGTH, plan=PLANS[SUITED[name]])
    return Line(title=name, rule=Rule.NAMED, share=BAR, scenarios=(scenario,))


def row_of(name: str, score: LineScore) -> str:
    """Return an effect's row of the page."""
    low, high = score.interval
    wrong = [said for hidden, said, _ in score.cells if said != hidden]
    counts = [f"{said} {count}" for hidden, said, count in score.cells if said in wrong]
    share = f"{score.right} of {score.trials} ({score.share:.1%})"
    return f"| `{name}` | {SUITED[name]} | {share} | {low:.1%} to {high:.1%} | {', '.join(counts)} |"


def main(arguments: list[str] | None = None) -> int:
    """Play and write the page; 1 where an effect stays below its bar."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=200, help="of each effect")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", choices=tuple(SUITED), action="append", help="this effect; may be repeated")
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
    given = parser.parse_args(arguments)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    rows, reached = [], True
    for name in given.only or SUITED:
        (score,) = confusion([line_of(name)], given.games, judged, workers=given.workers).scores
        rows.append(row_of(name, score))
        reached &= score.share >= BAR
        sys.stderr.write(rows[-1] + "\n")
    page = HEAD.format(games=given.games) + "\n".join(rows) + "\n"
    if given.output is None:
        sys.stdout.write(page)
    else:
        given.output.write_text(page, encoding="utf-8")
    return 0 if reached else _BELOW


if __name__ == "__main__":
    sys.exit(main())
