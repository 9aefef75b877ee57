"""A diagnosis as a page, figures, tables and plain data."""

from rtec.report.diagnosis.document import diagnosis_document
from rtec.report.diagnosis.sentence import verdict_sentence
from rtec.report.diagnosis.terminal import diagnosis_table

__all__ = ["diagnosis_document", "diagnosis_table", "verdict_sentence"]
