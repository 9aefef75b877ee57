"""Speed of box and PC over the simulated bus, with the machine and without."""

import pytest
from figures_link import cut, exchange

from rtec.requester.settings import HandshakeSettings


def test_exchanges_over_the_bus(benchmark):
    benchmark(exchange, 50_050, HandshakeSettings())  # ends half-way up, where a total too small would show


@pytest.mark.parametrize("speed_mm_s", [0.0, 10.0], ids=["at rest", "moving"])
def test_a_cell(benchmark, speed_mm_s):
    _, cell = benchmark(cut, 1, 5.0, speed_mm_s)
    assert cell._cell.bus.busy_ps > 0.1 * cell.now_ps
