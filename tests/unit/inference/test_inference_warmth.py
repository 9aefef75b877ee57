"""Tables of models of heat: what is in them at a stated warmth, against formulas written out here."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.effects import Units, effect_named
from rtec.errors import ArgumentError
from rtec.inference.model import Model, Term
from rtec.inference.static_predictor import predictor_at_mean, predictor_of_file, predictor_of_model
from rtec.inference.warmth import Warmth, check_followed, mean_warmth

X = np.array([0.0, 40.0, 100.0])


def term(name, amplitudes, **shape):
    effect = effect_named(name)
    return Term(effect=effect, shape=effect.shape_type(**shape), amplitudes=tuple(amplitudes))


def model(*terms):
    return Model(observe="deviation", units=Units("mm", "mm", "s"), terms=terms, datum=0.001)


GROWTH = term("thermal_growth", [12e-6], sensor="temperature_screw", lag=600.0)
SHIFT = term("thermal_shift", [0.004], sensor="temperature_bed")
WARM_UP = term("warm_up", [0.010], time_constant=1200.0)
SPINDLE = term("thermal_shift", [0.002], sensor="spindle", lag=900.0)


def errors(parts, warmth, way=1):
    return predictor_of_model(parts, 0.0, 100.0, warmth)[0].error_mm(X, way)


def test_growth_and_shift_stand_at_their_temperatures():
    heats = Warmth(temperatures_degc={"temperature_screw": 26.0, "temperature_bed": 21.5})
    found = errors(model(GROWTH, SHIFT, term("backlash", [0.02])), heats, -1)
    assert found == pytest.approx(0.001 + 12e-6 * 6.0 * X + 0.004 * 1.5 - 0.01, abs=1e-12)


def test_a_warm_up_stands_at_its_time():
    found = errors(model(WARM_UP), Warmth(since_on_s=1200.0))
    assert found == pytest.approx(0.001 + 0.01 * (1 - np.exp(-1)), abs=1e-12)


@pytest.mark.parametrize(("since_s", "share"), [(None, 1.0), (900.0, 1 - np.exp(-1)), (0.0, 0.0)])
def test_a_spindle_has_run_up_from_rest_since_then(since_s, share):
    found = errors(model(SPINDLE), Warmth(spindle_rpm=3000.0, since_on_s=since_s))
    assert found == pytest.approx(0.001 + 0.002 * 3.0 ** (5 / 3) * share, abs=1e-12)


@pytest.mark.parametrize(
    ("one", "warmth", "says"),
    [
        (GROWTH, None, "--temperature is missing; give screw=22degC: thermal_growth"),
        (SHIFT, Warmth(temperatures_degc={"temperature_screw": 20.0}), "give bed=22degC"),
        (WARM_UP, Warmth(temperatures_degc={}), "--at is missing"),
        (SPINDLE, Warmth(since_on_s=60.0), "--spindle is missing"),
    ],
)
def test_no_table_is_made_where_the_warmth_is_not_known(one, warmth, says):
    with pytest.raises(ArgumentError, match=says):
        predictor_of_model(model(one), 0.0, 100.0, warmth)


def test_a_temperature_that_nothing_follows_is_refused():
    check_followed(Warmth(temperatures_degc={"temperature_bed": 20.0}), ["temperature_bed", "time"])
    with pytest.raises(ArgumentError, match="bad is not valid; use what the model follows: bed; did you mean 'bed'"):
        check_followed(Warmth(temperatures_degc={"temperature_bad": 20.0}), ["temperature_bed", "time"])


def test_a_file_for_a_machine_that_corrects_says_what_to_do(tmp_path):
    (tmp_path / "m.toml").write_text(
        'observe = "deviation"\n[[effect]]\nname = "thermal_shift"\nsensor = "temperature_bed"\nshift = "4 um/K"\n'
    )
    says = r"thermal_shift, which follows the heat of the machine.*rtec export m\.toml --csv"
    with pytest.raises(ArgumentError, match=says):
        predictor_of_file(tmp_path / "m.toml", 0.0, 100.0)


def test_at_the_mean_of_the_readings_and_what_that_leaves(tmp_path):
    # one place after another, while the bed warms up from 20 to 24 degC
    heats = np.linspace(20.0, 24.0, 41)
    columns = np.column_stack([np.resize(X, 41), heats, 4.0 * (heats - 20.0)])
    head = "target_mm,temperature_bed_degc,deviation_um"
    np.savetxt(tmp_path / "d.csv", columns, delimiter=",", header=head, comments="")
    data = load_dataset(tmp_path / "d.csv")
    parts = model(SHIFT, term("backlash", [0.0]))
    assert mean_warmth(parts, data).temperatures_degc == {"temperature_bed": pytest.approx(22.0)}
    table, left_out = predictor_at_mean(parts, 0.0, 100.0, data)
    assert table.error_mm(X, 1) == pytest.approx(0.001 + 0.008, abs=1e-12)
    assert [one.effect for one in left_out] == ["thermal_shift"]
    assert f"changes by {4.0 * np.std(heats):.3g} µm RMS" in left_out[0].why


def test_a_warmth_is_said_in_words_and_refused_where_it_cannot_be():
    assert str(Warmth(temperatures_degc={"temperature": 22.5}, spindle_rpm=3000.0)) == (
        "temperature at 22.5 degC, spindle at 3000 rpm"
    )
    for wrong in (SimpleNamespace(since_on_s=-1.0), SimpleNamespace(temperatures_degc={"temperature": -300.0})):
        with pytest.raises(ArgumentError):
            Warmth(**vars(wrong))
