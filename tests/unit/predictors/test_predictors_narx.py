"""NARX networks: what they predict beside plain numpy, their memory, their files, and whether they hold."""

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.predictors import KnownPredictor, Narx, NarxShape, Sequences, read_predictor, stability, write_predictor


def narx(*, linear=True, channels=2, neurons=5, inputs=(0, 2), feedback=(1, 3), scale=0.4, seed=1):
    shape = NarxShape(
        channels=channels, neurons=neurons, input_delays=inputs, feedback_delays=feedback, linear=linear
    )
    draw = np.random.default_rng(seed)
    return Narx(
        shape=shape,
        names=("velocity", "current")[:channels],
        period_s=1e-3,
        middle=draw.uniform(-1.0, 1.0, channels + 1),
        half=draw.uniform(0.5, 2.0, channels + 1),
        weights=draw.normal(0.0, scale, shape.weights),
    )


def sequences(model, samples, starts=(0,), seed=2):
    draw = np.random.default_rng(seed)
    inputs = draw.uniform(-1.0, 1.0, (samples, len(model.names)))
    return Sequences(
        inputs=inputs, output=draw.uniform(-1.0, 1.0, samples), names=model.names, period_s=1e-3, starts=starts
    )


def plain(model, run):
    """Return the free run by the definition, sample by sample."""
    shape, neurons = model.shape, model.shape.neurons
    begin = neurons * (shape.taps + 1)
    hidden, (outer, (bias, *direct)) = (
        model.weights[:begin].reshape(-1, neurons),
        (model.weights[begin : begin + neurons], model.weights[begin + neurons :]),
    )
    x = (run.inputs - model.middle[:-1]) / model.half[:-1]
    y = (run.output - model.middle[-1]) / model.half[-1]
    for t in range(model.lags, len(y)):
        taps = [x[t - d, c] for c in range(shape.channels) for d in shape.input_delays]
        taps = np.array(taps + [y[t - d] for d in shape.feedback_delays])
        y[t] = bias + outer @ np.tanh(taps @ hidden[:-1] + hidden[-1]) + (np.array(direct) @ taps if direct else 0.0)
    return y * model.half[-1] + model.middle[-1]


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("neurons", [1, 5, 8, 12])
def test_a_free_run_is_that_of_the_definition(linear, neurons):
    model = narx(linear=linear, neurons=neurons)
    data = sequences(model, 400, starts=(0, 150, 152))
    expected = np.concatenate([plain(model, run) for run in data.runs()])
    assert model.free_run(data) == pytest.approx(expected, abs=1e-12)


def test_the_papers_networks_have_their_numbers_of_weights():
    sizes = [
        NarxShape(channels=1, neurons=n, input_delays=range(i), feedback_delays=range(1, k + 1), linear=False).weights
        for n, i, k in ((12, 4, 4), (6, 5, 4))
    ]
    assert sizes == [121, 67]


def test_no_measured_output_behind_the_lags_is_looked_at():
    model = narx()
    data = sequences(model, 100)
    other = Sequences(
        inputs=data.inputs, output=np.append(data.output[:3], np.full(97, 9.0)), names=data.names, period_s=1e-3
    )
    assert np.array_equal(model.free_run(data), model.free_run(other))


def test_step_by_step_it_is_the_free_run():
    model = narx()
    data = sequences(model, 60)
    state = model.at_rest(data.inputs[0], 0.3)
    for t in range(model.lags):
        model.remember(state, data.inputs[t], data.output[t])
    found = [model.step(state, data.inputs[t]) for t in range(model.lags, 60)]
    assert found == pytest.approx(model.free_run(data)[model.lags :], abs=1e-12)


def test_what_has_diverged_is_no_number():
    model = narx(scale=0.0)
    model.weights.setflags(write=True)
    model.weights[-2] = 1.5
    data = sequences(model, 200)
    found = model.free_run(data)
    assert np.isfinite(found[:3]).all()
    assert np.isnan(found[-1])
    judged = stability(model, data)
    assert not judged.stable
    assert judged.growth == np.inf


