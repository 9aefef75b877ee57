"""The JSON documents: the contract's keys, in the unit that is shown, strict."""

from __future__ import annotations

import json

import pytest

from rtec.inference.results import Value
from rtec.report.diagnosis import comparison_document, diagnosis_document
from rtec.report.diagnosis.document import parameters_document
from rtec.report.diagnosis.quantities import named_texts, value_text

CONTRACT = {
    "verdict", "effects", "steps", "candidates", "noise_floor", "rms_before", "rms_after", "unit", "not_testable",
    "minimum_detectable", "unknown", "suggested_experiment", "final",
}  # fmt: skip


def _strict(document: object) -> object:
    def refuse(word: str) -> None:
        raise AssertionError(word)

    return json.loads(json.dumps(document, allow_nan=False), parse_constant=refuse)


def test_a_diagnosis_has_the_contracts_keys_in_the_shown_unit(make_diagnosis):
    document = _strict(diagnosis_document(make_diagnosis()))
    assert set(document) >= CONTRACT
    assert document["verdict"] == "NAMED" and document["unit"] == "um"
    assert document["effects"] == ["backlash", "cyclic"]
    numbers = [document[key] for key in ("rms_before", "rms_after", "rms_heldout", "noise_floor")]
    assert numbers == pytest.approx([7.0, 1.0, 1.04, 1.0])
    assert document["not_testable"] == {
        "servo_lag": "no velocity or feed column",
        "interpolation": "no scale signal period",
    }
    assert document["minimum_detectable"] == pytest.approx({"backlash": 0.3, "thermal_growth": 0.4})
    assert document["suggested_experiment"] == "Measure dense points just after a reversal."
    assert document["unknown"] is None


def test_steps_and_candidates_have_the_contracts_keys(make_diagnosis):
    document = diagnosis_document(make_diagnosis())
    assert [(step["effect"], step["added"]) for step in document["steps"]] == [
        ("scale", True), ("backlash", True), ("cyclic", True),
    ]  # fmt: skip
    assert all(
        set(step) >= {"effect", "params", "rms_train", "rms_heldout", "p_adjusted"} for step in document["steps"]
    )
    backlash = document["steps"][1]
    assert backlash["rms_train"] == pytest.approx(3.7) and backlash["rms_heldout"] == pytest.approx(3.885)
    assert backlash["params"] == {"backlash_um": 12.0, "backlash_um_error": 0.2}
    assert backlash["heldout_gain"] == pytest.approx(20.0)  # 2e-5 mm² in µm²
    first = document["candidates"][0]
    assert set(first) >= {"effect", "predicted_rms", "p_adjusted", "tied_with", "reason"}
    assert first["predicted_rms"] == pytest.approx(3.8) and first["tied_with"] == ["windup"]


def test_what_is_no_finite_number_is_null(make_diagnosis, make_step, make_noise):
    step = make_step("backlash", float("inf"), rms_heldout=float("nan"), p_adjusted=float("nan"),
                     params=(Value("backlash", float("nan"), float("inf"), "um"),))  # fmt: skip
    noise = make_noise(from_repeats=False, sigma=float("nan"))
    document = _strict(diagnosis_document(make_diagnosis(steps=(step,), noise=noise, rms_heldout=float("nan"))))
    found = document["steps"][0]
    assert found["rms_train"] is None and found["rms_heldout"] is None and found["p_adjusted"] is None
    assert found["params"] == {"backlash_um": None, "backlash_um_error": None}
    assert document["noise_floor"] is None and document["rms_heldout"] is None


def test_parameters_carry_their_unit_and_never_overwrite_each_other():
    values = (
        Value("lag", 1.5, 0.1, "ms"),
        Value("expansion", 11.0, None, "um/m/K"),
        Value("period", 6.35, 0.001, "mm"),
        Value("sensor", "temperature_nut", None, ""),
        Value("backlash_um", 3.0, None, "um"),
    )
    assert parameters_document(values) == {
        "lag_ms": 1.5,
        "lag_ms_error": 0.1,
        "expansion_um_per_m_k": 11.0,
        "period_mm": 6.35,
        "period_mm_error": 0.001,
        "sensor": "temperature_nut",
        "backlash_um": 3.0,
    }


def test_two_parameters_of_one_name_are_both_kept():
    flat = parameters_document((Value("period", 1.0, 0.1, "mm"), Value("period", 2.0, 0.2, "mm")))
    assert flat == {"period_mm": 1.0, "period_mm_error": 0.1, "period_2_mm": 2.0, "period_2_mm_error": 0.2}


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (12.3456, 0.0987, "12.346 ± 0.099 µm"),
        (0.0, 0.5, "0.00 ± 0.50 µm"),
        (-3.21, 1.0, "−3.2 ± 1.0 µm"),
        (1234.5, 99.6, "1230 ± 100 µm"),
        (123456.0, 1234.0, "123.5 ± 1.2 mm"),
    ],
)
def test_a_value_is_rounded_to_two_digits_of_its_error(value, error, text):
    assert value_text(Value("x", value, error, "um")) == text


def test_numbers_of_one_effect_in_one_unit_share_it_with_their_errors():
    values = (Value("nodes", 9.0, None, ""), Value("mean", 40.0, 9.0, "arcsec"),
              Value("largest", -7200.0, 36.0, "arcsec"), Value("sensor", "bed", None, ""))  # fmt: skip
    assert named_texts(values) == [
        ("nodes", "9"),
        ("mean", "0.0111 ± 0.0025 deg"),
        ("largest", "−2.000 ± 0.010 deg"),
        ("sensor", "bed"),
    ]


def test_a_comparison_has_the_contracts_keys(make_comparison):
    document = _strict(comparison_document(make_comparison()))
    assert set(document) >= {"rms", "rms_heldout", "noise_floor", "unit", "rows"}
    assert document["rms"] == pytest.approx(1.5) and document["unit"] == "um" and document["rows"] == 210
    assert document["where"][0] == {
        "quantity": "position",
        "unit": "mm",
        "share": 0.6,
        "worst": [
            {"low": 10.0, "high": 20.0, "direction": -1, "mean": pytest.approx(2.0), "rms": pytest.approx(2.5),
             "rows": 10}
        ],
    }  # fmt: skip
