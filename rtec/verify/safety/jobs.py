"""Faults in phases, and episodes of a soak, as jobs of a campaign."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

from rtec.board import Microcontroller
from rtec.injector import Design
from rtec.machine.fault_kinds import INSIDE_BOX, FaultPlace
from rtec.machine.faults import Fault, Trigger
from rtec.machine.station_settings import InBox
from rtec.units import PS_PER_S
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
    Value,
)
from rtec.verify.campaign.own_files import NONE, OwnFile, unpacked
from rtec.verify.contract.in_box import PythonInBox
from rtec.verify.safety.matrix import Outcome, Trial, judged, moments
from rtec.verify.safety.phases import Phase, Twin, first_effect, hyphened, new_cell, run_through, twin_of
from rtec.verify.safety.soak import Episode, EpisodeJob, SoakPlan
from rtec.verify.safety.threats import THREATS
from rtec.verify.safety.variants import VARIANTS, Variant, impossible, unreachable


def _word(variant: Variant) -> str:
    return hyphened(variant.name.replace(",", ""))


_VARIANTS = {_word(variant): variant for variant in VARIANTS}
_PHASES = {hyphened(phase.value): phase for phase in Phase}
_CLASSES = {
    "place": {word: variant.place for word, variant in _VARIANTS.items()},
    "category": {word: hyphened(variant.kind.category.value) for word, variant in _VARIANTS.items()},
    "threat": {word: THREATS[variant.kind].value for word, variant in _VARIANTS.items() if variant.kind in THREATS},
}
_DESIGN = Choice(name="design", words=tuple(design.value for design in Design))


_ALGORITHM = OwnFile(name="algorithm", beside="design")


@lru_cache(maxsize=8)
def _in_box(value: Value) -> InBox | None:
    """Return what works in the boxes in the place of the design."""
    if value in (None, NONE):
        return None
    file, kind = unpacked(str(value))
    return PythonInBox(file, kind) if kind else replace(Microcontroller.named("8051-12mhz"), program=file)


@lru_cache(maxsize=4)
def _twin(phase: Phase, design: Design, run: int, algorithm: Value) -> Twin:
    """Return the run without a fault, which all faults of a phase share."""
    return twin_of(phase, design, run, _in_box(algorithm))


def inject(parameters: Parameters, seed: int, run: int) -> Record:
    """Inject one fault, or two, at random moments of a phase: one trial of ``rtec safety``, with the same numbers.

    Parameters
    ----------
    parameters
        ``design``, ``phase``, ``fault``, ``second`` (another fault, or none): words. Of two, each comes at the moment
        at which it comes alone; times of detection count from the first effect of ``fault``. ``algorithm`` may be
        left out: one of the user's in the place of the design.
    seed, run
        Of the plan; number of the run, which chooses moment, bits and state at rest.

    Examples
    --------
    >>> words = {"design": "c", "phase": "cutting", "fault": "pc-killed", "second": "none"}
    >>> record = inject(words, seed=1, run=0)
    >>> record["result"], record["outcome"], record["stopped_by"], record["direction"]
    ('passed', 'safe stop', 'box', 'positive')
    """
    injection = injection_of(parameters, seed, run)
    phase, design, both = injection.phase, injection.design, injection.variants
    cell = new_cell(phase, design, run, faults=injection.faults, algorithm=injection.algorithm)
    run_through(cell, phase)
    trial = judged(both[0], phase, design, run, cell, injection.twin.cell)
    fired = cell.fired
    then, *second = (first_effect(cell, phase, one) for one in fired)
    record = trial_record(trial) | {
        "moment_ps": injection.faults[0].from_ps,
        "activated_ps": None if then is None else then.at_ps,
        "state": None if then is None else then.state,
        "direction": None if then is None else then.direction,
    }
    if not second:
        return record
    beyond = next((where for one in both if (where := one.beyond_supervision(design)) is not None), None)
    result = _result(trial.outcome, beyond, activated=all(one.times > 0 for one in fired))
    return record | {
        "result": result if trial.sound else FAILED,
        "beyond_supervision": beyond,
        "second_fired": fired[1].times,
        "second_moment_ps": injection.faults[1].from_ps,
        "second_activated_ps": None if second[0] is None else second[0].at_ps,
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Injection:
    """What a job injects."""

    design: Design
    phase: Phase
    run: int
    """``design``, ``phase``, ``run``: where, with the moves of which run."""
    variants: tuple[Variant, ...]
    faults: tuple[Fault, ...]
    """``variants``, ``faults``: one or two, at their moments."""
    algorithm: InBox | None
    """In the boxes, in the place of the design."""
    twin: Twin
    """The run without them."""


def injection_of(parameters: Parameters, seed: int, run: int) -> Injection:
    """Return what a job with these parameters injects, as `inject` takes them."""
    design, phase = Design.named(str(parameters["design"])), _PHASES[str(parameters["phase"])]
    algorithm = parameters.get("algorithm")
    twin = _twin(phase, design, run, algorithm)
    drawn = moments(seed, twin, phase, design, run)
    both = tuple(_VARIANTS[word] for name in ("fault", "second") if (word := str(parameters[name])) != NONE)
    faults = tuple(variant.fault(phase, *drawn[variant]) for variant in both)
    if all(fault.trigger is Trigger.WHILE_INSERTING for fault in faults):  # one of a box can wait
        faults = (*faults[:1], *(replace(fault, trigger=Trigger.AT_ONCE) for fault in faults[1:]))
    return Injection(
        design=design, phase=phase, run=run, variants=both, faults=faults, algorithm=_in_box(algorithm), twin=twin
    )


def _result(outcome: Outcome, beyond: str | None, *, activated: bool) -> str:
    if outcome is Outcome.UNDETECTED and (activated or beyond is None):
        return FAILED if beyond is None else EXEMPT
    return PASSED if activated else NOT_ACTIVATED


def trial_record(trial: Trial) -> Record:
    """Return a trial as numbers and words."""
    beyond = trial.variant.beyond_supervision(trial.design)
    return {
        "result": _result(trial.outcome, beyond, activated=trial.fired > 0) if trial.sound else FAILED,
        "outcome": trial.outcome.value if trial.sound else "wrong without any fault",
        "beyond_supervision": beyond,
        "fired": trial.fired,
        "stopped_by": trial.stopped_by.name.lower(),
        "reason": trial.reason,
        "detected_s": trial.detected_s,
        "detected_ps": trial.detected_ps,
        "encoder_counts": trial.encoder_counts,
        "controller_counts": trial.controller_counts,
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
        ``design``, a word; ``length_s``, of an episode that nothing stops; ``algorithm``, as of `inject`.
    seed, run
        Of the plan; number of the episode.
    """
    algorithm = _in_box(parameters.get("algorithm"))
    plan = SoakPlan(episode_s=float(parameters["length_s"] or 0.0), seed=seed, algorithm=algorithm)
    return episode_record(EpisodeJob(plan=plan, design=Design.named(str(parameters["design"])), number=run).run())


