"""Compensation tables for other programs: against the model's formulas, and against what a compiler makes of them."""

import shutil
import subprocess

import numpy as np
import pytest

from rtec.effects import Units, effect_named
from rtec.inference.model import Model, Term
from rtec.predictors import BidirectionalTable, UnidirectionalTable
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
from rtec.study.c_source import compensation_lines
from rtec.study.compensation import LINUXCNC_TRIPLETS, MOST_NODES, compensation_of, csv_lines, linuxcnc_lines

UNITS = Units("mm", "mm", "s")


def term(name, amplitudes, **shape):
    effect = effect_named(name)
    return Term(effect=effect, shape=effect.shape_type(**shape), amplitudes=tuple(amplitudes))


def model(*terms, datum=0.0):
    return Model(observe="deviation", units=UNITS, terms=terms, datum=datum)


WAVE = model(term("cyclic", [0.006, 0.0], period=25.0), term("backlash", [-0.014]), term("drift", [1e-6]))


def truth(x, way):
    return 0.006 * np.sin(2.0 * np.pi * x / 25.0) - 0.007 * way


def test_straight_lines_stay_within_what_was_asked_for():
    x = np.linspace(0.0, 300.0, 20_011)
    for within in (1e-3, 1e-4):
        table = compensation_of(WAVE, 0.0, 300.0, within_mm=within, most=MOST_NODES)
        for way, errors in ((1, table.forward_mm), (-1, table.reverse_mm)):
            off = np.abs(np.interp(x, table.position_mm, errors) - truth(x, way)).max()
            assert off <= 1.02 * within + 1e-6  # written in nanometres
            assert off <= table.interpolation_mm * 1.05 + 1e-6
        # a chord of a sine is off by h^2/8 times its curvature: so many it takes at least, and half as many more
        least = 300.0 * 2.0 * np.pi / 25.0 * np.sqrt(0.006 / (8.0 * within)) * 0.7
        assert least < table.position_mm.size < 2.5 * least
    assert [one.effect for one in table.left_out] == ["drift"]


def test_so_many_nodes_as_there_may_be_are_put_where_they_help_most():
    table = compensation_of(WAVE, 0.0, 300.0, within_mm=0.0, most=LINUXCNC_TRIPLETS)
    assert table.position_mm.size == LINUXCNC_TRIPLETS
    assert (np.diff(table.position_mm) > 0).all()
    even = np.linspace(0.0, 300.0, LINUXCNC_TRIPLETS)
    x = np.linspace(0.0, 300.0, 20_011)
    evenly = np.abs(np.interp(x, even, truth(even, 1)) - truth(x, 1)).max()
    assert table.interpolation_mm < 1.6 * evenly


def test_a_compensation_file_holds_actual_positions_that_ascend():
    table = compensation_of(WAVE, 0.0, 300.0, within_mm=1e-3, most=LINUXCNC_TRIPLETS)
    rows = np.array([[float(x) for x in line.split()] for line in linuxcnc_lines(table)])
    assert rows.shape == (table.position_mm.size, 3)
    assert rows[:, 1] - rows[:, 0] == pytest.approx(truth(rows[:, 0], 1), abs=2e-6)
    assert rows[:, 2] - rows[:, 0] == pytest.approx(truth(rows[:, 0], -1), abs=2e-6)
    inches = np.array([[float(x) for x in line.split()] for line in linuxcnc_lines(table, per_unit_mm=25.4)])
    assert inches * 25.4 == pytest.approx(rows, abs=1e-6)


