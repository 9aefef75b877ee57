"""Which stretch of a run shows what matters of it."""

from __future__ import annotations

import numpy as np

from rtec.verify.contract.trials import Run

_SHOWN_EDGES = 12
"""Of the encoder, around the moment that is shown."""
_MARGIN = 0.15
_FAR = 20
"""Times the shortest distance of two changes: what is farther before the last step belongs to something else."""


def shown_ps(run: Run) -> tuple[int, int]:
    """Return begin and end of what a picture shows: the last events up to the fault, and what followed on them.

    Examples
    --------
    >>> from rtec.verify.contract.built_in import BuiltIn
    >>> from rtec.verify.contract.contract import Contract
    >>> from rtec.verify.contract.streams import Stream
    >>> from rtec.verify.contract.trials import Case, Trials
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> trials = Trials(BuiltIn(InjectorSettings(design=Design.C, timing=Timing())), Contract.of(Design.C))
    >>> shown_ps(trials.one(Case(title="at rest", stream=Stream.read("00 1us:r1 9ms:end"))))
    (1000085000, 1000215000)
    """
    stream, violation = run.case.stream, run.judgement.violation
    if violation is None and len(run.response.edges):
        return _last_step_ps(run)
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


def _last_step_ps(run: Run) -> tuple[int, int]:
    """Return begin and end of the changes at the controller around the last step of a run that is right."""
    changes, done = run.response.edges.times_ps, run.response.completed.times_ps
    last = int(np.searchsorted(changes, done[-1], side="right")) if len(done) else len(changes)
    shown = changes[max(last - _SHOWN_EDGES // 2, 0) : last + 2]
    apart = np.diff(shown)
    far = np.flatnonzero(apart > _FAR * apart.min()) if apart.size else np.array([], np.int64)
    # the stretch between two long rests that has the step in it
    at = min(last, len(changes)) - max(last - _SHOWN_EDGES // 2, 0) - 1
    begin_ps = int(shown[max((k + 1 for k in far.tolist() if k < at), default=0)])
    end_ps = int(shown[min((k for k in far.tolist() if k >= at), default=shown.size - 1)])
    margin_ps = max(round(_MARGIN * (end_ps - begin_ps)), 10_000)
    return max(begin_ps - margin_ps, 0), min(end_ps + margin_ps, run.case.stream.until_ps)
