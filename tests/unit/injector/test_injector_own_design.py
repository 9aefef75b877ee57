"""A design of one's own: a row is all that the box needs; tests/unit/machine has loop, cell and board."""

import pytest

from rtec.errors import ArgumentError
from rtec.injector import DesignRow, Injector, InjectorSettings, Processor, RealEdges, Timing
from rtec.signal import EdgeStream

FULL_CYCLE = DesignRow(
    key="c4", title="Full cycle by inverters", short="C4", step_counts=4, inverts=True, pins=0x03,
    decide_cycles=5, fast_ns=125,
)  # fmt: skip
LEVELS = [0, 1, 3, 2]
"""Of the states 1 to 4 of the report, A + 2 B."""


def box(design=FULL_CYCLE):
    return InjectorSettings(
        design=design, timing=Timing.of(design, Processor.MCS51), real_edges=RealEdges.HOLD
    )  # fmt: skip


@pytest.mark.parametrize("moved", [1, -1])
def test_in_motion_it_adds_a_cycle_and_takes_one_away(moved):
    injector = Injector(box())
    quarter = 50_000_000
    lines = EdgeStream([quarter * k for k in range(1, 81)], [LEVELS[moved * k % 4] for k in range(1, 81)], initial=0)
    injector.request(-2, at_ps=0)
    counts = injector.process(lines, until_ps=90 * quarter).counts()
    assert (counts.net, counts.illegal) == (80 * moved - 8, 0)
    assert injector.insertions.completed == -2


@pytest.mark.parametrize(
    ("step_counts", "inverts"), [(0, True), (3, True), (1, True), (2, False), (6, False)]
)  # fmt: skip
def test_gates_that_cannot_make_the_step_are_refused(step_counts, inverts):
    """An odd number of inversions turns the count round, and pulses that end elsewhere take their counts back."""
    with pytest.raises(ArgumentError, match="step_counts"):
        DesignRow(
            key="x", title="X", short="X", step_counts=step_counts, inverts=inverts, pins=3, decide_cycles=4,
            fast_ns=100,
        )  # fmt: skip
