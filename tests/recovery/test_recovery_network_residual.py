"""What a model that knows no position leaves of the log of a ball screw: "ball-screw runout" (Erwinski et al. 2016).

The emulated screw has a runout, a torque ripple, or neither; what is planted is read back from the residual.
"""

import numpy as np
import pytest

from rtec.axis.plants import BallScrew, run_drive
from rtec.axis.plants.ball_screw import ScrewRunout, TorqueRipple
from rtec.dataset.dynamic_log import dynamic_log
from rtec.dataset.load import load_dataset
from rtec.dataset.motion_residual import residual_dataset
from rtec.effects import LIBRARY, Library, effect_named
from rtec.effects.library import OF_LOOP
from rtec.inference.diagnose import diagnose
from rtec.inference.results import Verdict
from rtec.metrology import measurement_of_columns
from rtec.predictors.fitting.linear_models import fit_arx, free_run_rms
from rtec.predictors.fitting.narx import fit_narx
from rtec.predictors.motion_file import KnownMotion, head_of
from rtec.toolpath import random_path
from rtec.toolpath.contouring import run_contour

STEP_S = 2e-3
RUNOUT = ScrewRunout(amplitude_um=3.0, phase_deg=40.0)
PITCH = {"screw_pitch": "10 mm"}
FEW = Library(tuple(map(effect_named, ("cyclic", "reversal_spike", "servo_lag", "acceleration_lag"))))
"""A search among few effects is quick; among all of them it finds the same."""


def command(seconds=10.0):
    """A smooth motion to and fro, at up to 250 mm/s."""
    t = np.arange(0.0, seconds, STEP_S)
    rise = 1.0 - np.exp(-((t / 1.0) ** 2))
    return t, rise * (90.0 * np.sin(2 * np.pi * 0.31 * t) + 15.0 * np.sin(2 * np.pi * 0.83 * t + 0.4))


def logged(t, target, actual, seed):
    noise = np.random.default_rng(seed).normal(0.0, 5e-4, t.size)
    return measurement_of_columns({"time_s": t, "target_mm": target, "actual_mm": actual + noise}, facts=PITCH)


def log_of(once_a_turn, seed=1):
    t, target = command()
    return logged(t, target, run_drive(BallScrew(once_a_turn=once_a_turn), t, target).actual_mm, seed)


def linear(measurement):
    data = dynamic_log(measurement).sequences
    model = fit_arx(data.part(0, len(data) // 2), 4, 2)
    return KnownMotion(model=model, head=head_of(model), name="ARX"), data


def diagnosed(once_a_turn):
    measurement = log_of(once_a_turn)
    return diagnose(residual_dataset(linear(measurement)[0], measurement, library=FEW))


def numbers(found, name):
    """The values of an accepted effect in the model found, as people read them."""
    term = next(term for term in found.model.terms if term.name == name)
    return {key: value for key, value, _ in term.effect.summary(term.shape, term.amplitudes, found.model.units)}


@pytest.fixture(scope="module")
def runout():
    return diagnosed(RUNOUT)


def test_a_runout_is_read_from_what_the_model_leaves(runout):
    found = numbers(runout, "screw_runout")
    assert found["amplitude_1"] == pytest.approx(3.0, rel=0.05)
    assert found["period"] == pytest.approx(10.0, rel=1e-3)
    assert found["phase_1"] == pytest.approx(40.0, abs=5.0)
    assert found["position_loop"] == pytest.approx(1.0 / BallScrew().cascade.position_gain_per_s, rel=0.15)
    assert "torque_ripple" not in runout.effects


def test_with_the_runout_no_more_is_left_than_of_a_screw_without(runout):
    """The floor: what such a model leaves, on samples it has not seen, of the same screw run true."""
    known, data = linear(log_of(None))
    floor_um = free_run_rms(known.model, data.part(len(data) // 2, len(data)))
    step = next(step for step in runout.steps if step.effect == "screw_runout")
    assert 1e3 * step.rms_heldout < 1.1 * floor_um
    assert 1e3 * runout.rms_before > 1.5 * floor_um


def test_a_torque_ripple_is_no_runout():
    found = diagnosed(TorqueRipple(amplitude_nm=0.1))
    assert "torque_ripple" in found.effects
    assert "screw_runout" not in found.effects


def test_a_true_screw_has_neither():
    assert not {"screw_runout", "torque_ripple", "cyclic"} & set(diagnosed(None).effects)


def test_at_one_speed_nobody_can_tell():
    t = np.arange(0.0, 6.0, 4e-3)
    wave = 2e-3 * np.sin(2 * np.pi * 10.0 * t + 0.4) + np.random.default_rng(0).normal(0.0, 5e-4, t.size)
    columns = {"time_s": t, "target_mm": 100.0 * t, "deviation_mm": wave}
    data = load_dataset(measurement_of_columns(columns, facts=PITCH), library=FEW.with_own(OF_LOOP))
    found = diagnose(data)
    tied = {name for one in found.candidates for name in one.tied_with}
    assert found.verdict is Verdict.TIED
    assert tied == {"cyclic", "screw_runout", "torque_ripple"}
    assert "several constant speeds from creep to the highest" in found.experiment.text


@pytest.mark.sweep
def test_among_all_effects_it_is_the_same():
    measurement = log_of(RUNOUT)
    found = diagnose(residual_dataset(linear(measurement)[0], measurement, library=LIBRARY))
    assert numbers(found, "screw_runout")["amplitude_1"] == pytest.approx(3.0, rel=0.05)
    assert "torque_ripple" not in found.effects


@pytest.mark.sweep
def test_a_network_that_was_trained_on_a_random_path_leaves_the_runout():
    """As Erwinski et al. (2016): a random path within their limits, the first half trains."""
    run = run_contour(random_path(seed=0), "ball-screw").axes["x"]
    measurement = logged(run.time_s, run.command_mm, run.actual_mm, 1)
    data = dynamic_log(measurement).sequences
    fitted = fit_narx(
        data.part(0, len(data) // 2),
        neurons=[8],
        input_delays=range(4),
        feedback_delays=range(1, 5),
        starts=2,
        seed=0,
        validation=0.25,
    )
    known = KnownMotion(model=fitted.narx, head=head_of(fitted.narx), name="NARX")
    found = numbers(diagnose(residual_dataset(known, measurement)), "screw_runout")
    assert found["amplitude_1"] == pytest.approx(3.0, rel=0.05)
    assert found["period"] == pytest.approx(10.0, rel=1e-3)
