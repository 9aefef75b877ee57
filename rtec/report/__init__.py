"""Results as a page, figures and tables; nothing is computed here."""

from rtec.report.document import study_document
from rtec.report.folder import write_report
from rtec.report.results import (
    FeedCurve,
    HoldCurve,
    Learned,
    Limit,
    Round,
    StudyResult,
    StudyRow,
    TruthScore,
    Waveform,
    row_dict,
)
from rtec.report.search import rounds_sentence
from rtec.report.terminal import staircase_table, terminal_table

__all__ = [
    "FeedCurve",
    "HoldCurve",
    "Learned",
    "Limit",
    "Round",
    "StudyResult",
    "StudyRow",
    "TruthScore",
    "Waveform",
    "rounds_sentence",
    "row_dict",
    "staircase_table",
    "study_document",
    "terminal_table",
    "write_report",
]
