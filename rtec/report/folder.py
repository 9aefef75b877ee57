"""The report's folder, which gets all of its files or none."""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

from rtec.errors import OutputError
from rtec.metrology import measurement_of_readings, write_laser_file, write_measurement
from rtec.report.appearance import Scale, printable, scale_of
from rtec.report.illustrations import Illustration, illustrations
from rtec.report.page import render_page
from rtec.report.results import StudyResult, StudyRow, Waveform
from rtec.report.tables import curves_csv, rows_csv
from rtec.signal import coarsest_timescale, write_vcd

PAGE = "report.html"
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9-]+")


def write_report(result: StudyResult, folder: Path) -> Path:
    """Write page, figures, tables, readings and waveforms of a study.

    Everything is made in a hidden folder inside ``folder`` and moved to its place at the end, so that an error, a
    full disk or Ctrl-C leaves the folder as it was. What stands in the way under the same name is replaced.

    Parameters
    ----------
    result
        The study.
    folder
        Where to; it exists.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OutputError
        The folder is missing or not writable, or the disk is full.
    ArgumentError
        A unit that is not known.
    """
    scale = scale_of(result.unit)
    figures = illustrations(result, scale)
    part: Path | None = None
    try:
        part = Path(tempfile.mkdtemp(prefix=".rtec-report-", dir=folder))
        new = part / "new"
        new.mkdir()
        _write_all(result, scale, figures, new)
        _move_into_place(new, part / "old", folder)
    except OSError as error:
        raise OutputError(f"{folder}: the report cannot be written ({_reason(error, part)}); nothing was") from None
    finally:
        if part is not None:
            shutil.rmtree(part, ignore_errors=True)
    return folder / PAGE


def _reason(error: OSError, part: Path | None) -> str:
    """Return why, without the name of the hidden folder."""
    text = error.strerror or str(error)
    return text.replace(f"{part}{os.sep}new{os.sep}", "") if part is not None else text


def _move_into_place(new: Path, old: Path, folder: Path) -> None:
    """Move the entries of ``new`` into ``folder``, those in the way into ``old``; undo that where it fails."""
    old.mkdir()
    done: list[tuple[Path, Path]] = []
    try:
        for entry in sorted(new.iterdir(), key=lambda path: (path.name == PAGE, path.name)):
            place = folder / entry.name
            moves = [(place, old / entry.name)] if os.path.lexists(place) else []
            for source, target in [*moves, (entry, place)]:
                # noted before it is done: an interruption in between is undone as well
                done.append((source, target))
                source.rename(target)
    except BaseException:
        for source, target in reversed(done):
            if not os.path.lexists(source):
                with contextlib.suppress(OSError):
                    target.rename(source)
        raise


def _write_all(result: StudyResult, scale: Scale, figures: list[Illustration], folder: Path) -> None:
    """Write every file of the report into an empty folder, the page last."""
    for name in ("figures", "readings", "waveforms"):
        (folder / name).mkdir()
    for figure in figures:
        (folder / "figures" / f"{figure.name}.svg").write_bytes(figure.svg)
        (folder / "figures" / f"{figure.name}.png").write_bytes(figure.png)
    _write_text(folder / "rows.csv", rows_csv(result, scale))
    _write_text(folder / "feed.csv", curves_csv(result, scale))
    _write_text(folder / "result.json", json.dumps(plain(result.to_dict()), indent=2, allow_nan=False) + "\n")
    for row in result.rows:
        _write_readings(result, row, folder / "readings")
    for waveform in result.waveforms:
        _write_waveform(waveform, folder / "waveforms")
    for name in ("figures", "readings", "waveforms"):
        with contextlib.suppress(OSError):
            (folder / name).rmdir()
    files = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    _write_text(folder / PAGE, render_page(result, scale, figures, files))


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def plain(value: object) -> Any:
    """Return a value as strict JSON holds it: what is no finite number becomes null.

    Examples
    --------
    >>> plain({"rms": float("nan"), "audit": True, "rows": (1, 2.5)})
    {'rms': None, 'audit': True, 'rows': [1, 2.5]}
    """
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "item"):  # a number of numpy
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def file_name(*words: str) -> str:
    """Return a file name without ending that every system allows.

    Examples
    --------
    >>> file_name("a", "8051"), file_name("../../etc")
    ('a_8051', 'etc')
    """
    return "_".join(_NOT_IN_NAMES.sub("-", word).strip("-")[:60] or "x" for word in words)


def _write_readings(result: StudyResult, row: StudyRow, folder: Path) -> None:
    """Write the readings of a row as a measurement and as the laser system would."""
    facts = {"study": printable(result.study), "correction": printable(row.title)}
    if result.period_mm is not None:
        facts["screw_pitch"] = f"{result.period_mm!r} mm"
    write_measurement(folder / f"{file_name(row.name)}.csv", measurement_of_readings(row.readings, facts))
    write_laser_file(folder / f"{file_name(row.name)}.dat", row.readings)


def _write_waveform(waveform: Waveform, folder: Path) -> None:
    streams = {"encoder": waveform.encoder, "controller": waveform.controller}
    times = [int(time) for stream in streams.values() for time in stream.times_ps[[0, -1]] if len(stream)]
    start_ps, end_ps = min([waveform.from_ps, *times]), max([waveform.to_ps, *times])
    write_vcd(
        folder / f"{file_name(waveform.name, waveform.processor)}.vcd",
        streams,
        start_ps=start_ps,
        end_ps=end_ps,
        timescale=coarsest_timescale(streams.values(), start_ps=start_ps, end_ps=end_ps),
    )
