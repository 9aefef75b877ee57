"""The JSON document of ``rtec run``."""

from __future__ import annotations

from typing import Any

from rtec.io import strict
from rtec.report.diagnosis import diagnosis_document
from rtec.report.shift import shift_document
from rtec.report.tables import COUNT_COLUMNS, ISO_COLUMNS, READING_COLUMNS, THESIS_COLUMNS, LengthColumn
from rtec.study.results import Round, StudyResult, StudyRow


def study_document(result: StudyResult) -> dict[str, Any]:
    """Return a study as plain data under the names that scripts rely on: what ``rtec run --json`` prints.

    Returns
    -------
    dict
        Lengths in µm, whatever the study's unit; ``diagnosis`` as of ``rtec diagnose --json``, None where the
        predictor was given.
    """
    learned = result.learned
    document = {
        "study": result.study.name,
        "unit": "um",
        "repeatability_um": result.study.repeatability_mm * 1000.0,
        "seed": result.study.seed,
        "diagnosis": None if learned is None else diagnosis_document(learned.diagnosis),
        "rounds": [] if learned is None else [_round(one) for one in learned.rounds],
        "model": _model(result),
        "rows": [row_dict(row) for row in result.rows],
        "shift": shift_document(result.shift),
        "warnings": list(result.warnings),
        "wall_s": result.wall_s,
    }
    cleaned: dict[str, Any] = strict(document)
    return cleaned


def _round(one: Round) -> dict[str, Any]:
    return {
        "readings": one.readings.size,
        "runs": one.plan.runs,
        "increment_mm": one.plan.increment_mm,
        "machine_s": one.machine_s,
        "rms_less_model_before_um": one.missed_rms_mm * 1000.0,
        "rms_less_model_um": one.left_rms_mm * 1000.0,
        "verdict": one.diagnosis.verdict.value,
        "effects": list(one.diagnosis.effects),
        "unseen_periods": list(one.diagnosis.unseen_periods),
        "rms_against_truth_um": one.score.rms_mm * 1000.0,
        "worst_against_truth_um": one.score.worst_mm * 1000.0,
    }


def _model(result: StudyResult) -> dict[str, Any]:
    scores = () if result.learned is None else result.learned.scores
    return {
        "predictor": result.study.predictor,
        "left_out": {left.effect: left.why for left in result.study.left_out},
        "rms_against_truth_um": result.predictor_score.rms_mm * 1000.0,
        "worst_against_truth_um": result.predictor_score.worst_mm * 1000.0,
        "steps_against_truth_um": [score.rms_mm * 1000.0 for score in scores],
    }


def row_dict(row: StudyRow) -> dict[str, object]:
    """Return one row under the names that scripts rely on, lengths in µm."""

    def um(column: LengthColumn) -> float | None:
        value_mm = column.of(row)
        return None if value_mm is None else value_mm * 1000.0

    return {
        "name": row.name,
        "reason": row.reason or None,
        **{f"{column.key}_um": um(column) for column in THESIS_COLUMNS},
        "iso230": {column.key: um(column) for column in ISO_COLUMNS},
        **{f"{column.key}_um": um(column) for column in READING_COLUMNS},
        **{column.key: column.value(row) for column in COUNT_COLUMNS},
        "beyond_word_steps": row.run.beyond_word_steps,
        "audit": row.run.audit,
        "audit_counts": row.run.audit_counts,
        "ending": row.run.ending.name,
        "faults": [{"fault": str(fired.fault), "times": fired.times} for fired in row.run.fired],
    }
