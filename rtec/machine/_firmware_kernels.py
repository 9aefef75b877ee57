"""Compiled seam between the machine and a box whose processor runs its firmware, in place of the behavioural box.

The box is the tuple ``(board, cpu, bytes, hidden, log, queue, rest, snapshot)``; kernels of axes have it as a pair,
with :func:`run_firmware` compiled for their record and called by its address. What it tells the PC is copied into
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
from rtec._jit import Record, helper, kernel
from rtec.board._board_kernels import (
    ACCEPTED,
    COMPLETED,
    REFUSED,
    REQUEST_LOW,
    STATUS,
    TRIP,
    TRIPS,
    WORDS,
    board_ask,
    board_edge,
    board_fire,
    board_lose_power,
    board_restart,
    board_run,
    board_switch,
    inserting,
    read_bus,
    read_ps,
    signed_word,
)
from rtec.controller._kernels import receiver_edge
from rtec.injector._monitor_kernels import observe
from rtec.link._bus_kernels import NO_FAULT
from rtec.link._kernels import deliver, mailbox_reset, post
from rtec.machine._recorder_kernels import keep
from rtec.requester._box_kernels import FATAL, NOT_HOMED, STATUS_NOT_HOMED, take_answer
from rtec.signal._kernels import NEVER

Bytes = NDArray[np.uint8]

IDLE, WANTED, TAKEN, FOUND = 0, 1, 2, 3
"""Of the search for a round: none, a snapshot is wanted, it is taken, the round is known."""
READINGS_TO_END = 4
"""Readings after which what the firmware has begun is over, and said, once the switch is open."""
TRIP_PS = 100_000_000
"""How long the probe's line stays low, at least."""
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


@helper
def note_insertions(s: Record, b: Record, mem: Bytes) -> None:
    """Note what the words to the PC say of insertions, in the record of the behavioural box."""
    completed = signed_word(mem, WORDS + COMPLETED, 2)
    s.inserted += abs(completed - s.completed)
    s.completed = completed
    refused = int(np.int64(mem[XRAM + WORDS + REFUSED]))
    s.refused += (refused - b.refused_said) & 255
    b.refused_said = refused


@helper
def take_words(m: Record, box: Any, t_ps: int) -> None:
    """Send the words on to the PC that have become valid at ``t_ps``, and note what they say."""
    b, _, mem, h, _, _, rest, snapshot = box
    position = signed_word(mem, WORDS, 3)
    n = m.node
    note_insertions(m.injector, b, mem)
    not_homed = n.box.status == STATUS_NOT_HOMED
    take_answer(
        n.box,
        signed_word(mem, WORDS + ACCEPTED, 2),
        int(np.int64(mem[XRAM + WORDS + STATUS])),
        signed_word(mem, WORDS + TRIP, 3),
        int(np.int64(mem[XRAM + WORDS + TRIPS])),
    )
    if not_homed and n.box.status != STATUS_NOT_HOMED:
        n.box.zero = m.box_count - position
    m.injector.requested = n.box.accepted
    post(n.up, t_ps, position, m.injector.completed, n.box.accepted, n.box.status)
    look_for_round(rest, mem, h, snapshot)


@helper
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


@helper
def reset_idle_loop(box: Any) -> None:
    """Let the search for a round begin anew: something comes in between."""
    _, _, _, _, _, _, rest, _ = box
    rest.state = IDLE


@helper
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


@helper
def deliver_board(m: Record, box: Any, t_ps: int) -> None:
    """Let the receiver see what the box drives, once all events of this instant are carried out."""
    b, _, _, _, _, _, _, _ = box
    m.injector.ab_out = b.ab_out
    if observe(b):
        receiver_edge(m.receiver, t_ps, b.ab_out)
    m.injector.ahead = b.ahead


