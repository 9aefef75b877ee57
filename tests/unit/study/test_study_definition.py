"""A study's file: what is left out, what is refused, and how that is said."""

from dataclasses import replace

import numpy as np
import pytest

from rtec.axis import ProfileShape
from rtec.errors import FileFormatError, RtecError
from rtec.injector import Design
from rtec.predictors import BidirectionalTable, LatheNetwork
from rtec.study import builtin_study, builtin_text, read_study


def written(folder, text):
    path = folder / "mine.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def unnamed(study):
    """Return a study as if it came from no file."""
    return replace(study, file="")


def refusal(folder, text):
    """Return the one line in which a study is refused."""
    path = written(folder, text)
    with pytest.raises(RtecError) as caught:
        read_study(path)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 500 + len(str(path))
    assert str(path) in message
    return message.replace(str(path), "FILE")


def test_the_builtin_text_reads_back_to_the_builtin_study(tmp_path):
    assert unnamed(read_study(written(tmp_path, builtin_text()))) == builtin_study()


def test_keys_left_out_have_the_builtin_values(tmp_path):
    builtin = builtin_study()
    assert unnamed(read_study(written(tmp_path, ""))) == builtin
    study = read_study(written(tmp_path, '[program]\nruns = 2\n[box]\ndesigns = ["b"]\n'))
    assert unnamed(study) == replace(builtin, plan=replace(builtin.plan, runs=2), designs=(Design.B,))


# every value in a study, and what is said where it is wrong
REFUSED = [
    ('nmae = "x"', ["unknown key 'nmae'", "did you mean 'name'?"]),
    ("[axsi]\na = 1", ["unknown key 'axsi'", "did you mean 'axis'?"]),
    ('[axis]\naceleration = "1 m/s^2"', ["unknown key 'axis.aceleration'", "did you mean 'acceleration'?"]),
    ('[program]\nfeeds = "1 mm/s"', ["unknown key 'program.feeds'", "did you mean 'feed'?"]),
    ('name = "a/b"', ["FILE: name", "a/b"]),
    ('unit = "ft"', ["FILE: unit", "um, mm, inch"]),
    ("axis = 5", ["axis = 5", "[axis]"]),
    ('[[axis]]\nerror = "lathe"', ["a table [axis]"]),
    ("[axis]\nacceleration = 500", ["axis.acceleration", "500", "unit", "mm/s^2"]),
    ('[axis]\nacceleration = "500"', ["axis.acceleration", "500", "write the unit"]),
    ('[axis]\nerror = "lahte"', ["axis.error", "lathe", ".csv"]),
    ("[encoder]\nhome_state = true", ["encoder.home_state", "True"]),
    ('[encoder]\nphase_error = "90 deg"', ["encoder.phase_error", "-89 to 89"]),
    ('[encoder]\nphase_error = "60 deg"\nduty_error_a = "40 %"', ["encoder.phase_error", "apart"]),
    ("[conversation]\nwindow = 3", ["unknown key 'conversation'", "one of name, ", "handshake"]),
    ('[axis]\nacceleration = "-1 m/s^2"', ["axis.acceleration: -1 m/s^2 is too small", "to 1000 m/s^2"]),
    ('[axis]\ncyclic_period = "-1 mm"', ["axis.cyclic_period"]),
    ('[controller]\ntable_interval = "0 mm"', ["controller.table_interval"]),
    ('[figures]\nfeeds = ["1e5 mm/s"]', ["figures.feeds"]),
    ('[calibration]\nincrement = "0 inch"', ["calibration.increment", "above zero"]),
    ('[figures]\nspan = "0 mm"', ["figures.span"]),
    ('[servo]\nperiod = "2 ms"', ["servo.period: 2 ms is too large", "to 1 ms"]),
    ('[program]\nstart = "50 inch"', ["program.start", "below the end"]),
    (
        '[program]\nstart = "0.5 inch"\nincrement = "0.5 inch"',
        ["program.start", "outside the range of", "25.4 to 1016 mm"],
    ),
    ('[program]\nincrement = "0.51 inch"', ["program.increment", "a whole part of the travel"]),
    ("[program]\nruns = 0", ["program.runs", "1 to 99"]),
    ('[program]\nfeed = "51 inch/min"', ["program.feed", "0.1 to 50"]),
    ('[axis]\nmax_speed = "20 mm/s"', ["program.feed", "faster than axis.max_speed", "at most 20 mm/s"]),
    ('[laser]\ndwell = "6 s"', ["laser.dwell: 6 s is not less than program.dwell", "less than 6 s"]),
    ('[controller]\nfilter_clock = "33333337 Hz"', ["controller.filter_clock", "round it"]),
    ('[controller]\npolicy = "gess"', ["controller.policy", "did you mean 'guess'?"]),
    ('[box]\ndesigns = ["orginal"]', ["box.designs", "did you mean 'original'?"]),
    ('[box]\ndesigns = ["a", "b", "a"]', ["box.designs", "each design once"]),
    ("[box]\nprocessor = 8051", ["box.processor", "8051", "fast"]),
    ("[handshake]\nwindow = 0", ["handshake.window"]),
    ('[handshake]\ndata_valid_low = "1 ms"', ["handshake.data_valid_low"]),
    ('[controller]\nfilter_clock = "50.0000005 MHz"', ["controller.filter_clock", "whole number of hertz"]),
    ('[predictor]\nmodel = "learnd"', ["predictor.model", "did you mean 'learned'?"]),
    ('[calibration]\nincrement = "0.001 inch"', ["calibration.increment", "makes 312008", "at most 50000 readings"]),
    ('[calibration]\ndwell = "3 s"', ["laser.dwell", "not less than calibration.dwell", "less than 3 s"]),
    ("[calibration]\nstart = 1", ["unknown key 'calibration.start'"]),
    ("[figures]\nfeeds = [5]", ["figures.feeds", "unit"]),
]


