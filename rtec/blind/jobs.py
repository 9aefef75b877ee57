"""Games of hidden effects as jobs of a campaign."""

from __future__ import annotations

import re

from rtec.blind.answer import Rule
from rtec.blind.confusion import GameJob
from rtec.blind.judged import judged, refitted
from rtec.blind.lines import the_lines
from rtec.verify.campaign.job import FAILED, NOT_ACTIVATED, PASSED, Choice, JobKind, Parameters, Record

_LINES = {"-".join(re.findall(r"[a-z0-9]+", line.title.lower())): line for line in the_lines()}


def game(parameters: Parameters, seed: int, run: int) -> Record:
    """Play one game of a line of the confusion matrix: a trial of ``rtec blind score``, with the same answer.

    Parameters
    ----------
    parameters
        ``line``: a word.
    seed, run
        Of the plan; number of the game in its line.

    Examples
    --------
    >>> record = game({"line": "nothing-white-noise"}, seed=0, run=0)
    >>> record["result"], record["hidden"], record["outcome"]
    ('passed', 'nothing', 'NONE')
    """
    line = _LINES[str(parameters["line"])]
    refit = refitted if line.rule is Rule.FLOOR else None
    played = GameJob(line=line, trial=run, seed=seed, judge=judged, refit=refit).run()
    return {
        # weaker than what the judge says that it would find: neither right nor wrong
        "result": NOT_ACTIVATED if played.right is None else PASSED if played.right else FAILED,
        "outcome": played.said,
        "hidden": played.hidden,
        "plan": played.plan,
        "game_seed": str(played.seed),
    }


GAME = JobKind(
    does="An effect is hidden in a measurement, and the diagnosis names it or not.",
    function=f"{__name__}:game",
    parameters=(Choice(name="line", words=tuple(_LINES)),),
    by=("line",),
)
