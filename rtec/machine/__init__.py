"""The parts joined: the open signal path and the closed loop."""

from rtec.machine.open_path import OpenPath, OpenPathResult, simulate

__all__ = ["OpenPath", "OpenPathResult", "simulate"]
