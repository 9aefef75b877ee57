"""Compiled frames: how the words of the messages lie in eight bytes.

A frame is its identifier and its eight bytes as one int64, byte 0 lowest; its sign is the highest bit of byte 7, also
uncompiled, where whole numbers have no end. ``rtec.dbc`` says the same in the language of the field, and a test holds
one to the other. Byte 0 is the checksum and byte 1 the sequence counter, in every frame.
"""

from __future__ import annotations

from rtec._jit import helper
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

PAYLOAD_BITS = 64

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

# fields of the messages: the first bit, how many, and whether the number is signed
SEQUENCE = 8, 8, False
REQUEST_TOTAL = 16, 16, True
REQUEST_INVERSE = 32, 16, False
REQUEST_FLAGS = 48, 5, False
REQUEST_REQUESTER = 48 + REQUESTER_SHIFT, 3, False
REQUEST_SESSION = 56, 8, False
STATUS_CODE = 16, 8, False
STATUS_FLAGS = 24, 8, False
"""The state, in the lowest three bits, and the flags above it."""
STATUS_SESSION = 32, 8, False
"""The number of the box's present session: another one after each start."""
STATUS_FRAMES = 40, 8, False
STATUS_REQUESTS = 48, 8, False
STATUS_MOMENTS = 56, 8, False
CORRECTIONS_COMPLETED = 16, 16, True
CORRECTIONS_ACCEPTED = 32, 16, True
CORRECTIONS_SESSION = 48, 8, False
CORRECTIONS_JUDGED = 56, 8, False
"""The sequence counter of the request that the box judged last."""
POSITION_COUNTS = 16, 32, True
POSITION_VALID = 48, 1, False
POSITION_COUNTED = 49, 15, False
"""The counts since home that the box has added up, modulo 2^15."""
PROBE_COUNTS = POSITION_COUNTS
PROBE_TRIPS = 48, 8, False
PROBE_SESSION = 56, 8, False
HOLD_REASON = 16, 8, False
HOLD_AXIS = 24, 8, False
SETUP_WORD = 16, 48, False
"""The word of `design_cycle_step`."""


@helper
def field(payload: int, bit: int, width: int, is_signed: bool) -> int:
    """Return a field: ``width`` bits from ``bit`` on, in two's complement where it is signed."""
    value = (payload >> bit) & ((1 << width) - 1)
    return value - (1 << width) if is_signed and value >> (width - 1) else value


@helper
def placed(value: int, bit: int, width: int, is_signed: bool) -> int:
    """Return a payload of this field alone; what the field does not hold is cut off."""
    # the highest bit of the payload is its sign
    return field(value, 0, width, bit + width == PAYLOAD_BITS) << bit


@helper
def pack_request(axis: int, sequence: int, total: int, flags: int, requester: int, session: int) -> int:
    """Return the payload of a request: the total twice, the second time inverted."""
    word = placed(sequence, *SEQUENCE) | placed(total, *REQUEST_TOTAL) | placed(~total, *REQUEST_INVERSE)
    word |= placed(flags, *REQUEST_FLAGS) | placed(requester, *REQUEST_REQUESTER) | placed(session, *REQUEST_SESSION)
    return sealed(REQUEST + axis, word)


@helper
def request_agrees(payload: int) -> bool:
    """Return whether the total and its inverse say the same."""
    return field(~payload, *REQUEST_INVERSE) == field(payload, 16, 16, False)


@helper
def pack_status(
    axis: int, sequence: int, code: int, flags: int, session: int, frames: int, requests: int, moments: int
) -> int:
    """Return the payload of a status: code, state and flags, and how many of each kind were refused so far."""
    word = placed(sequence, *SEQUENCE) | placed(code, *STATUS_CODE) | placed(flags, *STATUS_FLAGS)
    word |= placed(session, *STATUS_SESSION) | placed(frames, *STATUS_FRAMES)
    word |= placed(requests, *STATUS_REQUESTS) | placed(moments, *STATUS_MOMENTS)
    return sealed(STATUS + axis, word)


@helper
def pack_corrections(axis: int, sequence: int, completed: int, accepted: int, session: int, judged: int) -> int:
    """Return the payload of the corrections: both totals, and the sequence counter of the last request judged."""
    word = placed(sequence, *SEQUENCE) | placed(completed, *CORRECTIONS_COMPLETED)
    word |= placed(accepted, *CORRECTIONS_ACCEPTED) | placed(session, *CORRECTIONS_SESSION)
    return sealed(CORRECTIONS + axis, word | placed(judged, *CORRECTIONS_JUDGED))


@helper
def pack_position(axis: int, sequence: int, position: int, valid: int, counted: int) -> int:
    """Return the payload of a position: the word, Data Valid, and the counts added up, modulo 2^15."""
    word = placed(sequence, *SEQUENCE) | placed(position, *POSITION_COUNTS)
    word |= placed(valid, *POSITION_VALID) | placed(counted, *POSITION_COUNTED)
    return sealed(POSITION + axis, word)


@helper
def pack_probe(axis: int, sequence: int, position: int, trips: int, session: int) -> int:
    """Return the payload of a probe latch."""
    word = placed(sequence, *SEQUENCE) | placed(position, *PROBE_COUNTS)
    word |= placed(trips, *PROBE_TRIPS) | placed(session, *PROBE_SESSION)
    return sealed(PROBE + axis, word)


@helper
def pack_hold(sequence: int, reason: int, axis: int) -> int:
    """Return the payload of a hold: why, and for which axis."""
    word = placed(sequence, *SEQUENCE) | placed(reason, *HOLD_REASON) | placed(axis, *HOLD_AXIS)
    return sealed(HOLD, word)


@helper
def pack_setup(identifier: int, sequence: int, word: int) -> int:
    """Return the payload of a setup, or of what a PC expects of one: the word of `design_cycle_step`."""
    return sealed(identifier, placed(sequence, *SEQUENCE) | placed(word, *SETUP_WORD))


@helper
def design_cycle_step(design: int, cycle_us: int, step: int) -> int:
    """Return the word that says how a box or a PC is set up; ``step`` in 0.1 nm. It is never 0."""
    return (design & 0xF) | (cycle_us & 0xFFFFF) << 4 | (step & 0xFFFFFF) << 24
