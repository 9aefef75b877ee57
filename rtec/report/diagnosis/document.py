"""The JSON documents of ``rtec diagnose``, ``rtec add`` and ``rtec compare``."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

from rtec.inference.collinear import collinear_pairs, nested
from rtec.inference.fit import values_of
from rtec.inference.results import Candidate, Diagnosis, NoiseFloor, Step, Unknown, Value
from rtec.io import strict
from rtec.report.diagnosis.quantities import Shown, shown_of, unit_suffix

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison, Where


def diagnosis_document(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return a diagnosis as plain data: what ``rtec diagnose --json`` prints.

    Parameters
    ----------
    diagnosis
        The search.

    Returns
    -------
    dict
        Lengths, forces and the like in ``unit``; parameters in the unit that ends their key, with the standard error
        under ``..._error``; what is no finite number is None.
    """
    shown = shown_of(diagnosis.dataset.units)
    document = {
        "verdict": diagnosis.verdict.value,
        "effects": list(diagnosis.effects),
        "steps": [_step(step, shown) for step in diagnosis.steps],
        "candidates": [_candidate(candidate, shown) for candidate in diagnosis.candidates],
        "noise_floor": shown.number(diagnosis.noise.floor),
        "final": _final(diagnosis),
        "rms_before": shown.number(diagnosis.rms_before),
        "rms_heldout_before": shown.number(diagnosis.rms_heldout_before),
        "rms_after": shown.number(diagnosis.rms_after),
        "rms_heldout": shown.number(diagnosis.rms_heldout),
        "unit": shown.unit,
        "not_testable": dict(diagnosis.not_testable),
        "minimum_detectable": {name: shown.number(value) for name, value in diagnosis.minimum_detectable},
        "outliers": [
            {"row": one.row, diagnosis.dataset.observe: shown.number(one.value)} for one in diagnosis.outliers
        ],
        "probability": dict(diagnosis.probability),
        "unseen_periods": list(diagnosis.unseen_periods),
        "unknown": _unknown(diagnosis.unknown, diagnosis.dataset.units.position),
        "suggested_experiment": diagnosis.experiment.text,
        "observe": diagnosis.dataset.observe,
        "source": diagnosis.dataset.source,
        "rows": diagnosis.dataset.rows,
        "heldout_by": diagnosis.heldout_by,
        "heldout_rows": diagnosis.dataset.rows if diagnosis.heldout is None else diagnosis.heldout.rows,
        "datum": shown.number(diagnosis.model.datum),
        "noise": noise_document(diagnosis.noise, shown),
        "lack_of_fit": dict(diagnosis.lack_of_fit),
        "look_alikes": _collinear_pairs(diagnosis),
        "notes": list(dict.fromkeys([*diagnosis.dataset.notes, *diagnosis.notes])),
    }
    cleaned: dict[str, Any] = strict(document)
    return cleaned


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as plain data: what ``rtec compare --json`` prints.

    Parameters
    ----------
    comparison
        A model against a measurement.

    Returns
    -------
    dict
        Lengths, forces and the like in ``unit``; what is no finite number is None.
    """
    shown = shown_of(comparison.dataset.units)
    document = {
        "rms": shown.number(comparison.rms),
        "rms_heldout": shown.number(comparison.rms_heldout),
        "noise_floor": shown.number(comparison.noise.floor),
        "unit": shown.unit,
        "rows": comparison.dataset.rows,
        "observe": comparison.dataset.observe,
        "source": comparison.dataset.source,
        "effects": list(comparison.model.names),
        "datum": shown.number(comparison.model.datum),
        "heldout_by": comparison.heldout_by,
        "heldout_rows": comparison.dataset.rows if comparison.heldout is None else comparison.heldout.rows,
        "noise": noise_document(comparison.noise, shown),
        "where": [_where(where, shown) for where in comparison.where],
        "notes": list(comparison.dataset.notes),
    }
    cleaned: dict[str, Any] = strict(document)
    return cleaned


def _where(where: Where, shown: Shown) -> dict[str, Any]:
    return {
        "quantity": where.quantity,
        "unit": where.unit,
        "share": where.share,
        "worst": [
            {
                "low": stretch.low,
                "high": stretch.high,
                "direction": stretch.direction,
                "mean": shown.number(stretch.mean),
                "rms": shown.number(stretch.rms),
                "rows": stretch.rows,
            }
            for stretch in where.worst
        ],
    }


def noise_document(noise: NoiseFloor, shown: Shown) -> dict[str, Any]:
    """Return where the noise floor comes from."""
    return {
        "from_repeats": noise.from_repeats,
        "sigma": shown.number(noise.sigma),
        "correlation": noise.correlation,
        "white_share": noise.white_share,
        "degrees_of_freedom": noise.degrees_of_freedom,
        "sigma_adjacent": shown.number(noise.sigma_adjacent),
    }


def parameters_document(values: tuple[Value, ...]) -> dict[str, float | str | None]:
    """Return parameters as one flat dict, the unit at the end of each key; a second one of a name gets a number.

    Examples
    --------
    >>> parameters_document((Value("backlash", 12.3, 0.2, "um"), Value("sensor", "temperature_nut", None, "")))
    {'backlash_um': 12.3, 'backlash_um_error': 0.2, 'sensor': 'temperature_nut'}
    """
    flat: dict[str, float | str | None] = {}
    for value in values:
        suffix = unit_suffix(value.unit)
        stem = value.name.removesuffix(suffix)
        numbers = itertools.count(2)
        key = stem + suffix
        while key in flat:
            key = f"{stem}_{next(numbers)}{suffix}"
        flat[key] = value.value
        if value.error is not None:
            flat[f"{key}_error"] = value.error
    return flat


def _step(step: Step, shown: Shown) -> dict[str, Any]:
    gain_factor = shown.factor**2
    return {
        "effect": step.effect,
        "added": step.added,
        "params": parameters_document(step.params),
        "rms_train": shown.number(step.rms_train),
        "rms_heldout": shown.number(step.rms_heldout),
        "p_adjusted": step.p_adjusted,
        "heldout_gain": step.gain * gain_factor,
        "heldout_gain_error": step.gain_error * gain_factor,
        "reason": step.reason,
    }


def _final(diagnosis: Diagnosis) -> dict[str, dict[str, list[float | str | None]]]:
    """Return the parameters of the model found: value, standard error and unit by effect and name.

    A second effect of a name, such as another family of waves, gets a number: ``cyclic_2``.
    """
    found: dict[str, dict[str, list[float | str | None]]] = {}
    for term in diagnosis.model.terms:
        numbers, key = itertools.count(2), term.name
        while key in found:
            key = f"{term.name}_{next(numbers)}"
        found[key] = {v.name: [v.value, v.error, v.unit] for v in values_of(term, diagnosis.model)}
    return found


def _candidate(candidate: Candidate, shown: Shown) -> dict[str, Any]:
    return {
        "effect": candidate.effect,
        "accepted": candidate.accepted,
        "predicted_rms": shown.number(candidate.predicted_rms),
        "achieved_rms": shown.number(candidate.achieved_rms),
        "p_adjusted": candidate.p_adjusted,
        "params": parameters_document(candidate.params),
        "tied_with": list(candidate.tied_with),
        "cosine": candidate.cosine,
        "reason": candidate.reason,
    }


def _unknown(unknown: Unknown | None, position_unit: str) -> dict[str, Any] | None:
    if unknown is None:
        return None
    return {
        "depends_on": list(unknown.depends_on),
        "period": unknown.period,
        "period_unit": position_unit,
        "frequency_hz": unknown.frequency_hz,
        "description": unknown.description,
    }


def _collinear_pairs(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    return [
        {"effects": [first, second], "cosine": cosine, "nested": nested(first, second)}
        for first, second, cosine in collinear_pairs(diagnosis.cosines)
    ]
