"""Blocks of a measurement, which are held out together: of one speed of a spindle, or told by a column."""

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.dataset.many_rows import locked
from rtec.errors import ArgumentError
from rtec.inference.chessboard import board_of
from rtec.metrology import measurement_of_columns

MINUTES = np.arange(120.0)


def loaded(speed=(0.0, 3000.0, 0.0, 1500.0), *, facts=None, **more):
    columns = {
        "time_min": MINUTES,
        "spindle_rpm": np.repeat(speed, MINUTES.size // len(speed)),
        "ch1_um": np.sin(MINUTES),
        "ch2_um": np.cos(MINUTES),
        "gap_v": np.cos(MINUTES),
        **more,
    }
    kept = {name: list(values) for name, values in columns.items() if values is not None}
    return load_dataset(measurement_of_columns(kept), observe="ch1", facts=facts)


def test_a_change_of_speed_starts_a_block_and_each_is_held_out_alone():
    data = loaded()
    assert data.block.tolist() == np.repeat([0, 1, 2, 3], 30).tolist()
    board = board_of(data)
    assert board.fold.tolist() == data.block.tolist()
    assert board.cells == 4
    part = board_of(data.take(np.flatnonzero(data.block != 1)))
    assert part.cell.tolist() == np.repeat([0, 1, 2], 30).tolist()


def test_without_a_speed_that_changes_there_are_no_blocks():
    assert loaded(speed=(1500.0,)).block is None
    assert loaded(spindle_rpm=None).block is None
    assert loaded(target_mm=MINUTES % 7.0).block is None  # places are held out there


def test_a_column_may_say_what_is_held_out_together():
    shift = np.repeat([1.0, 2.0, 1.0], 40)
    for name in ("shift", "SHIFT"):
        data = loaded(shift=shift, facts={"blocks": name})
        assert data.block.tolist() == np.repeat([0, 1, 2], 40).tolist()
    assert loaded(facts={"blocks": "spindle"}).block.tolist() == np.repeat([0, 1, 2, 3], 30).tolist()
    with pytest.raises(ArgumentError, match=r"name of a column .*spindle_rpm.*ch2_um"):
        loaded(facts={"blocks": "shift"})


def test_the_column_may_hold_words(tmp_path):
    text = "run,direction,target_mm,deviation_um,batch\n" + "".join(
        f"{run},1,{x},{x / 7},{'ab'[run > 2]}\n" for run in (1, 2, 3, 4) for x in range(5)
    )
    (tmp_path / "a.csv").write_text("# blocks: 2\n" + text)
    assert load_dataset(tmp_path / "a.csv").block is None
    assert (
        load_dataset(tmp_path / "a.csv", facts={"blocks": "batch"}).block.tolist() == np.repeat([0, 1], 10).tolist()
    )


def test_whole_blocks_are_locked_away():
    shown, away = locked(loaded())
    assert away.source.startswith("the last block of")
    assert np.unique(away.block).tolist() == [3]
    assert shown.rows + away.rows == 120


def test_channels_beside_the_one_observed_explain_nothing():
    data = loaded()
    assert [name for name, _ in data.unknown] == ["gap_v"]
    assert "not used, as channels beside the one observed: ch2_um" in data.notes
