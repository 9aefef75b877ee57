"""The box between encoder and controller: the four insertion designs, their timing, and what the gates do."""

from rtec.injector.box import Injector, InjectorSettings, Insertions, PowerLoss, RealEdges
from rtec.injector.design import Design
from rtec.injector.timing import Processor, Timing

__all__ = [
    "Design",
    "Injector",
    "InjectorSettings",
    "Insertions",
    "PowerLoss",
    "Processor",
    "RealEdges",
    "Timing",
]
