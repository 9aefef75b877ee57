"""Experiment plans: their ranges, and the file that people read and edit."""

from dataclasses import replace

import pytest

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology import (
    ExperimentPlan,
    Heating,
    Passes,
    Reading,
    Spacing,
    Strokes,
    Weather,
    Zero,
    read_experiment,
    write_experiment,
)

RICH = ExperimentPlan(
    reading=Reading.DRIVE,
    runs=3,
    targets=60,
    start_mm=-12.5,
    span_mm=360.0,
    shifts_mm=(0.0, 1.0 / 3.0),
    spacing=Spacing.DENSE_AT_ENDS,
    strokes=Strokes.FULL,
    heating=Heating.COLD_AND_HOT,
    weather=Weather.DAYS,
    zero=Zero.KEPT,
    rotary=True,
    overshoot_mm=0.1,
    feeds_mm_s=(80.0, 1.1),
    dwell_s=2.5,
    turn_dwells_s=(1.0, 300.0),
    loads_kg=(5.0, 12.3),
    columns=("time", "velocity", "torque", "load"),
)
MANY = "[runs]\nfeeds = [" + ", ".join(['"1 mm/s"'] * 21) + "]\n"


@pytest.fixture
def file(tmp_path):
    return tmp_path / "plan.toml"


@pytest.mark.parametrize("plan", [ExperimentPlan(), RICH, replace(ExperimentPlan(), passes=Passes.FORWARD)])
def test_a_plan_comes_back_from_its_file(file, plan):
    write_experiment(file, plan, 'measure again,\nand again "so"')
    assert read_experiment(file) == plan
    assert file.read_text().startswith('# measure again, and again "so"\nreading = ')


def test_units_are_those_of_people(file):
    file.write_text(
        '[targets]\nstart = "1 inch"\nend = "0.5 m"\n[runs]\nfeeds = ["1.2 m/min"]\ndwell = "0.1 min"\n'
        '[conditions]\nloads = ["500 g"]\n'
    )
    plan = read_experiment(file)
    assert (plan.start_mm, plan.end_mm) == pytest.approx((25.4, 500.0))
    assert (plan.feeds_mm_s, plan.dwell_s, plan.loads_kg) == ((pytest.approx(20.0),), 6.0, (0.5,))
    assert (plan.rotary, plan.runs) == (False, ExperimentPlan().runs)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("runs = 5\n", "runs is no table"),
        ("[run]\nnumber = 5\n", "unknown key 'run'.*did you mean 'runs'"),
        ("[runs]\nnumbr = 5\n", "unknown key 'runs.numbr'.*did you mean 'number'"),
        ("[runs]\nnumber = 1000\n", "runs.number: 1000 is too large"),
        ("[runs]\nnumber = 99\n[targets]\nnumber = 2000\n", "readings"),
        ('[runs]\npasses = "both"\n', "plan.toml: runs.passes"),
        ('[runs]\nfeeds = ["40"]\n', "runs.feeds: '40'.*write the unit"),
        ('[runs]\nfeeds = ["40 mm"]\n', "runs.feeds: '40 mm'"),
        ("[runs]\nfeeds = []\n", "runs.feeds: 0 "),
        ('[runs]\nfeeds = "40 mm/s"\n', "runs.feeds"),
        ('[runs]\nfeeds = ["0 mm/s"]\n', "plan.toml: runs.feeds: 0 mm/s is too small"),
        (MANY, "21 values"),
        ('[runs]\nrests_before_reversals = ["2 s"]\n', "runs.rests_before_reversals: 1 times"),
        (
            '[targets]\nstart = "20 mm"\nend = "10 mm"\n',
            "plan.toml: targets.end: 10 mm is not valid; use more than targets.start, 20 mm",
        ),
        ('[targets]\nstart = "20 deg"\nend = "100 mm"\n', "targets.end: '100 mm'"),
        ("[targets]\nstart = 20\n", "targets.start: 20"),
        ('columns = ["tmie"]\n', "plan.toml: columns: 'tmie'.*did you mean 'time'"),
        ('columns = ["time", "time"]\n', "each once"),
        ("columns = [3]\n", "columns: '3'"),
        ('reading = "at rest"\n', "reading: 'at rest'.*did you mean 'position at rest'"),
        ('[conditions]\nweather = "rain"\n', "conditions.weather"),
        ('[conditions]\nloads = ["-1 kg"]\n', "conditions.loads: -1 kg is too small"),
        ('[runs]\ndwell = "1 h"\n[targets]\nnumber = 200\n', "duration at rest"),
        ('reading = "force in motion"\n[runs]\npasses = "forward only"\n', "runs.number: 5 is not valid; use 1"),
        ("[runs\n", "plan.toml"),
    ],
)
def test_what_is_wrong_is_named_with_file_and_key(file, text, says):
    file.write_text(text)
    with pytest.raises((ArgumentError, FileFormatError), match=says) as caught:
        read_experiment(file)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(file):
    with pytest.raises(FileFormatError, match=r"plan\.toml"):
        read_experiment(file)


def test_how_long_an_experiment_takes():
    plan = ExperimentPlan(
        runs=2, targets=10, span_mm=300.0, feeds_mm_s=(30.0,), dwell_s=5.0, turn_dwells_s=(1.0, 10.0)
    )
    assert plan.duration_s == pytest.approx(2 * 2 * (10.0 + 10 * 5.0 + 10.0))
    log = replace(plan, reading=Reading.MOVING, strokes=Strokes.FULL, feeds_mm_s=(30.0, 10.0))
    assert log.duration_s == pytest.approx(2 * 2 * (10.0 + 30.0))
