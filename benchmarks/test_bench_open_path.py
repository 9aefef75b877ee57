"""Speed of the open path."""

import pytest
from open_path_job import carry_out, job

from rtec.injector import Design

EDGES = 200_000


@pytest.mark.parametrize("design", Design)
@pytest.mark.parametrize("in_blocks", [True, False], ids=["blocks", "steps"])
def test_open_path(benchmark, design, in_blocks):
    result = benchmark(carry_out, job(design, EDGES), in_blocks=in_blocks)
    assert result.insertions.completed == EDGES // 100


def test_open_path_with_corrections_close_together(benchmark):
    result = benchmark(carry_out, job(Design.C, EDGES, spacing_edges=8))
    assert result.insertions.completed == EDGES // 8
