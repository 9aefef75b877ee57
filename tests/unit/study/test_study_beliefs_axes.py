"""What a study and a table for another program say of a predictor that looks at other axes."""

import pytest

from rtec.cli import main
from rtec.errors import ArgumentError
from rtec.predictors import AxisTables, KnownPredictor, write_predictor
from rtec.predictors.axis_tables import AxisTable
from rtec.study.definition import read_study


@pytest.fixture
def file(tmp_path):
    tables = tuple(
        AxisTable(of=of, positions_mm=[0.0, 1100.0], values=[0.0, 0.01]) for of in ("position", "position_2")
    )
    predictor = AxisTables(tables=tables, range_mm=(0.0, 1100.0))
    write_predictor(tmp_path / "p.toml", KnownPredictor(predictor=predictor, name="squareness", axis=1))
    return tmp_path / "p.toml"


def test_a_study_has_one_axis(file, tmp_path):
    study = tmp_path / "s.toml"
    study.write_text('[predictor]\nmodel = "p.toml"\n')
    with pytest.raises(ArgumentError, match=r"s\.toml: predictor\.model: .*position_2.*a study has one axis"):
        read_study(study)


@pytest.mark.parametrize("name", ["csv", "linuxcnc", "c"])
def test_only_c_holds_the_places_of_other_axes(file, tmp_path, name, capsys):
    out = tmp_path / {"csv": "t.csv", "linuxcnc": "t.comp", "c": "t.c"}[name]
    assert main(["export", str(file), f"--{name}", str(out)]) == (0 if name == "c" else 2)
    assert out.exists() == (name == "c")
    if name != "c":
        assert "--c holds a predictor of several axes" in capsys.readouterr().err
