"""Effects of a moving axis: lags, and the forces of a drive, against simulated motion."""

from dataclasses import replace

import numpy as np
import pytest

from rtec.effects import BuildUpShape, Conditions, Shape, Units
from rtec.effects.acceleration_lag import acceleration_lag
from rtec.effects.asymmetric_friction import AsymmetricFriction
from rtec.effects.cogging import Cogging
from rtec.effects.coulomb import Coulomb
from rtec.effects.force_offset import ForceOffset
from rtec.effects.inertia import Inertia
from rtec.effects.servo_lag import servo_lag
from rtec.effects.stribeck import Stribeck, StribeckShape
from rtec.effects.viscous import Viscous, ViscousShape

WavesShape = Cogging().shape_type


def held_against(position, velocity):
    rows = np.ones(position.size, dtype=np.int64)
    return Conditions(position=position, position_unit="mm", run=rows, velocity=velocity, moving=True)


def test_a_proportional_loop_follows_late():
    gain, speed, step = 40.0, 25.0, 1e-5
    actual, t = 0.0, 0.0
    while t < 0.5:
        actual += gain * (speed * t - actual) * step
        t += step
    c = held_against(np.array([speed * t]), np.array([speed]))
    assert servo_lag.contribution(c, Shape(), [1 / gain]) == pytest.approx([actual - speed * t], rel=1e-3)


def test_at_one_frequency_inertia_looks_like_a_spring():
    t = np.linspace(0.0, 3.0, 500)
    for second, why in ((0.0, "one frequency: not identifiable from a spring"), (20.0, None)):
        position = 50 * np.sin(2 * t) + second * np.sin(7 * t)
        c = held_against(position, np.gradient(position, t))
        assert (
            Inertia().untestable(replace(c, acceleration=-200 * np.sin(2 * t) - 49 * second * np.sin(7 * t))) == why
        )


def test_a_slide_on_a_spring_lags_by_its_inertia():
    mass, stiffness, damping, acceleration = 2.0, 8e6, 4e3, 500.0
    step, behind, rate = 1e-6, 0.0, 0.0
    for _ in range(60_000):
        rate += step * (-acceleration - stiffness / mass * behind - damping / mass * rate)
        behind += step * rate
    c = Conditions(
        position=np.zeros(1),
        position_unit="mm",
        run=np.ones(1, dtype=np.int64),
        acceleration=np.array([acceleration]),
        moving=True,
    )
    assert acceleration_lag.contribution(c, Shape(), [mass / stiffness]) == pytest.approx([behind], rel=1e-3)


def test_the_forces_of_a_drive_move_the_slide():
    """A slide integrated under a known force: what the effects add at its motion is that force again."""
    mass, viscous, fade, coulomb, asymmetry = 0.1, 0.2, 150.0, 20.0, 0.03
    peak, slow, weight, cog, pitch = 8.0, 3.0, -4.0, 2.5, 12.0
    step, count = 1e-5, 200_000
    x, v = 0.0, 5.0
    xs, vs, forces = np.empty(count), np.empty(count), np.empty(count)
    for i in range(count):
        force = 60.0 * np.sin(2 * np.pi * 1.5 * i * step)
        friction = viscous * v / (1.0 + (v / fade) ** 2) + asymmetry * abs(v)
        friction += np.sign(v) * (coulomb + peak * np.exp(-((v / slow) ** 2)))
        xs[i], vs[i], forces[i] = x, v, force
        a = (force - friction - weight - cog * np.sin(2 * np.pi * x / pitch)) / mass
        x, v = x + step * v, v + step * a
    acceleration = np.gradient(vs, step)
    keep = np.abs(vs) > 5.0  # where the sign of the motion changes within a step, there is no answer
    c = Conditions(
        position=xs[keep],
        position_unit="mm",
        run=np.ones(int(keep.sum()), dtype=np.int64),
        velocity=vs[keep],
        acceleration=acceleration[keep],
        direction=np.sign(vs[keep]),
        moving=True,
    )
    assert c.both_directions
    parts = [
        (Inertia(), Shape(), [mass]),
        (Viscous(), ViscousShape(fade), [viscous]),
        (Coulomb(), BuildUpShape(), [coulomb]),
        (AsymmetricFriction(), Shape(), [asymmetry]),
        (Stribeck(), StribeckShape(speed=slow), [peak]),
        (ForceOffset(), Shape(), [weight]),
        (Cogging(), WavesShape(pitch), [cog, 0.0]),
    ]
    total = sum(effect.contribution(c, shape, amplitudes) for effect, shape, amplitudes in parts)
    assert total == pytest.approx(forces[keep], abs=0.05)
    assert np.std(forces[keep]) > 20


