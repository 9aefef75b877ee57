"""Two-level signals in time: the Gray code, edge streams, merging, waveform files."""

from rtec.signal._kernels import DELTA, ILLEGAL, NEVER
from rtec.signal.gray import STATES, Direction, GrayState, count_deltas, levels_of_states, states_of_levels
from rtec.signal.line import LevelStream
from rtec.signal.merge import Gate, merge_chunks, merge_lines
from rtec.signal.stream import Counts, EdgeStream
from rtec.signal.vcd import TIMESCALES_PS, VcdPhaseError, VcdSignal, VcdWriter
from rtec.signal.waveform import Detail, coarsest_timescale, write_vcd

__all__ = [
    "DELTA",
    "ILLEGAL",
    "NEVER",
    "STATES",
    "TIMESCALES_PS",
    "Counts",
    "Detail",
    "Direction",
    "EdgeStream",
    "Gate",
    "GrayState",
    "LevelStream",
    "VcdPhaseError",
    "VcdSignal",
    "VcdWriter",
    "coarsest_timescale",
    "count_deltas",
    "levels_of_states",
    "merge_chunks",
    "merge_lines",
    "states_of_levels",
    "write_vcd",
]
