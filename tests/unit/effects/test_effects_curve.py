"""Curves over anything: their columns draw smooth functions, and only over what the data have."""

import numpy as np
import pytest

from rtec.effects import LIBRARY, Conditions
from rtec.effects.curve import Curve
from rtec.errors import ArgumentError

N = 400
RNG = np.random.default_rng(3)
VELOCITY = RNG.uniform(-60.0, 60.0, N)
PLACE = RNG.uniform(0.0, 300.0, N)
WAY = np.sign(VELOCITY)
DATA = Conditions(
    position=PLACE, position_unit="mm", run=np.ones(N, dtype=np.int64), velocity=VELOCITY, direction=WAY,
    time_s=np.arange(N) * 2.0, others={"oil_level": RNG.uniform(0.0, 1.0, N)},
)  # fmt: skip


def left(curve, values):
    """Return the smallest share of the variance that any shape of a curve leaves."""
    found = []
    for shape in curve.shapes(DATA):
        columns = np.column_stack([curve.columns(DATA, shape), np.ones(N)])
        rest = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
        found.append(float(np.var(rest) / np.var(values)))
    return min(found)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("velocity", VELOCITY * np.abs(VELOCITY)),
        ("position", np.sin(PLACE / 60.0)),
        ("position*direction", np.where(WAY > 0, np.sin(PLACE / 60.0), np.cos(PLACE / 90.0))),
        ("position*time", np.sin(PLACE / 100.0) * np.exp(-DATA.time_s / 400.0)),
        ("oil_level", DATA.others["oil_level"] ** 2),
    ],
)
def test_a_curve_draws_what_depends_on_its_quantities(text, values):
    assert left(Curve(text), values) < 0.003
    assert left(Curve("time"), values) > 0.3 or "time" in text


def test_a_curve_by_name():
    assert LIBRARY.named("curve:position*direction").text == "position*direction"
    assert "curve" not in LIBRARY
    with pytest.raises(ArgumentError, match="one quantity or two"):
        LIBRARY.named("curve:position*time*velocity")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "over something"),
        ("pressure", "no pressure"),
        ("acceleration", "no moving data"),
        ("run", "never changes"),
    ],
)
def test_what_the_data_lack(text, says):
    assert says in Curve(text).untestable(DATA)


def test_beyond_its_nodes_a_curve_stays_what_it_is():
    curve = Curve("velocity")
    shape = curve.shapes(DATA)[-1]
    far = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64),
                     velocity=np.array([shape.nodes[-1], 1e6]))  # fmt: skip
    at_end, beyond = curve.columns(far, shape)
    assert at_end == pytest.approx(beyond)
