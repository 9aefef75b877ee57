"""Erwinski et al. (2019) identified a linear motor by its logs; the same logs of the emulated one are read back.

Their figures: 3.61 kg at 39 N/A, so 92.56 mA a m/s²; cogging of 12 mm.
"""

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


def test_the_log_of_a_path_names_what_the_drive_has():
    run = run_contour(butterfly(), "linear-motor").axes["x"]
    found = identified(run.time_s, run.actual_mm, run.current_a, 1)
    assert set(found) >= {"inertia", "coulomb", "viscous"}
    is_right(found["inertia"], *INERTIA)
