"""Compensation files of LinuxCNC as tables."""

from __future__ import annotations

from enum import Enum
from pathlib import Path

from rtec.io import read_text
from rtec.predictors._rows import LARGEST_FILE, QUANTITIES, LengthUnit, bidirectional, columns_of, row_of
from rtec.predictors.tables import BidirectionalTable


class CompensationKind(Enum):
    """What the second and third column of a LinuxCNC compensation file hold (``COMP_FILE_TYPE``)."""

    POSITIONS = 0
    """The positions reached, forward and reverse: the error is position minus nominal."""
    TRIMS = 1
    """Nominal minus the position reached: the error is the negative."""


def read_linuxcnc_table(
    path: str | Path, *, unit: LengthUnit, kind: CompensationKind = CompensationKind.POSITIONS
) -> BidirectionalTable:
    r"""Read a compensation file of LinuxCNC: nominal, forward, reverse on each line.

    Parameters
    ----------
    path
        The file: three numbers a line, separated by blanks, without comments.
    unit
        The machine's unit of length; the file does not say it.
    kind
        ``COMP_FILE_TYPE`` of the machine's INI file.

    Raises
    ------
    FileFormatError
        The file cannot be read, a line is no triple of numbers (LinuxCNC itself would silently stop there), or the
        nominal positions do not ascend.

    References
    ----------
    LinuxCNC, INI configuration, ``[JOINT_n]``: ``COMP_FILE`` and ``COMP_FILE_TYPE``.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "z.comp"
    ...     _ = path.write_text("0.0 0.0 -0.001\n10.0 10.002 9.999\n")
    ...     table = read_linuxcnc_table(path, unit=LengthUnit.MM)
    >>> table.error_mm(10.0, [+1, -1]).round(9)
    array([ 0.002, -0.001])
    """
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in enumerate(read_text(path, most_bytes=LARGEST_FILE).rstrip().splitlines(), start=1):
        rows.append(row_of(path, number, line.split(), ["nominal", "forward", "reverse"]))
        lines.append(number)
    header = [(name, unit) for name in QUANTITIES]
    columns = columns_of(path, rows, lines, header)
    nominal, forward, reverse = (columns[name] for name in QUANTITIES)
    if kind is CompensationKind.POSITIONS:
        return bidirectional(nominal, forward - nominal, reverse - nominal)
    return bidirectional(nominal, -forward, -reverse)
