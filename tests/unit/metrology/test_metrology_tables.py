"""Tables as people write them: what the layouts of ``foreign_files`` do not reach."""

import io
import zipfile

import foreign_files
import pytest

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology import column_choices, read_measurement
from rtec.metrology.tables import table, workbook

HEAD = "Soll [mm];Fehler [um]\n"


@pytest.fixture
def read(tmp_path):
    def from_text(text, *maps, name="x.csv", **choices):
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_measurement(tmp_path / name, column_choices(maps, **choices))

    return from_text


BAD = [
    ("Soll [mm];Fehler [um]\n0;1\n10;NaN\n", "line 3: Fehler [um] 'NaN' is not a finite number"),
    ("Soll [mm];Fehler [um]\n0;1.5\n10;2,5\n", "a decimal point, and numbers with a decimal comma, such as '2,5'"),
    ("Soll [mm];Fehler [um];Zeit\n0;1;7\n10;2;9\n", "column 'Zeit' has no unit; use time_s"),
    ("Soll [mm];Fehler [um];Zeit\n0;1;1/2/2026 10:00\n10;2;2/3/2026 10:00\n", "may be day/month or month/day"),
    ("Soll [mm];Fehler [um];Zeit\n0;1;25:00:00\n10;2;10:00:00\n", "'25:00:00' is no time of day"),
    ("Target;Run 1;Run 2\n0;1;2\n10;2;3\n20;2;3\n", "column 'Target' has no unit; use target_mm"),
    ("Target [mm];1+ [um];2 [um]\n0;1;2\n10;2;3\n", "some of the runs state a direction, others none"),
    ("Target [mm];1 [um];2 [mm]\n0;1;2\n10;2;3\n", "are in um and mm"),
    ("Soll [mm];Fehler [um];\n0;1;3\n10;2;4\n", "column 3 has no heading"),
    ("0;1\n10;2\n", "no header line"),
    ("Soll [mm];Fehler [um]\n0;1\n10\n20;3\n", "line 3: 1 fields; use 2"),
    ("Soll [mm];Fehler [um];Soll - Ist [um]\n0;;-1\n10;;-2\n", "Fehler [um] is empty"),
    (
        "Soll [mm];Fehler [um]\n0;100.000\n10;250\n",
        "'100.000' may have a decimal point, or a point between thousands",
    ),
    ("Soll;Fehler\n0 mm;1 um\n1 mm;2\n", "line 3: Fehler '2' has no unit; other cells have um"),
    ("Soll;Temp.\n0 mm;20 °C\n1 mm;68 °F\n", "cells of column 'Temp.' are in degc and degf"),
    ("Soll;Fehler\n0 mm;1 um\n1 um;2 inch\n1 °;2 um\n", "cells of column 'Soll' are in mm and um and deg"),
    ("Soll [mm];Fehler [um]\n0;(1.5)\n10;2\n20;3\n", "line 2: Fehler [um] '(1.5)' is not a finite number"),
    ("Soll [mm];Fehler [um];Soll [mm];Abw [um]\n0;1;5;2\n10;1;15;2\n", "--table 1, or another of them"),
    ("Soll [mm];Fehler [um];Abw [um]\nAchse X\n0;1;2\nAchse Y\n0;1;2\n", "'Achse Y', rows from line 5"),
    (
        "Richtung;Soll [mm];Fehler [um]\n+;0;1\n+;10;2\n\nnach der Messe\n+;0;1\n+;10;2\n",
        "'nach der Messe', rows from line 6",
    ),
    ("Soll [mm];1 [um];2 [um]\n0;1;2\n10;1;2\nSoll [mm];1 [um];2 [um]\n0;1;2\n10;1;2\n", "--table 1, or another"),
    (
        "Soll [mm];Vorwärts [um];Rückwärts [um];Differenz [um]\n0;1;2;1\n10;1;2;1\n",
        "'Differenz [um]=ignore' reads the passes",
    ),
    ("Achse;Soll [mm];Fehler [um]\nX;0;1\nX;9;2\nY;0;1\nY;9;2\n", "column 'Achse' names several axes: X, Y"),
    ("Soll [mm];1+ [um];1- [um]\n0;1 mm;2 mm\n10;1 mm;2 mm\n", "a cell of it mm; use one unit"),
    ("Soll [mm];Richtung;Fehler [um]\n0;A;1\n0;B;2\n9;A;1\n9;B;1\n", "Richtung 'A' is no direction"),
]


