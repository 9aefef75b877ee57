"""The compiled frames against cantools and the DBC; numbers of the DBC against those of the nodes."""

from importlib.resources import files
from pathlib import Path

import cantools
import pytest
from crc_oracle import frame_checksum
from hypothesis import given, settings, strategies as st

from rtec.link import _frame_kernels as frames
from rtec.requester import _box_kernels
from rtec.requester.status import Status
from rtec.requester.supervision import HoldReason

ROOT = Path(__file__).parents[3]
DBC = cantools.database.load_string((files("rtec.link") / "rtec.dbc").read_text(), database_format="dbc")

AXES = st.integers(1, 15)
BYTE = st.integers(0, 255)
TOTAL = st.integers(-(2**15), 2**15 - 1)
POSITION = st.integers(-(2**31), 2**31 - 1)
FRAMES = st.binary(min_size=8, max_size=8)


def drawn(*strategies):
    """Draw examples without a deadline: the first one compiles."""
    return lambda test: settings(deadline=None)(given(*strategies)(test))


def data_of(payload):
    return int(payload).to_bytes(8, "little", signed=True)


def payload_of(data):
    return int.from_bytes(data, "little", signed=True)


def by_cantools(name, identifier, **values):
    """Return what cantools makes of the message of axis 1, under another axis' identifier."""
    data = DBC.encode_message(name, {"Crc": 0, **values})
    return bytes([frame_checksum(identifier, data)]) + data[1:]


def read_by_cantools(name, data):
    return DBC.decode_message(name, data, decode_choices=False)


# packing


@drawn(AXES, BYTE, TOTAL, st.integers(0, 31), st.integers(0, 7), BYTE)
def test_request(axis, sequence, total, flags, requester, session):
    assert data_of(frames.pack_request(axis, sequence, total, flags, requester, session)) == by_cantools(
        "Request_1", 0x200 + axis, Sequence=sequence, Total=total, TotalInverted=0xFFFF - total % 65536,
        LargeCorrection=flags & 1, Probing=flags >> 1 & 1, GoHome=flags >> 2 & 1, Enable=flags >> 3 & 1,
        Reset=flags >> 4, Requester=requester, Session=session,
    )  # fmt: skip


@drawn(AXES, BYTE, BYTE, BYTE, BYTE, BYTE, BYTE, BYTE)
def test_status(axis, sequence, code, flags, session, refused, requests, moments):
    frame = frames.pack_status(axis, sequence, code, flags & 0x7F, session, refused, requests, moments)
    assert data_of(frame) == by_cantools(
        "Status_1", 0x180 + axis, Sequence=sequence, Code=code, State=flags & 7, SwitchOn=flags >> 3 & 1,
        Probing=flags >> 4 & 1, HoldWanted=flags >> 5 & 1, AtHome=flags >> 6 & 1, Session=session,
        FramesRefused=refused, RequestsRefused=requests, MomentsRefused=moments,
    )  # fmt: skip


@drawn(AXES, BYTE, TOTAL, TOTAL, BYTE, BYTE)
def test_corrections(axis, sequence, completed, accepted, session, judged):
    assert data_of(frames.pack_corrections(axis, sequence, completed, accepted, session, judged)) == by_cantools(
        "Corrections_1", 0x280 + axis, Sequence=sequence, Completed=completed, Accepted=accepted,
        Session=session, Judged=judged,
    )  # fmt: skip


@drawn(AXES, BYTE, POSITION, st.integers(0, 1), st.integers(-(2**14), 2**14 - 1))
def test_position(axis, sequence, position, valid, counted):
    assert data_of(frames.pack_position(axis, sequence, position, valid, counted)) == by_cantools(
        "Position_1", 0x300 + axis, Sequence=sequence, Position=position, DataValid=valid, Counted=counted
    )


@drawn(AXES, BYTE, POSITION, BYTE, BYTE)
def test_probe(axis, sequence, position, trips, session):
    assert data_of(frames.pack_probe(axis, sequence, position, trips, session)) == by_cantools(
        "Probe_1", 0x380 + axis, Sequence=sequence, Position=position, Trips=trips, Session=session
    )


@drawn(BYTE, BYTE, st.integers(0, 15))
def test_hold(sequence, reason, axis):
    assert data_of(frames.pack_hold(sequence, reason, axis)) == by_cantools(
        "Hold", 0x080, Sequence=sequence, Reason=reason, Axis=axis
    )


@drawn(st.integers(-(2**40), 2**40))
def test_counters_wrap_into_their_fields(number):
    assert frames.pack_probe(1, number, number, number, number) == frames.pack_probe(
        1, number % 256, (number + 2**31) % 2**32 - 2**31, number % 256, number % 256
    )
    wrapped = (number + 2**14) % 2**15 - 2**14  # Counted is modulo 2^15
    assert frames.pack_position(1, 0, 0, 0, number) == frames.pack_position(1, 0, 0, 0, wrapped)


