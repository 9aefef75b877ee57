"""What an insertion algorithm owes, in numbers: the contract of a corrector (docs/algorithm.md)."""

from __future__ import annotations

from dataclasses import dataclass

from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError
from rtec.injector import Design, DesignRow
from rtec.units import PS_PER_S

STATES = ("00", "10", "11", "01")
"""The report's states 1 to 4 as the levels of A and B."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Contract:
    """What is asked of an algorithm.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> from rtec.injector import Design
    >>> Contract.of(Design.ORIGINAL).states, Contract.of(Design.C).states
    ((0,), (0, 1, 2, 3))
    >>> Contract(step_counts=2).quarter_ps
    500000
    """

    step_counts: int
    """Counts that one step of the total adds."""
    states: tuple[int, ...] = (0, 1, 2, 3)
    """Angle states 0..3 in which it inserts at rest; in the others it may wait for the axis to move."""
    frequency_hz: float = 500e3
    """Of the encoder's square waves: up to here every count has to be right, whether or not it inserts."""
    acceleration_hz_s: float = 1e8
    """How fast that frequency may change. 100 MHz/s is ten times gravity at a signal period of 1 um."""
    jitter: float = 0.1
    """By this share of the time between two edges at the highest frequency, two of them may come nearer."""
    separation_ps: int = 60_000
    """Shortest time from a change of A to one of B at the controller, or back. Nearer to each other its receiver
    cannot tell which came first: three samples at 50 MHz by default."""
    delay_ps: int = 50_000_000
    """Longest time for which the controller's count may differ from what it has to be."""
    turn_ps: int = 100_000
    """After a turn of the axis the line that has changed may change back this soon."""

    def __post_init__(self) -> None:
        whole_within("step_counts", self.step_counts, 1, 1000)
        if not self.states or any(state not in range(4) for state in self.states):
            raise ArgumentError("states", self.states, "some of the angle states 0 to 3")
        number_within("frequency_hz", self.frequency_hz, 1.0, 1e8)
        number_within("acceleration_hz_s", self.acceleration_hz_s, 1.0, 1e15)
        number_within("jitter", self.jitter, 0.0, 0.9)
        whole_within("separation_ps", self.separation_ps, 0, PS_PER_S // 1000)
        whole_within("delay_ps", self.delay_ps, 1, PS_PER_S)
        whole_within("turn_ps", self.turn_ps, 1, PS_PER_S // 1000)

    @classmethod
    def of(cls, design: DesignRow, **limits: float) -> Contract:
        """Return the contract of a design."""
        states = (0,) if design.one_state else (0, 1, 2, 3)
        return cls(step_counts=design.step_counts, states=states, **limits)  # type: ignore[arg-type]  # checked there

    @property
    def quarter_ps(self) -> int:
        """Return the time between two edges at the highest frequency."""
        return round(PS_PER_S / (4.0 * self.frequency_hz))


def design_with(step_counts: int, states: tuple[int, ...]) -> Design:
    """Return the design of the report that has this step, made in these states at rest.

    Raises
    ------
    ArgumentError
        There is none.

    Examples
    --------
    >>> design_with(4, (0,)), design_with(2, (0, 1, 2, 3))
    (<Design.ORIGINAL>, <Design.C>)
    """
    for design in Design:
        known = Contract.of(design)
        if (known.step_counts, known.states) == (step_counts, states):
            return design
    levels = ",".join(STATES[state] for state in states)
    allowed = "--step 4, 2 or 1 in all states, or --step 4 --states 00, as the boxes of the report have"
    raise ArgumentError("--step", f"{step_counts} in {levels}", allowed, problem="fits no box")


def states_of(text: str) -> tuple[int, ...]:
    """Read states written as levels of A and B: ``"00"``, ``"00,11"``, ``"all"``.

    Raises
    ------
    ArgumentError
        Anything else.

    Examples
    --------
    >>> states_of("00"), states_of("11, 01"), states_of("all")
    ((0,), (2, 3), (0, 1, 2, 3))
    """
    if text.strip().lower() == "all":
        return 0, 1, 2, 3
    words = [word.strip() for word in text.split(",")]
    if any(word not in STATES for word in words):
        raise ArgumentError("states", repr(text[:60]), "some of 00, 10, 11, 01 with commas between, or all")
    return tuple(sorted({STATES.index(word) for word in words}))
