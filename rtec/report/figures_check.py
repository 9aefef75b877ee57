"""One run of an algorithm as a picture and as waveforms: what went in, what came out, where it broke the contract."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rtec.conformance.trials import Run
from rtec.report.figures_style import write_figure
from rtec.report.waveform import waveform

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN_EDGES = 12
"""Of the encoder, around the moment that is shown."""
_MARGIN = 0.15


def case_figure(run: Run, name: str) -> Figure:
    """Draw the part of a run that matters.

    Parameters
    ----------
    run
        Made by `rtec.conformance.trials.Trials`.
    name
        Of the algorithm.
    """
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


def write_case_figure(run: Run, name: str, file: Path) -> None:
    """Draw the part of a run that matters into a file."""
    write_figure(lambda: case_figure(run, name), file)


def shown_ps(run: Run) -> tuple[int, int]:
    """Return begin and end of what a picture shows: the last events up to the fault, and what followed on them.

    Examples
    --------
    >>> from rtec.conformance.built_in import BuiltIn
    >>> from rtec.conformance.contract import Contract
    >>> from rtec.conformance.streams import Stream
    >>> from rtec.conformance.trials import Case, Trials
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> trials = Trials(BuiltIn(InjectorSettings(design=Design.C, timing=Timing())), Contract.of(Design.C))
    >>> shown_ps(trials.one(Case(title="at rest", stream=Stream.read("00 1us:r1 9ms:end"))))
    (970000, 1230000)
    """
    stream, violation = run.case.stream, run.judgement.violation
    events = sorted({*stream.edges_ps.tolist(), *stream.requests_ps.tolist()})
    changes = run.response.edges.times_ps.tolist()
    pivot_ps = violation.time_ps if violation is not None else max(events, default=0)
    before = [t for t in events if t <= pivot_ps][-_SHOWN_EDGES:]
    behind = [t for t in events if t > pivot_ps][:2]
    begin_ps = min([*before, pivot_ps])
    end_ps = max([*behind, pivot_ps])
    # what comes out soon after the last of these events belongs to them
    soon_ps = max(end_ps - begin_ps, 1_000_000)
    end_ps = max([end_ps, *(t for t in changes if begin_ps <= t <= end_ps + soon_ps)])
    end_ps = max([end_ps, *(t for t in run.response.completed.times_ps.tolist() if t <= end_ps + soon_ps)])
    margin_ps = max(round(_MARGIN * (end_ps - begin_ps)), 10_000)
    return max(begin_ps - margin_ps, 0), min(end_ps + margin_ps, stream.until_ps)