def test_a_table_for_people_says_what_it_leaves_out_and_what_its_lines_leave():
    table = compensation_of(WAVE, 0.0, 100.0, within_mm=1e-3, most=MOST_NODES)
    lines = list(csv_lines(table))
    assert lines[0] == f"# interpolation_error: {1e3 * table.interpolation_mm:.3f} um"
    assert lines[1].startswith("# left_out: drift, ")
    assert lines[2] == "position_mm,forward_um,reverse_um"
    assert len(lines) == 3 + table.position_mm.size
    x, up, down = (float(text) for text in lines[-1].split(","))
    assert (up, down) == pytest.approx((1e3 * truth(x, 1), 1e3 * truth(x, -1)), abs=2e-3)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_a_compiler_takes_the_function_and_it_says_the_same(tmp_path):
    table = compensation_of(WAVE, 0.0, 300.0, within_mm=1e-4, most=MOST_NODES)
    (tmp_path / "z.c").write_text("\n".join(compensation_lines(table, "z")) + "\n")
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "z.c"\nint main(void) {\n'
        "    for (int k = -20; k <= 320; ++k)\n"
        '        printf("%.9f %.9f\\n", z_error_mm(k + 0.25, 1), z_error_mm(k + 0.25, -1));\n'
        "    return 0;\n}\n"
    )
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1"]
    subprocess.run(["cc", *flags, "main.c", "-o", "z"], cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "z"], capture_output=True, text=True, check=True).stdout
    found = np.array([[float(x) for x in line.split()] for line in said.splitlines()])
    x = np.clip(np.arange(-20, 321) + 0.25, 0.0, 300.0)  # beyond the ends the error of the nearest end
    assert found == pytest.approx(np.stack([truth(x, 1), truth(x, -1)], axis=1), abs=1.1e-4)


def test_a_step_is_a_step_in_the_table_and_its_error_says_so():
    step = model(term("cyclic", [0.006, 0.0, 0.005], period=25.0, step_at=7.0))
    table = compensation_of(step, 0.0, 300.0, within_mm=1e-4, most=MOST_NODES)
    x = np.setdiff1d(np.round(np.linspace(0.0, 300.0, 200_001), 6), np.arange(7.0, 300.0, 25.0))
    turns = (x - 7.0) / 25.0
    true = 0.006 * np.sin(2.0 * np.pi * x / 25.0) + 0.005 * (0.5 - (turns - np.floor(turns)))
    off = np.abs(np.interp(x, table.position_mm, table.forward_mm) - true).max()
    assert off <= 1.05 * table.interpolation_mm + 1e-6 < 2e-4
    jump = np.interp([7.00001, 6.99999], table.position_mm, table.forward_mm)
    assert jump[0] - jump[1] == pytest.approx(0.005, abs=1e-5)


@pytest.mark.parametrize("both", [False, True])
def test_straight_lines_of_a_table_are_drawn_by_its_own_points(both):
    at, error = np.array([-3.337, 1.11, 50.0071, 51.0, 97.77]), np.array([0.001, -0.004, 0.012, 0.0123, -0.02])
    if both:
        table = BidirectionalTable(
            forward_positions_mm=at, forward_errors_mm=error, reverse_positions_mm=at + 0.213, reverse_errors_mm=error
        )
        places = np.sort(np.concatenate([at, at[:-1] + 0.213]))[1:]
    else:
        table, places = UnidirectionalTable(positions_mm=at, errors_mm=error, backlash_mm=0.0071), at
    drawn = compensation_of(table, *table.range_mm, within_mm=1e-8, most=MOST_NODES)
    assert drawn.position_mm.tolist() == pytest.approx(places.tolist())
    assert drawn.left_out == () and drawn.interpolation_mm < 1e-6
    assert drawn.reverse_mm == pytest.approx(table.error_mm(places, -1), abs=1e-6)


def test_the_range_of_a_network_begins_and_ends_at_nodes():
    rising = LayeredNetwork(
        inputs=("position",), middle=[4.0], half=[3.0], hidden=(1,), weights=[1.0, 0.0, 1.0, 0.0],
        bias_mm=0.0, factor_mm=0.1,
    )  # fmt: skip
    known = TrainedNetworks(networks=(rising,), range_mm=(1.0007, 7.0003))
    drawn = compensation_of(known, -20.0, 30.0, within_mm=1e-5, most=MOST_NODES)
    assert drawn.position_mm[[0, 1, -2, -1]].tolist() == [-20.0, 1.0007, 7.0003, 30.0]
    assert drawn.forward_mm[[0, -1]] == pytest.approx(0.1 / (1.0 + np.exp([0.9998, -1.0001])), abs=2e-5)
