"""Dry friction that builds up after a reversal: against the equation of Dahl, integrated in small steps."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from rtec.effects import BuildUpShape, Conditions, distance_since_reversal
from rtec.effects.coulomb import Coulomb
from rtec.effects.load_friction import LoadFriction
from rtec.effects.stribeck import Stribeck, StribeckShape
from rtec.inference.forms import forms_of

TURNS = (0.0, 40.0, 35.0, 60.0, 59.0, 62.0, 10.0)
STEP = 0.01


def path(turns=TURNS, noise=0.0):
    """Readings every 0.01 mm along strokes of many lengths, and the true position."""
    sizes = [round(abs(b - a) / STEP) for a, b in itertools.pairwise(turns)]
    way = np.repeat(np.sign(np.diff(turns)), sizes)
    true = turns[0] + STEP * np.append(0.0, np.cumsum(way))[:-1]
    read = true + noise * np.random.default_rng(0).normal(size=true.size)
    run = np.ones(true.size, dtype=np.int64)
    c = Conditions(
        position=read,
        position_unit="mm",
        run=run,
        direction=way,
        velocity=way * np.linspace(1.0, 9.0, way.size),
        since_reversal=distance_since_reversal(read, way, run, moving=True),
        moving=True,
    )
    return c, true


def dahl(true, distance):
    """Share of friction by Euler's steps of ``ds = (sign(dx) - s) |dx| / distance``."""
    share, found = 0.0, []
    for gone in np.diff(true, prepend=true[0]):
        for _ in range(5):
            share += (np.sign(gone) - share) * abs(gone) / 5.0 / distance
        found.append(share)
    return np.array(found)


@pytest.mark.parametrize("distance", [0.5, 3.0])
def test_friction_carried_over_a_reversal_is_that_of_dahl(distance):
    c, true = path()
    found = Coulomb().contribution(c, BuildUpShape(distance, carried=True), [20.0])
    assert found == pytest.approx(20.0 * dahl(true, distance), abs=20.0 * 2.0 * STEP / distance)
    assert np.abs(found).max() <= 20.0


def test_friction_from_nothing_has_grown_to_63_percent_a_distance_after_each_reversal():
    c, _ = path()
    found = Coulomb().columns(c, BuildUpShape(2.0))[:, 0]
    at_turn = c.since_reversal == 0.0
    assert at_turn.sum() == len(TURNS) - 1
    assert not found[at_turn].any()
    one = np.abs(c.since_reversal - 2.0) < STEP / 4.0
    assert found[one] == pytest.approx(c.direction[one] * 0.6321, abs=1e-3)


def test_noise_of_the_position_does_not_wear_the_build_up_down():
    c, _ = path()
    noisy, _ = path(noise=0.05)  # five steps: every other reading goes back
    assert (np.diff(noisy.position) * c.direction[1:] < 0.0).mean() > 0.4
    shape = BuildUpShape(1.0, carried=True)
    off = np.abs(Coulomb().columns(noisy, shape) - Coulomb().columns(c, shape))
    assert off.mean() < 0.02
    assert np.quantile(off, 0.99) < 0.3  # where a stroke begins, by the noise of its first reading


def test_the_second_run_starts_from_nothing():
    c, _ = path((0.0, 20.0, 10.0))
    second = replace(c, run=np.where(c.direction > 0, 1, 2))
    shape = BuildUpShape(1.0, carried=True)
    turn = int(np.argmax(c.direction < 0))
    assert Coulomb().columns(c, shape)[turn, 0] == pytest.approx(1.0, abs=0.02)
    assert Coulomb().columns(second, shape)[turn, 0] == 0.0


def test_a_part_of_the_readings_remembers_the_strokes_before_it():
    c, _ = path()
    rows = np.arange(4100, c.rows, 37)
    part = replace(c.take(rows), whole=c)
    shape = BuildUpShape(3.0, carried=True)
    assert Coulomb().columns(part, shape) == pytest.approx(Coulomb().columns(c, shape)[rows])


@pytest.mark.parametrize("carried", [False, True])
def test_what_holds_an_axis_at_rest_is_not_known(carried):
    c, _ = path()
    rest = np.where(np.arange(c.rows) % 7 == 0, 0.0, c.direction)
    assert not Coulomb().columns(replace(c, direction=rest), BuildUpShape(2.0, carried))[::7].any()


def test_friction_at_once_is_no_matter_of_choice():
    c, _ = path()
    shapes = Coulomb().shapes(c)
    assert shapes[0] == BuildUpShape()
    assert Coulomb().tried(c, shapes[0]) == 1.0
    assert Coulomb().tried(c, shapes[1]) == len(shapes) > 10
    assert Coulomb().variants(c, shapes[0]) == shapes
    assert Coulomb().variants(c, shapes[3]) == [BuildUpShape(), shapes[3]]
    assert {shape.carried for shape in shapes} == {False, True}
    ways = np.array([shape.distance for shape in shapes[1:] if not shape.carried])
    assert ways[-1] == pytest.approx(c.span / 30.0)
    assert (ways[1:] / ways[:-1]).max() <= 1.5 + 1e-9
    assert Coulomb().tunables(c, shapes[0]) == ()


def test_without_a_way_since_the_reversal_friction_is_there_at_once():
    c, _ = path()
    assert Coulomb().shapes(replace(c, since_reversal=None)) == [BuildUpShape()]
    assert Coulomb().shapes(replace(c, since_reversal=np.zeros(c.rows))) == [BuildUpShape()]


def test_at_one_speed_each_way_a_build_up_cannot_be_told_from_viscous_friction():
    c, _ = path()
    assert Coulomb().shapes(replace(c, velocity=5.0 * c.direction)) == [BuildUpShape()]


def test_friction_by_load_builds_up_alike():
    c, _ = path()
    load = np.linspace(1.0, 9.0, c.rows)
    shape = BuildUpShape(2.0, carried=True)
    expected = load[:, None] * Coulomb().columns(c, shape)
    assert LoadFriction().columns(replace(c, load=load), shape) == pytest.approx(expected)


@pytest.mark.parametrize("carried", [False, True])
def test_friction_that_falls_with_speed_builds_up_alike(carried):
    c, _ = path()
    over, left = BuildUpShape(2.0, carried), np.exp(-((c.velocity / 3.0) ** 2))
    found = Stribeck().columns(c, StribeckShape(2.0, carried, speed=3.0))[:, 0]
    assert found == pytest.approx(left * Coulomb().columns(c, over)[:, 0])


def test_speeds_are_scanned_and_each_costs_as_if_every_distance_had_been_tried():
    c, _ = path()
    at_once, build_ups = Stribeck().shapes(c), Coulomb().shapes(c)
    assert len(at_once) == len({shape.speed for shape in at_once}) > 5
    assert not any(shape.distance for shape in at_once)
    assert Stribeck().tried(c, at_once[2]) == len(at_once)
    soft = StribeckShape(0.5, True, speed=at_once[2].speed)
    assert Stribeck().tried(c, soft) == len(at_once) * len(build_ups)
    assert Stribeck().variants(c, soft) == [at_once[2], soft]
    assert Stribeck().variants(c, at_once[2]) == [at_once[2]]
    found = forms_of(Stribeck()).closer(c, at_once[2])
    assert [(s.distance, s.carried) for s in found] == [(s.distance, s.carried) for s in build_ups]
    assert {s.speed for s in found} == {at_once[2].speed}
    assert [t.name for t in Stribeck().tunables(c, soft)] == ["speed", "distance"]
    assert [t.name for t in Stribeck().tunables(c, at_once[2])] == ["speed"]
