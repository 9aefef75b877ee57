"""What an experiment on an axis measures: targets, runs, feeds, rests, heat, weather, and what is recorded.

It is what a person at a machine carries out to tell effects apart, read from a page of TOML
(`rtec.metrology.experiment_file`). The motion program that a study sends to its control is another thing
(`rtec.metrology.MeasuringPlan`).
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError, unknown

COLUMNS = (
    "direction", "time", "feed", "velocity", "dwell", "temperature", "pressure", "humidity", "load", "force",
    "torque", "current", "voltage",
)  # fmt: skip
"""What can be recorded beside run, target and actual position."""
MOST_READINGS = 20_000
MOST_IN_TURN = 20
"""Feeds, shifts and loads."""
LONGEST_S = {"at rest": 5 * 86_400.0, "in motion": 7200.0}
"""Of a whole experiment; a reading in motion comes many times a second."""
_FARTHEST_MM = 1e5
_SLOWEST_MM_S, _FASTEST_MM_S = 1e-6, 5e3
_LONGEST_REST_S = 86_400.0
_HEAVIEST_KG = 1e5


class Passes(enum.Enum):
    """In which directions the targets are visited in each run."""

    BOTH = "both directions"
    FORWARD = "forward only"


class Spacing(enum.Enum):
    """How the targets lie."""

    EVEN = "even"
    """But for offsets of up to half the screw's pitch, so that nothing periodic hides (ISO 230-2, 4.3.1)."""
    DENSE_AT_ENDS = "dense after reversals"


class Strokes(enum.Enum):
    """How a log in motion moves."""

    SHORT = "short strokes"
    """To and fro, of drawn lengths, the feeds in turn."""
    FULL = "from end to end"
    """In both directions at each feed."""


class Heating(enum.Enum):
    """What the temperature of the machine does."""

    NONE = "steady"
    COLD_AND_HOT = "cold and hot in turn"
    """Each run after another state of the machine."""
    ONE_RISE = "rising"


class Weather(enum.Enum):
    """What the air around the laser does."""

    STEADY = "steady"
    """At the pressure and humidity that the laser assumes."""
    DAYS = "another day for each run"
    ONE_DAY = "of one day"


class Reading(enum.Enum):
    """What is read, and when."""

    AT_REST = "position at rest"
    MOVING = "position in motion"
    DRIVE = "force in motion"
    """Force, torque or current of the drive."""


