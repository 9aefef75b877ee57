"""The lathe's network in plain Python, read from the thesis's formula (000, section 4.4.2) and printed program.

Slow and literal: no arrays, no clamping tricks, the numbers parsed from the paper's own text where it is at hand.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

PAPERS = Path(__file__).resolve().parents[3] / "shared" / "papers"
"""Folder of the papers beside the project; it may be absent."""


def paper_text() -> str | None:
    """Return the thesis's text, or None where the papers are not at hand."""
    found = sorted(PAPERS.glob("000_*.txt"))
    return found[0].read_text(encoding="utf-8", errors="replace") if found else None


def printed_numbers(text: str) -> dict[str, list[float]]:
    """Return every ``const double`` of a printed listing, by name."""
    text = re.sub(r"<\|.*?\|>", "", text)
    numbers = {}
    for name, size, body in re.findall(r"const double (\w+)(?:\[(\d+)\])? = \{?([^;]*?)\}?;", text):
        values = [float(word) for word in re.findall(r"[+-]\d\.\d+e[+-]\d+", body)]
        if values:
            assert len(values) == int(size or 1), name
            numbers[name] = values
    return numbers


def logsig(x: float) -> float:
    return 1.0 / (1.0 + math.exp(-x)) if x > -700.0 else 0.0


def output(numbers: dict[str, list[float]], prefix: str, reverse: bool, position: float) -> float:
    """Return the output of one network: sum of layer weights times logsig, plus the output bias."""
    biases = numbers[prefix + ("IW_B1" if reverse else "Bias1")]
    total = numbers[prefix + "Bias2"][0]
    for weight, bias, layer in zip(numbers[prefix + "IW2"], biases, numbers[prefix + "LW"], strict=True):
        total += layer * logsig(bias + weight * position)
    return total


def error_inch(numbers: dict[str, list[float]], reverse: bool, position: float, phase: float) -> float:
    """Return the error in inches at a position whose place within the turn is ``phase`` (both in inches)."""
    return output(numbers, "Full", reverse, position) + output(numbers, "cyclic", reverse, phase)
