from pathlib import Path

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.effects import Observable
from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology import Column, Measurement, Readings, write_laser_file


def rows(*columns):
    """Return rows of a CSV file."""
    return "\n".join(",".join(f"{value}" for value in row) for row in zip(*columns, strict=True)) + "\n"


def notes(data):
    return "\n".join(data.notes)


@pytest.mark.parametrize(
    ("header", "values", "observe", "coordinate", "units", "observed", "position"),
    [
        ("target_mm,actual_mm", (10, 10.002), "deviation", "target", ("mm", "mm"), 0.002, 10),
        ("target_inch,deviation_um", (1, 3), "deviation", "target", ("mm", "mm"), 0.003, 25.4),
        ("actual_mm,deviation_um", (10, 500), "deviation", "target", ("mm", "mm"), 0.5, 9.5),
        ("target_mm,actual_mm,deviation_um", (10, 11, 7), "deviation", "target", ("mm", "mm"), 0.007, 10),
        ("command_deg,actual_deg", (10, 10.5), "deviation", "target", ("deg", "deg"), 0.5, 10),
        ("target_rev,deviation_arcsec", (0.25, 36), "deviation", "target", ("deg", "deg"), 0.01, 90),
        ("target_count,actual_count", (10, 13), "deviation", "target", ("count", "count"), 3, 10),
        ("time_min,deviation_arcsec", (2, 36), "deviation", "time", ("deg", "s"), 0.01, 120),
        ("actual_mm,force_n", (10, 3), "force", "actual", ("n", "mm"), 3, 10),
        ("target_mm,current_a", (10, 3), "current", "target", ("a", "mm"), 3, 10),
        ("time_s,torque_nm", (10, 3), "torque", "time", ("nm", "s"), 3, 10),
        ("target_mm,actual_mm,voltage_v", (10, 10.5, 3), "deviation", "target", ("mm", "mm"), 0.5, 10),
    ],
)
def test_default_quantity_and_coordinate(load, header, values, observe, coordinate, units, observed, position):
    # the same reading over and over but for the first column, so that there is something to go along
    text = header + "\n" + "".join(",".join(map(str, values)) + "\n" for _ in range(4))
    data = load(text)
    assert (data.observe, data.coordinate) == (observe, coordinate)
    assert (data.units.observed, data.units.position) == units
    np.testing.assert_allclose(data.observed, observed, rtol=1e-9)
    np.testing.assert_allclose(data.conditions.position, position, rtol=1e-12)
    assert data.observable is (Observable.DEVIATION if observe == "deviation" else Observable.DRIVE)


@pytest.mark.parametrize(
    ("observe", "quantity", "unit", "first"),
    [
        ("force", "force", "n", 7.0),
        (" Force_N ", "force", "n", 7.0),
        ("deviation", "deviation", "mm", 0.5),
        ("actual", "actual", "mm", 1.5),
        ("temperature_nut", "temperature_nut", "degc", 20.0),
        ("ch3", "ch3", "mm", 0.25),
        ("CH3_um", "ch3", "mm", 0.25),
    ],
)
def test_observe_names_a_quantity_or_a_heading(load, observe, quantity, unit, first):
    text = "target_mm,actual_mm,force_n,temperature_nut_degf,ch3_um\n"
    text += "1,1.5,7,68,250\n2,2.5,8,68,250\n3,3.25,9,68,260\n"
    data = load(text, observe=observe)
    assert (data.observe, data.units.observed) == (quantity, unit)
    assert data.observed[0] == pytest.approx(first, rel=1e-12)
    assert data.conditions.position[0] == (1.5 if quantity == "force" else 1.0)
    assert ("temperature_nut" in data.conditions.temperatures) == (quantity != "temperature_nut")


