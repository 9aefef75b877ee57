"""Compensation tables of controls: Sinumerik and Heidenhain, as their manuals describe them; tried on no control."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rtec.effects import Floats
from rtec.errors import ArgumentError
from rtec.inference.model import Model
from rtec.inference.static_predictor import LeftOut
from rtec.inference.warmth import Warmth
from rtec.predictors import Predictor
from rtec.study.compensation import drawn

SINUMERIK_POINTS = 2000
"""Most points of a table; MD38000 has to allow for them."""
HEIDENHAIN_POINTS = 256
"""Most lines of a table."""
_SINUMERIK_STEP_MM, _HEIDENHAIN_STEP_MM = 1e-6, 1e-4
_DISTANCE_MM = 1e-4
"""Steps of the distance between two points."""
_AXES = "XYZABCUVW"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EvenTable:
    """Errors of an axis, actual less commanded position, at points as far from each other."""

    first_mm: float
    step_mm: float
    forward_mm: Floats
    reverse_mm: Floats
    """Shape (points,); the same where a control has one curve for both directions."""
    left_max_mm: float
    left_rms_mm: float
    """Of both directions: the difference between the model and lines from point to point."""
    reversal_mm: float
    """Mean of the reverse less the forward error."""
    left_out: tuple[LeftOut, ...]

    @property
    def position_mm(self) -> Floats:
        """Of the points, shape (points,)."""
        return np.round(self.first_mm + self.step_mm * np.arange(self.forward_mm.size), 6)


def even_table(
    known: Model | Predictor,
    low_mm: float,
    high_mm: float,
    *,
    within_mm: float,
    most: int,
    both_ways: bool,
    warmth: Warmth | None = None,
) -> EvenTable:
    """Return the table with the fewest points, doubled from two on, that draws what is known within a tolerance.

    Parameters
    ----------
    known, low_mm, high_mm, within_mm, most, warmth
        As of `rtec.study.compensation.compensation_of`. Where ``most`` points do not suffice, so many are used.
    both_ways
        Whether the control has a curve for each direction (Heidenhain), or one for both (Sinumerik): their mean.

    Raises
    ------
    ArgumentError
        As for `compensation_of`.

    Examples
    --------
    >>> from rtec.predictors import UnidirectionalTable
    >>> slope = UnidirectionalTable(positions_mm=[0, 100], errors_mm=[0, 0.01], backlash_mm=0.004)
    >>> table = even_table(slope, 0, 100, within_mm=1e-4, most=256, both_ways=False)
    >>> table.position_mm.tolist(), table.forward_mm.tolist(), round(table.left_max_mm, 9)
    ([0.0, 100.0], [0.002, 0.012], 0.002)
    """
    fine, true, left_out = drawn(known, low_mm, high_mm, warmth)
    wanted = true if both_ways else np.stack([true.mean(axis=0)] * 2)
    rounded_mm = _HEIDENHAIN_STEP_MM if both_ways else _SINUMERIK_STEP_MM
    intervals = 1
    while True:
        step_mm = max(round((high_mm - low_mm) / intervals / _DISTANCE_MM), 1) * _DISTANCE_MM
        points = np.minimum(low_mm + step_mm * np.arange(intervals + 1), high_mm)
        errors = np.round(np.stack([np.interp(points, fine, one) for one in wanted]) / rounded_mm) * rounded_mm
        lines = np.stack([np.interp(fine, low_mm + step_mm * np.arange(intervals + 1), one) for one in errors])
        if np.abs(lines - wanted).max() <= within_mm or 2 * intervals + 1 > most:
            break
        intervals *= 2
    return EvenTable(
        first_mm=low_mm,
        step_mm=step_mm,
        forward_mm=errors[0],
        reverse_mm=errors[1],
        left_max_mm=float(np.abs(lines - true).max()),
        left_rms_mm=float(np.sqrt(np.mean((lines - true) ** 2))),
        reversal_mm=float((true[1] - true[0]).mean()),
        left_out=left_out,
    )


def sinumerik_axis(axis: str) -> str:
    """Return how a Sinumerik names a machine axis.

    Raises
    ------
    ArgumentError
        No letter, and no name such as AX4 or X1.

    Examples
    --------
    >>> sinumerik_axis("Z"), sinumerik_axis("ax4"), sinumerik_axis("X1")
    ('AX3', 'AX4', 'X1')
    """
    name = axis.upper()
    if len(name) == 1 and name in "XYZ":
        return f"AX{'XYZ'.index(name) + 1}"
    if not re.fullmatch(r"[A-Z]{1,4}[0-9]{1,2}", name):
        raise ArgumentError("--axis", axis[:40], "X, Y, Z, or the name of a machine axis such as AX4 or X1")
    return name


def sinumerik_lines(table: EvenTable, axis: str, said: tuple[str, ...]) -> Iterator[str]:
    """Yield the lines of a file with the compensation of measuring system 1 of a machine axis.

    Parameters
    ----------
    table
        One curve for both directions.
    axis
        As of `sinumerik_axis`.
    said
        Sentences of the comment at the top.

    References
    ----------
    Siemens, Sinumerik 840D sl, Function Manual Extended Functions, K3, "Measuring system error compensation": a
    positive value makes the axis move in the negative direction, so that the value is the error itself.

    Examples
    --------
    >>> table = EvenTable(first_mm=0.0, step_mm=50.0, forward_mm=np.array([0.0, 0.003]), reverse_mm=np.zeros(2),
    ...                   left_max_mm=0.0, left_rms_mm=0.0, reversal_mm=0.0, left_out=())
    >>> list(sinumerik_lines(table, "AX1", ()))[4:8]
    ['$AA_ENC_COMP[0,0,AX1]=0.000000', '$AA_ENC_COMP[0,1,AX1]=0.003000', '$AA_ENC_COMP_STEP[0,AX1]=50.0000', \
'$AA_ENC_COMP_MIN[0,AX1]=0.000000']
    """
    points = table.forward_mm.size
    yield from (f"%_N_{axis}_EEC_INI", "CHANDATA(1)", *(f"; {_plain(sentence)}" for sentence in said))
    yield f"; MD38000 $MA_MM_ENC_COMP_MAX_POINTS has to be {points} or more, MD32700 $MA_ENC_COMP_ENABLE[0] 1 again."
    yield f"; Both directions: mean. Their mean difference is {table.reversal_mm:.6f} mm (MD32450 $MA_BACKLASH)."
    for k, value in enumerate(table.forward_mm):
        yield f"$AA_ENC_COMP[0,{k},{axis}]={_fixed(value, 6)}"
    yield f"$AA_ENC_COMP_STEP[0,{axis}]={table.step_mm:.4f}"
    yield f"$AA_ENC_COMP_MIN[0,{axis}]={_fixed(table.first_mm, 6)}"
    yield f"$AA_ENC_COMP_MAX[0,{axis}]={_fixed(float(table.position_mm[-1]), 6)}"
    yield from (f"$AA_ENC_COMP_IS_MODULO[0,{axis}]=0", "M17")


def sinumerik_shift_lines(shift_mm: float, axis: str, said: tuple[str, ...]) -> Iterator[str]:
    """Yield the lines of a file with the thermal shift of a machine axis, which is the same at every position.

    References
    ----------
    As `sinumerik_lines`, "Temperature compensation": SD43900 acts where bit 0 of MD32750 is set, SD43910 and SD43920
    where bit 1 is.
    """
    yield from (f"; {_plain(sentence)}" for sentence in said)
    yield "; MD32750 $MA_TEMP_COMP_TYPE has to have bit 0 set."
    yield f"$SA_TEMP_COMP_ABS_VALUE[{axis}]={_fixed(shift_mm, 6)}"
    yield "M17"


def heidenhain_axis(axis: str) -> str:
    """Return the name of a column of a Heidenhain table.

    Raises
    ------
    ArgumentError
        No letter of an axis.
    """
    if len(axis) != 1 or axis.upper() not in _AXES:
        raise ArgumentError("--axis", axis[:40], f"one of {', '.join(_AXES)}")
    return axis.upper()


def heidenhain_lines(table: EvenTable, axis: str, name: str) -> Iterator[str]:
    """Yield the lines of a compensation value table (.COM) of an axis that depends on itself.

    Parameters
    ----------
    table
        A curve for each direction: that of the positive one stands in the axis' column, the other under BACKLASH.
    axis
        As of `heidenhain_axis`.
    name
        Of the file.

    References
    ----------
    Heidenhain, Technical Manual MANUALplus 620, January 2012, section 6.10.3: columns AXISPOS, BACKLASH and one for
    each axis.

    Examples
    --------
    >>> table = EvenTable(first_mm=0.0, step_mm=50.0, forward_mm=np.array([0.0, 0.003]), reverse_mm=np.zeros(2),
    ...                   left_max_mm=0.0, left_rms_mm=0.0, reversal_mm=0.0, left_out=())
    >>> print(*heidenhain_lines(table, "X", "X.COM"), sep="|")
    BEGIN X.COM MM|NR   AXISPOS       BACKLASH      X|0    +0.0000       +0.0000       +0.0000|\
1    +50.0000      +0.0000       +0.0030|[END]
    """
    yield from (f"BEGIN {_plain(name)} MM", f"{'NR':<5}{'AXISPOS':<14}{'BACKLASH':<14}{axis}")
    for k, (at, up, down) in enumerate(zip(table.position_mm, table.forward_mm, table.reverse_mm, strict=True)):
        yield f"{k:<5}{_signed(at):<14}{_signed(down):<14}{_signed(up)}"
    yield "[END]"


def _signed(value: float) -> str:
    return f"{round(value, 4) + 0.0:+.4f}"


def _fixed(value: float, digits: int) -> str:
    return f"{round(value, digits) + 0.0:.{digits}f}"


def _plain(text: str) -> str:
    return "".join(letter if " " <= letter <= "~" else "u" if letter == "µ" else "?" for letter in text)
