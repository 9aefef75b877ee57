"""A diagnosis or a comparison as a page, figures, tables and plain data."""

from rtec.report.diagnosis.document import comparison_document, diagnosis_document
from rtec.report.diagnosis.folder import write_comparison, write_diagnosis, write_several
from rtec.report.diagnosis.plates import comparison_figures, diagnosis_figures
from rtec.report.diagnosis.sentence import comparison_sentence, verdict_sentence
from rtec.report.diagnosis.several import (
    change_entries,
    changes_sentence,
    changes_table,
    several_document,
    several_table,
)
from rtec.report.diagnosis.terminal import comparison_table, diagnosis_table, found_table

__all__ = [
    "change_entries",
    "changes_sentence",
    "changes_table",
    "comparison_document",
    "comparison_figures",
    "comparison_sentence",
    "comparison_table",
    "diagnosis_document",
    "diagnosis_figures",
    "diagnosis_table",
    "found_table",
    "several_document",
    "several_table",
    "verdict_sentence",
    "write_comparison",
    "write_diagnosis",
    "write_several",
]
