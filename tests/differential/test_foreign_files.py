"""Files as instruments, spreadsheets and people write them: read right, or asked about; never misread."""

import foreign_files
import pytest

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology import column_choices, read_measurement


@pytest.fixture(params=foreign_files.ALL, ids=lambda make: make().name)
def foreign(request):
    return request.param()


def answered(foreign):
    return column_choices(foreign.maps, sheet=foreign.sheet, decimal=foreign.decimal, table=foreign.table)


def found(measurement):
    r = measurement.to_readings()
    return list(
        zip(r.run.tolist(), r.direction.tolist(), r.target_mm.tolist(), (r.deviation_mm * 1e3).tolist(), strict=True)
    )


def test_it_is_read_right_or_asked_about(foreign, tmp_path):
    file = tmp_path / foreign.name
    file.write_bytes(foreign.data)
    if foreign.asks:
        with pytest.raises((FileFormatError, ArgumentError)) as asked:
            read_measurement(file)
        assert foreign.asks in str(asked.value)
        assert str(file) in str(asked.value)
        assert "\n" not in str(asked.value)
        if not (foreign.maps or foreign.sheet or foreign.decimal or foreign.table):
            return
    measurement = read_measurement(file, answered(foreign))
    expected = [(r.run, r.direction, r.target_mm, r.deviation_um) for r in foreign.expected]
    readings = found(measurement)
    assert len(readings) == len(expected) - foreign.missing
    if foreign.missing:
        whole = {one[:3] for one in readings}
        expected = [one for one in expected if one[:3] in whole]
    for got, wanted in zip(readings, expected, strict=True):
        assert got[:2] == wanted[:2]
        assert got[2:] == pytest.approx(wanted[2:], abs=0.02 if foreign.name == "laser.dat" else 1e-6)
    for words in foreign.notes:
        assert any(words in note for note in measurement.notes)


def test_each_layout_is_another_file():
    names = {make().name for make in foreign_files.ALL}
    assert len(names) == len(foreign_files.ALL) >= 100


@pytest.mark.parametrize(
    "make",
    [foreign_files.iso_dates, foreign_files.clock_times_over_midnight, foreign_files.date_and_time_columns],
    ids=lambda make: make.__name__,
)
def test_times_of_every_kind_are_seconds_since_the_first(make, tmp_path):
    foreign = make()
    (tmp_path / foreign.name).write_bytes(foreign.data)
    time = read_measurement(tmp_path / foreign.name).columns["time"].values
    assert time.tolist() == [r.time_s for r in foreign.expected]
