"""The JSON documents of ``rtec diagnose``, ``rtec add`` and ``rtec compare``."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

from rtec.dataset.dataset import warnings_of
from rtec.inference.collinear import collinear_pairs, nested
from rtec.inference.fit import values_of
from rtec.inference.results import Candidate, Diagnosis, LearnedCurve, Step, Unknown, Value
from rtec.io import strict
from rtec.report.diagnosis.quantities import Shown, shown_of, unit_suffix

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison, Stretch


def diagnosis_document(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return a diagnosis as plain data: what ``rtec diagnose --json`` prints.

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
        "final": _final(diagnosis),
        **_in_unit(shown, diagnosis, "rms_before", "rms_heldout_before", "rms_after"),
        "not_testable": dict(diagnosis.not_testable),
        "minimum_detectable": {name: shown.number(value) for name, value in diagnosis.minimum_detectable},
        "outliers": [
            {"row": one.row, diagnosis.dataset.observe: shown.number(one.value)} for one in diagnosis.outliers
        ],
        "probability": dict(diagnosis.probability),
        "approximate": list(diagnosis.approximate),
        "unseen_periods": list(diagnosis.unseen_periods),
        "unknown": _unknown(diagnosis.unknown, diagnosis.dataset.units.position),
        "curve": _curve(diagnosis.curve, shown),
        "suggested_experiment": diagnosis.experiment.text,
        "lack_of_fit": dict(diagnosis.lack_of_fit),
        "look_alikes": [
            {"effects": [first, second], "cosine": cosine, "nested": nested(first, second)}
            for first, second, cosine in collinear_pairs(diagnosis.cosines)
        ],
        "notes": list(dict.fromkeys([*diagnosis.dataset.notes, *diagnosis.notes])),
    }
    return _document(diagnosis, shown, document)


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as plain data: what ``rtec compare --json`` prints.

    Returns
    -------
    dict
        Lengths, forces and the like in ``unit``; what is no finite number is None.
    """
    shown = shown_of(comparison.dataset.units)
    document = {
        **_in_unit(shown, comparison, "rms"),
        "effects": list(comparison.model.names),
        "where": [
            _plain(where, "quantity", "unit", "share") | {"worst": [_stretch(one, shown) for one in where.worst]}
            for where in comparison.where
        ],
        "notes": list(comparison.dataset.notes),
    }
    return _document(comparison, shown, document)


def _document(result: Diagnosis | Comparison, shown: Shown, more: dict[str, Any]) -> dict[str, Any]:
    """Return what a search and a comparison both tell, with what else there is."""
    noise = result.noise
    document = {
        **_in_unit(shown, result, "rms_heldout"),
        "noise_floor": shown.number(noise.floor),
        "unit": shown.unit,
        **_plain(result.dataset, "rows", "observe", "source"),
        "warnings": warnings_of(result.dataset, result.heldout),
        "heldout_by": result.heldout_by,
        "rms_heldout_rows": None if result.rms_heldout_rows is None else shown.number(result.rms_heldout_rows),
        "heldout_rows": (result.heldout or result.dataset).rows,
        "datum": shown.number(result.model.datum),
        "noise": _plain(noise, "from_repeats", "correlation", "white_share", "degrees_of_freedom")
        | _in_unit(shown, noise, "sigma", "sigma_adjacent"),
    }
    cleaned: dict[str, Any] = strict(more | document)
    return cleaned


def _plain(record: object, *names: str) -> dict[str, Any]:
    """Return fields of a record as they are."""
    return {name: getattr(record, name) for name in names}


def _in_unit(shown: Shown, record: object, *names: str) -> dict[str, float | None]:
    """Return fields of a record in the unit of the document."""
    return {name: shown.number(getattr(record, name)) for name in names}


def _stretch(stretch: Stretch, shown: Shown) -> dict[str, Any]:
    return _plain(stretch, "low", "high", "direction", "rows") | _in_unit(shown, stretch, "mean", "rms")


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
    return {
        "effect": step.effect,
        "added": True,
        **_plain(step, "p_adjusted", "reason"),
        **_in_unit(shown, step, "rms_train", "rms_heldout"),
        "params": parameters_document(step.params),
        "heldout_gain": step.gain * shown.factor**2,
        "heldout_gain_error": step.gain_error * shown.factor**2,
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
        **_plain(candidate, "effect", "accepted", "p_adjusted", "cosine", "reason"),
        **_in_unit(shown, candidate, "predicted_rms", "achieved_rms"),
        "params": parameters_document(candidate.params),
        "tied_with": list(candidate.tied_with),
    }


def _curve(curve: LearnedCurve | None, shown: Shown) -> dict[str, Any] | None:
    """Return a learned curve: what it is over, what it leaves and is like, and its values with standard errors."""
    if curve is None:
        return None
    shape = curve.shape
    return {
        "over": shape.over,
        "across": shape.across or None,
        "by_direction": shape.by_direction,
        "rms": shown.number(curve.rms),
        "rms_heldout": shown.number(curve.rms_heldout),
        "descriptions": list(curve.descriptions),
        "at": curve.at.tolist(),
        "at_across": curve.across.tolist() if shape.across else None,
        "directions": list(curve.ways),
        "values": (curve.values * shown.factor).tolist(),
        "errors": (curve.errors * shown.factor).tolist(),
    }


def _unknown(unknown: Unknown | None, position_unit: str) -> dict[str, Any] | None:
    if unknown is None:
        return None
    found = _plain(unknown, "period", "frequency_hz", "description")
    return {"depends_on": list(unknown.depends_on), "period_unit": position_unit, **found}
