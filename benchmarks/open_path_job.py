"""The open path's job: 500 kHz, phase error 10 degrees, jitter 5 ns, profile ``fast``, filter of 60 ns, x4."""

from __future__ import annotations

from rtec.axis import Encoder, Imperfections
from rtec.injector import Design, InjectorSettings, Processor, Timing
from rtec.machine import OpenPath, OpenPathResult, simulate

FREQUENCY_HZ = 500e3
REAL_TIME_EDGES_S = 4 * FREQUENCY_HZ


class WrongResultError(Exception):
    """What was timed did not do its job."""


def encoder() -> Encoder:
    """Return the encoder with the job's imperfections."""
    return Encoder(imperfections=Imperfections(phase_error_deg=10.0, jitter_ps=5_000), seed=3)


def box(design: Design) -> InjectorSettings:
    """Return a box with the fast processor."""
    return InjectorSettings(design=design, timing=Timing.of(design, Processor.FAST))


def job(design: Design, edges: int, *, spacing_edges: int = 100) -> OpenPath:
    """Return the run: ``edges`` edges with a correction every ``spacing_edges``."""
    return OpenPath(
        injector=box(design),
        encoder=encoder(),
        frequency_hz=FREQUENCY_HZ,
        cycles=edges // 4,
        corrections=edges // spacing_edges,
    )


def carry_out(path: OpenPath, *, in_blocks: bool = True) -> OpenPathResult:
    """Run it and make sure that every correction was completed and every count is right.

    Raises
    ------
    WrongResultError
        Where it was not so.
    """
    result = simulate(path, in_blocks=in_blocks)
    expected = 4 * path.cycles + path.corrections * path.injector.design.step_counts
    if not result.good or result.controller_counts != expected:
        raise WrongResultError(
            f"{path.injector.design.key}: {result.controller_counts} counts instead of {expected}, "
            f"{result.pending} pending"
        )
    return result
