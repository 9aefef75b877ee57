"""Colours and lines of every figure: whoever wants another one changes it here.

The strong colours are those of Okabe and Ito (2008), told apart by colour-blind readers and in grey print.
"""

from __future__ import annotations

from typing import TypeAlias

Dash: TypeAlias = str | tuple[float, tuple[float, ...]]
"""A line of matplotlib: its sign, or lengths of strokes and gaps in line widths."""

BLUE, VERMILION, GREEN, PURPLE = "#0072b2", "#d55e00", "#009e73", "#cc79a7"
AMBER, SKY, VIOLET, BROWN = "#e69f00", "#56b4e9", "#7b3294", "#8a5a00"
PAPER, INK, ALARM = "#ffffff", "#222222", "#c1121f"
GREY = "#777777"
"""Of what has no colour of its own."""
NEUTRAL = "#4d4d4d"
"""Of readings without a direction."""
FORWARD, REVERSE = BLUE, VERMILION
SERIES = (BLUE, VERMILION, GREEN, PURPLE, AMBER, SKY, VIOLET, GREY)
"""Of things beside each other that have no colour of their own."""

GUIDE = "#b0b0b0"
"""Of lines that lead the eye."""
GRID, EDGE, TICK = "#e4e4e4", "#888888", "#555555"
PALE = "#666666"
"""Of words and marks that stand back."""
MOMENT = "#999999"
"""Of the line at time zero."""
GROWTH = "#6a6a6a"
MEASURED = "#a0a0a0"
"""Of a log behind its model."""
BAND = "#dcdcdc"
"""Of the noise."""
LIGHT = "#a6cee3"
SHADE = "#000000"
"""Of what lies beyond a limit, nearly transparent."""
STATE, STATE_EDGE = "#eef2f6", "#8a99a8"
"""Of bands of numbers under lines."""
ALIKE_COLOURS = ("#f4f8fb", "#a9cbe2", FORWARD)
"""From effects that have nothing in common to those that no fit tells apart."""
SAFE, DELAYED, STOPPED, UPSTREAM = "#d9f0e3", "#f6e3a1", "#9ecae1", "#e6a08c"
"""Of outcomes of a fault."""

GUIDE_LINE: Dash = (0, (4, 3))
REVERSE_LINE: Dash = (0, (4, 2))
LIMIT_LINE: Dash = (0, (5, 2))
DOTTED: Dash = (0, (2, 2))
FINE_DOTS: Dash = (0, (1, 1.5))
LEADER: Dash = (0, (1, 2))
"""From a dimension to what it measures."""
CENTRE_LINE: Dash = (0, (6, 2, 1, 2))
RIVALS: tuple[tuple[str, Dash], ...] = (
    (FORWARD, "-"), (REVERSE, "--"), (GREEN, "-."), (PURPLE, ":"), (AMBER, (0, (5, 1))),
)  # fmt: skip
STATE_LINES: tuple[Dash, ...] = ("-", LIMIT_LINE, DOTTED, (0, (1, 1)))

WAYS_OF_CORRECTING = {
    "uncompensated": (NEUTRAL, "#3a3a3a", "o"),
    "table": (PURPLE, "#a0457a", "X"),
    "original": (VERMILION, "#b34e00", "s"),
    "a": (AMBER, "#8f6200", "D"),
    "b": (BLUE, "#005f94", "v"),
    "c": (GREEN, "#00734f", "^"),
}
"""Colour, a darker shade for words on white, and marker of each row of a study."""
OTHER_WAY = ("#7f7f7f", "#5f5f5f", "P")
