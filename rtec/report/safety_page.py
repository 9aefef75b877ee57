"""The safety case as a page, all figures from the runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median

from rtec.injector import Design
from rtec.injector.design import BESIDE, IN_PATH
from rtec.machine.fault_kinds import LATCH_STUCK
from rtec.machine.faults import FaultKind
from rtec.report.rendering import csv_text, markdown_page
from rtec.verify.safety.case import LIMIT_MM, SafetyCase, detection_of
from rtec.verify.safety.matrix import LATE_S, Outcome, Trial
from rtec.verify.safety.soak import Soak
from rtec.verify.safety.variants import Variant, impossible

TEMPLATE = Path(__file__).with_name("safety.md.j2")
_FAULT_COLUMNS = (
    "fault",
    "safe stop",
    "who said so",
    "median, ms",
    "longest, ms",
    "counts off until then",
    "delayed",
    "counts off more than its twin, at most",
    "longer beyond rounding, at most, ms",
)
_WORTH_A_ROW = 1
"""Counts: the page shows the faults that had a controller off by more before the stop."""


def faults_csv(case: SafetyCase) -> str:
    """Return how each fault was detected, and how long it delayed, as CSV with a head line."""
    rows: list[tuple[object, ...]] = [_FAULT_COLUMNS]
    for variant in case.matrix.plan.variants:
        trials = _fired(case, variant)
        found, late = detection_of(trials), [trial for trial in trials if trial.outcome is Outcome.DELAYED]
        if not found.held and not late:
            continue
        off, longest = _latest(late)
        stopped = ("; ".join(found.reasons), *map(_whole_ms, (found.median_s, found.longest_s)))
        how = (*stopped, f"{found.off_counts:.0f}") if found.held else ("",) * 4
        delay = (f"{off:.0f}", _whole_ms(longest)) if late else ("", "")
        share = f"{found.held} of {len(trials)}" if found.held else ""
        rows.append((variant.name, share, *how, len(late), *delay))
    return csv_text(rows)


def safety_page(case: SafetyCase, *, command: str, picture: str, table: str) -> str:
    """Return the page as Markdown.

    Parameters
    ----------
    case
        What the runs show.
    command
        That makes it.
    picture, table
        Names of the files with the figure and with `faults_csv`.
    """
    plan, trials = case.matrix.plan, case.matrix.trials
    fired = [trial for trial in trials if trial.fired]
    undetected = [trial for trial in fired if trial.outcome is Outcome.UNDETECTED]
    stopped = [
        trial
        for trial in fired
        if trial.outcome is Outcome.SAFE_STOP
        and not trial.variant.upstream
        and not trial.design.in_path
        and trial.variant.kind is not LATCH_STUCK
    ]
    elsewhere = [trial for trial in undetected if not trial.variant.upstream]
    return markdown_page(
        TEMPLATE,
        command=command,
        picture=picture,
        csv=table,
        plan=plan,
        variants=plan.variants,
        classes=len({variant.kind for variant in plan.variants}),
        runs=len(trials),
        fired=len(fired),
        avoidable=len(case.matrix.avoidable),
        counts={outcome.value: sum(trial.outcome is outcome for trial in fired) for outcome in Outcome},
        others=len(elsewhere),
        late_s=LATE_S,
        groups=[(designs[0].in_path, grouped(_worst(case, designs))) for _, designs in plan.groups],
        latest=_latest([trial for trial in fired if trial.outcome is Outcome.DELAYED]),
        detection=_detection(case),
        exact=sum(trial.left_counts == 0 for trial in stopped),
        stopped=len(stopped),
        upstream=_upstream(case, undetected),
        elsewhere=_counted(
            f"{trial.variant.name}, {trial.phase.value}, design {trial.design.value}" for trial in elsewhere
        ),
        lost=_without_power(case),
        ramps=[
            (ramp.design.value, ramp.limit, _word(ramp.outcome), ramp.reason or "–", f"{ramp.off_mm * 1e3:.0f} um")
            for ramp in case.ramps
        ],
        limit_mm=LIMIT_MM,
        impossible=_impossible(case),
        soak=None if case.soak is None else _soak(case.soak),
    )


def grouped(worst: dict[str, dict[str, str]]) -> list[tuple[str, str, str]]:
    """Return faults that end alike in a row: their names, the outcome in most phases, and phases with another.

    Examples
    --------
    >>> grouped({"a": {"rest": "tolerated"}, "b": {"rest": "tolerated"}})
    [('a; b', 'tolerated', '')]
    """
    rows: dict[tuple[str, str], list[str]] = {}
    for name, by_phase in worst.items():
        most = Counter(by_phase.values()).most_common(1)[0][0]
        others: dict[str, list[str]] = {}
        for phase, outcome in by_phase.items():
            if outcome != most:
                others.setdefault(outcome, []).append(phase)
        exceptions = "; ".join(f"{outcome}: {', '.join(phases)}" for outcome, phases in others.items())
        rows.setdefault((most, exceptions), []).append(name)
    return [("; ".join(names), most, exceptions) for (most, exceptions), names in rows.items()]


def _worst(case: SafetyCase, designs: Sequence[Design]) -> dict[str, dict[str, str]]:
    plan = case.matrix.plan
    return {
        variant.name: {phase.value: _word(case.matrix.worst(variant, phase, designs)) for phase in plan.phases}
        for variant in plan.variants
    }


def _word(outcome: Outcome) -> str:
    return f"**{outcome.value}**" if outcome is Outcome.UNDETECTED else outcome.value


def _fired(case: SafetyCase, variant: Variant) -> list[Trial]:
    return [trial for trial in case.matrix.trials if trial.variant is variant and trial.fired]


def _latest(late: Sequence[Trial]) -> tuple[float, float]:
    """Return by how many counts more than their twins delayed trials were off at most, and how much longer, in s."""
    return max((trial.off_counts for trial in late), default=0.0), max((trial.late_s for trial in late), default=0.0)


def _detection(case: SafetyCase) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for variant in case.matrix.plan.variants:
        trials = _fired(case, variant)
        found = detection_of(trials)
        if round(found.off_counts) > _WORTH_A_ROW:
            share = f"{found.held} of {len(trials)}"
            times = (_ms(found.median_s), _ms(found.longest_s))
            rows.append((variant.name, share, "; ".join(found.reasons), *times, f"{found.off_counts:.0f}"))
    return rows


def _without_power(case: SafetyCase) -> str:
    lost = [
        abs(trial.drift_counts)
        for trial in case.matrix.trials
        if trial.fired and trial.design.in_path and trial.variant.kind is FaultKind.POWER_LOST
    ]
    return f" Here: up to {max(lost)} counts after the stop." if lost else ""


def _ms(time_s: float | None) -> str:
    return "–" if time_s is None else f"{_whole_ms(time_s)} ms"


def _whole_ms(time_s: float | None) -> str:
    return "" if time_s is None else f"{time_s * 1e3:.0f}"


def _upstream(case: SafetyCase, undetected: Sequence[Trial]) -> list[tuple[object, ...]]:
    rows: list[tuple[object, ...]] = []
    for variant in dict.fromkeys(trial.variant for trial in undetected if trial.variant.upstream):
        some = [trial for trial in undetected if trial.variant is variant]
        seen = median(max(trial.following_counts, 0.0) for trial in some)
        left = max(abs(trial.left_counts) for trial in some)
        share = f"{len(some)} of {len(_fired(case, variant))}"
        rows.append((variant.name, share, left, f"{seen:.0f} counts", variant.kind.seen_by))
    return rows


def _impossible(case: SafetyCase) -> list[tuple[str, str]]:
    """Return the faults that are not applicable with their phases, and the reason."""
    reasons: dict[str, dict[str, list[str]]] = {}
    for variant in case.matrix.plan.variants:
        for phase in case.matrix.plan.phases:
            reason = impossible(variant, phase)
            if reason is not None:
                reasons.setdefault(reason, {}).setdefault(variant.name, []).append(phase.value)
    return [
        ("; ".join(f"{name} ({', '.join(phases)})" for name, phases in variants.items()), reason)
        for reason, variants in reasons.items()
    ]


def _soak(soak: Soak) -> dict[str, object]:
    fired, outcomes = soak.fired(), soak.outcomes
    lost = Counter(episode.injected[0].variant for episode in soak.undetected("before the box"))
    return {
        "hours": soak.hours(),
        "by_design": "; ".join(
            f"{', '.join(design.short for design in group)} {soak.hours(group):.1f} h" for group in (BESIDE, IN_PATH)
        ),
        "episodes": len(soak.episodes),
        "minutes": soak.plan.episode_s / 60,
        "faults": sum(fired.values()),
        "checks_million": sum(episode.checks for episode in soak.episodes) / 1e6,
        "travel_km": sum(episode.travel_mm for episode in soak.episodes) / 1e6,
        "tolerated": outcomes[Outcome.TOLERATED],
        "stops": outcomes[Outcome.SAFE_STOP],
        "undetected": len(soak.undetected()),
        "upstream": len(soak.undetected("before the box")),
        "processor": len(soak.undetected("with the processor")),
        "by_class": ", ".join(f"{kind.value} {fired[kind]}" for kind in FaultKind),
        "by_phase": _counted(injected.phase.value for episode in soak.episodes for injected in episode.injected),
        "held_by": _counted(episode.reason for episode in soak.episodes if episode.outcome is Outcome.SAFE_STOP),
        "lost": [(variant.name, count, variant.kind.seen_by) for variant, count in lost.most_common()],
    }


def _counted(names: Iterable[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in Counter(names).most_common())