@kernel
def run_firmware(m: Record, box: Any, t_ps: int) -> bool:
    """Let the firmware run up to ``t_ps`` and carry out what it changes until then.

    What it changes at ``t_ps`` itself joins what comes next there; the controller sees it by :func:`deliver_board`.
    Returns True, at ``event_ps``, where an insertion has begun for which a fault waits.
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
            published, before = b.published, inserting(b)
            board_fire(b, mem, h, log)
            ended = before and not inserting(b)
            if own_ps < t_ps:
                deliver_board(m, box, own_ps)
            m.event_ps = max(m.event_ps, own_ps)
            if b.published > published:
                inserted = m.injector.inserted
                take_words(m, box, own_ps)
                ended = b.in_path == 1 and m.injector.inserted > inserted  # its outputs do not tell
            if m.keeps == 1:
                keep(m, own_ps, ended)
            if m.pending.kind != NO_FAULT and inserting(b):
                return True
        else:
            m.event_ps = max(m.event_ps, min(t_ps, NEVER - 1))
            return False


@helper
def restart_firmware(m: Record, box: Any, t_ps: int) -> None:
    """Let the processor start again, with nothing asked of it and nothing inserted."""
    b, _, mem, h, log, _, _, _ = box
    reset_idle_loop(box)
    board_restart(b, mem, h, log, t_ps)
    board_ask(mem, 0, 0)
    m.injector.completed = 0
    m.injector.requested = 0


@helper
def power_firmware(m: Record, box: Any, t_ps: int, on: int) -> None:
    """Take the processor's power away or give it back."""
    b, _, _, h, _, _, _, _ = box
    if on == 1:
        restart_firmware(m, box, t_ps)
    else:
        reset_idle_loop(box)
        board_lose_power(b, h)


@helper
def set_inputs(m: Record, box: Any, t_ps: int) -> None:
    """Put switch and probe's line as they are now.

    A trip pulls the line low for long enough that any program sees it. A node that has stopped for good keeps the
    switch in front of the firmware open.
    """
    b, _, mem, h, log, _, _, _ = box
    enable_n = 0 if m.node.box.switch_on == 1 and m.node.box.state != FATAL else 1
    trip_n = 0 if t_ps - m.trip_ps < TRIP_PS else 1
    if enable_n != b.enable_n or trip_n != b.trip_n:
        reset_idle_loop(box)
        board_switch(b, mem, h, log, t_ps, enable_n, trip_n)


@helper
def turn_firmware(m: Record, box: Any, t_ps: int) -> None:
    """Let the box's node, between bus and firmware, see to what the firmware does not.

    It takes back a home command that the axis has left, and resets a processor that the operator has asked to start
    again.
    """
    mem = box[2]
    n = m.node
    n.box.next_ps += n.box.period_ps
    if n.resets != m.resets:
        m.resets = n.resets
        restart_firmware(m, box, t_ps)
    if n.box.state == NOT_HOMED and n.at_home == 0:
        mailbox_reset(n.down)
        board_ask(mem, 0, 0)
    set_inputs(m, box, t_ps)


@helper
def zero_firmware(box: Any) -> None:
    """Zero the count by which the lines have gone ahead: the axis stands at home."""
    b, _, _, _, _, _, _, _ = box
    b.ahead = 0


@helper
def firmware_edge(box: Any, t_ps: int, level: int) -> None:
    """Send a transition, up to which the firmware has run, into the box."""
    b, _, mem, h, log, _, _, _ = box
    reset_idle_loop(box)
    board_edge(b, mem, h, log, t_ps, level)


@helper
def words_valid(box: Any) -> bool:
    """Return whether Data Valid is high."""
    b, _, _, _, _, _, _, _ = box
    return bool(b.valid == 1)


@helper
def stop_firmware(m: Record, pair: Any, t_ps: int) -> None:
    """Open the switch, and let what the firmware has begun come to its end."""
    box, run = pair
    b, _, mem, h, log, _, _, _ = box
    status = m.node.box.status
    board_switch(b, mem, h, log, t_ps, 1, b.trip_n)
    run(m, box, t_ps + READINGS_TO_END * b.reading_ps)
    m.node.box.status = status  # before the switch was opened
