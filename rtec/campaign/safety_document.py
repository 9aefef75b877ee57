"""The safety case as a page, all figures from the runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from statistics import median

from rtec.campaign import safety_prose as prose
from rtec.campaign.safety import SafetyCase, detection_of
from rtec.campaign.safety_matrix import Outcome, Trial
from rtec.campaign.safety_prose import filled, table
from rtec.campaign.safety_ramp import LIMIT_MM
from rtec.campaign.safety_variants import Variant, impossible
from rtec.campaign.soak import Soak
from rtec.injector import Design
from rtec.injector.design import BESIDE, IN_PATH
from rtec.machine.faults import FaultKind


def document(case: SafetyCase, *, command: str, picture: str) -> str:
    """Return the page as Markdown.

    Parameters
    ----------
    case
        What the runs show.
    command
        That makes it.
    picture
        Name of the figure's file.
    """
    parts = [_head(case, command), *_definitions()]
    for _, designs in case.matrix.plan.groups:
        if designs[0].in_path:
            parts += ["## Design B", filled(prose.DESIGN_B), _faults_by_phases(case, designs)]
        else:
            parts += ["## Original, A and C", "The worst of all trials.", _faults_by_phases(case, designs)]
    parts.append(f"![Every fault in every phase, by what happens at the controller]({picture})")
    parts += ["## How long delayed", _late(case)]
    parts += ["## How it is detected", filled(prose.DETECTION), _detection(case), filled(_after_stop(case))]
    parts += _remains(case)
    parts += ["## What is not applicable", _impossible(case) or "All that was tried can."]
    if case.soak is not None:
        parts += _soak(case.soak)
    parts.append("[Documentation](index.md)")
    return "\n\n".join(part for part in parts if part) + "\n"


def _head(case: SafetyCase, command: str) -> str:
    plan, trials = case.matrix.plan, case.matrix.trials
    fired = [trial for trial in trials if trial.fired]
    counts = Counter(trial.outcome for trial in fired)
    avoidable = len(case.matrix.avoidable)
    verdict = (
        f"**{avoidable or 'None'} of them ended in wrong counts that nobody noticed although supervision by the "
        "report, a sequence counter or a checksum could have caught them.**"
    )
    others = sum(trial.outcome is Outcome.UNDETECTED and not trial.variant.upstream for trial in fired)
    summary = (
        f"{len(plan.variants)} faults of {len({variant.kind for variant in plan.variants})} classes are "
        f"injected at axis 1 of a machine of two axes in {len(plan.phases)} phases of its operation, with "
        f"{len(plan.designs)} designs and {plan.seeds} seeds each (other moments, bits, frames, states at rest): "
        f"{len(trials)} runs. In {len(fired)} the fault took "
        f"effect; the others prove nothing and are left out. {verdict} It was tolerated in "
        f"{counts[Outcome.TOLERATED]} runs and delayed the correction in {counts[Outcome.DELAYED]}; "
        f"{counts[Outcome.SAFE_STOP]} ended in a safe stop; in {counts[Outcome.UNDETECTED]} it stayed undetected, "
        f"{others or 'none'} "
        "of them at box, link or PC, the others before the box, in the encoder's cable "
        "([what remains](#what-remains))."
    )
    title = "# Safety case: every fault, in every phase of operation"
    return f"{title}\n\n{filled(prose.QUOTE)}\n\n```sh\n{command}\n```\n\n{filled(summary)}"


def _definitions() -> list[str]:
    return [
        "## What is said of a run",
        filled(prose.REFERENCE),
        table(["word", "what it means"], prose.WORDS),
        filled(prose.ALLOWED),
        table(["phase", "what the machine is doing"], prose.PHASES),
    ]


def _faults_by_phases(case: SafetyCase, designs: Sequence[Design]) -> str:
    phases = case.matrix.plan.phases
    rows = [
        [variant.name, *(_word(case.matrix.worst(variant, phase, designs)) for phase in phases)]
        for variant in case.matrix.plan.variants
    ]
    return table(["fault", *(phase.value for phase in phases)], rows)


def _word(outcome: Outcome) -> str:
    if outcome is Outcome.NOT_APPLICABLE:
        return "–"
    return f"**{outcome.value}**" if outcome is Outcome.UNDETECTED else outcome.value


def _fired(case: SafetyCase, variant: Variant) -> list[Trial]:
    return [trial for trial in case.matrix.trials if trial.variant is variant and trial.fired]


def _late(case: SafetyCase) -> str:
    rows = []
    for variant in case.matrix.plan.variants:
        late = [trial for trial in _fired(case, variant) if trial.outcome is Outcome.DELAYED]
        if late:
            off = max(trial.off_counts for trial in late)
            longest_s = max(trial.late_s for trial in late)
            rows.append([variant.name, len(late), f"{off:.0f} counts", _ms(longest_s)])
    return table(["fault", "runs", "off by more than its twin, at most", "longer beyond rounding, at most"], rows)


def _detection(case: SafetyCase) -> str:
    rows = []
    for variant in case.matrix.plan.variants:
        trials = _fired(case, variant)
        found = detection_of(trials)
        if found.held:
            share = f"{found.held} of {len(trials)}"
            times = (_ms(found.median_s), _ms(found.longest_s))
            rows.append([variant.name, share, "; ".join(found.reasons), *times, f"{found.off_counts:.0f}"])
    return table(["fault", "safe stop", "who said so", "median", "longest", "counts off until then"], rows)


def _after_stop(case: SafetyCase) -> str:
    """Return what the controllers have after a stop, against encoder and insertions."""
    held = [t for t in case.matrix.trials if t.fired and t.outcome is Outcome.SAFE_STOP and not t.variant.upstream]
    main = [trial for trial in held if not trial.design.in_path]
    exact = sum(trial.left_counts == 0 for trial in main)
    return (
        f"After the stop, the controllers of the Original, A and C had exactly the counts of the encoder and of what "
        f"was truly inserted in {exact} of the {len(main)} runs that were held for a fault of box, link or PC."
    )


def _without_power(case: SafetyCase) -> str:
    """Return how many counts Design B loses without power."""
    lost = [
        abs(trial.drift_counts)
        for trial in case.matrix.trials
        if trial.fired and trial.design.in_path and trial.variant.kind is FaultKind.POWER_LOST
    ]
    return f"{prose.WITHOUT_POWER} Here: up to {max(lost)} counts after the stop." if lost else prose.WITHOUT_POWER


def _ms(time_s: float | None) -> str:
    return "–" if time_s is None else f"{time_s * 1e3:.0f} ms"


def _remains(case: SafetyCase) -> list[str]:
    """Return the section about what no supervision catches."""
    silent = [trial for trial in case.matrix.trials if trial.fired and trial.outcome is Outcome.UNDETECTED]
    rows = []
    for variant in dict.fromkeys(trial.variant for trial in silent if trial.variant.upstream):
        some = [trial for trial in silent if trial.variant is variant]
        seen = median(max(trial.following_counts, 0.0) for trial in some)
        left = max(abs(trial.left_counts) for trial in some)
        share = f"{len(some)} of {len(_fired(case, variant))}"
        rows.append([variant.name, share, left, f"{seen:.0f} counts", variant.kind.seen_by])
    headings = [
        "fault",
        "undetected",
        "counts lost, at most",
        "a speed check would have seen",
        "what could observe it",
    ]
    ramps = [
        [ramp.design.value, ramp.limit, _word(ramp.outcome), ramp.reason or "–", f"{ramp.off_mm * 1e3:.0f} um"]
        for ramp in case.ramps
    ]
    runaway = f"{prose.RUNAWAY} Here it is {LIMIT_MM * 1e3:.0f} um, where the healthy table stays within 30 um:"
    return [
        "## What remains",
        filled(prose.UPSTREAM),
        table(headings, rows) if rows else "",
        filled(_others([trial for trial in silent if not trial.variant.upstream])),
        filled(_without_power(case)),
        filled(prose.LARGE),
        filled(runaway) if ramps else "",
        table(["design", "option", "outcome", "who said so", "off by"], ramps) if ramps else "",
        filled(prose.BEYOND),
    ]


def _others(trials: Sequence[Trial]) -> str:
    if not trials:
        return "Nothing else was undetected."
    named = Counter(f"{trial.variant.name}, {trial.phase.value}, design {trial.design.value}" for trial in trials)
    return "Also undetected: " + "; ".join(f"{name} ({count})" for name, count in named.items()) + "."


def _impossible(case: SafetyCase) -> str:
    """Return the faults that are not applicable, by reason."""
    reasons: dict[str, dict[str, list[str]]] = {}
    for variant in case.matrix.plan.variants:
        for phase in case.matrix.plan.phases:
            reason = impossible(variant, phase)
            if reason is not None:
                reasons.setdefault(reason, {}).setdefault(variant.name, []).append(phase.value)
    lines = []
    for reason, variants in reasons.items():
        names = "; ".join(f"{name} ({', '.join(phases)})" for name, phases in variants.items())
        lines.append(f"- {names}: {reason}.")
    return "\n".join(lines)


def _soak(soak: Soak) -> list[str]:
    """Return the section about the soak."""
    fired, outcomes = soak.fired(), soak.outcomes()
    main = [episode for episode in soak.episodes if episode.design in BESIDE]
    phases = Counter(injected.phase.value for episode in main for injected in episode.injected)
    held = Counter(episode.reason for episode in main if episode.outcome is Outcome.SAFE_STOP)
    what = (
        f"{soak.hours():.1f} hours of machine time on three axes with the Original, A and C, in {len(main)} "
        f"episodes of up to {soak.plan.episode_s / 60:.0f} minutes: random programs (0.5 to 5 mm/s, rapids of up to "
        f"7 m/min, rests, reversals), probing, large corrections, and {sum(fired.values())} faults that took effect "
        "at random moments and places, those of box, link and PC one after the other, one of the encoder for an "
        "episode. A machine that is held ends its episode; only time that was run counts. Every axis is looked at "
        "every 5 ms, and at every rest all counts must be right: "
        f"{sum(episode.checks for episode in main) / 1e6:.1f} million looks at an axis at rest, "
        f"{sum(episode.travel_mm for episode in main) / 1e6:.2f} km of travel."
    )
    ended = (
        f"{outcomes[Outcome.TOLERATED]} episodes tolerated, "
        f"{outcomes[Outcome.SAFE_STOP]} safe stops, "
        f"**{len(soak.undetected(upstream=False)) or 'none'} with wrong counts that nobody noticed because of box, "
        f"link or PC**, {len(soak.undetected(upstream=True))} with counts lost before the box. Design B apart: "
        f"{soak.hours(IN_PATH):.1f} hours, {_counted(soak.outcomes(IN_PATH), lambda outcome: outcome.value)}."
    )
    rows = [[kind.value, fired[kind]] for kind in FaultKind]
    return [
        "## Soak",
        filled(what),
        filled(ended),
        table(["class", "took effect"], rows),
        filled(f"By phase: {_counted(phases, str)}. Held by: {_counted(held, str)}."),
        _lost(soak),
    ]


def _lost(soak: Soak) -> str:
    """Return what was lost before the box."""
    named = Counter(episode.injected[0].variant for episode in soak.undetected(upstream=True))
    if not named:
        return ""
    rows = [[variant.name, count, variant.kind.seen_by] for variant, count in named.most_common()]
    return "Counts lost before the box:\n\n" + table(["fault", "episodes", "what could observe it"], rows)


def _counted(counter: Counter[str] | Counter[Outcome], name: Callable[..., str]) -> str:
    return ", ".join(f"{name(key)} {count}" for key, count in counter.most_common())