def test_friction_is_silent_at_rest(log):
    c = log()
    rest = c.direction == 0
    assert rest.any()
    assert not Coulomb().columns(c, BuildUpShape())[rest].any()
    assert not Stribeck().columns(c, StribeckShape(speed=10.0))[rest].any()


@pytest.mark.parametrize(
    "effect, change, reason",
    [
        (servo_lag, {"velocity": None}, "no velocity or feed column"),
        (servo_lag, {"velocity": np.zeros(4000)}, "the velocity is zero throughout"),
        (acceleration_lag, {"acceleration": None}, "no moving data"),
        (acceleration_lag, {"acceleration": np.zeros(4000)}, "the acceleration is zero throughout"),
        (Viscous(), {"velocity": None}, "no velocity or feed column"),
        (Viscous(), {"velocity": np.zeros(4000)}, "the velocity is zero throughout"),
        (
            Viscous(),
            {"velocity": np.tile([5.0, 5.2, -9.0, -9.1], 1000), "direction": np.tile([1.0, 1.0, -1.0, -1.0], 1000)},
            "one speed each way",
        ),
        (Coulomb(), {"direction": None}, "no directions"),
        (Coulomb(), {"direction": np.ones(4000)}, "one direction only"),
        (AsymmetricFriction(), {"velocity": np.linspace(0.0, 5.0, 4000)}, "one direction only"),
        (Stribeck(), {"velocity": np.tile([5.0, -5.0, 10.0, -10.0], 1000)}, "2 speeds only: at least 4 needed"),
    ],
)
def test_what_the_data_cannot_show(log, effect, change, reason):
    assert reason in effect.untestable(log(**change))


def test_a_slow_speed_that_fills_the_time_hides_no_other(log):
    way = np.tile([1.0, -1.0], 2000)
    speeds = way * np.repeat([3.0, 10.0, 20.0], [2700, 850, 450])  # as far at each of the three
    assert Viscous().untestable(log(velocity=speeds, direction=way)) is None
    assert "one speed" in Viscous().untestable(log(velocity=way * np.repeat([10.0, 2.0], [3500, 500]), direction=way))
    one_way = {"velocity": np.full(4000, 5.0), "direction": np.ones(4000)}
    assert Viscous().untestable(log(**one_way)) is None, "a force in proportion, as far as one direction tells"


@pytest.mark.parametrize(
    "effect, units, name, unit, factor",
    [
        (servo_lag, Units("mm", "mm", "s"), "lag", "ms", 1e3),
        (servo_lag, Units("a", "deg", "s"), "lag", "A/(deg/s)", 1.0),
        (acceleration_lag, Units("deg", "deg", "s"), "lag", "ms^2", 1e6),
        (acceleration_lag, Units("mm", "deg", "s"), "lag", "um/(deg/s^2)", 1e3),
        (Inertia(), Units("n", "mm", "s"), "inertia", "kg", 1e3),
        (Inertia(), Units("nm", "mm", "s"), "inertia", "N*m/(m/s^2)", 1e3),
        (Viscous(), Units("n", "mm", "s"), "viscous", "N/(m/s)", 1e3),
        (Viscous(), Units("a", "deg", "s"), "viscous", "A/(deg/s)", 1.0),
        (Coulomb(), Units("a", "deg", "s"), "coulomb", "A", 1.0),
        (ForceOffset(), Units("v", "deg", "s"), "force_offset", "V", 1.0),
    ],
)
def test_units_as_people_read_them(effect, units, name, unit, factor):
    (amplitude,) = effect.amplitudes(Shape(), units)
    assert (amplitude.name, amplitude.unit, amplitude.factor) == (name, unit, factor)
