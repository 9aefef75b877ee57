"""The report of a campaign: page, map, the jobs of every combination, and their records for other programs."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rtec.io import write_text
from rtec.rates import clopper_pearson, never_seen, wilson
from rtec.report.appearance import printable
from rtec.report.campaign_coverage import coverage_csv, coverage_values
from rtec.report.campaign_rates import RATE_HEADS, THREAT_HEADS, between, rates, threat, totals
from rtec.report.campaign_tally import Cell, Group, Tally, residual, tallied
from rtec.report.drawn import Illustration, Plate, drawn
from rtec.report.figures_campaign import campaign_figure, words_of, worst_of
from rtec.report.figures_job import job_figure
from rtec.report.figures_sobol import combinations, sobol_figure
from rtec.report.folder import file_name
from rtec.report.page_folder import write_page_folder
from rtec.report.rendering import html_page
from rtec.verify.campaign.export import again_of, write_csv, write_junit
from rtec.verify.campaign.job import FAILED, Parameters, Value
from rtec.verify.campaign.run import Campaign, Counts
from rtec.verify.campaign.store import Done, Store
from rtec.verify.campaign.trace import Trace, trace_of

JOBS = "jobs"
"""Folder of the jobs' pages, and the name of their tables."""
_LISTED = 12
_MOST_SHOWN = 500
"""Jobs of a cell that its page shows, those that failed first; the tables have all."""
DEFINITIONS = (
    (
        "took effect",
        "The fault found something to act on; what did not take effect proves nothing and is in no rate.",
    ),
    ("passed", "The fault took effect, and nothing went wrong that should not."),
    ("failed", "It did harm that supervision can prevent."),
    ("exempt", "It did harm that supervision cannot prevent; in the denominator, but not a failure."),
    ("hole", "A combination that took effect in none of its jobs."),
    ("Wilson, Clopper-Pearson", "Intervals of 95 % of the rate of failures; the second is the exact one."),
    ("below", "Bound of the rate of something that none of n jobs showed, with 95 % confidence: about 3/n."),
    ("rate", "Of these jobs, a designed experiment: not how often something happens in a workshop."),
)
"""Terms of the page and what they mean."""


def write_campaign(campaign: Campaign, store: Store, addresses: Sequence[str], folder: Path, *, again: str) -> Path:
    """Write page, map, jobs and tables of a campaign, all or nothing; errors as of `write_page_folder`.

    Parameters
    ----------
    campaign
        What came of it.
    store, addresses
        Its records; addresses of the plan's jobs, in their order.
    folder
        Where to; it exists.
    again
        The command, to which ``--job`` and an address are added.

    Returns
    -------
    Path
        The page.
    """
    tally = tallied(campaign.plan, store, addresses)
    traces = _traces(campaign, tally)
    report = _Report(campaign, tally, store, again, traces.keys())
    plate = Plate("map", "Every combination", report.caption, lambda: campaign_figure(tally, report.link))
    figures = drawn([plate, *_sobol_plates(campaign)])

    def beside(new: Path) -> None:
        (new / JOBS).mkdir()
        for address, trace in traces.items():
            for figure in drawn([Plate(address, trace.title, "", partial(job_figure, trace))]):
                (new / JOBS / f"{address}.svg").write_bytes(figure.svg)
            trace.write_vcd(new / JOBS / f"{address}.vcd")
        for page, text in report.job_pages():
            write_text(new / page, text)
        if campaign.coverage is not None:
            write_text(new / "coverage.csv", coverage_csv(campaign.coverage))
        write_csv(new / f"{JOBS}.csv", lambda: store.records(addresses), again, campaign.plan)
        write_junit(new / f"{JOBS}.xml", lambda: store.records(addresses), again, campaign.plan)

    document = campaign.to_dict() | {
        "command": again,
        "threats": [_threat_document(group) for group in tally.threats],
        "requirements": {name: counts.to_dict() for name, counts in tally.requirements.items()},
    }
    return write_page_folder(folder, figures, document, "campaign.html.j2", report.values(figures), beside=beside)


