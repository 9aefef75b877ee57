"""What differs between measurements: planted differences are found, and none where there is none."""

import numpy as np
import pytest

from rtec.dataset.load import load_dataset
from rtec.inference.changes import Outcome, changes, changes_from_first
from rtec.inference.compare import compare
from rtec.inference.diagnose import diagnose
from rtec.inference.model_file import read_model
from rtec.metrology import Column, Measurement

TARGETS = np.linspace(0.0, 500.0, 21)


def measured(seed, *, backlash_um=10.0, scale_um_m=20.0, cyclic_um=0.0, noise_um=0.4, runs=4):
    """Return a measurement whose errors are these, written as their definitions say."""
    rng = np.random.default_rng(seed)
    run = np.repeat(np.arange(1, runs + 1), 2 * TARGETS.size)
    direction = np.tile(np.repeat([1.0, -1.0], TARGETS.size), runs)
    target = np.tile(np.concatenate([TARGETS, TARGETS[::-1]]), runs)
    error = scale_um_m * target / 1000 - np.where(direction < 0, 1.0, 0.0) * backlash_um
    error = error + cyclic_um * np.sin(2 * np.pi * target / 130.0) + rng.normal(0.0, noise_um, target.size)
    columns = [
        Column("run", "", run.astype(float)),
        Column("direction", "", direction),
        Column("target", "mm", target),
        Column("deviation", "mm", error / 1000),
    ]
    return load_dataset(
        Measurement(source=f"{seed}.csv", facts={}, unknown={}, columns={one.quantity: one for one in columns})
    )


@pytest.fixture(scope="module")
def before():
    return diagnose(measured(1))


def by_effect(found):
    return {change.effect: change for change in found}


def test_a_smaller_backlash_differs_and_the_scale_does_not(before):
    after = diagnose(measured(2, backlash_um=4.0))
    found = by_effect(changes(before, after))
    assert found["backlash"].outcome is Outcome.DIFFERS
    assert abs(found["backlash"].difference) == pytest.approx(6.0, abs=0.4)
    # 84 readings each way: the mean of a direction is known to 0.4 / sqrt(84), and a backlash is a difference of two
    assert found["backlash"].error == pytest.approx(0.4 * np.sqrt(4 / 84), rel=0.3)
    assert found["scale"].outcome is Outcome.SAME


def test_what_is_gone_and_what_is_new_are_two_sides_of_one_thing(before):
    after = diagnose(measured(3, backlash_um=0.0))
    there = by_effect(changes(before, after))
    back = by_effect(changes(after, before))
    assert (there["backlash"].outcome, back["backlash"].outcome) == (Outcome.GONE, Outcome.NEW)
    assert there["backlash"].other is None
    assert back["backlash"].first is None
    assert there["backlash"].first == back["backlash"].other


def test_what_the_other_could_not_have_shown_is_left_open():
    small = diagnose(measured(4, backlash_um=1.0))
    coarse = diagnose(measured(5, backlash_um=1.0, scale_um_m=2000.0, noise_um=30.0, runs=2))
    assert "backlash" in small.effects
    assert "backlash" not in coarse.effects
    found = by_effect(changes(small, coarse))
    assert found["backlash"].outcome is Outcome.OPEN
    assert "too small" in found["backlash"].reason


def test_differences_are_rare_where_there_are_none(tmp_path):
    (tmp_path / "m.toml").write_text(
        'observe = "deviation"\n[[effect]]\nname = "scale"\n[[effect]]\nname = "backlash"\n'
    )
    results = []
    for seed in range(60):
        data = measured(100 + seed)
        results.append(compare(data, read_model(tmp_path / "m.toml", data.units)))
    pairs = [changes(one, two) for one, two in zip(results[::2], results[1::2], strict=True)]
    false = sum(any(change.outcome is Outcome.DIFFERS for change in found) for found in pairs)
    assert all(len(found) >= 2 for found in pairs)
    assert false <= 2  # at a level of 0.01, three or more of 30 come once in 300 times
    p = np.array([change.p_adjusted for found in pairs for change in found])
    assert (p < 0.5).any()


def test_what_the_model_states_says_nothing_of_either_measurement(tmp_path):
    (tmp_path / "m.toml").write_text(
        'observe = "deviation"\n[[effect]]\nname = "scale"\n[[effect]]\nname = "backlash"\nbacklash = "10 um"\n'
    )
    one, two = (measured(seed, backlash_um=size) for seed, size in ((11, 10.0), (12, 4.0)))
    found = changes(*(compare(data, read_model(tmp_path / "m.toml", data.units)) for data in (one, two)))
    outcomes = {change.effect: (change.outcome, change.reason) for change in found}
    assert outcomes == {"scale": (Outcome.SAME, ""), "backlash": (Outcome.OPEN, "the model states it")}


def test_each_is_held_against_the_first(before):
    found = changes_from_first({"a": before, "b": before, "c": before})
    assert list(found) == ["b", "c"]
    assert {change.outcome for change in found["b"]} == {Outcome.SAME}
