"""Every fault in every phase of operation, for every design: what the controller counts in the end."""

from __future__ import annotations

import enum
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rtec.checks import whole_within
from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.jobs import JobPool
from rtec.machine.fault_kinds import INSIDE_BOX
from rtec.machine.station_settings import InBox
from rtec.units import PS_PER_MS, PS_PER_S
from rtec.verify.safety.monitor import MonitoredAxis, MonitoredCell, Stopper
from rtec.verify.safety.phases import Phase, Twin, moment_within, new_cell, run_through, twin_of
from rtec.verify.safety.variants import VARIANTS, Variant, impossible

LATE_S = 0.25
"""Counts that are wrong for longer than this, and reported by nobody, are an undetected error, even if they come
right later."""
_SEEDS = 3


class Outcome(enum.Enum):
    """What happens at the controller, in ascending order of harm."""

    NOT_APPLICABLE = "not applicable"
    TOLERATED = "tolerated"
    DELAYED = "delayed"
    SAFE_STOP = "safe stop"
    UNDETECTED = "undetected"

    @property
    def harm(self) -> int:
        """Return the place in the order of harm."""
        return list(Outcome).index(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One fault in one phase."""

    variant: Variant
    phase: Phase
    design: Design
    seed: int
    """``variant``, ``phase``, ``design``, ``seed``: what was tried."""
    fired: int
    """How often the fault took effect."""
    outcome: Outcome
    """What happened at the controllers."""
    stopped_by: Stopper
    reason: str
    """``stopped_by``, ``reason``: who stopped the machine, and why; in words."""
    detected_s: float | None
    detected_ps: int | None
    """``detected_s``, ``detected_ps``: the stop, from the first effect and from the start; None: not stopped, or
    before the axis was let go."""
    encoder_counts: int
    controller_counts: int
    """``encoder_counts``, ``controller_counts``: in the end, of the axis that is off most, else of axis 1."""
    off_counts: float
    """Largest difference between a controller and the healthy prediction until the end or the stop, beyond that of
    the fault-free run."""
    left_counts: int
    """Counts that a controller is off at the end, by encoder and insertions."""
    drift_counts: int
    """Largest number of counts that a controller gained or lost on its encoder after the stop."""
    late_s: float
    """Time beyond the bound, more than in the fault-free run."""
    following_counts: float
    """What a check of the speed would have seen more than in the fault-free run."""
    sound: bool = True
    """Whether the fault-free run is right; else the fault shows nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixPlan:
    """What is tried.

    Raises
    ------
    ArgumentError
        No seed, or a negative one.
    """

    designs: Sequence[Design] = tuple(Design)
    phases: Sequence[Phase] = tuple(Phase)
    variants: Sequence[Variant] = VARIANTS
    """All combinations of them."""
    seeds: int = _SEEDS
    """Trials of each: other moments of the phase, other bits, other states at rest."""
    first: int = 0
    """Number of the first of them, which is its trial's seed."""
    seed: int = 1
    """Of all of them."""
    algorithm: InBox | None = None
    """In the boxes, in the place of the designs; None: the designs themselves."""

    def __post_init__(self) -> None:
        tried = [(variant, phase) for variant in self.variants for phase in self.phases]
        if tried and all(impossible(variant, phase) for variant, phase in tried):
            raise self._inapplicable()
        whole_within("seeds", self.seeds, 1, 1000)
        whole_within("first", self.first, 0, 999)
        whole_within("seed", self.seed, 0, (1 << 32) - 1)

    def concerns(self, variant: Variant, design: Design) -> bool:
        """Return whether the boxes have the part to which a fault happens."""
        unknown_inside = self.algorithm is not None and variant.kind in INSIDE_BOX
        return not unknown_inside and impossible(variant, Phase.CUTTING, design) is None

    def _inapplicable(self) -> ArgumentError:
        """Return what is wrong with faults of which none can take effect in any of the phases."""
        possible = [
            phase.value for phase in Phase if any(impossible(variant, phase) is None for variant in self.variants)
        ]
        names = ", ".join(phase.value for phase in self.phases)
        reasons = dict.fromkeys(impossible(variant, phase) for variant in self.variants for phase in self.phases)
        return ArgumentError(
            "phase", names, f"a phase in which it can take effect: {', '.join(possible)}",
            problem=f"is none for this fault ({'; '.join(reason for reason in reasons if reason)})",
        )  # fmt: skip

    @property
    def groups(self) -> list[tuple[str, list[Design]]]:
        """Return titles and designs of its tables: lines that pass beside the processor, and through it."""
        beside = [design for design in self.designs if not design.in_path]
        in_path = [design for design in self.designs if design.in_path]
        short = ", ".join(design.short for design in beside)
        first = f"{short}: the worst" if len(beside) > 1 else ", ".join(design.title for design in beside)
        titles = first, ", ".join(design.title for design in in_path)
        return [(title, group) for title, group in zip(titles, (beside, in_path), strict=True) if group]


@dataclass(frozen=True, slots=True, kw_only=True)
class Matrix:
    """What came of a plan."""

    plan: MatrixPlan
    trials: tuple[Trial, ...]

    def of(self, variant: Variant, phase: Phase, designs: Sequence[Design]) -> list[Trial]:
        """Return the trials of a fault in a phase that proved something."""
        return [
            trial
            for trial in self.trials
            if trial.variant is variant and trial.phase is phase and trial.design in designs and trial.fired > 0
        ]

    def worst(self, variant: Variant, phase: Phase, designs: Sequence[Design]) -> Outcome:
        """Return the most harmful outcome of a fault in a phase."""
        found = self.of(variant, phase, designs)
        return max(
            (trial.outcome for trial in found), key=lambda outcome: outcome.harm, default=Outcome.NOT_APPLICABLE
        )

    @property
    def avoidable(self) -> tuple[Trial, ...]:
        """Return the undetected errors that supervision can catch: those that begin at box, link or PC.

        Design B is held to the same, but for the lines that are lost with its processor.
        """
        return tuple(
            trial
            for trial in self.trials
            if trial.outcome is Outcome.UNDETECTED
            and trial.fired > 0
            and trial.variant.beyond_supervision(trial.design) is None
        )

    @property
    def unsound(self) -> tuple[tuple[Phase, Design, int], ...]:
        """Return phases, designs and numbers of the runs that are wrong without any fault."""
        found = ((trial.phase, trial.design, trial.seed) for trial in self.trials if not trial.sound)
        return tuple(dict.fromkeys(found))

    @property
    def unproven(self) -> tuple[tuple[Variant, Phase], ...]:
        """Return the faults that never took effect in a phase, although nothing speaks against it."""
        return tuple(
            (variant, phase)
            for variant in self.plan.variants
            for phase in self.plan.phases
            if impossible(variant, phase) is None
            and any(self.plan.concerns(variant, design) for design in self.plan.designs)
            and not self.of(variant, phase, self.plan.designs)
        )

    @property
    def good(self) -> bool:
        """Return whether no undetected error is avoidable, every fault took effect, and all is right without one."""
        return not self.avoidable and not self.unproven and not self.unsound


def run_matrix(plan: MatrixPlan, progress: Callable[[float], None] = lambda share: None) -> Matrix:
    """Try every fault of the plan in every phase."""
    jobs = [
        PhaseJob(plan=plan, phase=phase, design=design, seed=seed)
        for phase in plan.phases
        for design in plan.designs
        for seed in range(plan.first, plan.first + plan.seeds)
    ]
    trials: list[Trial] = []
    with JobPool() as pool:
        for done, some in enumerate(pool.results(jobs), start=1):
            trials += some
            progress(done / len(jobs))
    return Matrix(plan=plan, trials=tuple(trials))


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseJob:
    """All faults of a plan in one phase, at one seed."""

    plan: MatrixPlan
    phase: Phase
    design: Design
    seed: int

    def run(self) -> list[Trial]:
        """Try them."""
        phase, design, seed = self.phase, self.design, self.seed
        twin = twin_of(phase, design, seed, self.plan.algorithm)
        trials = []
        for variant, (moment_ps, bits) in moments(self.plan.seed, twin, phase, design, seed).items():
            if variant in self.plan.variants and self.plan.concerns(variant, design):
                fault = variant.fault(phase, moment_ps, bits)
                cell = new_cell(phase, design, seed, faults=(fault,), algorithm=self.plan.algorithm)
                run_through(cell, phase)
                trials.append(judged(variant, phase, design, seed, cell, twin.cell))
        return trials


def moments(plan_seed: int, twin: Twin, phase: Phase, design: Design, seed: int) -> dict[Variant, tuple[int, int]]:
    """Draw for every fault its moment in the phase, and its bits: one alone is injected as it is among the others."""
    generator = np.random.default_rng([plan_seed, list(Phase).index(phase), list(Design).index(design), seed])
    # the seed says which of the box's three frames is affected
    return {
        variant: (moment_within(twin, generator), seed + 3 * int(generator.integers(1 << 30))) for variant in VARIANTS
    }


def judged(
    variant: Variant, phase: Phase, design: Design, seed: int, cell: MonitoredCell, twin: MonitoredCell
) -> Trial:
    """Return what a run shows beside its fault-free twin."""
    fired = cell.fired[0]
    axes, healthy = cell.monitored, twin.monitored
    stop = cell.stop(fired.first_ps)
    off = max(0.0, *(axis.worst_counts - other.worst_counts for axis, other in zip(axes, healthy, strict=True)))
    late_s = max(0.0, *(axis.late_s - other.late_s for axis, other in zip(axes, healthy, strict=True)))
    if stop.by is not Stopper.NOBODY:
        outcome = Outcome.SAFE_STOP
    elif any(is_wrong(axis, other) for axis, other in zip(axes, healthy, strict=True)):
        outcome = Outcome.UNDETECTED
    elif off > 1.0 or late_s > 5 * PS_PER_MS / PS_PER_S:
        outcome = Outcome.DELAYED
    else:
        outcome = Outcome.TOLERATED
    worst = max(axes, key=lambda axis: abs(axis.off_counts))
    return Trial(
        variant=variant, phase=phase, design=design, seed=seed, fired=fired.times, outcome=outcome,
        stopped_by=stop.by, reason=stop.reason, detected_s=stop.detected_s, detected_ps=stop.at_ps,
        encoder_counts=worst.encoder_counts, controller_counts=worst.controller_counts, off_counts=off,
        left_counts=worst.off_counts, late_s=late_s,
        drift_counts=max((axis.drift_counts for axis in axes), key=abs),
        following_counts=max(
            axis.following_counts - other.following_counts for axis, other in zip(axes, healthy, strict=True)
        ),
        sound=_is_sound(healthy, design),
    )  # fmt: skip


def _is_sound(healthy: Sequence[MonitoredAxis], design: Design) -> bool:
    """Return whether a fault-free run is right: every count, and nothing owed but by an axis that waits for 00."""
    owing = [axis.pending_steps != 0 for axis in healthy]
    owes = all(owing) if design.one_state else any(owing)
    return not owes and not any(is_wrong(axis, axis) for axis in healthy)


def is_wrong(axis: MonitoredAxis, twin: MonitoredAxis) -> bool:
    """Return whether an axis at rest, which nobody has stopped, has wrong counts, or had them for long."""
    counts = axis.off_counts != 0 or axis.uninserted_counts != 0
    total = abs(axis.asked_counts) > axis.bound_counts
    pending = axis.pending_steps != 0 and twin.pending_steps == 0
    return counts or total or pending or axis.wrong_s > twin.wrong_s + LATE_S or axis.checks == 0