@pytest.mark.parametrize(("text", "said"), REFUSED, ids=[text[:40] for text, _ in REFUSED])
def test_what_is_refused_names_file_key_and_value(tmp_path, text, said):
    message = refusal(tmp_path, text)
    for words in said:
        assert words in message


NO_TOML = [
    (b"\xff\xfe\x00", "UTF-8"),
    (b"x = " + b"[" * 5000, "nested too deeply"),
    (b"#" * 1_000_001, "at most 1000000 bytes"),
    (b'title = "' + b"y" * 90_000 + b'"', "1 to 200 characters"),
    (b"[figures]\nfeeds = [" + b'"1 mm/s",' * 1001 + b"]", "figures.feeds"),
]


@pytest.mark.parametrize(("text", "said"), NO_TOML, ids=[said + str(len(text)) for text, said in NO_TOML])
def test_hostile_files_are_refused_in_one_line(tmp_path, text, said):
    assert said in refusal(tmp_path, text)


@pytest.mark.parametrize("name", ["none.toml", "."])
def test_what_is_no_file_is_refused(tmp_path, name):
    written(tmp_path, "")
    with pytest.raises(FileFormatError) as caught:
        read_study(tmp_path / name)
    assert str(tmp_path / name) in str(caught.value)


TABLE = "position_mm,forward_um,reverse_um\n0,0,20\n500,30,60\n1100,50,90\n"


def test_a_table_beside_the_study_is_error_and_model(tmp_path):
    (tmp_path / "mine.csv").write_text(TABLE)
    study = read_study(written(tmp_path, '[axis]\nerror = "mine.csv"\n[predictor]\nmodel = "axis"\n'))
    expected = BidirectionalTable(
        forward_positions_mm=[0, 500, 1100],
        forward_errors_mm=[0, 0.03, 0.05],
        reverse_positions_mm=[0, 500, 1100],
        reverse_errors_mm=[0.02, 0.06, 0.09],
    )
    at = np.linspace(0, 1100, 23)
    for way in (1, -1):
        assert study.axis_error.error_mm(at, way) == pytest.approx(expected.error_mm(at, way), abs=1e-12)
    assert study.model == study.axis_error
    other = read_study(written(tmp_path, '[predictor]\nmodel = "mine.csv"\n'))
    assert isinstance(other.axis_error, LatheNetwork)
    assert other.model == study.axis_error


def test_a_calibration_takes_the_widest_step_that_divides_the_travel(tmp_path):
    study = read_study(written(tmp_path, '[program]\nend = "3.6 inch"\n[calibration]\nincrement = "0.35 inch"\n'))
    assert study.calibration.targets_mm / 25.4 == pytest.approx(np.linspace(1, 3.6, 9), abs=1e-4)  # 2.6 inch / 8
    wide = read_study(written(tmp_path, '[program]\nend = "3.6 inch"\n[calibration]\nincrement = "10 inch"\n'))
    assert (wide.calibration.targets_mm / 25.4).tolist() == [1.0, 3.6]


MODEL = """observe = "deviation"
datum = "5 um"
[[effect]]
name = "backlash"
backlash = "-80 um"
[[effect]]
name = "drift"
amplitudes = ["1 um/h"]
"""


def test_a_model_file_is_a_predictor_without_what_changes_in_time(tmp_path):
    (tmp_path / "m.toml").write_text(MODEL)
    study = read_study(written(tmp_path, '[predictor]\nmodel = "m.toml"\n'))
    assert not study.learns
    # direction times half the backlash, and the datum
    assert study.model.error_mm([30.0, 900.0], 1) == pytest.approx([-0.035, -0.035], abs=1e-12)
    assert study.model.error_mm([30.0, 900.0], -1) == pytest.approx([0.045, 0.045], abs=1e-12)
    assert study.model.range_mm == pytest.approx((25.4, 1016.0))
    assert [(left.effect, left.why) for left in study.left_out] == [("drift", "it changes with time or temperature")]


