"""Table 5-1 again: the order of the compensations, published figures as bounds, and a stack whose parts add up."""

import itertools

import pytest
from contributions import Contributions
from corrected_axis import Lathe
from table_5_1 import BI, NETWORK, PUBLISHED, STUDY, recipes, three, uncompensated
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


@pytest.mark.parametrize("name", ["uni-directional", BI, BOTH_ROUNDS])
def test_squares_add_up_to_the_whole_as_far_as_chance_lets_them(stacks, name):
    for stack in stacks[name].values():
        assert abs(stack.disagreement) < 0.1
        assert abs(stack.disagreement) < 3.0 * stack.by_chance
        assert stack.disagreement_last < 0.1
