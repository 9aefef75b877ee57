"""Compiled circuit board of the box: the processor with everything that the report draws around it.

The encoder's lines reach the gates, the decoder chip and, behind the hold latch, the processor's pins. The processor
runs ahead to the next change of the lines or to its own next change of an output, whichever comes first; it is never
stepped. Whoever drives the board calls :func:`board_run` up to the next event from outside, then :func:`board_fire`
for the output that the processor has changed, or :func:`board_edge` for a transition, in the order of their times.
Where many transitions are known beforehand, :func:`play` queues them, so that the processor takes them on its way.

The processor's loop comes as an argument, ``cpu = (execute, words, code)``: called by its address, it is compiled
once and not into every kernel of the board.

Cycle k begins at ``origin_ps + k * cycle_num / cycle_den`` and samples its pins ``sample_ps`` later; a change of a
latch comes to its pin at the beginning of a cycle.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model.core import _layout as cpu_at
from firmware_model.core._interrupt_kernels import until
from firmware_model.core._pin_kernels import set_pins
from firmware_model.core._reset_kernels import reset as reset_processor
from rtec._jit import Record, kernel, step
from rtec.controller._kernels import RECEIVER, receiver_edge, receiver_reset, receiver_settle
from rtec.injector._monitor_kernels import observe
from rtec.signal._kernels import NEVER

Bytes = NDArray[np.uint8]
Longs = NDArray[np.int64]

# bits of port 1, outputs (docs/firmware.md, "Hardware map")
DECODER_RST, HOLD = 0x40, 0x80
# of port 3: inputs, and the output NOT_VALID
ENABLE_N, NOT_VALID, CIRCUIT, TRIP_N, LINES = 0x01, 0x02, 0x04, 0x08, 0x30

# words on the external bus
DECODER_HIGH, DECODER_LOW = 0xFF00, 0xFF01
REQUEST_LOW, REQUEST_HIGH, PC_STATUS = 0xFF10, 0xFF11, 0xFF12
LARGE, PROBING, HOME = 1, 2, 4
"""Bits of the PC's status."""
WORDS = 0xFF20
# where in the words to the PC, after three bytes of position, something stands
COMPLETED, ACCEPTED, STATUS, TRIP, TRIPS, REFUSED = 3, 5, 7, 8, 11, 12

BOARD = np.dtype(
    [
        # parameters
        ("pins", np.int64),  # of port 1 that the gates hang on
        ("in_path", np.int64),  # as in the injector's record
        ("inverts", np.int64),
        ("one_state", np.int64),
        ("cycle_num", np.int64),  # a cycle lasts cycle_num / cycle_den picoseconds
        ("cycle_den", np.int64),
        ("cycles_per_ps", np.float64),
        ("sample_ps", np.int64),
        ("origin_ps", np.int64),
        ("reading_ps", np.int64),  # a reading of the PC's words comes within so long
        ("latched", np.int64),  # 1: P1.7 works the hold latch; 0: it stays open, and real edges merge with the pulses
        # state
        ("now_ps", np.int64),
        ("next_ps", np.int64),  # when the output that the processor has changed reaches its pin
        ("ab_in", np.int64),
        ("held", np.int64),
        ("holding", np.int64),
        ("port", np.int64),  # pins of port 1
        ("enable_n", np.int64),
        ("trip_n", np.int64),
        ("valid", np.int64),  # Data Valid
        ("decoder", RECEIVER),
        ("decoder_latch", np.int64),
        ("inhibited", np.int64),
        ("refused_said", np.int64),  # word of the insertions refused, when it was last looked at
        ("ab_out", np.int64),
        # observations
        ("published", np.int64),  # how often Data Valid rose
        ("published_ps", np.int64),
        ("seen_in", np.int64),  # as of the behavioural box, so that one monitor serves both
        ("seen_out", np.int64),
        ("angle", np.int64),
        ("ahead", np.int64),
        ("illegal_out", np.int64),
    ],
    align=True,
)


