import numpy as np
import pytest

from rtec.errors import ArgumentError, FileFormatError, OutputError
from rtec.io import MAX_BYTES
from rtec.metrology import Column, Measurement, Readings, measurement_of_readings, read_measurement, write_measurement
from rtec.metrology.readings import RotaryReadings

"""Measurements of real machines beside the project; they may be absent."""


@pytest.fixture
def file(tmp_path):
    return tmp_path / "x.csv"


def read(file, text):
    file.write_bytes(text.encode())
    return read_measurement(file)


@pytest.mark.parametrize(
    ("heading", "quantity", "unit", "of_two"),
    [
        ("run", "run", "", 2),
        ("time_s", "time", "s", 2),
        ("time_ms", "time", "s", 0.002),
        ("time_min", "time", "s", 120),
        ("time_h", "time", "s", 7200),
        ("target_mm", "target", "mm", 2),
        ("target_um", "target", "mm", 0.002),
        ("command_m", "target", "mm", 2000),
        ("target_inch", "target", "mm", 50.8),
        ("actual_deg", "actual", "deg", 2),
        ("deviation_arcsec", "deviation", "deg", 2 / 3600),
        ("actual_rev", "actual", "rev", 2),
        ("actual_count", "actual", "count", 2),
        ("velocity_mm_s", "velocity", "mm_s", 2),
        ("velocity_mm_min", "velocity", "mm_s", 2 / 60),
        ("feed_m_min", "feed", "mm_s", 2000 / 60),
        ("feed_inch_min", "feed", "mm_s", 50.8 / 60),
        ("velocity_deg_s", "velocity", "deg_s", 2),
        ("temperature_degc", "temperature", "degc", 2),
        ("temperature_degF", "temperature", "degc", -30 / 1.8),
        ("temperature_front_bearing_k", "temperature_front_bearing", "degc", -271.15),
        ("force_n", "force", "n", 2),
        ("current_a", "current", "a", 2),
        ("voltage_v", "voltage", "v", 2),
        ("torque_nm", "torque", "nm", 2),
    ],
)
def test_every_unit_of_the_contract(file, heading, quantity, unit, of_two):
    measurement = read(file, f"{heading}\n2\n2\n")
    column = measurement.columns[quantity]
    assert column.unit == unit
    np.testing.assert_allclose(column.values, [of_two, of_two], rtol=1e-14)
    assert not measurement.unknown


def test_facts_header_and_unknown_columns(file):
    text = (
        "# axis: z, long one\n# Screw_Pitch : 0.25 inch\n# only words\n# note: a\n# note: b: c\n\n"
        '"target_mm", pulse_v ,operator\r\n1,0.5,Ann\r\n\r\n2,0.75,"Bob, jr"\r\n'
    )
    measurement = read(file, text)
    assert dict(measurement.facts) == {"axis": "z, long one", "screw_pitch": "0.25 inch", "note": "a\nb: c"}
    assert measurement.columns["target"].values.tolist() == [1, 2]
    assert measurement.unknown["pulse_v"].tolist() == [0.5, 0.75]
    assert measurement.unknown["operator"].tolist() == ["Ann", "Bob, jr"]
    assert measurement.rows == 2


def test_byte_order_mark_is_taken_off(file):
    file.write_bytes(b"\xef\xbb\xbftarget_mm\n1\n")
    assert list(read_measurement(file).columns) == ["target"]


