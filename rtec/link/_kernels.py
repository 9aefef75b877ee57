"""Compiled parts of the link: a mailbox that delivers messages of five words after a fixed latency, in order."""

from __future__ import annotations

import numpy as np

from rtec._jit import Record, helper, step
from rtec.signal._kernels import NEVER

SLOTS = 16
"""Messages that may be under way at once; the face keeps the latency below this many periods of the sender."""

MAILBOX = np.dtype(
    [
        ("latency_ps", np.int64),
        ("first", np.int64),
        ("waiting", np.int64),
        ("arrives_ps", np.int64, (SLOTS,)),
        ("w0", np.int64, (SLOTS,)),
        ("w1", np.int64, (SLOTS,)),
        ("w2", np.int64, (SLOTS,)),
        ("w3", np.int64, (SLOTS,)),
        # the message delivered last, and when
        ("delivered", np.int64),
        ("delivered_ps", np.int64),
        ("word0", np.int64),
        ("word1", np.int64),
        ("word2", np.int64),
        ("word3", np.int64),
        ("lost", np.int64),  # messages that found no slot
    ],
    align=True,
)


@step
def deliver(m: Record, t_ps: int) -> None:
    """Deliver what has arrived by ``t_ps``; the latest message stands in ``word0`` .. ``word3``."""
    while m.waiting > 0 and m.arrives_ps[m.first] <= t_ps:
        slot = m.first
        m.word0 = m.w0[slot]
        m.word1 = m.w1[slot]
        m.word2 = m.w2[slot]
        m.word3 = m.w3[slot]
        m.delivered += 1
        m.delivered_ps = m.arrives_ps[slot]
        m.first = (slot + 1) % SLOTS
        m.waiting -= 1


@step
def post(m: Record, t_ps: int, w0: int, w1: int, w2: int, w3: int) -> None:
    """Send a message at ``t_ps``."""
    if m.waiting == SLOTS:
        deliver(m, t_ps)  # a message that has arrived frees its slot, read or not
    if m.waiting == SLOTS:
        m.lost += 1
        return
    slot = (m.first + m.waiting) % SLOTS
    m.arrives_ps[slot] = t_ps + m.latency_ps
    m.w0[slot] = w0
    m.w1[slot] = w1
    m.w2[slot] = w2
    m.w3[slot] = w3
    m.waiting += 1


@helper
def mailbox_reset(m: Record) -> None:
    """Empty the mailbox."""
    m.first = 0
    m.waiting = 0
    m.delivered = 0
    m.delivered_ps = -NEVER
    m.lost = 0