@pytest.mark.parametrize(("text", "words"), BAD)
def test_one_clear_error(read, text, words):
    with pytest.raises(FileFormatError) as error:
        read(text)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("maps", "words"),
    [
        (("nominal=target_mm",), "'nominal' is not valid; use a heading of"),
        (("Sol [mm]=target_mm",), "did you mean 'Soll [mm]'?"),
        (("Soll [mm]",), "such as 'nominal=target_mm'"),
        (("Soll [mm]=targt_mm",), "did you mean 'target_mm'?"),
        (("Soll [mm]=target_mm", "Soll [mm]=actual_mm"), "has two"),
        (("Soll [mm]=force",), "with a unit, such as force_n"),
    ],
)
def test_choices_that_are_none(read, maps, words):
    with pytest.raises(ArgumentError) as error:
        read(HEAD + "0;1\n10;2\n", *maps)
    assert words in str(error.value)


def test_choices_go_before_what_is_guessed(read):
    m = read("Soll [mm];Fehler [um];x\n0;1;7\n10;2;8\n", "Fehler [um]=deviation_nm", "column 3=temperature_degc")
    assert m.columns["deviation"].values.tolist() == [1e-6, 2e-6]
    assert m.columns["temperature"].values.tolist() == [7.0, 8.0]
    assert [note for note in m.notes if "took" in note] == ["took column 'Soll [mm]' for the target"]
    assert list(read(HEAD + "0;1\n10;2\n", "Fehler [um]=ignore").columns) == ["target"]


def test_a_rule_above_everything_is_a_heading_as_good_as_any(read):
    assert list(read("----\nSoll\n").unknown) == ["----"]


def test_nothing_is_said_of_our_own_format(read):
    assert read("target_mm,deviation_um,note\n0,1,a\n10,2,b\n").notes == ()


def test_a_heading_that_nobody_can_type_is_asked_about_by_its_number(read):
    with pytest.raises(FileFormatError) as error:
        read("Target " + "x" * 300 + ";Error [um]\n0;1\n10;2\n")
    assert "--map 'column 1=target_mm'" in str(error.value)
    assert len(str(error.value)) < 400


def test_a_table_that_is_not_there(read):
    text = "Achse X\nSoll [mm];Fehler [um]\n0;1\n10;2\n\nAchse Y\nSoll [mm];Fehler [um]\n0;3\n10;4\n"
    assert read(text, table=2).columns["deviation"].values.tolist() == [0.003, 0.004]
    with pytest.raises(ArgumentError, match="a file of a laser system"):
        read(RTL, name="x.rtl", table=1)
    with pytest.raises(ArgumentError, match=r"1 to 2 in .*: 'Achse X', rows from line 3; 'Achse Y', rows"):
        read(text, table=3)


@pytest.mark.parametrize(("factor", "what"), [(-1.0, "target less actual"), (1e-3, "a thousandth of actual less")])
def test_deviations_that_the_positions_beside_them_contradict(read, factor, what):
    seen = (0.0, 4.0, -2.0, 5.0)
    rows = "".join(f"{10 * k};{10 * k + 7 + e / 1000};{factor * e}\n" for k, e in enumerate(seen))
    with pytest.raises(FileFormatError, match=f"'Fehler .um.' is {what}"):
        read("Soll [mm];Ist [mm];Fehler [um]\n" + rows)
    unlike = "0;0.0;1\n10;10.004;2\n20;20;-3\n"  # the encoder beside the error that a laser saw
    assert read("Soll [mm];Ist [mm];Fehler [um]\n" + unlike).rows == 3


