"""Models of motion side by side: known systems, an honest choice, and what goes wrong."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtec.dataset.dynamic_log import dynamic_log
from rtec.errors import ArgumentError
from rtec.metrology import column_choices, measurement_of_columns
from rtec.predictors import Narx, NarxShape, Sequences
from rtec.predictors.linear_models import Arx, Held
from rtec.training.compare_dynamic import compare_dynamic
from rtec.training.dynamic_methods import DynamicFit, DynamicMethod, dynamic_methods
from rtec.training.dynamic_results import DynamicKind
from rtec.training.free_run import comes_back, free_run_of

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="the measurements of real machines are not there")
SAMPLES, NOISE = 1200, 0.01
QUICK = {method.name: method for method in dynamic_methods() if not method.is_network}
NETWORKS = [method for method in dynamic_methods() if method.is_network]


def log_of(**columns):
    return dynamic_log(measurement_of_columns(columns), observe="level" if "level_v" in columns else None)


def first_order(samples=SAMPLES, seed=0, gain=1.0):
    """A tank: y(t) = 0.9 y(t - 1) + 0.1 u(t - 1), read with a little noise."""
    rng = np.random.default_rng(seed)
    u = gain * np.repeat(rng.uniform(-1.0, 1.0, samples // 20), 20)
    y = np.zeros(samples)
    for t in range(1, samples):
        y[t] = 0.9 * y[t - 1] + 0.1 * u[t - 1]
    return log_of(time_s=np.arange(samples), command_v=u, level_v=y + rng.normal(0.0, NOISE, samples))


def servo(samples=SAMPLES):
    """An axis that lags 16 ms behind its velocity, read with a noise of 1 um."""
    t = 1e-3 * np.arange(samples)
    noise = 1e-3 * np.random.default_rng(4).normal(size=samples)
    path, speed = 9.0 * np.sin(7.0 * t) + np.sin(31.0 * t), 63.0 * np.cos(7.0 * t) + 31.0 * np.cos(31.0 * t)
    return log_of(time_s=t, command_mm=path, actual_mm=path - 0.016 * speed + noise)


def method(name, fit, kind=DynamicKind.LINEAR):
    return DynamicMethod(name=name, kind=kind, fit=fit)


def test_a_first_order_system_is_found_down_to_its_noise():
    result = compare_dynamic(first_order(), methods=list(QUICK.values()))
    assert result.samples == {"train": 450, "validation": 150, "heldout": 600}
    found = result.named("ARX")
    assert result.chosen == "ARX"
    assert found.rms_heldout == pytest.approx(NOISE, rel=0.3)
    assert found.rms_first_tenth == pytest.approx(NOISE, rel=0.5)
    assert found.rms_last_tenth == pytest.approx(NOISE, rel=0.5)
    assert found.coverage == pytest.approx(0.9, abs=0.05)
    assert found.stable
    assert found.works
    level = result.log.sequences.output
    assert result.named("mean").rms_heldout == pytest.approx(
        np.sqrt(np.mean((level[600:] - level[:600].mean()) ** 2))
    )
    assert result.named("persistence").rms_heldout == pytest.approx(np.sqrt(np.mean((level[601:] - level[600]) ** 2)))
    for name in ("servo lag", "physical"):
        assert "no error of an axis" in result.named(name).reason
        assert result.named(name).rms_heldout is None


def test_a_lagging_servo_is_chosen_where_it_is_enough():
    log = servo()
    result = compare_dynamic(log, methods=list(QUICK.values()))
    found = result.named("servo lag")
    assert result.chosen == "servo lag"
    assert found.rms_heldout == pytest.approx(1.0, rel=0.2)
    assert found.notes[0].startswith("16 ms (16 samples)")
    assert "shifted against each other" in found.notes[0]
    assert result.named("physical").rms_heldout < 2.0 < 0.01 * np.std(log.sequences.output)


def test_networks_learn_the_system_too_within_their_budget():
    result = compare_dynamic(first_order(), methods=NETWORKS, starts=1, budget_s=20.0)
    network, hybrid = result.rows
    assert network.rms_heldout == pytest.approx(NOISE, rel=0.5)
    assert network.parameters in (49, 89)
    assert hybrid.reason == "the output is no error of an axis whose command is known"
    ended = compare_dynamic(first_order(), methods=NETWORKS, budget_s=0.0)
    assert any(note.startswith("--budget ended its training") for note in ended.rows[0].notes)
    assert ended.rows[0].rms_heldout > network.rms_heldout
    assert not ended.interrupted


def test_physics_and_a_network_together_are_no_worse_than_physics():
    methods = [QUICK["physical"], *(method for method in NETWORKS if method.kind is DynamicKind.HYBRID)]
    result = compare_dynamic(servo(), methods=methods, starts=1, budget_s=20.0)
    assert result.named("hybrid").rms_heldout < 1.3 * result.named("physical").rms_heldout


def test_fewer_samples_than_weights_are_a_reason():
    result = compare_dynamic(first_order(100), methods=NETWORKS[:1], starts=1)
    assert "49 weights" in result.rows[0].reason
    with pytest.raises(ArgumentError, match="80 or more"):
        compare_dynamic(first_order(60), methods=[])


def test_the_training_part_alone_chooses():
    """What happens in the unseen half changes figures, and not the choice."""
    log = first_order()
    other = first_order(seed=1, gain=30.0).sequences
    data = log.sequences
    half = np.arange(SAMPLES) < SAMPLES // 2
    changed = replace(
        data,
        inputs=np.where(half[:, None], data.inputs, other.inputs),
        output=np.where(half, data.output, -other.output),
    )
    methods = [QUICK["mean"], QUICK["ARX"]]
    honest = compare_dynamic(log, methods=methods)
    fooled = compare_dynamic(replace(log, sequences=changed), methods=methods)
    assert honest.chosen == fooled.chosen == "ARX"
    assert fooled.named("ARX").rms_train == honest.named("ARX").rms_train
    assert fooled.ranked[0].name == "mean"
    assert any("times worse" in note for note in fooled.notes)
    assert any("outside its trained values of command" in note for note in fooled.notes)
    assert not any("times worse" in note for note in honest.notes)


def test_of_models_that_are_as_good_the_smaller_one_is_chosen():
    def fitted(feedback):
        def fit(task):
            model = Arx(
                names=task.train.names,
                period_s=task.train.period_s,
                unit="V",
                feedback=feedback,
                forward=[[0.0, 0.1]],
            )
            return DynamicFit(model=model, judged=model)

        return fit

    methods = [method("large", fitted([0.9, 0.0, 0.0])), method("small", fitted([0.9]))]
    assert compare_dynamic(first_order(), methods=methods).chosen == "small"


def test_what_does_not_come_back_from_a_moved_start_is_not_chosen():
    def best_but_fickle(task):
        model = QUICK["ARX"].fit(task).model
        return DynamicFit(model=model, judged=model, holds=False)

    def poor(task):
        train = task.train
        model = Arx(names=train.names, period_s=train.period_s, unit="V", feedback=[0.5], forward=[[0.1]])
        return DynamicFit(model=model, judged=model)

    result = compare_dynamic(first_order(), methods=[method("fickle", best_but_fickle), method("poor", poor)])
    assert result.chosen == "poor"
    assert result.ranked[0].name == "fickle"


def test_a_model_with_two_motions_for_one_input_does_not_come_back():
    """y(t) = 1.5 tanh(y(t - 1)) rests at +1.29 and at -1.29; its free run over its own data shows nothing."""
    shape = NarxShape(channels=1, neurons=1, input_delays=(0,), feedback_delays=(1,), linear=False)
    scale = {"middle": [0.0, 0.0], "half": [1.0, 1.0]}
    kind = {"names": ("command",), "period_s": 1.0, "unit": "um"}
    u = 0.1 * np.sin(0.05 * np.arange(2000.0))[:, None]
    start = Sequences(inputs=u, output=np.repeat([1.0, -1.0], 1000), starts=(0, 1000), **kind)
    for gain, holds in ((1.5, False), (0.9, True)):
        narx = Narx(shape=shape, **kind, **scale, weights=[1.0, 1.0, 0.0, gain, 0.0])
        own = replace(start, output=narx.free_run(start))
        assert free_run_of(narx, own).rms == pytest.approx(0.0, abs=1e-9)
        assert comes_back(narx, own) is holds


def test_a_row_that_diverges_says_so_and_the_others_go_on():
    def diverges(task):
        train = task.train
        model = Arx(names=train.names, period_s=train.period_s, unit="V", feedback=[1.5], forward=[[0.1]])
        return DynamicFit(model=model, judged=model)

    def refuses(task):
        raise ArgumentError("this", "one thing", "another")

    result = compare_dynamic(first_order(), methods=[method("wild", diverges), method("no", refuses), QUICK["ARX"]])
    assert "diverges" in result.named("wild").reason
    assert not result.named("wild").stable
    assert "use another" in result.named("no").reason
    assert result.chosen == "ARX"
    assert [row.name for row in result.ranked] == ["ARX", "wild", "no"]


def test_ctrl_c_keeps_what_was_found():
    def interrupted(task):
        raise KeyboardInterrupt

    def early(task):
        return DynamicFit(model=Held(), judged=Held(), interrupted=True)

    methods = [QUICK["mean"], method("slow", interrupted), QUICK["ARX"]]
    result = compare_dynamic(first_order(), methods=methods)
    assert result.interrupted
    assert result.named("mean").rms_heldout is not None
    assert [row.reason for row in result.rows[1:]] == ["ended before it was fitted", "ended before its turn"]
    assert compare_dynamic(first_order(), methods=[method("early", early)]).interrupted


def test_another_log_judges_in_place_of_the_second_half():
    log, other = first_order(), first_order(400, seed=5)
    result = compare_dynamic(log, other, methods=[QUICK["ARX"]])
    assert result.samples == {"train": 900, "validation": 300, "heldout": 400}
    assert result.rows[0].rms_heldout == pytest.approx(free_run_of(result.rows[0].model, other.sequences).rms)
    assert result.heldout_by == other.measurement.source


def test_speeds_beyond_the_trained_ones_are_said():
    t = 1e-3 * np.arange(1000)
    path = np.where(t < 0.5, np.sin(20.0 * t), np.sin(10.0) + 2.0 * np.sin(20.0 * (t - 0.5)))
    log = log_of(time_s=t, command_mm=path, actual_mm=path + 0.1 * np.sin(9.0 * t))
    notes = compare_dynamic(log, methods=[QUICK["mean"]]).notes
    assert any(note.startswith("network asked outside its trained speeds: -20") for note in notes)
    calm = compare_dynamic(servo(), methods=[QUICK["mean"]]).notes
    assert "the unseen part stays within the trained speeds" in calm


@needs_shared
def test_a_real_drive_in_free_run_over_its_unseen_half():
    """EMPS: 1.5 um is asked of physics; an ARX model leaves 7."""
    log = dynamic_log(SHARED / "emps_train.csv")
    result = compare_dynamic(log, methods=[QUICK["ARX"], QUICK["physical"]])
    assert result.chosen == "physical"
    assert result.named("physical").rms_heldout < 1.3
    assert 5.0 < result.named("ARX").rms_heldout < 8.0
    pulses = compare_dynamic(log, dynamic_log(SHARED / "emps_pulses.csv"), methods=[QUICK["servo lag"]])
    assert pulses.rows[0].rms_heldout == pytest.approx(93.4, abs=0.5)


@needs_shared
def test_pulses_on_a_real_drive_once_the_voltage_is_an_input():
    log = dynamic_log(SHARED / "emps_pulses.csv", choices=column_choices(["pulse_v=voltage_v"]))
    result = compare_dynamic(log, methods=[QUICK["physical"]])
    assert result.rows[0].rms_heldout < 1.5


@needs_shared
@pytest.mark.sweep
@pytest.mark.parametrize(("kind", "most_um"), [(DynamicKind.NETWORK, 4.5), (DynamicKind.HYBRID, 1.5)])
def test_networks_on_a_real_drive(kind, most_um):
    log = dynamic_log(SHARED / "emps_train.csv")
    result = compare_dynamic(log, methods=[each for each in NETWORKS if each.kind is kind], starts=2, budget_s=None)
    assert result.rows[0].rms_heldout < most_um
