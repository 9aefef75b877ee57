import numpy as np
import pytest

from rtec.errors import ArgumentError, FileFormatError, OutputError
from rtec.io import read_text
from rtec.metrology import Readings, write_laser_file
from rtec.metrology.laser_file import is_laser_file, readings_of_text


def read_laser_file(path):
    return readings_of_text(path, read_text(path))


HEADER = "Position       LasRead   LinearError Status AirTemp AirPress MatTemp"
TABLE_2_3 = f"""{HEADER}
    -7.00000     -0.000004      0.000004      0 73.76 29.33    74.65
    -6.86000     -0.139901     -0.000099      0 73.76 29.33    74.65
    -6.72000     -0.279949     -0.000051      0 73.76 29.34    74.65
    -6.58000     -0.419945     -0.000055      0 73.76 29.34    74.65
    -6.44000     -0.559952     -0.000048      0 73.76 29.34    74.65
    -6.30000     -0.699888     -0.000112      0 73.76 29.34          74.65
"""
FIGURE_4_4 = """Position      LasRead   LinearError Status AirTempAirPress
 MatTemp
     1.00000      0.000010     -0.000010      0 70.37 29.25 71.49
     2.00000     -0.999691     -0.000309      0 70.36 29.25 71.49
     3.00000     -1.999600     -0.000400      0 70.35 29.25 71.49
"""


def rows(positions, errors=None):
    zero = positions[0]
    errors = errors or [0.0] * len(positions)
    body = [
        f"{p:12.5f} {-(p - zero) - e:13.6f} {e:13.6f} 0 68.00 29.92 68.00"
        for p, e in zip(positions, errors, strict=True)
    ]
    return "\n".join([HEADER, *body]) + "\n"


@pytest.fixture
def file(tmp_path):
    return tmp_path / "z.dat"


def test_printed_rows_of_table_2_3(file):
    file.write_text(TABLE_2_3)
    readings = read_laser_file(file)
    np.testing.assert_allclose(
        readings.target_mm, np.array([-7, -6.86, -6.72, -6.58, -6.44, -6.3]) * 25.4, rtol=1e-15
    )
    inch = [0.000004, -0.000099, -0.000051, -0.000055, -0.000048, -0.000112]
    np.testing.assert_allclose(readings.deviation_mm, np.array(inch) * 25.4, rtol=1e-12)
    assert readings.direction.tolist() == [1] * 6
    assert readings.run.tolist() == [1] * 6
    np.testing.assert_allclose(readings.air_temperature_degc, 23.2, atol=1e-9)  # 73.76 degF
    np.testing.assert_allclose(
        readings.air_pressure_kpa[[0, 5]], [99.32279, 99.35665], atol=1e-4
    )  # 29.33, 29.34 inHg
    np.testing.assert_allclose(readings.material_temperature_degc, 23.694444, atol=1e-6)  # 74.65 degF


def test_header_run_together_and_wrapped_as_in_figure_4_4(file):
    file.write_text("5/6-D LASER\nTest: z axis\n\n" + FIGURE_4_4)
    readings = read_laser_file(file)
    np.testing.assert_allclose(readings.deviation_mm, np.array([-0.000010, -0.000309, -0.000400]) * 25.4)
    assert is_laser_file(FIGURE_4_4)
    assert not is_laser_file("target_mm,actual_mm\n1,2\n")
    assert not is_laser_file("Position, 3\n")


def test_unidirectional_runs_jump_back(file):
    file.write_text(rows([1, 2, 3, 1, 2, 3]))
    readings = read_laser_file(file)
    assert readings.direction.tolist() == [1] * 6
    assert readings.run.tolist() == [1] * 3 + [2] * 3


def test_first_pass_may_go_backwards(file):
    file.write_text(rows([3, 2, 1, 1, 2, 3]))
    readings = read_laser_file(file)
    assert readings.direction.tolist() == [-1] * 3 + [1] * 3
    assert readings.run.tolist() == [1] * 6


FULL = [1, 2, 3, 3, 2, 1, 1, 2, 3, 3, 2, 1]


@pytest.mark.parametrize(
    ("kept", "line", "words"),
    [
        (11, 12, "reverse pass of run 2 ends here and lacks 1 of 3 targets"),
        (10, 11, "reverse pass of run 2 ends here and lacks 2 of 3 targets"),
        (9, 10, "ends before the reverse pass of run 2"),
        (8, 9, "forward pass of run 2 ends here and lacks 1 of 3 targets"),
        (7, 8, "forward pass of run 2 ends here and lacks 2 of 3 targets"),
        (5, 6, "reverse pass of run 1 ends here and lacks 1 of 3 targets"),
        (4, 5, "reverse pass of run 1 ends here and lacks 2 of 3 targets"),
    ],
)
def test_cut_off_in_the_middle_of_a_pass(file, kept, line, words):
    file.write_text(rows(FULL[:kept]))
    with pytest.raises(FileFormatError, match=words) as caught:
        read_laser_file(file)
    assert caught.value.line == line