def test_cells_in_units_of_two_kinds_become_the_first(read):
    m = read("Soll;Fehler\n0 mm;1,5 um\n25,4 mm;-0,002 mm\n2 in;0,1 thou\n")
    assert m.columns["target"].values.tolist() == pytest.approx([0.0, 25.4, 50.8])
    assert m.columns["deviation"].values.tolist() == pytest.approx([0.0015, -0.002, 0.00254])
    assert any("'Soll' is in mm and inch: all of it was turned into mm" in note for note in m.notes)


def test_messages_name_the_headings_of_the_file(read):
    m = read("Pos. [mm];Abw. [um];run\n0;1;1\n10;2;1\n")
    assert [m.called(name) for name in ("target", "deviation", "run")] == [
        "target ('Pos. [mm]')",
        "deviation ('Abw. [um]')",
        "run",
    ]
    wide = read("Pos. [mm];1+ [um];1- [um]\n0;1;3\n10;2;4\n")
    assert [wide.called("deviation", [row]) for row in (0, 3)] == ["deviation ('1+ [um]')", "deviation ('1- [um]')"]


@pytest.mark.parametrize(
    "heading", ["Soll - Ist [um]", "Straightness error [um]", "Mean error [um]", "yaw [um]", "Korrektur Fehler [um]"]
)
def test_what_is_no_deviation_is_not_taken_for_one(read, heading):
    m = read(f"Soll [mm];{heading}\n0;1\n10;2\n")
    assert list(m.columns) == ["target"]
    assert list(m.unknown) == [heading]


def test_dates_of_other_countries(read):
    for cells in (("11/22/2026 1:00 PM", "11/22/2026 1:00:05 PM"), ("22/11/2026 13:00", "22/11/2026 13:00:05")):
        m = read(f"Soll [mm];Fehler [um];Zeit\n0;1;{cells[0]}\n10;2;{cells[1]}\n")
        assert m.columns["time"].values.tolist() == [0.0, 5.0]
        assert any("22" in note and "year" in note for note in m.notes)


def test_a_date_beside_a_time_of_day(read):
    m = read("Soll [mm];Fehler [um];Date;Time\n0;1;2026-11-22;23:59:50\n10;2;2026-11-24;00:00:10\n")
    assert m.columns["time"].values.tolist() == [0.0, 86420.0]
    with pytest.raises(FileFormatError, match="both hold 'time'"):
        read("Soll [mm];Fehler [um];Zeit [s];Uhrzeit [s]\n0;1;2;2\n10;2;3;3\n")


def test_a_sensor_that_recorded_little_is_left_out_and_said(read):
    m = read("Soll [mm];Fehler [um];Temp Luft [°C]\n0;1;20\n10;2;\n20;3;\n30;4;\n")
    assert list(m.columns) == ["target", "deviation"]
    assert m.notes[-1] == "column 'Temp Luft [°C]' is not used: 3 of its 4 cells are empty"


def test_too_many_cells_are_refused_and_plain_numbers_are_not(read, monkeypatch):
    monkeypatch.setattr(table, "MOST_CELLS", 10)
    rows = "".join(f"{k};{k}\n" for k in range(20))
    assert read(HEAD + rows).rows == 20
    with pytest.raises(FileFormatError, match="42 cells, not all of which are plain numbers"):
        read(HEAD + rows + "1;n/a\n")


def test_archives_are_read_with_limits(tmp_path, monkeypatch):
    data = foreign_files.workbook().data
    file = tmp_path / "x.xlsx"
    file.write_bytes(data)
    assert read_measurement(file).rows == 30
    monkeypatch.setattr(workbook, "_MOST_BYTES", 1000)
    with pytest.raises(FileFormatError, match="once unpacked; use at most 1000 bytes"):
        read_measurement(file)


