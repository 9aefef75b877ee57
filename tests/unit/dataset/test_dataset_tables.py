"""Tables of readings at speeds, headings that are asked about, and what is said first."""

import numpy as np
import pytest

from rtec.effects.library import LIBRARY
from rtec.errors import FileFormatError


def a_table(repeats=1, seed=0):
    """Return a table of torques at speeds each way, and the speeds."""
    rng = np.random.default_rng(seed)
    speeds = np.repeat(np.geomspace(0.5, 80.0, 12), 2) * np.tile([-1.0, 1.0], 12)
    v = np.tile(speeds, repeats) * (1.0 + 1e-4 * rng.uniform(-1, 1, 24 * repeats))
    torque = 3.0 * np.sign(v) + 0.02 * v + 0.05 * rng.standard_normal(v.size)
    return "velocity_deg_s,torque_nm\n" + "".join(f"{a:.9g},{b:.9g}\n" for a, b in zip(v, torque, strict=True)), v


def test_a_table_of_speeds_needs_neither_time_nor_position(load):
    text, v = a_table()
    data = load(text, observe="torque")
    c = data.conditions
    assert (data.rows, c.position_unit, c.moving, data.coordinate) == (24, "deg", False, "velocity")
    assert c.places.size == 1
    assert c.time_s is None
    assert c.acceleration is None
    np.testing.assert_array_equal(c.direction, np.sign(v))
    np.testing.assert_allclose(c.velocity, v, rtol=1e-8)
    assert not data.has_repeats
    assert "the direction is the sign of the velocity" in data.notes[0]
    assert "neither time nor position" in data.notes[1]
    assert "row order counts as time" in data.notes[1]
    assert not any("no time column" in note for note in data.notes)
    for effect in LIBRARY:
        reason = effect.untestable(c)
        if effect.name in ("cogging", "pitch_map", "cyclic", "scale"):
            assert "one position only" in reason or "1 position only" in reason
        if effect.name in ("viscous", "coulomb", "stribeck", "asymmetric_friction"):
            assert reason is None
        if effect.name == "inertia":
            assert reason is not None


def test_speeds_of_a_table_read_again_are_repeats(load):
    text, _ = a_table(repeats=3)
    data = load(text, observe="torque")
    assert data.conditions.run.tolist() == np.repeat([1, 2, 3], 24).tolist()
    assert data.cell.tolist() == np.tile(np.arange(24), 3).tolist()


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("time_s,nominalPos,deviation_um", ("'nominalPos'", "looks like the target", "nominalPos=target_mm")),
        ("velocity_mm_s,pos,current_a", ("'pos'", "looks like the actual position", "pos=actual_mm")),
        ("time_s,soll,deviation_um", ("'soll'", "looks like the target", "soll=ignore")),
        ("Dir,target_mm,deviation_um", ("Dir 4 is not valid", "+1 or -1", "Dir=ignore")),
    ],
)
def test_what_looks_like_a_position_or_a_direction_is_asked_about(load, header, words):
    with pytest.raises(FileFormatError) as error:
        load(header + "\n1,2,3\n1,5,4\n-1,2,3\n4,9,4\n")
    assert all(word in str(error.value) for word in words)


def test_what_is_understood_is_used_and_said(load):
    data = load("time_s,Position [mm],current_a\n0,2,3\n1,5,4\n2,2,3\n3,9,4\n")
    assert (data.conditions.position.tolist(), data.units.position) == ([2.0, 5.0, 2.0, 9.0], "mm")
    assert "took column 'Position [mm]' for the actual position" in data.notes
    data = load("Dir,target_mm,deviation_um\n1,2,3\n1,5,4\n-1,5,3\n-1,2,4\n")
    assert data.conditions.direction.tolist() == [1.0, 1.0, -1.0, -1.0]
    assert "took column 'Dir' for the direction of approach" in data.notes


def test_other_unknown_columns_are_no_question(load):
    data = load("direction,target_mm,deviation_um,Position [raw],opposite\n1,2,3,1,1\n1,5,4,2,2\n1,9,4,3,1\n")
    assert [name for name, _ in data.unknown] == ["Position [raw]", "opposite"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s,deviation_um\n0,1\n1,2\n2,1\n", "time is the coordinate"),
        ("# counts_per_rev: 400\ndirection,target_count,deviation_count\n1,0,1\n1,5,2\n1,7,2\n", "row order counts"),
        ("# counts_per_rev: 400\ntime_s,target_count,deviation_count\n0,0,1\n9,5,2\n19,7,2\n", "sign of the motion"),
    ],
)
def test_what_is_taken_for_time_or_direction_is_said_first(load, text, words):
    assert words in load(text).notes[0]