@pytest.mark.parametrize("cut", [2, 14, 40, 67])
def test_cut_off_in_the_middle_of_a_line(file, cut):
    text = rows([1, 2, 3])
    whole = text[: text.rindex("\n", 0, -1) + 1]
    last = text[len(whole) : -1]
    file.write_text(whole + last[:cut])
    if not last[:cut].strip():
        assert read_laser_file(file).size == 2
        return
    if cut >= len(last):
        assert read_laser_file(file).size == 3
        return
    with pytest.raises(FileFormatError, match="cut off in the middle of this line") as caught:
        read_laser_file(file)
    assert caught.value.line == 4


def test_file_without_its_last_line_end_is_whole(file):
    file.write_text(TABLE_2_3.rstrip("\n"))
    assert read_laser_file(file).size == 6


def test_missing_turning_target_is_named(file):
    file.write_text(rows([1, 2, 3, 2, 1]))
    with pytest.raises(FileFormatError, match=r"reverse pass of run 1 .*first: 3\.00000 inch"):
        read_laser_file(file)


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("-0.279949", "-0.289949", 4, "disagree by 0.010000 inch"),
        ("-0.279949", "nan", 4, "LasRead 'nan'"),
        ("-0.279949", "1e400", 4, "LasRead '1e400'"),
        ("-0.279949", "abc", 4, "LasRead 'abc'"),
        ("-0.279949", "0x1", 4, "LasRead '0x1'"),
        ("-0.279949", "", 4, "6 columns"),
        ("-0.279949", "-0.279949 1", 4, "8 columns"),
        ("-0.000051      0", "-0.000051    0.5", 4, "Status '0.5'"),
        ("-6.72000", "-6.72\0", 4, "NUL byte"),
        ("LinearError", "Error", None, "no header"),
    ],
)
def test_bad_rows(file, old, new, line, words):
    file.write_text(TABLE_2_3.replace(old, new))
    with pytest.raises(FileFormatError, match=words) as caught:
        read_laser_file(file)
    assert caught.value.line == line
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "empty"),
        (b" \n\n", "empty"),
        (HEADER.encode(), "no reading follows"),
        (rows([1, 1, 1]).encode(), "never changes"),
        (rows([1]).encode(), "never changes"),
        (b"\xff\xfe" + HEADER.encode(), "is no UTF-8"),
    ],
)
def test_bad_files(file, data, words):
    file.write_bytes(data)
    with pytest.raises(FileFormatError, match=words):
        read_laser_file(file)


def test_folder_and_missing_file(tmp_path):
    with pytest.raises(FileFormatError, match="no regular file"):
        read_laser_file(tmp_path)
    with pytest.raises(FileFormatError, match="no such file"):
        read_laser_file(tmp_path / "none")


def test_writer_gives_back_the_printed_rows(file):
    file.write_text(TABLE_2_3)
    readings = read_laser_file(file)
    copy = file.with_name("copy.dat")
    write_laser_file(copy, readings)
    written = [line.split() for line in copy.read_text().splitlines()]
    printed = [line.split() for line in TABLE_2_3.splitlines()]
    # the laser was zeroed 0.000000 inch from the first target, so LasRead is the printed one too
    assert written == printed


def test_writer_refuses_what_does_not_fit_and_where_it_cannot_write(file, tmp_path):
    far = Readings(target_mm=[3e5, 4e5], deviation_mm=[0, 0], direction=[1, 1], run=[1, 1])
    with pytest.raises(ArgumentError, match="10000 inch"):
        write_laser_file(file, far)
    near = Readings(target_mm=[3, 4], deviation_mm=[0, 0], direction=[1, 1], run=[1, 1])
    with pytest.raises(OutputError, match="cannot be written"):
        write_laser_file(tmp_path / "none" / "z.dat", near)
    file.mkdir()
    with pytest.raises(OutputError, match="cannot be written"):
        write_laser_file(file, near)
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"target_mm": []}, "target_mm"),
        ({"deviation_mm": [1.0]}, "deviation_mm"),
        ({"deviation_mm": [1.0, float("nan")]}, r"deviation_mm\[1\]"),
        ({"deviation_mm": [1.0, 1e13]}, r"deviation_mm\[1\]"),
        ({"direction": [1, 0]}, r"direction\[1\]"),
        ({"direction": [1, 257]}, r"direction\[1\]"),
        ({"run": [1, 1.5]}, r"run\[1\]"),
        ({"target_mm": ["a", "b"]}, "target_mm"),
        ({"air_temperature_degc": [20.0]}, "air_temperature_degc"),
    ],
)
def test_readings_are_checked(change, name):
    good = {"target_mm": [1, 2], "deviation_mm": [0, 0], "direction": [1, 1], "run": [1, 1]}
    with pytest.raises(ArgumentError, match=name):
        Readings(**(good | change))
