"""The state tables that the code walks: a design asked for one step at rest, and the states that its lines pass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtec.injector.box import Injector, InjectorSettings
from rtec.injector.design import DesignRow
from rtec.injector.timing import Timing
from rtec.signal import STATES, EdgeStream, count_deltas, states_of_levels


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
        return f"{STATES[self.state - 1].a}{STATES[self.state - 1].b}"

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
    """Let a design insert one step at rest from every state, for both signs, and return what its lines do.

    A state in which it does not insert, such as all but state 1 of the Original, has no walk.

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
    made = (_walk(design, state.number, state.level, sign) for state in STATES for sign in (1, -1))
    return [walk for walk in made if walk is not None]


def _walk(design: DesignRow, state: int, level: int, sign: int) -> Walk | None:
    timing = Timing()
    box = Injector(InjectorSettings(design=design, timing=timing), initial=level)
    box.request(sign, at_ps=0)
    until_ps = 2 * (timing.rest_ps + timing.worst_ps(design))
    seen = box.process(EdgeStream([], [], initial=level), until_ps=until_ps)
    if box.insertions.completed != sign:
        return None
    before = np.concatenate([[level], seen.levels[:-1]])
    pairs = list(zip(before.tolist(), seen.levels.tolist(), strict=True))
    return Walk(
        state=state,
        sign=sign,
        states=tuple((states_of_levels(seen.levels).astype(int) + 1).tolist()),
        levels=tuple(f"{ab & 1}{ab >> 1}" for ab in seen.levels.tolist()),
        counts=tuple(np.cumsum(count_deltas(seen.levels, level)).tolist()),
        lines=tuple(_change(was, now) for was, now in pairs),
    )


def _change(before: int, after: int) -> str:
    """Return which line changes, and to which level."""
    lines = [f"{line}={after >> bit & 1}" for bit, line in enumerate("AB") if (before ^ after) >> bit & 1]
    return ",".join(lines)
