"""The checksum of a frame against a division bit by bit, and what it finds."""

from itertools import combinations

import pytest
from crc_oracle import bits_of, crc8h2f, crc15_can, frame_checksum
from hypothesis import given, settings, strategies as st

from rtec.link._crc_kernels import is_sealed, sealed

IDENTIFIERS = [0x080, *(base + axis for base in (0x180, 0x200, 0x280, 0x300, 0x380) for axis in range(1, 16))]
BITS = [("identifier", place) for place in range(16)] + [("payload", place) for place in range(64)]


def payload_of(data):
    return int.from_bytes(data, "little", signed=True)


def data_of(payload):
    return int(payload).to_bytes(8, "little", signed=True)


def test_oracle_has_the_published_check_values():
    # AUTOSAR, Specification of CRC Routines: CRC8H2F of "123456789"; catalogue of CRCs: CRC-15/CAN
    assert crc8h2f(b"123456789") == 0xDF
    assert crc8h2f(bytes(4)) == 0x12
    assert crc15_can(bits_of(b"123456789")) == 0x059E


@settings(deadline=None)  # the first example compiles
@given(identifier=st.integers(0, 0x7FF), data=st.binary(min_size=8, max_size=8))
def test_checksum_is_that_of_the_oracle(identifier, data):
    assert data_of(sealed(identifier, payload_of(data))) == bytes([frame_checksum(identifier, data)]) + data[1:]


@pytest.mark.parametrize(("identifier", "data"), [(0x201, "0001fdff02000807"), (0x383, "00ffffffffffffff")])
@pytest.mark.parametrize("wrong", [1, 2, 3])
def test_every_error_of_up_to_three_bits_is_found(identifier, data, wrong):
    right = int(sealed(identifier, payload_of(bytes.fromhex(data))))
    assert is_sealed(identifier, right)
    tried = 0
    for places in combinations(range(len(BITS)), wrong):
        flips = {"identifier": 0, "payload": 0}
        for place in places:
            part, bit = BITS[place]
            flips[part] |= 1 << bit
        payload = right ^ payload_of(flips["payload"].to_bytes(8, "little"))
        assert int(sealed(identifier ^ flips["identifier"], payload)) != payload, places
        tried += 1
    assert tried == {1: 80, 2: 3160, 3: 82160}[wrong]


def test_bursts_up_to_a_byte_are_found():
    right = int(sealed(0x282, payload_of(bytes.fromhex("0042fdff02000807"))))
    # bits in the order of the checksum: each byte from its highest bit on, byte 0 behind byte 7
    order = [8 * byte + place for byte in (1, 2, 3, 4, 5, 6, 7, 0) for place in range(7, -1, -1)]
    for first in range(64):
        for pattern in range(1, 256):
            flipped = [order[first + k] for k in range(8) if pattern >> k & 1 and first + k < 64]
            if flipped:
                flips = sum(1 << place for place in flipped)
                payload = right ^ payload_of(flips.to_bytes(8, "little"))
                assert int(sealed(0x282, payload)) != payload, (first, pattern)


@pytest.mark.parametrize("data", ["0001fdff02000807", "0080000000000000"])
def test_frame_under_another_of_our_identifiers_is_refused(data):
    sums = {identifier: int(sealed(identifier, payload_of(bytes.fromhex(data)))) & 0xFF for identifier in IDENTIFIERS}
    assert len(sums) == 76
    confused = [(one, other) for one, other in combinations(IDENTIFIERS, 2) if sums[one] == sums[other]]
    # eight bits cannot tell 76 identifiers apart for sure: those that look alike differ in axis and in kind
    assert len(confused) == 28
    for one, other in confused:
        assert one & 15 != other & 15
        assert one & ~15 != other & ~15
        assert max(one & 15, other & 15) > 3  # never with three axes
