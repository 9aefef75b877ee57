"""Erwinski et al. (2019) identified a linear motor by its logs; the same logs of the emulated one are read back.

Their figures: 3.61 kg at 39 N/A, so 92.56 mA a m/s²; cogging of 12 mm; 20 % below a straight line at 2 m/s; 500 mA
set the axis in motion.
"""

import re

import numpy as np
import pytest

import rtec
from rtec.axis.plants import LinearMotor, run_current, run_drive
from rtec.toolpath import butterfly
from rtec.toolpath.contouring import run_contour

NOISE_A = 0.005
INERTIA = "inertia_a_per_m_s2", 3.61 / 39.0


def identified(time_s, actual_mm, current_a, seed):
    noise = np.random.default_rng(seed).normal(0.0, NOISE_A, time_s.size)
    columns = {"time_s": time_s, "actual_mm": actual_mm, "current_a": current_a + noise}
    result = rtec.diagnose(rtec.read(columns, observe="current"))
    return {one["effect"]: one["params"] for one in result["candidates"] if one["accepted"]}


def is_right(params, name, value):
    error = params[f"{name}_error"]
    assert params[name] == pytest.approx(value, abs=3.0 * error, rel=1e-12)
    assert params[name] == pytest.approx(value, rel=0.02)


@pytest.mark.parametrize("seed", [1, 2])
def test_steps_of_2_a_tell_the_mass(seed):
    t = np.arange(0.0, 1.2, 0.25e-3)
    current = np.where(t % 0.2 < 0.1, 2.0, -2.0)
    is_right(identified(t, run_current(LinearMotor(), t, current).actual_mm, current, seed)["inertia"], *INERTIA)


def test_a_slow_travel_tells_the_cogging():
    t = np.arange(0.0, 20.0, 1e-3)
    run = run_drive(LinearMotor(), t, 5.0 * t)
    moving = t > 0.5
    found = identified(t[moving], run.actual_mm[moving], run.current_a[moving], 1)["cogging"]
    is_right(found, "period_mm", 12.0)
    is_right(found, "amplitude_1_a", 0.150)


def stroke(speed, way_mm, step_s):
    """Positions from rest to rest at a constant speed, with their limits of acceleration and jerk."""
    rise_s, bend_s = max(speed / 25_000.0, step_s), 0.05
    t = np.arange(0.0, way_mm / speed + rise_s + 2.0 * bend_s, step_s)
    trapezoid = np.clip(t / rise_s, 0.0, 1.0) - np.clip((t - way_mm / speed) / rise_s, 0.0, 1.0)
    samples = round(bend_s / step_s)
    return step_s * speed * np.cumsum(np.convolve(trapezoid, np.ones(samples) / samples)[: t.size])


def sweep_of_speeds(slowest, count, seconds, step_s=1e-3):
    """There and back at constant speeds up to 2 m/s, each for some seconds, a tenth of a second at rest between."""
    rest = np.zeros(round(0.1 / step_s))
    parts = [rest]
    for speed in np.geomspace(slowest, 2000.0, count):
        way_mm = min(1000.0, 12.0 * np.ceil(2.0 * speed / 12.0)) if speed > 1.2 else 10.0 * speed
        there = stroke(speed, way_mm, step_s)
        once = [there, rest + there[-1], there[-1] - there, rest]
        parts += once * max(1, int(np.ceil(seconds * speed / way_mm)))
    command = np.concatenate(parts)
    t = step_s * np.arange(command.size)
    run = run_drive(LinearMotor(), t, command)
    return t, run.actual_mm, run.current_a


@pytest.mark.parametrize(
    "slowest, count, seconds", [(1.0, 9, 1.0), pytest.param(0.1, 20, 2.0, marks=pytest.mark.sweep)]
)
def test_a_sweep_of_speeds_tells_a_friction_that_flattens(slowest, count, seconds):
    t, actual, current = sweep_of_speeds(slowest, count, seconds)
    noise = np.random.default_rng(1).normal(0.0, NOISE_A, t.size)
    result = rtec.diagnose(rtec.read({"time_s": t, "actual_mm": actual, "current_a": current + noise}))
    assert result["verdict"] in ("NAMED", "LIKELY")
    found, friction = result["final"], LinearMotor().friction
    planted = {
        ("coulomb", "coulomb"): friction.coulomb_n / 39.0,
        ("stribeck", "stribeck"): (friction.static_n - friction.coulomb_n) / 39.0,
        ("stribeck", "speed"): friction.stribeck_mm_s,
        ("viscous", "viscous"): friction.viscous_n_s_m / 39.0,
        ("viscous", "fade"): friction.fade_mm_s,
    }
    value = {}
    for (effect, name), truth in planted.items():
        value[name], error, _ = found[effect][name]
        assert value[name] == pytest.approx(truth, abs=3.0 * error), name
    speeds = np.geomspace(slowest, 2000.0, 50)
    curve = value["coulomb"] + value["stribeck"] * np.exp(-((speeds / value["speed"]) ** 2))
    curve += 1e-3 * value["viscous"] * speeds / (1.0 + (speeds / value["fade"]) ** 2)
    assert curve == pytest.approx(friction.steady_n(speeds) / 39.0, rel=0.02)
    (note,) = [note for note in result["notes"] if note.startswith("breakaway: ")]
    value, error = map(float, re.findall(r"[0-9.]+", note)[:2])
    assert value == pytest.approx(0.5, abs=min(3.0 * error, 0.01))


def test_the_log_of_a_path_names_what_the_drive_has():
    run = run_contour(butterfly(), "linear-motor").axes["x"]
    found = identified(run.time_s, run.actual_mm, run.current_a, 1)
    assert set(found) >= {"inertia", "coulomb", "viscous"}
    is_right(found["inertia"], *INERTIA)
