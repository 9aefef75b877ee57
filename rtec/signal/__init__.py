"""Two-level signals in time: the Gray code, edge streams, waveform files."""

from rtec.signal._kernels import ILLEGAL, NEVER
from rtec.signal.gray import STATES, count_deltas, levels_of_states, states_of_levels
from rtec.signal.stream import EdgeStream
from rtec.signal.vcd import TIMESCALES_PS, VcdSignal, VcdWriter, coarsest_timescale
from rtec.signal.waveform import write_vcd

__all__ = [
    "ILLEGAL",
    "NEVER",
    "STATES",
    "TIMESCALES_PS",
    "EdgeStream",
    "VcdSignal",
    "VcdWriter",
    "coarsest_timescale",
    "count_deltas",
    "levels_of_states",
    "states_of_levels",
    "write_vcd",
]
