"""Any insertion algorithm held to the contract of a corrector, whether in Python, Verilog or machine code."""
