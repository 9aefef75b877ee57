import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from iso230_oracle import oracle_figures

from rtec.errors import RtecError
from rtec.io import read_text
from rtec.metrology import (
    MachineAxis,
    MeasuringPlan,
    Move,
    Readings,
    measuring_program,
    parse_program,
    positioning_figures,
    read_measurement,
    write_laser_file,
)
from rtec.metrology.laser_file import readings_of_text


def read_laser_file(path):
    return readings_of_text(path, read_text(path))


FOLDER = Path(tempfile.mkdtemp(prefix="rtec-metrology-"))


@st.composite
def complete_tests(draw):
    """Readings of a complete bidirectional test, in the order and on the grid of a laser file."""
    hundredths = draw(st.lists(st.integers(-4000, 4000), min_size=2, max_size=12, unique=True))
    runs = draw(st.integers(2, 6))
    target = np.sort(np.array(hundredths)) / 100 * 25.4
    count = 2 * runs * target.size
    microinch = draw(st.lists(st.integers(-9000, 9000), min_size=count, max_size=count))
    return Readings(
        target_mm=np.tile(np.concatenate((target, target[::-1])), runs),
        deviation_mm=np.array(microinch) * 25.4e-6,
        direction=np.tile(np.repeat([1, -1], target.size), runs),
        run=np.repeat(np.arange(1, runs + 1), 2 * target.size),
    )


@given(complete_tests())
@settings(max_examples=60, deadline=None)
def test_figures_equal_the_oracle_in_any_order(readings):
    expected = oracle_figures(
        readings.target_mm.tolist(), readings.deviation_mm.tolist(), readings.direction.tolist()
    )
    shuffled = np.random.default_rng(0).permutation(readings.size)
    columns = {name: getattr(readings, name)[shuffled] for name in ("target_mm", "deviation_mm", "direction", "run")}
    for one in (readings, Readings(**columns)):
        figures = positioning_figures(one).to_dict("mm")
        assert {key: figures[key] for key in expected} == pytest.approx(expected, rel=1e-9, abs=1e-12)


@given(complete_tests())
@settings(max_examples=40, deadline=None)
def test_laser_file_gives_runs_and_directions_back(readings):
    file = FOLDER / "z.dat"
    write_laser_file(file, readings)
    back = read_laser_file(file)
    np.testing.assert_array_equal(back.run, readings.run)
    np.testing.assert_array_equal(back.direction, readings.direction)
    np.testing.assert_allclose(back.target_mm, readings.target_mm, atol=1e-9)
    np.testing.assert_allclose(back.deviation_mm, readings.deviation_mm, atol=1e-9)


@given(complete_tests(), st.data())
@settings(max_examples=40, deadline=None)
def test_laser_file_cut_anywhere_is_refused_or_holds_whole_passes(readings, data):
    file = FOLDER / "cut.dat"
    write_laser_file(file, readings)
    text = file.read_text()
    file.write_text(text[: data.draw(st.integers(0, len(text) - 2))])
    try:
        back = read_laser_file(file)
    except RtecError as error:
        assert "\n" not in str(error)
        return
    # what cannot be told from a whole file: the first pass or a part of it, or whole runs
    targets = np.unique(np.round(readings.target_mm, 6)).size
    assert back.size <= targets or back.size % (2 * targets) == 0


@given(
    st.integers(0, 200), st.sampled_from([0.025, 0.05, 0.1, 0.52, 1.0, 0.0125]), st.integers(2, 30), st.integers(1, 3)
)
@settings(max_examples=60, deadline=None)
def test_program_visits_every_target_in_both_directions(start, increment, steps, runs):
    start_inch = start / 8
    plan = MeasuringPlan(
        start_mm=start_inch * 25.4,
        end_mm=(start_inch + steps * increment) * 25.4,
        increment_mm=increment * 25.4,
        dwell_s=1,
        runs=runs,
        feed_mm_s=10 * 25.4 / 60,
        overshoot_mm=12.7,
        axis=MachineAxis(minimum_mm=-25.4, maximum_mm=2540),
    )
    moves = [block.position_mm for block in parse_program(measuring_program(plan)) if isinstance(block, Move)]
    there = plan.targets_mm
    assert there.size == steps + 1
    assert plan.number_of_readings == runs * 2 * (steps + 1)
    one_run = 2 + steps + 1 + steps + 1
    assert len(moves) == 1 + runs * one_run
    for run in range(runs):
        first = 1 + run * one_run + 1
        np.testing.assert_allclose(moves[first : first + steps + 1], there)
        np.testing.assert_allclose(moves[first + steps + 2 : first + one_run - 1], there[::-1], atol=1.01e-4 * 25.4)
        assert moves[first + steps + 1] > there[-1]
        assert moves[first - 1] < there[0]


@given(st.binary(max_size=300))
@settings(max_examples=200, deadline=None)
def test_any_bytes_give_one_clear_error_or_readings(data):
    file = FOLDER / "any"
    for start in (b"", b"target_mm,actual_mm\n", b"Position LasRead LinearError Status AirTemp AirPress MatTemp\n"):
        file.write_bytes(start + data)
        for read in (read_measurement, read_laser_file, lambda path: read_measurement(path).to_readings()):
            try:
                read(file)
            except RtecError as error:
                assert "\n" not in str(error)


FIELD = st.sampled_from(
    ["1", "-2.5", "1e300", "1e400", "nan", "", " ", "x", '"', "#", "1e-320", "9" * 400, "0x1", "+-1"]
)


@given(
    st.lists(
        st.sampled_from(["target_mm", "actual_inch", "deviation_um", "run", "direction", "time_h", "x", "time"])
    ),
    st.lists(st.lists(FIELD, max_size=4), max_size=5),
)
@settings(max_examples=300, deadline=None)
def test_any_table_gives_one_clear_error_or_figures(headings, rows):
    file = FOLDER / "table.csv"
    file.write_text("\n".join([",".join(headings), *(",".join(row) for row in rows)]))
    try:
        positioning_figures(read_measurement(file).to_readings(), period=1.0).to_dict()
    except RtecError as error:
        assert "\n" not in str(error)


@given(st.lists(st.text(alphabet="G0M1753ZXYF.-() 9", max_size=12), max_size=6))
@settings(max_examples=300, deadline=None)
def test_any_program_gives_one_clear_error_or_blocks(lines):
    try:
        blocks = parse_program(["G70", "G01G59G90G94", "G53Z1.F1.", *lines])
    except RtecError as error:
        assert "\n" not in str(error)
    else:
        assert len(blocks) <= 3 + len(lines)
