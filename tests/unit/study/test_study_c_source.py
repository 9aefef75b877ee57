"""Trained predictors in C: what a compiler makes of them, beside the predictor and beside plain numpy."""

import ctypes
import itertools
import math
import re
import shutil
import subprocess
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from rtec.errors import ArgumentError
from rtec.predictors import AxisTables, BidirectionalTable, NoError, UnidirectionalTable
from rtec.predictors.axis_tables import AxisTable
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
from rtec.predictors.predictor_file import KnownPredictor
from rtec.predictors.tables import Between
from rtec.study.c_source import Precision, predictor_lines

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wmissing-prototypes")
PITCH, LOW, HIGH = 6.35, -120.0, 1016.0
COMPILES = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def network(inputs, hidden, seed):
    random = np.random.default_rng(seed)
    scale = {"position": (448.0, 568.0), "direction": (0.5, 0.5), "turn": (PITCH / 2, PITCH / 2)}
    weights = []
    for before, after in itertools.pairwise((len(inputs), *hidden, 1)):
        weights += [*random.normal(0.0, 2.0, before * after), *random.normal(0.0, 1.0, after)]
    middle, half = np.array([scale[name] for name in inputs]).T
    return LayeredNetwork(
        inputs=inputs, middle=middle, half=half, hidden=hidden, weights=weights, bias_mm=-0.013, factor_mm=0.011
    )


def networks(*parts):
    return TrainedNetworks(networks=parts, range_mm=(LOW, HIGH), pitch_mm=PITCH)


ALL = ("position", "direction", "turn")
X = np.array([-119.9, 3.1, 40.0, 40.5, 512.0, 1000.25])
Y = np.array([0.001, -0.004, 0.0125, 0.0124, 0.0124, -0.0371])
ELSEWHERE = {"reverse_positions_mm": X[1:] + 0.7, "reverse_errors_mm": 0.02 - Y[1:]}
PREDICTORS = {
    "40": networks(network(ALL, (40,), 1)),
    "30-10": networks(network(ALL, (30, 10), 2)),
    "30 + 8": networks(network(("position", "direction"), (30,), 3), network(("turn", "direction"), (8,), 4)),
    "10-20-5, no direction": networks(network(("turn",), (10, 20, 5), 5)),
    "one way, lines": UnidirectionalTable(positions_mm=X, errors_mm=Y, backlash_mm=0.013),
    "one way, cubics": UnidirectionalTable(positions_mm=X, errors_mm=Y, backlash_mm=0.013, between=Between.CUBIC),
    "both ways, lines": BidirectionalTable(forward_positions_mm=X, forward_errors_mm=Y, **ELSEWHERE),
    "both ways, cubics": BidirectionalTable(
        forward_positions_mm=X, forward_errors_mm=Y, **ELSEWHERE, between=Between.CUBIC
    ),
}


# by the definitions alone


def plain(predictor, x, way):
    """Return the error by the formulas of the docstrings, one position at a time."""
    if isinstance(predictor, TrainedNetworks):
        held = min(max(x, LOW), HIGH)
        turn = math.fmod(held, PITCH) % PITCH
        turn = 0.0 if PITCH - turn <= 0.0005 else turn
        seen = {"position": held, "direction": 1.0 if way < 0 else 0.0, "turn": turn}
        return sum(plain_network(part, [seen[name] for name in part.inputs]) for part in predictor.networks)
    if isinstance(predictor, UnidirectionalTable):
        at, error = predictor.positions_mm, predictor.errors_mm + (predictor.backlash_mm if way < 0 else 0.0)
    elif way < 0:
        at, error = predictor.reverse_positions_mm, predictor.reverse_errors_mm
    else:
        at, error = predictor.forward_positions_mm, predictor.forward_errors_mm
    if predictor.between is Between.CUBIC:
        return float(cubics(tuple(at), tuple(error))(np.clip(x, at[0], at[-1])))
    return float(np.interp(x, at, error))


@cache
def cubics(at, error):
    return PchipInterpolator(at, error)


