"""Where the tool of three slides stands, beside products of whole transformations; and the way through a grid."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from volume import Slide, Volume, drawn_volume, there_and_back

from rtec.errors import ArgumentError

TOOL = (20.0, -35.0, 110.0)


def by_transformations(volume, place, way):
    """Return the error by 4 x 4 matrices, one slide after the other from the bed to the tool."""
    whole = np.eye(4)
    for k, slide in enumerate(volume.slides):
        x = np.array([place[k]])
        step = np.eye(4)
        step[:3, :3] = Rotation.from_rotvec([float(turn(x)[0]) for turn in slide.turns]).as_matrix()
        step[:3, 3] = [float(shift(x)[0]) for shift in slide.shifts] + x[0] * np.array(slide.tilt_rad)
        step[k, 3] += x[0] + (slide.backlash_mm if way[k] < 0 else 0.0)
        whole = whole @ step
    return (whole @ [*volume.tool_mm, 1.0])[:3] - place - np.array(volume.tool_mm)


@pytest.mark.parametrize("seed", range(4))
def test_the_tool_stands_where_the_transformations_bring_it(seed):
    drawn = drawn_volume(seed)
    volume = Volume(slides=drawn.slides, tool_mm=TOOL)
    rng = np.random.default_rng(seed)
    places, ways = rng.uniform(0.0, 300.0, (40, 3)), rng.choice([-1.0, 1.0], (40, 3))
    expected = [by_transformations(volume, *row) for row in zip(places, ways, strict=True)]
    found = volume.error_mm(places, ways)
    assert np.abs(found).max() > 1e-3
    # angles of some 30 µrad, twice of each other, over 300 mm: 0.3 nm
    assert found == pytest.approx(np.array(expected), abs=1e-6)


def test_a_drawn_machine_is_the_same_for_a_seed():
    place, way = np.array([[100.0, 50.0, 250.0]]), np.ones((1, 3))
    assert drawn_volume(7).error_mm(place, way).tolist() == drawn_volume(7).error_mm(place, way).tolist()
    assert drawn_volume(7).error_mm(place, way).tolist() != drawn_volume(8).error_mm(place, way).tolist()


def test_the_way_there_and_back_visits_each_place_from_both_sides():
    grid = ([0.0, 1.0, 2.0], [0.0, 5.0], [0.0, 7.0])
    way = there_and_back(*grid)
    assert len(way) == 24
    assert set(way[:12]) == set(way[12:]) == {(x, y, z) for x in grid[0] for y in grid[1] for z in grid[2]}
    for before, after in pairwise(way):
        assert sum(a != b for a, b in zip(before, after, strict=True)) <= 1  # one axis at a time


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        (lambda: Slide(tilt_rad=(1.0, 0.0, 0.0)), "tilt_rad"),
        (lambda: Slide(shifts=()), "shifts"),
        (lambda: Slide(backlash_mm=-1.0), "backlash_mm"),
        (lambda: Volume(slides=(Slide(),)), "slides"),
        (lambda: Volume(slides=(Slide(tilt_rad=(1e-5, 0.0, 0.0)), Slide(), Slide())), "tilt_rad of axis 1"),
        (lambda: Volume(slides=(Slide(), Slide(), Slide()), tool_mm=(0.0, np.inf, 0.0)), "tool_mm"),
    ],
)
def test_a_machine_that_cannot_be(wrong, says):
    with pytest.raises(ArgumentError, match=says):
        wrong()
