"""Rows of a campaign's tables: results, rates with their intervals, and threats."""

from __future__ import annotations

from rtec.rates import clopper_pearson, never_seen, wilson
from rtec.report.campaign_tally import Group, residual
from rtec.verify.campaign.run import Campaign, Counts

THREAT_HEADS = "threat", "faults", "defence", "who said so", "survived", "harm", "residual rate, 95 %"
RATE_HEADS = ("tried", "failed", "exempt", "no effect", "rate", "Wilson", "Clopper-Pearson", "outcomes")


def rates(counts: Counts) -> tuple[str, ...]:
    """Return counts, rate and intervals of 95 %, under `RATE_HEADS`."""
    tried, failed = counts.tried, counts.failed
    outcomes = ", ".join(f"{name} {count}" for name, count in counts.outcomes.most_common())
    numbers = str(tried), str(failed), str(counts.exempt), str(counts.not_activated)
    if not tried:
        return *numbers, "–", "–", "–", outcomes
    rate = f"{failed / tried:.2g}" if failed else f"below {never_seen(tried):.2g}"
    return *numbers, rate, between(wilson(failed, tried)), between(clopper_pearson(failed, tried)), outcomes


def between(interval: tuple[float, float] | None) -> str:
    """Return an interval as text."""
    return "–" if interval is None else f"{interval[0]:.2g} to {interval[1]:.2g}"


def threat(group: Group) -> tuple[str, ...]:
    """Return from threat to residual rate, under `THREAT_HEADS`."""
    counts = group.counts
    survived = ", ".join(f"{name} {count}" for name, count in counts.outcomes.most_common() if name != "undetected")
    return (
        group.title, ", ".join(group.faults), group.defence,
        ", ".join(f"{who} {count}" for who, count in group.told_by.most_common()),
        survived, f"{counts.failed + counts.exempt}, {counts.exempt} of them exempt" if counts.exempt else
        str(counts.failed), residual(counts),
    )  # fmt: skip


def totals(campaign: Campaign) -> list[tuple[str, str, str, str]]:
    """Return how many jobs had each result."""
    counts = campaign.counts
    done = counts.tried + counts.not_activated
    outcomes = ", ".join(f"{name} {count}" for name, count in counts.outcomes.most_common())
    lines = [
        ("took effect", counts.tried, outcomes),
        ("passed", counts.passed, "survived"),
        ("failed", counts.failed, "not survived"),
        ("exempt", counts.exempt, "not survived, beyond supervision"),
        ("not activated", counts.not_activated, "proves nothing"),
        ("no record", campaign.jobs - done, "to be run by the same command"),
    ]
    return [(name, str(number), f"{number / campaign.jobs:.1%}", words) for name, number, words in lines]
