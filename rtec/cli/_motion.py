"""The option ``--motion`` of every command that has it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rtec.cli._words import MOTIONS
from rtec.units import SWEEP, parse_quantity

if TYPE_CHECKING:
    from rtec.axis import Program
    from rtec.axis.motion import MotionKind

MOTION_NAMES = f"{', '.join(MOTIONS)}, or a G-code programme FILE.nc"
DEFAULT_ACCELERATION = "100 MHz/s"


def read_motion(text: str, acceleration: str = DEFAULT_ACCELERATION) -> tuple[MotionKind, Program | None, float]:
    """Return the kind of motion, its programme where it has one, and the acceleration in Hz/s.

    Raises
    ------
    RtecError
        An unknown motion, a file that is no programme, an acceleration without its unit.

    Examples
    --------
    >>> read_motion("dither")
    (<MotionKind.DITHER: 'dither'>, None, 100000000.0)
    """
    from pathlib import Path

    from rtec.axis.motion import MotionKind, motion_named
    from rtec.metrology import read_program

    gain = parse_quantity(acceleration, SWEEP, name="--acceleration")
    named = motion_named(text)
    if isinstance(named, Path):
        return MotionKind.PROGRAMME, read_program(named), gain
    return named, None, gain
