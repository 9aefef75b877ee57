"""A motion on its way through the open signal path."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtec._jit import Record, new_record
from rtec.axis._kernels import PIECE
from rtec.axis.motion import COUNT_MM, Motion
from rtec.machine import _motion_kernels
from rtec.machine._motion_kernels import ASKED
from rtec.machine.tape import NOBODY


class MotionRun:
    """A motion that is carried out some edges at a time."""

    def __init__(self, motion: Motion) -> None:
        segments = motion.segments
        self.motion = motion
        self._piece = new_record(PIECE)
        self._columns = tuple(column / COUNT_MM for column in (segments.x0_mm, segments.v0_mm_s, segments.a0_mm_s2))
        self._at = np.zeros(2, np.int64)

    @property
    def requests_left(self) -> int:
        """Return how many requests are still to be made."""
        return int(self.motion.requests_ps.size - self._at[ASKED])

    def run(self, state: Record, edges: int, box: Any, tape: Any) -> float:
        """Pass at most so many edges; return the share of the time that is over, 1 at the end."""
        segments = self.motion.segments
        x0, v0, a0 = self._columns
        over = _motion_kernels.run_pieces(
            state, self._piece, segments.start_ps, segments.duration_ps, x0, v0, a0,
            self.motion.requests_ps, self._at,
            edges, box, tape or NOBODY,
        )  # fmt: skip
        return 1.0 if over else min(max(int(state.encoder.last_ps), 0) / segments.total_ps, 0.999)

    def finish(self, state: Record, settle_ps: int, box: Any, tape: Any) -> int:
        """Let the box insert the pending steps at rest; return when all is settled."""
        requests_ps, total_ps = self.motion.requests_ps, self.motion.total_ps
        come_to_rest = _motion_kernels.come_to_rest
        return int(come_to_rest(state, requests_ps, self._at, total_ps, settle_ps, box, tape or NOBODY))
