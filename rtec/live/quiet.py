"""Python's garbage collector kept out of a loop with deadlines."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

from rtec.units import PS_PER_MS, PS_PER_S

YOUNG = 0
POLL_PS = 20 * PS_PER_MS


@contextmanager
def quiet_collector() -> Iterator[None]:
    """Switch automatic collection off: present objects are frozen, and a `Pace` collects newer ones."""
    was_on = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.unfreeze()
        if was_on:
            gc.enable()


class Pace:
    """When a loop with deadlines attends to all else: every 20 ms; and once a second it collects what is new.

    Parameters
    ----------
    begin_ps
        The first time of both, on the clock of the bus.
    """

    def __init__(self, begin_ps: int) -> None:
        self._poll_ps = self._tidy_ps = begin_ps

    def polls(self, now_ps: int) -> bool:
        """Return whether it is time to poll."""
        if now_ps >= self._tidy_ps:
            self._tidy_ps = now_ps + PS_PER_S
            gc.collect(YOUNG)  # below a millisecond where little was made
        if now_ps < self._poll_ps:
            return False
        self._poll_ps = now_ps + POLL_PS
        return True
