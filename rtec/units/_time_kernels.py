"""Sizes of units of time that compiled code and its faces share; changed, all machine code is compiled anew."""

PS_PER_S = 1_000_000_000_000
PS_PER_MS = 1_000_000_000
PS_PER_US = 1_000_000
PS_PER_NS = 1_000
