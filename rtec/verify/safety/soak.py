"""Hours of cutting on three axes with random faults of every class: the counts are right, or the machine is held.

The time is run in episodes. Each has its own programs, its own error table, and faults of box, link and PC one after
the other at random moments, or one fault of the encoder; it ends when its programs do, or soon after the machine is
held. Only the time that was run counts.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rtec.checks import number_within, whole_within
from rtec.injector import Design
from rtec.injector.design import BESIDE, IN_PATH
from rtec.jobs import JobPool
from rtec.machine.fault_kinds import INSIDE_BOX
from rtec.machine.faults import Fault, FaultKind, FaultPlace, FaultRow, Trigger
from rtec.machine.station_settings import InBox
from rtec.predictors import Predictor
from rtec.units import PS_PER_MS, PS_PER_S
from rtec.verify.safety.matrix import Outcome
from rtec.verify.safety.monitor import (
    MonitoredAxis,
    MonitoredCell,
    Stopper,
    sinusoidal_table,
    station_settings,
)
from rtec.verify.safety.phases import Order, Orders, Phase, carry_out
from rtec.verify.safety.soak_program import Programs, draw_orders, draw_programs
from rtec.verify.safety.variants import VARIANTS, Variant

AXES = 3
_SHARE_OF_B = 0.1
"""Of the hours, in addition: the design that the report only sketches."""
_WRONG_S = 0.5
_HOT_MM = 0.05
_SLICE_PS = 5 * PS_PER_MS
_AFTER_STOP_PS = 400 * PS_PER_MS
_GAP_S = 60.0
"""Between faults of an episode, on average."""
_SHARE_UPSTREAM = 0.2
_BATCH = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class SoakPlan:
    """How long, and with which seed.

    Raises
    ------
    ArgumentError
        A value outside its range.
    """

    hours: float = 100.0
    """Of cutting, the Original and Designs A and C together; Design B runs a tenth of it in addition."""
    episode_s: float = 240.0
    """Length of an episode in which nothing stops the machine."""
    seed: int = 1
    """Of everything."""
    threads: int = 2
    """That run episodes at the same time; the result is the same with any number."""
    only: Design | None = None
    """All hours with this design."""
    algorithm: InBox | None = None
    """In the boxes, in the place of the design."""

    def __post_init__(self) -> None:
        number_within("hours", self.hours, 1e-3, 1e5, unit="h")
        number_within("episode_s", self.episode_s, 20.0, 3600.0, unit="s")
        whole_within("seed", self.seed, 0, (1 << 32) - 1)
        whole_within("threads", self.threads, 1, 64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Injected:
    """A fault that took effect."""

    variant: Variant
    phase: Phase
    axis: int
    """``variant``, ``phase``, ``axis``: what, and during what, where."""
    activated_ps: int
    """When it first took effect; of lines and word within 5 ms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """What came of one episode."""

    number: int
    """Gives the episode again, with the plan's seed."""
    design: Design
    """Of all three boxes."""
    run_s: float
    """Simulated time."""
    injected: tuple[Injected, ...]
    """Faults that took effect, in the order of their beginnings."""
    unfired: tuple[Variant, ...]
    """Faults that began and found nothing to act on."""
    outcome: Outcome
    """TOLERATED, SAFE_STOP or UNDETECTED."""
    reason: str
    """Who held it, and why."""
    detected_s: float | None
    """From the effect of the last fault to the stop."""
    off_counts: float
    """By how many counts a controller was off the healthy prediction when it stopped."""
    wrong: str
    """What was wrong, in words."""
    left_counts: int
    following_counts: float
    """``left_counts``, ``following_counts``: counts by which a controller is off in the end, and what a check of the
    speed would have seen."""
    checks: int
    """Looks at an axis at rest at which every count was right."""
    travel_mm: float

    @property
    def beyond_supervision(self) -> str | None:
        """Return where the wrong counts begin that no box or PC can catch; None: whatever is wrong is avoidable."""
        found = [injected.variant.beyond_supervision(self.design) for injected in self.injected]
        return next((where for where in found if where is not None), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Soak:
    """What came of all episodes."""

    plan: SoakPlan
    episodes: tuple[Episode, ...]

    def hours(self, designs: Sequence[Design] = tuple(Design)) -> float:
        """Return the time run with these designs."""
        return sum(episode.run_s for episode in self.episodes if episode.design in designs) / 3600.0

    def fired(self) -> Counter[FaultRow]:
        """Return how many faults of each class took effect."""
        return Counter(injected.variant.kind for episode in self.episodes for injected in episode.injected)

    @property
    def outcomes(self) -> Counter[Outcome]:
        """Return how the episodes ended."""
        return Counter(episode.outcome for episode in self.episodes)

    def undetected(self, where: str | None = None) -> tuple[Episode, ...]:
        """Return the episodes with an undetected error: the avoidable ones, or those that begin elsewhere."""
        wrong = (episode for episode in self.episodes if episode.outcome is Outcome.UNDETECTED)
        return tuple(episode for episode in wrong if episode.beyond_supervision == where)

    @property
    def missing(self) -> tuple[FaultKind, ...]:
        """Return the classes of which no fault took effect."""
        fired = self.fired()
        return tuple(kind for kind in FaultKind if fired[kind] == 0)

    @property
    def good(self) -> bool:
        """Return whether no count was wrong undetected, and every class took effect."""
        return not self.undetected() and not self.missing


def run_soak(plan: SoakPlan, progress: Callable[[float], None] = lambda share: None) -> Soak:
    """Run the hours of the plan."""
    shares = {design: plan.hours / len(BESIDE) for design in BESIDE}
    shares |= dict.fromkeys(IN_PATH, plan.hours * _SHARE_OF_B)
    shares = shares if plan.only is None else {plan.only: plan.hours}
    whole_s = sum(shares.values()) * 3600.0
    episodes: list[Episode] = []
    with JobPool(plan.threads) as pool:
        for design, hours in shares.items():
            ran_s, number = 0.0, 0
            while ran_s < hours * 3600.0:
                # an episode may end early, so that more may be wanted than whole ones fit into the rest
                batch = min(max(math.ceil((hours * 3600.0 - ran_s) / plan.episode_s), plan.threads), _BATCH)
                some = [EpisodeJob(plan=plan, design=design, number=n) for n in range(number, number + batch)]
                for episode in pool.results(some):
                    if ran_s < hours * 3600.0:
                        episodes.append(episode)
                        ran_s += episode.run_s
                number += batch
                progress(min(sum(episode.run_s for episode in episodes) / whole_s, 1.0))
    return Soak(plan=plan, episodes=tuple(episodes))


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeJob:
    """One episode of a soak; plan, design and number are its seed."""

    plan: SoakPlan
    design: Design
    number: int

    def run(self) -> Episode:
        """Run it."""
        length_s = self.plan.episode_s
        generator = np.random.default_rng([self.plan.seed, list(Design).index(self.design), self.number])
        programs = draw_programs(generator, axes=AXES, length_s=length_s)
        amplitude_mm, backlash_mm = float(generator.uniform(0.005, 0.025)), float(generator.uniform(0.0, 0.015))
        table, hot = (
            sinusoidal_table(amplitude_mm=amplitude_mm, backlash_mm=backlash_mm, offset_mm=offset_mm)
            for offset_mm in (0.0, _HOT_MM)
        )
        orders = draw_orders(generator, length_s=length_s)
        drawn = _draw_faults(generator, length_s)
        cell = MonitoredCell(
            [station_settings(axis, self.design, algorithm=self.plan.algorithm) for axis in range(1, AXES + 1)],
            programs.moves,
            table,
            faults=[fault for _, _, fault in drawn],
            slice_ps=_SLICE_PS,
        )
        phases = _run(cell, programs, orders, drawn, hot)
        return _concluded(cell, self.design, self.number, drawn, phases)


Drawn = list[tuple[Variant, int, Fault]]


def _draw_faults(generator: np.random.Generator, length_s: float) -> Drawn:
    """Return one fault of the encoder, or those of box, link and PC one after the other."""
    upstream = [variant for variant in VARIANTS if variant.upstream]
    others = [variant for variant in VARIANTS if not variant.upstream and variant.kind not in INSIDE_BOX]
    if generator.random() < _SHARE_UPSTREAM:
        at_s = float(generator.uniform(0.0, 0.9 * length_s))
        return [_draw_fault(generator, upstream, at_s, set())]
    drawn: Drawn = []
    taken: set[int] = set()
    at_s = float(generator.exponential(_GAP_S / 2.0)) if generator.random() < 0.9 else 0.0
    while at_s < 0.9 * length_s:
        drawn.append(_draw_fault(generator, others, at_s, taken))
        at_s += 3.0 + float(generator.exponential(_GAP_S))
    return drawn


def _draw_fault(
    generator: np.random.Generator, variants: Sequence[Variant], at_s: float, taken: set[int]
) -> tuple[Variant, int, Fault]:
    """Return a random fault at a time; one fault a box and episode, so that each can be told by its effect."""
    known = {variant.kind for variant in variants}
    kinds = sorted((kind for kind in FaultKind if kind in known), key=lambda kind: kind.code)
    while True:
        kind = kinds[int(generator.integers(len(kinds)))]
        some = [variant for variant in variants if variant.kind is kind]
        variant = some[int(generator.integers(len(some)))]
        axis = 1 + int(generator.integers(AXES))
        at_axis = variant.kind.place is FaultPlace.AXIS
        if not at_axis or axis not in taken:
            break
    inserting = at_axis and bool(generator.random() < 0.5)
    at_ps = max(int(at_s * PS_PER_S), 1) + int(generator.integers(10 * PS_PER_MS))
    fault = variant.fault(Phase.CUTTING, at_ps, int(generator.integers(1 << 30)), axis=axis)
    if at_axis:
        taken.add(axis)
    if inserting:
        until_ps = None if fault.until_ps is None else fault.until_ps + 5_000 * PS_PER_MS
        fault = replace(fault, until_ps=until_ps, trigger=Trigger.WHILE_INSERTING)
    return variant, axis, fault


def _run(cell: MonitoredCell, programs: Programs, orders: Orders, drawn: Drawn, hot: Predictor) -> list[Phase]:
    """Run an episode to its end or its stop; return the phase of each fault that began."""
    phases: list[Phase] = []
    began = sorted({fault.from_ps for _, _, fault in drawn})
    end_ps = programs.end_ps
    times = sorted({*began, *(at_ps for at_ps, _ in orders), end_ps})
    doing = dict(orders)
    at_fault = {fault.from_ps: (axis, fault.trigger) for _, axis, fault in drawn}
    probing, large_ps = False, -(10**15)
    for at_ps in times:
        cell.monitor(until_ps=at_ps, stop_after_ps=_AFTER_STOP_PS)
        if cell.now_ps < at_ps:
            break
        if at_ps in at_fault:
            axis, trigger = at_fault[at_ps]
            phase = Phase.LARGE if at_ps - large_ps < 100 * PS_PER_MS else _phase(cell, axis, probing)
            phases.append(Phase.INSERTION if trigger is Trigger.WHILE_INSERTING else phase)
        order = doing.get(at_ps)
        if order is None or (order is Order.LARGE and probing):
            continue
        if order is Order.LARGE:
            large_ps = at_ps
        else:
            probing = order is Order.PROBE
        carry_out(cell, order, hot)
    if any(axis.stop_ps is not None for axis in cell.monitored):
        cell.settle()
    return phases


def _phase(cell: MonitoredCell, axis: int, probing: bool) -> Phase:
    speed_mm_s = abs(cell.axes[axis - 1].view.speed_mm_s)
    if not cell.running:
        return Phase.START_UP
    if probing:
        return Phase.PROBING
    if speed_mm_s > 10.0:
        return Phase.RAPID
    return Phase.AT_REST if speed_mm_s == 0.0 else Phase.CUTTING


def _concluded(cell: MonitoredCell, design: Design, number: int, drawn: Drawn, phases: list[Phase]) -> Episode:
    axes = cell.monitored
    injected, unfired = [], []
    last_ps = None
    for (variant, axis, _), phase, activation in zip(drawn, phases, cell.fired, strict=False):
        if activation.first_ps is None:
            unfired.append(variant)
            continue
        injected.append(Injected(variant=variant, phase=phase, axis=axis, activated_ps=activation.first_ps))
        last_ps = max(last_ps or 0, activation.first_ps)
    stop, wrong = cell.stop(last_ps), ""
    outcome = Outcome.SAFE_STOP
    if stop.by is Stopper.NOBODY:
        wrong = "; ".join(
            f"axis {i}: {words}" for i, axis in enumerate(axes, start=1) if (words := flaw(axis, design))
        )
        outcome = Outcome.UNDETECTED if wrong else Outcome.TOLERATED
    return Episode(
        number=number, design=design, run_s=cell.now_ps / PS_PER_S, injected=tuple(injected), unfired=tuple(unfired),
        outcome=outcome, reason=stop.reason, detected_s=stop.detected_s, wrong=wrong,
        off_counts=max(abs(axis.stop_counts) for axis in axes),
        left_counts=max((axis.off_counts for axis in axes), key=abs),
        following_counts=max(axis.following_counts for axis in axes), checks=sum(axis.checks for axis in axes),
        travel_mm=sum(axis.travel_mm for axis in cell.axes),
    )  # fmt: skip


def flaw(axis: MonitoredAxis, design: Design) -> str:
    """Return what is wrong at an axis at rest that nobody has stopped; empty where nothing is."""
    if axis.off_counts != 0 or axis.uninserted_counts != 0:
        return f"{axis.off_counts} counts of the encoder, {axis.uninserted_counts} of the insertions are wrong"
    if abs(axis.asked_counts) > axis.bound_counts:
        return f"the total is off by {axis.asked_counts:.1f} counts"
    if axis.pending_steps != 0 and not design.one_state:  # the Original waits for both lines to be low
        return f"{axis.pending_steps} steps are never inserted"
    if axis.wrong_s > _WRONG_S:
        return f"wrong by {axis.wrong_counts:.1f} counts for {axis.wrong_s:.2f} s"
    return "" if axis.checks else "never seen at rest"
