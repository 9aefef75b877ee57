"""What a position loop leaves of a screw's turn, beside the same loop integrated step by step."""

import numpy as np
import pytest

from rtec.effects import Conditions, effect_named
from rtec.effects.library import OF_LOOP
from rtec.effects.screw_runout import ScrewRunout
from rtec.effects.torque_ripple import RippleShape, TorqueRipple

KV, INNER, PITCH = 50.0, 500.0, 10.0
STEP_S = 1e-3


def moved(rows=3000, **others):
    """A smooth motion to and fro from rest, at up to 250 mm/s."""
    t = STEP_S * np.arange(rows)
    position = 40.0 * (1.0 - np.cos(2 * np.pi * t))
    run = np.ones(rows, dtype=np.int64)
    facts = {
        "position": position,
        "position_unit": "mm",
        "run": run,
        "time_s": t,
        "moving": True,
        "screw_pitch": PITCH,
    }
    return Conditions(**(facts | others))


def integrated(conditions, force_per_mass, nut, fine=50):
    """The error of a loop around a velocity loop that is asked to stand still, by small steps."""
    h = STEP_S / fine
    place, speed, left = 0.0, 0.0, []
    fine_position = np.interp(np.arange(conditions.rows * fine) * h, conditions.time_s, conditions.position)
    phase = 2 * np.pi * fine_position / PITCH
    nuts, forces = nut * np.sin(phase), force_per_mass * np.sin(phase)
    for k in range(conditions.rows * fine):
        if k % fine == 0:
            left.append(place + nuts[k])
        wanted = -KV * (place + nuts[k])
        speed += h * (INNER * (wanted - speed) + forces[k])
        place += h * speed
    return np.array(left)


def test_a_runout_is_what_the_loop_leaves_of_it():
    c = moved()
    shape = ScrewRunout.shape_type(PITCH, 1.0 / KV, 1.0 / INNER)
    found = ScrewRunout().contribution(c, shape, [0.003, 0.0])
    assert found == pytest.approx(integrated(c, 0.0, 0.003), abs=3e-5)
    assert np.abs(found).max() > 0.003


def test_a_ripple_is_what_the_loop_leaves_of_a_force():
    c, shape = moved(), RippleShape(PITCH, 1.0 / KV, 1.0 / INNER, 20.0)  # an integral too slow to act
    found = TorqueRipple().columns(c, shape)[:, 0]
    stepped = integrated(c, 100.0, 0.0)
    scale = float(found @ stepped) / float(found @ found)
    late = c.time_s > 0.5
    assert (scale * found)[late] == pytest.approx(stepped[late], abs=0.03 * np.abs(stepped).max())


def test_a_part_of_a_log_sees_what_the_whole_log_does():
    c, shape = moved(), ScrewRunout.shape_type(PITCH, 1.0 / KV, 1.0 / INNER)
    rows = np.arange(0, c.rows, 7)
    part = Conditions(
        position=c.position[rows],
        position_unit="mm",
        run=c.run[rows],
        time_s=c.time_s[rows],
        moving=True,
        whole=c,
        order_of_rows=rows.astype(float),
    )
    assert ScrewRunout().columns(part, shape) == pytest.approx(ScrewRunout().columns(c, shape)[rows], abs=1e-12)


@pytest.mark.parametrize("effect", OF_LOOP, ids=lambda effect: effect.name)
@pytest.mark.parametrize(
    "change, reason",
    [
        ({"moving": False}, "no log in motion"),
        ({"screw_pitch": None}, "travel of a turn"),
        ({"screw_pitch": 50.0}, "fewer than 3 turns"),
    ],
)
def test_without_motion_pitch_or_turns_there_is_neither(effect, change, reason):
    assert reason in effect.untestable(moved(**change))
    assert effect.untestable(moved()) is None


@pytest.mark.parametrize("effect", OF_LOOP, ids=lambda effect: effect.name)
def test_both_have_names_in_files_and_their_tunables_enclose_their_shapes(effect):
    assert effect_named(effect.name) is effect
    c = moved()
    for shape in effect.shapes(c):
        assert effect.columns(c, shape).shape == (c.rows, 2)
        assert all(t.low <= getattr(shape, t.name) <= t.high for t in effect.tunables(c, shape))
