"""Heat: a network of nodes that speeds and surroundings warm, what grows by it, and what thermometers say of it."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rtec.heat.bearings import Bearing, Loss, Oil, jacket_w_m2_k, rotating_w_m2_k
    from rtec.heat.course import HeatCourse
    from rtec.heat.duty import Duty, Piece
    from rtec.heat.machines import warm_machine
    from rtec.heat.network import Chiller, Link, Network, NetworkRun, Node, Room
    from rtec.heat.sensors import Thermometer
    from rtec.heat.spindle import Growth, WarmMachine, WarmRun

__all__ = [
    "Bearing",
    "Chiller",
    "Duty",
    "Growth",
    "HeatCourse",
    "Link",
    "Loss",
    "Network",
    "NetworkRun",
    "Node",
    "Oil",
    "Piece",
    "Room",
    "Thermometer",
    "WarmMachine",
    "WarmRun",
    "jacket_w_m2_k",
    "rotating_w_m2_k",
    "warm_machine",
]

_MODULES = ("course", "duty", "machines", "network", "bearings", "sensors", "spindle")
"""Where a name is looked for when it is asked for: a course is read without the compiler."""


def __getattr__(name: str) -> Any:
    if name in __all__:
        for module in _MODULES:
            found = vars(import_module(f"{__name__}.{module}"))
            if name in found:
                return found[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