def plain_network(part, inputs):
    values, at = (np.array(inputs) - part.middle) / part.half, 0
    widths = (len(inputs), *part.hidden, 1)
    for layer, (before, after) in enumerate(itertools.pairwise(widths), 1):
        weights = part.weights[at : at + before * after].reshape(before, after)
        at += before * after
        values = values @ weights + part.weights[at : at + after]
        at += after
        if layer < len(widths) - 1:
            values = 0.5 + 0.5 * np.tanh(0.5 * values)
    return part.bias_mm + part.factor_mm * float(values[0])


def positions():
    """Return random ones, the ends and beyond, nodes, multiples of the pitch, and places just beside all of them."""
    random = np.random.default_rng(7)
    turns = PITCH * np.arange(-20, 162)
    marks = np.concatenate([turns, turns - 0.0005, X, X + 0.7, [LOW, HIGH, 0.0]])
    beside = [np.nextafter(marks, side * np.inf) for side in (-1.0, 1.0)]
    near = [marks + off for off in (-1e-3, -6e-4, -4e-4, -1e-9, 1e-9, 1e-3)]
    return np.concatenate(
        [random.uniform(LOW - 50, HIGH + 50, 4000), marks, *beside, *near, [-1e6, 1e6, -1e300, 1e300]]
    )


# through the compiler


def compiled(folder, lines, precision=Precision.DOUBLE, name="corr", others=0):
    """Return the function of a C file, from a shared library."""
    (folder / "corr.c").write_text("\n".join(lines) + "\n")
    library = f"corr{len(list(folder.iterdir()))}.so"  # the loader takes a file of the same name for the one it has
    command = ["cc", *FLAGS, "-O2", "-shared", "-fPIC", "corr.c", "-o", library, "-lm"]
    subprocess.run(command, cwd=folder, check=True, timeout=60)
    function = getattr(ctypes.CDLL(str(folder / library)), f"{name}_error_mm")
    real = ctypes.c_double if precision is Precision.DOUBLE else ctypes.c_float
    function.argtypes, function.restype = (real, ctypes.c_int, *[real] * others), real
    return function


def source(predictor, precision=Precision.DOUBLE, held_mm=(-math.inf, math.inf), **known):
    known = {"name": "network 40 lm", **known}
    return list(
        predictor_lines(KnownPredictor(predictor=predictor, **known), "corr", held_mm=held_mm, precision=precision)
    )


@COMPILES
@pytest.mark.parametrize("kind", PREDICTORS)
def test_double_precision_says_what_the_predictor_says_and_the_formulas_say(kind, tmp_path):
    predictor = PREDICTORS[kind]
    function = compiled(tmp_path, source(predictor))
    x = positions()
    for way in (1, -1):
        found = np.array([function(at, way) for at in x])
        assert np.abs(found - predictor.error_mm(x, way)).max() <= 1e-12
        # on the very edge of the end of the turn the formula's own remainder chooses the side
        edge = np.abs((np.clip(x, LOW, HIGH) + 0.0005) / PITCH - np.round((np.clip(x, LOW, HIGH) + 0.0005) / PITCH))
        clear = (edge * PITCH > 1e-9) if isinstance(predictor, TrainedNetworks) else np.ones(x.size, dtype=bool)
        assert clear.sum() > 6000
        expected = np.array([plain(predictor, at, way) for at in x[clear]])
        assert np.abs(found[clear] - expected).max() <= 1e-12


@COMPILES
@pytest.mark.parametrize("kind", PREDICTORS)
def test_single_precision_is_within_its_digits(kind, tmp_path):
    """Bound: 2e-6 of the output's span for the sum, and the steps of a position times the slope of the error."""
    predictor = PREDICTORS[kind]
    function = compiled(tmp_path, source(predictor, Precision.SINGLE), Precision.SINGLE)
    x = np.random.default_rng(8).uniform(LOW, HIGH, 4000).astype(np.float32).astype(np.float64)
    phase = (x + 0.0005) % PITCH
    x = x[np.minimum(phase, PITCH - phase) > 5e-4]  # there the remainder chooses the side of the step
    h = float(np.spacing(np.float32(HIGH)))
    for way in (1, -1):
        truth = predictor.error_mm(x, way)
        around = np.stack([predictor.error_mm(x + off, way) for off in np.linspace(-2 * h, 2 * h, 5)])
        bound = 2e-6 * max(1e-3, np.ptp(truth), np.abs(truth).max()) + np.ptp(around, axis=0)
        found = np.array([function(at, way) for at in x])
        assert (np.abs(found - truth) <= bound).all()
        assert bound.max() < 2e-5
        assert np.abs(found - truth).max() > 0.0  # single, indeed


