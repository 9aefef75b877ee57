"""A NARX network in C: what a compiler makes of it, beside the network."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

from rtec.cli import main
from rtec.predictors import KnownPredictor, Narx, NarxShape, Sequences, write_predictor
from rtec.study.c_source import Precision
from rtec.study.narx_source import narx_lines

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wmissing-prototypes")
COMPILES = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
SAMPLES = 10_000


def network(*, linear, channels=2, inputs=(0, 2), feedback=(1, 3)):
    shape = NarxShape(channels=channels, neurons=6, input_delays=inputs, feedback_delays=feedback, linear=linear)
    draw = np.random.default_rng(5)
    return Narx(
        shape=shape,
        names=("velocity", "current")[:channels],
        period_s=2.5e-4,
        middle=draw.uniform(-1.0, 1.0, channels + 1),
        half=draw.uniform(0.5, 2.0, channels + 1),
        weights=draw.normal(0.0, 0.3, shape.weights),
    )


def lines_of(narx, precision=Precision.DOUBLE):
    return list(narx_lines(KnownPredictor(predictor=narx, name="a */ drive"), narx, "axis", precision=precision))


def compiled(folder, lines):
    (folder / "axis.c").write_text("\n".join(lines) + "\n")
    library = folder / "axis.so"
    subprocess.run(["cc", *FLAGS, "-O2", "-shared", "-fPIC", "axis.c", "-o", library, "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(library))


def stepped(library, narx, data, number=ctypes.c_double):
    """Return what the C says of a run, whose first samples are as measured."""
    state = (number * (64 * (narx.lags + 1)))()
    row, step = number * len(narx.names), library.axis_step
    step.restype = number
    found = data.output.astype(np.float64).copy()
    rows = [row(*inputs) for inputs in data.inputs.tolist()]
    library.axis_rest(state, rows[0], number(0.0))
    for t in range(narx.lags):
        library.axis_measured(state, rows[t], number(data.output[t]))
    for t in range(narx.lags, len(data)):
        found[t] = step(state, rows[t])
    return found


def motion(narx, samples=SAMPLES):
    draw = np.random.default_rng(6)
    inputs = draw.uniform(-1.0, 1.0, (samples, len(narx.names)))
    return Sequences(inputs=inputs, output=draw.uniform(-1.0, 1.0, samples), names=narx.names, period_s=narx.period_s)


@COMPILES
@pytest.mark.parametrize(
    "shape",
    [
        {"linear": True},
        {"linear": False},
        {"linear": True, "channels": 1, "inputs": (1,), "feedback": (1,)},
        {"linear": False, "channels": 1, "inputs": range(5), "feedback": range(1, 5)},
    ],
)
def test_over_ten_thousand_steps_the_c_is_the_network(tmp_path, shape):
    narx = network(**shape)
    data = motion(narx)
    library = compiled(tmp_path, lines_of(narx))
    assert stepped(library, narx, data) == pytest.approx(narx.free_run(data), rel=0.0, abs=1e-12)


@COMPILES
def test_in_single_precision_it_is_the_network_to_a_millionth(tmp_path):
    narx = network(linear=True)
    data = motion(narx, 500)
    lines = lines_of(narx, Precision.SINGLE)
    assert not any("double" in line for line in lines)
    found = stepped(compiled(tmp_path, lines), narx, data, ctypes.c_float)
    assert found == pytest.approx(narx.free_run(data), rel=0.0, abs=1e-5)


@COMPILES
def test_at_rest_it_remembers_inputs_and_output_as_they_were(tmp_path):
    narx = network(linear=True)
    library = compiled(tmp_path, lines_of(narx))
    state, row = (ctypes.c_double * 64)(), (ctypes.c_double * 2)(0.3, -0.2)
    library.axis_rest(state, row, ctypes.c_double(0.7))
    library.axis_step.restype = ctypes.c_double
    expected = narx.step(narx.at_rest([0.3, -0.2], 0.7), [0.3, -0.2])
    assert library.axis_step(state, row) == pytest.approx(expected, abs=1e-14)


def test_export_writes_the_c_of_a_network_and_no_table(tmp_path, capsys):
    narx = network(linear=True)
    model, source = tmp_path / "m.toml", tmp_path / "axis.c"
    write_predictor(model, KnownPredictor(predictor=narx, name="a */ drive"))
    assert main(["export", str(model), "--c", str(source)]) == 0
    assert "axis_step()" in capsys.readouterr().out
    assert source.read_text().splitlines() == lines_of(narx)
    for option in (["--csv", "F.csv"], ["--c", "axis.c", "--from", "0 mm"]):
        assert main(["export", str(model), *option]) == 2
        assert "NARX network" in capsys.readouterr().err