def test_observe_takes_the_name_that_the_file_has_for_it(load):
    data = load("time_s,z_um,temperature_nut_degc\n0,1,20\n60,2,21\n120,4,22\n", observe="z")
    assert (data.observe, data.coordinate, data.observed.tolist()) == ("actual", "time", [0.001, 0.002, 0.004])


def test_a_velocity_observed_is_no_condition(load):
    data = load("target_mm,actual_mm,velocity_mm_s\n1,1,7\n2,2,8\n3,3,9\n", observe="velocity")
    assert data.observed.tolist() == [7, 8, 9]
    assert not data.conditions.moving
    assert data.conditions.velocity is None


def test_a_deviation_across_zero_of_a_rotary_axis(load):
    data = load("target_deg,actual_deg\n" + rows([0, 120, 240, 359.9], [359.99, 120.01, 240, 0.0]))
    np.testing.assert_allclose(data.observed, [-0.01, 0.01, 0, 0.1], atol=1e-9)


def test_actual_observed_without_target_goes_over_time(load):
    data = load("time_s,actual_mm\n0,1\n60,2\n120,4\n", observe="actual")
    assert (data.coordinate, data.units.position) == ("time", "s")
    assert data.conditions.position.tolist() == [0, 60, 120]


def test_nothing_or_too_much_to_explain(load):
    with pytest.raises(FileFormatError, match=r"several other quantities; use --observe force or --observe curr"):
        load("actual_mm,force_n,current_a\n1,2,3\n2,3,4\n3,4,5\n")
    with pytest.raises(FileFormatError, match=r"no deviation.*'target_mm, pulse_v'; use target with actual"):
        load("target_mm,pulse_v\n1,2\n2,3\n3,4\n")
    with pytest.raises(FileFormatError, match=r"only other quantities; use --observe actual"):
        load("time_s,actual_mm\n1,2\n2,3\n3,4\n")
    with pytest.raises(FileFormatError, match=r"nothing to explain in the columns 'target_mm'"):
        load("target_mm\n1\n2\n3\n", observe="force")
    with pytest.raises(ArgumentError, match=r"--observe: 'currents' is not valid; use .*did you mean 'current'"):
        load("target_mm,actual_mm,current_a\n1,2,3\n2,3,4\n3,4,5\n", observe="currents")
    for word in ("target", "run", "time", "pulses_v", "x" * 1000, "\n"):
        with pytest.raises(ArgumentError, match=r"--observe.*use one of deviation, actual") as caught:
            load("run,time_s,target_mm,actual_mm,pulse_v\n1,1,1,1,1\n1,2,2,2,1\n1,3,3,3,1\n", observe=word)
        assert len(str(caught.value)) < 300


def test_fewer_than_three_rows(load):
    for text, found in (("target_mm,actual_mm\n1,2\n2,3\n", "2 rows"), ("target_mm,actual_mm\n1,2\n", "one row")):
        with pytest.raises(FileFormatError, match=f"{found}; use at least 3"):
            load(text)


def test_numbers_whose_squares_would_overflow(load):
    for number in ("1e300", "-1.1e12", "1e13"):
        with pytest.raises(FileFormatError, match=r"line 3: actual_mm is .*; use at most 1e\+12 in size"):
            load(f"target_mm,actual_mm\n1,1\n2,{number}\n3,3\n")


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("target_mm,actual_deg", "units mixed: target in mm, actual in deg"),
        ("target_deg,deviation_um", "units mixed: target in deg, deviation in mm"),
        ("target_deg,actual_count", "counts_per_rev: 8192' turns counts into angles"),
        ("target_mm,feed_deg_s,deviation_um", "units mixed: feed in deg/s, positions in mm"),
        ("target_deg,velocity_mm_s,deviation_deg", "units mixed: velocity in mm/s, positions in deg"),
        ("actual_count,velocity_deg_s,current_a", "velocity in deg/s, positions in count; .*counts_per_rev"),
    ],
)
def test_units_that_do_not_belong_together(load, header, words):
    count = header.count(",")
    text = header + "\n" + "".join(f"{i}" + f",{i}" * count + "\n" for i in (1, 2, 3))
    with pytest.raises(FileFormatError, match=words):
        load(text)


