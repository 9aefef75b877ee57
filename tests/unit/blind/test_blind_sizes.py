"""Sizes of hidden effects: which number they are, how they are read, and hiding one of that size."""

import pytest

from rtec.blind.game import play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import INSIDE, OF_DRIVE, Scenario
from rtec.blind.sizes import SIZES, Size, plans_showing, read_size, scenario_of_sizes, size_of
from rtec.errors import ArgumentError


def test_every_effect_that_can_be_hidden_has_a_size():
    assert set(SIZES) == {*INSIDE, *OF_DRIVE}


@pytest.mark.parametrize("name", sorted(SIZES))
def test_the_size_is_a_number_of_the_hidden_effect(name):
    _, secret = play(Scenario(names=(name,), plan=PLANS[plans_showing(name)[-1]]), 1)
    size = size_of(secret.effects[0])
    assert size.unit in SIZES[name][1]
    # it says how strong the effect is: what does not scale with that is no size, but where the loop makes it
    assert size.scales or name in ("acceleration_lag", "servo_lag", "lost_counts")


@pytest.mark.parametrize(
    ("name", "text", "plan", "value"),
    [
        ("backlash", "3 um", "base", 3.0),
        ("lost_counts", "7 count", "base", 7.0),
        ("servo_lag", "0.1 ms", "moving", 0.1),
        ("thermal_growth", "11.5 um/m/K", "temperature", 11.5),
        ("refraction", "3", "weather", 3.0),
        ("coulomb", "4 N", "drive", 4.0),
        ("coulomb", "4 N*m", "joint", 4.0),
    ],
)
def test_an_effect_has_the_size_that_is_asked_for(name, text, plan, value):
    wanted = [(name, read_size(name, text, where="--hide"))]
    if plan == "joint":
        wanted = [(name, Size(value=4.0, uncertainty=0.0, unit="N*m"))]
    _, secret = play(scenario_of_sizes(wanted, PLANS[plan], 3), 3)
    assert abs(size_of(secret.effects[0]).value) == pytest.approx(value, rel=1e-9)


def test_sizes_stand_beside_each_other_and_beside_none():
    wanted = [("backlash", read_size("backlash", "6 um", where="x")), ("drift", None)]
    scenario = scenario_of_sizes(wanted, PLANS["base"], 1)
    # play of 12 um is 3 sigma at 2 um of noise, half of it from forward and half from backward readings
    assert scenario.strengths == (pytest.approx(1.5), 5.0)


@pytest.mark.parametrize(
    ("text", "value", "uncertainty"),
    [
        ("12 um", 12.0, 0.0),
        ("12 +- 0.5 um", 12.0, 0.5),
        ("12 um +- 500 nm", 12.0, 0.5),
        ("12um+/-0.5um", 12.0, 0.5),
        ("-12 um", 12.0, 0.0),
    ],
)
def test_a_size_is_read(text, value, uncertainty):
    size = read_size("backlash", text, where="x")
    assert (size.value, size.uncertainty, size.unit) == (pytest.approx(value), pytest.approx(uncertainty), "um")


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("backlash", "12", "the play of backlash, such as backlash='5 um'"),
        ("backlash", "12 UM", "did you mean '12 um'?"),
        ("backlash", "1 um +- 2 um +- 3 um", "the play of backlash"),
        ("drift", "3 um", "such as drift='5 um/h'"),
        ("coulomb", "3", "coulomb='5 N' or coulomb='5 N\\*m'"),
        ("refraction", "3 um", "such as refraction=5"),
        ("offset", "3 um", "offset without a value"),
        ("moving_bump", "3 um", "moving_bump without a value"),
    ],
)
def test_what_is_no_size_is_refused(name, text, says):
    with pytest.raises(ArgumentError, match=says):
        read_size(name, text, where="--hide")


def test_a_size_beyond_the_noise_is_refused_with_its_range():
    # 30 times 2 um of noise are 120 um of play, 0.01 times are 0.04 um
    with pytest.raises(ArgumentError, match=r"backlash=3000 um .*from 0\.04 to 120 um"):
        scenario_of_sizes([("backlash", read_size("backlash", "3 mm", where="x"))], PLANS["base"], 1)


def test_a_force_is_no_torque():
    with pytest.raises(ArgumentError, match=r"a size in N\*m"):
        scenario_of_sizes([("coulomb", read_size("coulomb", "3 N", where="x"))], PLANS["joint"], 1)
