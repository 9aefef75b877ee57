"""The lathe's network: the printed numbers, the formula, and the figures of the machine."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rtec.errors import ArgumentError
from rtec.predictors import FORWARD, REVERSE, LatheNetwork, Predictor

INCH = 25.4
LATHE = LatheNetwork()


def on_grid(step_hundredths: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return forward and reverse errors in inches from 1 inch on."""
    position_mm = (1.0 + np.arange(count) * step_hundredths / 100) * INCH
    return LATHE.error_mm(position_mm, FORWARD) / INCH, LATHE.error_mm(position_mm, REVERSE) / INCH


@pytest.mark.parametrize("appendix", ["Appendix D", "Appendix E"])
def test_committed_numbers_are_those_of_both_appendices(oracle, paper, committed, appendix):
    listing = paper.index("/* calcZ.c */")
    text = (
        paper[listing:]
        if appendix == "Appendix E"
        else paper[paper.index("It is the output of netvalues.m") : listing]
    )
    assert oracle.printed_numbers(text) == committed


@pytest.mark.parametrize("direction", [FORWARD, REVERSE])
def test_equals_the_formula_of_the_thesis(oracle, numbers, direction):
    # phase in thousandths of an inch by whole numbers, so that no rounding chooses a turn
    thousandths = np.arange(1000, 40001, 7)
    expected = [oracle.error_inch(numbers, direction < 0, n / 1000, n % 250 / 1000) for n in thousandths]
    assert_allclose(LATHE.error_mm(thousandths / 1000 * INCH, direction) / INCH, expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("step_hundredths", "count", "average", "reversal"),
    [(2.5, 1561, 0.005176, 0.003892), (52, 76, 0.005087, 0.003908), (0.01, 390001, 0.005226, 0.003923)],
    ids=["0.025 inch", "0.52 inch", "continuous"],
)
def test_figures_of_the_machine(step_hundredths, count, average, reversal):
    forward, reverse = on_grid(step_hundredths, count)
    assert round(np.ptp([forward, reverse]), 6) == average
    assert round(np.abs(reverse - forward).max(), 6) == reversal


@pytest.mark.parametrize("direction", [FORWARD, REVERSE])
@pytest.mark.parametrize("turns", [5, 28, 79, 159])
def test_a_multiple_of_the_pitch_belongs_to_the_turn_that_begins(oracle, numbers, direction, turns):
    position = turns * 0.25
    begins = oracle.error_inch(numbers, direction < 0, position, 0.0)
    ends = oracle.error_inch(numbers, direction < 0, position, 0.25)
    assert begins - ends > 6e-5
    near_mm = position * INCH + np.array([-4.9e-4, -1e-12, 0.0, 1e-12, 2e-8])
    assert_allclose(LATHE.error_mm(near_mm, direction) / INCH, begins, rtol=0, atol=1e-8)
    # 0.51 µm below, the slope of the network leaves 3e-6 inch
    assert_allclose(LATHE.error_mm(position * INCH - 5.1e-4, direction) / INCH, ends, rtol=0, atol=3e-6)


def test_held_outside_the_trained_range():
    beyond = LATHE.error_mm([0.9 * INCH, 40.1 * INCH, -1e9, 1e9], FORWARD)
    ends = LATHE.error_mm([INCH, 40.0 * INCH], FORWARD)
    assert beyond.tolist() == [ends[0], ends[1], ends[0], ends[1]]
    assert LATHE.range_mm == (25.4, 1016.0)


@pytest.mark.parametrize(
    ("position", "direction", "named"),
    [
        (float("nan"), 1, "position_mm"),
        ([1.0, float("inf")], 1, "position_mm"),
        ("far", 1, "position_mm"),
        (1.0, 0, "direction"),
        (1.0, 2, "direction"),
        ([1.0, 2.0, 3.0], [1, -1], "direction"),
    ],
)
def test_bad_positions_and_directions(position, direction, named):
    with pytest.raises(ArgumentError) as caught:
        LATHE.error_mm(position, direction)
    assert caught.value.name == named


def test_numbers_are_a_fresh_array_of_one_type():
    first = LATHE.numbers
    first[:] = 0.0
    assert first.flags.writeable
    assert np.any(LATHE.numbers != 0.0)
    assert isinstance(LATHE, Predictor)
    assert LATHE == LatheNetwork()
    assert hash(LATHE) == hash(LatheNetwork())


SAMPLE = """
import numpy as np
from numba import config
from rtec.predictors import LatheNetwork, BidirectionalTable, NoError
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
print(int(config.DISABLE_JIT))
lathe = LatheNetwork()
grid = np.linspace(20.0, 1030.0, 60)
table = BidirectionalTable.sampled_from(lathe, grid[5:40:7])
for predictor in (lathe, table):
    for direction in (1, -1):
        print(*(float(x).hex() for x in predictor.error_mm(grid, direction)))
print(NoError().error_mm(3.0, 1))
steep = LayeredNetwork(inputs=("turn",), middle=[0], half=[1], hidden=(2,), weights=[1e6, -1e6, 0, 0, 1, 1, 0],
                       bias_mm=0.0, factor_mm=1.0)
print(TrainedNetworks(networks=(steep, steep), pitch_mm=5, range_mm=(0, 9)).error_mm([0.1, 9.0], 1).tolist())
"""


def sample(disable: str) -> list[str]:
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", SAMPLE],
        env={**os.environ, "NUMBA_DISABLE_JIT": disable},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.splitlines()


def test_the_same_numbers_without_compilation_and_no_warning():
    compiled, plain = sample("0"), sample("1")
    assert (compiled[0], plain[0]) == ("0", "1")
    for left, right in zip(compiled[1:5], plain[1:5], strict=True):
        values = [[float.fromhex(word) for word in line.split()] for line in (left, right)]
        assert len(values[0]) == 60
        assert_allclose(values[0], values[1], rtol=1e-12)
    assert compiled[5:] == plain[5:] == ["0.0", "[2.0, 2.0]"]
