"""The parts joined: the open signal path and the closed loop."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rtec.machine.closed_loop import (
        TRACE_COLUMNS,
        Ending,
        LoopResult,
        Machine,
        readings_of,
        run_machine,
    )
    from rtec.machine.in_motion import on_capture, with_motion
    from rtec.machine.laser_readings import Laser, MeasuringRun, measuring_run, repeated_run, straight_pass
    from rtec.machine.open_path import OpenPath, OpenPathResult
    from rtec.machine.open_run import simulate

__all__ = [
    "TRACE_COLUMNS",
    "Ending",
    "Laser",
    "LoopResult",
    "Machine",
    "MeasuringRun",
    "OpenPath",
    "OpenPathResult",
    "measuring_run",
    "on_capture",
    "readings_of",
    "repeated_run",
    "run_machine",
    "simulate",
    "straight_pass",
    "with_motion",
]

_MODULES = ("open_path", "open_run", "in_motion", "laser_readings", "closed_loop")
"""Where a name is looked for when it is asked for: the open path starts without the closed loop."""


def __getattr__(name: str) -> Any:
    if name in __all__:
        for module in _MODULES:
            found = vars(import_module(f"{__name__}.{module}"))
            if name in found:
                return found[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
