"""The options ``--motion`` and ``--acceleration`` of every command that has them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtec.cli._parameters import option, quantity
from rtec.cli._words import MOTIONS
from rtec.units import SWEEP

if TYPE_CHECKING:
    from rtec.axis import Program
    from rtec.axis.motion import MotionKind

_NAMES = f"{', '.join(MOTIONS)}, or a G-code programme FILE.nc"
ACCELERATION = "100 MHz/s"


@dataclass(frozen=True, slots=True)
class AskedMotion:
    """A kind of motion, and its programme where it has one."""

    kind: MotionKind
    program: Program | None = None


def motion(text: str, **more: Any) -> Any:
    """Return the option that takes an `AskedMotion`."""
    return option("--motion", "MOTION", f"{text}: {_NAMES}.", read=read_motion, **more)


def acceleration(text: str, **more: Any) -> Any:
    """Return the option that takes an acceleration in Hz/s."""
    return quantity("--acceleration", SWEEP, "'100 MHz/s'", text, **more)


def read_motion(text: str) -> AskedMotion:
    """Read the name of a motion, or the programme in a file.

    Raises
    ------
    RtecError
        An unknown motion, or a file that is no programme.

    Examples
    --------
    >>> read_motion("dither").kind
    <MotionKind.DITHER: 'dither'>
    """
    from rtec.axis.motion import MotionKind, motion_named

    named = motion_named(text)
    if isinstance(named, Path):
        from rtec.metrology import read_program  # takes longer to load than a run

        return AskedMotion(MotionKind.PROGRAMME, read_program(named))
    return AskedMotion(named)
