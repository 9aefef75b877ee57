"""Faults in phases, and episodes of a soak, as jobs of a campaign."""

from __future__ import annotations

from functools import lru_cache

from rtec.injector import Design
from rtec.machine.fault_kinds import FaultPlace
from rtec.verify.campaign.job import (
    EXEMPT,
    FAILED,
    NOT_ACTIVATED,
    PASSED,
    Choice,
    JobKind,
    Number,
    Parameters,
    Record,
)
from rtec.verify.safety.matrix import Outcome, Trial, judged, moments
from rtec.verify.safety.phases import Phase, Twin, hyphened, new_cell, run_through, twin_of
from rtec.verify.safety.soak import Episode, EpisodeJob, SoakPlan
from rtec.verify.safety.threats import THREATS
from rtec.verify.safety.variants import VARIANTS, Variant, impossible


def _word(variant: Variant) -> str:
    return hyphened(variant.name.replace(",", ""))


_VARIANTS = {_word(variant): variant for variant in VARIANTS}
_PHASES = {hyphened(phase.value): phase for phase in Phase}
_NONE = "none"
_CLASSES = {
    "place": {word: variant.kind.place.value.lower() for word, variant in _VARIANTS.items()},
    "category": {word: hyphened(variant.kind.category.value) for word, variant in _VARIANTS.items()},
    "threat": {word: THREATS[variant.kind].value for word, variant in _VARIANTS.items() if variant.kind in THREATS},
}
_DESIGN = Choice(name="design", words=tuple(design.value for design in Design))


@lru_cache(maxsize=4)
def _twin(phase: Phase, design: Design, run: int) -> Twin:
    """Return the run without a fault, which all faults of a phase share."""
    return twin_of(phase, design, run)


def inject(parameters: Parameters, seed: int, run: int) -> Record:
    """Inject one fault, or two, at random moments of a phase: one trial of ``rtec safety``, with the same numbers.

    Parameters
    ----------
    parameters
        ``design``, ``phase``, ``fault``, ``second`` (another fault, or none): words. Of two, each comes at the moment
        at which it comes alone; times of detection count from the first effect of ``fault``.
    seed, run
        Of the plan; number of the run, which chooses moment, bits and state at rest.

    Examples
    --------
    >>> words = {"design": "c", "phase": "cutting", "fault": "pc-killed", "second": "none"}
    >>> record = inject(words, seed=1, run=0)
    >>> record["result"], record["outcome"], record["stopped_by"]
    ('passed', 'safe stop', 'box')
    """
    design, phase = Design.named(str(parameters["design"])), _PHASES[str(parameters["phase"])]
    twin = _twin(phase, design, run)
    drawn = moments(seed, twin, phase, design, run)
    both = [_VARIANTS[word] for name in ("fault", "second") if (word := str(parameters[name])) != _NONE]
    cell = new_cell(phase, design, run, faults=tuple(variant.fault(phase, *drawn[variant]) for variant in both))
    run_through(cell, phase)
    trial = judged(both[0], phase, design, run, cell, twin.cell)
    record = trial_record(trial) | {"moment_ps": drawn[both[0]][0]}
    if len(both) == 1:
        return record
    beyond = next((where for one in both if (where := one.beyond_supervision(design)) is not None), None)
    activated = all(one.times > 0 for one in cell.fired)
    return record | {
        "result": FAILED if trial.twin_fault else _result(trial.outcome, beyond, activated=activated),
        "beyond_supervision": beyond,
        "second_fired": cell.fired[1].times,
        "second_moment_ps": drawn[both[1]][0],
    }


def _result(outcome: Outcome, beyond: str | None, *, activated: bool) -> str:
    if outcome is Outcome.UNDETECTED and (activated or beyond is None):
        return FAILED if beyond is None else EXEMPT
    return PASSED if activated else NOT_ACTIVATED


