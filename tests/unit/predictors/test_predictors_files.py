"""Table files: what they say in each unit, and one clear line for whatever is wrong with them."""

import os

import pytest
from numpy.testing import assert_allclose

from rtec.errors import ArgumentError, FileFormatError, OutputError
from rtec.predictors import (
    BidirectionalTable,
    LengthUnit,
    UnidirectionalTable,
    read_linuxcnc_table,
    read_table,
    write_table,
)
from rtec.predictors.table_files import LARGEST_FILE, CompensationKind

BOTH = BidirectionalTable(
    forward_positions_mm=[25.4, 50.8, 76.3],
    forward_errors_mm=[0.01, 0.1 + 0.2, -1e-7],
    reverse_positions_mm=[25.4, 50.8, 76.3],
    reverse_errors_mm=[0.08, 0.09, 0.1],
)
ONE = UnidirectionalTable(positions_mm=[0.1, 1 / 3, 7.0], errors_mm=[0.001, 2 / 3, -0.001], backlash_mm=-1 / 3)


def test_columns_in_any_unit_and_order(tmp_path):
    path = tmp_path / "z.csv"
    lines = ["\ufeff# lathe", "", "reverse_um, position_inch ,forward_mm", "84.5,1,.0134", "86,+2.0,15e-3", ""]
    path.write_bytes("\r\n".join(lines).encode())
    table = read_table(path)
    assert isinstance(table, BidirectionalTable)
    assert_allclose(table.forward_positions_mm, [25.4, 50.8], rtol=1e-15)
    assert_allclose(table.forward_errors_mm, [0.0134, 0.015], rtol=1e-15)
    assert_allclose(table.reverse_errors_mm, [0.0845, 0.086], rtol=1e-15)


def test_one_direction_with_a_backlash(tmp_path):
    path = tmp_path / "z.csv"
    path.write_text("# Backlash: -0.003 inch\nposition_mm,forward_um\n0,1\n5,2\n")
    assert read_table(path) == UnidirectionalTable(
        positions_mm=[0, 5], errors_mm=[0.001, 0.002], backlash_mm=-0.003 * 25.4
    )


@pytest.mark.parametrize("table", [BOTH, ONE], ids=["both", "one"])
def test_written_in_mm_reads_back_to_the_same_numbers(tmp_path, table):
    write_table(table, tmp_path / "t.csv")
    assert read_table(tmp_path / "t.csv") == table


@pytest.mark.parametrize("unit", list(LengthUnit))
def test_written_in_other_units(tmp_path, unit):
    write_table(BOTH, tmp_path / "t.csv", unit=unit)
    assert f"position_{unit.name.lower()}" in (tmp_path / "t.csv").read_text()
    assert_allclose(read_table(tmp_path / "t.csv").numbers, BOTH.numbers, rtol=1e-14)


def test_tables_with_different_positions_are_not_written(tmp_path):
    table = BidirectionalTable(
        forward_positions_mm=[0, 1], forward_errors_mm=[0, 0], reverse_positions_mm=[0, 2], reverse_errors_mm=[0, 0]
    )
    with pytest.raises(ArgumentError, match="sampled_from"):
        write_table(table, tmp_path / "t.csv")
    assert os.listdir(tmp_path) == []


def test_a_written_table_can_be_read_by_those_who_may_read_other_files(tmp_path):
    (tmp_path / "other").touch()
    write_table(BOTH, tmp_path / "t.csv")
    assert (tmp_path / "t.csv").stat().st_mode == (tmp_path / "other").stat().st_mode


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "t.csv"
    write_table(BOTH, path)
    before = path.read_bytes()

    def full(*_args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OutputError, match="No space left"):
        write_table(ONE, path)
    assert os.listdir(tmp_path) == ["t.csv"]
    assert path.read_bytes() == before
    with pytest.raises(OutputError, match="cannot be written"):
        write_table(ONE, tmp_path / "absent" / "t.csv")
    with pytest.raises(OutputError, match="cannot be written"):
        write_table(ONE, tmp_path / "a\0b.csv")


