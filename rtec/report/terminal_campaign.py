"""How ``rtec campaign`` tells its result on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rtec.rates import clopper_pearson, never_seen

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rtec.verify.campaign.run import Campaign, Counts
    from rtec.verify.campaign.sensitivity import SobolIndex

_TOLD = 10
"""Jobs that failed, and holes, up to which each has a line."""


def show(campaign: Campaign, again: str) -> None:
    """Print a line for each row, the total, and why the answer is not good where it is not.

    Parameters
    ----------
    campaign
        What came of it.
    again
        The command, to which ``--job`` and an address are added.
    """
    console = Console(highlight=False)
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    for name in campaign.by:
        table.add_column(name, overflow="fold")
    for name in ("tried", "failed", "95 %", "no effect"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("outcomes")
    for values, counts in campaign.rows.items():
        table.add_row(*(f"{v:g}" if isinstance(v, float) else str(v) for v in values), *_cells(counts))
    console.print(table)
    total = campaign.counts
    console.print(
        f"{total.tried + total.not_activated} of {campaign.jobs} jobs done: {total.passed} passed, "
        f"{total.failed} failed, {total.exempt} exempt, {total.not_activated} not activated.",
        soft_wrap=True,
    )
    if total.tried:
        console.print(_rate(total), soft_wrap=True)
    if campaign.coverage is not None:
        named = (
            f"of {' x '.join(campaign.coverage.dimensions)}: {campaign.coverage.hit} of {campaign.coverage.possible}"
        )
        console.print(f"Coverage {named} took effect; -o and --json name the others.", soft_wrap=True)
    for line in _sensitivity(campaign):
        console.print(line, soft_wrap=True)
    if total.exempt:
        console.print("Exempt: harm that supervision cannot prevent.")
    for line in _against(campaign, again):
        console.print(line, soft_wrap=True, markup=False)


def _sensitivity(campaign: Campaign) -> Iterator[str]:
    """Yield a line for each result whose variance has been split up, the parameters with the largest share first."""
    split: dict[str, list[SobolIndex]] = {}
    for index in campaign.sensitivity:
        split.setdefault(" ".join([*map(str, index.where.values()), index.of]), []).append(index)
    if split:
        yield "Total Sobol indices, with 95 % intervals:"
    for where, parts in split.items():
        parts.sort(key=lambda index: index.total, reverse=True)
        shares = map(_share, parts)
        yield f"  {where}: {', '.join(shares)}"


def _share(index: SobolIndex) -> str:
    interval = "" if index.total_95 is None else f" ({index.total_95[0]:.2f}..{index.total_95[1]:.2f})"
    return f"{index.parameter} {index.total:.2f}{interval}"


def _against(campaign: Campaign, again: str) -> Iterator[str]:
    """Yield why the answer is not good, a line each."""
    for one in campaign.failing[:_TOLD]:
        words = ", ".join(str(value) for value in one.job.parameters.values())
        yield f"failed: {words}, run {one.job.run}; again: {again} --job {one.address}"
    if campaign.counts.failed > _TOLD:
        yield f"and {campaign.counts.failed - _TOLD} more that failed; --csv FILE.csv has them all"
    for hole in campaign.holes[:_TOLD]:
        words = ", ".join(str(value) for value in hole.values())
        yield f"never took effect: {words}; more --runs meet it at other moments"
    if len(campaign.holes) > _TOLD:
        yield f"and {len(campaign.holes) - _TOLD} more that never took effect; --json lists them"
    for raised in campaign.raised[:_TOLD]:
        yield f"no record: job {raised.address}: {raised.error}"


def _cells(counts: Counts) -> list[str]:
    tried = counts.tried
    low, high = clopper_pearson(counts.failed, tried) if tried else (0.0, 1.0)
    interval = "-" if not tried else f"{low:.2g}..{high:.2g}" if counts.failed else f"< {never_seen(tried):.2g}"
    outcomes = ", ".join(f"{name} {count}" for name, count in counts.outcomes.most_common())
    return [str(tried), str(counts.failed), interval, str(counts.not_activated), outcomes]


def _rate(counts: Counts) -> str:
    tried = counts.tried
    if not counts.failed:
        return f"No failure in {tried}: the rate is below {never_seen(tried):.2g} at 95 % confidence."
    low, high = clopper_pearson(counts.failed, tried)
    rate = f"{counts.failed / tried:.2g}"
    return f"Rate of failures {rate}, with 95 % confidence {low:.2g} to {high:.2g} (Clopper and Pearson)."
