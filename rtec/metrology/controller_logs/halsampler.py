"""Recordings of LinuxCNC's ``halsampler``: a line a sample, numbers with a space behind each, no headings.

With ``-t`` the number of the sample stands first; a line ``overrun`` says that samples were lost before the next.
What the columns are stands in the HAL file that connects pins to ``sampler.0.pin.0`` and on: its lines may stand
above the samples behind ``#``, or in a file beside the log with the same name and the suffix ``.hal``::

    loadrt motmod servo_period_nsec=1000000
    net x-cmd joint.0.motor-pos-cmd => sampler.0.pin.0
    net x-fb  joint.0.motor-pos-fb  => sampler.0.pin.1

Without it ``--map 'column 1=target_mm' --map 'column 2=actual_mm'`` tells. The period is that of the thread in the
HAL file, or of a line ``# sample_period: 0.5 ms``; else 1 ms, the usual servo period.

Seen in the source of ``sampler_usr.c``: spaces, tag, ``overrun``. Names of pins are those of the manual. Machine
units are taken for mm; ``# linear_units: inch`` changes it.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from rtec.errors import ArgumentError, FileFormatError
from rtec.io import read_text
from rtec.metrology.controller_logs.channels import Channel, Floats, table_of_channels, unit_of_axis
from rtec.metrology.plain_numbers import PLAIN_NUMBER, plain_numbers, shown
from rtec.metrology.tables.choices import ColumnChoices
from rtec.metrology.tables.table import Table
from rtec.units import MM_PER_INCH, TIME, parse_quantity

_PIN = re.compile(r"([\w.\[\]-]+)\s*(?:=>|<=|<=>|\s)\s*sampler\.\d+\.pin\.(\d+)\b")
_SIGNAL = re.compile(r"net\s+(\S+)\s+(.*)")
_TARGET = re.compile(r"sampler\.\d+\.pin\.(\d+)\b")
_PERIOD = re.compile(r"\b(?:servo_period_nsec|period1?)\s*=\s*(\d+)\b")
_MEANINGS = (
    (r"pos-cmd|position-cmd", "target", ""),
    (r"pos-fb|position-fb", "actual", ""),
    (r"f-error$|ferror", "deviation", ""),
    (r"vel-fb|velocity-fb", "velocity", "_s"),
    (r"current-fb|current$", "current", "a"),
    (r"torque", "torque", "nm"),
)
"""What the name of a pin holds, with quantity and unit; none, or one that begins with _, for that of the axis."""
_JOINT = re.compile(r"\b(?:joint|axis)\.(\w)\b")
_LETTERS = "xyzabcuvw"
_USUAL_PERIOD_S = 1e-3
_FEW = 50


def is_halsampler(text: str) -> bool:
    r"""Return whether a text is such a recording: numbers with a space behind each, ``overrun``, or a list of pins.

    Examples
    --------
    >>> is_halsampler("0.100000 0.099000 \n0.200000 0.198000 \n"), is_halsampler("target_mm,actual_mm\n1,2\n")
    (True, False)
    """
    few = text[:20_000].split("\n")[:_FEW]
    samples = [line for line in few if line.strip() and not line.startswith("#")][:-1]
    if not samples or not all(line == "overrun" or _is_sample(line) for line in samples):
        return False
    pins = any(_TARGET.search(line) for line in few if line.startswith("#"))
    return pins or "overrun" in samples or all(line.endswith(" ") for line in samples)


def _is_sample(line: str) -> bool:
    return all(PLAIN_NUMBER.fullmatch(word) for word in line.split())


def read_halsampler(source: str | Path, text: str, choices: ColumnChoices) -> Table:
    r"""Return the samples of such a recording as a table; stretches between losses of unknown length are runs.

    Raises
    ------
    FileFormatError
        A line that is no sample or cut off, no list of pins and no ``--map`` of a column, or more pins than columns.
    ArgumentError
        A fact ``sample_period`` or ``linear_units`` that cannot be read.

    Examples
    --------
    >>> text = ("# net x joint.0.motor-pos-cmd => sampler.0.pin.0\n# net xf joint.0.motor-pos-fb => sampler.0.pin.1\n"
    ...         "0.100000 0.099000 \n0.200000 0.198000 \n")
    >>> table = read_halsampler("x.txt", text, ColumnChoices())
    >>> table.headings, table.numbers.tolist()
    (('target_x_mm', 'actual_x_mm', 'time_s'), [[0.1, 0.099, 0.0], [0.2, 0.198, 0.001]])
    """
    lines = text.rstrip("\n").split("\n")
    about = [line.lstrip("# ").strip() for line in lines if line.startswith("#")]
    beside = Path(source).with_suffix(".hal")
    notes: list[str] = []
    if not any(_TARGET.search(line) for line in about) and beside != Path(source) and beside.is_file():
        about += read_text(beside, "a HAL file", most_bytes=1 << 20).split("\n")
        notes.append(f"pins as {beside.name} has them")
    numbers, first_after_loss = _samples(source, lines)
    pins = _pins(about)
    named = any(f"column {column + 1}" in choices.columns for column in range(numbers.shape[1]))
    if not pins and not named:
        problem = f"{numbers.shape[1]} columns without names"
        allowed = "the 'net' lines of its HAL file behind '#' above the samples, or --map 'column 1=target_mm'"
        raise FileFormatError(source, None, problem, allowed)
    tagged = _is_tagged(numbers, pins)
    if pins and len(pins) + tagged > numbers.shape[1]:
        problem = f"{numbers.shape[1]} columns, and {len(pins)} pins of the sampler"
        raise FileFormatError(source, None, problem, "a column for each pin")
    period_s = _period(about, notes)
    time_s, run = _clock(numbers, first_after_loss, tagged, period_s, notes)
    inch = _fact(about, "linear_units") in ("inch", "in")
    channels = [
        _channel(column, numbers[:, column], pins.get(column - tagged, ""), time_s, choices, inch)
        for column in range(int(tagged), numbers.shape[1])
    ]
    joints = {one.axis for one in channels if one.axis}
    if joints:
        unit = "inch" if inch else "mm"
        notes.append(f"took joints 0, 1, 2, ... for axes {', '.join(sorted(joints))}, and machine units for {unit}")
    return table_of_channels(source, channels, choices, facts={}, notes=notes, run=run)


def _samples(source: str | Path, lines: list[str]) -> tuple[Floats, list[int]]:
    """Return all samples, shape (samples, columns), and the numbers of those that follow a loss."""
    rows: list[str] = []
    after_loss: list[int] = []
    for line in lines:
        if line.strip() == "overrun":
            after_loss.append(len(rows))
        elif line.strip() and not line.startswith("#"):
            rows.append(line)
    width = len(rows[0].split())
    found = plain_numbers(rows, width, None)
    if found is None or len(rows) < 2:
        for number, line in enumerate(lines, 1):
            if line.strip() in ("", "overrun") or line.startswith("#"):
                continue
            if len(line.split()) != width or not _is_sample(line):
                allowed = f"{width} numbers a line; the file may be cut off"
                raise FileFormatError(source, number, f"{shown(line.strip())} is no sample", allowed)
        raise FileFormatError(source, None, f"{len(rows)} samples", "two or more finite ones")
    return found, sorted(set(after_loss) - {0})


def _pins(about: list[str]) -> dict[int, str]:
    """Return what is connected to each pin of the sampler: the pin of the motion, else the signal."""
    found: dict[int, str] = {}
    signals: dict[str, str] = {}
    for line in about:
        if (net := _SIGNAL.match(line)) is None:
            continue
        words = [word for word in re.split(r"[\s<=>]+", net[2]) if word]
        source = next((word for word in words if not _TARGET.fullmatch(word)), signals.get(net[1], ""))
        signals.setdefault(net[1], source)
        for word in words:
            if (pin := _TARGET.fullmatch(word)) is not None:
                found[int(pin[1])] = source or net[1]
    return found


def _is_tagged(numbers: Floats, pins: dict[int, str]) -> bool:
    """Return whether the first column numbers the samples."""
    first = numbers[:, 0]
    rises = bool((first == np.round(first)).all() and (np.diff(first) >= 1.0).all())
    return rises and (not pins or numbers.shape[1] == max(pins) + 2)


def _fact(about: list[str], key: str) -> str:
    return next((line.partition(":")[2].strip() for line in about if line.startswith(f"{key}:")), "")


def _period(about: list[str], notes: list[str]) -> float:
    """Return the time between samples in s."""
    if stated := _fact(about, "sample_period"):
        period_s = parse_quantity(stated, TIME, name="sample_period")
        if not 0.0 < period_s < 1e3:
            raise ArgumentError("sample_period", stated, "a time above 0, such as 1 ms")
        return period_s
    for line in about:
        if line.startswith("loadrt") and (found := _PERIOD.search(line)) is not None and int(found[1]) > 0:
            notes.append(f"a sample every {1e-6 * int(found[1]):g} ms, as the HAL file has it")
            return 1e-9 * int(found[1])
    notes.append("took 1 ms for the time between samples; '# sample_period: 0.5 ms' above them changes it")
    return _USUAL_PERIOD_S


def _clock(
    numbers: Floats, after_loss: list[int], tagged: bool, period_s: float, notes: list[str]
) -> tuple[Floats, Floats | None]:
    """Return the time of each sample in s, and its run where samples were lost and nobody counted them."""
    count = np.arange(numbers.shape[0], dtype=np.float64)
    if tagged:
        count = numbers[:, 0] - numbers[0, 0]
        missing = int((np.diff(count) - 1.0).sum())
        notes.append("took column 1 for the number of the sample")
        if missing:
            notes.append(f"{missing} samples ({missing * period_s:.3g} s) are missing")
        return count * period_s, None
    if not after_loss:
        return count * period_s, None
    notes.append(
        f"samples were lost {len(after_loss)} times ('overrun'), nobody knows how many: each stretch is a run"
    )
    run = 1.0 + np.searchsorted(after_loss, count, side="right").astype(np.float64)
    return count * period_s, run


def _channel(column: int, values: Floats, pin: str, time_s: Floats, choices: ColumnChoices, inch: bool) -> Channel:
    name = f"column {column + 1}"
    if name in choices.columns or not pin:
        return Channel(name=name, values=values, time_s=time_s)
    quantity, unit = next(((what, unit) for word, what, unit in _MEANINGS if re.search(word, pin)), ("", ""))
    joint = _JOINT.search(pin)
    letter = ""
    if joint is not None and quantity:
        letter = _LETTERS[int(joint[1])] if joint[1].isdigit() and int(joint[1]) < len(_LETTERS) else joint[1]
    own = unit_of_axis(letter)
    if unit in ("", "_s"):
        values = values * MM_PER_INCH if inch and own == "mm" else values
        unit = own + unit
    values = -values if quantity == "deviation" else values
    return Channel(
        name=pin or name, values=values, time_s=time_s, quantity=quantity, unit=unit if quantity else "", axis=letter
    )
