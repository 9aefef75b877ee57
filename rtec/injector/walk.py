"""The state tables of the designs: the states that the lines pass when a design inserts a step at rest.

The box walks the same ones in machine code (`rtec.injector._insertion_kernels`); tests compare the two.
"""

from __future__ import annotations

from dataclasses import dataclass

from rtec.injector.design import DesignRow

LEVELS = ("00", "10", "11", "01")
"""Levels of A and B in states 1 to 4: one count from each to the next, and from the last to the first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Walk:
    """What one insertion does to the lines."""

    state: int
    """The encoder's, 1..4 as the report counts; the lines pass unchanged before."""
    sign: int
    """+1 or -1: whether counts are added."""
    states: tuple[int, ...]
    """Of the controller, one after the other."""
    levels: tuple[str, ...]
    """The same as levels of A and B, such as ``10``."""
    counts: tuple[int, ...]
    """Of the controller, after each."""
    lines: tuple[str, ...]
    """What each change is, such as ``A=1``."""

    @property
    def start_levels(self) -> str:
        """Return the encoder's levels of A and B."""
        return LEVELS[self.state - 1]

    def to_dict(self) -> dict[str, object]:
        """Return it as plain data."""
        return {
            "state": self.state,
            "start_levels": self.start_levels,
            "sign": "+" if self.sign > 0 else "-",
            "states": list(self.states),
            "levels": list(self.levels),
            "counts": list(self.counts),
            "changes": list(self.lines),
        }


def walks(design: DesignRow) -> list[Walk]:
    """Return what one insertion at rest does to the lines, from every state and for both signs.

    Each change is a count: a step of the design is so many neighbouring states. A state in which it does not insert,
    such as all but state 1 of the Original, has no walk.

    Parameters
    ----------
    design
        Of the report, or one's own.

    Examples
    --------
    >>> from rtec.injector.design import Design
    >>> [(walk.start_levels, walk.sign, walk.levels) for walk in walks(Design.C)][:2]
    [('00', 1, ('10', '11')), ('00', -1, ('01', '11'))]
    >>> {walk.start_levels for walk in walks(Design.ORIGINAL)}
    {'00'}
    """
    states = range(1) if design.one_state else range(len(LEVELS))
    return [_walk(design, state, sign) for state in states for sign in (1, -1)]


def _walk(design: DesignRow, state: int, sign: int) -> Walk:
    counts = [sign * k for k in range(1, design.step_counts + 1)]
    states = [(state + count) % len(LEVELS) for count in counts]
    levels = [LEVELS[now] for now in states]
    return Walk(
        state=state + 1,
        sign=sign,
        states=tuple(now + 1 for now in states),
        levels=tuple(levels),
        counts=tuple(counts),
        lines=tuple(map(_change, [LEVELS[state], *levels], levels)),
    )


def _change(before: str, after: str) -> str:
    """Return which line changes, and to which level."""
    return ",".join(f"{line}={now}" for line, was, now in zip("AB", before, after, strict=True) if was != now)
