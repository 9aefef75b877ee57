"""The hunt for the stream that breaks an algorithm: at random, and around what random streams do; then cut short."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtec.verify.contract.random_streams import random_stream, varied
from rtec.verify.contract.shrink import shrink
from rtec.verify.contract.streams import can_be
from rtec.verify.contract.trials import Run, Trials

_VARIED = 0.5
"""Share of streams that vary one of the runs before."""
_AT_ONCE = 16


def hunt(
    trials: Trials,
    *,
    tries: int = 3000,
    seed: int = 0,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[Run | None, int]:
    """Look for a stream that breaks an algorithm.

    Returns
    -------
    worst
        The shortest run found that breaks the contract, or None; with the same seed the same.
    made
        Runs made on the hunt, ``tries`` at most; those that cut what was found short are not counted.

    Notes
    -----
    Half of the streams are drawn at random: runs at one speed up to the highest, turns, pieces of motion with rests
    between, a trembling axis; requests at times of all sizes before an edge and behind each other. The other half
    varies one of the runs just made: an event moves to where something has changed at the controller, into the
    insertion, whenever the algorithm makes it. Chains of such variations lead further from what is drawn.

    Examples
    --------
    Gates alone, as the report first draws them, merge a real edge with an insertion:

    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.verify.contract.contract import Contract
    >>> from rtec.injector import Design, InjectorSettings, Processor, Timing
    >>> box = BuiltIn(InjectorSettings(design=Design.A, timing=Timing.of(Design.A, Processor.FAST)))
    >>> trials = Trials(box, Contract.of(Design.A))
    >>> trials.measure_settling(), len(hunt(trials)[0].case.stream) <= 4
    (None, True)
    """
    rng = np.random.default_rng(seed)
    begun, made = trials.made, 0
    before: list[Run] = []
    while made < tries:
        streams = [
            varied(before[int(rng.integers(len(before)))], trials, rng)
            if before and rng.random() < _VARIED
            else random_stream(trials, rng)
            for _ in range(_AT_ONCE)
        ]
        cases = [trials.case("a stream of the hunt", stream) for stream in streams if can_be(stream, trials.contract)]
        made += _AT_ONCE
        before = trials.all_of(cases)
        for run in before:
            if not run.right:
                worst, cut = shrink(trials, run)
                return worst, trials.made - begun - cut
        progress(made / tries)
    return None, trials.made - begun
