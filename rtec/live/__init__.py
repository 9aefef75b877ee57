"""Box and PC on a live bus: the machines of simulated time, moved by a clock that nobody can stop."""

from rtec.live.box_loop import BoxLoop
from rtec.live.pc_loop import PcLoop

__all__ = ["BoxLoop", "PcLoop"]
