"""A classic CAN frame with a standard identifier and eight bytes, bit by bit (ISO 11898-1).

Nothing here imports rtec.
"""

from __future__ import annotations

import numpy as np
from crc_oracle import bits_of, crc15_can

# behind the last stuffed bit: CRC delimiter, acknowledge slot and delimiter, end of frame, intermission
TAIL_BITS = 1 + 1 + 1 + 7 + 3
DATA_BITS = 64
CRC_BITS = 15


def head(identifier: int) -> list[int]:
    """Return start of frame, identifier, RTR, IDE, r0 and the data length code 8."""
    return [0, *((identifier >> place) & 1 for place in range(10, -1, -1)), 0, 0, 0, 1, 0, 0, 0]


def bare_bits(identifier: int, data: bytes) -> list[int]:
    """Return the bits that are subject to stuffing: from the start of frame to the end of the checksum."""
    bits = head(identifier) + bits_of(data)
    crc = crc15_can(bits)
    return bits + [(crc >> place) & 1 for place in range(CRC_BITS - 1, -1, -1)]


def stuffed(bits: list[int]) -> list[int]:
    """Return the bits with one of the opposite level behind every five equal ones, stuff bits counted in."""
    out: list[int] = []
    run = 0
    for bit in bits:
        run = run + 1 if out and out[-1] == bit else 1
        out.append(bit)
        if run == 5:
            out.append(1 - bit)
            run = 1
    return out


def frame_bits(identifier: int, data: bytes) -> int:
    """Return how many bits of time a frame takes, the intermission behind it included."""
    return len(stuffed(bare_bits(identifier, data))) + TAIL_BITS


# the largest number of stuff bits, exactly, by following every state that the wire can be in: the level and
# the length of the present run, and the register of the checksum

_REGISTERS = np.arange(1 << CRC_BITS)
_SHIFTED = (_REGISTERS << 1) & 0x7FFF
_TOP = _REGISTERS >> (CRC_BITS - 1)
_NEXT = [np.where(_TOP ^ bit, _SHIFTED ^ 0x4599, _SHIFTED) for bit in (0, 1)]
_RUNS = [(level, run) for level in (0, 1) for run in (1, 2, 3, 4)]


def _after(level: int, run: int, bit: int) -> tuple[int, int, int]:
    """Return level, run and number of stuff bits after one more bit."""
    run = run + 1 if bit == level else 1
    return (1 - bit, 1, 1) if run == 5 else (bit, run, 0)


def _step(best: dict, bits: tuple[int, ...]) -> dict:
    new = {state: np.full(1 << CRC_BITS, -1000) for state in _RUNS}
    for (level, run), counts in best.items():
        for bit in bits:
            level2, run2, more = _after(level, run, bit)
            target = new[level2, run2]
            target[_NEXT[bit]] = np.maximum(target[_NEXT[bit]], counts + more)
    return new


def _stuff_of_checksums(level: int, run: int) -> np.ndarray:
    """Return how many stuff bits each checksum brings behind data that end with such a run."""
    levels, runs = np.full(1 << CRC_BITS, level), np.full(1 << CRC_BITS, run)
    more = np.zeros(1 << CRC_BITS, dtype=int)
    for place in range(CRC_BITS - 1, -1, -1):
        bit = (_REGISTERS >> place) & 1
        runs = np.where(bit == levels, runs + 1, 1)
        full = runs == 5
        levels, runs, more = np.where(full, 1 - bit, bit), np.where(full, 1, runs), more + full
    return more


def worst_frame(identifier: int | None = None) -> tuple[int, int, bytes]:
    """Return the frame with the most stuff bits: their number, its identifier and its data.

    Of the frames with the given identifier, or of all frames.
    """
    fixed = [0, *[None] * 11, *head(0)[12:]] if identifier is None else head(identifier)
    choices = [(0, 1) if bit is None else (bit,) for bit in [*fixed[1:], *[None] * DATA_BITS]]
    first = {state: np.full(1 << CRC_BITS, -1000) for state in _RUNS}
    first[0, 1][_NEXT[0][0]] = 0  # the start of frame
    history = [first]
    for bits in choices:
        history.append(_step(history[-1], bits))
    ends = {state: counts + _stuff_of_checksums(*state) for state, counts in history[-1].items()}
    state = max(ends, key=lambda key: ends[key].max())
    register = int(ends[state].argmax())
    most = int(ends[state][register])
    path: list[int] = []
    for before, after, bits in zip(history[-2::-1], history[:0:-1], choices[::-1], strict=True):
        bit, state, register = _back(before, after[state][register], state, register, bits)
        path.append(bit)
    path.reverse()
    word = int("".join(map(str, path)), 2)
    return most, word >> (7 + DATA_BITS), (word & ((1 << DATA_BITS) - 1)).to_bytes(8, "big")


def _back(before: dict, count: int, state: tuple, register: int, bits: tuple[int, ...]) -> tuple:
    """Return a bit, and the state and register before it, that lead to this count."""
    for bit in bits:
        source = int(np.flatnonzero(_NEXT[bit] == register)[0])
        for (level, run), counts in before.items():
            level2, run2, more = _after(level, run, bit)
            if (level2, run2) == state and counts[source] + more == count:
                return bit, (level, run), source
    raise AssertionError("no way leads here")