def test_columns_that_nothing_uses_are_named(load):
    text = "target_mm,actual_mm,force_n,pulse_v,operator\n" + "1,1,2,3,Ann\n2,2,3,4,Bob\n3,3,4,5,Ann\n"
    data = load(text)
    assert [name for name, _ in data.unknown] == ["pulse_v"]
    assert data.unknown[0][1].tolist() == [3, 4, 5]
    for words in ("not used: force_n", "used by no effect: pulse_v", "not all of it are numbers: operator"):
        assert words in notes(data)
    assert "row order counts as time" in notes(data)


def test_a_measurement_or_a_laser_file_will_do(load, tmp_path):
    target = np.array([0.0, 5.0, 10.0, 10.0, 5.0, 0.0])
    columns = {"target": Column("target", "mm", target), "deviation": Column("deviation", "mm", target * 1e-3)}
    data = load_dataset(Measurement(source="m", facts={"screw_pitch": "5 mm"}, columns=columns, unknown={}))
    assert (data.source, data.conditions.screw_pitch) == ("m", 5.0)
    file = tmp_path / "x.rtl"
    heat = np.full(6, 21.0)
    readings = Readings(
        target_mm=target,
        deviation_mm=target * 1e-3,
        direction=[1, 1, 1, -1, -1, -1],
        run=[1] * 6,
        air_temperature_degc=heat,
        air_pressure_kpa=heat * 4,
        material_temperature_degc=heat + 1,
    )
    write_laser_file(file, readings)
    data = load_dataset(file)
    assert (data.source, data.rows) == (str(file), 6)
    assert data.conditions.direction.tolist() == [1, 1, 1, -1, -1, -1]
    np.testing.assert_allclose(data.conditions.temperatures["temperature_material"], 22.0, atol=0.06)


@pytest.mark.parametrize(
    ("fact", "unit", "attribute", "value"),
    [
        ("screw_pitch: 6.35 mm", "mm", "screw_pitch", 6.35),
        ("scale_signal_period: 20 um", "mm", "signal_period", 0.02),
        ("scale_signal_period: 4 deg", "deg", "signal_period", 4.0),
        ("scale_signal_period: 16 counts", "count", "signal_period", 16.0),
        ("reference_temperature: 20 degC", "mm", "reference_temperature_degc", 20.0),
        ("reference_temperature: 71.6 °F", "mm", "reference_temperature_degc", 22.0),
        ("reference_temperature: 293.15 K", "mm", "reference_temperature_degc", 20.0),
        ("other: 1", "mm", "reference_temperature_degc", 20.0),
        ("other: 1", "deg", "revolution", 360.0),
        ("other: 1", "rev", "revolution", 360.0),
        ("other: 1", "mm", "revolution", None),
        ("other: 1", "count", "revolution", None),
        ("counts_per_rev: 8192", "count", "revolution", 360.0),
        ("counts_per_rev: 8192", "mm", "revolution", None),
    ],
)
def test_facts_of_the_axis(load, fact, unit, attribute, value):
    data = load(f"# {fact}\ntarget_{unit},actual_{unit}\n0,0\n1,1\n2,2\n")
    found = getattr(data.conditions, attribute)
    assert found == (value if value is None else pytest.approx(value, rel=1e-12))


