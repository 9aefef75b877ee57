"""Compiled seam between the machine and a box whose processor runs its firmware, in place of the behavioural box.

The box is the tuple ``(board, cpu, bytes, hidden, log, queue, rest, snapshot)``. What it tells the PC is copied into
the records of the behavioural box and injector, where the PC's part of the loop and the results look for it.

At rest the firmware goes round in circles: once its registers and memory are what they were at an earlier reading,
with the same words before it, it will do the same again, and whole rounds are left out (timers that run free make a
round last as many readings as it takes for all of them to stand where they stood).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model.core._layout import BUS_AT, CYCLES, XRAM
from rtec._jit import Record, helper, step
from rtec.board._board_kernels import (
    COMPLETED,
    REFUSED,
    REQUEST_LOW,
    STATUS,
    WORDS,
    board_ask,
    board_edge,
    board_fire,
    board_run,
    board_switch,
    read_bus,
    read_ps,
    signed_word,
)
from rtec.controller._kernels import receiver_edge
from rtec.injector._monitor_kernels import observe
from rtec.link._kernels import deliver, post
from rtec.requester._box_kernels import STATUS_NOT_HOMED
from rtec.signal._kernels import NEVER

Bytes = NDArray[np.uint8]

IDLE, WANTED, TAKEN, FOUND = 0, 1, 2, 3
"""Of the search for a round: none, a snapshot is wanted, it is taken, the round is known."""
READINGS_TO_END = 4
"""Readings after which what the firmware has begun is over, and said, once the switch is open."""
STATE_BYTES = 512
"""Internal RAM, pins and registers."""

REST = np.dtype(
    [
        ("state", np.int64),
        ("cycle", np.int64),  # of the snapshot
        ("round_cycles", np.int64),
        # observation
        ("skipped_cycles", np.int64),
    ],
    align=True,
)


@step
def note_insertions(s: Record, mem: Bytes) -> None:
    """Note what the words to the PC say of insertions, in the record of the behavioural box."""
    completed = signed_word(mem, WORDS + COMPLETED, 2)
    s.inserted += abs(completed - s.completed)
    s.completed = completed
    refused = int(np.int64(mem[XRAM + WORDS + REFUSED]))
    s.refused += (refused - s.refused) & 255


@helper
def take_words(m: Record, box: Any, t_ps: int) -> None:
    """Send the words on to the PC that have become valid at ``t_ps``, and note what they say."""
    _, _, mem, h, _, _, rest, snapshot = box
    position = signed_word(mem, WORDS, 3)
    note_insertions(m.injector, mem)
    m.node.box.accepted = signed_word(mem, WORDS + COMPLETED + 2, 2)
    m.injector.requested = m.node.box.accepted
    status = int(np.int64(mem[XRAM + WORDS + STATUS]))
    if m.node.box.status == STATUS_NOT_HOMED and status != STATUS_NOT_HOMED:
        m.node.box.zero = m.encoder.count - position
    m.node.box.status = status
    m.node.box.readings += 1
    post(m.node.up, t_ps, position, m.injector.completed, m.node.box.accepted, status)
    look_for_round(rest, mem, h, snapshot)


@step
def look_for_round(rest: Record, mem: Bytes, h: NDArray[np.int64], snapshot: Bytes) -> None:
    """Compare the processor with what it was at the snapshot."""
    if rest.state == WANTED:
        for i in range(STATE_BYTES):
            snapshot[i] = mem[i]
        rest.cycle = h[CYCLES]
        rest.state = TAKEN
    elif rest.state == TAKEN:
        for i in range(STATE_BYTES):
            if mem[i] != snapshot[i]:
                return
        rest.round_cycles = h[CYCLES] - rest.cycle
        rest.state = FOUND


@step
def forget_round(box: Any) -> None:
    """Let the search for a round begin anew: something comes in between."""
    _, _, _, _, _, _, rest, _ = box
    rest.state = IDLE


@step
def skip_rounds(m: Record, box: Any, t_ps: int) -> bool:
    """Leave out the whole rounds before ``t_ps``; False where none is known yet."""
    b, _, _, h, _, _, rest, _ = box
    if rest.state == IDLE:
        rest.state = WANTED
    if rest.state != FOUND:
        return False
    rounds = rest.round_cycles * b.cycle_num
    if rounds % b.cycle_den != 0:  # a clock without whole picoseconds: so many rounds that they are whole
        rounds *= b.cycle_den
    round_ps = rounds // b.cycle_den
    times = max(t_ps - b.origin_ps - h[CYCLES] * b.cycle_num // b.cycle_den, 0) // round_ps
    b.origin_ps += times * round_ps
    turns = times * round_ps // (rest.round_cycles * b.cycle_num // b.cycle_den)
    rest.skipped_cycles += turns * rest.round_cycles
    deliver(m.node.up, t_ps)
    deliver(m.node.down, t_ps)
    return True


@step
def deliver_board(m: Record, box: Any, t_ps: int) -> None:
    """Let the receiver see what the box drives, once all events of this instant are carried out."""
    b, _, _, _, _, _, _, _ = box
    if observe(b):
        receiver_edge(m.receiver, t_ps, b.ab_out)


@step
def run_firmware(m: Record, box: Any, t_ps: int) -> None:
    """Let the firmware run up to ``t_ps`` and carry out what it changes until then.

    What it changes at ``t_ps`` itself joins what comes next there; the controller sees it by :func:`deliver_board`.
    """
    b, cpu, mem, h, log, queue, _, _ = box
    while True:
        if board_run(b, cpu, mem, h, log, queue, t_ps):
            if h[BUS_AT] >= REQUEST_LOW:
                deliver(m.node.down, read_ps(b, h))
                if m.node.down.delivered > 0:
                    board_ask(mem, m.node.down.word0, m.node.down.word1)
            read_bus(b, mem, h)
        elif b.next_ps <= t_ps:
            own_ps = b.next_ps
            published = b.published
            board_fire(b, mem, h, log)
            if own_ps < t_ps:
                deliver_board(m, box, own_ps)
            m.event_ps = max(m.event_ps, own_ps)
            if b.published > published:
                take_words(m, box, own_ps)
        else:
            m.event_ps = max(m.event_ps, min(t_ps, NEVER - 1))
            return


@step
def firmware_edge(box: Any, t_ps: int, level: int) -> None:
    """Send a transition, up to which the firmware has run, into the box."""
    b, _, mem, h, log, _, _, _ = box
    forget_round(box)
    board_edge(b, mem, h, log, t_ps, level)


@step
def words_valid(box: Any) -> bool:
    """Return whether Data Valid is high."""
    b, _, _, _, _, _, _, _ = box
    return bool(b.valid == 1)


@step
def stop_firmware(m: Record, box: Any, t_ps: int) -> None:
    """Open the switch, and let what the firmware has begun come to its end."""
    b, _, mem, h, log, _, _, _ = box
    status = m.node.box.status
    board_switch(b, mem, h, log, t_ps, 1, b.trip_n)
    run_firmware(m, box, t_ps + READINGS_TO_END * b.reading_ps)
    m.node.box.status = status  # before the switch was opened
