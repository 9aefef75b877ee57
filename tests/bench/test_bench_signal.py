"""Speed of single stages: encoder, box, receiver, gates, waveform files."""

import numpy as np
import pytest
from figures_signal import stage_works, write_changes

from rtec.signal import Gate, LevelStream, merge_lines

EDGES = 100_000


@pytest.mark.parametrize("stage", list(stage_works(4)))
def test_stage(benchmark, stage):
    benchmark(stage_works(EDGES)[stage])


@pytest.mark.parametrize("gate", Gate)
def test_merging(benchmark, gate):
    rng = np.random.default_rng(1)
    a, b = (LevelStream(np.cumsum(rng.integers(1, 1000, EDGES)), 0) for _ in range(2))
    merged = benchmark(merge_lines, gate, a, b)
    assert 0 < len(merged) <= len(a) + len(b)


def test_writing_vcd(benchmark):
    size = benchmark(write_changes(EDGES))
    assert size > 10 * EDGES  # a time of picoseconds and a value each