@step
def time_of(b: Record, cycle: int) -> int:
    """Return when a cycle begins; whole multiples of ``cycle_den`` cycles are exact, so nothing drifts."""
    return int(b.origin_ps + cycle // b.cycle_den * b.cycle_num + cycle % b.cycle_den * b.cycle_num // b.cycle_den)


@step
def cycle_that_sees(b: Record, t_ps: int) -> int:
    """Return the first cycle that samples its pins at or after ``t_ps``."""
    since_ps = t_ps - b.origin_ps - b.sample_ps
    # the product in floating point is off by one or two at most, and the rest tells; a division would cost more
    cycle = int(since_ps * b.cycles_per_ps)
    rest = since_ps * b.cycle_den - cycle * b.cycle_num
    while rest > 0:
        cycle += 1
        rest -= b.cycle_num
    while rest <= -b.cycle_num:
        cycle -= 1
        rest += b.cycle_num
    return int(cycle)


@step
def gates(b: Record) -> int:
    """Return the levels at the controller."""
    if b.in_path == 1:
        return int(b.port >> 4 & 3)
    line = b.held if b.holding == 1 else b.ab_in
    low = ~b.port & b.pins
    if b.inverts == 1:
        return int(line ^ (low & 3))
    return int((line | (low & 3)) & ~(low >> 2))


@step
def pins_at(b: Record, line: int) -> int:
    """Return the levels that the circuits put on port 3 with the lines behind the hold latch at ``line``."""
    circuit = (line | line >> 1) & 1 if b.one_state == 1 else (line ^ line >> 1) & 1
    return int(0xC2 | b.enable_n | circuit << 2 | b.trip_n << 3 | line << 4)


@step
def board_pins(b: Record, m: Bytes, h: Longs, log: Longs, cycle: int) -> None:
    """Let the processor sample the lines as they are from ``cycle`` on."""
    levels = pins_at(b, b.held if b.holding == 1 else b.ab_in)
    if levels != m[cpu_at.PINS + 3]:
        set_pins(m, h, log, 3, levels, cycle)


@step
def read_ps(b: Record, h: Longs) -> int:
    """Return when the read of the bus happens that the processor waits for: at the sampling of its first cycle."""
    return time_of(b, h[cpu_at.CYCLES]) + int(b.sample_ps)


@step
def read_bus(b: Record, m: Bytes, h: Longs) -> None:
    """Answer a read of the external bus, all transitions until then taken: the decoder's bytes, or memory."""
    address = h[cpu_at.BUS_AT]
    if address in (DECODER_HIGH, DECODER_LOW):
        receiver_settle(b.decoder, read_ps(b, h))
        if b.inhibited == 0:
            b.decoder_latch = b.decoder.count & 0xFFF if b.port & DECODER_RST else 0
        m[cpu_at.XRAM + DECODER_HIGH] = b.decoder_latch >> 8
        m[cpu_at.XRAM + DECODER_LOW] = b.decoder_latch & 255
        b.inhibited = 1 if address == DECODER_HIGH else 0
    h[cpu_at.BUS] = 2
    h[cpu_at.STOP] = cpu_at.RUNNING
    # what was due at this boundary is decided: an instruction that no interrupt may precede stays that
    h[cpu_at.DUE] = h[cpu_at.CYCLES] + 1


@step
def board_run(b: Record, cpu: Any, m: Bytes, h: Longs, log: Longs, queue: Longs, t_ps: int) -> bool:
    """Run the processor until it changes an output, or until its next instruction would see the lines at ``t_ps``.

    Returns True where it has stopped before a read of the bus, which :func:`read_bus` answers.
    """
    execute, words, code = cpu
    end = cycle_that_sees(b, t_ps)
    if b.next_ps == NEVER and h[cpu_at.CYCLES] < end and h[cpu_at.STOP] == cpu_at.RUNNING:
        until(h, queue, end)
        execute(words, code, m, h, log, queue)
        if h[cpu_at.STOP] == cpu_at.STOP_OUTPUT:
            b.next_ps = time_of(b, h[cpu_at.OUTPUT_AT])
            h[cpu_at.STOP] = cpu_at.RUNNING
        return bool(h[cpu_at.STOP] == cpu_at.STOP_BUS)
    return False


@step
def zero_decoder(b: Record, t_ps: int) -> None:
    """Let the chip's RST, which goes low or high, zero the counter and open the inhibit latch."""
    receiver_settle(b.decoder, t_ps)
    b.decoder.count = 0
    b.inhibited = 0


@step
def board_fire(b: Record, m: Bytes, h: Longs, log: Longs) -> None:
    """Let the output that the processor has changed act on the circuits."""
    t_ps = b.next_ps
    b.next_ps = NEVER
    before, b.port = b.port, int(m[cpu_at.P1])
    fell = before & ~b.port
    if (before ^ b.port) & DECODER_RST:
        zero_decoder(b, t_ps)
    if b.latched == 1 and fell & HOLD:
        b.held = b.ab_in
        b.holding = 1
    elif b.holding == 1 and b.latched == 1 and b.port & HOLD:
        b.holding = 0
        board_pins(b, m, h, log, h[cpu_at.OUTPUT_AT])
    valid = 0 if m[cpu_at.P3] & NOT_VALID else 1
    if valid > b.valid:
        b.published += 1
        b.published_ps = t_ps
    b.valid = valid
    b.ab_out = gates(b)


@step
def pass_edge(b: Record, t_ps: int, ab: int) -> None:
    """Take a transition of the encoder to ``ab`` at ``t_ps`` to the decoder chip and the gates."""
    b.ab_in = ab
    receiver_edge(b.decoder, t_ps, ab)
    b.ab_out = gates(b)


@step
def board_edge(b: Record, m: Bytes, h: Longs, log: Longs, t_ps: int, ab: int) -> None:
    """Take a transition up to which the processor has run, and let it see it."""
    pass_edge(b, t_ps, ab)
    if b.holding == 0:
        board_pins(b, m, h, log, cycle_that_sees(b, t_ps))


@kernel
def board_switch(b: Record, m: Bytes, h: Longs, log: Longs, t_ps: int, enable_n: int, trip_n: int) -> None:
    """Set the switch and the probe's line."""
    b.enable_n = enable_n
    b.trip_n = trip_n
    board_pins(b, m, h, log, cycle_that_sees(b, t_ps))


@kernel
def board_ask(m: Bytes, total: int, flags: int) -> None:
    """Let the PC put its words out: the total, two bytes, and its status."""
    m[cpu_at.XRAM + REQUEST_LOW] = total & 255
    m[cpu_at.XRAM + REQUEST_HIGH] = total >> 8 & 255
    m[cpu_at.XRAM + PC_STATUS] = flags & 255


@step
def signed_word(m: Bytes, at: int, size: int) -> int:
    """Return a signed word of the box, low byte first."""
    value = 0
    for i in range(size):
        value |= int(np.int64(m[cpu_at.XRAM + at + i])) << (8 * i)
    return int(value - ((value >> (8 * size - 1)) << (8 * size)))


@step
def board_start(b: Record, m: Bytes, h: Longs, log: Longs, t_ps: int, ab: int) -> None:
    """Power up at ``t_ps`` with the lines at ``ab``: the processor comes out of reset, its latches are high."""
    b.origin_ps = t_ps - time_of(b, h[cpu_at.CYCLES]) + b.origin_ps
    b.now_ps = t_ps
    b.next_ps = NEVER
    b.holding = 0
    if b.port & DECODER_RST == 0:
        zero_decoder(b, t_ps)
    b.port = 0xFF
    b.valid = 0
    b.ab_in = ab
    h[cpu_at.BUS] = 1
    h[cpu_at.DUE] = 0
    board_pins(b, m, h, log, h[cpu_at.CYCLES])
    b.ab_out = gates(b)


@kernel
def board_restart(b: Record, m: Bytes, h: Longs, log: Longs, t_ps: int) -> None:
    """Let the processor come out of a reset pulled at ``t_ps``; the decoder chip counts on."""
    reset_processor(m, h)
    b.refused_said = 0
    board_start(b, m, h, log, t_ps, b.ab_in)


@step
def board_lose_power(b: Record, h: Longs) -> None:
    """Let go of all outputs: the gates, fed by the controller, pass A and B on; those of Design B are dead."""
    h[cpu_at.STOP] = cpu_at.STOP_POWER_DOWN
    b.next_ps = NEVER
    b.holding = 0
    b.valid = 0
    b.port = 0xFF & ~b.pins if b.in_path == 1 else 0xFF
    b.ab_out = gates(b)


@step
def inserting(b: Record) -> bool:
    """Return whether an insertion is under way, as the outputs tell; those of Design B do not."""
    low = ~b.port & b.pins
    if b.inverts == 1:  # one of the two inverters has changed
        return bool((low ^ low >> 1) & 1)
    return bool(b.in_path == 0 and low != 0)


@kernel
def power_up(b: Record, m: Bytes, h: Longs, log: Longs, t_ps: int, ab: int) -> None:
    """Start from outside, the decoder at zero, nothing seen yet."""
    receiver_reset(b.decoder, ab)
    board_start(b, m, h, log, t_ps, ab)
    b.seen_in = ab
    b.seen_out = b.ab_out
    # Design B has no lines out yet: its angle is whatever it comes to be, and counted from there
    b.angle = ((b.ab_out ^ (b.ab_out >> 1)) - (ab ^ (ab >> 1))) & 3


@kernel
def begin_counting(b: Record) -> None:
    """Forget what was seen at the controller's side so far: whoever counts there begins now."""
    b.seen_in = b.ab_in
    b.seen_out = b.ab_out
    b.angle = ((b.ab_out ^ (b.ab_out >> 1)) - (b.ab_in ^ (b.ab_in >> 1))) & 3
    b.ahead = 0
    b.illegal_out = 0


@step
def note_output(b: Record, t_ps: int, n: int, out_ps: Longs, out_levels: Bytes) -> int:
    """Write down what the controller sees if it has changed; return the number of changes written."""
    if observe(b):
        out_ps[n] = t_ps
        out_levels[n] = b.ab_out
        return n + 1
    return n


@step
def catch_up(m: Bytes, h: Longs, log: Longs, queue: Longs, rows: int, cycle: int) -> None:
    """Apply those of the first queued changes of pins that are sampled before ``cycle`` and not met yet."""
    while h[cpu_at.CHANGE] < min(rows, h[cpu_at.CHANGES]) and queue[h[cpu_at.CHANGE], 0] < cycle:
        set_pins(m, h, log, 3, queue[h[cpu_at.CHANGE], 2], queue[h[cpu_at.CHANGE], 0])
        h[cpu_at.CHANGE] += 1


@step
def note_said(b: Record, m: Bytes, said: Longs, published: int, t_ps: int) -> None:
    """Keep what was published at ``t_ps``, if anything was since ``published``."""
    if b.published > published:
        row = published % said.shape[0]
        said[row, 0] = t_ps
        said[row, 1] = signed_word(m, WORDS + COMPLETED, 2)
        said[row, 2] = m[cpu_at.XRAM + WORDS + STATUS]


@kernel
def play(
    b: Record,
    cpu: Any,
    m: Bytes,
    h: Longs,
    log: Longs,
    times_ps: Longs,
    levels: Bytes,
    until_ps: int,
    queue: Longs,
    out_ps: Longs,
    out_levels: Bytes,
    said: Longs,
) -> tuple[int, int]:
    """Run the board over a chunk of real edges and on to just before ``until_ps``.

    ``queue`` has a row for each edge; ``said`` keeps time, completed total and message of the latest publications,
    number ``published`` in that row, modulo its length. Returns the edges taken and the changes written; it ends
    early, at ``now_ps``, where ``out_ps`` has no room for the edges left and a change of the box.
    """
    edges = times_ps.size
    for i in range(edges):
        queue[i, 0] = cycle_that_sees(b, times_ps[i])
        queue[i, 1] = 3
        queue[i, 2] = pins_at(b, int(levels[i]))
    i = 0
    if b.ab_out != b.seen_out and edges > 0 and times_ps[0] == b.now_ps:
        pass_edge(b, times_ps[0], int(levels[0]))  # at the moment of a reset: one change with it
        i = 1
    h[cpu_at.CHANGE] = 0
    h[cpu_at.CHANGES] = 0 if b.holding == 1 else edges
    h[cpu_at.DUE] = 0
    n = note_output(b, b.now_ps, 0, out_ps, out_levels)  # what a reset or a switch has changed since
    while b.now_ps < until_ps and n + edges - i < out_ps.size:
        waits = board_run(b, cpu, m, h, log, queue, until_ps)
        stop_ps = read_ps(b, h) if waits else min(b.next_ps, until_ps)
        while i < edges and (times_ps[i] < stop_ps or (waits and times_ps[i] == stop_ps)):
            pass_edge(b, times_ps[i], int(levels[i]))
            n = note_output(b, times_ps[i], n, out_ps, out_levels)
            i += 1
        b.now_ps = min(stop_ps, until_ps)
        if waits:
            read_bus(b, m, h)
        elif b.next_ps < until_ps:
            held, published = b.holding, b.published
            board_fire(b, m, h, log)
            note_said(b, m, said, published, stop_ps)
            if i < edges and times_ps[i] == stop_ps:
                pass_edge(b, stop_ps, int(levels[i]))
                i += 1
            n = note_output(b, stop_ps, n, out_ps, out_levels)
            if b.holding > held:  # the processor sees no edge until the latch opens ...
                catch_up(m, h, log, queue, i, h[cpu_at.OUTPUT_AT])
                h[cpu_at.CHANGES] = h[cpu_at.CHANGE]
                board_pins(b, m, h, log, h[cpu_at.OUTPUT_AT])
            elif b.holding < held:  # ... and from then on those to come
                board_pins(b, m, h, log, h[cpu_at.OUTPUT_AT])
                h[cpu_at.CHANGE] = i
                h[cpu_at.CHANGES] = edges
                h[cpu_at.DUE] = 0
    catch_up(m, h, log, queue, i, NEVER)
    h[cpu_at.CHANGES] = h[cpu_at.CHANGE]
    return i, n