BAD_MODELS = [
    (MODEL.replace("deviation", "force"), ["m.toml", "not to 'force'"]),
    ('observe = "force"\n', ["FILE: predictor.model", "force in mm", "a deviation in mm"]),
    (MODEL.replace('backlash = "-80 um"', ""), ["FILE: predictor.model", "backlash without numbers"]),
    (MODEL.replace("-80 um", "-80 deg"), ["m.toml", "backlash", "deg"]),
    (MODEL.replace('"backlash"', '"backlsh"'), ["m.toml", "backlash"]),
    ("[[[", ["m.toml"]),
    (None, ["m.toml", "no such file"]),
]
BAD_TABLES = [
    (None, ["bad.csv", "no such file"]),
    ("position_mm,forward_um,reverse_um\n0,0,20\n500,30,60\n400,50,90\n", ["bad.csv, line 4", "400"]),
    (
        "position_mm,forward_um,reverse_um\n0,20,0\n1100,20,0\n",
        ["FILE: axis.error", "not below the forward error"],
    ),
    ("position_mm,forward_mm,reverse_mm\n0,0,1\n1,-2,1\n1100,0,1\n", ["FILE: axis.error", "falls"]),
    (
        "position_mm,forward_um,reverse_um\n0,0,20\n500,30,60\n",
        ["FILE: program.end", "the range of the axis's error"],
    ),
]


@pytest.mark.parametrize(
    ("name", "section", "text", "said"),
    [
        *(("m.toml", '[predictor]\nmodel = "m.toml"\n', *bad) for bad in BAD_MODELS),
        *(("bad.csv", '[axis]\nerror = "bad.csv"\n', *bad) for bad in BAD_TABLES),
    ],
)
def test_files_that_cannot_be_used_are_refused(tmp_path, name, section, text, said):
    if text is not None:
        (tmp_path / name).write_text(text)
    path = written(tmp_path, section)
    with pytest.raises(RtecError) as caught:
        read_study(path)
    message = str(caught.value).replace(str(path), "FILE")
    assert "\n" not in message
    for words in said:
        assert words in message


def test_a_jerk_makes_s_curves(tmp_path):
    study = read_study(written(tmp_path, '[axis]\njerk = "10 m/s^3"\n'))
    assert study.limits.max_jerk_mm_s3 == 10_000.0
    assert study.shape is ProfileShape.JERK_LIMITED
    assert builtin_study().shape is ProfileShape.TRAPEZOIDAL


def test_timing_is_the_processors_with_the_studys_gate(tmp_path):
    study = read_study(written(tmp_path, '[box]\nprocessor = "fast"\ngate_margin = 0.5\nrest = "2 ms"\n'))
    timing = study.timing(Design.C)
    assert (timing.decide_ps, timing.step_ps) == (125_000, 125_000)
    assert (timing.gate_margin, timing.rest_ps) == (0.5, 2_000_000_000)
    assert study.injector(Design.A).design is Design.A


def test_faults_and_probing_are_tables_in_any_number(tmp_path):
    text = """
[[faults]]
kind = "power lost"
from = "600 s"
until = "601 s"
trigger = "while inserting"

[[faults]]
kind = "PC killed"
from = "1 s"

[[probing]]
from = "2 s"
until = "3 s"
"""
    study = read_study(written(tmp_path, text))
    assert [str(fault) for fault in study.faults] == [
        "power lost from 600 s to 601 s, while inserting",
        "PC killed from 1 s",
    ]
    assert study.probing == ((2 * 10**12, 3 * 10**12),)
    assert builtin_study().faults == builtin_study().probing == ()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("faults = 3", "faults = 3"),
        ("[faults]", "at most 100 tables [[faults]]"),
        ('[[faults]]\nfrom = "1 s"', "faults[1] has no 'kind'"),
        ('[[faults]]\nkind = "power lots"\nfrom = "1 s"', "did you mean 'power lost'"),
        ('[[faults]]\nkind = "power lost"', "faults[1] has no 'from'"),
        ('[[faults]]\nkind = "power lost"\nfrom = "1"', "faults[1].from"),
        ('[[faults]]\nkind = "power lost"\nfrom = "2 s"\nuntil = "1 s"', "faults[1].until"),
        ('[[faults]]\nkind = "frame lost"\nfrom = "1 s"', "faults[1].kind"),
        ('[[faults]]\nkind = "power lost"\nfrom = "1 s"\nplace = 1', "unknown key 'faults[1].place'"),
        ('[[faults]]\nkind = "PC killed"\nfrom = "1 s"\ntrigger = "while inserting"', "faults[1].trigger"),
        ('[[probing]]\nfrom = "2 s"', "probing[1] has no 'until'"),
        ('[[probing]]\nfrom = "-1 s"\nuntil = "2 s"', "probing[1].from: -1 s"),
        ('[[faults]]\nkind = "glitches"\nfrom = "-1 s"', "faults[1].from: -1 s"),
        ('[[faults]]\nkind = "glitches"\nfrom = "1 s"\n[[faults]]\nkind = "glitches"\nfrom = "2 s"', "is over"),
        ('[[probing]]\nfrom = "2 s"\nuntil = "2 s"', "probing[1].until"),
    ],
)
def test_a_fault_that_cannot_be_is_refused_with_its_key(tmp_path, text, said):
    assert said in refusal(tmp_path, text)
