"""Compiled frames: how the words of the messages lie in eight bytes.

A frame is its identifier and its eight bytes as one int64, byte 0 lowest; its sign is the highest bit of byte 7, also
uncompiled, where whole numbers have no end. ``rtec.dbc`` says the same in the language of the field, and a test holds
one to the other. Byte 0 is the checksum and byte 1 the sequence counter, in every frame.
"""

from __future__ import annotations

from rtec._jit import step
from rtec.link._crc_kernels import sealed

HOLD = 0x080
SETUP = 0x100
EXPECTED = 0x140
STATUS = 0x180
REQUEST = 0x200
CORRECTIONS = 0x280
POSITION = 0x300
PROBE = 0x380
"""Identifiers: a message of axis n has n added. The lower the identifier, the sooner the bus carries it; so what
a PC expects is there before its command to go home."""
KINDS_OF_AXIS = (SETUP, EXPECTED, STATUS, REQUEST, CORRECTIONS, POSITION, PROBE)
"""All but the hold, which is for every axis."""

MOST_AXES = 15
AXIS_BITS = 0xF

# flags of a request; the first three are those of the box's state machine
LARGE_CORRECTION = 1
PROBING = 2
GO_HOME = 4
ENABLE = 8
RESET = 16
REQUESTER_SHIFT = 5

# flags of the status
SWITCH_ON = 8
IS_PROBING = 16
HOLD_WANTED = 32
AT_HOME = 64

COUNTED_BITS = 15
SETUP_BITS = 48


@step
def unsigned(payload: int, bit: int, width: int) -> int:
    """Return the unsigned field of ``width`` bits at ``bit``."""
    return (payload >> bit) & ((1 << width) - 1)


@step
def signed(payload: int, bit: int, width: int) -> int:
    """Return the two's complement field of ``width`` bits at ``bit``."""
    value = unsigned(payload, bit, width)
    return value - (1 << width) if value >> (width - 1) else value


@step
def sequence_of(payload: int) -> int:
    """Return the sequence counter of any frame."""
    return (payload >> 8) & 0xFF


@step
def pack_request(axis: int, sequence: int, total: int, flags: int, requester: int, session: int) -> int:
    """Return the payload of a request: the total twice, the second time inverted."""
    word = (sequence & 0xFF) << 8
    word |= (total & 0xFFFF) << 16
    word |= (~total & 0xFFFF) << 32
    word |= (flags & 0x1F) << 48
    word |= (requester & 7) << (48 + REQUESTER_SHIFT)
    word |= signed(session, 0, 8) << 56
    return sealed(REQUEST + axis, word)


@step
def request_total(payload: int) -> int:
    """Return the total that a request asks for."""
    return signed(payload, 16, 16)


@step
def request_agrees(payload: int) -> bool:
    """Return whether the total and its inverse say the same."""
    return unsigned(payload, 16, 16) ^ unsigned(payload, 32, 16) == 0xFFFF


@step
def request_flags(payload: int) -> int:
    """Return the five flags of a request."""
    return unsigned(payload, 48, 5)


@step
def request_requester(payload: int) -> int:
    """Return the number of the PC."""
    return unsigned(payload, 48 + REQUESTER_SHIFT, 3)


@step
def session_of(payload: int) -> int:
    """Return the session: in byte 7 of requests and probe latches."""
    return unsigned(payload, 56, 8)


@step
def pack_status(
    axis: int, sequence: int, code: int, flags: int, session: int, frames: int, requests: int, moments: int
) -> int:
    """Return the payload of a status: code, state and flags, and how many of each kind were refused so far."""
    word = (sequence & 0xFF) << 8
    word |= (code & 0xFF) << 16
    word |= (flags & 0xFF) << 24
    word |= (session & 0xFF) << 32
    word |= (frames & 0xFF) << 40
    word |= (requests & 0xFF) << 48
    word |= signed(moments, 0, 8) << 56
    return sealed(STATUS + axis, word)


