"""A study of a machine that warms: what its file says, and what the corrected axis does over a short shift."""

import numpy as np
import pytest

from rtec.errors import ArgumentError, RtecError
from rtec.heat.duty import Duty, Piece
from rtec.jobs import Workers
from rtec.predictors import BidirectionalTable, KnownPredictor, NoError, write_predictor
from rtec.report.appearance import scale_of
from rtec.report.figures_shift import shift_figure
from rtec.report.shift import shift_csv, shift_document
from rtec.requester.settings import Outside
from rtec.study import builtin_study, builtin_text, read_study
from rtec.study.run import machine_of
from rtec.study.shift import course_of, run_shift, warm_axis

TEXT = """
name = "short"
unit = "um"
[program]
start = "30 mm"
end = "230 mm"
increment = "50 mm"
overshoot = "2 mm"
dwell = "3 s"
runs = 1
[laser]
dwell = "2 s"
repeatability = "0 um"
[predictor]
model = "axis"
"""
HEAT = """
[heat]
duty = ["40 min at 6000 rpm, feed 20 mm/s", "30 min at 0 rpm"]
training = [
    "60 min at 2000 rpm, feed 15 mm/s", "40 min at 0 rpm", "80 min at 6000 rpm, feed 25 mm/s", "80 min at 0 rpm",
    "80 min at 5000 rpm, feed 20 mm/s",
]
every = "15 min"
increment = "100 mm"
"""


def study_of(tmp_path, heat=HEAT, text=TEXT):
    file = tmp_path / "short.toml"
    file.write_text(text + heat, encoding="utf-8")
    return read_study(file)


def shift_of(study):
    with Workers(None, total=1.0) as workers:
        return run_shift(study, study.heat, machine_of(study), workers)


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    study = study_of(
        tmp_path_factory.mktemp("shift"), HEAT + "speed = true\n", TEXT + '[handshake]\noutside = "keep"\n'
    )
    return study, shift_of(study)


def test_the_built_in_studies_are_a_cold_machine_and_a_warm_one(tmp_path):
    assert builtin_study().heat is None
    warm = builtin_study("warm")
    assert warm.heat.axis == "z"
    assert warm.handshake.outside is Outside.KEEP
    (tmp_path / "copy.toml").write_text(builtin_text("warm"), encoding="utf-8")
    assert read_study(tmp_path / "copy.toml").heat.duty == warm.heat.duty


def test_pieces_of_a_duty_are_written_as_people_say_them(tmp_path):
    heat = study_of(tmp_path).heat
    assert heat.duty.pieces == (
        Piece(duration_s=2400.0, spindle_rpm=6000.0, feed_mm_s=20.0),
        Piece(duration_s=1800.0),
    )
    named = study_of(tmp_path, '[heat]\nduty = "shop"\ntraining = "paper"\nseed = 4\n').heat
    assert named.duty == Duty.shop(4, hours=8.0)
    assert named.training.duration_s == 4.5 * 3600.0


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ('duty = ["2 h"]', "a time and a speed"),
        ('duty = ["2 h at 1e9 rpm"]', "100000 rpm"),
        ('duty = ["2 m at 100 rpm"]', "time"),
        ("duty = []", "one piece or more"),
        ('duty = "papre"', "did you mean 'paper'"),
        ('duty = ["900 h at 100 rpm"]', "at most 200 h"),
        ('axis = "w"', "axis"),
        ('every = "0 s"', "1 s to 200 h"),
        ('increment = "900 mm"', "up to the travel"),
        ('fit = "lag"', "first-order lags"),
        ('thermometers = ["screw_nit"]', "did you mean 'screw_nut'"),
        ('thermometer = ["screw_nut"]', "did you mean 'thermometers'"),
        ('design = "q"', "design"),
        ('model = "none.toml"', "none.toml"),
    ],
)
def test_what_cannot_be_is_said_with_its_key(tmp_path, line, says):
    with pytest.raises(RtecError, match=says) as error:
        study_of(tmp_path, f"[heat]\n{line}\n")
    assert "short.toml" in str(error.value) or "none.toml" in str(error.value)


def test_the_predictor_may_come_from_files(tmp_path):
    fitted = study_of(tmp_path)
    course = course_of(fitted.heat, fitted.heat.duty)
    cold = BidirectionalTable.sampled_from(NoError(), [30.0, 230.0])
    axis = warm_axis(fitted, fitted.heat, cold, course)
    assert len(axis.heat) == 2
    for name, model in zip(("start", "end"), axis.heat, strict=True):
        write_predictor(tmp_path / f"{name}.toml", KnownPredictor(predictor=model, name=name))
    read = study_of(tmp_path, HEAT + 'model = ["start.toml", "end.toml"]\n')
    again = warm_axis(read, read.heat, cold, course)
    assert again.numbers == pytest.approx(axis.numbers, rel=1e-12)
    assert (again.at_mm, set(again.ranges)) == (axis.at_mm, set(axis.ranges))
    for name, ends in axis.ranges.items():
        assert again.ranges[name] == pytest.approx(ends)
    one = study_of(tmp_path, HEAT + 'model = "start.toml"\n')
    assert warm_axis(one, one.heat, cold, course).at_mm == ()
    with pytest.raises(ArgumentError, match="says itself what it sees"):
        study_of(tmp_path, HEAT + 'model = "start.toml"\nspeed = true\n')


