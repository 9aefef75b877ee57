"""Predictors made of models, against formulas written out here."""

import numpy as np
import pytest

from rtec.effects import Shape, Units, effect_named
from rtec.errors import ArgumentError
from rtec.inference.model import Model, Term
from rtec.inference.static_predictor import (
    FEWEST_POINTS,
    MOST_POINTS,
    predictor_of_file,
    predictor_of_model,
    static_part,
)
from rtec.study.definition import read_study

UNITS = Units("mm", "mm", "s")


def term(name, amplitudes, **shape):
    effect = effect_named(name)
    return Term(effect=effect, shape=effect.shape_type(**shape), amplitudes=tuple(amplitudes))


def model(*terms, datum=0.0, units=UNITS, observe="deviation"):
    return Model(observe=observe, units=units, terms=terms, datum=datum)


def test_every_effect_of_position_and_direction_is_in_it():
    # two harmonics that differ by direction, a line, a backlash and a datum
    cyclic = term(
        "cyclic", [0.010, 0.0, 0.0, 0.004, 0.002, 0.0, 0.0, 0.0], period=6.35, harmonics=2, by_direction=True
    )
    parts = model(term("scale", [2e-5]), term("backlash", [-0.08]), cyclic, datum=0.05)
    table, left_out = predictor_of_model(parts, 25.4, 1016.0)
    assert left_out == ()
    at = np.random.default_rng(5).uniform(25.4, 1016.0, 2000)
    for way in (1, -1):
        turn = 2 * np.pi * at / 6.35
        truth = 0.05 - 0.04 * way + (0.010 + 0.002 * way) * np.sin(turn) + 0.004 * np.cos(2 * turn)
        slope = static_part(model(term("scale", [2e-5])), at, way)[0]
        assert table.error_mm(at, way) == pytest.approx(truth + slope, abs=3e-5)  # 0.2 % of the wave
        assert slope[0] - slope[1] == pytest.approx(2e-5 * (at[0] - at[1]), abs=1e-12)


def test_beyond_its_range_the_ends_are_held():
    table, _ = predictor_of_model(model(term("scale", [1e-4])), 100.0, 200.0)
    assert table.range_mm == (100.0, 200.0)
    assert table.error_mm([0.0, 300.0], 1) == pytest.approx(table.error_mm([100.0, 200.0], 1), abs=1e-15)


@pytest.mark.parametrize(
    ("one", "why"),
    [
        (term("drift", [1.0]), "changes with time"),
        (term("servo_lag", [1.0]), "velocity"),
        (term("acceleration_lag", [1.0]), "acceleration"),
    ],
)
def test_what_depends_on_more_is_left_out_and_said(one, why):
    table, left_out = predictor_of_model(model(one, term("backlash", [0.02])), 0.0, 100.0)
    assert [left.effect for left in left_out] == [one.name]
    assert why in left_out[0].why
    assert table.error_mm([50.0, 50.0], [1, -1]).tolist() == [0.01, -0.01]


def test_a_windup_counts_as_built_up():
    table, left_out = predictor_of_model(model(term("windup", [0.02], distance=30.0)), 0.0, 100.0)
    assert left_out == ()
    assert table.error_mm([5.0, 5.0], [1, -1]).tolist() == [0.01, -0.01]


def test_waves_that_the_grid_cannot_follow_are_left_out():
    fine = term("interpolation", [1e-3, 0.0], period=0.02, harmonics=1)
    table, left_out = predictor_of_model(model(fine), 0.0, 1000.0)
    assert [(left.effect, "0.02 mm" in left.why) for left in left_out] == [("interpolation", True)]
    assert not table.error_mm(np.linspace(0, 1000, 50), 1).any()
    short, nothing = predictor_of_model(model(fine), 0.0, 1.0)
    assert nothing == ()
    assert short.error_mm(0.005, 1) == pytest.approx(1e-3, rel=0.01)


def test_the_grid_is_as_fine_as_the_shortest_wave_asks_and_no_finer():
    sizes = {}
    for period in (1000.0, 6.35, 0.2):
        wave = term("cyclic", [1e-3, 0.0], period=period, harmonics=1)
        sizes[period] = predictor_of_model(model(wave), 0.0, 1000.0)[0].forward_positions_mm.size - 1
    assert sizes == {1000.0: FEWEST_POINTS, 6.35: round(50_000 / 6.35), 0.2: MOST_POINTS}


def test_an_empty_model_is_its_datum():
    table, left_out = predictor_of_model(model(datum=0.007), 0.0, 10.0)
    assert (table.error_mm([0.0, 10.0], [1, -1]).tolist(), left_out) == ([0.007, 0.007], ())


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (model(Term(effect=effect_named("backlash"), shape=Shape())), "backlash without numbers"),
        (model(observe="force", units=Units("n", "mm", "s")), "force in n"),
        (model(units=Units("deg", "deg", "s")), "deviation in deg over positions in deg"),
        (model(units=Units("mm", "s", "s")), "over time"),
    ],
)
def test_models_that_predict_no_deviation_of_a_linear_axis_are_refused(bad, said):
    with pytest.raises(ArgumentError, match=said):
        predictor_of_model(bad, 0.0, 10.0)


# a model in a file: where it was measured it says its error, and beyond that it holds

SLOPE = 'observe = "deviation"\n{}[[effect]]\nname = "scale"\nscale = "100 ppm"\n'
MEASURED = 'range = ["10 mm", "300 mm"]\n'


def slope(folder, head=MEASURED):
    file = folder / "m.toml"
    file.write_text(SLOPE.format(head))
    return file


@pytest.mark.parametrize(
    ("asked", "known"),
    [((50.0, 200.0), (50.0, 200.0)), ((0.0, 500.0), (10.0, 300.0)), ((400.0, 500.0), (10.0, 300.0))],
)
def test_a_model_is_known_where_it_was_measured(tmp_path, asked, known):
    predictor, _ = predictor_of_file(slope(tmp_path), *asked)
    assert predictor.range_mm == known
    inside = predictor.error_mm(known[1] - 1.0, +1)
    assert predictor.error_mm(known[1] + 900.0, +1) - inside == pytest.approx(1e-4)  # one mm more, not 901


def test_a_model_that_does_not_say_where_it_was_measured_is_known_wherever_it_is_asked(tmp_path):
    predictor, _ = predictor_of_file(slope(tmp_path, head=""), 0.0, 500.0)
    assert predictor.range_mm == (0.0, 500.0)


def test_a_study_beyond_the_measurement_of_its_model_is_refused(tmp_path):
    slope(tmp_path)
    (tmp_path / "s.toml").write_text(
        '[program]\nstart = "30 mm"\nend = "400 mm"\nincrement = "10 mm"\n[predictor]\nmodel = "m.toml"\n'
    )
    with pytest.raises(
        ArgumentError, match=r"program\.end: 400 mm is outside the range of the predictor; use 30 to 300 mm"
    ):
        read_study(tmp_path / "s.toml")