BAD = [
    ("target_mm\n1\nnan\n", 3, "target_mm 'nan' is not a finite number"),
    ("target_mm\n1\nabc\n", 3, "'abc'"),
    ("target_mm\n1\n\u0661\n", 3, "is not a finite number"),
    ("target_mm,actual_mm\n1,\n", 2, "actual_mm is empty"),
    ("target_mm,actual_mm\n1,2\n\n3\n", 4, "1 fields; use 2"),
    ("target_mm,actual_mm\n1,2\n1,2,3\n", 3, "3 fields; use 2"),
    ("# a: b\ntarget_mm,target_mm\n1,2\n", 2, "both hold 'target'"),
    ("target_mm,target_inch\n1,2\n", 1, "both hold 'target'"),
    ("target_mm,other,Other\n1,2,3\n", 1, "both hold 'other'"),
    ("time,target_mm\n1,2\n", 1, "'time' has no unit; use time_s, time_ms"),
    ("command\n1\n", 1, "'command' has no unit"),
    ("1,2\n3,4\n", 1, "no header line"),
    ("# a: b\n", None, "no header line"),
    ("target_mm\n", 1, "no row follows"),
    ("target_mm\n\n  \n", 1, "no row follows"),
    ("target_mm,\n1,2\n", 1, "column 2 has no heading"),
    ("", None, "empty"),
    ("target_mm\n1\n\0\n", 3, "NUL byte"),
    ("direction,target_mm\n1,2\n0,2\n", 3, "direction 0 is not valid"),
    ("run,target_mm\n1,2\n\n1.5,2\n", 4, "run 1.5 is not valid"),
    ("target_m\n1e307\n", 2, "stays finite in mm"),
    ("target_mm,pulse_v\n1,nan\n", 2, "pulse_v 'nan' is not finite"),
    ('target_mm\n"1\n', 2, "no row of a CSV file"),
    ("a" * 200_000 + "\n1\n", 1, "no row of a CSV file"),
    (",".join(f"c{i}" for i in range(1001)) + "\n", 1, "1001 columns"),
    ("target_mm\n" + "9" * 500 + "\n", 2, "not a finite number"),
]


@pytest.mark.parametrize(("text", "line", "words"), BAD)
def test_bad_files(file, text, line, words):
    with pytest.raises(FileFormatError) as caught:
        read(file, text)
    assert words in str(caught.value)
    assert caught.value.line == line
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_wrong_encoding_and_size(file):
    file.write_bytes("target_mm\n1\n\xe9\n".encode("latin-1"))
    with pytest.raises(FileFormatError, match=r"line 3: target_mm 'é' is not a finite number"):
        read_measurement(file)
    file.write_bytes(b"target_mm\n1\n\xe9\x02\n")
    with pytest.raises(FileFormatError, match=r"line 3: byte 0x02 is no text"):
        read_measurement(file)
    with file.open("wb") as sparse:
        sparse.truncate(MAX_BYTES + 1)
    with pytest.raises(FileFormatError, match=f"at most {MAX_BYTES} bytes"):
        read_measurement(file)


def test_a_fault_in_a_large_file_is_found_on_its_line(file):
    rows = ["0.5,1.5"] * 20_000
    rows[17_777] = "0.5,NaN"
    with pytest.raises(FileFormatError, match="line 17779: actual_mm 'NaN'"):
        read(file, "target_mm,actual_mm\n" + "\n".join(rows))


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("target_mm\n1\n2\n", [2, 3]),
        ("# a: b\n\ntarget_mm\n1\n2\n\n\n", [4, 5]),
        ("target_mm\n\n1\n \t\n2\n3", [3, 5, 6]),
    ],
)
def test_each_row_knows_its_line(file, text, lines):
    measurement = read(file, text)
    assert [measurement.line_of(row) for row in range(measurement.rows)] == lines
    bare = Measurement(source="x", facts={}, columns=measurement.columns, unknown={})
    assert bare.line_of(0) is None


def test_actual_minus_target_and_columns(file):
    readings = read(file, "run,direction,target_inch,actual_mm\n3,-1,1,25.5\n").to_readings()
    assert isinstance(readings, Readings)
    np.testing.assert_allclose(readings.deviation_mm, [0.1], rtol=1e-12)
    assert (readings.run.tolist(), readings.direction.tolist()) == ([3], [-1])


def test_deviation_is_taken_where_it_is_given(file):
    readings = read(file, "direction,target_mm,actual_mm,deviation_um\n1,1,1,7\n").to_readings()
    np.testing.assert_allclose(readings.deviation_mm, [0.007], rtol=1e-12)
    readings = read(file, "direction,actual_mm,deviation_um\n1,2,500\n").to_readings()
    np.testing.assert_allclose([readings.target_mm, readings.deviation_mm], [[1.5], [0.5]], rtol=1e-12)


