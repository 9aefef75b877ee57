"""Speed of single stages: encoder, box, receiver, waveform files."""

import pytest
from figures_signal import STAGES, stage_works, write_changes

EDGES = 100_000


@pytest.mark.parametrize("stage", STAGES)
def test_stage(benchmark, stage):
    benchmark(stage_works(EDGES)[stage])


def test_writing_vcd(benchmark):
    size = benchmark(write_changes(EDGES))
    assert size > 10 * EDGES  # a time of picoseconds and a value each
