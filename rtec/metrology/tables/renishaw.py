"""Files of Renishaw's laser software (``.rtl``): sections of text, targets in mm, deviations in µm.

======================  =====================================================================================
section                 holds
======================  =====================================================================================
``HEADER::``            file type, owner, version
``TARGET DATA::``       ``Target-count:``, then ``Targets :`` with the targets, a few a line, then ``Flags:``
``USER-TEXT::``         machine, serial number, date, axis, location, title
``RUNS::``              ``Run-count:``; forward and backward passes count as runs of their own
``DEVIATIONS::``        ``Run Target Data:``, then a line a reading: run, number of the target, deviation
``EOF::``               the end
======================  =====================================================================================

The layout is that of files in public and of programs that read them; the maker does not publish it. The direction of
a pass is that in which its targets follow each other in the file.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rtec.errors import FileFormatError
from rtec.metrology.columns import ColumnUnit, quantity_of_heading
from rtec.metrology.measurement import Column, Measurement
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.cells import number_of
from rtec.metrology.tables.choices import ColumnChoices

_SECTION = re.compile(r"([A-Z][A-Z0-9 -]{0,40})::")
_PAIR = re.compile(r"([A-Za-z][\w .-]{0,40}?)\s*:\s*(.*)")


def is_renishaw_file(text: str) -> bool:
    r"""Return whether a text is such a file, by the sections that it begins with.

    Examples
    --------
    >>> is_renishaw_file("HEADER::\nFile type : rtl\n\nTARGET DATA::\n"), is_renishaw_file("target_mm,deviation_um\n")
    (True, False)
    """
    found = _SECTION.fullmatch(text.lstrip()[:60].split("\n", 1)[0].strip())
    return found is not None and found[1].strip() == "HEADER"


def read_renishaw_text(source: str | Path, text: str, choices: ColumnChoices) -> Measurement:
    r"""Return the measurement in such a file; choices of ``target`` and ``deviation`` go before mm and µm.

    Raises
    ------
    FileFormatError
        No targets or no deviations, another number of them than the file states, a number that is none, a reading of
        no target, a kind of measurement whose units are not known.

    Examples
    --------
    >>> text = ("HEADER::\nFile type : rtl\nTARGET DATA::\nTargets :\n 0.0 100.0\nRUNS::\nRun-count: 2\n"
    ...         "DEVIATIONS::\nRun Target Data:\n1 1 0.0\n1 2 1.5\n2 2 2.0\n2 1 0.5\nEOF::\n")
    >>> m = read_renishaw_text("x.rtl", text, ColumnChoices())
    >>> m.columns["target"].values.tolist(), m.columns["direction"].values.tolist()
    ([0.0, 100.0, 100.0, 0.0], [1.0, 1.0, -1.0, -1.0])
    """
    sections = _sections(text)
    facts = {
        key: value
        for name in ("HEADER", "USER-TEXT")
        for key, value in _pairs(sections.get(name, [])).items()
        if value
    }
    units = _units(source, facts, choices)
    targets = _targets(source, sections)
    rows, lines = _readings(source, sections, len(targets))
    run, number = rows[:, 0], rows[:, 1].astype(np.int64) - 1
    target = targets[number]
    notes = ["a laser file with sections: targets in mm, deviations in um" if not choices.columns else ""]
    direction, more = _directions(run, target)
    empty = _empty_runs(run, rows[:, 2])
    kept = ~np.isin(run, empty)
    if empty:
        more.append(f"runs {', '.join(f'{one:g}' for one in empty)} hold zeros only and are left out")
    inside = {name: unit.inside for name, unit in units.items()}
    return Measurement(
        source=str(source),
        facts={key.lower(): value for key, value in facts.items()},
        columns={
            "run": Column("run", "", _numbered(run[kept], direction[kept])),
            "direction": Column("direction", "", direction[kept]),
            "target": Column("target", inside["target"], (target * units["target"].factor)[kept]),
            "deviation": Column("deviation", inside["deviation"], (rows[:, 2] * units["deviation"].factor)[kept]),
        },
        unknown={},
        lines=[line for line, keep in zip(lines, kept, strict=True) if keep],
        notes=tuple(note for note in [*notes, *more] if note),
    )


def _sections(text: str) -> dict[str, list[tuple[int, str]]]:
    found: dict[str, list[tuple[int, str]]] = {}
    current: list[tuple[int, str]] = []
    for line, raw in enumerate(text.split("\n"), 1):
        stripped = raw.strip()
        if (match := _SECTION.fullmatch(stripped)) is not None:
            current = found.setdefault(match[1].strip(), [])
        elif stripped:
            current.append((line, stripped))
    return found


def _pairs(lines: list[tuple[int, str]]) -> dict[str, str]:
    matches = (_PAIR.fullmatch(text) for _, text in lines)
    return {match[1].strip(): match[2].strip() for match in matches if match is not None}


def _units(source: str | Path, facts: dict[str, str], choices: ColumnChoices) -> dict[str, ColumnUnit]:
    """Return the units of targets and deviations: mm and µm of a linear measurement, else what the user states."""
    found = {"target": ColumnUnit("mm", 1.0), "deviation": ColumnUnit("mm", 1e-3)}
    stated = 0
    for name in found:
        ours = quantity_of_heading(choices.columns.get(name, ""))
        if ours is not None and ours[0] == name:
            found[name] = ours[1]
            stated += 1
    kind = facts.get("File type", "rtl").lower()
    owner = facts.get("Owner", "").lower()
    if stated < len(found) and (
        kind not in ("rtl", "") or any(word in owner for word in ("angular", "rotary", "straight"))
    ):
        problem = f"file type {shown(kind)}, {shown(facts.get('Owner', ''))}: not linear, and its units are not known"
        allowed = "--map 'target=target_deg' --map 'deviation=deviation_arcsec', or the units that it has"
        raise FileFormatError(source, None, problem, allowed)
    return found


def _targets(source: str | Path, sections: dict[str, list[tuple[int, str]]]) -> np.ndarray:
    lines = sections.get("TARGET DATA", [])
    pairs = _pairs(lines)
    start = next(
        (index for index, (_, text) in enumerate(lines) if text.replace(" ", "").lower() == "targets:"), None
    )
    targets: list[float] = []
    for line, text in lines[start + 1 :] if start is not None else []:
        if _PAIR.fullmatch(text) is not None:
            break
        targets += [_number(source, line, word) for word in text.split()]
    if not targets:
        raise FileFormatError(
            source, None, "no targets", "a section TARGET DATA:: with 'Targets :' and numbers below it"
        )
    _check_count(source, pairs.get("Target-count"), len(targets), "targets")
    return np.array(targets)


def _readings(
    source: str | Path, sections: dict[str, list[tuple[int, str]]], targets: int
) -> tuple[np.ndarray, list[int]]:
    """Return run, number of the target and deviation of each reading, shape (readings, 3), with their lines."""
    rows, numbers = [], []
    for line, text in sections.get("DEVIATIONS", []):
        if _PAIR.fullmatch(text) is not None:
            continue
        fields = [_number(source, line, word) for word in text.split()]
        if len(fields) != 3:
            raise FileFormatError(source, line, f"{len(fields)} fields", "run, number of the target, deviation")
        if fields[0] != round(fields[0]) or fields[1] not in range(1, targets + 1):
            raise FileFormatError(source, line, f"run {fields[0]:g}, target {fields[1]:g}", f"targets 1 to {targets}")
        rows.append(fields)
        numbers.append(line)
    if not rows:
        raise FileFormatError(source, None, "no deviations", "a section DEVIATIONS:: with a line for each reading")
    found = np.array(rows)
    _check_count(source, _pairs(sections.get("RUNS", [])).get("Run-count"), np.unique(found[:, 0]).size, "runs")
    return found, numbers


def _number(source: str | Path, line: int, word: str) -> float:
    value = number_of(word, "," if "," in word else ".")
    if value is None:
        raise FileFormatError(source, line, f"{shown(word)} is not a finite number", "a decimal number")
    return value


def _check_count(source: str | Path, stated: str | None, found: int, what: str) -> None:
    count = None if stated is None else number_of(stated, ".")
    if stated is not None and count != found:
        problem = f"{found} {what}, where the file states {shown(stated)}"
        raise FileFormatError(source, None, problem, "as many as stated; the file may be cut off")


def _directions(run: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Return the direction of each reading: that in which the targets of its run follow each other."""
    direction = np.ones(run.size)
    for one in np.unique(run):
        rows = np.flatnonzero(run == one)
        if target[rows[-1]] < target[rows[0]]:
            direction[rows] = -1.0
    return direction, ["the direction of each run is that in which its targets follow each other in the file"]


def _empty_runs(run: np.ndarray, deviation: np.ndarray) -> list[float]:
    """Return the runs of zeros beside runs of readings: some programs write them where a return is not measured."""
    empty = [float(one) for one in np.unique(run) if not deviation[run == one].any()]
    return empty if len(empty) < np.unique(run).size else []


def _numbered(run: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return run numbers that a pass forward and the one backward after it share."""
    found = np.zeros(run.size)
    for way in (1.0, -1.0):
        for number, one in enumerate(np.unique(run[direction == way]), 1):
            found[(run == one) & (direction == way)] = number
    return found
