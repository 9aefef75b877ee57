"""Effects of a player's own, hidden in the emulated axis: what their function says is what the axis does."""

from dataclasses import replace

import numpy as np
import pytest

import rtec
from rtec.blind.game import again, play
from rtec.blind.guess import guessed, points_of, read_answer
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario, scenario_of, unfit
from rtec.blind.sealing import measure, new, reveal
from rtec.blind.sizes import plans_showing, read_size, scenario_of_sizes
from rtec.dataset.load import load_dataset
from rtec.effects.quantities import quantity_of
from rtec.errors import ArgumentError, RtecError
from rtec.metrology import ExperimentPlan

RESOLUTION_MM = 2.1e-5
SEED = 5


def bump(position, place, width):
    return np.exp(-(((position - place) / width) ** 2))


@rtec.effect
def dent(position, *, place: rtec.Within(0, 500, "mm"), width: rtec.Within(2, 40, "mm")):
    "A dent in the way."
    return bump(position, place, width)


@rtec.effect
def sweat(humidity):
    return humidity**2


class Slope(rtec.Effect):
    """An effect that is no function."""

    name = "slope"

    def columns(self, conditions, shape):
        return conditions.position[:, None]


GAME = Scenario(names=("backlash", "dent"), plan=PLANS["turned_once"], own=(dent,))
BARE = Scenario(names=("backlash",), plan=PLANS["turned_once"])
EXPERIMENT = ExperimentPlan(runs=2, targets=41)


def added_mm(with_it, without):
    """Return what hiding one effect more adds to each reading."""
    at, bare = ([game.columns[key].values for key in ("target", "actual")] for game in (with_it, without))
    assert at[0].tolist() == bare[0].tolist()
    return at[0], at[1] - bare[1]


def numbers(secret):
    return {one.name: one.value for one in secret.effects[-1].parameters}


def test_the_axis_does_what_the_function_says_and_keeps_its_numbers_under_another_plan():
    first, second = play(GAME, SEED), again(GAME, SEED, EXPERIMENT)
    bare = play(BARE, SEED)[0], again(BARE, SEED, EXPERIMENT)[0]
    assert numbers(first[1]) == numbers(second[1])
    assert first[1].effects[-1].rms_sigma == pytest.approx(3.0)
    assert first[1].outside == ("dent",)
    for (measurement, secret), without in zip((first, second), bare, strict=True):
        target_mm, error_mm = added_mm(measurement, without)
        said = numbers(secret)
        expected_mm = 1e-3 * said["dent"] * bump(target_mm, said["place"], said["width"])
        assert np.abs(error_mm - expected_mm).max() < RESOLUTION_MM


def test_what_the_function_gets_is_what_a_file_of_the_measurement_says():
    got = {}

    @rtec.effect(over="time")
    def spy(
        time,
        position,
        direction,
        velocity,
        temperature,
        since_reversal,
        run,
        pressure,
        humidity,
        dwell_s,
        phase_of_pitch,
    ):
        got.update((name, values) for name, values in locals().items() if name != "got")
        return np.sin(time) + position * 1e-3

    recorded = ("direction", "time", "feed", "temperature", "pressure", "humidity", "dwell")
    plan = replace(PLANS["temperature"], columns=recorded, feeds_mm_s=(40.0, 20.0))
    conditions = load_dataset(play(Scenario(names=("spy",), plan=plan, own=(spy,)), SEED)[0]).conditions
    assert set(got) == set(spy.quantities)
    rounded = {"temperature": 0.1, "pressure": 0.06, "humidity": 0.6}
    for name, values in got.items():
        assert np.abs(values - quantity_of(conditions, name)).max() <= rounded.get(name, 1e-9), name
    assert np.ptp(got["temperature"]) > 5.0


def test_parameters_are_drawn_so_that_the_effect_shows():
    @rtec.effect
    def far(position, *, place: rtec.Within(0, 5000, "mm"), width: rtec.Within(2, 40, "mm")):
        return bump(position, place, width)

    secrets = [play(Scenario(names=("far",), plan=PLANS["single_pass"], own=(far,)), seed)[1] for seed in range(6)]
    places = [numbers(secret)["place"] for secret in secrets]
    assert max(places) < 1000.0
    assert len(set(places)) == len(places)


def test_an_amplitude_that_cannot_be_negative_is_not_and_others_are_of_both_signs():
    signs = {}
    for one in (dent, rtec.effect(dent.function, name="rub", not_negative=True)):
        game = Scenario(names=(one.name,), plan=PLANS["sparse"], own=(one,))
        signs[one.name] = {np.sign(numbers(play(game, seed)[1])[one.name]) for seed in range(8)}
    assert signs == {"dent": {-1.0, 1.0}, "rub": {1.0}}