@COMPILES
@pytest.mark.parametrize("precision", Precision)
def test_nothing_of_a_library_but_the_exponential_function(precision, tmp_path):
    if shutil.which("nm") is None:
        pytest.skip("no nm")
    for kind in ("40", "30 + 8", "one way, lines", "both ways, cubics"):
        predictor = PREDICTORS[kind]
        (tmp_path / "corr.c").write_text("\n".join(source(predictor, precision)) + "\n")
        subprocess.run(["cc", *FLAGS, "-Wdouble-promotion", "-c", "corr.c"], cwd=tmp_path, check=True, timeout=60)
        shown = subprocess.run(["nm", "corr.o"], cwd=tmp_path, capture_output=True, text=True, check=True, timeout=60)
        rows = [line.split() for line in shown.stdout.splitlines()]
        exponential = ["exp" if precision is Precision.DOUBLE else "expf"]
        undefined = [row[-1] for row in rows if row[-2] == "U" and not row[-1].startswith("_")]
        assert undefined == (exponential if isinstance(predictor, TrainedNetworks) else []), kind
        assert [row[-1] for row in rows if row[-2] == "T"] == ["corr_error_mm"]


@COMPILES
def test_saturated_neurons_and_what_is_no_number_do_no_harm(tmp_path):
    steep = LayeredNetwork(
        inputs=("position",), middle=[0.0], half=[1e-3], hidden=(2,), weights=[1.0, -1.0, 0.0, 0.0, 1.0, 3.0, 0.5],
        bias_mm=0.0, factor_mm=1.0,
    )  # fmt: skip
    function = compiled(tmp_path, source(TrainedNetworks(networks=(steep,), range_mm=(-1e5, 1e5))))
    assert [function(at, 1) for at in (-1e5, 1e5, -2.0, 2.0)] == [3.5, 1.5, 3.5, 1.5]
    assert function(math.nan, 1) == function(-math.inf, 1) == 3.5
    assert function(0.0, 0) == 2.5
    table = compiled(tmp_path, source(PREDICTORS["both ways, cubics"], held_mm=(0.0, 500.0)))
    assert table(math.nan, 1) == table(-7.0, 1) == pytest.approx(plain(PREDICTORS["both ways, cubics"], 0.0, 1))


@COMPILES
@pytest.mark.parametrize("pitch_mm", [1e-6, 0.5])
def test_many_turns_are_counted_whole(pitch_mm, tmp_path):
    part = LayeredNetwork(
        inputs=("turn",), middle=[0.0], half=[pitch_mm], hidden=(1,), weights=[1.0, 0.0, 1.0, 0.0],
        bias_mm=0.0, factor_mm=0.01,
    )  # fmt: skip
    predictor = TrainedNetworks(networks=(part,), range_mm=(-5e5, 5e5), pitch_mm=pitch_mm)
    lines = source(predictor)
    assert ("long long" in "\n".join(lines)) == (pitch_mm == 1e-6)  # a long has 32 bits on many controllers
    function = compiled(tmp_path, lines)
    x = np.random.default_rng(9).uniform(-5e5, 5e5, 500)
    assert [function(at, 1) for at in x] == pytest.approx(predictor.error_mm(x, 1).tolist(), abs=1e-12)


def test_the_comment_says_what_it_is():
    text = "\n".join(
        source(PREDICTORS["40"], Precision.SINGLE, name="network 40 lm", source="z.csv", interval_mm=0.0018)
    )
    comment, code = text.split("*/", 1)
    for said in ("corr_error_mm: error of an axis, actual minus target, in mm", "compensation is its negative",
                 "network 40 lm, trained on z.csv", "90 % of readings lie within 1.8 um",
                 "known from -120 to 1016 mm",
                 "a position near 1016 mm has steps of 0.061 um", "expf()"):  # fmt: skip
        assert said in comment
    assert "double" not in code and not re.search(r"\d\.\d+(e-?\d+)?[,;) ]", code)
    assert "is not known" in "\n".join(source(PREDICTORS["40"]))


