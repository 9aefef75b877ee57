"""rtec diagnose LOG --model MOTION.toml: what a model of motion leaves is explained."""

import contextlib
import io
import json

import numpy as np
import pytest

import rtec
from rtec.cli import main
from rtec.predictors.linear_models import ServoLag
from rtec.predictors.motion_file import KnownMotion, head_of, write_motion

PLAY_UM = 6.0


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """An axis that lags 16 ms behind its velocity, which the model knows, and has a play, which it does not."""
    folder = tmp_path_factory.mktemp("motion")
    t = 4e-3 * np.arange(2000)
    target = 30.0 * np.sin(1.1 * t) + 8.0 * np.sin(4.3 * t)
    speed = 33.0 * np.cos(1.1 * t) + 34.4 * np.cos(4.3 * t)
    noise = np.random.default_rng(1).normal(0.0, 5e-4, t.size)
    behind = target - 0.016 * speed
    actual = behind + 0.5e-3 * PLAY_UM * np.sign(np.gradient(behind)) + noise
    rows = (f"{a:.6f},{b:.7f},{c:.7f}" for a, b, c in zip(t, target, actual, strict=True))
    (folder / "log.csv").write_text("\n".join(["time_s,target_mm,actual_mm", *rows]) + "\n")
    lag = ServoLag(names=("velocity", "acceleration"), period_s=4e-3, unit="um", per_velocity=16.0)
    write_motion(folder / "lag.toml", KnownMotion(model=lag, head=head_of(lag), name="servo lag"))
    write_motion(folder / "force.toml", KnownMotion(model=lag, head=head_of(lag, "force"), name="of a force"))
    return folder


def said(*words):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([*map(str, words)])
    return code, out.getvalue(), err.getvalue()


def test_the_effects_of_what_is_left_are_named_and_the_lag_that_is_known_is_not(files):
    code, out, _ = said("diagnose", files / "log.csv", "--model", files / "lag.toml", "--json")
    found = json.loads(out)
    assert code == 0
    assert "servo_lag" not in found["effects"]
    assert abs(found["final"]["backlash"]["backlash"][0]) == pytest.approx(PLAY_UM, rel=0.05)
    assert found["rms_before"] == pytest.approx(PLAY_UM / 2.0, rel=0.05)
    assert rtec.diagnose(files / "log.csv", model=files / "lag.toml")["final"] == found["final"]
    assert found["notes"][0] == "explained is what servo lag leaves of the following error in free run"


@pytest.mark.parametrize(
    "model, words, reason",
    [
        ("lag.toml", ["--observe", "current"], "--observe does not go with a model of motion"),
        ("force.toml", [], "use a model of following_error or deviation"),
    ],
)
def test_what_does_not_fit_is_refused(files, model, words, reason):
    code, _, err = said("diagnose", files / "log.csv", "--model", files / model, *words)
    assert code == 2
    assert reason in err
