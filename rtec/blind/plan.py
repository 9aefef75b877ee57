"""What the game measures: targets, order of the readings, feeds, dwells, and which columns the file holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtec.checks import number_within
from rtec.errors import unknown
from rtec.metrology import ExperimentPlan, Heating, Passes, Reading, Spacing, Weather
from rtec.metrology.experiment_plan import COLUMNS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PITCH_MM = 5.0
"""Of the screw that drives the axis; stated in every file."""
SIGNAL_PERIOD_MM = 2.0
"""Of the magnetic scale's signal; stated in every file."""
PROGRAM_STEP_MM = 0.001
"""Resolution of the control: targets are whole numbers of it."""
TARGET_ROOM_MM = 0.5 * PITCH_MM
"""By which a target may lie beside its place, so that no period of the screw hides."""
RECORDED = tuple(name for name in COLUMNS if name not in ("current", "voltage"))
"""What the emulated axis records of it."""
RIGID_MM = 1e-6
"""Over which what rubs bends before it slips, in a drive of which nothing is soft: gone within a reading."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan(ExperimentPlan):
    """A measuring plan of the game: what an experiment measures, within the limits of the emulated axis, and noise.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> PLANS["base"].readings
    210
    """

    name: str
    """In `PLANS`, or what was drawn."""
    presliding_mm: float = RIGID_MM
    """Over which what rubs in a drive bends before it slips."""
    right_forward: bool = False
    """Whether the control's own table keeps what is approached forward right: play is left to the other approach."""
    arm_level: bool = False
    """Whether a rotary axis is first measured where its arm lies about level, and its weight pulls."""
    sigma_um: float = 2.0
    """Standard deviation of the repeat noise."""
    sigma_n: float = 2.0
    """The same of a drive's force, in N."""
    wave_shares: tuple[float, float] = (0.14, 0.4)
    """Shortest and longest period, as shares of the span, of a wave that the screw does not make."""
    lost_share: float | None = None
    """Share of the readings after which counts go lost; None where it is drawn."""

    def __post_init__(self) -> None:
        """Check the ranges: those of any experiment, and those of the emulated axis."""
        ExperimentPlan.__post_init__(self)
        number_within("start_mm", self.start_mm, 5.0, 1e4, unit="mm")
        number_within("span_mm", self.span_mm, 10.0, 1e4, unit="mm")
        number_within("presliding_mm", self.presliding_mm, RIGID_MM, 10.0, unit="mm")
        number_within("overshoot_mm", self.overshoot_mm, 0.5, self.start_mm / 2.0, unit="mm")
        for feed in self.feeds_mm_s:
            number_within("feeds_mm_s", feed, 0.05, 90.0, unit="mm/s")
        number_within("dwell_s", self.dwell_s, 2.0, 100.0, unit="s")
        for dwell in self.turn_dwells_s:
            number_within("turn_dwells_s", dwell, 1.0, 1000.0, unit="s")
        for name in self.columns:
            if name not in RECORDED:
                raise unknown("columns", name, RECORDED, noun="column")
        number_within("sigma_um", self.sigma_um, 0.1, 100.0, unit="um")
        number_within("sigma_n", self.sigma_n, 0.1, 100.0, unit="N")
        for share in self.wave_shares:
            number_within("wave_shares", share, 0.01, 0.5)
        if self.lost_share is not None:
            number_within("lost_share", self.lost_share, 0.05, 0.95)

    @property
    def repeated(self) -> bool:
        """Whether places are passed again under the same conditions, so that there is a floor to judge by."""
        return self.runs > 1


_BASE = Plan(name="base")
_DRIVE = Plan(
    name="drive",
    reading=Reading.DRIVE,
    runs=2,
    targets=60,
    span_mm=100.0,
    feeds_mm_s=(2.0, 10.0, 30.0, 80.0),
    columns=("time", "velocity", "force"),
    wave_shares=(0.08, 0.2),
)
_ONE_SPEED = Plan(
    name="one_speed",
    reading=Reading.DRIVE,
    rotary=True,
    runs=1,
    passes=Passes.FORWARD,
    span_mm=25.0,
    feeds_mm_s=(5.0,),
    columns=("time", "velocity", "torque"),
)
_ALL = (
    _BASE,
    Plan(name="dwell", columns=("direction", "time", "dwell")),
    Plan(name="temperature", heating=Heating.COLD_AND_HOT, columns=("direction", "time", "temperature")),
    Plan(name="right_forward", right_forward=True),
    Plan(name="dense", spacing=Spacing.DENSE_AT_ENDS),
    Plan(
        name="moving",
        reading=Reading.MOVING,
        runs=2,
        targets=60,
        span_mm=100.0,
        feeds_mm_s=(5.0, 20.0, 60.0),
        columns=("time", "velocity"),
    ),
    _DRIVE,
    replace(_DRIVE, name="soft_drive", presliding_mm=0.5),
    replace(
        _DRIVE,
        name="joint",
        rotary=True,
        span_mm=150.0,
        columns=("time", "velocity", "torque"),
        wave_shares=(0.05, 0.12),
    ),
    _ONE_SPEED,
    replace(_DRIVE, name="loads", runs=3, targets=40, columns=("time", "velocity", "force", "load")),
    Plan(name="weather", runs=8, targets=15, weather=Weather.DAYS, columns=("direction", "pressure", "humidity")),
    Plan(
        name="one_day",
        runs=1,
        targets=41,
        passes=Passes.FORWARD,
        weather=Weather.ONE_DAY,
        columns=("direction", "time", "pressure", "humidity"),
    ),
    Plan(name="turn", rotary=True, runs=3, targets=36, span_mm=350.0),
    Plan(name="single_pass", runs=1, passes=Passes.FORWARD),
    Plan(name="one_feed", columns=("direction", "time", "feed")),
    Plan(name="turned_once", runs=1),
    Plan(name="two_runs", runs=2, passes=Passes.FORWARD, lost_share=0.5),
    Plan(name="sparse", runs=1, targets=7),
    Plan(
        name="one_way",
        runs=5,
        passes=Passes.FORWARD,
        spacing=Spacing.DENSE_AT_ENDS,
        span_mm=200.0,
        shifts_mm=(0.0, 50.0, 25.0, 100.0, 75.0),
    ),
    replace(_ONE_SPEED, name="one_pose", span_mm=10.0, arm_level=True),
    Plan(
        name="one_heating",
        runs=1,
        targets=41,
        passes=Passes.FORWARD,
        heating=Heating.ONE_RISE,
        columns=("direction", "time", "temperature"),
    ),
)
PLANS: Mapping[str, Plan] = MappingProxyType({plan.name: plan for plan in _ALL})
"""The plans by name: good ones, and the poor ones on which effects are confounded."""


