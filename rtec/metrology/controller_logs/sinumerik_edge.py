"""Logs of Siemens Industrial Edge for machine tools: high-frequency data of a Sinumerik as JSON.

====================================  ===============================================================================
part                                  holds
====================================  ===============================================================================
``Header`` / ``SignalListHFData``     ``Name`` (``DES_POS|1``), ``Type``, ``Axis`` (``X1``) of each signal
``Header`` / ``CycleTimeMs``          period of the position controller, in ms
``Payload``                           a list; ``HFData`` holds rows with a value for each signal, ``CYCLE`` among
                                      them; ``HFTimestamp`` relates cycles to the time of day; blocks, calls and
                                      low-frequency data stand between
====================================  ===============================================================================

Seen in a log of a Sinumerik 840D sl (format 1.0): the cycle number counts on where samples are lost; at rest
``CONT_DEV`` is ``DES_POS`` less ``ENC_POS``; positions are in mm or degrees, and ``VEL_FFW`` in the same a second.
The file states no units: those of current (A), torque (Nm), power (W) and load (percent) are by the maker's
documentation.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from rtec.errors import FileFormatError
from rtec.io.json import parse_json
from rtec.metrology.controller_logs.channels import Channel, Floats, table_of_channels, unit_of_axis
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.choices import ColumnChoices
from rtec.metrology.tables.table import Table

_SIGNS = ('"SignalListHFData"', '"HFData"')
_MEANINGS: dict[str, tuple[str, str | None]] = {
    "DES_POS": ("target", ""),
    "CMD_POS": ("target", ""),
    "ENC_POS": ("actual", ""),
    "ENC1_POS": ("actual", ""),
    "CURRENT": ("current", "a"),
    "TORQUE": ("torque", "nm"),
    "CONT_DEV": ("contdev", ""),
    "POWER": ("power", "w"),
    "LOAD": ("utilisation", "percent"),
    "VEL_FFW": ("velffw", "_s"),
    "CMD_SPEED": ("cmdspeed", None),
    "TORQUE_FFW": ("torqueffw", "nm"),
}
"""Quantity and unit of a signal by its name; none, or one that begins with _, for that of the axis; None: unknown."""
_FARTHEST_MM = 50_000.0
"""Travel of a linear axis; what goes farther turns."""


def is_sinumerik_edge(text: str) -> bool:
    """Return whether a text is such a log, by what it begins with.

    Examples
    --------
    >>> is_sinumerik_edge('{"Header": {"SignalListHFData": []}}'), is_sinumerik_edge("target_mm,actual_mm")
    (True, False)
    """
    return text.lstrip()[:1] == "{" and any(sign in text[:1_000_000] for sign in _SIGNS)


def read_sinumerik_edge(source: str | Path, text: str, choices: ColumnChoices) -> Table:
    """Return the samples of such a log as a table.

    Time is that of the cycle number, so that it has gaps where samples are lost.

    Raises
    ------
    FileFormatError
        No JSON (the file may be cut off), no list of signals, rows of another length than the list, cycle numbers
        that do not rise, or no period.

    Examples
    --------
    >>> text = ('{"Header": {"CycleTimeMs": 2, "SignalListHFData": [{"Name": "CYCLE", "Axis": "Cycle"},'
    ...         ' {"Name": "DES_POS|1", "Axis": "X1"}]}, "Payload": [{"HFData": [[7, 1.0], [8, 1.5], [10, 2.5]]}]}')
    >>> table = read_sinumerik_edge("x.json", text, ColumnChoices())
    >>> table.headings, table.numbers.tolist()
    (('target_x_mm', 'time_s'), [[1.0, 0.0], [1.5, 0.002], [2.5, 0.006]])
    """
    try:
        document = parse_json(text)
    except ValueError as error:
        line = getattr(error, "lineno", None)
        problem = f"broken JSON ({getattr(error, 'msg', error)})"
        raise FileFormatError(source, line, problem, "a whole log; the file may be cut off") from None
    header, payload = _parts(source, document)
    signals = _signals(source, header)
    rows = _rows(source, payload, len(signals))
    names = [name for name, _ in signals]
    if "CYCLE" not in names:
        raise FileFormatError(source, None, "no signal CYCLE", "a log with the cycle number, which is its clock")
    cycle = rows[:, names.index("CYCLE")]
    if not (np.diff(cycle) > 0.0).all():
        row = int(np.flatnonzero(np.diff(cycle) <= 0.0)[0])
        problem = f"cycle {cycle[row + 1]:.0f} follows cycle {cycle[row]:.0f}"
        raise FileFormatError(source, None, problem, "cycle numbers that rise")
    period_s, notes = _period(source, header, payload)
    time_s = (cycle - cycle[0]) * period_s
    notes += _gaps(cycle, period_s)
    channels, more = _channels(signals, rows, time_s)
    facts = _facts(header)
    return table_of_channels(source, channels, choices, facts=facts, notes=[*notes, *more])


def _parts(source: str | Path, document: Any) -> tuple[dict[str, Any], list[Any]]:
    header = document.get("Header") if isinstance(document, dict) else None
    payload = document.get("Payload") if isinstance(document, dict) else None
    if not isinstance(header, dict) or not isinstance(payload, list):
        raise FileFormatError(source, None, "no 'Header' and 'Payload'", "a log of Siemens Edge with both")
    return header, payload


def _signals(source: str | Path, header: dict[str, Any]) -> list[tuple[str, str]]:
    """Return name and axis of each signal."""
    listed = header.get("SignalListHFData")
    if not isinstance(listed, list) or not listed or not all(isinstance(one, dict) for one in listed):
        raise FileFormatError(source, None, "no list 'SignalListHFData'", "a log with high-frequency data")
    return [(str(one.get("Name", "")), str(one.get("Axis", ""))) for one in listed]


def _rows(source: str | Path, payload: list[Any], width: int) -> Floats:
    """Return all rows, shape (samples, signals); NaN stands for what is missing."""
    rows: list[Any] = []
    for number, part in enumerate(payload, 1):
        block = part.get("HFData", []) if isinstance(part, dict) else []
        if not isinstance(block, list) or any(not isinstance(row, list) or len(row) != width for row in block):
            problem = f"a row of 'HFData' in part {number} of the payload has another length than the list of signals"
            raise FileFormatError(source, None, problem, f"{width} values a row")
        rows += block
    if len(rows) < 2:
        raise FileFormatError(source, None, f"{len(rows)} rows of 'HFData'", "two or more")
    try:
        return np.array(rows, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise FileFormatError(source, None, "a value in 'HFData' is no number", "numbers") from None


def _period(source: str | Path, header: dict[str, Any], payload: list[Any]) -> tuple[float, list[str]]:
    """Return the time of a cycle in s: as stated, else by the time stamps."""
    stated = header.get("CycleTimeMs")
    if isinstance(stated, int | float) and not isinstance(stated, bool) and 0.0 < stated < 1e4:
        return 1e-3 * stated, []
    stamps = [part["HFTimestamp"] for part in payload if isinstance(part, dict) and "HFTimestamp" in part]
    try:
        moments = np.array([str(one["Time"]).removesuffix("Z") for one in stamps], dtype="datetime64[us]")
        counts = np.array([one["HFProbeCounter"] for one in stamps], dtype=np.float64)
        period_s = float((moments[-1] - moments[0]) / np.timedelta64(1, "s") / (counts[-1] - counts[0]))
    except (KeyError, TypeError, ValueError, IndexError):
        period_s = 0.0
    if not 0.0 < period_s < 10.0:
        problem = "neither 'CycleTimeMs' nor two time stamps: the period is not known"
        raise FileFormatError(source, None, problem, 'a log with "CycleTimeMs": 2 in its header, in ms')
    return period_s, [f"the header states no period: {1e3 * period_s:.4g} ms by the time stamps"]


def _gaps(cycle: Floats, period_s: float) -> list[str]:
    steps = np.diff(cycle)
    missing = int((steps - 1.0).sum())
    if not missing:
        return []
    gaps = int((steps > 1.0).sum())
    what = "1 gap" if gaps == 1 else f"{gaps} gaps"
    return [f"{what} in the cycle numbers: {missing} samples ({missing * period_s:.3g} s) are missing"]


def _channels(signals: list[tuple[str, str]], rows: Floats, time_s: Floats) -> tuple[list[Channel], list[str]]:
    found, notes, names = [], [], {}  # type: list[Channel], list[str], dict[str, str]
    for column, (name, axis) in enumerate(signals):
        if name == "CYCLE":
            continue
        quantity, unit = _MEANINGS.get(name.partition("|")[0], ("", ""))
        letter = re.sub(r"\d+$", "", axis).lower()
        letter = "s" if letter.startswith("sp") else letter if len(letter) == 1 else ""
        if letter and names.setdefault(letter, axis) != axis:
            letter, quantity = "", ""  # X2 beside X1
        own = unit_of_axis(letter)
        unit = "" if unit is None else own + unit if unit in ("", "_s") else unit
        if not letter:
            quantity = unit = ""
        values = rows[:, column]
        found.append(Channel(name=name, values=values, time_s=time_s, quantity=quantity, unit=unit, axis=letter))
        if quantity == "actual" and own == "mm" and np.ptp(values) > _FARTHEST_MM:
            notes.append(
                f"axis {axis} goes {1e-3 * np.ptp(values):.3g} m; if it turns, its unit is degrees: "
                f"--map 'target_{letter}_mm=target_deg' --map 'actual_{letter}_mm=actual_deg'"
            )
    axes = ", ".join(f"{axis} as {letter} in {unit_of_axis(letter)}" for letter, axis in names.items())
    if any(one.quantity == "contdev" for one in found):
        notes.append("column contdev is target less actual as the controller has it")
    notes.insert(0, f"took axes {axes}, by their letters: the file states no units")
    return found, notes


def _facts(header: dict[str, Any]) -> dict[str, str]:
    machine = header.get("MachineInfo")
    name = machine.get("MachineName") if isinstance(machine, dict) else None
    began = header.get("Initial", {}).get("Time") if isinstance(header.get("Initial"), dict) else None
    found = {"machine": name, "date": began}
    return {key: shown(value).strip("'") for key, value in found.items() if isinstance(value, str)}