def test_rotary_units(file):
    readings = read(file, "direction,target_rev,deviation_arcsec\n1,0.25,36\n").to_readings()
    assert isinstance(readings, RotaryReadings)
    np.testing.assert_allclose([readings.target_deg, readings.deviation_deg], [[90], [0.01]], rtol=1e-12)
    text = "# counts_per_rev: 8192\ndirection,target_count,actual_count\n1,2048,2049\n"
    readings = read(file, text).to_readings()
    np.testing.assert_allclose([readings.target_deg, readings.deviation_deg], [[90], [360 / 8192]], rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s,deviation_um\n1,2\n", "no positioning test in the columns 'time_s, deviation_mm'"),
        ("target_mm,pulse_v\n1,2\n", "'target_mm, pulse_v'"),
        ("actual_mm,Punkt\n1,2\n", "where 'Punkt' is one, --map 'Punkt=target_mm' says so"),
        ("target_mm,Anzeige\n1,2\n", "--map 'Anzeige=deviation_mm'"),
        ("direction,target_mm,actual_deg\n1,2,3\n", "target in mm, actual in deg"),
        ("direction,target_mm,deviation_arcsec\n1,2,3\n", "target in mm, deviation in deg"),
        ("direction,target_count,actual_count\n1,2,3\n", "says nothing of length or angle"),
        ("# counts_per_rev: many\ndirection,target_count,actual_count\n1,2,3\n", "counts_per_rev: 'many'"),
        ("# counts_per_rev: 0\ndirection,target_count,actual_count\n1,2,3\n", "counts_per_rev: '0'"),
        ("target_mm,actual_mm\n1,2\n1,2\n", "nothing moves"),
        ("run,target_mm,actual_mm\n1,1,2\n1,2,2\n2,2,2\n", "nothing moves in run 2"),
    ],
)
def test_no_readings(file, text, words):
    measurement = read(file, text)
    with pytest.raises(FileFormatError) as caught:
        measurement.to_readings()
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("target", "run", "direction"),
    [
        ([0, 1, 2, 2, 1, 0], None, [1, 1, 1, -1, -1, -1]),
        ([0, 1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0], None, [1, 1, 1, -1, -1, -1] * 2),
        ([2, 1, 0, 0, 1, 2, 2], None, [-1, -1, -1, 1, 1, 1, 1]),
        ([0, 1, 2, 0, 1, 2], [1, 1, 1, 2, 2, 2], [1] * 6),
        ([0, 1, 2, 0, 1, 2], None, [1, 1, 1, -1, 1, 1]),
    ],
)
def test_direction_from_the_sign_of_the_motion(target, run, direction):
    columns = [Column("target", "mm", np.array(target, float)), Column("deviation", "mm", np.zeros(len(target)))]
    if run:
        columns.append(Column("run", "", np.array(run, float)))
    by_quantity = {column.quantity: column for column in columns}
    readings = Measurement(source="x", facts={}, columns=by_quantity, unknown={}).to_readings()
    assert readings.direction.tolist() == direction
    assert readings.run.tolist() == (run or [1] * len(target))


def test_written_measurement_reads_back_to_the_same_numbers(file):
    generator = np.random.default_rng(1)
    values = generator.normal(size=50) * 10.0 ** generator.integers(-12, 12, 50)
    written = Measurement(
        source="x",
        facts={"axis": "z", "note": "a\nb"},
        columns={
            "target": Column("target", "mm", values),
            "temperature_nut": Column("temperature_nut", "degc", values[::-1].copy()),
            "feed": Column("feed", "mm_s", np.arange(50.0)),
        },
        unknown={"pulse, v": values * 3, "who": np.array(['a "b", c'] * 50)},
    )
    write_measurement(file, written)
    back = read_measurement(file)
    assert dict(back.facts) == dict(written.facts)
    assert list(back.columns) == list(written.columns)
    for key, column in written.columns.items():
        np.testing.assert_array_equal(back.columns[key].values, column.values)
        assert back.columns[key].unit == column.unit
    np.testing.assert_array_equal(back.unknown["pulse, v"], values * 3)
    assert back.unknown["who"].tolist() == written.unknown["who"].tolist()


@pytest.mark.parametrize("kind", ["linear", "rotary"])
def test_readings_travel_through_a_file(file, kind):
    common = {"direction": [1, 1, -1], "run": [1, 1, 2]}
    if kind == "linear":
        readings = Readings(
            target_mm=[0.1, 0.2, 0.3], deviation_mm=[1e-3, 2e-3, 0.1], air_temperature_degc=[20, 21, 22.5], **common
        )
    else:
        readings = RotaryReadings(target_deg=[0.1, 0.2, 0.3], deviation_deg=[1e-3, 2e-3, 0.1], **common)
    write_measurement(file, measurement_of_readings(readings, {"axis": "z"}))
    measurement = read_measurement(file)
    back = measurement.to_readings()
    assert type(back) is type(readings)
    names = ("target_mm", "deviation_mm") if kind == "linear" else ("target_deg", "deviation_deg")
    for name in (*names, "direction", "run"):
        np.testing.assert_array_equal(getattr(back, name), getattr(readings, name))
    assert ("temperature_air" in measurement.columns) == (kind == "linear")