class _Report:
    """What the pages of a campaign say."""

    def __init__(self, campaign: Campaign, tally: Tally, store: Store, again: str, pictures: Collection[str]) -> None:
        self.campaign, self.tally, self._store, self._again, self._pictures = campaign, tally, store, again, pictures
        rows = tally.rows.values
        self._pages = {
            row: f"{JOBS}/{k + 1:03d}-{file_name(words_of(row) or 'all')}.html" for k, row in enumerate(rows)
        }

    @property
    def caption(self) -> str:
        """Return what the map shows."""
        named = " x ".join(
            axis.name for axis in (self.tally.rows, self.tally.columns, self.tally.panels) if axis.name
        )
        return f"{named}: the worst that happened in the jobs of each combination; a cell leads to its jobs."

    def _anchor(self, column: Value, panel: Value) -> str:
        return f"c{self.tally.columns.values.index(column)}-{self.tally.panels.values.index(panel)}"

    def link(self, row: Value, column: Value, panel: Value) -> str:
        """Return where the jobs of a cell are, from the folder of the figures."""
        return f"../{self._pages[row]}#{self._anchor(column, panel)}"

    def values(self, figures: Sequence[Illustration]) -> dict[str, Any]:
        """Return what the template of the page names."""
        campaign, tally, plan = self.campaign, self.tally, self.campaign.plan
        cells = tally.rows, tally.columns, tally.panels
        failing = [
            (
                f"{page}#{one.address}",
                _words(one.job.parameters, one.job.run),
                _record(one),
                again_of(one, self._again),
            )
            for one in campaign.failing
            for page in [self._pages[one.job.parameters[cells[0].name] if cells[0].name else None]]
        ]
        # ids in an inline drawing are those of the file, and links go from the page
        inline = {
            figure.name: re.sub(r"^.*?(?=<svg)", "", figure.svg.decode(), flags=re.DOTALL).replace('"../', '"')
            for figure in figures
        }
        return {
            "title": printable(plan.name),
            "sentence": sentence(campaign),
            "tone": "good" if campaign.good else "bad",
            "facts": self._facts(),
            "values": [(name, _listed(values)) for name, values in plan.grid.items()]
            + [
                (name, f"{one.low:g} to {one.high:g}, drawn ({one.draw}{', log' if one.log else ''})")
                for name, one in plan.drawn.items()
            ],
            "totals": totals(campaign),
            "rate": _rate(campaign.counts),
            "map": inline.get("map", ""),
            "map_caption": self.caption,
            "job_pages": [(words_of(row) or "all", page) for row, page in self._pages.items() if self._cells(row)],
            "pages": list(self._pages.values()),
            "failing": failing,
            "more_failed": campaign.counts.failed - len(failing),
            "holes": [", ".join(map(" ".join, _named(hole))) for hole in campaign.holes],
            "no_holes": "None: each of them took effect in at least one job."
            if plan.kind.proves
            else "This kind of jobs has no combinations that have to be proved.",
            "errors": [(one.address, one.error) for one in campaign.raised],
            "threat_heads": THREAT_HEADS,
            "threats": [threat(group) for group in tally.threats],
            "requirement_heads": ("requirement", *RATE_HEADS),
            "requirements": [(name, *rates(counts)) for name, counts in tally.requirements.items()],
            "rate_heads": (*campaign.by, *RATE_HEADS),
            "rates": [(*map(words_of, row), *rates(counts)) for row, counts in campaign.rows.items()],
            "sobol": [
                (figure.title, inline[figure.name], figure.caption) for figure in figures if figure.name != "map"
            ],
            "sensitivity": [
                (
                    ", ".join(words_of(value) for value in one.where.values()), one.of, one.parameter,
                    f"{one.first:.2f}", between(one.first_95), f"{one.total:.2f}", between(one.total_95),
                )
                for one in campaign.sensitivity
            ],
            "definitions": DEFINITIONS,
        } | coverage_values(campaign.coverage)  # fmt: skip

    def _facts(self) -> list[tuple[str, str]]:
        campaign, plan = self.campaign, self.campaign.plan
        ids = ", ".join(dict.fromkeys(one.id for one in plan.requirements))
        return [
            ("plan", printable(plan.about)),
            ("a job", plan.kind.does),
            ("jobs", f"{campaign.jobs}, {plan.repeats} of each combination that can prove something"),
            *([("requirements", ids)] if ids else []),
            ("seed", str(plan.seed)),
            ("code", campaign.code),
            ("time", f"{campaign.seconds:.0f} s of all jobs together"),
            ("command", printable(self._again)),
        ]

    def _cells(self, row: Value) -> Iterator[tuple[Value, Value, Cell]]:
        for column in self.tally.columns.values:
            for panel in self.tally.panels.values:
                if (cell := self.tally.cells.get((row, column, panel))) is not None:
                    yield column, panel, cell

    def job_pages(self) -> Iterator[tuple[str, str]]:
        """Yield path and text of the page of each row."""
        for row, page in self._pages.items():
            cells = [
                (
                    self._anchor(column, panel),
                    ", ".join(filter(None, map(words_of, (row, column, panel)))) or "all",
                    worst_of(cell),
                    self._shown(cell),
                    max(cell.counts.tried + cell.counts.not_activated - _MOST_SHOWN, 0),
                )
                for column, panel, cell in self._cells(row)
            ]
            if cells:
                plan, title = printable(self.campaign.plan.name), words_of(row) or "all"
                values = {"plan": plan, "title": title, "cells": cells, "traced": bool(self.campaign.plan.kind.trace)}
                yield page, html_page("campaign_jobs.html.j2", (), **values)

    def _shown(self, cell: Cell) -> list[dict[str, object]]:
        failed, others = list[dict[str, object]](), list[dict[str, object]]()
        for done in self._store.records(cell.addresses):
            some = failed if done.record["result"] == FAILED else others
            if len(some) < _MOST_SHOWN:
                some.append(self._job(done))
        return (failed + others)[:_MOST_SHOWN]

    def _job(self, done: Done) -> dict[str, object]:
        result, outcome = str(done.record["result"]), done.record.get("outcome")
        return {
            "address": done.address,
            "run": done.job.run,
            "failed": result == FAILED,
            "result": result if outcome in (None, result) else f"{result}: {outcome}",
            "record": _record(done),
            "again": again_of(done, self._again),
            "picture": done.address in self._pictures,
        }


