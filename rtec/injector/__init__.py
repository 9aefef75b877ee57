"""The box between encoder and controller: the four insertion designs, their timing, and what the gates do."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rtec.injector.box import Injector, InjectorSettings, Insertions, RealEdges
    from rtec.injector.design import Design, DesignRow
    from rtec.injector.protocol import Algorithm, BoxAlgorithm, Break, Reach, Response, Stimulus, Totals
    from rtec.injector.timing import Processor, Timing

__all__ = [
    "Algorithm",
    "BoxAlgorithm",
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

_MODULES = ("design", "timing", "box", "protocol")
"""Where a name is looked for when it is asked for: what designs and times there are is known without the compiler."""


def __getattr__(name: str) -> Any:
    if name in __all__:
        for module in _MODULES:
            found = vars(import_module(f"{__name__}.{module}"))
            if name in found:
                return found[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
