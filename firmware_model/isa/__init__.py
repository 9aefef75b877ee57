"""The instruction set: the table from which dispatch, disassembly and documentation come."""
