"""A captured stream as runs of any algorithm: cases for the suite."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np

from rtec.signal import states_of_levels
from rtec.signal.captures import Capture
from rtec.units import PS_PER_S
from rtec.verify.contract.cases import GOLDEN
from rtec.verify.contract.streams import Stream
from rtec.verify.contract.trials import Case, Trials

_MOST_EDGES = 400_000
"""Played all in all: a capture that is longer is played a few times only."""
_MOST_MOMENTS, _FEWEST_MOMENTS = 24, 2


def captured_stream(capture: Capture) -> Stream:
    """Return the edges of a capture, at their measured times from its first sample on, with nothing asked for.

    Raises
    ------
    FileFormatError
        Both lines change at once somewhere.

    Examples
    --------
    >>> from pathlib import Path
    >>> from rtec.signal import EdgeStream
    >>> edges = EdgeStream([1_000_000, 1_620_000], [3, 1], initial=1)
    >>> print(captured_stream(Capture(path=Path("scope.csv"), edges=edges, end_ps=3_000_000)))
    10 1us:+ 1.62us:- 3us:end
    """
    none = np.zeros(0, np.int64)
    return Stream(
        state=int(states_of_levels([capture.edges.initial])[0]),
        edges_ps=capture.edges.times_ps,
        moves=capture.moves,
        requests_ps=none,
        totals=none,
        until_ps=capture.end_ps,
    )


def captured_cases(stream: Stream) -> Callable[[Trials], Iterator[Case]]:
    """Return what makes the runs of a captured stream for an algorithm whose time to settle is known.

    Parameters
    ----------
    stream
        Of `captured_stream`. It is played with nothing asked for, then with one step of each sign at moments spread
        over it.

    Examples
    --------
    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.verify.contract.contract import Contract
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> trials = Trials(BuiltIn(InjectorSettings(design=Design.C, timing=Timing())), Contract.of(Design.C))
    >>> stream = Stream.read("00 1ms:+ 3ms:+ 4ms:- 9ms:end")
    >>> trials.measure_settling(), trials.first_wrong(captured_cases(stream)(trials))
    (None, (None, 49))
    """

    def make(trials: Trials) -> Iterator[Case]:
        yield trials.case("the capture, nothing asked for", stream)
        room = _MOST_EDGES // (2 * stream.edges_ps.size)
        for i, sign in product(range(int(np.clip(room, _FEWEST_MOMENTS, _MOST_MOMENTS))), (1, -1)):
            asked_ps = max(round((0.5 + i * GOLDEN) % 1.0 * stream.until_ps), 1)
            title = f"{sign:+d} step {asked_ps / PS_PER_S:.9g} s into the capture"
            yield trials.case(title, stream.asking((asked_ps, sign)))

    return make
