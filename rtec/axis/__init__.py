"""What moves: programs of moves, motion profiles, encoders with their imperfections, servo and mechanical play."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rtec.axis._aimed import Window
    from rtec.axis.encoder import Encoder, Imperfections
    from rtec.axis.profile import Limits, MotionSegments, ProfileShape, plan
    from rtec.axis.program import Block, Dwell, Move, Program, Rapid
    from rtec.axis.servo import Servo

__all__ = [
    "Block",
    "Dwell",
    "Encoder",
    "Imperfections",
    "Limits",
    "MotionSegments",
    "Move",
    "ProfileShape",
    "Program",
    "Rapid",
    "Servo",
    "Window",
    "plan",
]

_MODULES = ("program", "profile", "servo", "encoder", "_aimed")
"""Where a name is looked for when it is asked for: a programme is read without the compiler."""


def __getattr__(name: str) -> Any:
    if name in __all__:
        for module in _MODULES:
            found = vars(import_module(f"{__name__}.{module}"))
            if name in found:
                return found[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
