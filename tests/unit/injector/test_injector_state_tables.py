"""The report's state tables, corrected: every design, starting state, sign and profile, at rest and in motion."""

import itertools

import pytest
from injector_oracle import decoded

from rtec.injector import Design, Injector, InjectorSettings, Processor, Timing
from rtec.signal import EdgeStream

US = 1_000_000
FORWARD = ["00", "10", "11", "01"]
CODE = {"00": 0, "10": 1, "11": 3, "01": 2}
TEXT = {code: text for text, code in CODE.items()}

# levels "A B" step by step, from the rules of the report's text
TABLE = {
    (Design.B, 1, +1): "10",
    (Design.B, 1, -1): "01",
    (Design.B, 2, +1): "11",
    (Design.B, 2, -1): "00",
    (Design.B, 3, +1): "01",
    (Design.B, 3, -1): "10",
    (Design.B, 4, +1): "00",
    (Design.B, 4, -1): "11",
    (Design.C, 1, +1): "10 11",
    (Design.C, 1, -1): "01 11",
    (Design.C, 2, +1): "11 01",
    (Design.C, 2, -1): "00 01",
    (Design.C, 3, +1): "01 00",
    (Design.C, 3, -1): "10 00",
    (Design.C, 4, +1): "00 10",
    (Design.C, 4, -1): "11 10",
    (Design.A, 1, +1): "10 11 01 00",
    (Design.A, 1, -1): "01 11 10 00",
    (Design.A, 2, +1): "11 01 00 10",
    (Design.A, 2, -1): "00 01 11 10",
    (Design.A, 3, +1): "01 00 10 11",
    (Design.A, 3, -1): "10 00 01 11",
    (Design.A, 4, +1): "00 10 11 01",
    (Design.A, 4, -1): "11 10 00 01",
    (Design.ORIGINAL, 1, +1): "10 11 01 00",
    (Design.ORIGINAL, 1, -1): "01 11 10 00",
}
COUNTS = {Design.ORIGINAL: 4, Design.A: 4, Design.B: 1, Design.C: 2}
CASES = list(itertools.product(Design, (Processor.MCS51, Processor.FAST), (1, 2, 3, 4), (+1, -1)))


def make(design, processor, initial, **changes):
    timing = Timing.of(design, processor)
    return Injector(InjectorSettings(design=design, timing=timing, **changes), initial=initial)


def texts(stream):
    return [TEXT[int(ab)] for ab in stream.levels]


@pytest.mark.parametrize(("design", "processor", "state", "sign"), CASES)
def test_at_rest(design, processor, state, sign):
    levels = FORWARD[state - 1]
    box = make(design, processor, CODE[levels])
    box.request(sign, at_ps=0)
    out = box.process(EdgeStream([], [], initial=CODE[levels]), until_ps=100 * US)
    expected = TABLE.get((design, state, sign), "").split()
    assert texts(out) == expected
    assert decoded([levels, *expected]) == (sign * COUNTS[design] if expected else 0, 0)
    saw = box.insertions
    assert saw.completed == (sign if expected else 0)
    assert (saw.ahead_counts, saw.illegal, saw.refused) == (sign * COUNTS[design] * len(expected[:1]), 0, 0)


@pytest.mark.parametrize("motion", [+1, -1])
@pytest.mark.parametrize(("design", "processor", "state", "sign"), CASES)
def test_in_motion(design, processor, state, sign, motion):
    quarter = 50 * US
    # twelve edges, the ninth of which reaches the state; the gate has timed a whole cycle by then
    angles = [(state - 1 + motion * (k - 8)) % 4 for k in range(-1, 12)]
    levels = [FORWARD[angle] for angle in angles]
    box = make(design, processor, CODE[levels[0]])
    times = [quarter * (k + 1) for k in range(12)]
    codes = [CODE[level] for level in levels[1:]]
    before = box.process(EdgeStream(times[:8], codes[:8], initial=CODE[levels[0]]), until_ps=times[8])
    assert texts(before) == levels[1:9]
    box.request(sign, at_ps=times[8])
    after = box.process(EdgeStream(times[8:9], codes[8:9], initial=codes[7]), until_ps=times[9])
    row = TABLE.get((design, state, sign), "").split()
    assert texts(after) == [FORWARD[state - 1], *row]
    rest = box.process(EdgeStream(times[9:], codes[9:], initial=codes[8]), until_ps=times[11] + quarter)
    assert decoded([levels[0], *texts(before), *texts(after), *texts(rest)])[1] == 0
    total = decoded([levels[0], *texts(before), *texts(after), *texts(rest)])[0]
    # the Original waits for state 1, which comes among the last three edges where it is not this one
    assert box.insertions.completed == sign
    assert total == 12 * motion + sign * COUNTS[design]
    assert (box.insertions.ahead_counts, box.insertions.illegal) == (sign * COUNTS[design], 0)


@pytest.mark.parametrize("design", [Design.A, Design.B, Design.C])
def test_a_series_there_and_back_returns_to_the_start(design):
    box = make(design, Processor.FAST, 1)
    box.request(5, at_ps=0)
    there = box.process(EdgeStream([], [], initial=1), until_ps=100 * US)
    box.request(0, at_ps=100 * US)
    back = box.process(EdgeStream([], [], initial=1), until_ps=200 * US)
    assert decoded(["10", *texts(there)]) == (5 * COUNTS[design], 0)
    assert decoded(["10", *texts(there), *texts(back)]) == (0, 0)
    assert (box.insertions.inserted, box.insertions.completed, box.insertions.ahead_counts) == (10, 0, 0)
