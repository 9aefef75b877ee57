"""The instruction set: the table from which dispatch, disassembly and documentation come."""

from firmware_model.isa.disassembler import Line, disassemble, disassemble_image
from firmware_model.isa.table import INSTRUCTIONS, RESERVED_OPCODE, Instruction, Operand

__all__ = [
    "INSTRUCTIONS",
    "RESERVED_OPCODE",
    "Instruction",
    "Line",
    "Operand",
    "disassemble",
    "disassemble_image",
]
