"""The processor: decoded program memory, the compiled loop, and the face that owns its state."""

from firmware_model.core.mcs51 import Mcs51
from firmware_model.core.results import Fault, FaultKind, PortChange, RunResult

__all__ = ["Fault", "FaultKind", "Mcs51", "PortChange", "RunResult"]
