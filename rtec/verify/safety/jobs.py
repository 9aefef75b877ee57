"""Faults in phases, and episodes of a soak, as jobs of a campaign."""

from __future__ import annotations

from functools import lru_cache

from rtec.injector import Design
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
from rtec.verify.safety.matrix import Outcome, Trial, moments, run_trial
from rtec.verify.safety.phases import Phase, Twin, hyphened, twin_of
from rtec.verify.safety.soak import Episode, EpisodeJob, SoakPlan
from rtec.verify.safety.variants import VARIANTS, Variant, impossible


def _word(variant: Variant) -> str:
    return hyphened(variant.name.replace(",", ""))


_VARIANTS = {_word(variant): variant for variant in VARIANTS}
_PHASES = {hyphened(phase.value): phase for phase in Phase}
_DESIGN = Choice(name="design", words=tuple(design.value for design in Design))


@lru_cache(maxsize=4)
def _twin(phase: Phase, design: Design, run: int) -> Twin:
    """Return the run without a fault, which all faults of a phase share."""
    return twin_of(phase, design, run)


def inject(parameters: Parameters, seed: int, run: int) -> Record:
    """Inject one fault at a random moment of a phase: one trial of ``rtec safety``, with the same numbers.

    Parameters
    ----------
    parameters
        ``design``, ``phase``, ``fault``: words.
    seed, run
        Of the plan; number of the run, which chooses moment, bits and state at rest.

    Examples
    --------
    >>> record = inject({"design": "c", "phase": "cutting", "fault": "pc-killed"}, seed=1, run=0)
    >>> record["result"], record["outcome"], record["stopped_by"]
    ('passed', 'safe stop', 'box')
    """
    design, phase = Design.named(str(parameters["design"])), _PHASES[str(parameters["phase"])]
    variant, twin = _VARIANTS[str(parameters["fault"])], _twin(phase, design, run)
    moment_ps, bits = moments(seed, twin, phase, design, run)[variant]
    return trial_record(run_trial(variant, twin, phase, design, run, moment_ps, bits)) | {"moment_ps": moment_ps}


def _result(outcome: Outcome, beyond: str | None, *, activated: bool) -> str:
    if outcome is Outcome.UNDETECTED and (activated or beyond is None):
        return FAILED if beyond is None else EXEMPT
    return PASSED if activated else NOT_ACTIVATED


def trial_record(trial: Trial) -> Record:
    """Return a trial as numbers and words."""
    beyond = trial.variant.beyond_supervision(trial.design)
    return {
        "result": _result(trial.outcome, beyond, activated=trial.fired > 0),
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
    return impossible(_VARIANTS[str(parameters["fault"])], _PHASES[str(parameters["phase"])])


FAULT = JobKind(
    does="A fault is injected in a phase of operation, and the counts of the controller are compared in the end.",
    function=f"{__name__}:inject",
    parameters=(
        _DESIGN,
        Choice(name="phase", words=tuple(_PHASES)),
        Choice(
            name="fault",
            words=tuple(_VARIANTS),
            classes={
                "place": {word: variant.kind.place.value.lower() for word, variant in _VARIANTS.items()},
                "category": {word: hyphened(variant.kind.category.value) for word, variant in _VARIANTS.items()},
            },
        ),
    ),
    by=("fault",),
    proves=("fault", "phase"),
    impossible=_impossible,
)
EPISODE = JobKind(
    does="Three axes cut with random faults of every class, until their programs end or the machine is held.",
    function=f"{__name__}:soak_episode",
    parameters=(_DESIGN, Number(name="length_s", unit="s", low=20.0, high=3600.0, default=240.0)),
    by=("design",),
)
