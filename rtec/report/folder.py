"""The report's folder, which gets all of its files or none."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rtec.inference.model_file import write_model
from rtec.io import write_text
from rtec.metrology import Readings, measurement_of_readings, write_laser_file, write_measurement
from rtec.report.appearance import Scale, printable, scale_of
from rtec.report.document import study_document
from rtec.report.drawn import Illustration
from rtec.report.illustrations import illustrations
from rtec.report.page import page_values
from rtec.report.page_folder import write_page_folder
from rtec.report.search import search_figures
from rtec.report.shift import shift_csv
from rtec.report.tables import curves_csv, rows_csv
from rtec.signal import coarsest_timescale, write_vcd
from rtec.study.results import StudyResult, Waveform

_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9-]+")


def write_report(result: StudyResult, folder: Path, *, found: Sequence[Illustration] | None = None) -> Path:
    """Write page, figures, tables, readings and waveforms of a study: all or nothing, as `write_page_folder` does.

    Parameters
    ----------
    result
        The study.
    folder
        Where to; it exists.
    found
        What `search_figures` has drawn of the search already; None: it is drawn now.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OutputError
        As `write_page_folder`.
    ArgumentError
        A unit that is not known.
    """
    scale = scale_of(result.study.unit)
    if found is None:
        found = () if result.learned is None else search_figures(result.learned)
    return write_page_folder(
        folder,
        [*found, *illustrations(result, scale)],
        study_document(result),
        "report.html.j2",
        page_values(result, scale),
        beside=lambda new: _write_beside(result, scale, new),
    )


def _write_beside(result: StudyResult, scale: Scale, folder: Path) -> None:
    for name in ("readings", "waveforms"):
        (folder / name).mkdir()
    write_text(folder / "rows.csv", rows_csv(result, scale))
    write_text(folder / "feed.csv", curves_csv(result, scale))
    if result.shift is not None:
        write_text(folder / "shift.csv", shift_csv(result.shift, scale))
    if result.learned is not None:
        _write_readings(result, "calibration", "none", result.learned.readings, folder / "readings")
        write_model(folder / "model.toml", result.learned.diagnosis.model)
    for row in result.rows:
        if row.readings is not None:
            _write_readings(result, file_name(row.name), row.title, row.readings, folder / "readings")
    for waveform in result.waveforms:
        _write_waveform(waveform, folder / "waveforms")


def file_name(*words: str) -> str:
    """Return a file name without ending that every system allows.

    Examples
    --------
    >>> file_name("a", "8051"), file_name("../../etc")
    ('a_8051', 'etc')
    """
    return "_".join(_NOT_IN_NAMES.sub("-", word).strip("-")[:60] or "x" for word in words)


def _write_readings(result: StudyResult, name: str, correction: str, readings: Readings, folder: Path) -> None:
    facts = {"study": printable(result.study.name), "correction": printable(correction)}
    if result.study.period_mm is not None:
        facts["screw_pitch"] = f"{result.study.period_mm!r} mm"
    write_measurement(folder / f"{name}.csv", measurement_of_readings(readings, facts))
    write_laser_file(folder / f"{name}.dat", readings)


def _write_waveform(waveform: Waveform, folder: Path) -> None:
    streams = {"encoder": waveform.encoder, "controller": waveform.controller}
    times_ps = np.concatenate([[waveform.from_ps, waveform.to_ps], *(stream.times_ps for stream in streams.values())])
    write_vcd(
        folder / f"{file_name(waveform.name, waveform.processor)}.vcd",
        streams,
        start_ps=int(times_ps.min()),
        end_ps=int(times_ps.max()),
        timescale=coarsest_timescale(times_ps),
    )
