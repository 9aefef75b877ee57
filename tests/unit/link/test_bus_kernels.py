"""The bus: who sends when, how long a frame takes, and what each fault does to it."""

from importlib.resources import files

import cantools
import numpy as np
import pytest
from bus_oracle import Bus, Fault
from can_bits_oracle import TAIL_BITS, bare_bits, frame_bits, stuffed, worst_frame
from crc_oracle import frame_checksum
from hypothesis import given, settings, strategies as st

from rtec._jit import new_record
from rtec.link import _bus_kernels as bus_kernels
from rtec.link._bus_kernels import ANY, BUS, FAULT, FRAME_BITS, bus_reset, bus_submit, next_delivery
from rtec.link._frame_kernels import pack_corrections, pack_request, pack_status
from rtec.signal._kernels import NEVER

BIT_PS = 2_000_000  # 500 kbit/s
FRAME_PS = 270_000_000
MS = 10**9
PC, BOX = 0, 1
LAST_PS = 10**6 * MS


def fault(kind, *, node=ANY, identifier=ANY, begin=0, end=1 << 60, most=1 << 60, delay=0, seed=1):
    return {
        "kind": getattr(bus_kernels, kind), "place": node, "identifier": identifier, "from_ps": begin,
        "until_ps": end, "most": most, "delay_ps": delay, "seed": seed,
    }  # fmt: skip


def drive(frames, *faults):
    """Submit frames in order of time; return those delivered, and the bus and the faults as they are then."""
    bus = new_record(BUS)
    bus_reset(bus, BIT_PS)
    records = np.rec.array(np.zeros(len(faults), dtype=FAULT))
    for record, values in zip(records, faults, strict=True):
        for name, value in values.items():
            record[name] = value
    found = []

    def collect(before_ps):
        while (t_ps := next_delivery(bus, records, before_ps)) != NEVER:
            found.append((int(t_ps), int(bus.node), int(bus.identifier), int(bus.payload)))

    for t_ps, node, identifier, payload in frames:
        collect(t_ps + 1)
        bus_submit(bus, records, node, t_ps, identifier, payload)
    collect(LAST_PS)
    return found, bus, records


def cycles(number, identifier=0x201, node=PC, first=0):
    """Return a frame each 10 ms, counted in its payload."""
    return [(first + k * 10 * MS, node, identifier, 100 + k) for k in range(number)]


def payloads(found):
    return [payload for *_, payload in found]


# arbitration and time


def test_node_that_wants_to_send_too_much_is_counted():
    found, bus, _ = drive([(0, 1, 0x181, k) for k in range(20)])
    assert payloads(found) == list(range(17))  # one on the wires and 16 that wait
    assert bus.overrun == 3


FRAMES = st.lists(
    st.tuples(
        st.integers(0, 4 * FRAME_PS), st.integers(0, 3), st.sampled_from([0x080, 0x181, 0x201, 0x202, 0x301]),
        st.integers(-(2**63), 2**63 - 1),
    ),
    max_size=40,
)  # fmt: skip
FAULTS = st.builds(
    dict,
    kind=st.sampled_from(["LOST", "LATE", "DUPLICATED", "REORDERED", "STUCK", "BABBLING", "OFF"]),
    node=st.integers(0, 3),
    identifier=st.sampled_from([ANY, 0x181, 0x201]),
    begin=st.integers(0, 20 * FRAME_PS),
    length=st.integers(0, 40 * FRAME_PS),
    most=st.integers(0, 20),
    delay=st.integers(0, 3 * FRAME_PS),
)


@settings(deadline=None, max_examples=300)
@given(FRAMES, st.lists(FAULTS, max_size=2))
def test_bus_is_that_of_the_oracle(steps, drawn):
    # the steps between frames add up to their times
    frames, now_ps = [], 0
    for step_ps, *frame in steps:
        now_ps += step_ps // 3
        frames.append((now_ps, *frame))
    faults, plain = [], []
    for d in drawn:
        where = {"node": d["node"], "begin": d["begin"], "end": d["begin"] + d["length"], "most": d["most"]}
        faults.append(fault(d["kind"], identifier=d["identifier"], delay=d["delay"], **where))
        plain.append(
            Fault(
                kind=d["kind"], node=d["node"], identifier=None if d["identifier"] == ANY else d["identifier"],
                begin_ps=d["begin"], end_ps=where["end"], most=d["most"], delay_ps=d["delay"],
            )
        )  # fmt: skip
    found, bus, records = drive(frames, *faults)
    oracle = Bus(BIT_PS, plain)
    for frame in frames:
        oracle.submit(*frame)
    oracle.run(LAST_PS)
    if bus.overrun:
        return  # the oracle's queues have no end
    assert found == oracle.delivered
    assert [int(f.fired) for f in records] == [f.fired for f in plain]


# faults, one by one


def test_other_faults_do_not_prove_themselves_on_the_babbling_node():
    _, _, records = drive(
        cycles(1, first=MS), fault("BABBLING", end=5 * MS), fault("LOST", end=5 * MS), fault("CORRUPTED", end=5 * MS)
    )
    assert [int(f.fired) > 0 for f in records] == [True, False, False]