def test_a_shift_too_short_for_a_calibration_is_refused(tmp_path):
    study = study_of(tmp_path, '[heat]\nduty = ["20 s at 4000 rpm"]\n')
    with pytest.raises(ArgumentError, match="which a calibration takes"):
        shift_of(study)
    study = study_of(tmp_path, '[heat]\nevery = "20 s"\n')
    with pytest.raises(ArgumentError, match="which a run takes"):
        shift_of(study)


def test_what_grows_counts_from_a_machine_that_stands(short):
    study, _ = short
    course = course_of(study.heat, study.heat.duty)
    assert course.growth_mm(0.0, 30.0) == course.growth_mm(0.0, 230.0) == 0.0
    # at 6000 rpm the balls of its bearings displace the spindle by some 0.4 um for each (1000 rpm)^2, at once
    assert 0.005 < abs(course.growth_mm(2.0, 30.0)) < 0.030


def test_uncorrected_the_axis_shows_its_error_and_what_has_grown(short):
    study, shift = short
    row = shift.rows[0]
    assert row.deviation_mm.shape == (5, 6)  # every 15 min of 70, at 3 targets in both directions
    course = course_of(study.heat, study.heat.duty)
    targets = [30.0, 130.0, 230.0, 230.0, 130.0, 30.0]
    error = study.axis_error.error_mm(targets, [1, 1, 1, -1, -1, -1])
    for k, time_s in enumerate(row.time_s):
        grown = np.array([course.growth_mm(float(time_s), at_mm) for at_mm in targets])
        assert row.deviation_mm[k] - error == pytest.approx(grown, abs=6e-3)  # it grows during a calibration, too
    middle = row.deviation_mm[3] - error
    grown = [course.growth_mm(float(row.time_s[3]), at_mm) for at_mm in targets]
    assert middle == pytest.approx(grown, abs=2e-3)


def test_the_predictor_of_temperatures_leaves_less_than_the_cold_table(short):
    _, shift = short
    rows = {row.name: row for row in shift.rows}
    assert list(rows) == ["uncompensated", "cold", "warm", "speed"]
    assert shift.good
    assert rows["warm"].rms_mm < 0.5 * rows["cold"].rms_mm
    assert rows["speed"].rms_mm < 0.5 * rows["cold"].rms_mm
    assert rows["cold"].rms_mm > 0.015


def test_beyond_its_temperatures_the_row_says_so(tmp_path):
    heat = HEAT.replace('"80 min at 6000 rpm, feed 25 mm/s"', '"80 min at 3000 rpm"').replace(
        '"80 min at 5000 rpm, feed 20 mm/s"', '"80 min at 1000 rpm"'
    )
    held = shift_of(study_of(tmp_path, heat))
    row = held.rows[-1]
    assert not held.good
    assert np.isnan(row.deviation_mm[-1]).all()
    assert row.run.outside_input.startswith("temperature_")
    assert row.reason == (
        f"held after {row.run.simulated_s / 60.0:.0f} min: {row.run.outside_input} is outside what the predictor was "
        "trained for"
    )
    document = shift_document(held)
    assert document[-1]["outside_input"] == row.run.outside_input
    assert len(document[-1]["calibrations"]) == 5
    keys = {"name", "rms_um", "worst_um", "calibrations", "outside_s", "outside_input", "audit", "reason"}
    assert set(document[0]) == keys
    assert set(document[0]["calibrations"][0]) == {"time_s", "mean_um", "rms_um"}


def test_figure_and_file_show_every_calibration(short):
    study, shift = short
    lines = shift_csv(shift, scale_of("um")).splitlines()
    assert lines[0] == "name,time_s,mean_um,least_um,largest_um,rms_um"
    assert len(lines) == 1 + 4 * 5
    cells = dict(zip(lines[0].split(","), lines[1].split(","), strict=True))
    assert float(cells["mean_um"]) == pytest.approx(1000.0 * shift.rows[0].deviation_mm[0].mean())

    class Result:
        pass

    result = Result()
    result.shift, result.study = shift, study
    figure = shift_figure(result, scale_of("um"))
    above, below = figure.axes
    assert [line.get_label().split(":")[0] for line in above.get_lines()[:4]] == [row.title for row in shift.rows]
    assert len(below.get_lines()) == 6
