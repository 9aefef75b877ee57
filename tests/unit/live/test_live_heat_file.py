"""Thermometers of a live PC: the last whole row of a table that somebody goes on writing."""

import numpy as np
import pytest

from rtec.errors import RtecError
from rtec.live.heat_file import OLDEST_S, READ_EVERY_S, HeatFile

HEAD = "# a logger\ntime_s,temperature_nose_degc,remark,temperature_bed_k,spindle_rpm\n"


class Clock:
    at_s = 100.0

    def __call__(self):
        return self.at_s


@pytest.fixture
def logged(tmp_path):
    file, clock = tmp_path / "heat.csv", Clock()
    file.write_text(HEAD + "0,20.5,cold,293.15,0\n")
    heat = HeatFile(file, clock)

    def says(more="", after_s=READ_EVERY_S):
        with file.open("a") as end:
            end.write(more)
        clock.at_s += after_s
        return heat.values().tolist()

    return heat, says


def test_the_last_whole_row_counts_in_its_units(logged):
    heat, says = logged
    assert heat.inputs == ("temperature_nose", "temperature_bed", "spindle_speed")
    assert says() == pytest.approx([20.5, 20.0, 0.0])
    assert says("1,21,warm,294.15,3000\n2,99") == pytest.approx([21.0, 21.0, 3000.0])
    assert says(",hot,300,1\n\n")[0] == 99.0


def test_it_is_not_read_at_every_turn(logged):
    _, says = logged
    assert says()[0] == 20.5
    assert says("1,30,x,300,0\n", after_s=0.9 * READ_EVERY_S)[0] == 20.5
    assert says(after_s=0.1 * READ_EVERY_S)[0] == 30.0


def test_what_is_no_number_and_a_row_of_another_length_say_nothing(logged):
    _, says = logged
    assert np.isnan(says("1,oops,x,300,7\n")).tolist() == [True, False, False]
    assert np.isnan(says("1,30,300,7\n")).all()


def test_a_file_that_nobody_writes_any_more_says_nothing(logged):
    _, says = logged
    assert says()[0] == 20.5
    assert says(after_s=0.9 * OLDEST_S)[0] == 20.5
    assert np.isnan(says(after_s=0.2 * OLDEST_S)).all()
    assert says("1,31,x,300,0\n")[0] == 31.0


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time_s,ch1_um\n0,1\n", "the headings 'time_s,ch1_um'"),
        ("", "the headings ''"),
        ("temperature_a_degc,temperature_a_k\n", "two columns of temperature_a"),
        (None, "no such file"),
    ],
)
def test_a_file_without_thermometers_is_refused(tmp_path, text, says):
    if text is not None:
        (tmp_path / "heat.csv").write_text(text)
    with pytest.raises(RtecError, match=says):
        HeatFile(tmp_path / "heat.csv")
