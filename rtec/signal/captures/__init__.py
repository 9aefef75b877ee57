"""Captured A/B lines: what a logic analyser recorded, read as an edge stream."""

from rtec.signal.captures.capture import ENDINGS, Capture, read_capture

__all__ = ["ENDINGS", "Capture", "read_capture"]