def test_writer_reports_what_it_cannot_write(tmp_path):
    measurement = Measurement(
        source="x", facts={}, columns={"target": Column("target", "mm", np.array([1.0]))}, unknown={}
    )
    with pytest.raises(OutputError, match="cannot be written"):
        write_measurement(tmp_path / "none" / "x.csv", measurement)


@pytest.mark.parametrize(
    "columns",
    [
        {},
        {"target": Column("target", "mm", np.array([]))},
        {"target": Column("actual", "mm", np.array([1.0]))},
        {"target": Column("target", "mm", np.array([1.0])), "actual": Column("actual", "mm", np.array([1.0, 2.0]))},
    ],
)
def test_measurement_refuses_columns_that_do_not_fit(columns):
    with pytest.raises(ArgumentError, match="columns"):
        Measurement(source="x", facts={}, columns=columns, unknown={})


@pytest.mark.parametrize(
    ("heading", "value", "quantity", "unit", "inside"),
    [
        ("target_nm", 2e6, "target", "mm", 2.0),
        ("actual_rad", np.pi, "actual", "deg", 180.0),
        ("velocity_rad_s", np.pi / 2, "velocity", "deg_s", 90.0),
        ("velocity_rpm", 60.0, "velocity", "deg_s", 360.0),
        ("feed_m_s", 0.5, "feed", "mm_s", 500.0),
        ("time_us", 5e6, "time", "s", 5.0),
        ("pressure_hpa", 1013.25, "pressure", "hpa", 1013.25),
        ("pressure_mbar", 1013.25, "pressure", "hpa", 1013.25),
        ("pressure_pa", 101325.0, "pressure", "hpa", 1013.25),
        ("pressure_bar", 1.01325, "pressure", "hpa", 1013.25),
        ("humidity_percent", 40.0, "humidity", "percent", 40.0),
        ("load_kg", 12.0, "load", "kg", 12.0),
        ("load_nm", 3.0, "load", "nm", 3.0),
    ],
)
def test_units_of_other_makers(tmp_path, heading, value, quantity, unit, inside):
    (tmp_path / "x.csv").write_text(f"{heading},position_um\n{value!r},1\n{value!r},2\n")
    column = read_measurement(tmp_path / "x.csv").columns[quantity]
    assert (column.unit, column.values[0]) == (unit, pytest.approx(inside))


DATES = "time,target_mm\n{},1\n{},2\n{},3\n"


@pytest.mark.parametrize(
    ("dates", "seconds"),
    [
        (("2026-03-01T10:00:00Z", "2026-03-01T10:00:00.25Z", "2026-03-01T11:00:01+01:00"), [0.0, 0.25, 1.0]),
        (("2026-03-01 23:59:59", "2026-03-02 00:00:01", "2026-03-03 00:00:01"), [0.0, 2.0, 86402.0]),
        (("20260301T1000", "20260301T1001", "20260301T1100"), [0.0, 60.0, 3600.0]),
    ],
)
def test_dates_with_times_of_day_are_seconds_since_the_first(tmp_path, dates, seconds):
    (tmp_path / "x.csv").write_text(DATES.format(*dates))
    column = read_measurement(tmp_path / "x.csv").columns["time"]
    assert (column.unit, column.values.tolist()) == ("s", seconds)


@pytest.mark.parametrize(
    ("dates", "line", "says"),
    [
        (("2026-03-01T10:00:00Z", "2026-03-41T10:00:00Z", "2026-03-01T10:00:00Z"), 3, "is no date"),
        (("2026-03-01T10:00:00Z", "2026-03-01T10:00:01", "2026-03-01T10:00:02Z"), 3, "only one of them states"),
        (("2026-03-01T10:00:00Z", "12", ""), 3, "is no date"),
        (("1", "2", "3"), 1, "has no unit"),
    ],
)
def test_what_is_no_date_is_named_with_its_line(tmp_path, dates, line, says):
    (tmp_path / "x.csv").write_text(DATES.format(*dates))
    with pytest.raises(FileFormatError, match=says) as error:
        read_measurement(tmp_path / "x.csv")
    assert error.value.line == line