def episode_record(episode: Episode) -> Record:
    """Return an episode as numbers and words; one in which no fault took effect proves nothing about faults."""
    beyond = episode.beyond_supervision
    return {
        "result": _result(episode.outcome, beyond, activated=bool(episode.injected)),
        "outcome": episode.outcome.value,
        "beyond_supervision": beyond,
        "faults": ", ".join(
            f"{_word(one.variant)} at axis {one.axis} during {one.phase.value} at {one.activated_ps / PS_PER_S:.3f} s"
            for one in episode.injected
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
    design = Design.named(str(parameters["design"]))
    if parameters.get("algorithm", NONE) != NONE and any(
        one.kind in INSIDE_BOX for one in (first, second) if one is not None
    ):
        return "what is inside a box with an algorithm of the user's is not known"
    if second is None:
        return impossible(first, phase, design)
    if first is second:
        return "a fault is no second one beside itself"
    if first.kind.place is second.kind.place is FaultPlace.AXIS and first.kind.part == second.kind.part:
        return "of two faults of one cable, one word or one part of a box, the end of one would end both"
    return impossible(first, phase, design) or impossible(second, phase, design)


def _unreachable(parameters: Parameters) -> str | None:
    """Return why the first fault cannot take effect first in a state of the axis and a direction."""
    variant, phase = _VARIANTS[str(parameters["fault"])], _PHASES[str(parameters["phase"])]
    design, state = Design.named(str(parameters["design"])), int(str(parameters["state"]))
    return unreachable(variant, phase, design, state, str(parameters["direction"]))


FAULT = JobKind(
    does="A fault, or two, are injected in a phase of operation, and the controller's counts compared in the end.",
    function=f"{__name__}:inject",
    parameters=(
        _DESIGN,
        Choice(name="phase", words=tuple(_PHASES)),
        Choice(name="fault", words=tuple(_VARIANTS), classes=_CLASSES),
        Choice(name="second", words=(NONE, *_VARIANTS), default=(NONE,), classes=_CLASSES),
        _ALGORITHM,
    ),
    by=("fault",),
    trace="rtec.verify.safety.trace:trace_of",
    proves=("fault", "phase"),  # of pairs, many a first fault stops the machine before the second can act
    impossible=_impossible,
    observed=(
        Choice(name="state", words=("1", "2", "3", "4")),
        Choice(name="direction", words=("positive", "negative", "rest")),
    ),
    unreachable=_unreachable,
)
EPISODE = JobKind(
    does="Three axes cut with random faults of every class, until their programs end or the machine is held.",
    function=f"{__name__}:soak_episode",
    parameters=(_DESIGN, Number(name="length_s", unit="s", low=20.0, high=3600.0, default=240.0), _ALGORITHM),
    by=("design",),
)
