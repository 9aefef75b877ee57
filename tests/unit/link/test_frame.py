"""A frame and its form as a number; the oracle is `struct`."""

import struct

import pytest
from hypothesis import given, strategies as st

from rtec.errors import ArgumentError
from rtec.link.frame import Frame


@given(st.integers(0, 0x7FF), st.binary(min_size=8, max_size=8))
def test_the_payload_is_the_little_endian_signed_number(identifier, data):
    frame = Frame(identifier=identifier, data=data)
    assert frame.payload == struct.unpack("<q", data)[0]
    assert Frame.of_payload(identifier, frame.payload) == frame


def test_a_shorter_frame_has_no_payload():
    with pytest.raises(ArgumentError, match="7 bytes"):
        _ = Frame(identifier=1, data=bytes(7)).payload


@pytest.mark.parametrize(("extended", "highest"), [(False, 0x7FF), (True, 0x1FFFFFFF)])
def test_the_identifier_fits_its_format(extended, highest):
    assert Frame(identifier=highest, data=b"", extended=extended).identifier == highest
    for wrong in (-1, highest + 1, 1.0, True):
        with pytest.raises(ArgumentError, match="identifier"):
            Frame(identifier=wrong, data=b"", extended=extended)


@pytest.mark.parametrize("data", [bytes(9), "text", bytearray(2), None])
def test_data_is_up_to_eight_bytes(data):
    with pytest.raises(ArgumentError, match="data"):
        Frame(identifier=1, data=data)


@pytest.mark.parametrize("payload", [1 << 63, -(1 << 63) - 1, 0.5])
def test_a_payload_fits_64_bits(payload):
    with pytest.raises(ArgumentError, match="payload"):
        Frame.of_payload(1, payload)