@pytest.mark.parametrize(
    ("fact", "unit"),
    [
        ("screw_pitch: 6.35", "mm"),
        ("screw_pitch: 0 mm", "mm"),
        ("screw_pitch: 5 deg", "mm"),
        ("screw_pitch: 5 mm", "deg"),
        ("screw_pitch: 5 kg", "count"),
        ("scale_signal_period: fine", "mm"),
        ("reference_temperature: 20", "mm"),
        ("reference_temperature: -300 degC", "mm"),
        ("counts_per_rev: many", "count"),
        ("counts_per_rev: 0", "count"),
        ("counts_per_rev: 8192 mm", "count"),
    ],
)
def test_facts_that_are_none(load, fact, unit):
    name, value = fact.split(": ")
    body = f"target_{unit},actual_{unit}\n0,0\n1,1\n2,2\n"
    with pytest.raises(FileFormatError, match=f"{name}: "):
        load(f"# {fact}\n{body}")
    with pytest.raises(ArgumentError, match=f"{name}: "):
        load(body, facts={name: value})


def test_options_go_before_the_file(load):
    text = "# screw_pitch: 5 mm\ntarget_mm,actual_mm\n0,0\n1,1\n2,2\n"
    assert load(text, facts={"screw_pitch": "0.25 inch"}).conditions.screw_pitch == pytest.approx(6.35)
    assert load(text, facts={"reference_temperature": "68 degF"}).conditions.screw_pitch == 5
    with pytest.raises(ArgumentError, match="did you mean 'screw_pitch'"):
        load(text, facts={"screwpitch": "5 mm"})


def test_counts_of_a_turn_in_words(load):
    body = "target_count,actual_count\n0,0\n2048,2048\n4096,4097\n"
    data = load("# axis: brushless motor, 8192 counts/rev encoder\n" + body)
    np.testing.assert_allclose(data.conditions.position, [0, 90, 180], rtol=1e-12)
    assert data.observed[2] == pytest.approx(360 / 8192, rel=1e-9)
    assert "8192 counts a revolution, as 'axis' says" in notes(data)
    assert load("# counts_per_rev: 4096\n# axis: 8192 counts/rev\n" + body).conditions.position[1] == 180
    assert load(body, facts={"counts_per_rev": "4096 counts/rev"}).conditions.position[1] == 180
    contradiction = "# axis: 8192 counts/rev\n# note: 4096 counts per revolution\n"
    assert load(contradiction + body).units.position == "count"


def test_a_period_that_time_or_counts_cannot_use_is_noted(load):
    data = load("# screw_pitch: 5 mm\ntime_s,deviation_um\n0,1\n1,2\n2,3\n")
    assert data.conditions.screw_pitch is None
    assert "screw_pitch: 5 mm is not used, because positions are time" in notes(data)
    assert load("# screw_pitch: 384 s\ntime_s,deviation_um\n0,1\n1,2\n2,3\n").conditions.screw_pitch == 384


TRAIN = "# screw_pitch: 5 mm\n# reference_temperature: 22 degC\ntarget_mm,deviation_um,temperature_degc\n" + rows(
    range(5), range(5), range(5)
)


def test_a_file_to_score_on_takes_over_facts_and_quantity(load):
    train = load(TRAIN, "train.csv")
    text = "target_inch,actual_mm,force_n,temperature_degf\n" + rows(range(4), range(4), range(4), range(4))
    test = load(text, like=train)
    assert (test.observe, test.conditions.screw_pitch) == ("deviation", 5)
    assert test.conditions.reference_temperature_degc == 22
    assert "reference temperature as in" in notes(test)
    assert load("# screw_pitch: 4 mm\n" + text, like=train).conditions.screw_pitch == 4
    drive = load("actual_mm,force_n\n" + rows(range(4), range(4)), "train.csv")
    assert load(text, like=drive).observe == "force"
    # a force over the target in training is one over the target here, although there is an actual
    command = load("target_mm,force_n\n" + rows(range(4), range(4)), "train.csv")
    assert (load(text, like=drive).coordinate, load(text, like=command).coordinate) == ("actual", "target")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "target_deg,deviation_arcsec,temperature_degc\n",
            "units mixed between files: positions in deg here, in mm in",
        ),
        ("time_s,deviation_um,temperature_degc\n", "units mixed between files: positions in s here"),
        ("target_count,deviation_count,temperature_degc\n", "positions in count here.*counts_per_rev"),
        ("target_mm,deviation_um,force_n\n", "no temperature here, but in"),
        ("target_mm,deviation_um,temperature_nut_degc\n", "no temperature here, but in"),
        (
            "target_mm,velocity_mm_s,deviation_um,temperature_degc\n",
            "a log of a moving axis here, readings at rest in",
        ),
    ],
)
def test_a_file_of_another_kind(load, text, words):
    train = load(TRAIN, "train.csv")
    columns = text.count(",") + 1
    with pytest.raises(FileFormatError, match=words):
        load(text + rows(*[range(1, 5)] * columns), like=train)


