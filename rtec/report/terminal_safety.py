"""How ``rtec safety`` tells its result on the terminal."""

from __future__ import annotations

import shlex
from collections import Counter
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rtec.verify.safety.matrix import Matrix, Outcome, Trial
from rtec.verify.safety.phases import Phase, hyphened

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rtec.injector import Design
    from rtec.verify.safety.case import SafetyCase
    from rtec.verify.safety.soak import Soak

_WORDS = {
    Outcome.NOT_APPLICABLE: "-",
    Outcome.TOLERATED: "tol.",
    Outcome.DELAYED: "del.",
    Outcome.SAFE_STOP: "stop",
    Outcome.UNDETECTED: "UNDETECTED",
}
_UPSTREAM = "lost"
_HEADS = {
    Phase.START_UP: "start",
    Phase.AT_REST: "rest",
    Phase.CUTTING: "cut",
    Phase.RAPID: "rapid",
    Phase.REVERSAL: "turn",
    Phase.INSERTION: "ins.",
    Phase.PROBING: "probe",
    Phase.LARGE: "large",
}
"""Short, so that eight of them and a fault fit a line of 80 letters."""
_TOLD_ONE_BY_ONE = 24
"""Runs up to which each is told on a line of its own."""


def show(case: SafetyCase, own: Sequence[str] = ()) -> None:
    """Print the table fault by phase, what was found, the soak, and why the case is not good where it is not.

    Parameters
    ----------
    case
        What the runs show.
    own
        Options of the command that name an algorithm of the user's.
    """
    matrix = case.matrix
    console = Console(highlight=False)
    if matrix.plan.algorithm is not None:
        console.print(f"{matrix.plan.algorithm.name}, in the place of:", soft_wrap=True)
    for title, designs in matrix.plan.groups:
        console.print(_table(matrix, title, designs))
    heads = ", ".join(f"{_HEADS[phase]} = {phase.value}" for phase in matrix.plan.phases)
    console.print(f"Columns: {heads}.")
    console.print("tol.: tolerated; del.: delayed; stop: safe stop; UNDETECTED; -: not applicable.")
    console.print(f"{_UPSTREAM}: undetected, but it begins before the box, whose lines the controller sees, too.")
    fired = [trial for trial in matrix.trials if trial.fired]
    counted = Counter(trial.outcome.value for trial in fired)
    console.print(
        f"{len(fired)} faults took effect in {len(matrix.trials)} runs: "
        + ", ".join(f"{name} {count}" for name, count in counted.most_common())
    )
    if len(matrix.trials) <= _TOLD_ONE_BY_ONE:
        for trial in fired:
            console.print(_told(trial))
    if case.soak is not None:
        _show_soak(console, case.soak)
    if case.reasons:
        console.print("FAILS:", style="bold red")
        for reason in case.reasons:
            console.print(reason, style="bold red", soft_wrap=True)
    told = case.matrix.avoidable or fired
    if told:
        worst = max(told, key=lambda trial: trial.outcome.harm)
        console.print(f"play it again: {_again(worst, matrix.plan.seed, own)}", soft_wrap=True)


def _table(matrix: Matrix, title: str, designs: Sequence[Design]) -> Table:
    """Return the worst outcomes of some designs, a class of faults after the other."""
    table = Table(title=title, title_justify="left", box=None, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("fault")
    for phase in matrix.plan.phases:
        table.add_column(_HEADS[phase], no_wrap=True)
    before = ""
    for variant in matrix.plan.variants:
        cells = []
        for phase in matrix.plan.phases:
            outcome = matrix.worst(variant, phase, designs)
            cells.append(_UPSTREAM if outcome is Outcome.UNDETECTED and variant.upstream else _WORDS[outcome])
        kind, _, how = variant.name.partition(", ")
        if how and kind != before:
            table.add_row(kind)
        table.add_row(f"  {how}" if how else kind, *cells)
        before = kind
    return table


def _told(trial: Trial) -> str:
    ended = trial.outcome.value
    if trial.outcome is Outcome.SAFE_STOP:
        after = "" if trial.detected_s is None else f" after {trial.detected_s * 1e3:.0f} ms"
        ended = f"safe stop{after} ({trial.reason})"
    elif trial.outcome is not Outcome.TOLERATED:
        ended += f", off by {trial.off_counts:.0f} counts"
    run = f"{trial.variant.name}; {trial.phase.value}, design {trial.design.value}, run {trial.seed}"
    return f"{run}: {ended}"


def _again(trial: Trial, seed: int, own: Sequence[str]) -> str:
    words = ["rtec", "safety", *own, "--fault", trial.variant.name, "--phase", hyphened(trial.phase.value)]
    words += ["--design", trial.design.value, "--first", str(trial.seed), "--seeds", "1"]
    return shlex.join(words + ([] if seed == 1 else ["--seed", str(seed)]))


def _show_soak(console: Console, soak: Soak) -> None:
    fired, outcomes = soak.fired(), soak.outcomes
    console.print(
        f"Soak: {soak.hours():.1f} h in {len(soak.episodes)} episodes, {sum(fired.values())} faults of {len(fired)} "
        f"classes; tolerated {outcomes[Outcome.TOLERATED]}, safe stop {outcomes[Outcome.SAFE_STOP]}, "
        f"lost before the box {len(soak.undetected('before the box'))}, "
        f"with Design B's processor {len(soak.undetected('with the processor'))}, "
        f"undetected {len(soak.undetected())}"
    )
