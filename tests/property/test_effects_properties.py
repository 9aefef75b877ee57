"""What holds for every plan: invariances that the cards promise, parts of readings."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from rtec.effects import LIBRARY, BuildUpShape, Conditions, CyclicShape, HeatShape, Shape, effect_named
from rtec.effects.gravity import GravityShape
from rtec.effects.hysteresis import HysteresisShape
from rtec.effects.lost_counts import StepShape
from rtec.effects.quantisation import rounding_error
from rtec.effects.reversal_spike import SpikeShape
from rtec.effects.run_offset import RunShape
from rtec.effects.stribeck import StribeckShape
from rtec.effects.thermal_growth import GrowthShape
from rtec.effects.viscous import ViscousShape
from rtec.effects.warm_up import WarmShape
from rtec.effects.warm_up_growth import WarmGrowthShape
from rtec.effects.windup import WindupShape

SensorShape = effect_named("refraction").shape_type

SEEDS = st.integers(0, 2**32 - 1)
SHAPES = {
    "windup": WindupShape(7.0),
    "thermal_growth": GrowthShape("screw"),
    "thermal_shift": HeatShape("screw"),
    "warm_up": WarmShape(300.0),
    "warm_up_growth": WarmGrowthShape(300.0),
    "run_offset": RunShape((1, 2, 3)),
    "reversal_spike": SpikeShape(7.0),
    "refraction": SensorShape("screw"),
    "dead_path": SensorShape("screw"),
    "gravity": GravityShape(2),
    "coulomb": BuildUpShape(7.0),
    "load_friction": BuildUpShape(7.0),
    "hysteresis": HysteresisShape(7.0),
    "lost_counts": StepShape(250.0),
    "stribeck": StribeckShape(7.0, speed=4.0),
    "viscous": ViscousShape(6.0),
    "cyclic": CyclicShape(6.35, 3, by_direction=True),
}
SIMPLE = (
    "offset scale cosine backlash windup thermal_growth thermal_shift warm_up drift servo_lag acceleration_lag "
    "lost_counts inertia viscous coulomb asymmetric_friction stribeck force_offset cyclic warm_up_growth run_offset "
    "reversal_spike refraction dead_path gravity load_friction"
).split()

# what each effect depends on; its card promises that nothing else changes it
DEPENDS = {
    "offset": {"none"},
    "force_offset": {"none"},
    "scale": {"position"},
    "cosine": {"position"},
    "backlash": {"direction"},
    "coulomb": {"direction", "since_reversal"},
    "windup": {"direction", "since_reversal"},
    "thermal_growth": {"position", "temperatures"},
    "thermal_shift": {"temperatures"},
    "warm_up": {"time_s"},
    "warm_up_growth": {"position", "time_s"},
    "run_offset": {"run"},
    "reversal_spike": {"direction", "since_reversal"},
    "refraction": {"position", "temperatures", "pressure_hpa", "humidity_percent"},
    "dead_path": {"temperatures", "pressure_hpa", "humidity_percent"},
    "gravity": {"position"},
    "load_friction": {"direction", "since_reversal", "load"},
    "drift": {"time_s"},
    "lost_counts": {"time_s"},
    "servo_lag": {"velocity"},
    "viscous": {"velocity"},
    "asymmetric_friction": {"velocity"},
    "acceleration_lag": {"acceleration"},
    "inertia": {"acceleration"},
    "stribeck": {"velocity", "direction", "since_reversal"},
    "cyclic": {"position", "direction"},
}
COLUMNS = (
    "position", "direction", "since_reversal", "time_s", "velocity", "acceleration", "temperatures", "run", "load",
    "pressure_hpa", "humidity_percent",
)  # fmt: skip


def plan(seed, rows=60):
    rng = np.random.default_rng(seed)
    return Conditions(
        position=rng.uniform(-500.0, 500.0, rows),
        position_unit="mm",
        run=rng.integers(1, 4, rows),
        direction=rng.choice([-1.0, 1.0], rows),
        time_s=rng.uniform(0.0, 900.0, rows),
        velocity=rng.uniform(-100.0, 100.0, rows),
        acceleration=rng.normal(scale=500.0, size=rows),
        since_reversal=rng.uniform(0.0, 50.0, rows),
        temperatures={"screw": rng.uniform(18.0, 30.0, rows)},
        pressure_hpa=rng.uniform(980.0, 1030.0, rows),
        humidity_percent=rng.uniform(20.0, 80.0, rows),
        load=rng.uniform(1.0, 50.0, rows),
        moving=True,
    )


def changed(conditions, name, other):
    values = {field: getattr(conditions, field) for field in Conditions.__dataclass_fields__}
    return Conditions(**{**values, name: getattr(other, name)})


@pytest.mark.parametrize("name", SIMPLE)
@given(seed=SEEDS)
@settings(max_examples=10, deadline=None)
def test_nothing_but_its_own_conditions_changes_an_effect(name, seed):
    effect, shape = effect_named(name), SHAPES.get(name, Shape())
    unit = "deg" if name == "gravity" else "mm"  # a weight on a linear axis depends on nothing
    here, there = (replace(plan(one), position_unit=unit) for one in (seed, seed + 1))
    columns = effect.columns(here, shape)
    for column in COLUMNS:
        moved = effect.columns(changed(here, column, there), shape)
        if column in DEPENDS[name]:
            assert not np.array_equal(moved, columns), column
        else:
            assert np.array_equal(moved, columns), column


@pytest.mark.parametrize(
    "name", ["scale", "drift", "backlash", "windup", "servo_lag", "coulomb", "stribeck", "cyclic"]
)
@given(seed=SEEDS)
@settings(max_examples=10, deadline=None)
def test_turned_round_an_effect_of_the_motion_turns_its_sign(name, seed):
    effect, shape = effect_named(name), SHAPES.get(name, Shape())
    shape = CyclicShape(6.35, 2) if name == "cyclic" else shape
    here = plan(seed)
    values = {field: getattr(here, field) for field in Conditions.__dataclass_fields__}
    back = {key: -values[key] for key in ("position", "direction", "velocity", "acceleration")}
    columns, mirrored = effect.columns(here, shape), effect.columns(Conditions(**{**values, **back}), shape)
    if name == "drift":
        assert np.array_equal(mirrored, columns)
    elif name == "cyclic":
        signs = np.array([-1.0, 1.0, -1.0, 1.0])  # sines are odd, cosines even
        assert mirrored == pytest.approx(columns * signs, abs=1e-9)
    else:
        assert mirrored == pytest.approx(-columns)


@pytest.mark.parametrize("effect", [e for e in LIBRARY if e.name != "hysteresis"], ids=lambda effect: effect.name)
@given(seed=SEEDS, data=st.data())
@settings(max_examples=5, deadline=None)
def test_parts_of_readings_have_parts_of_columns(effect, seed, data):
    here = plan(seed)
    rows = np.array(data.draw(st.lists(st.integers(0, here.rows - 1), min_size=1, max_size=20)))
    shape = SHAPES.get(effect.name, effect.shape_type())
    if effect.name in ("pitch_map", "backlash_map", "force_map"):
        shape = effect.shape_type((-500.0, 0.0, 200.0, 500.0))
    whole = effect.columns(here, shape)
    assert effect.columns(here.take(rows), shape) == pytest.approx(whole[rows], rel=1e-12, abs=1e-12)


@given(seed=SEEDS, step=st.floats(1e-6, 10.0))
@settings(max_examples=50, deadline=None)
def test_what_is_rounded_stays_rounded(seed, step):
    values = np.random.default_rng(seed).normal(scale=30.0, size=50)
    off = rounding_error(values, step)
    assert rounding_error(values + off, step) == pytest.approx(np.zeros(50), abs=1e-9 * step)
    assert np.abs(off).max() <= step / 2 * (1 + 1e-6)