def test_archives_that_are_no_workbook_say_so(tmp_path):
    def refused(data, words):
        (tmp_path / "x.csv").write_bytes(data)
        with pytest.raises(FileFormatError) as error:
            read_measurement(tmp_path / "x.csv")
        assert words in str(error.value)
        assert "saved as .xlsx without a password" in str(error.value)

    refused(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 600, "an old workbook (.xls), or one with a password")
    refused(foreign_files.workbook().data[:900], "damaged")
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
    refused(stream.getvalue(), "an OpenDocument file")


def test_a_sheet_that_is_not_there(tmp_path):
    file = tmp_path / "x.xlsx"
    file.write_bytes(foreign_files.workbook_of_several().data)
    with pytest.raises(ArgumentError, match="did you mean 'after'"):
        read_measurement(file, column_choices(sheet="aftr"))
    (tmp_path / "x.csv").write_text("target_mm\n1\n")
    with pytest.raises(ArgumentError, match="use it for a workbook"):
        read_measurement(tmp_path / "x.csv", column_choices(sheet="after"))


RTL = "\n".join(foreign_files.rtl())


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Target-count: 5", "Target-count: 6", "5 targets, where the file states '6'"),
        ("Run-count:6", "Run-count:8", "6 runs, where the file states '8'"),
        ("  1    1", "  1    9", "run 1, target 9; use targets 1 to 5"),
        ("File type  : rtl", "File type  : rta", "its units are not known"),
        ("Owner      : Linear", "Owner      : Rotary", "--map 'target=target_deg'"),
        ("-2.700000", "nan", "'nan' is not a finite number"),
    ],
)
def test_renishaw_files_that_went_wrong(read, old, new, words):
    assert old in RTL
    with pytest.raises(FileFormatError) as error:
        read(RTL.replace(old, new, 1), name="x.rtl")
    assert words in str(error.value)


def test_renishaw_files_of_rotary_axes_are_read_with_stated_units(read):
    text = RTL.replace("Owner      : Linear", "Owner      : Rotary")
    m = read(text, "target=target_deg", "deviation=deviation_arcsec", name="x.rtl")
    assert (m.columns["target"].unit, m.columns["deviation"].unit) == ("deg", "deg")
    assert m.columns["deviation"].values[0] == pytest.approx(-2.7 / 3600)


def test_returns_that_were_not_measured_are_left_out(read):
    lines = RTL.split("\n")
    start = lines.index("Run Target Data:") + 1
    lines[start:] = [
        line[:9] + "    0.000000" if line[:3].strip().isdigit() and int(line[:3]) % 2 == 0 else line
        for line in lines[start:]
    ]
    m = read("\n".join(lines), name="x.rtl")
    assert m.rows == 15
    assert set(m.columns["direction"].values) == {1.0}
    assert any("runs 2, 4, 6 hold zeros only" in note for note in m.notes)


def test_a_number_too_long_to_count_runs_is_no_run(read):
    with pytest.raises(FileFormatError, match="no positioning test in the columns"):
        read(f"Target [mm];1 [um];{'9' * 400} [um]\n0;1;2\n10;2;3\n").to_readings()


def test_one_axis_of_a_log_of_several(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text("time_s,target_x_mm,actual_x_mm,Target_Y_inch,current_y_a\n0,1,2,1,5\n1,3,4,2,6\n")
    y = read_measurement(file, column_choices(axis="Y"))
    assert y.columns["target"].values.tolist() == [25.4, 50.8]
    assert set(y.columns) == {"time", "target", "current"}
    assert set(read_measurement(file, column_choices(axis="x")).columns) == {"time", "target", "actual"}
    with pytest.raises(ArgumentError, match="one of x, y"):
        read_measurement(file)
    with pytest.raises(ArgumentError, match="one of x, y"):
        read_measurement(file, column_choices(axis="z"))
    with pytest.raises(ArgumentError, match="letter"):
        column_choices(axis="xy")
    kept = read_measurement(file, column_choices(["target_x_mm=ignore"], axis="x"))
    assert "target" not in kept.columns
