"""Table 5-1 again: the order of the compensations, published figures as bounds, and a stack whose parts add up."""

import itertools

import numpy as np
import pytest
from contributions import (
    INTERPOLATION,
    OF_PREDICTOR,
    REPEATABILITY,
    REST,
    ROUNDING,
    SHAPE,
    TIMING,
    Contributions,
    mean_square_um2,
    stairs,
)
from corrected_axis import Lathe, Repeatability, uni_directional
from table_5_1 import BI, NETWORK, PUBLISHED, STUDY, UNCOMPENSATED, main, recipes, three, uncompensated
from threadpoolctl import threadpool_limits

from rtec.injector import Design

BOTH_ROUNDS = f"two rounds: {NETWORK}"
SOME = (None, Design.ORIGINAL, Design.B, Design.C)


@pytest.fixture(scope="module")
def lathe():
    return Lathe()


@pytest.fixture(scope="module")
def bench(lathe):
    return Contributions(lathe, STUDY, designs=SOME)


@pytest.fixture(scope="module")
def splits(lathe, bench):
    every = recipes(lathe, starts=1)
    with threadpool_limits(1):
        return {name: bench.split(every[name]) for name in ("uni-directional", BI, BOTH_ROUNDS)}


@pytest.fixture(scope="module")
def stacks(lathe, bench, splits):
    every = recipes(lathe, starts=1)
    return {name: {s.design: s for s in bench.stacks(every[name], split)} for name, split in splits.items()}


def standing_mm(target_mm, corrected_mm):
    """Where the axis stands once a correction that depends on that place has come to rest, by plain repetition."""
    x = target_mm.copy()
    for _ in range(50):
        x = target_mm - corrected_mm(x)
    return x


def each_way(task, function):
    """A function of places and a direction, at the places of each direction."""
    found = np.empty(task.target_mm.size)
    for way in (1, -1):
        rows = task.direction == way
        found[rows] = function(task.target_mm[rows], way)
    return found


def test_each_compensation_is_better_than_the_one_before(lathe, splits):
    found = [three(uncompensated(lathe, STUDY, 0))]
    found += [three(lathe.tested(split.real, None, STUDY, 0)) for split in splits.values()]
    for before, after in itertools.pairwise(found):
        assert all(a < b for a, b in zip(after, before, strict=True))


def test_published_figures_are_reached_by_the_tables_and_networks(lathe, splits):
    for name, published in ((BI, PUBLISHED[BI]), (BOTH_ROUNDS, PUBLISHED[NETWORK])):
        for design in (None, Design.ORIGINAL):
            figures = lathe.tested(splits[name].real, design, STUDY, 0)
            assert all(a <= b for a, b in zip(three(figures), published[:3], strict=True))
            cyclic = max(figures.cyclic_forward.peak_to_peak, figures.cyclic_backward.peak_to_peak)
            assert cyclic / 25.4 <= published[3]


def test_the_uncompensated_axis_is_the_thesis_s_but_for_its_repeats(lathe):
    average, reversal, repeat = three(uncompensated(lathe, STUDY, 0))
    assert average == pytest.approx(PUBLISHED[UNCOMPENSATED][0], rel=0.08)
    assert reversal == pytest.approx(PUBLISHED[UNCOMPENSATED][1], rel=0.08)
    assert repeat < 0.8 * PUBLISHED[UNCOMPENSATED][2]


@pytest.mark.parametrize("name", ["uni-directional", BI, BOTH_ROUNDS])
def test_squares_add_up_to_the_whole_as_far_as_chance_lets_them(stacks, name):
    for stack in stacks[name].values():
        assert abs(stack.disagreement) < 0.1
        assert abs(stack.disagreement) < 3.0 * stack.by_chance
        assert stack.disagreement_last < 0.1


def test_a_trained_predictor_is_the_sum_of_its_parts(splits):
    for split in splits.values():
        whole, grid = split.only(*OF_PREDICTOR), split.grid_mm[::97]
        for way in (1, -1):
            assert whole.error_mm(grid, way) == pytest.approx(split.real.error_mm(grid, way), abs=1e-12)


