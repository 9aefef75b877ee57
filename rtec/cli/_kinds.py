"""Kinds of values that verbs take: their names, for annotations.

Help looks annotations up, and what stands behind these takes a second to load; what makes a value of a text loads it.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rtec.board import Microcontroller
    from rtec.conformance.streams import Stream
    from rtec.controller import IllegalPolicy, Multiplication
    from rtec.injector import Design, Processor, RealEdges
    from rtec.live.played import Role
    from rtec.study.c_source import Precision

    Clock = tuple[int, int]
    """A period in ps as a ratio."""
    States = tuple[int, ...]
    """Angle states 0 to 3."""
else:
    Clock = States = object
    Design = IllegalPolicy = Microcontroller = Multiplication = Precision = Processor = object
    RealEdges = Role = Stream = object

__all__ = [
    "Clock",
    "Design",
    "IllegalPolicy",
    "Microcontroller",
    "Multiplication",
    "Precision",
    "Processor",
    "RealEdges",
    "Role",
    "States",
    "Stream",
]  # fmt: skip