def test_time_that_only_one_of_two_files_has(load):
    train = load("target_mm,deviation_um\n" + rows(range(5), range(5)), "train.csv")
    with_time = "time_min,target_mm,deviation_um\n" + rows(range(5), range(5), range(5))
    test = load(with_time, like=train)
    assert test.conditions.time_s is None
    assert test.units.clock == "reading"
    assert "row order counts as time" in notes(test)
    with pytest.raises(FileFormatError, match="no time here, but in"):
        load("target_mm,deviation_um\n" + rows(range(5), range(5)), like=load(with_time, "train.csv"))


SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"


@pytest.mark.skipif(not SHARED.is_dir(), reason="the measurements of real machines are not there")
@pytest.mark.parametrize(
    ("name", "rows", "cells", "units"),
    [
        ("stage_x.csv", 90, 18, ("mm", "mm", "reading")),
        ("stage_z.csv", 50, 10, ("mm", "mm", "reading")),
        ("worm_drive.csv", 666, 0, ("deg", "s", "s")),
        ("motor_hold_b_16.csv", 512, 0, ("a", "deg", "reading")),
    ],
)
def test_real_readings(name, rows, cells, units):
    data = load_dataset(SHARED / name)
    assert (data.rows, data.cell.max() + 1) == (rows, cells)
    assert (data.units.observed, data.units.position, data.units.clock) == units
    assert not data.conditions.moving
    raw = np.loadtxt(SHARED / name, delimiter=",", comments="#", skiprows=5 if name == "worm_drive.csv" else 3)[-1]
    last = {"stage": raw[-1] - raw[-2], "worm": raw[1] / 3600, "motor": raw[1]}[name.split("_")[0]]
    assert data.observed[-1] == pytest.approx(last, rel=1e-9)


def test_readings_under_different_loads_are_no_repeats(tmp_path):
    rows = [(v, load) for load in (0.0, 10.0, 0.0, 10.0) for v in (-20.0, -5.0, 5.0, 20.0)]
    lines = "\n".join(f"{v},{10 * (v > 0)},{load}" for v, load in rows)
    (tmp_path / "x.csv").write_text(f"velocity_mm_s,force_n,load_kg\n{lines}\n")
    data = load_dataset(tmp_path / "x.csv")
    assert data.units.load == "kg"
    assert data.conditions.load.tolist() == [load for _, load in rows]
    for number in np.unique(data.cell[data.cell >= 0]):
        assert np.ptp(data.conditions.load[data.cell == number]) == 0.0
        assert np.ptp(data.conditions.velocity[data.cell == number]) == 0.0
    assert (data.cell >= 0).all()


def test_the_air_and_its_columns_go_into_the_conditions(tmp_path):
    (tmp_path / "x.csv").write_text(
        "target_mm,deviation_um,pressure_mbar,humidity_percent\n0,1,1000,40\n5,2,1001,41\n9,2,1002,42\n"
    )
    data = load_dataset(tmp_path / "x.csv")
    assert data.conditions.pressure_hpa.tolist() == [1000.0, 1001.0, 1002.0]
    assert data.conditions.humidity_percent.tolist() == [40.0, 41.0, 42.0]
    assert not any("not used" in note for note in data.notes)
