"""One job of a campaign as a folder: what was seen of it as picture and waveform file, and its record."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from rtec.report.appearance import printable
from rtec.report.drawn import Plate, drawn
from rtec.report.figures_job import job_figure
from rtec.report.page_folder import write_page_folder
from rtec.verify.campaign.trace import Trace

CAPTION = (
    "Totals and words, then the lines around each moment that matters. The encoder's side is that of the box's "
    "input, behind the cable; counts are from the beginning of the recording. job.vcd has all of it."
)


def write_job(trace: Trace, document: Mapping[str, object], plan: str, folder: Path) -> Path:
    """Write page, picture and ``job.vcd`` of one job, all or nothing; errors as of `write_page_folder`.

    Parameters
    ----------
    trace
        What was seen.
    document
        Parameters and record.
    plan
        Its name.
    folder
        Where to; it exists.

    Returns
    -------
    Path
        The page.
    """
    figures = drawn([Plate("waveform", trace.title, CAPTION, partial(job_figure, trace))])
    rows = [(name, printable(str(value))) for name, value in document.items() if value not in (None, "", [])]
    values = {"title": printable(trace.title), "plan": printable(plan), "rows": rows}
    return write_page_folder(
        folder, figures, dict(document), "campaign_job.html.j2", values,
        beside=lambda new: trace.write_vcd(new / "job.vcd"),
    )  # fmt: skip