def plan_named(name: str) -> Plan:
    """Return a plan by its name.

    Raises
    ------
    ArgumentError
        No plan has this name; the nearest is suggested.

    Examples
    --------
    >>> plan_named("turned_once").runs
    1
    """
    if name not in PLANS:
        raise unknown("plan", name, PLANS, noun="plan")
    return PLANS[name]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """A plan with everything drawn that the seed decides: the readings in the order in which they are taken."""

    plan: Plan
    """Where it comes from."""
    target_mm: Floats
    direction: NDArray[np.int8]
    run: Ints
    """Of each reading, shape (n,)."""
    feed_mm_s: Floats
    """Of the move to it."""
    turn_dwell_s: Floats
    """Rest before the last reversal."""

    @property
    def passes(self) -> Ints:
        """The number of the pass of each reading, as `passes_of` says, shape (n,)."""
        return passes_of(self.direction, self.run)


def passes_of(direction: NDArray[Any], run: Ints) -> Ints:
    """Return the number of the pass of each reading, from 0, shape (n,): one begins where run or direction change.

    Examples
    --------
    >>> passes_of(np.array([1.0, -1.0, 1.0, 1.0]), np.array([1, 1, 2, 2])).tolist()
    [0, 1, 2, 2]
    """
    begins = (np.diff(direction) != 0) | (np.diff(run) != 0)
    return np.concatenate([[0], np.cumsum(begins)])


def draw_course(plan: Plan, rng: np.random.Generator) -> Course:
    """Draw targets and dwells of a plan at rest.

    Notes
    -----
    Targets are even but for offsets of up to half the screw's pitch to either side (ISO 230-2, 4.3.1 asks for
    random offsets, so that periodic errors are sampled), and whole steps of the control.

    Examples
    --------
    >>> course = draw_course(PLANS["base"], np.random.default_rng(1))
    >>> course.target_mm.size, np.unique(course.target_mm).size
    (210, 21)
    """
    targets = _targets(plan, rng)
    dwells = np.geomspace(*plan.turn_dwells_s, max(plan.runs, 2))
    rng.shuffle(dwells)
    there = [(float(x), 1) for x in targets]
    back = [(float(x), -1) for x in targets[::-1]] if plan.passes is Passes.BOTH else []
    one = np.array(there + back)
    run = np.repeat(np.arange(1, plan.runs + 1), len(one))
    feeds, shifts = np.resize(plan.feeds_mm_s, plan.runs), np.resize(plan.shifts_mm, plan.runs)
    return Course(
        plan=plan,
        target_mm=np.round(np.tile(one[:, 0], plan.runs) + shifts[run - 1], 6),
        direction=np.tile(one[:, 1], plan.runs).astype(np.int8),
        run=run,
        feed_mm_s=feeds[run - 1],
        turn_dwell_s=np.round(dwells, 1)[run - 1],
    )


def _targets(plan: Plan, rng: np.random.Generator) -> Floats:
    """Return the targets of a forward pass, ascending."""
    if plan.spacing is Spacing.EVEN:
        places = np.linspace(0.0, 1.0, plan.targets)
    else:
        # half of them within the first quarter of the way from either end, ever closer to it
        share = np.linspace(-1.0, 1.0, plan.targets)
        places = 0.5 + 0.5 * np.sign(share) * (1.0 - (1.0 - np.abs(share)) ** 2)
    gap = float(np.diff(places).min()) * plan.span_mm
    offset = rng.uniform(-0.5, 0.5, plan.targets) * min(PITCH_MM, 0.8 * gap)
    steps = np.round((plan.start_mm + places * plan.span_mm + offset) / PROGRAM_STEP_MM)
    return np.round(steps * PROGRAM_STEP_MM, 6)