@pytest.mark.parametrize("linear", [True, False])
def test_a_file_gives_back_the_same_numbers(tmp_path, linear):
    model = narx(linear=linear)
    write_predictor(tmp_path / "m.toml", KnownPredictor(predictor=model, name="drive", source="log.csv", axis=2))
    known = read_predictor(tmp_path / "m.toml")
    data = sequences(model, 50)
    assert (known.name, known.source, known.axis) == ("drive", "log.csv", 2)
    assert (known.predictor.shape, known.predictor.names, known.predictor.unit) == (model.shape, model.names, "um")
    assert np.array_equal(known.predictor.free_run(data), model.free_run(data))


@pytest.mark.parametrize(
    ("line", "instead", "said"),
    [
        ("neurons = 5", "neurons = 6", "weights"),
        ("feedback_delays = [1, 3]", "feedback_delays = [0, 3]", "feedback_delays"),
        ("linear = true", "linear = 1", "linear"),
        ('period = "0.001 s"', 'period = "0 s"', "period"),
        ('inputs = ["velocity", "current"]', 'inputs = ["velocity"]', "middle|weights"),
        ('unit = "um"', 'range = ["0 mm", "1 mm"]', "range"),
    ],
)
def test_a_file_that_cannot_be_is_refused_by_its_key(tmp_path, line, instead, said):
    file = tmp_path / "m.toml"
    write_predictor(file, KnownPredictor(predictor=narx(), name="drive"))
    text = file.read_text()
    assert line in text
    file.write_text(text.replace(line, instead))
    with pytest.raises(ValueError, match=said) as error:
        read_predictor(file)
    assert str(file) in str(error.value)


def test_a_network_of_motion_is_no_curve_of_position(tmp_path):
    known = KnownPredictor(predictor=narx(), name="drive")
    with pytest.raises(ArgumentError, match="over position"):
        _ = known.of_position


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"names": ("velocity", "force")}, "inputs"),
        ({"period_s": 2e-3}, "period_s"),
        ({"unit": "mm"}, "unit"),
    ],
)
def test_other_data_than_those_of_the_training_are_refused(change, said):
    data = {"inputs": np.ones((9, 2)), "output": np.zeros(9), "names": ("velocity", "current"), "period_s": 1e-3}
    with pytest.raises(ArgumentError, match=said):
        narx().free_run(Sequences(**(data | change)))


def linear_model(*feedback):
    """A recurrence whose eigenvalues are known."""
    shape = NarxShape(channels=1, neurons=1, input_delays=(0,), feedback_delays=range(1, len(feedback) + 1))
    weights = np.zeros(shape.weights)
    weights[-len(feedback) - 1 :] = [1.0 - sum(feedback), *feedback]
    return Narx(shape=shape, names=("velocity",), period_s=1e-3, middle=[0.0, 0.0], half=[1.0, 1.0], weights=weights)


@pytest.mark.parametrize(
    ("poles", "stable"), [((0.9, -0.5), True), ((0.5 + 0.6j, 0.5 - 0.6j), True), ((1.0, 0.2), False)]
)
def test_the_largest_modulus_is_that_of_the_poles(poles, stable):
    _, *feedback = -np.poly(poles)
    model = linear_model(*feedback)
    data = sequences(model, 3000)
    data = Sequences(inputs=data.inputs, output=model.free_run(data), names=data.names, period_s=1e-3)
    found = stability(model, data)
    assert found.largest_modulus == pytest.approx(np.abs(poles).max(), rel=1e-9)
    assert found.rms_last_tenth == 0.0
    assert found.stable is stable


def test_a_model_that_drifts_off_is_not_stable():
    model = linear_model(0.9)
    inputs = np.sin(np.arange(3000.0) / 9.0)[:, None]
    data = Sequences(inputs=inputs, output=np.zeros(3000), names=("velocity",), period_s=1e-3)
    truth = model.free_run(data) + 1e-3
    drifting = truth + np.linspace(0.0, 2.0, 3000)
    assert stability(model, Sequences(inputs=inputs, output=truth, names=("velocity",), period_s=1e-3)).stable
    found = stability(model, Sequences(inputs=inputs, output=drifting, names=("velocity",), period_s=1e-3))
    assert not found.stable
    assert found.rms_last_tenth == pytest.approx(1.9, abs=0.05)


def test_a_run_too_short_to_judge_is_refused():
    model = narx()
    with pytest.raises(ArgumentError, match="longest run"):
        stability(model, sequences(model, 40, starts=(0, 20)))