class Zero(enum.Enum):
    """When the zero (reflector, indicator, counter) is set."""

    ANEW = "set anew before each run"
    KEPT = "kept from the last run but one to the last"


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentPlan:
    """What is measured on an axis, and how.

    Parameters
    ----------
    reading
        At rest at targets, or in motion the position or the force.
    runs
        Number of runs; of a log in motion, repetitions of the program.
    targets
        Of one pass; moves of one run in short strokes.
    start_mm, span_mm
        First target, and distance to the last (at least 1e-3).
    shifts_mm
        By which the targets are moved, run by run in turn.
    passes, spacing, strokes, heating, weather, zero
        How the targets are visited, how they lie, how a log moves, what temperature and air do, when the zero is set.
    rotary
        Whether the axis turns: what is in mm stands for degrees, what is in N for N m.
    overshoot_mm
        How far the axis goes beyond the first target of a pass, to come to it in the direction of the pass.
    feeds_mm_s
        Of the runs in turn; of the moves of a log in turn.
    dwell_s
        Rest at each target.
    turn_dwells_s
        Shortest and longest rest before a reversal; each run has another one.
    loads_kg
        On the axis, run by run in turn; empty where it carries what it carries.
    columns
        Of `COLUMNS`, beyond run, target and actual position.

    Raises
    ------
    ArgumentError
        A value outside its range, more readings than `MOST_READINGS`, or longer than `LONGEST_S`.

    Examples
    --------
    >>> ExperimentPlan(runs=5, targets=21).readings
    210
    """

    reading: Reading = Reading.AT_REST
    runs: int = 5
    targets: int = 21
    start_mm: float = 20.0
    span_mm: float = 300.0
    shifts_mm: tuple[float, ...] = (0.0,)
    passes: Passes = Passes.BOTH
    spacing: Spacing = Spacing.EVEN
    strokes: Strokes = Strokes.SHORT
    heating: Heating = Heating.NONE
    weather: Weather = Weather.STEADY
    zero: Zero = Zero.ANEW
    rotary: bool = False
    overshoot_mm: float = 1.0
    feeds_mm_s: tuple[float, ...] = (40.0,)
    dwell_s: float = 6.0
    turn_dwells_s: tuple[float, float] = (2.0, 60.0)
    loads_kg: tuple[float, ...] = ()
    columns: tuple[str, ...] = ("direction", "time")

    def __post_init__(self) -> None:
        unit = "deg" if self.rotary else "mm"
        whole_within("runs", self.runs, 1, 99)
        whole_within("targets", self.targets, 2, 2000)
        number_within("start_mm", self.start_mm, -_FARTHEST_MM, _FARTHEST_MM, unit=unit)
        number_within("span_mm", self.span_mm, 1e-3, _FARTHEST_MM, unit=unit)
        number_within("overshoot_mm", self.overshoot_mm, 0.0, _FARTHEST_MM, unit=unit)
        for shift in _in_turn("shifts_mm", self.shifts_mm):
            number_within("shifts_mm", shift, -self.span_mm, self.span_mm, unit=unit)
        for feed in _in_turn("feeds_mm_s", self.feeds_mm_s):
            number_within("feeds_mm_s", feed, _SLOWEST_MM_S, _FASTEST_MM_S, unit=f"{unit}/s")
        number_within("dwell_s", self.dwell_s, 0.0, _LONGEST_REST_S, unit="s")
        if len(self.turn_dwells_s) != 2:
            raise ArgumentError("turn_dwells_s", f"{len(self.turn_dwells_s)} times", "the shortest and the longest")
        for dwell in self.turn_dwells_s:
            number_within("turn_dwells_s", dwell, 0.0, _LONGEST_REST_S, unit="s")
        for load in _in_turn("loads_kg", self.loads_kg, fewest=0):
            number_within("loads_kg", load, 0.0, _HEAVIEST_KG, unit="kg")
        self._check_columns()
        self._check_size()

    def _check_columns(self) -> None:
        for name in self.columns:
            if name not in COLUMNS:
                raise unknown("columns", str(name), COLUMNS, noun="column")
        if len(set(self.columns)) != len(self.columns):
            raise ArgumentError("columns", ", ".join(self.columns), "each once")

    def _check_size(self) -> None:
        if self.in_motion and self.passes is Passes.FORWARD and self.runs > 1:
            raise ArgumentError("runs", self.runs, "1 where a log in motion goes forward only")
        whole_within("readings (runs times targets)", self.readings, 1, MOST_READINGS)
        kind = "in motion" if self.in_motion else "at rest"
        number_within(f"duration {kind}", self.duration_s, 0.0, LONGEST_S[kind], unit="s")

    @property
    def readings(self) -> int:
        """Number of readings at rest; in motion, of moves."""
        return self.runs * self.targets * (2 if self.passes is Passes.BOTH else 1)

    @property
    def in_motion(self) -> bool:
        """Whether the axis moves while it is read."""
        return self.reading is not Reading.AT_REST

    @property
    def end_mm(self) -> float:
        """Where the last target would lie without its offset."""
        return self.start_mm + self.span_mm

    @property
    def duration_s(self) -> float:
        """How long the experiment takes at least, in s, ramps aside."""
        ways = 2.0 if self.passes is Passes.BOTH else 1.0
        over = [self.span_mm / feed for feed in self.feeds_mm_s]
        if self.in_motion and self.strokes is Strokes.FULL:
            return self.runs * ways * sum(over)
        moving_s = ways * sum(over) / len(over)
        if self.in_motion:
            return self.runs * moving_s
        return self.runs * (moving_s + ways * (self.targets * self.dwell_s + max(self.turn_dwells_s)))


def _in_turn(name: str, values: tuple[float, ...], *, fewest: int = 1) -> tuple[float, ...]:
    whole_within(f"number of {name}", len(values), fewest, MOST_IN_TURN)
    return values
