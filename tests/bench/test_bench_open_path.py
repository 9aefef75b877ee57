"""Speed of the open path."""

import pytest
from open_path_job import FREQUENCY_HZ, STEPPED_HZ, carry_out, job

from rtec.injector import Design

EDGES = 200_000


@pytest.mark.parametrize("design", Design)
@pytest.mark.parametrize("frequency_hz", [FREQUENCY_HZ, STEPPED_HZ], ids=["blocks", "steps"])
def test_open_path(benchmark, design, frequency_hz):
    result = benchmark(carry_out, job(design, EDGES, frequency_hz=frequency_hz))
    assert result.corrections_inserted == EDGES // 100


def test_open_path_with_corrections_close_together(benchmark):
    result = benchmark(carry_out, job(Design.C, EDGES, spacing_edges=8))
    assert result.corrections_inserted == EDGES // 8
