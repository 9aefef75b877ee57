"""Families of noise: each is as strong as stated, and has the one property that makes it what it is."""

import math

import numpy as np
import pytest

from rtec.blind.drawn_plans import drawn_plan
from rtec.blind.game import play
from rtec.blind.noise import LEVEL_RATIO, Noise, Readings, noise_of
from rtec.blind.plan import passes_of
from rtec.blind.scenario import Scenario

TARGETS, RUNS, SIGMA, DRAWS = 24, 4, 2.0, 300


def readings(targets=TARGETS, runs=RUNS, uneven=True):
    """Return a program forth and back whose readings come at uneven times."""
    there = np.linspace(0.0, 100.0, targets)
    rng = np.random.default_rng(5)
    n = 2 * targets * runs
    gaps = rng.uniform(1.0, 9.0, n) if uneven else np.full(n, 4.0)
    return Readings(
        time_s=np.cumsum(gaps),
        position_mm=np.tile(np.concatenate([there, there[::-1]]), runs),
        direction=np.tile(np.repeat([1.0, -1.0], targets), runs),
        run=np.repeat(np.arange(1, runs + 1), 2 * targets),
    )


PLAN = readings()


def draws(kind, plan=PLAN, count=DRAWS):
    return np.array([noise_of(kind, plan, SIGMA, np.random.default_rng([seed, 77])) for seed in range(count)])


@pytest.mark.parametrize("kind", Noise)
def test_a_reading_scatters_by_sigma(kind):
    drawn = draws(kind)
    # the mean square of 300 draws of a record that is one random walk is known within some 6 %
    assert np.sqrt(np.mean(drawn**2)) == pytest.approx(SIGMA, rel=0.12)
    assert abs(drawn.mean()) < 0.15 * SIGMA


@pytest.mark.parametrize("kind", Noise)
def test_the_same_stream_draws_the_same_noise_and_a_single_pass_will_do(kind):
    short = readings(11, 1)
    assert draws(kind, short, 1).tolist() == draws(kind, short, 1).tolist()
    one_way = Readings(
        time_s=np.arange(11.0), position_mm=np.arange(11.0), direction=np.ones(11), run=np.ones(11, int)
    )
    assert np.isfinite(draws(kind, one_way, 20)).all()


def correlation(drawn, first, second):
    return np.corrcoef(drawn[:, first].ravel(), drawn[:, second].ravel())[0, 1]


def test_a_walk_gets_further_away_with_every_step():
    drawn = draws(Noise.RANDOM_WALK)
    apart = [np.mean((drawn[:, lag:] - drawn[:, :-lag]) ** 2) for lag in (1, 10, 20, 40)]
    # the white part adds the same to each
    assert (apart[2] - apart[1]) == pytest.approx(apart[1] - apart[0], rel=0.3)
    assert (apart[3] - apart[2]) == pytest.approx(2 * (apart[2] - apart[1]), rel=0.3)
    assert apart[3] > 3 * apart[0] - 2 * np.mean(drawn**2)


def test_noise_by_place_is_smooth_within_a_pass_and_new_in_the_next():
    drawn = draws(Noise.BY_PLACE)
    half = np.arange(TARGETS - 1)
    assert correlation(drawn, half, half + 1) > 0.5
    assert correlation(drawn, half[:-12], half[:-12] + 12) < 0.15
    # the same places, forth and back, and in the next run
    back = 2 * TARGETS - 1 - half
    assert abs(correlation(drawn, half, back)) < 0.1
    assert abs(correlation(drawn, half, half + 2 * TARGETS)) < 0.1


def test_noise_by_seconds_forgets_by_the_clock_and_not_by_the_reading():
    drawn = draws(Noise.BY_SECONDS, count=1500)
    gaps = np.diff(PLAN.time_s)
    near, far = np.flatnonzero(gaps < 3.0), np.flatnonzero(gaps > 7.0)
    assert correlation(drawn, near, near + 1) > correlation(drawn, far, far + 1) + 0.05
    even = readings(uneven=False)
    drawn = draws(Noise.BY_SECONDS, even)
    one, other = (correlation(drawn, some, some + 1) for some in (near, far))
    assert one == pytest.approx(other, abs=0.03)


def test_runs_are_offset_as_a_whole():
    drawn = draws(Noise.OFFSETS_PER_RUN)
    each = np.arange(2 * TARGETS - 1)
    assert correlation(drawn, each, each + 1) == pytest.approx(correlation(drawn, each[:5], each[:5] + 40), abs=0.05)
    assert correlation(drawn, each, each + 1) > 0.4
    assert abs(correlation(drawn, each, each + 2 * TARGETS)) < 0.1


def test_student_t_has_tails_that_normal_noise_lacks():
    def far_out(kind):
        return np.mean(np.abs(draws(kind)) > 4.0 * SIGMA)

    # P(|t3| > 4 sqrt 3) is 0.0062, of a normal number 0.00006
    assert far_out(Noise.STUDENT_T) == pytest.approx(0.0062, rel=0.2)
    assert far_out(Noise.WHITE) < 0.0002


def test_the_level_changes_three_times_over():
    rng = np.random.default_rng(3)
    assert math.isclose(LEVEL_RATIO, 3.0)
    drawn = noise_of(Noise.LEVEL_CHANGES, readings(2000, 5), 1.0, rng)
    level = np.array([np.var(part) for part in np.array_split(drawn, 40)])
    assert np.quantile(level, 0.95) / np.quantile(level, 0.05) == pytest.approx(LEVEL_RATIO, rel=0.3)


def test_an_unknown_pass_number_begins_at_each_turn():
    assert np.unique(passes_of(PLAN.direction, PLAN.run)).size == 2 * RUNS
    assert (np.diff(passes_of(PLAN.direction, PLAN.run)) >= 0).all()


def test_a_game_has_the_noise_that_was_asked_for():
    kind = Noise.BY_PLACE
    plan = drawn_plan(np.random.default_rng(2), targets=(21, 21), runs=(3, 3), both=True)
    measurement, secret = play(Scenario(noise=kind, plan=plan), 4)
    other, _ = play(Scenario(plan=plan), 4)
    assert secret.noise == kind.value
    assert measurement.columns["target"].values.tolist() == other.columns["target"].values.tolist()
    assert measurement.columns["actual"].values.tolist() != other.columns["actual"].values.tolist()
