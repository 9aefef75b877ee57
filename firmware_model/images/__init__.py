"""The box's firmware in 8051 assembly, and what it assembles to; docs/firmware.md describes both."""
