"""Where the tool of three slides stands, beside products of whole transformations; and the way through a grid."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from volume import Volume, drawn_volume

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
