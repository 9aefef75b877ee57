"""The parts joined: the open signal path and the closed loop."""

from rtec.machine.closed_loop import (
    TRACE_COLUMNS,
    Ending,
    Growth,
    LoopResult,
    Machine,
    readings_of,
    run_machine,
)
from rtec.machine.in_motion import insertion_at_rest, set_in_motion
from rtec.machine.measuring_run import Laser, MeasuringRun, measuring_run, straight_pass
from rtec.machine.open_path import OpenPath, OpenPathResult
from rtec.machine.open_run import simulate
from rtec.machine.thermometers import Thermometer

__all__ = [
    "TRACE_COLUMNS",
    "Ending",
    "Growth",
    "Laser",
    "LoopResult",
    "Machine",
    "MeasuringRun",
    "OpenPath",
    "OpenPathResult",
    "Thermometer",
    "insertion_at_rest",
    "measuring_run",
    "readings_of",
    "run_machine",
    "set_in_motion",
    "simulate",
    "straight_pass",
]