@pytest.mark.parametrize(
    ("effect", "plan", "why"),
    [
        (dent, "drive", "own effects are hidden in readings at rest"),
        (dent, "moving", "own effects are hidden in readings at rest"),
        (dent, "turn", "own effects are hidden in a linear axis"),
        (sweat, "base", "the plan does not record a humidity column"),
        (rtec.effect(lambda load: load, name="heavy"), "base", "the plan does not record a load column"),
        (Slope(), "base", "own effects are hidden where @rtec.effect made them of a function"),
    ],
)
def test_a_plan_that_cannot_show_it_is_refused(effect, plan, why):
    assert why in unfit(effect.name, PLANS[plan], (effect,))
    with pytest.raises(ArgumentError, match=f"{effect.name} cannot be seen with the plan {plan}.*{why}"):
        Scenario(names=(effect.name,), plan=PLANS[plan], own=(effect,))


def test_what_does_not_change_over_the_readings_is_refused():
    level = rtec.effect(lambda position: position**0, name="level")
    with pytest.raises(ArgumentError, match="effect level cannot be seen with the plan sparse"):
        play(Scenario(names=("level",), plan=PLANS["sparse"], own=(level,)), SEED)


@pytest.mark.parametrize("name", ["backlash", "moving_bump", "unknown"])
def test_a_name_of_the_game_is_refused(name):
    with pytest.raises(ArgumentError, match=f"own: {name} has a name that the game uses"):
        Scenario(own=(rtec.effect(dent.function, name=name),))


def test_a_seed_hides_one_own_effect_alone_or_beside_others():
    games = [scenario_of(seed, (dent, sweat)) for seed in range(200)]
    assert all(len(game.own_names) == 1 and len(game.names) <= 3 for game in games)
    assert {game.own_names[0] for game in games} == {"dent"}  # no plan that a seed draws records humidity
    beside = sum(len(game.names) > 1 for game in games)
    assert 30 < beside < 120
    assert {game.plan.name for game in (scenario_of(seed, (sweat,)) for seed in range(20))} == {"weather"}
    heavy = rtec.effect(lambda load: load, name="heavy")
    with pytest.raises(ArgumentError, match="heavy is shown by no plan of the game"):
        scenario_of(1, (heavy,))


def test_a_size_is_hidden_and_scored():
    size = read_size("dent", "20 um", where="--hide", own=["dent"])
    _, secret = play(scenario_of_sizes([("dent", size)], PLANS["base"], SEED, (dent,)), SEED)
    assert abs(numbers(secret)["dent"]) == pytest.approx(20.0)
    for words, points in ((["dent=21 um"], 3), (["dent=30 um"], 2), (["sweat=20 um"], -1), (["drift"], -1)):
        own = ["dent", "sweat"]
        scored = points_of(secret, read_answer(words, own), own)
        assert (sum(one.points for one in scored), max(one.most for one in scored)) == (points, 3)
    assert guessed(secret, ["unknown"]).solved
    with pytest.raises(ArgumentError, match=r"'dent' is not an effect; .* or of --effects"):
        read_answer(["dent"])
    with pytest.raises(ArgumentError, match="amplitude of dent, such as dent='5 um'"):
        read_size("dent", "3 s", where="--hide", own=["dent"])
    assert plans_showing("sweat", (sweat,)) == ("weather", "one_day")


def twice_as_wide():
    @rtec.effect
    def dent(position, *, place: rtec.Within(0, 500, "mm"), width: rtec.Within(2, 40, "mm")):
        return bump(position, place, 2.0 * width)

    return dent


def test_a_seal_tells_without_the_file_and_measures_with_it_only(tmp_path):
    data, plan, second = (tmp_path / name for name in ("data.csv", "plan.toml", "second.csv"))
    plan.write_text("[runs]\nnumber = 2\n")
    new(SEED, data, scenario=GAME)
    assert reveal(data).names == ("backlash", "dent")
    with pytest.raises(RtecError, match="this game hides an effect of somebody's own: give its file with --effects"):
        measure(data, plan, second, own=(sweat,))
    other = rtec.effect(lambda position: bump(position, 200.0, 30.0), name="dent")
    for changed in (other, twice_as_wide(), rtec.effect(sweat.function, name="dent")):
        with pytest.raises(RtecError, match="is not the one that was hidden: give its file as it was"):
            measure(data, plan, second, own=(changed,))
    assert [path.name for path in tmp_path.glob("second*")] == []
    measure(data, plan, second, own=(sweat, dent))
    assert numbers(reveal(second)) == numbers(reveal(data))
