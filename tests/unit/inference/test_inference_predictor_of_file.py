"""A model in a file as a predictor: where it was measured it says its error, and beyond that it holds."""

import pytest

from rtec.errors import ArgumentError
from rtec.inference.static_predictor import predictor_of_file
from rtec.study.definition import read_study

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
