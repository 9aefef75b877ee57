"""Changes of a processor's pins, queued for its loop as a driver in compiled code queues them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from firmware_model import Mcs51
from firmware_model.core import _layout as at


def drive(cpu: Mcs51, cycles: ArrayLike, ports: ArrayLike, levels: ArrayLike) -> None:
    """Queue changes of pins: the cycle in which each is first sampled, ascending, its port and the eight levels."""
    rows = np.column_stack([np.atleast_1d(np.asarray(column, dtype=np.int64)) for column in (cycles, ports, levels)])
    waiting = cpu._changes[int(cpu._hidden[at.CHANGE]) :]
    cpu._changes = np.ascontiguousarray(np.concatenate([waiting, rows]))
    cpu._hidden[at.CHANGE] = 0
    cpu._hidden[at.CHANGES] = len(cpu._changes)
