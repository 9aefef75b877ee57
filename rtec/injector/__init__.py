"""The box between encoder and controller: the four insertion designs, their timing, and what the gates do."""

from rtec.injector.box import Injector, InjectorSettings, Insertions, RealEdges
from rtec.injector.design import Design, DesignRow
from rtec.injector.protocol import Algorithm, Break, Reach, Response, Stimulus, Totals
from rtec.injector.timing import Processor, Timing

__all__ = [
    "Algorithm",
    "Break",
    "Design",
    "DesignRow",
    "Injector",
    "InjectorSettings",
    "Insertions",
    "Processor",
    "Reach",
    "RealEdges",
    "Response",
    "Stimulus",
    "Timing",
    "Totals",
]
