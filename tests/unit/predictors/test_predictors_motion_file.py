"""Files of models of motion: the same numbers again, and what is refused."""

import numpy as np
import pytest

from rtec.errors import ArgumentError, FileFormatError, RtecError
from rtec.predictors import Narx, NarxShape, Sequences, read_predictor
from rtec.predictors.drive_model import DriveModel
from rtec.predictors.linear_models import Arx, Held, ServoLag
from rtec.predictors.model_sum import ModelSum
from rtec.predictors.motion_file import KnownMotion, head_of, is_motion_file, read_motion, write_motion

KIND = {"names": ("velocity", "acceleration"), "period_s": 1.0 / 3.0e3, "unit": "um"}
DRAW = np.random.default_rng(0)
SHAPE = NarxShape(channels=2, neurons=3, input_delays=(0, 2), feedback_delays=(1, 3), linear=False)
NARX = Narx(
    shape=SHAPE, **KIND, middle=[0.0, 0.1, 0.2], half=[1.0, 2.0, 3.0], weights=DRAW.normal(0.0, 0.3, SHAPE.weights)
)
DRIVE = DriveModel(**KIND, output_per_error=1e3, stiffness=1.0e4 / 3.0, damping=70.0, coulomb=3.0, width=0.1)
MODELS = {
    "arx": Arx(**KIND, feedback=DRAW.normal(size=2) / 3.0, forward=DRAW.normal(size=(2, 3)), constant=0.1),
    "servo lag": ServoLag(**KIND, constant=0.1, per_velocity=1.0 / 3.0, per_acceleration=-0.2),
    "drive": DRIVE,
    "narx": NARX,
    "sum": ModelSum(parts=(DRIVE, NARX)),
}


def known(model, **more):
    return KnownMotion(model=model, head=head_of(model, "deviation"), name="mine", source="log.csv", **more)


@pytest.mark.parametrize("kind", MODELS)
def test_a_model_comes_back_with_the_same_numbers(tmp_path, kind):
    model = MODELS[kind]
    write_motion(tmp_path / "m.toml", known(model, interval=1.0 / 3.0, axis=2))
    assert f'predictor = "{kind}"' in (tmp_path / "m.toml").read_text()
    assert is_motion_file(tmp_path / "m.toml")
    back = read_motion(tmp_path / "m.toml")
    assert (back.head, back.name, back.source) == (head_of(model, "deviation"), "mine", "log.csv")
    assert (back.interval, back.axis) == (1.0 / 3.0, 2)
    data = Sequences(inputs=DRAW.normal(size=(50, 2)), output=DRAW.normal(size=50), **KIND)
    assert np.array_equal(back.model.free_run(data), model.free_run(data), equal_nan=True)
    # the reader of all predictors knows it too, but not as one of positions
    assert type(read_predictor(tmp_path / "m.toml").predictor) is type(model)
    with pytest.raises(ArgumentError, match="a model of motion predicts sample by sample"):
        _ = read_predictor(tmp_path / "m.toml").of_position


@pytest.mark.parametrize(
    ("kind", "found", "instead", "message"),
    [
        ("arx", "version = 1", "version = 2", "train it again"),
        ("arx", 'predictor = "arx"', 'predictor = "arxx"', '"arx" or'),
        ("arx", "constant = 0.1", "konstant = 0.1", "unknown key"),
        ("arx", "constant = 0.1", "", "no 'constant'"),
        ("arx", "forward = [[", "forward = [[1.0], [", "forward"),
        ("arx", 'inputs = ["velocity", "acceleration"]', 'inputs = ["command"]', "forward"),
        ("arx", 'period = "', 'period = "-', "period"),
        ("drive", "width = 0.1", "width = 0.0", "width"),
        ("drive", "gains = []", "gains = [1.0]", "gains"),
        ("narx", "neurons = 3", "neurons = 4", "weights"),
        ("sum", '[[part]]\npredictor = "drive"', '[[part]]\npredictor = "sum"', "is not valid"),
    ],
)
def test_a_file_that_cannot_be_says_what_is_wrong(tmp_path, kind, found, instead, message):
    file = tmp_path / "m.toml"
    write_motion(file, known(MODELS[kind]))
    text = file.read_text()
    assert found in text
    file.write_text(text.replace(found, instead))
    with pytest.raises(RtecError, match=message) as error:
        read_motion(file)
    assert str(file) in str(error.value) or kind in ("drive", "arx")


def test_what_has_no_file_is_refused(tmp_path):
    with pytest.raises(ArgumentError, match="Held"):
        write_motion(tmp_path / "m.toml", KnownMotion(model=Held(), head=head_of(NARX), name="held"))
    with pytest.raises(ArgumentError, match="Held"):
        head_of(Held())
    (tmp_path / "e.toml").write_text('observe = "deviation"\n')
    assert not is_motion_file(tmp_path / "e.toml")
    with pytest.raises(FileFormatError, match="predictor = None"):
        read_motion(tmp_path / "e.toml")
