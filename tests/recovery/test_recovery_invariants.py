"""What holds of every diagnosis, on games of all kinds: no step raises an error, only the physics matters."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import pytest

from rtec.blind.game import play
from rtec.blind.plan import PLANS
from rtec.blind.scenario import Scenario
from rtec.dataset.load import load_dataset
from rtec.inference.diagnose import diagnose
from rtec.metrology import write_measurement
from tests import invariants as holds
from tools.other_games import ROUND, game_of

PLAN = {name: replace(plan, runs=min(plan.runs, 3), targets=min(plan.targets, 15)) for name, plan in PLANS.items()}
GAMES = (
    ("base",),
    ("base", "backlash", "cyclic"),
    ("base", "chirped_cyclic"),
    ("base", "backlash", "lost_at_reversals"),
    ("dwell", "drift"),
    ("temperature", "backlash", "thermal_growth"),
    ("dense", "windup"),
    ("moving", "servo_lag"),
    ("drive", "coulomb", "viscous"),
    ("turn", "eccentricity"),
    ("two_runs", "drift"),
    ("turned_once", "scale"),
    ("one_day", "refraction"),
)
"""Plan, made short, and what is hidden."""
SHORT = (("base",), ("two_runs", "drift"), ("turned_once", "scale"))
"""Where effects are added one after another, which is asked of every effect again and again."""
each_game = pytest.mark.parametrize("game", GAMES, ids="-".join)


@cache
def measured(game):
    """Return the file of a game, its readings and their diagnosis."""
    plan, *names = game
    path = Path(mkdtemp()) / "game.csv"
    write_measurement(path, play(Scenario(names=tuple(names), plan=PLAN[plan], strength_sigma=4.0), 11)[0])
    data = load_dataset(path)
    return path, data, diagnose(data)


@each_game
def test_no_accepted_step_raises_an_error(game):
    assert not list(holds.rises(measured(game)[2]))


@each_game
def test_what_is_named_leaves_no_trend(game):
    assert not list(holds.trends(measured(game)[2]))


@each_game
def test_a_file_has_one_noise_floor(game):
    _, data, result = measured(game)
    assert not list(holds.floors(data, result))


@pytest.mark.one_in(3)
@pytest.mark.parametrize("telling", holds.TELLINGS)
@each_game
def test_the_way_in_which_a_measurement_is_told_changes_nothing(game, telling, tmp_path):
    path, _, result = measured(game)
    for told, table in holds.TELLINGS[telling](holds.Table.of(path.read_text(encoding="utf-8"))):
        assert not list(holds.differs(result, told, table.write(tmp_path / "told.csv")))


@pytest.mark.parametrize("game", SHORT, ids="-".join)
def test_effects_added_one_after_another_leave_no_less(game):
    _, data, result = measured(game)
    assert not list(holds.misses(data, result))


@pytest.mark.sweep
@pytest.mark.parametrize("index", range(len(ROUND)))
def test_the_same_holds_of_games_that_share_no_code_with_rtec(index, tmp_path):
    path = tmp_path / "game.csv"
    path.write_text(game_of(77, index).text, encoding="utf-8")
    data = load_dataset(path)
    result = diagnose(data)
    broken = [*holds.rises(result), *holds.trends(result), *holds.floors(data, result)]
    for tellings in holds.TELLINGS.values():
        for told, table in tellings(holds.Table.of(path.read_text(encoding="utf-8"))):
            broken += holds.differs(result, told, table.write(tmp_path / "told.csv"))
    assert not broken