def _sobol_plates(campaign: Campaign) -> Iterator[Plate]:
    """Yield the picture of the indices of each combination."""
    caption = "Shares of the variance of each result, with bootstrap intervals of 95 %."
    for k, (words, some) in enumerate(combinations(campaign.sensitivity).items()):
        yield Plate(f"sobol-{k + 1}", words, caption, partial(sobol_figure, some))


def _traces(campaign: Campaign, tally: Tally) -> dict[str, Trace]:
    """Return what there is to see of the jobs that are worth a picture, by their addresses."""
    found = {done.address: trace_of(campaign.plan.kind, done.job) for done in tally.shown}
    return {address: trace for address, trace in found.items() if trace is not None}


def _threat_document(group: Group) -> dict[str, object]:
    return {
        "threat": group.title, "defence": group.defence, "faults": group.faults,
        "told_by": dict(group.told_by), **group.counts.to_dict(), "residual_rate": residual(group.counts),
    }  # fmt: skip


def sentence(campaign: Campaign) -> str:
    """Return in a sentence whether the campaign is good, and if not why."""
    counts = campaign.counts
    missing = campaign.jobs - counts.tried - counts.not_activated
    if campaign.good and counts.tried:
        bound = f"with 95 % confidence the rate of failures is below {never_seen(counts.tried):.2g}"
        return f"None of {counts.tried} jobs that took effect failed: {bound}."
    against = [
        *([f"{counts.failed} of {counts.tried} jobs failed"] if counts.failed else []),
        *([f"combinations that never took effect: {len(campaign.holes)}"] if campaign.holes else []),
        *([f"jobs without a record: {missing}"] if missing else []),
    ]
    return f"{'; '.join(against) or 'No job took effect'}."


def _rate(counts: Counts) -> str:
    tried, failed = counts.tried, counts.failed
    if not tried:
        return "Nothing took effect: there is no rate."
    text = f"Rate of failures {failed / tried:.2g}; Wilson {between(wilson(failed, tried))}, Clopper and Pearson "
    text += f"{between(clopper_pearson(failed, tried))}, both of 95 %"
    return (
        f"{text}." if failed else f"{text}; none was seen in {tried}, so the rate is below {never_seen(tried):.2g}."
    )


def _listed(values: Sequence[Value]) -> str:
    shown = ", ".join(words_of(value) for value in values[:_LISTED])
    return shown if len(values) <= _LISTED else f"{len(values)}: {shown}, ..."


def _named(values: Mapping[str, Value]) -> Iterator[tuple[str, str]]:
    return ((name, words_of(value)) for name, value in values.items())


def _words(parameters: Parameters, run: int) -> str:
    return ", ".join([*(words_of(value) for value in parameters.values()), f"run {run}"])


def _record(done: Done) -> str:
    named = (
        f"{name} {words_of(value)}" for name, value in done.record.items()
        if value not in (None, "") and name not in ("result", "outcome")
    )  # fmt: skip
    return ", ".join(named)