@step
def status_code(payload: int) -> int:
    """Return the status or error code."""
    return unsigned(payload, 16, 8)


@step
def status_flags(payload: int) -> int:
    """Return the state, in the lowest three bits, and the flags above it."""
    return unsigned(payload, 24, 8)


@step
def status_session(payload: int) -> int:
    """Return the number of the box's present session: another one after each start."""
    return unsigned(payload, 32, 8)


@step
def pack_corrections(axis: int, sequence: int, completed: int, accepted: int, session: int, judged: int) -> int:
    """Return the payload of the corrections: both totals, and the sequence counter of the last request judged."""
    word = (sequence & 0xFF) << 8
    word |= (completed & 0xFFFF) << 16
    word |= (accepted & 0xFFFF) << 32
    word |= (session & 0xFF) << 48
    word |= signed(judged, 0, 8) << 56
    return sealed(CORRECTIONS + axis, word)


@step
def corrections_completed(payload: int) -> int:
    """Return the total inserted so far."""
    return signed(payload, 16, 16)


@step
def corrections_accepted(payload: int) -> int:
    """Return the total that the box has accepted."""
    return signed(payload, 32, 16)


@step
def corrections_session(payload: int) -> int:
    """Return the number of the box's session."""
    return unsigned(payload, 48, 8)


@step
def corrections_judged(payload: int) -> int:
    """Return the sequence counter of the request that the box judged last."""
    return unsigned(payload, 56, 8)


@step
def pack_position(axis: int, sequence: int, position: int, valid: int, counted: int) -> int:
    """Return the payload of a position: the word, Data Valid, and the counts added up, modulo 2^15."""
    word = (sequence & 0xFF) << 8
    word |= (position & 0xFFFFFFFF) << 16
    word |= (valid & 1) << 48
    word |= signed(counted, 0, COUNTED_BITS) << 49
    return sealed(POSITION + axis, word)


@step
def position_of(payload: int) -> int:
    """Return the position in counts, of a position or a probe latch."""
    return signed(payload, 16, 32)


@step
def position_valid(payload: int) -> int:
    """Return Data Valid."""
    return unsigned(payload, 48, 1)


@step
def position_counted(payload: int) -> int:
    """Return the counts since home that the box has added up, modulo 2^15."""
    return unsigned(payload, 49, COUNTED_BITS)


@step
def pack_probe(axis: int, sequence: int, position: int, trips: int, session: int) -> int:
    """Return the payload of a probe latch."""
    word = (sequence & 0xFF) << 8
    word |= (position & 0xFFFFFFFF) << 16
    word |= (trips & 0xFF) << 48
    word |= signed(session, 0, 8) << 56
    return sealed(PROBE + axis, word)


@step
def probe_trips(payload: int) -> int:
    """Return the number of trips since the start, modulo 256."""
    return unsigned(payload, 48, 8)


@step
def pack_hold(sequence: int, reason: int, axis: int) -> int:
    """Return the payload of a hold: why, and for which axis."""
    word = (sequence & 0xFF) << 8
    word |= (reason & 0xFF) << 16
    word |= (axis & 0xFF) << 24
    return sealed(HOLD, word)


@step
def pack_setup(identifier: int, sequence: int, word: int) -> int:
    """Return the payload of a setup, or of what a PC expects of one: the word of `design_cycle_step`."""
    payload = (sequence & 0xFF) << 8
    payload |= unsigned(word, 0, 40) << 16
    payload |= signed(word, 40, 8) << 56
    return sealed(identifier, payload)


@step
def setup_word(payload: int) -> int:
    """Return the word of a setup, or of what a PC expects of one."""
    return unsigned(payload, 16, SETUP_BITS)


@step
def design_cycle_step(design: int, cycle_us: int, step: int) -> int:
    """Return the word that says how a box or a PC is set up; ``step`` in 0.1 nm. It is never 0."""
    return (design & 0xF) | (cycle_us & 0xFFFFF) << 4 | (step & 0xFFFFFF) << 24
