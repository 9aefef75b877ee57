"""A grid of readings on its way through training: what other axes did, what is left, what is said."""

import re

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.errors import ArgumentError, FileFormatError
from rtec.predictors.fitting.training import Effort
from rtec.training import all_methods, compare_predictors
from rtec.training.parts import parts_of

NAMES = ("none", "table bi-directional linear", "squareness", "straightness", "angles", "network 40 lm")


def written(folder, name="grid.csv", *, head="# axis: 1\n", third="position_3_um", noise_um=0.2, seed=1, shift=0.0):
    """Write an axis that leans by 30 µm in a metre towards axis 2, and turns so that axis 3 is an arm."""
    rng = np.random.default_rng(seed)
    lines = [head + f"run,direction,target_mm,deviation_um,position_2_mm,{third}"]
    for run in (1, 2):
        for z in np.linspace(0.0, 80.0, 5) + shift:
            for y in np.linspace(-100.0, 200.0, 7) + shift:
                for way, along in ((1, 1), (-1, -1)):
                    for x in (np.linspace(0.0, 300.0, 9) + shift)[::along]:
                        error = (
                            2.0 * np.sin(x / 70.0) + 0.03 * y + 3.0 * (way < 0) + 0.04 * np.cos(x / 60.0) * (z - 40)
                        )
                        error += rng.normal(0.0, noise_um)
                        lines.append(f"{run},{way},{x:.9g},{error:.9g},{y:.9g},{1e3 * z:.9g}")
    file = folder / name
    file.write_text("\n".join(lines) + "\n")
    return file


def of(names):
    return [method for method in all_methods(several_axes=True) if method.name in names]


def test_places_of_other_axes_are_read_in_mm(tmp_path):
    data = load_dataset(written(tmp_path))
    assert data.axis == 1
    assert list(data.other_axes_mm) == [2, 3]
    assert data.other_axes_mm[3].max() == pytest.approx(80.0)
    assert any("positions of other axes" in note and "position_3_um" in note for note in data.notes)


def test_readings_at_other_places_of_another_axis_are_no_repeats(tmp_path):
    """Two runs over all places: each is visited twice, however often the axis itself passes a target."""
    data = load_dataset(written(tmp_path))
    assert np.unique(data.cell, return_counts=True)[1].tolist() == [2] * (9 * 7 * 5 * 2)


def test_each_geometry_explains_what_it_holds(tmp_path):
    data = load_dataset(written(tmp_path))
    check = load_dataset(written(tmp_path, "check.csv", seed=2, shift=-7.0))
    effort = Effort(starts=2, epochs=150)
    result = compare_predictors(data, check, methods=of(NAMES), effort=effort, budget_s=None)
    left = {row.name: 1e3 * row.rms_heldout_mm for row in result.rows}
    assert left["none"] > 4.0
    assert left["table bi-directional linear"] == pytest.approx(np.hypot(3.0, 0.8), rel=0.15)  # the lean, the turning
    assert left["squareness"] == pytest.approx(0.8, rel=0.15)  # 0.04 * rms(cos) * rms(z - 40)
    assert left["straightness"] == pytest.approx(0.8, rel=0.15)
    assert left["angles"] < 0.35
    assert left["network 40 lm"] < 0.35
    assert re.match(r"axis 2: squareness (29\.[5-9]|30\.[0-5])", result.named("squareness").notes[0])
    assert result.axis == 1
    assert 0.8 < result.named("angles").coverage <= 1.0


def test_without_other_axes_no_geometry_competes():
    assert not any(method.kind.value == "geometry" for method in all_methods())


def test_an_axis_that_stood_still_is_said_and_left_out(tmp_path):
    file = tmp_path / "still.csv"
    text = written(tmp_path).read_text().splitlines()
    file.write_text("\n".join([*text[:2], *(line.rpartition(",")[0] + ",5000" for line in text[2:])]))
    result = compare_predictors(load_dataset(file), methods=of(("squareness",)))
    assert result.notes[0] == "axis 3 stood still: its influence cannot be learnt"
    assert result.named("squareness").predictor.inputs == ("position", "direction", "position_2")


def test_a_file_that_judges_has_to_tell_the_same(tmp_path):
    data = load_dataset(written(tmp_path))
    other = load_dataset(written(tmp_path, "other.csv", third="humidity_percent"))
    with pytest.raises(ArgumentError, match="no column position_3_mm"):
        parts_of(data, other)


@pytest.mark.parametrize(
    ("head", "third", "says"),
    [
        ("# axis: 2\n", "position_3_mm", "position_2_mm is the position of the measured axis"),
        ("# axis: 16\n", "position_3_mm", "axis: 16"),
        ("", "position_2_inch", "position_2_inch is a second position"),
        ("", "position_3", "has no unit"),
    ],
)
def test_columns_that_contradict_give_one_error(tmp_path, head, third, says):
    with pytest.raises(FileFormatError, match=says):
        _ = load_dataset(written(tmp_path, head=head, third=third)).other_axes_mm


def test_a_letter_names_an_axis_but_no_number(tmp_path):
    assert load_dataset(written(tmp_path, head="# axis: z\n")).axis is None
