"""One run of an algorithm as a waveform file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rtec.conformance.trials import Run
from rtec.injector.waves import rows_of_streams, write_waves
from rtec.signal import VcdSignal


def write_run(run: Run, file: Path) -> None:
    """Write what went in and what came out: lines, states, counts, totals, insertions, and the moment of a fault.

    Parameters
    ----------
    run
        Made by `rtec.conformance.trials.Trials`.
    file
        One that exists is replaced once the new one is complete.

    Raises
    ------
    OutputError
        It cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from rtec.conformance.built_in import BuiltIn
    >>> from rtec.conformance.contract import Contract
    >>> from rtec.conformance.streams import Stream
    >>> from rtec.conformance.trials import Case, Trials
    >>> from rtec.injector import Design, InjectorSettings, Timing
    >>> trials = Trials(BuiltIn(InjectorSettings(design=Design.C, timing=Timing())), Contract.of(Design.C))
    >>> file = Path(tempfile.mkdtemp()) / "run.vcd"
    >>> write_run(trials.one(Case(title="at rest", stream=Stream.read("00 1us:r1 9ms:end"))), file)
    >>> file.read_text().splitlines()[1]
    '$timescale 100 ns $end'
    """
    stimulus, response, violation = run.case.stream.stimulus(), run.response, run.judgement.violation
    rows = rows_of_streams(stimulus.edges, response.edges, stimulus.requests, response.completed)
    at_ps = np.array([] if violation is None else [violation.time_ps], np.int64)
    failed = VcdSignal(scope="check", name="failed"), at_ps, np.ones(at_ps.size, np.int64)
    initial = stimulus.edges.initial, response.edges.initial
    write_waves(file, rows, initial=initial, end_ps=run.case.stream.until_ps, beside=[failed])
