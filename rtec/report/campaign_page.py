"""Tables of a campaign in a page of Markdown: between its comments they are the campaign's, all else is by hand."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rtec.errors import ArgumentError
from rtec.injector import Design
from rtec.io import read_text, write_text
from rtec.readable import hertz_text
from rtec.report.campaign_coverage import coverage_values
from rtec.report.campaign_rates import RATE_HEADS, rates, threat, totals
from rtec.report.campaign_tally import Group, tallied
from rtec.report.figures_campaign import words_of
from rtec.report.rendering import markdown_table
from rtec.verify.campaign.job import Record, Value
from rtec.verify.campaign.plan import Plan
from rtec.verify.campaign.run import Campaign
from rtec.verify.campaign.store import Store
from rtec.verify.envelope.jobs import ENVELOPE

Table = tuple[Sequence[str], Sequence[Sequence[object]]]
"""Heads and rows."""
_THREAT_HEADS = "threat", "faults", "defence", "harm", "residual rate, 95 %"
LIMIT_HEADS = (
    "processor", "design", "500 kHz", "inserts to", "passes to", "safe to", "limited by", "jitter",
    "from steady motion",
)  # fmt: skip


def _places(plan: Plan) -> re.Pattern[str]:
    return re.compile(rf"(<!-- rtec campaign {re.escape(plan.name)}: ([^\n]*?) -->\n).*?(<!-- end -->)", re.S)


def check_page(page: Path, plan: Plan) -> str:
    """Check that a page has a place for a plan, and return its text; errors as of `fill_page`."""
    text = read_text(page, "a page in Markdown")
    if not _places(plan).search(text):
        example = f"a line <!-- rtec campaign {plan.name}: rates -->, and <!-- end --> below it"
        raise ArgumentError("--page", str(page), example, problem="has no place for this plan")
    return text


def fill_page(page: Path, campaign: Campaign, store: Store, addresses: Sequence[str]) -> list[str]:
    """Write the tables of a campaign into a page that has places for them.

    Parameters
    ----------
    page
        Its places are lines ``<!-- rtec campaign PLAN: TABLE -->`` and ``<!-- end -->``; what is between is replaced.
        A table is ``results``, ``rates``, ``requirements``, ``threats``, ``coverage``, or of an envelope ``limits``.
    campaign, store, addresses
        What came of it, its records, and the addresses of its jobs.

    Returns
    -------
    list of str
        The names of the tables written.

    Raises
    ------
    ArgumentError
        The page has no place for this plan, or one for a table that the campaign does not have.
    FileFormatError, OutputError
        The page cannot be read or written.
    """
    text, makers = check_page(page, campaign.plan), _tables(campaign, store, addresses)
    place = _places(campaign.plan)
    names = [name for _, name, _ in place.findall(text)]
    for name in names:
        if name not in makers:
            raise ArgumentError("--page", repr(name), ", ".join(makers), problem="is no table of this plan")
    made = {name: markdown_table(*makers[name]()) for name in names}
    write_text(page, place.sub(lambda found: f"{found[1]}\n{made[found[2]]}\n\n{found[3]}", text))
    return names


def _tables(campaign: Campaign, store: Store, addresses: Sequence[str]) -> dict[str, Callable[[], Table]]:
    """Return what makes each table that the campaign has."""
    tally = tallied(campaign.plan, store, addresses)
    tables: dict[str, Callable[[], Table]] = {
        "results": lambda: (("result", "jobs", "share", "what happened"), totals(campaign)),
        "rates": lambda: (
            (*campaign.by, *RATE_HEADS),
            [(*map(words_of, row), *rates(counts)) for row, counts in campaign.rows.items()],
        ),
        "requirements": lambda: (
            ("requirement", *RATE_HEADS),
            [(name, *rates(counts)) for name, counts in tally.requirements.items()],
        ),
    }
    if tally.threats:
        tables["threats"] = lambda: (_THREAT_HEADS, [_threat(group) for group in tally.threats])
    if campaign.coverage is not None:
        tables["coverage"] = lambda: _coverage(campaign)
    if campaign.plan.kind is ENVELOPE:
        tables["limits"] = lambda: (LIMIT_HEADS, _limits(campaign, store, addresses))
    return tables


def _threat(group: Group) -> tuple[object, ...]:
    return group.title, len(group.faults), group.defence, *threat(group)[-2:]


def _coverage(campaign: Campaign) -> Table:
    values = coverage_values(campaign.coverage)
    rows = [(*key, *(text or "–" for text, _ in cells)) for key, cells in values["coverage_rows"]]
    return values["coverage_heads"], rows


def _limits(campaign: Campaign, store: Store, addresses: Sequence[str]) -> list[list[str]]:
    """Return the rows of an envelope, processor by processor."""
    processors = list(campaign.plan.grid["processor"])
    records = [done.record for done in store.records(addresses)]
    return [limit_cells(one) for one in sorted(records, key=lambda one: processors.index(one["processor"]))]


def limit_cells(record: Record) -> list[str]:
    """Return the cells of a row of an envelope; accelerations are those at counts of 1 µm.

    Parameters
    ----------
    record
        As of `rtec.verify.envelope.jobs.row_record`.
    """
    jitter_ps, ramp = record["max_jitter_ps"], record["max_acceleration_m_s2_at_1um"]
    beyond = "beyond " if "passes beyond" in str(record["summary"]) else ""
    return [
        str(record["processor"]), _short(record), str(record["at_500khz"]), _hertz(record["max_inserting_hz"]),
        beyond + _hertz(record["max_passing_hz"]), _hertz(record["max_safe_hz"]), str(record["limited_by"]),
        "–" if jitter_ps is None else f"{float(jitter_ps) * 1e-3:.3g} ns",
        "–" if ramp is None else f"{float(f'{float(ramp):.3g}'):.10g} m/s²",
    ]  # fmt: skip


def _short(record: Mapping[str, Value]) -> str:
    return Design.named(str(record["design"])).short


def _hertz(value: Value) -> str:
    return hertz_text(float(value), 4) if value else "none"
