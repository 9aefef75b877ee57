"""The state tables, against the box, docs/state-tables.md and the rules of NISTIR 4832."""

import pytest
from signal_oracle import FORWARD
from state_table_page import insertion_rows

from rtec.injector import Design, DesignRow, Injector, InjectorSettings, Timing
from rtec.injector.walk import LEVELS, walks
from rtec.signal import EdgeStream

TITLES = {"Original": Design.ORIGINAL, "Design A": Design.A, "Design B": Design.B, "Design C": Design.C}


def test_the_page_holds_what_the_code_walks():
    page = [
        (TITLES[title], int(row["Start"]), row["Levels"], row["Sign"], tuple(row["Output, step by step"].split()),
         tuple(int(count) for count in row["Count after each"].split()))
        for title, row in insertion_rows()
    ]  # fmt: skip
    code = [
        (design, walk.state, walk.start_levels, "+" if walk.sign > 0 else "-", walk.levels, walk.counts)
        for design in Design
        for walk in walks(design)
    ]
    assert code == page


@pytest.mark.parametrize("walk", walks(Design.C), ids=lambda walk: f"{walk.start_levels}{walk.sign:+d}")
def test_design_c_follows_the_general_algorithm_of_the_report(walk):
    # "if A&B are the same, invert A then B to add two counts, or invert B then A to subtract two counts. However, if
    # A&B are different, invert B then A to add two counts, or invert A then B to subtract two counts"
    same = walk.start_levels[0] == walk.start_levels[1]
    order = "AB" if same == (walk.sign > 0) else "BA"
    levels = dict(zip("AB", walk.start_levels, strict=True))
    expected = [f"{line}={1 - int(levels[line])}" for line in order]
    assert list(walk.lines) == expected


@pytest.mark.parametrize("design", list(Design))
def test_states_are_the_levels_and_counts_go_by_one(design):
    for walk in walks(design):
        assert [FORWARD[state - 1] for state in walk.states] == list(walk.levels)
        assert list(walk.counts) == [walk.sign * k for k in range(1, design.step_counts + 1)]
        assert walk.states[-1] == (walk.state - 1 + walk.sign * design.step_counts) % 4 + 1


CYCLE = DesignRow(
    key="c4", title="Cycle", short="C4", step_counts=4, inverts=True, pins=3, decide_cycles=5, fast_ns=1
)


@pytest.mark.parametrize("design", [*Design, CYCLE], ids=lambda design: design.key)
def test_the_box_walks_them_at_rest(design):
    walked = {}
    for state, levels in enumerate(LEVELS):
        for sign in (1, -1):
            level = int(levels[0]) + 2 * int(levels[1])
            box = Injector(InjectorSettings(design=design, timing=Timing()), initial=level)
            box.request(sign, at_ps=0)
            seen = box.process(EdgeStream([], [], initial=level), until_ps=10**10)
            if box.insertions.completed == sign:
                walked[state + 1, sign] = tuple(f"{ab & 1}{ab >> 1}" for ab in seen.levels.tolist())
    assert walked == {(walk.state, walk.sign): walk.levels for walk in walks(design)}
