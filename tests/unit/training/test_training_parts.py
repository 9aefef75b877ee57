"""The parts of a measurement: nothing in two of them, the ends train, and what judges is seen nowhere else."""

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.errors import ArgumentError
from rtec.training.parts import FEWEST_PLACES, parts_of


def dataset(folder, *, targets=40, runs=3, head="run,direction,target_mm,deviation_um", name="m.csv", offset_mm=0.0):
    rng = np.random.default_rng(targets)
    lines = [head]
    for run in range(1, runs + 1):
        for way in (1, -1):
            for x in (offset_mm + 10.0 * np.arange(targets))[::way]:
                lines.append(f"{run},{way},{x:g},{rng.normal():.9f}")
    file = folder / name
    file.write_text("\n".join([*lines, ""]))
    return load_dataset(file)


def members(samples):
    return set(samples.error_mm.tolist())


def places(samples):
    return set(samples.position_mm.tolist())


@pytest.mark.parametrize("runs", [1, 2, 4])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_each_reading_is_in_one_part(tmp_path, runs, seed):
    data = dataset(tmp_path, runs=runs)
    parts = parts_of(data, seed=seed)
    each = [members(part) for part in (parts.train, parts.choose, parts.sure, parts.heldout)]
    assert all(each)
    assert sum(map(len, each)) == data.rows  # no error stands twice in the file
    assert set().union(*each) == set(data.observed.tolist())
    # places that judge, or tell how sure, are those of nothing else
    others = places(parts.train) | places(parts.choose)
    assert not places(parts.heldout) & (others | places(parts.sure))
    assert not places(parts.sure) & others
    assert {0.0, 390.0} <= places(parts.train)
    assert members(parts.train) | members(parts.choose) == set(data.observed[parts.rows].tolist())
    assert len(places(parts.heldout)) == 8
    assert len(places(parts.sure)) == 4


def test_repeats_choose_at_the_places_that_train_and_without_repeats_other_places_do(tmp_path):
    parts = parts_of(dataset(tmp_path, runs=4))
    assert places(parts.choose) <= places(parts.train)
    train = {(x, way) for x, way in zip(parts.train.position_mm, parts.train.direction, strict=True)}
    assert len(train) == 2 * len(places(parts.train))
    parts = parts_of(dataset(tmp_path, runs=1, name="single.csv"))
    assert not places(parts.choose) & places(parts.train)


def test_another_seed_draws_other_places_and_the_same_the_same(tmp_path):
    data = dataset(tmp_path)
    drawn = [sorted(places(parts_of(data, seed=seed).heldout)) for seed in (0, 0, 1)]
    assert drawn[0] == drawn[1] != drawn[2]


def test_another_file_judges_alone(tmp_path):
    data, other = dataset(tmp_path), dataset(tmp_path, targets=30, offset_mm=5.0, name="other.csv")
    parts = parts_of(data, other)
    assert members(parts.heldout) == set(other.observed.tolist())
    assert parts.heldout_by == other.source
    assert parts_of(data).heldout_by == "places"
    assert parts.train.rows + parts.choose.rows + parts.sure.rows == data.rows


def test_the_fewest_places(tmp_path):
    parts = parts_of(dataset(tmp_path, targets=FEWEST_PLACES, runs=1))
    assert min(part.rows for part in (parts.train, parts.choose, parts.sure, parts.heldout)) > 0
    with pytest.raises(ArgumentError, match=r"7 targets.*8 or more"):
        parts_of(dataset(tmp_path, targets=FEWEST_PLACES - 1, runs=5, name="few.csv"))


def test_angles_times_and_readings_without_a_direction_are_refused(tmp_path):
    with pytest.raises(ArgumentError, match="deviation of a linear axis"):
        parts_of(dataset(tmp_path, head="run,direction,target_deg,deviation_arcsec", name="angle.csv"))
    file = tmp_path / "time.csv"
    rng = np.random.default_rng(0)
    file.write_text("time_s,deviation_um\n" + "".join(f"{t},{rng.normal():.4f}\n" for t in range(60)))
    with pytest.raises(ArgumentError, match=r"time\.csv"):
        parts_of(load_dataset(file))
