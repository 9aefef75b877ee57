"""A clock-exact MCS-51 microcontroller and the firmware that runs on it; nothing here knows the box around it.

::

    hexfile  → Image    program memory from Intel HEX
    isa                 one table: dispatch, disassembler, documentation
    core     → Mcs51    the processor: executes an Image, drives and reads pins
"""

from firmware_model.core.mcs51 import Mcs51
from firmware_model.core.results import Fault, FaultKind
from firmware_model.errors import FirmwareError
from firmware_model.hexfile import Image, read_hex
from firmware_model.isa.parts import TIMINGS

__all__ = [
    "TIMINGS",
    "Fault",
    "FaultKind",
    "FirmwareError",
    "Image",
    "Mcs51",
    "read_hex",
]
