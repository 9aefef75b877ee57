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
