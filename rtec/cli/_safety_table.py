"""How ``rtec safety`` tells its result on the terminal."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rtec.campaign.safety_matrix import Outcome

if TYPE_CHECKING:
    from rtec.campaign.safety import SafetyCase
    from rtec.campaign.soak import Soak

_WORDS = {
    Outcome.IMPOSSIBLE: "·",
    Outcome.RIGHT: "right",
    Outcome.LATE: "late",
    Outcome.HELD: "held",
    Outcome.SILENT: "SILENT",
}


def show(case: SafetyCase) -> None:
    """Print the table fault by phase, what was found, and the soak."""
    matrix = case.matrix
    console = Console(highlight=False)
    for title, designs in matrix.plan.groups:
        table = Table(title=title, box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
        table.add_column("fault", no_wrap=True)
        for phase in matrix.plan.phases:
            table.add_column(phase.value.replace(" correction", ""), no_wrap=True)
        for variant in matrix.plan.variants:
            cells = []
            for phase in matrix.plan.phases:
                outcome = matrix.worst(variant, phase, designs)
                upstream = outcome is Outcome.SILENT and variant.upstream
                cells.append("upstream" if upstream else _WORDS[outcome])
            table.add_row(variant.name, *cells)
        console.print(table)
    fired = [trial for trial in matrix.trials if trial.fired]
    counted = Counter(trial.outcome.value for trial in fired)
    console.print(
        f"{len(fired)} faults took effect in {len(matrix.trials)} runs: "
        + ", ".join(f"{name} {count}" for name, count in counted.most_common()),
        soft_wrap=True,
    )
    for trial in matrix.avoidable:
        words = (
            f"silent error: {trial.variant.name}, {trial.phase.value}, design {trial.design.value}, seed {trial.seed}"
        )
        console.print(words, style="bold red", soft_wrap=True)
    for variant, phase in matrix.unproven:
        console.print(f"never took effect: {variant.name}, {phase.value}", style="bold red", soft_wrap=True)
    console.print("upstream: silent, but it begins before the box, whose lines the controller sees, too.")
    if case.soak is not None:
        _show_soak(console, case.soak)


def _show_soak(console: Console, soak: Soak) -> None:
    fired, outcomes = soak.fired(), soak.outcomes()
    console.print(
        f"Soak: {soak.hours():.1f} h in {len(soak.episodes)} episodes, {sum(fired.values())} faults of {len(fired)} "
        f"classes; right {outcomes[Outcome.RIGHT]}, held {outcomes[Outcome.HELD]}, "
        f"lost before the box {len(soak.silent(upstream=True))}, silent {len(soak.silent(upstream=False))}",
        soft_wrap=True,
    )
    for episode in soak.silent(upstream=False):
        words = f"silent error: design {episode.design.value}, episode {episode.number}: {episode.wrong}"
        console.print(words, style="bold red", soft_wrap=True)
    for kind in soak.missing:
        console.print(f"never took effect: {kind.value}", style="bold red")