HEAD = b"position_mm,forward_um,reverse_um\n"
HOSTILE = {
    "empty": (b"", None, "the file is empty"),
    "comments only": (b"# nothing\n", None, "no header line"),
    "one row": (HEAD + b"0,1,2\n", None, "a table of 1 positions"),
    "unsorted": (HEAD + b"0,1,2\n2,1,2\n1,1,2\n", 4, "position 1 after 2"),
    "descending": (HEAD + b"# c\n2,1,2\n\n1,1,2\n", 5, "position 1 after 2"),
    "missing position": (HEAD + b"0,1,2\n,1,2\n", 3, "position is missing"),
    "missing error": (HEAD + b"0,1,2\n1,1,\n", 3, "reverse is missing"),
    "cut off": (HEAD + b"0,1,2\n1,1", 3, "a row of 2"),
    "too many": (HEAD + b"0,1,2\n1,1,2,3\n", 3, "a row of 4"),
    "nan": (HEAD + b"0,1,2\n1,nan,2\n", 3, "forward: 'nan'"),
    "large": (HEAD + b"0,1,2\n1e300,1,2\n", 3, "position: 1e+300"),
    "foreign digits": (HEAD + "0,1,2\n٣,1,2\n".encode(), 3, "position: '٣'"),
    "NUL": (HEAD + b"0,1,2\n1\x00,1,2\n", 3, "a NUL byte"),
    "not UTF-8": (HEAD + b"0,1,2\n\xff,1,2\n", 3, "byte 0xff is no UTF-8"),
    "decimal comma": (HEAD + b"0;1;2\n", 2, "a row of 1"),
    "unknown column": (b"position_mm,forwrd_um\n0,1\n", 1, "unknown column 'forwrd_um'"),
    "column twice": (b"position_mm,forward_um,forward_mm\n", 1, "two columns 'forward'"),
    "no position": (b"forward_um,reverse_um\n", 1, "no column position_..."),
    "no forward": (b"# x\nposition_um,reverse_um\n", 2, "no column forward_..."),
    "no backlash": (b"position_mm,forward_um\n0,1\n1,2\n", None, "neither a column reverse_... nor a backlash"),
    "both": (b"# backlash: 1 um\n" + HEAD + b"0,1,2\n1,2,3\n", None, "a column reverse_... and a backlash"),
    "bare backlash": (b"# backlash: 70\n", 1, "backlash: '70'"),
    "backlash twice": (b"# backlash: 1 um\n# backlash: 1 um\n", 2, "a second backlash"),
    "large backlash": (b"# backlash: 1e300 mm\n", 1, "backlash: 1e+300 mm"),
    "a long line": (HEAD + b"9" * 10_000 + b",1,2\n", 2, "position: '" + "9" * 40 + "'"),
}


@pytest.mark.parametrize(("content", "line", "problem"), HOSTILE.values(), ids=HOSTILE)
def test_bad_files_name_the_line(tmp_path, content, line, problem):
    path = tmp_path / "bad.csv"
    path.write_bytes(content)
    with pytest.raises(FileFormatError) as caught:
        read_table(path)
    assert (caught.value.line, caught.value.path) == (line, str(path))
    assert caught.value.problem.startswith(problem)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_the_nearest_column_is_suggested(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("position_mm,forwrd_um\n")
    with pytest.raises(FileFormatError, match="did you mean 'forward_um'"):
        read_table(path)


@pytest.mark.parametrize("read", [read_table, lambda path: read_linuxcnc_table(path, unit=LengthUnit.MM)])
def test_files_that_cannot_be_read(tmp_path, read):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "absent", tmp_path, tmp_path / "pipe", tmp_path / "a\0b", tmp_path / ("n" * 5000)):
        with pytest.raises(FileFormatError) as caught:
            read(path)
        assert caught.value.line is None
    with (tmp_path / "large").open("wb") as sparse:
        sparse.truncate(LARGEST_FILE + 1)
    with pytest.raises(FileFormatError, match=f"at most {LARGEST_FILE} bytes"):
        read(tmp_path / "large")


TRIPLES = "0.000000 0.000000 -0.001279\n0.100000\t0.098742  0.051632\n  0.200000 0.171529 0.194216\n\n"


@pytest.mark.parametrize(("unit", "mm"), [(LengthUnit.MM, 1.0), (LengthUnit.INCH, 25.4)])
def test_linuxcnc_positions(tmp_path, unit, mm):
    path = tmp_path / "z.comp"
    path.write_text(TRIPLES)
    table = read_linuxcnc_table(path, unit=unit)
    assert_allclose(table.forward_positions_mm, [0.0, 0.1 * mm, 0.2 * mm])
    assert_allclose(table.forward_errors_mm, [0.0, -0.001258 * mm, -0.028471 * mm], atol=1e-12)
    assert_allclose(table.reverse_errors_mm, [-0.001279 * mm, -0.048368 * mm, -0.005784 * mm], atol=1e-12)


def test_linuxcnc_trims_are_the_negative_error(tmp_path):
    path = tmp_path / "z.comp"
    path.write_text("0 0.001 -0.002\n10 -0.003 0.004\n")
    table = read_linuxcnc_table(path, unit=LengthUnit.MM, kind=CompensationKind.TRIMS)
    assert table.forward_errors_mm.tolist() == [-0.001, 0.003]
    assert table.reverse_errors_mm.tolist() == [0.002, -0.004]


@pytest.mark.parametrize(
    ("text", "line", "problem"),
    [
        ("", None, "the file is empty"),
        ("0 0 0\n# comment\n1 1 1\n", 2, "a row of 2"),
        ("0 0 0\n1 x 1\n", 2, "forward: 'x'"),
        ("0 0 0\nnan 0 1\n", 2, "nominal: 'nan'"),
        ("0 0 0\n0 0 0\n", 2, "position 0 after 0"),
    ],
)
def test_bad_linuxcnc_files(tmp_path, text, line, problem):
    path = tmp_path / "z.comp"
    path.write_text(text)
    with pytest.raises(FileFormatError) as caught:
        read_linuxcnc_table(path, unit=LengthUnit.MM)
    assert caught.value.line == line
    assert caught.value.problem.startswith(problem)