def test_interpolation_is_what_straight_lines_between_the_points_miss(lathe, stacks):
    nodes = lathe.tasks[0].target_mm[: lathe.tasks[0].target_mm.size // 8]
    e = lathe.error

    def missed(targets, way):
        lines = e.error_mm(nodes, way)
        x = standing_mm(targets, lambda x: np.interp(x, nodes, lines))
        return e.error_mm(x, way) - np.interp(x, nodes, lines)

    expected = mean_square_um2(each_way(lathe.many, missed))
    stack = stacks[BI][None]
    assert stack.alone[INTERPOLATION] == pytest.approx(expected, rel=0.1)
    assert abs(stack.alone[SHAPE]) < 0.01


def test_the_shape_of_a_uni_directional_table_is_what_one_backlash_cannot_say(lathe, stacks):
    nodes = np.unique(lathe.tasks[0].target_mm)
    e = lathe.error
    lost = e.error_mm(nodes, -1) - e.error_mm(nodes, 1)
    off = lathe.many.direction < 0
    expected = np.where(off, np.interp(lathe.many.target_mm, nodes, lost - lost.mean()), 0.0)
    assert stacks["uni-directional"][None].alone[SHAPE] == pytest.approx(mean_square_um2(expected), rel=0.05)


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.B, Design.C])
def test_rounding_is_that_to_the_step_at_the_place_where_the_axis_stands(lathe, stacks, design):
    step = design.step_counts * 1e-3
    e = lathe.error

    def rounded(targets, way):
        x = standing_mm(targets, lambda x: step * np.floor(e.error_mm(x, way) / step + 0.5))
        return e.error_mm(x, way) - (targets - x)

    # whole counts do not move the axis against its target: it stops beside it as without a correction
    task = lathe.many
    beside = lathe.deviation(task=task) - e.error_mm(task.target_mm, task.direction)
    stack = stacks[BI][design]
    expected = mean_square_um2(each_way(task, rounded) + beside)
    assert stack.alone[ROUNDING] + stack.alone[REST] == pytest.approx(expected, rel=0.05)
    assert abs(stack.alone[TIMING]) < 0.03


def test_the_original_loses_to_rounding_what_c_and_b_do_not(stacks):
    lost = [stacks[BI][design].insertion for design in (Design.ORIGINAL, Design.C, Design.B)]
    assert lost == sorted(lost, reverse=True)
    assert lost[0] > 3.0 * lost[1]


def test_repeatability_is_what_was_drawn(bench, stacks):
    assert stacks[BI][None].alone[REPEATABILITY] == pytest.approx(1.0, rel=0.15)
    assert stacks[BI][None].alone[REPEATABILITY] == mean_square_um2(bench.noise_mm)


def test_stairs_are_whole_steps_within_half_a_step(lathe):
    low, high = lathe.many.target_mm.min(), lathe.many.target_mm.max()
    found = stairs(lathe.error, 4e-3, low, high)
    x = np.random.default_rng(0).uniform(low, high, 2000)
    for way in (1, -1):
        steps = found.error_mm(x, way) / 4e-3
        flat = np.abs(steps - np.round(steps)) < 1e-6
        assert flat.mean() > 0.99
        off = np.abs(found.error_mm(x, way) - lathe.error.error_mm(x, way))[flat]
        assert np.mean(off < 2.0e-3 + 1e-6) > 0.99  # but for the jump that the printed network has at each turn


def test_drift_grows_with_the_root_of_time_and_white_noise_does_not(lathe):
    test = lathe.test
    hours = (test.begins_ps[-1] - test.begins_ps[0]) / 3.6e15
    walks = np.array([Repeatability(white_um=0.0, drift_um=8.0).draw(test, (seed,)) for seed in range(400)])
    assert 1e3 * walks[:, -1].std() == pytest.approx(8.0 * hours**0.5, rel=0.12)
    white = np.array([Repeatability(white_um=3.0).draw(test, (seed,)) for seed in range(20)])
    assert 1e3 * white.std() == pytest.approx(3.0, rel=0.03)
    assert 1e3 * white[:, -100:].std() == pytest.approx(3.0, rel=0.06)


def test_normal_repeats_that_are_independent_do_not_give_the_published_repeat(lathe):
    average, reversal, repeat = three(uncompensated(lathe, Repeatability(white_um=5.0), 1))
    assert repeat < 0.9 * PUBLISHED[UNCOMPENSATED][2]
    assert reversal > 0.95 * PUBLISHED[UNCOMPENSATED][1]
    assert average > 0.95 * PUBLISHED[UNCOMPENSATED][0]


def test_a_uni_directional_table_takes_the_mean_backlash(lathe):
    readings = lathe.exact(rounds=1)
    table = uni_directional(readings)
    nodes = np.unique(readings.target_mm)
    lost = lathe.error.error_mm(nodes, -1) - lathe.error.error_mm(nodes, 1)
    assert table.backlash_mm == pytest.approx(lost.mean(), abs=1e-9)


def test_too_few_draws_and_a_page_without_a_place_for_the_tables_are_refused(monkeypatch, capsys, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# Nothing\n")
    for words, said in ((["--draws", "1"], "2 or more"), (["-o", str(page)], "lacks the lines")):
        monkeypatch.setattr("sys.argv", ["table_5_1.py", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 2
        assert said in capsys.readouterr().err
