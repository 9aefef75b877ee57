"""Python's collector of garbage kept out of the way of a loop that has to be on time."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

YOUNG = 0


@contextmanager
def quiet_collector() -> Iterator[None]:
    """Let the collector rest: what is there now is never looked at again, and `collect_young` takes the rest."""
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


def collect_young() -> None:
    """Collect what was made since the last time: below a millisecond where that is little."""
    gc.collect(YOUNG)