# reading


@drawn(FRAMES)
def test_fields_of_any_request(data):
    payload, fields = payload_of(data), read_by_cantools("Request_1", data)
    assert frames.field(payload, *frames.SEQUENCE) == fields["Sequence"]
    assert frames.field(payload, *frames.REQUEST_TOTAL) == fields["Total"]
    assert frames.request_agrees(payload) == (fields["Total"] % 65536 + fields["TotalInverted"] == 65535)
    assert frames.field(payload, *frames.REQUEST_REQUESTER) == fields["Requester"]
    assert frames.field(payload, *frames.REQUEST_SESSION) == fields["Session"]
    flags = ["LargeCorrection", "Probing", "GoHome", "Enable", "Reset"]
    assert frames.field(payload, *frames.REQUEST_FLAGS) == sum(fields[flag] << k for k, flag in enumerate(flags))


@drawn(st.data())
def test_request_that_agrees_is_rare_among_frames(data):
    total = data.draw(st.integers(0, 65535))
    inverted = data.draw(st.sampled_from([65535 - total, total]) | st.integers(0, 65535))
    frame = bytes(2) + total.to_bytes(2, "little") + inverted.to_bytes(2, "little") + bytes(2)
    assert frames.request_agrees(payload_of(frame)) == (total + inverted == 65535)


# numbers


def test_identifiers_are_those_of_the_dbc():
    found = {message.name: message.frame_id for message in DBC.messages}
    expected = {"Hold": frames.HOLD}
    for name in ("Setup", "Expected", "Status", "Request", "Corrections", "Position", "Probe"):
        expected |= {f"{name}_{axis}": getattr(frames, name.upper()) + axis for axis in (1, 2, 3)}
    assert found == expected
    # a hold passes before all else, what is compared before what takes the axis home, what stops before what moves
    first = sorted(expected.values())
    assert first[:10] == [0x080, 0x101, 0x102, 0x103, 0x141, 0x142, 0x143, 0x181, 0x182, 0x183]
    assert frames.MOST_AXES == frames.AXIS_BITS == 15


def test_flags_are_those_of_the_dbc():
    request = {signal.name: 1 << (signal.start - 48) for signal in DBC.get_message_by_name("Request_1").signals[4:]}
    assert request["LargeCorrection"] == frames.LARGE_CORRECTION == _box_kernels.LARGE_CORRECTION
    assert request["Probing"] == frames.PROBING == _box_kernels.PROBING
    assert request["GoHome"] == frames.GO_HOME == _box_kernels.GO_HOME
    assert (request["Enable"], request["Reset"]) == (frames.ENABLE, frames.RESET)
    assert request["Requester"] == 1 << frames.REQUESTER_SHIFT
    status = {signal.name: signal.start - 24 for signal in DBC.get_message_by_name("Status_1").signals[3:]}
    assert [1 << status[name] for name in ("SwitchOn", "Probing", "HoldWanted", "AtHome")] == [
        frames.SWITCH_ON, frames.IS_PROBING, frames.HOLD_WANTED, frames.AT_HOME
    ]  # fmt: skip
    counted = DBC.get_message_by_name("Position_1").get_signal_by_name("Counted")
    assert counted.length == frames.POSITION_COUNTED[1]


def labels(message, signal):
    choices = DBC.get_message_by_name(message).get_signal_by_name(signal).choices
    return {str(label): number for number, label in choices.items()}


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_codes_are_those_of_the_box(axis):
    codes = labels(f"Status_{axis}", "Code")
    assert sorted(codes.values()) == list(range(14))
    for label, number in codes.items():
        known = getattr(_box_kernels, f"STATUS_{label}", None)
        assert number == (known if known is not None else getattr(_box_kernels, label)), label
    assert {status.name: int(status) for status in Status}.items() <= codes.items()
    for label, number in labels(f"Status_{axis}", "State").items():
        assert number == getattr(_box_kernels, label)


def test_reasons_are_those_of_the_pc():
    assert labels("Hold", "Reason") == {reason.name: int(reason) for reason in HoldReason}


def test_every_axis_of_the_dbc_has_the_same_messages():
    def facts(message):
        return [
            (s.name, s.start, s.length, s.is_signed, s.scale, s.unit, s.comment, s.choices) for s in message.signals
        ]

    for name in ("Setup", "Expected", "Status", "Request", "Corrections", "Position", "Probe"):
        one, *others = (DBC.get_message_by_name(f"{name}_{axis}") for axis in (1, 2, 3))
        for other in others:
            assert facts(other) == facts(one)
            assert (other.comment, other.cycle_time, other.length) == (one.comment, one.cycle_time, 8)