def trial_record(trial: Trial) -> Record:
    """Return a trial as numbers and words."""
    beyond = trial.variant.beyond_supervision(trial.design)
    return {
        "result": FAILED if trial.twin_fault else _result(trial.outcome, beyond, activated=trial.fired > 0),
        "outcome": trial.outcome.value,
        "beyond_supervision": beyond,
        "fired": trial.fired,
        "stopped_by": trial.stopped_by.name.lower(),
        "reason": trial.reason,
        "detected_s": trial.detected_s,
        "off_counts": trial.off_counts,
        "left_counts": trial.left_counts,
        "drift_counts": trial.drift_counts,
        "late_s": trial.late_s,
        "following_counts": trial.following_counts,
        "twin_fault": trial.twin_fault,
    }


def soak_episode(parameters: Parameters, seed: int, run: int) -> Record:
    """Run one episode of random faults: one of ``rtec safety --soak``, with the same numbers.

    Parameters
    ----------
    parameters
        ``design``, a word; ``length_s``, of an episode that nothing stops.
    seed, run
        Of the plan; number of the episode.
    """
    plan = SoakPlan(episode_s=float(parameters["length_s"] or 0.0), seed=seed)
    return episode_record(EpisodeJob(plan=plan, design=Design.named(str(parameters["design"])), number=run).run())


def episode_record(episode: Episode) -> Record:
    """Return an episode as numbers and words; one in which no fault took effect proves nothing about faults."""
    beyond = episode.beyond_supervision
    return {
        "result": _result(episode.outcome, beyond, activated=bool(episode.injected)),
        "outcome": episode.outcome.value,
        "beyond_supervision": beyond,
        "faults": ", ".join(
            f"{_word(one.variant)} at axis {one.axis} during {one.phase.value}" for one in episode.injected
        ),
        "without_effect": ", ".join(map(_word, episode.unfired)),
        "wrong": episode.wrong,
        "reason": episode.reason,
        "detected_s": episode.detected_s,
        "run_s": episode.run_s,
        "off_counts": episode.off_counts,
        "left_counts": episode.left_counts,
        "following_counts": episode.following_counts,
        "checks": episode.checks,
        "travel_mm": episode.travel_mm,
    }


def _impossible(parameters: Parameters) -> str | None:
    """Return why one fault cannot take effect in a phase, or why two cannot be injected together."""
    first, phase = _VARIANTS[str(parameters["fault"])], _PHASES[str(parameters["phase"])]
    second = _VARIANTS.get(str(parameters["second"]))
    if second is None:
        return impossible(first, phase)
    if first is second:
        return "a fault is no second one beside itself"
    kinds = first.kind, second.kind
    if all(kind.place is FaultPlace.AXIS for kind in kinds):
        if kinds[0].category is kinds[1].category:
            return "of two faults in the same part of a box, the end of one would end both"
        if phase is Phase.INSERTION:
            return "only one fault of a box can wait for an insertion"
    return impossible(first, phase) or impossible(second, phase)


FAULT = JobKind(
    does="A fault, or two, are injected in a phase of operation, and the controller's counts compared in the end.",
    function=f"{__name__}:inject",
    parameters=(
        _DESIGN,
        Choice(name="phase", words=tuple(_PHASES)),
        Choice(name="fault", words=tuple(_VARIANTS), classes=_CLASSES),
        Choice(name="second", words=(_NONE, *_VARIANTS), default=(_NONE,), classes=_CLASSES),
    ),
    by=("fault",),
    proves=("fault", "phase"),  # of pairs, many a first fault stops the machine before the second can act
    impossible=_impossible,
)
EPISODE = JobKind(
    does="Three axes cut with random faults of every class, until their programs end or the machine is held.",
    function=f"{__name__}:soak_episode",
    parameters=(_DESIGN, Number(name="length_s", unit="s", low=20.0, high=3600.0, default=240.0)),
    by=("design",),
)
