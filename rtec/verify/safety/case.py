"""The safety case: every fault in every phase, a PC that runs away, and hours of random faults."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from statistics import median

from rtec.injector import Design
from rtec.jobs import JobPool
from rtec.machine.station_settings import InBox
from rtec.requester.supervision import SupervisionLimits
from rtec.units import PS_PER_MS, PS_PER_S
from rtec.verify.safety.matrix import Matrix, MatrixPlan, Outcome, Trial, is_wrong, run_matrix
from rtec.verify.safety.monitor import Stopper, sinusoidal_table
from rtec.verify.safety.phases import END_PS, Phase, new_cell
from rtec.verify.safety.soak import Episode, Soak, SoakPlan, run_soak

_SHARE_MATRIX = 0.97
_S_PER_TRIAL, _S_PER_HOUR = 0.03, 4.5
"""Of one processor, about: for the progress only."""
LIMIT_MM = 0.050
"""The healthy table stays within 30 um."""
_FROM_PS = 1_500 * PS_PER_MS
_EVERY_PS = 50 * PS_PER_MS
_RAMP_MM_S = 0.060
_STEPS = 60
_AFTER_STOP_PS = 400 * PS_PER_MS


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """What came of a PC whose prediction runs away by 60 um a second, for three seconds."""

    design: Design
    limit: str
    """``design``, ``limit``: of the box; which option was set, in words."""
    outcome: Outcome
    reason: str
    """``outcome``, ``reason``: what happened, and who stopped the machine."""
    off_mm: float
    """By how much the axis was off when the machine stopped, or is in the end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RampJob:
    """A PC that runs away, and what is set against it."""

    design: Design
    limit: str
    supervision: SupervisionLimits
    algorithm: InBox | None = None

    def run(self) -> Ramp:
        """Let it run away."""
        cell = new_cell(Phase.CUTTING, self.design, 0, supervision=self.supervision, algorithm=self.algorithm)
        cell.monitor(until_ps=_FROM_PS)
        for k in range(1, _STEPS + 1):
            cell.predict_by(sinusoidal_table(offset_mm=k * _RAMP_MM_S * _EVERY_PS / PS_PER_S))
            cell.monitor(until_ps=_FROM_PS + k * _EVERY_PS, stop_after_ps=_AFTER_STOP_PS)
        cell.monitor(until_ps=END_PS, stop_after_ps=_AFTER_STOP_PS)
        axes, stop = cell.monitored, cell.stop(None)
        if stop.by is not Stopper.NOBODY:
            outcome, off_counts = Outcome.SAFE_STOP, max(abs(axis.stop_counts) for axis in axes)
        else:
            wrong = any(is_wrong(axis, axis) for axis in axes)
            outcome = Outcome.UNDETECTED if wrong else Outcome.TOLERATED
            off_counts = max(abs(axis.asked_counts) for axis in axes)
        return Ramp(
            design=self.design, limit=self.limit, outcome=outcome, reason=stop.reason, off_mm=off_counts * 0.001
        )


