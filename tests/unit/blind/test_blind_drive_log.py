"""A drive's log: its force is that of a mass, friction, magnets and weight, in the units of physics."""

from dataclasses import replace

import numpy as np
import pytest

from rtec.blind.drive_log import bent_bristles
from rtec.blind.game import play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import OF_DRIVE, Scenario, unfit
from rtec.dataset.load import load_dataset

DRIVE = PLANS["drive"]


PLAN_OF = {"gravity": PLANS["joint"], "load_friction": PLANS["loads"]}


def columns(names, seed=2, plan=DRIVE):
    measurement, secret = play(Scenario(names=names, plan=plan), seed)
    numbers = {(h.name, p.name): p.value for h in secret.effects for p in h.parameters}
    return {quantity: column.values for quantity, column in measurement.columns.items()}, numbers, secret


def added(name, seed=2):
    plan = PLAN_OF.get(name, DRIVE)
    read, numbers, secret = columns((name,), seed, plan)
    bare, _, _ = columns((), seed, plan)
    force = "torque" if plan.rotary else "force"
    return read[force] - bare[force], read, {p: value for (_, p), value in numbers.items()}, secret


@pytest.mark.parametrize("name", OF_DRIVE)
def test_a_part_is_as_strong_as_its_secret_says(name):
    what, _, _, secret = added(name)
    assert np.sqrt(np.mean(what**2)) / DRIVE.sigma_n == pytest.approx(3.0, rel=0.01)
    assert secret.effects[0].rms_sigma == pytest.approx(3.0)


def test_a_mass_needs_a_newton_for_each_metre_per_second_squared():
    what, read, numbers, _ = added("inertia")
    acceleration = np.gradient(read["velocity"], read["time"]) * 1e-3
    slope = np.polyfit(acceleration, what, 1)[0]
    assert slope == pytest.approx(numbers["mass"], rel=0.03)


def test_oil_and_weight_and_magnets():
    what, read, numbers, _ = added("viscous")
    assert what == pytest.approx(numbers["viscous"] * 1e-3 * read["velocity"], abs=0.03)
    what, read, numbers, _ = added("force_offset")
    assert what == pytest.approx(numbers["force"], abs=0.011)
    what, read, numbers, _ = added("cogging")
    grid = np.arange(5.0, 30.0, 0.05)
    power = [abs(np.mean(what * np.exp(2j * np.pi * read["actual"] / period))) for period in grid]
    assert grid[int(np.argmax(power))] == pytest.approx(numbers["period"], abs=0.15)


def test_an_arm_has_the_torque_of_its_lever():
    what, read, numbers, _ = added("gravity")
    turned = np.radians(read["actual"] - numbers["hangs_at"])
    mass_kg, g = 2.0, 9.81
    reach_m = numbers["largest"] / (mass_kg * g)
    held = mass_kg * g * reach_m * np.sin(turned)  # force times the horizontal distance of the mass
    assert what == pytest.approx(held, abs=0.02)


def test_a_load_presses_on_its_guide():
    what, read, numbers, _ = added("load_friction")
    moving = np.abs(read["velocity"]) > 0.5
    expected = numbers["friction"] * read["load"] * np.sign(read["velocity"])
    assert what[moving] == pytest.approx(expected[moving], abs=0.02)
    assert np.unique(read["load"]).size == 3


def test_a_curve_of_forces_is_the_same_there_and_back():
    what, read, numbers, _ = added("force_map")
    place = np.round(read["actual"]).astype(int)
    spread = [np.ptp(what[place == k]) for k in np.unique(place) if (place == k).sum() > 3]
    assert np.ptp(what) == pytest.approx(numbers["peak_to_peak"], rel=0.15)
    assert np.median(spread) < 0.15 * np.ptp(what)


@pytest.mark.parametrize("name", ["coulomb", "stribeck"])
def test_friction_is_against_the_motion_and_falls_as_it_should(name):
    what, read, numbers, _ = added(name)
    speed = read["velocity"]
    moving = np.abs(speed) > 0.5
    level = np.exp(-((speed / numbers["speed"]) ** 2)) if name == "stribeck" else np.ones(speed.size)
    assert what[moving] == pytest.approx((numbers["friction"] * level * np.sign(speed))[moving], abs=0.02)


def test_bristles_bend_before_they_slip():
    velocity = np.concatenate([np.full(50, 1e-4), np.full(50, -1e-4)])
    bent = bent_bristles(velocity, 0.01)
    # first order over the distance gone, in units of the presliding distance of 1 nm
    assert bent[:50] == pytest.approx(1.0 - np.exp(-np.arange(1, 51)), abs=1e-9)
    assert bent[50:] == pytest.approx(-1.0 + (1.0 + bent[49]) * np.exp(-np.arange(1, 51)), abs=1e-9)


def test_soft_bristles_bend_over_the_distance_of_the_plan():
    plan = replace(PLANS["soft_drive"], presliding_mm=1.5, runs=1, targets=10, sigma_n=0.1)
    measurement, secret = play(Scenario(names=("coulomb",), strength_sigma=30.0, plan=plan), 2)
    numbers = {p.name: (p.value, p.unit) for p in secret.effects[0].parameters}
    assert numbers["over"] == (1.5, "mm")
    x = measurement.columns["actual"].values
    force = measurement.columns["force"].values / numbers["friction"][0]
    share = force[0]
    for step, seen in zip(np.diff(x), force[1:], strict=True):
        share = np.sign(step) - (np.sign(step) - share) * np.exp(-abs(step) / 1.5)
        assert share == pytest.approx(seen, abs=0.25)


def test_a_drive_log_loads_as_one():
    measurement, _ = play(Scenario(names=("inertia", "coulomb"), plan=DRIVE), 1)
    assert set(measurement.columns) == {"run", "time", "actual", "velocity", "force"}
    assert load_dataset(measurement).observe == "force"
    speeds = np.abs(measurement.columns["velocity"].values)
    for feed in DRIVE.feeds_mm_s:
        assert (np.abs(speeds - feed) < 1e-3).mean() > 0.02


def test_a_drive_hides_forces_and_an_axis_does_not():
    assert unfit("scale", DRIVE) == "it does not show in a force"
    assert unfit("inertia", PLANS["moving"]) == "it shows in the force of a drive only"
    assert unfit("gravity", DRIVE) == "it shows on a rotary axis only"
    assert unfit("load_friction", DRIVE) == "the load does not change"
    assert all(unfit(name, PLAN_OF.get(name, DRIVE)) is None for name in OF_DRIVE)
