"""The Original on the report's 8051: exact times, the limit, and the lesson that the speed gate is there for."""

import itertools

import pytest
from injector_oracle import decoded

from rtec.injector import Design, Injector, InjectorSettings, Processor, Timing
from rtec.signal import EdgeStream

US = 1_000_000
CODE = {"00": 0, "10": 1, "11": 3, "01": 2}
TEXT = {code: text for text, code in CODE.items()}
CYCLE = ["10", "11", "01", "00"]


def box_with(*, gate=True, poll_offset_ps=0, rest_ps=1000 * US, initial=0):
    profile = Timing.of(Design.ORIGINAL, Processor.MCS51)
    timing = Timing(
        poll_ps=profile.poll_ps,
        poll_offset_ps=poll_offset_ps,
        decide_ps=profile.decide_ps,
        step_ps=profile.step_ps,
        recover_ps=profile.recover_ps,
        rest_ps=rest_ps,
        gate_margin=profile.gate_margin if gate else None,
    )
    return Injector(InjectorSettings(design=Design.ORIGINAL, timing=timing), initial=initial)


def cycles(frequency_hz, count, direction=1, start_ps=0):
    """Return ``count`` cycles of edges from state 1 back to state 1; the last edge of each reaches A&B low."""
    quarter = 10**12 / (4 * frequency_hz)
    levels = [CODE[level] for level in (CYCLE if direction > 0 else [*CYCLE[2::-1], "00"])]
    n = 4 * count
    return EdgeStream([start_ps + round(quarter * (k + 1)) for k in range(n)], levels * count, initial=0)


@pytest.mark.parametrize("phase_us", [0.0, 0.25, 0.5, 1.0, 1.5, 1.999999])
@pytest.mark.parametrize("sign", [+1, -1])
def test_levels_and_times_after_the_edge(phase_us, sign):
    # both lines go low so long after a look of the two-cycle polling loop
    edge = 100 * US + round(phase_us * US)
    box = box_with(gate=False, initial=2)
    box.request(sign, at_ps=edge)
    out = box.process(EdgeStream([edge], [0], initial=2), until_ps=edge + 100 * US)
    first = edge + (0 if phase_us == 0 else 2 * US - round(phase_us * US)) + 4 * US
    assert out.times_ps.tolist() == [edge, first, first + US, first + 2 * US, first + 3 * US]
    pulses = ["10", "11", "01", "00"] if sign > 0 else ["01", "11", "10", "00"]
    assert [TEXT[int(ab)] for ab in out.levels] == ["00", *pulses]
    assert 4 * US <= first - edge < 6 * US
    assert out.times_ps[-1] - edge < 9 * US
    assert box.insertions.longest_ps == out.times_ps[-1] - edge
    # two-microsecond pulses that overlap by half
    a = [int(ab) & 1 for ab in out.levels]
    assert sum(a) == 2 and sum(int(ab) >> 1 for ab in out.levels) == 2


def lost_counts(frequency_hz, *, offset_us, direction, sign, gate=False):
    """Insert once, the first pulse coming so long after both lines went low; return (counts lost, illegal)."""
    stream = cycles(frequency_hz, 6, direction)
    edge = int(stream.times_ps[11])  # the end of the third cycle
    look = edge + round(offset_us * US) - 4 * US
    # at rest at once: the moment of the request decides
    box = box_with(gate=gate, rest_ps=1, poll_offset_ps=look % (2 * US))
    head = box.process(stream.part(0, 12), until_ps=look)
    box.request(sign, at_ps=look)
    tail = box.process(stream.part(12, 24), until_ps=int(stream.times_ps[-1]) + 50 * US)
    levels = ["00", *(TEXT[int(ab)] for part in (head, tail) for ab in part.levels)]
    net, illegal = decoded(levels)
    assert box.insertions.completed == sign
    assert box.insertions.ahead_counts == net - 24 * direction
    assert box.insertions.illegal == illegal
    return 24 * direction + 4 * sign - net, illegal


def test_boundary_lies_three_microseconds_before_the_next_edge():
    # A&B low lasts 8.333 us: pulses that start 5.333 us after its beginning end with it
    quarter_us = 1e6 / (4 * 30_000)
    assert quarter_us - 3 == pytest.approx(5.333, abs=1e-3)
    before = lost_counts(30_000, offset_us=5.3332, direction=1, sign=1)
    after = lost_counts(30_000, offset_us=5.3335, direction=1, sign=1)
    assert (before, after) == ((0, 0), (4, 0))


def run_gate_off(frequency_hz, poll_offset_ps, direction=1, sign=1):
    stream = cycles(frequency_hz, 12, direction)
    box = box_with(gate=False, poll_offset_ps=poll_offset_ps)
    end = int(stream.times_ps[-1]) + 50 * US
    # the axis moves already when the request comes
    head = box.process(stream.part(0, 3), until_ps=int(stream.times_ps[3]))
    box.request(3 * sign, at_ps=int(stream.times_ps[3]))
    tail = box.process(stream.part(3, 48), until_ps=end)
    net, illegal = decoded(["00", *(TEXT[int(ab)] for part in (head, tail) for ab in part.levels)])
    assert box.insertions.inserted == 3
    return net - 48 * direction - 4 * box.insertions.completed, illegal


@pytest.mark.parametrize(("direction", "sign"), list(itertools.product([+1, -1], [+1, -1])))
def test_limit_is_27_8_khz(direction, sign):
    offsets = range(0, 2 * US, US // 50)
    assert all(run_gate_off(27_700, offset, direction, sign) == (0, 0) for offset in offsets)
    wrong = [run_gate_off(27_900, offset, direction, sign) for offset in offsets]
    if direction == sign:
        assert any(error != 0 for error, _ in wrong)
        assert not any(illegal for _, illegal in wrong)
