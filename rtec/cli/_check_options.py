"""What the user said of an algorithm, handed from the verb to what makes the algorithm."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rtec.cli._kinds import Clock, Design, Microcontroller, Processor, RealEdges, States


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What the user said about an algorithm and its contract; None where nothing was said."""

    algorithm: str
    design: Design | None
    step_counts: int | None
    states: States | None
    frequency_hz: float | None
    acceleration_hz_s: float | None
    jitter: float | None
    separation_ps: int | None
    delay_ps: int | None
    clock_ps: Clock | None
    pins: Path | None
    simulator: str | None
    processor: Microcontroller | None
    part: str | None
    hold_latch: bool | None
    timing: Processor | None
    real_edges: RealEdges | None
