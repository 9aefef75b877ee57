"""One run of an algorithm as a picture and as waveforms: what went in, what came out, where it broke the contract."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtec.report.waveform import waveform
from rtec.verify.contract.shown import shown_ps
from rtec.verify.contract.trials import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def case_figure(run: Run, name: str) -> Figure:
    """Draw the part of a run that matters."""
    stimulus, violation = run.case.stream.stimulus(), run.judgement.violation
    marks = [] if violation is None else [(violation.time_ps, violation.fault.value)]
    return waveform(
        stimulus.edges,
        run.response.edges,
        requested=stimulus.requests,
        completed=run.response.completed,
        window_ps=shown_ps(run),
        title=f"{name}: {'every count right' if violation is None else violation.reason}",
        marks=marks,
    )
