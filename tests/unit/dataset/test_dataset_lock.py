"""What is locked away: whole runs, a part of a pass, the end of a log; and that nothing looks at it."""

from dataclasses import replace

import numpy as np
import pytest
from inference_oracle import SIGMA, measured

from rtec.dataset.many_rows import locked
from rtec.errors import ArgumentError
from rtec.inference.diagnose import diagnose


def test_the_last_run_is_locked_away():
    data = measured(runs=3, targets=4)
    shown, away = locked(data)
    assert shown.observed.tolist() == data.observed[:16].tolist()
    assert away.observed.tolist() == data.observed[16:].tolist()
    assert set(away.coordinates.run.tolist()) == {3}
    assert shown.has_repeats
    assert not away.has_repeats  # one run of it alone repeats nothing
    assert away.source == f"the last run of {data.source}"


def test_of_ten_runs_two_are_locked_away():
    shown, away = locked(measured(runs=10, targets=4))
    assert (shown.rows, away.rows) == (64, 16)
    assert away.has_repeats
    assert away.source.startswith("the last 2 runs of ")


def test_of_one_or_two_runs_every_fifth_reading_is_locked_away():
    data = measured(runs=2, targets=20)
    shown, away = locked(data)
    assert (shown.rows, away.rows) == (64, 16)
    assert away.observed.tolist() == data.observed[4::5].tolist()
    # a cell of which one run alone is left is no repeat
    cells = [set(shown.coordinates.run[shown.cell == k].tolist()) for k in range(shown.cell.max() + 1)]
    assert cells
    assert all(runs == {1, 2} for runs in cells)


def test_of_a_log_the_last_fifth_is_locked_away():
    data = measured(runs=1, targets=50)
    data = replace(data, conditions=replace(data.conditions, moving=True))
    shown, away = locked(data)
    assert (shown.rows, away.rows) == (80, 20)
    assert shown.coordinates.time_s.max() < away.coordinates.time_s.min()


def test_readings_of_one_run_are_no_repeats_of_each_other():
    data = measured(runs=3, targets=4)
    twice = data.take(np.concatenate([np.arange(24), [23]]))
    assert not locked(twice)[1].has_repeats


@pytest.mark.parametrize("rows", [1, 5, 14])
def test_too_few_readings_cannot_be_cut_in_two(rows):
    with pytest.raises(ArgumentError, match=f"--lock: {rows} reading"):
        locked(measured(runs=1, targets=10).take(np.arange(rows)))


def test_what_is_locked_away_decides_nothing():
    """The last run is of another machine: the answer is that of the other runs, and only its score tells."""
    drawn = measured(lambda x, way, t, run: 0.004 * way, runs=5)
    last = drawn.coordinates.run == 5
    other = replace(drawn, observed=np.where(last, drawn.observed + 2e-4 * drawn.conditions.position, drawn.observed))
    answers = []
    for data in (drawn, other):
        shown, away = locked(data)
        answers.append(diagnose(shown, heldout=away, locked=True))
    same, changed = answers
    assert same.effects == changed.effects == ("backlash",)
    assert [s.params for s in same.steps] == [s.params for s in changed.steps]
    assert same.rms_heldout == pytest.approx(SIGMA, rel=0.3)
    assert changed.rms_heldout > 10 * SIGMA
    # another measurement has a say: a backlash that is not there is taken out again
    nothing = measured(seed=9)
    assert diagnose(locked(drawn)[0], heldout=nothing).effects == ()
