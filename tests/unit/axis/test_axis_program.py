import math

import pytest

from rtec.axis.program import Dwell, Move, Program, Rapid
from rtec.errors import ArgumentError

HOSTILE = [math.nan, math.inf, -math.inf, 10**400, "10", None, True, 1j, [1.0], b"\0"]


@pytest.mark.parametrize("value", HOSTILE)
def test_every_number_refuses_what_is_no_finite_number(value):
    makers = {
        "target_mm": [lambda: Move(target_mm=value, feed_mm_s=1.0), lambda: Rapid(target_mm=value)],
        "feed_mm_s": [lambda: Move(target_mm=1.0, feed_mm_s=value)],
        "seconds": [lambda: Dwell(seconds=value)],
        "start_mm": [lambda: Program(blocks=(), start_mm=value)],
    }
    for name, calls in makers.items():
        for call in calls:
            with pytest.raises(ArgumentError, match=name):
                call()


@pytest.mark.parametrize(
    "call",
    [
        lambda: Move(target_mm=0, feed_mm_s=0),
        lambda: Move(target_mm=0, feed_mm_s=-1),
        lambda: Move(target_mm=0, feed_mm_s=1.1e4),
        lambda: Move(target_mm=1.1e5, feed_mm_s=1),
        lambda: Rapid(target_mm=-1.1e5),
        lambda: Dwell(seconds=-1e-12),
        lambda: Dwell(seconds=8.64e6 + 1),
        lambda: Program(blocks=(Dwell(seconds=0),), start_mm=1e6),
    ],
)
def test_values_beyond_their_range_are_refused(call):
    with pytest.raises(ArgumentError, match=r"is too (small|large); use "):
        call()


@pytest.mark.parametrize(("seconds", "dwell_ps"), [(0, 0), (6, 6 * 10**12), (0.1, 10**11), (1e-12, 1), (2.4e-12, 2)])
def test_dwell_is_whole_picoseconds(seconds, dwell_ps):
    assert Dwell(seconds=seconds).dwell_ps == dwell_ps
    assert type(Dwell(seconds=seconds).dwell_ps) is int


@pytest.mark.parametrize(
    ("blocks", "name"), [((Dwell(seconds=1), 5.0), r"blocks\[1\]"), (7, "blocks"), ("G", "blocks")]
)
def test_program_refuses_what_is_no_block(blocks, name):
    with pytest.raises(ArgumentError, match=name):
        Program(blocks=blocks)
