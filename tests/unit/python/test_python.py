"""``import rtec``: what it loads, what it reads, and what results show."""

import subprocess
import sys

import numpy as np
import pytest

import rtec
from rtec.errors import RtecError

X = np.tile(np.concatenate([np.arange(0.0, 400.0, 20.0), np.arange(380.0, -1.0, -20.0)]), 5)
WAY = np.tile(np.repeat([1, -1], 20), 5)
RUN = np.repeat(np.arange(1, 6), 40)
ERROR = -2.0 * WAY + 0.015 * X + np.random.default_rng(1).normal(0.0, 0.5, 200)
COLUMNS = {"run": RUN, "direction": WAY, "target_mm": X, "deviation_um": ERROR}


class Frame:
    """What a data frame of any library has: columns, and a column by its name."""

    def __init__(self, columns, index=None):
        self.columns, self._values, self.index = list(columns), columns, index

    def __getitem__(self, name):
        return self._values[name]


@pytest.fixture(scope="module")
def found():
    return rtec.diagnose(COLUMNS)


def test_import_loads_nothing():
    heavy = ("numpy", "numba", "scipy", "matplotlib", "typer")
    code = f"import sys, rtec; sys.exit(any(module in sys.modules for module in {heavy}))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    assert set(rtec.__all__) <= set(dir(rtec))
    assert not hasattr(rtec, "no_such_thing")


def test_a_path_a_mapping_and_a_frame_are_read_alike(tmp_path):
    file = tmp_path / "z.csv"
    lines = [
        ",".join(COLUMNS),
        *(f"{r},{w},{x},{y!r}" for r, w, x, y in zip(RUN, WAY, X, ERROR.tolist(), strict=True)),
    ]
    file.write_text("\n".join(lines))
    for source in (file, str(file), COLUMNS, Frame(COLUMNS)):
        data = rtec.read(source)
        assert len(data) == 200
        assert data["deviation"] == pytest.approx(ERROR / 1000)
        assert "z.csv" in repr(data) or "data" in repr(data)
        assert "deviation_mm" in data._repr_html_()


def test_words_dates_and_gaps_in_a_frame():
    ways = np.where(WAY > 0, "forward", "backward")
    gaps = ERROR.copy()
    gaps[7] = np.nan
    when = np.datetime64("2026-03-01T08:00:00") + np.arange(200) * np.timedelta64(10, "s")
    data = rtec.read(COLUMNS | {"direction": ways, "deviation_um": gaps, "time": when})
    assert len(data) == 199
    assert data["direction"][:3].tolist() == [1.0, 1.0, 1.0]
    assert data["time"][-1] == pytest.approx(1990.0)
    assert "1 of 200 rows are left out" in " ".join(data.measurement.notes)


@pytest.mark.parametrize(
    ("source", "says"),
    [
        (3, "a path, a data frame, or a mapping"),
        ({}, "0 columns"),
        ({"target_mm": [0.0, 1.0], "deviation_um": [0.0]}, "rows of columns: target_mm: 2, deviation_um: 1"),
        ({"target_mm": [[0.0], [1.0]]}, "of shape"),
        ({"target_mm": [], "deviation_um": []}, "with rows"),
        ({"target_mm ": [0.0, 1, 2], "target_mm": [0.0, 1, 2]}, "twice"),
        ({"target_mm": [0.0, 1.0, np.inf], "deviation_um": [0.0, 1.0, 2.0]}, "inf"),
        ("no_such_file.csv", "no such file"),
    ],
)
def test_what_is_no_measurement(source, says):
    with pytest.raises(RtecError, match=says):
        rtec.read(source)


def test_a_frame_with_one_name_twice():
    frame = Frame({"target_mm": X, "deviation_um": ERROR})
    frame.columns.append("target_mm")
    with pytest.raises(RtecError, match="twice"):
        rtec.read(frame)


def test_options_of_read():
    plain = {"nominal": X, "error": ERROR, "run": RUN, "direction": WAY}
    data = rtec.read(plain, columns={"nominal": "target_mm", "error": "deviation_um"}, screw_pitch="5 mm")
    assert data.dataset().conditions.screw_pitch == 5.0
    with pytest.raises(RtecError, match="screw_pitch"):
        rtec.read(plain, screw_pich="5 mm")
    with pytest.raises(RtecError, match="with its unit"):
        rtec.read(plain, screw_pitch=5)


def test_a_diagnosis_in_a_notebook(found):
    assert (found.verdict, set(found.effects)) == ("NAMED", {"backlash", "scale"})
    assert found.unit == "um"
    assert found.residual == pytest.approx(ERROR - found.columns["model_um"], abs=1e-9)
    assert found["final"]["scale"]["scale"][0] == pytest.approx(15.0, abs=1.5)
    assert found.to_dict()["verdict"] == "NAMED"
    assert len(repr(found)) < 300
    page = found._repr_html_()
    assert "<svg" in page
    assert "<td>backlash</td>" in page
    for kind in ("staircase", "measured", "residual"):
        assert found.plot(kind).axes
    with pytest.raises(RtecError, match="plot"):
        found.plot("colours")
    with pytest.raises(RtecError, match="key"):
        found["colour"]


