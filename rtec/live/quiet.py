"""Python's garbage collector kept out of a loop with deadlines."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

YOUNG = 0


@contextmanager
def quiet_collector() -> Iterator[None]:
    """Switch automatic collection off: present objects are frozen, and `collect_young` collects newer ones."""
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
