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