@COMPILES
def test_a_name_cannot_end_the_comment(tmp_path):
    nasty = "*/ } /* \\ ??/ Fräse @ // double"
    function = compiled(tmp_path, source(PREDICTORS["40"], name=nasty, source=nasty))
    assert math.isfinite(function(1.0, 1))


def test_what_c_cannot_hold_is_refused():
    with pytest.raises(ArgumentError, match="tables or networks"):
        source(NoError())
    thin = LayeredNetwork(
        inputs=("position",), middle=[0.0], half=[1e-50], hidden=(1,), weights=[1.0, 0.0, 1.0, 0.0],
        bias_mm=0.0, factor_mm=1.0,
    )  # fmt: skip
    with pytest.raises(ArgumentError, match="half width 1e-50"):
        source(TrainedNetworks(networks=(thin,), range_mm=(0.0, 1.0)), Precision.SINGLE)


# predictors that look at other axes


def of_axes():
    random = np.random.default_rng(11)
    at = np.array([-50.0, -3.0, 20.0, 260.0])
    tables = (
        AxisTable(of="position", positions_mm=X, values=Y, direction=1),
        AxisTable(of="position", positions_mm=X + 0.3, values=2.0 * Y, direction=-1),
        AxisTable(of="position_2", positions_mm=at, values=random.normal(0.0, 0.01, 4)),
        AxisTable(of="position_10", positions_mm=at, values=random.normal(0.0, 0.01, 4)),
        AxisTable(
            of="position", positions_mm=at, values=random.normal(0, 1e-4, 4), arm="position_10", arm_mm=(-20.0, 90.0)
        ),
    )
    scale = {"position_2": (105.0, 155.0), "position_10": (30.0, 110.0)}
    network = LayeredNetwork(
        inputs=("direction", "position_10", "turn", "position_2"),
        middle=[0.5, scale["position_10"][0], PITCH / 2, scale["position_2"][0]],
        half=[0.5, scale["position_10"][1], PITCH / 2, scale["position_2"][1]],
        hidden=(7, 3),
        weights=random.normal(0.0, 1.5, 4 * 7 + 7 + 7 * 3 + 3 + 3 + 1),
        bias_mm=0.002,
        factor_mm=0.013,
    )
    flat = tuple(table for table in tables if not table.direction and table.arm is None)
    return {
        "tables": AxisTables(tables=tables, range_mm=(LOW, HIGH)),
        "tables of both directions": AxisTables(tables=flat, range_mm=(LOW, HIGH)),
        "networks": networks(network),
    }


@COMPILES
@pytest.mark.parametrize("kind", of_axes())
def test_a_predictor_of_several_axes_takes_their_places_as_arguments(kind, tmp_path):
    predictor = of_axes()[kind]
    lines = source(predictor, name=kind)
    text = "\n".join(lines)
    assert (
        "double corr_error_mm(double position_mm, int direction, double position_2_mm, double position_10_mm)" in text
    )
    function = compiled(tmp_path, lines, others=2)
    random = np.random.default_rng(12)
    x, y, z = (random.uniform(LOW - 50, HIGH + 50, 4000), *random.uniform(-150.0, 350.0, (2, 4000)))
    for way in (1, -1):
        found = np.array([function(a, way, b, c) for a, b, c in zip(x, y, z, strict=True)])
        assert np.abs(found - predictor.error_mm(x, way, y, z)).max() <= 1e-12
    single = compiled(tmp_path, source(predictor, Precision.SINGLE), Precision.SINGLE, others=2)
    off = [single(a, 1, b, c) - predictor.error_mm(a, 1, b, c) for a, b, c in zip(x[:99], y, z, strict=False)]
    assert 0.0 < np.median(np.abs(off)) < 2e-6  # but for places beside the end of a turn
