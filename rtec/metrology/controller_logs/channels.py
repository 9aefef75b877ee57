"""Channels of a controller's log put on one clock, as a table with the headings of measurement files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rtec.errors import FileFormatError
from rtec.metrology.columns import quantity_of_heading
from rtec.metrology.plain_numbers import shown
from rtec.metrology.tables.choices import ColumnChoices
from rtec.metrology.tables.table import Table

Floats = npt.NDArray[np.float64]

_ROTARY = "abc"
_SAME_CLOCK = 1e-6
"""Of a sample period, by which two clocks may differ and be one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Channel:
    """A channel of a log.

    Parameters
    ----------
    name
        As the file has it.
    values
        Shape (samples,).
    time_s
        Of each sample since the start of the log, shape (samples,).
    quantity, unit
        As in a heading of measurement files; no quantity where the name says none.
    axis
        Letter of its axis, or nothing.
    """

    name: str
    values: Floats
    time_s: Floats
    quantity: str = ""
    unit: str = ""
    axis: str = ""

    @property
    def is_position(self) -> bool:
        """Whether it is a commanded or measured position, whose clock is that of the log."""
        return self.quantity in ("target", "actual", "deviation")

    def heading(self, with_axis: bool = True) -> str:
        """Return the heading of its column."""
        parts = [self.quantity, self.axis if with_axis else "", self.unit]
        return "_".join(part for part in parts if part) if self.quantity else self.name


def unit_of_axis(letter: str) -> str:
    """Return the unit of an axis by its letter: deg for A, B, C and spindles, mm for the others.

    Examples
    --------
    >>> unit_of_axis("x"), unit_of_axis("b"), unit_of_axis("s")
    ('mm', 'deg', 'deg')
    """
    return "deg" if letter in (*_ROTARY, "s") else "mm"


def letter_in(name: str) -> str:
    """Return the letter of the axis that a name holds, in small, or nothing.

    Examples
    --------
    >>> letter_in("Axes.X.NcToPlc.ActPos"), letter_in("fbAxisY.SetPos"), letter_in("Y1"), letter_in("Axis 1.ActPos")
    ('x', 'y', 'y', '')
    """
    patterns = (
        r"(?i:axis|achse|ax)[ _.-]?([XYZABCUVWxyzabcuvw])(?![A-Za-z0-9])",
        r"(?:^|[ _.\[-])([XYZABCUVWxyzabcuvw])(?:[ _]?(?i:axis|achse))(?![a-z])",
        r"(?:^|[ _.\[-])([XYZABCUVWxyzabcuvw])\d?(?=$|[ _.\]-])",
    )
    found = (re.search(pattern, name) for pattern in patterns)
    return next((match[1].lower() for match in found if match is not None), "")


def table_of_channels(
    source: str | Path,
    channels: Sequence[Channel],
    choices: ColumnChoices,
    *,
    facts: dict[str, str],
    notes: Sequence[str],
    run: Floats | None = None,
) -> Table:
    """Return channels as a table with a row for each sample of the positions.

    Channels on another clock are interpolated linearly. A channel that the user maps keeps its own name; so does the
    second of two that mean the same.

    Parameters
    ----------
    source
        The file, for messages.
    channels
        In the order of the file.
    choices
        Where they name an axis, columns of unknown meaning of other axes are left out.
    facts, notes
        Of the table.
    run
        Number of the run of each sample of the positions, rising, shape (samples,); the time of each starts at 0.

    Raises
    ------
    FileFormatError
        No channel, or fewer than two samples in common.

    Examples
    --------
    >>> t = np.array([0.0, 0.001, 0.002])
    >>> log = [Channel(name="ENC_POS|1", values=t * 5, time_s=t, quantity="actual", unit="mm", axis="x")]
    >>> table_of_channels("x.json", log, ColumnChoices(), facts={}, notes=[]).headings
    ('actual_x_mm', 'time_s')
    """
    if not channels:
        raise FileFormatError(source, None, "no channel with samples", "a log of positions")
    said = list(notes)
    channels = [_as_mapped(one, choices) for one in channels]
    axes = {one.axis for one in channels if one.axis}
    if choices.axis in axes:
        others = [one for one in channels if one.axis not in ("", choices.axis) and not _is_known(one)]
        channels = [one for one in channels if one not in others]
        if others:
            said.append(f"{len(others)} channels of other axes that are no positions or drive signals are left out")
    base = next((one for one in channels if one.is_position), channels[0])
    kept, moved = _on_clock(source, channels, base.time_s)
    if moved:
        said.append(f"{_list(moved)} have samples at other times than {shown(base.name)}: interpolated linearly")
    columns: dict[str, Floats] = {}
    for one in channels:
        heading = one.heading(with_axis=_is_known(one) or choices.axis not in axes)
        if heading.lower() in (known.lower() for known in columns):
            said.append(f"channel {shown(one.name)} is left as it is: {heading} is another one already")
            heading = one.name
        same = one.name not in moved
        columns[heading] = one.values[kept] if same else np.interp(base.time_s[kept], one.time_s, one.values)
    columns["time_s"] = base.time_s[kept]
    if run is not None:
        columns["run"] = run[kept]
        columns["time_s"] -= base.time_s[np.searchsorted(run, run[kept])]
    numbers = np.column_stack(list(columns.values()))
    whole = np.isfinite(numbers).all(axis=1)
    if not whole.all():
        said.append(f"{int((~whole).sum())} of {whole.size} samples without a value in some channel are left out")
    if whole.sum() < 2:
        raise FileFormatError(source, None, f"{int(whole.sum())} samples with a value in each channel", "two or more")
    return Table(
        source=str(source),
        facts=facts,
        headings=tuple(columns),
        units=("",) * len(columns),
        above=("",) * len(columns),
        heading_line=0,
        lines=(np.flatnonzero(whole) + 1).tolist(),
        numbers=numbers[whole],
        notes=tuple(said),
    )


def _as_mapped(one: Channel, choices: ColumnChoices) -> Channel:
    """Return a channel without a meaning where the user states one for its name: the table maps it."""
    return replace(one, quantity="", unit="", axis="") if one.name.strip().lower() in choices.columns else one


def _is_known(one: Channel) -> bool:
    return bool(one.quantity) and quantity_of_heading(one.heading(with_axis=False)) is not None


def _on_clock(
    source: str | Path, channels: Sequence[Channel], clock: Floats
) -> tuple[npt.NDArray[np.bool_], list[str]]:
    """Return which samples of a clock every channel covers, and the names of those that have another clock."""
    step = float(np.median(np.diff(clock))) if clock.size > 1 else 1.0
    moved = [
        one.name
        for one in channels
        if one.time_s.size != clock.size or np.abs(one.time_s - clock).max(initial=0.0) > _SAME_CLOCK * step
    ]
    first = max(one.time_s[0] for one in channels)
    last = min(one.time_s[-1] for one in channels)
    kept = (clock >= first - _SAME_CLOCK * step) & (clock <= last + _SAME_CLOCK * step)
    if kept.sum() < 2:
        problem = "the channels have no time in common"
        raise FileFormatError(source, None, problem, "channels of one recording")
    return kept, moved


def _list(names: Sequence[str]) -> str:
    few = ", ".join(shown(name) for name in names[:3])
    return few if len(names) <= 3 else f"{few} and {len(names) - 3} more channels"
