"""Results as a page, figures and tables; nothing is computed here."""

from rtec.report.folder import write_report
from rtec.report.results import (
    FeedCurve,
    HoldCurve,
    Limit,
    StudyResult,
    StudyRow,
    Waveform,
    row_dict,
)
from rtec.report.terminal import terminal_table

__all__ = [
    "FeedCurve",
    "HoldCurve",
    "Limit",
    "StudyResult",
    "StudyRow",
    "Waveform",
    "row_dict",
    "terminal_table",
    "write_report",
]