def test_a_model_is_made_written_read_and_asked(found, tmp_path):
    file = tmp_path / "m.toml"
    found.model.save(file)
    again = rtec.Model.read(file)
    assert again.parameters["scale"]["scale"][0] == found.model.parameters["scale"]["scale"][0]
    assert again.predict(COLUMNS) == pytest.approx(found.columns["model_um"], abs=1e-9)
    assert rtec.compare(COLUMNS, file).rms == pytest.approx(found.rms_after, rel=1e-4)
    made = rtec.Model({"backlash": {"backlash": "-4 um"}, "scale": {}})
    assert made.effects == ("backlash", "scale")
    assert rtec.compare(COLUMNS, made).rms < 0.6
    with pytest.raises(RtecError, match="not an effect"):
        rtec.Model(["backlsh"])
    with pytest.raises(RtecError, match="without numbers"):
        made.predict(COLUMNS)
    with pytest.raises(RtecError, match="no numbers"):
        made.save(tmp_path / "n.toml")


def test_one_effect_more(found):
    one = rtec.add("backlash", COLUMNS)
    two = rtec.add("scale", COLUMNS, one.model)
    assert two.rms_after == pytest.approx(found.rms_after, rel=1e-3)
    with pytest.raises(RtecError, match="no parameter of scale"):
        rtec.add("scale", COLUMNS, period="3 mm")


def test_an_own_effect_in_a_model_file_has_to_be_given(tmp_path):
    lean = rtec.effect(lambda position: position**2 / 1e4, name="lean")
    result = rtec.add(lean, COLUMNS)
    result.model.save(tmp_path / "m.toml")
    assert rtec.compare(COLUMNS, tmp_path / "m.toml", effects=[lean]).model.effects == ("lean",)
    with pytest.raises(RtecError, match="no effect 'lean'"):
        rtec.compare(COLUMNS, tmp_path / "m.toml")


def test_an_own_effect_that_equals_one_of_the_library_is_tied_with_it():
    lean = rtec.effect(lambda position: position, name="lean")
    result = rtec.diagnose(COLUMNS, effects=[lean])
    assert result.verdict == "TIED"
    assert {"scale", "lean"} <= {name for c in result["candidates"] for name in (c["effect"], *c["tied_with"])}


def test_the_next_hour(found, tmp_path):
    planned = found.next("30 min", tmp_path / "plan.toml")
    assert planned["duration_s"] <= 1800.0
    assert {file.suffix for file in tmp_path.iterdir()} == {".toml", ".csv", ".nc"}
    with pytest.raises(RtecError, match="no plan: one run"):
        found.next("60 s")


def test_heldout_and_lock_judge_one_at_a_time():
    with pytest.raises(RtecError, match="one of lock and heldout"):
        rtec.diagnose(COLUMNS, heldout=COLUMNS, lock=True)
    assert rtec.diagnose(COLUMNS, lock=True)["heldout_rows"] == 40


def test_training_on_the_log_of_a_warm_machine():
    time_min = np.arange(240.0)
    speed = np.repeat([0.0, 2000.0, 0.0, 4000.0], 60)
    nose = 20.0 + np.convolve(speed / 400.0, np.exp(-time_min / 30.0) / 30.0)[:240]
    log = {"time_min": time_min, "spindle_rpm": speed, "temperature_nose_degc": nose, "axial_um": 3.0 * (nose - 20.0)}
    found = rtec.train(log, budget="20 s").to_dict()
    rows = {row["name"]: row for row in found["rows"]}
    assert rows[found["chosen"]]["rms_heldout_um"] < 0.05 * rows["mean"]["rms_heldout_um"]
    assert found["heldout_by"].startswith("the last blocks (4000 rpm)")
    with pytest.raises(rtec.errors.ArgumentError, match="blocks"):
        rtec.train({"target_mm": [0.0, 1.0, 2.0], "deviation_um": [0.0, 1.0, 2.0]}, blocks="run")


def test_the_open_path():
    result = rtec.simulate("a", "100kHz", corrections=-3, cycles=100)
    assert result["controller_counts"] - result["encoder_counts"] == -12
    with pytest.raises(RtecError, match="8051 or fast"):
        rtec.simulate("a", "100kHz", corrections=3, cycles=100, timing="slow")
    with pytest.raises(RtecError, match="unit"):
        rtec.simulate("a", "100", corrections=3, cycles=100)
