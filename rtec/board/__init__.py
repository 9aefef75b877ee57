"""The box as a circuit board: a processor that runs the firmware, and the circuits of the report around it."""

from rtec.board.board import Board
from rtec.board.microcontroller import MICROCONTROLLERS, Microcontroller

__all__ = ["MICROCONTROLLERS", "Board", "Microcontroller"]
