"""The hunt for the stream that breaks an algorithm: at random, then where the margin is smallest; then cut short."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rtec.verify.contract.contract import Contract
from rtec.verify.contract.random_streams import MOST_EVENTS, random_stream, varied
from rtec.verify.contract.shrink import shrink
from rtec.verify.contract.streams import Stream, can_be
from rtec.verify.contract.trials import Run, Trials

_NEW = 0.3
"""Share of streams drawn at random from there on."""
_KEPT = 24
_AT_ONCE = 16


def hunt(
    trials: Trials,
    *,
    tries: int = 3000,
    seed: int = 0,
    at_random: float = 0.1,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[Run | None, int]:
    """Look for a stream that breaks an algorithm.

    Parameters
    ----------
    trials
        The algorithm, with its time to settle measured.
    tries
        Runs that may be made.
    seed
        Of the random choices: the same hunt finds the same stream.
    at_random
        Share of the tries before the smallest margins lead; 1 for a hunt at random.
    progress
        Called with the share done.

    Returns
    -------
    worst
        The shortest run found that breaks the contract, or None.
    made
        Runs made on the hunt; those that cut what was found short are not counted.

    Notes
    -----
    The first tenth of the streams is drawn at random: runs at one speed up to the highest, turns, pieces of motion
    with rests between, a trembling axis; requests at times of all sizes before an edge and behind each other. After
    it, streams whose runs came near to a fault are varied, and an event moves to where something has changed at the
    controller: into the insertion, whenever the algorithm makes it. Near is what has the smallest separation, the
    longest delay, the most changes; of runs that differ in the size of these, each kind has a leader of its own.

    Examples
    --------
    Gates alone, as the report first draws them, merge a real edge with an insertion:

    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.injector import Design, InjectorSettings, Processor, Timing
    >>> box = BuiltIn(InjectorSettings(design=Design.A, timing=Timing.of(Design.A, Processor.FAST)))
    >>> trials = Trials(box, Contract.of(Design.A))
    >>> trials.measure_settling(), len(hunt(trials)[0].case.stream) <= 4
    (None, True)
    """
    rng = np.random.default_rng(seed)
    near = _Nearest(trials.contract)
    begun, made = trials.made, 0
    while made < tries:
        guided = made >= at_random * tries
        streams = [
            near.pick(trials, rng) if guided and near.runs else random_stream(trials, rng) for _ in range(_AT_ONCE)
        ]
        cases = [trials.case("a stream of the hunt", stream) for stream in streams if can_be(stream, trials.contract)]
        made += _AT_ONCE
        for run in trials.all_of(cases):
            if not run.right:
                worst, cut = shrink(trials, run)
                return worst, trials.made - begun - cut
            near.take(run)
        progress(made / tries)
    return None, trials.made - begun


class _Nearest:
    """Runs that came nearest to a fault, of each kind one."""

    def __init__(self, contract: Contract) -> None:
        self.contract = contract
        self.runs: dict[tuple[int, ...], tuple[float, Run]] = {}

    def take(self, run: Run) -> None:
        """Take a run if none of its kind came nearer."""
        seen = run.judgement
        kind = _size(seen.separation_ps), _size(seen.pulse_ps), _size(seen.delay_ps), min(abs(seen.completed), 2)
        score = _score(run, self.contract)
        if kind not in self.runs or score < self.runs[kind][0]:
            self.runs[kind] = score, run

    def pick(self, trials: Trials, rng: np.random.Generator) -> Stream:
        """Return a stream near one of them, half the time of the nearest; now and then a new one."""
        if rng.random() < _NEW:
            return random_stream(trials, rng)
        ranked = sorted(self.runs.values(), key=lambda pair: pair[0])
        some = ranked[:_KEPT] if rng.random() < 0.5 else ranked
        return varied(some[int(rng.integers(len(some)))][1], trials, rng)


def _size(time_ps: int | None) -> int:
    """Return a time's order of magnitude, in powers of two."""
    return -1 if time_ps is None else int(time_ps).bit_length()


def _score(run: Run, contract: Contract) -> float:
    """Return how far a run is from a fault, the smaller the nearer."""
    seen = run.judgement
    apart = 10.0 if seen.separation_ps is None else seen.separation_ps / max(contract.separation_ps, 1)
    behind = seen.delay_ps / contract.delay_ps
    return apart - behind - 0.01 * min(len(run.response.edges), MOST_EVENTS)
