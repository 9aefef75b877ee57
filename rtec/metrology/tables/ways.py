"""What no word tells and the order of the targets does: which of two names is forward, and what counts the runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtec.metrology.readings import Floats
from rtec.metrology.tables.words import plain_words

_NUMBERS = frozenset("nr no n num number nummer messung measurement meas set series".split())


def ways_by_motion(names: Sequence[str], target: Floats, run: Floats) -> dict[str, int] | None:
    """Return the direction that each of two names stands for, or None where the targets do not tell.

    +1 for the name under which all targets of a run ascend, one after the other, −1 for the other. Names, targets and
    runs are those of the readings in their order.

    Examples
    --------
    >>> ways_by_motion(["A", "A", "B", "B"], np.array([0.0, 9, 9, 0]), np.ones(4))
    {'A': 1, 'B': -1}
    >>> ways_by_motion(["A", "B", "A", "B"], np.array([0.0, 0, 9, 9]), np.ones(4)) is None
    True
    """
    found: dict[str, set[int]] = {name: set() for name in names}
    if len(found) != 2:
        return None
    steps = np.sign(np.diff(target)).astype(int).tolist()
    same_run = (np.diff(run) == 0).tolist()
    for before, after, step, same in zip(names, names[1:], steps, same_run, strict=False):
        if before == after and same and step:
            found[after].add(step)
    told = {name: next(iter(steps)) for name, steps in found.items() if len(steps) == 1}
    return told if sorted(told.values()) == [-1, 1] else None


def counts_runs(heading: str, numbers: Floats, target: Floats) -> bool:
    """Return whether a column that is called a number counts runs: up from run to run, with several targets in each.

    ``Nr.`` may number the rows, the targets or the runs; numbers and targets have the shape (rows,), in order.

    Examples
    --------
    >>> target = np.array([0.0, 9, 0, 9])
    >>> counts_runs("Nr.", np.array([1.0, 1, 2, 2]), target), counts_runs("Nr.", np.array([1.0, 2, 3, 4]), target)
    (True, False)
    """
    if not (set(plain_words(heading)) <= _NUMBERS and (np.diff(numbers) >= 0).all() and np.ptp(numbers) > 0):
        return False
    runs = [target[numbers == one] for one in np.unique(numbers)]
    return bool((numbers == np.round(numbers)).all()) and all(np.ptp(places) > 0 for places in runs)
