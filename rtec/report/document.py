"""The JSON document of ``rtec run``."""

from __future__ import annotations

from typing import Any

from rtec.report.diagnosis import diagnosis_document
from rtec.report.plain_data import plain
from rtec.report.results import StudyResult, row_dict


def study_document(result: StudyResult) -> dict[str, Any]:
    """Return a study as plain data under the names that scripts rely on: what ``rtec run --json`` prints.

    Parameters
    ----------
    result
        The study.

    Returns
    -------
    dict
        Lengths in µm, whatever the study's unit; ``diagnosis`` as of ``rtec diagnose --json``, None where the
        predictor was given.
    """
    learned = result.learned
    document = {
        "study": result.study,
        "unit": "um",
        "repeatability_um": result.repeatability_mm * 1000.0,
        "seed": result.seed,
        "diagnosis": None if learned is None else diagnosis_document(learned.diagnosis),
        "model": _model(result),
        "rows": [row_dict(row) for row in result.rows],
        "warnings": list(result.warnings),
        "wall_s": result.wall_s,
    }
    cleaned: dict[str, Any] = plain(document)
    return cleaned


def _model(result: StudyResult) -> dict[str, Any]:
    """Return where the PC's predictor comes from, and how far it is from the axis."""
    scores = () if result.learned is None else result.learned.scores
    return {
        "predictor": result.predictor,
        "left_out": {left.effect: left.why for left in result.left_out},
        "rms_against_truth_um": result.predictor_score.rms_mm * 1000.0,
        "worst_against_truth_um": result.predictor_score.worst_mm * 1000.0,
        "steps_against_truth_um": [score.rms_mm * 1000.0 for score in scores],
    }