def test_corrupted_frame_is_another_one_under_a_wrong_checksum():
    right = int(pack_request(1, 5, -3, 8, 0, 7))
    weights = set()
    for seed in range(60):
        found, _, (f,) = drive([(k * MS, PC, 0x201, right) for k in range(10)], fault("CORRUPTED", seed=seed))
        assert f.fired == len(found) == 10
        for *_, payload in found:
            weights.add(((right ^ payload) % 2**64).bit_count())
            data = payload.to_bytes(8, "little", signed=True)
            assert frame_checksum(0x201, data) != data[0]
    assert weights == {1, 2, 3}


@pytest.mark.parametrize(("kind", "agrees"), [("FLIPPED", False), ("MASQUERADE", True)])
def test_miscounted_request_has_a_right_checksum(kind, agrees):
    right = int(pack_request(1, 5, 100, 8, 0, 7))
    bits = set()
    for seed in range(40):
        found, _, (f,) = drive([(0, PC, 0x201, right)], fault(kind, seed=seed))
        data = found[0][3].to_bytes(8, "little", signed=True)
        total, inverted = int.from_bytes(data[2:4], "little"), int.from_bytes(data[4:6], "little")
        assert f.fired == 1
        assert (total ^ 100).bit_count() == 1
        assert (total + inverted == 65535) is agrees
        assert frame_checksum(0x201, data) == data[0]
        bits.add(total ^ 100)
    assert bits == {1 << k for k in range(8)}


ANSWERS = [
    (0, 1, 0x181, int(pack_status(1, 5, 0, 1, 7, 0, 0, 0))),
    (MS, 1, 0x281, int(pack_corrections(1, 5, 3, 3, 7, 5))),
]


def test_only_requests_are_miscounted():
    found, _, (f,) = drive(ANSWERS, fault("FLIPPED"))
    assert payloads(found) == [frame[3] for frame in ANSWERS]
    assert f.fired == 0


def test_a_masquerading_answer_has_one_wrong_bit_under_a_right_checksum():
    found, _, (f,) = drive(ANSWERS, fault("MASQUERADE", most=2))
    assert f.fired == 2
    for payload, (_, _, identifier, sent) in zip(payloads(found), ANSWERS, strict=True):
        data = (payload & (2**64 - 1)).to_bytes(8, "little")
        assert (((payload ^ sent) >> 16) & (2**48 - 1)).bit_count() == 1
        assert frame_checksum(identifier, data) == data[0]


# how long a frame is


def test_oracle_of_the_wire_knows_stuffing():
    assert stuffed([0] * 5 + [1] * 4) == [0] * 5 + [1] * 5 + [0]  # the stuff bit counts as the first of five
    assert stuffed([1, 1, 1, 1, 1, 1]) == [1, 1, 1, 1, 1, 0, 1]
    assert stuffed([0, 1] * 9) == [0, 1] * 9
    # 1 start + 11 identifier + 3 + 4 length + 64 data + 15 checksum, and 13 behind them
    assert (len(bare_bits(0x201, bytes(8))), TAIL_BITS) == (98, 13)


@settings(deadline=None)
@given(st.integers(0, 0x7FF), st.binary(min_size=8, max_size=8))
def test_no_frame_is_longer_than_the_bus_takes_for_one(identifier, data):
    assert 111 <= frame_bits(identifier, data) <= 133 < FRAME_BITS


def test_longest_frame_of_all_is_two_bits_below_the_bound():
    most, identifier, data = worst_frame()
    assert frame_bits(identifier, data) == 111 + most == 133
    # a stuff bit after the first five bits and then after each four, were all 98 bits free
    assert 111 + (98 - 1) // 4 == FRAME_BITS


def test_load_of_three_axes():
    dbc = cantools.database.load_string((files("rtec.link") / "rtec.dbc").read_text(), database_format="dbc")
    load = {}
    for message in dbc.messages:
        kind = message.name.partition("_")[0]
        load[kind] = load.get(kind, 0.0) + FRAME_BITS * 1000 / message.cycle_time / 500_000
    always = sum(load[kind] for kind in ("Status", "Request", "Corrections", "Position"))
    assert always == pytest.approx(0.324)
    assert always + load["Probe"] == pytest.approx(0.405)
    # held by the PC: a hold for each axis
    assert always + load["Probe"] + 3 * load["Hold"] == pytest.approx(0.486)


@pytest.mark.parametrize(("events", "last_ms"), [(0, 4.05), (2, 5.67)])
def test_all_frames_of_a_cycle_at_once_are_through_before_the_next(events, last_ms):
    frames = [(0, PC, 0x200 + axis, 0) for axis in (1, 2, 3)]
    for axis in (1, 2, 3):
        frames += [(0, axis, base + axis, 0) for base in (0x180, 0x280, 0x300, 0x380)]
        frames += [(0, axis, base + axis, 1) for base in (0x180, 0x280)[:events]]  # code changed, job done
    found, *_ = drive(frames)
    assert len(found) == 15 + 3 * events
    assert found[-1][0] == pytest.approx(last_ms * MS)
