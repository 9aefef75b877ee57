"""A diagnosis or a comparison as a page, figures, tables and plain data."""

from rtec.report.diagnosis.document import comparison_document, diagnosis_document
from rtec.report.diagnosis.sentence import comparison_sentence, verdict_sentence
from rtec.report.diagnosis.terminal import comparison_table, diagnosis_table

__all__ = [
    "comparison_document",
    "comparison_sentence",
    "comparison_table",
    "diagnosis_document",
    "diagnosis_table",
    "verdict_sentence",
]