def ramp_jobs(design: Design, algorithm: InBox | None = None) -> tuple[RampJob, ...]:
    """Return a PC that runs away without a limit, with the box's, and with its own."""
    steps = round(LIMIT_MM / (0.001 * design.step_counts))
    limits = {
        "none": SupervisionLimits(),
        f"limit_steps = {steps}": SupervisionLimits(limit_steps=steps),
        f"limit_mm = {LIMIT_MM}": SupervisionLimits(limit_mm=LIMIT_MM),
    }
    return tuple(
        RampJob(design=design, limit=limit, supervision=set_, algorithm=algorithm) for limit, set_ in limits.items()
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyCase:
    """What the runs show."""

    matrix: Matrix
    ramps: tuple[Ramp, ...]
    soak: Soak | None
    """``matrix``, ``ramps``, ``soak``: faults by phases, a PC that runs away, and the soak if one was asked for."""

    @property
    def good(self) -> bool:
        """Return whether no avoidable undetected error was found, and every fault that can be activated was."""
        return not self.reasons

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why the case is not good, a line each."""
        soak = self.soak
        found = [
            f"wrong without any fault: {phase.value}, design {design.value}, run {number}"
            for phase, design, number in self.matrix.unsound
        ]
        found += [
            f"undetected error: {trial.variant.name}, {trial.phase.value}, design {trial.design.value}, "
            f"run {trial.seed}"
            for trial in self.matrix.avoidable
            if trial.sound
        ]
        found += [
            f"never took effect: {variant.name}, {phase.value}; more --seeds meet it at other moments"
            for variant, phase in self.matrix.unproven
        ]
        found += [
            f"a PC that runs away, design {ramp.design.value}, limit {ramp.limit}: {ramp.outcome.value}"
            for ramp in self.ramps
            if (ramp.outcome is Outcome.UNDETECTED) != (ramp.limit == "none")
        ]
        if soak is not None:
            found += [
                f"soak, undetected error: design {episode.design.value}, episode {episode.number}: {episode.wrong}"
                for episode in soak.undetected()
            ]
            found += [f"soak, never took effect: {kind.value}" for kind in soak.missing]
        return tuple(found)

    def to_dict(self) -> dict[str, object]:
        """Return plain data under stable names."""
        matrix = self.matrix
        return {
            "good": self.good,
            "reasons": list(self.reasons),
            "seed": matrix.plan.seed,
            **({} if matrix.plan.algorithm is None else {"algorithm": matrix.plan.algorithm.name}),
            "trials": len(matrix.trials),
            "fired": sum(trial.fired > 0 for trial in matrix.trials),
            "outcomes": _by_value(trial.outcome for trial in matrix.trials if trial.fired > 0),
            "avoidable": [_trial_dict(trial) for trial in matrix.avoidable],
            "unproven": [{"fault": variant.name, "phase": phase.value} for variant, phase in matrix.unproven],
            "rows": [
                {
                    "fault": variant.name,
                    "class": variant.kind.words,
                    "upstream": variant.upstream,
                    "phase": phase.value,
                    "design": design.value,
                    "outcome": matrix.worst(variant, phase, [design]).value,
                }
                for variant in matrix.plan.variants
                for phase in matrix.plan.phases
                for design in matrix.plan.designs
            ],
            "ramps": [
                {
                    "design": ramp.design.value,
                    "limit": ramp.limit,
                    "outcome": ramp.outcome.value,
                    "off_mm": ramp.off_mm,
                }
                for ramp in self.ramps
            ],
            "soak": None if self.soak is None else _soak_dict(self.soak),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """How a fault is found out, over all trials in which it was."""

    reasons: tuple[str, ...]
    """Who stopped the machine and why, the most frequent first."""
    held: int
    """Trials in which it was held."""
    median_s: float | None
    longest_s: float | None
    """``median_s``, ``longest_s``: from the first effect to the stop; None where the axis was not even let go."""
    off_counts: float
    """Largest number of counts that a controller was off until then."""


def detection_of(trials: list[Trial]) -> Detection:
    """Return how the machine was stopped in these trials."""
    held = [trial for trial in trials if trial.outcome is Outcome.SAFE_STOP]
    times_s = [trial.detected_s for trial in held if trial.detected_s is not None]
    return Detection(
        reasons=tuple(reason for reason, _ in Counter(trial.reason for trial in held).most_common()),
        held=len(held),
        median_s=median(times_s) if times_s else None,
        longest_s=max(times_s, default=None),
        off_counts=max((trial.off_counts for trial in held), default=0.0),
    )


def make_case(
    plan: MatrixPlan,
    soak: SoakPlan | None = None,
    progress: Callable[[float], None] = lambda share: None,
    *,
    ramps: bool = True,
) -> SafetyCase:
    """Run everything; without ``ramps`` no PC that runs away."""
    trials = len(plan.designs) * len(plan.phases) * len(plan.variants) * plan.seeds
    first_s = trials * _S_PER_TRIAL
    whole_s = first_s + (0.0 if soak is None else soak.hours * _S_PER_HOUR)
    share = first_s / whole_s
    matrix = run_matrix(plan, lambda done: progress(done * share * _SHARE_MATRIX))
    with JobPool() as pool:
        jobs = [job for design in plan.designs if ramps for job in ramp_jobs(design, plan.algorithm)]
        ran_away = tuple(pool.results(jobs))
    soaked = None if soak is None else run_soak(soak, lambda done: progress(share + done * (1.0 - share)))
    progress(1.0)
    return SafetyCase(matrix=matrix, ramps=ran_away, soak=soaked)


def _trial_dict(trial: Trial) -> dict[str, object]:
    return {
        "fault": trial.variant.name,
        "phase": trial.phase.value,
        "design": trial.design.value,
        "seed": trial.seed,
        "off_counts": trial.off_counts,
        "left_counts": trial.left_counts,
    }


def _soak_dict(soak: Soak) -> dict[str, object]:
    return {
        "good": soak.good,
        "hours": soak.hours(),
        "hours_by_design": {design.value: soak.hours([design]) for design in Design},
        "episodes": len(soak.episodes),
        "outcomes": {outcome.value: count for outcome, count in soak.outcomes.items()},
        "fired": {kind.words: count for kind, count in soak.fired().items()},
        "missing": [kind.value for kind in soak.missing],
        "undetected": [{"design": e.design.value, "episode": e.number, "wrong": e.wrong} for e in soak.undetected()],
        "undetected_upstream": [_beyond_dict(e) for e in soak.undetected("before the box")],
        "undetected_with_processor": [_beyond_dict(e) for e in soak.undetected("with the processor")],
    }


def _beyond_dict(episode: Episode) -> dict[str, object]:
    faults = ", ".join(injected.variant.name for injected in episode.injected)
    return {"design": episode.design.value, "episode": episode.number, "wrong": episode.wrong, "fault": faults}


def _by_value(outcomes: Iterable[Outcome]) -> dict[str, int]:
    counted = Counter(outcomes)
    return {outcome.value: counted[outcome] for outcome in Outcome if counted[outcome]}
