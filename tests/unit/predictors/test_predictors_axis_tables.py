"""Sums of tables of several axes: what they say, and what they refuse."""

import numpy as np
import pytest

from rtec.errors import ArgumentError, FileFormatError
from rtec.predictors import AxisTables, Cautious, KnownPredictor, read_predictor, write_predictor
from rtec.predictors.axis_tables import AxisTable
from rtec.predictors.binding import bound, check_axis
from rtec.predictors.curve import NoError
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks

X = np.array([-10.0, 20.0, 35.0, 300.0])
FORWARD, REVERSE = np.array([0.0, 3.0, -2.0, 5.0]) * 1e-3, np.array([4.0, 7.0, 3.0, 9.0]) * 1e-3
Y, BENT = np.array([-5.0, 100.0, 250.0]), np.array([-1.0, 2.0, 8.0]) * 1e-3
ANGLE = np.array([1e-5, -2e-5, 5e-6])
TABLES = AxisTables(
    tables=(
        AxisTable(of="position", positions_mm=X, values=FORWARD, direction=1),
        AxisTable(of="position", positions_mm=X, values=REVERSE, direction=-1),
        AxisTable(of="position_2", positions_mm=Y, values=BENT),
        AxisTable(of="position_2", positions_mm=Y, values=ANGLE, arm="position_12", arm_mm=(0.0, 80.0)),
    ),
    range_mm=(-10.0, 300.0),
)


def by_the_words(x, way, y, z):
    own = np.interp(x, X, FORWARD if way > 0 else REVERSE)
    return own + np.interp(y, Y, BENT) + np.interp(y, Y, ANGLE) * (np.clip(z, 0.0, 80.0) - 40.0)


def test_a_sum_says_what_its_tables_add_up_to():
    rng = np.random.default_rng(1)
    x, y, z = (rng.uniform(-60.0, 400.0, 300) for _ in range(3))
    way = rng.choice([-1, 1], 300)
    expected = [by_the_words(*row) for row in zip(x, way, y, z, strict=True)]
    assert TABLES.inputs == ("position", "direction", "position_2", "position_12")
    assert TABLES.error_mm(x, way, y, z) == pytest.approx(expected, abs=1e-15)


def test_places_of_other_axes_broadcast():
    both = TABLES.error_mm([[0.0], [50.0]], 1, [0.0, 100.0, 200.0], 40.0)
    assert both.shape == (2, 3)
    assert both[1, 2] == pytest.approx(by_the_words(50.0, 1, 200.0, 40.0), abs=1e-15)


def test_how_many_axes_it_looks_at_is_said():
    with pytest.raises(ArgumentError, match="position_2, position_12"):
        TABLES.error_mm(0.0, 1)
    with pytest.raises(ArgumentError, match="1 columns; use none"):
        NoError().error_mm(0.0, 1, 5.0)
    with pytest.raises(ArgumentError, match="position_12"):
        TABLES.error_mm(0.0, 1, 5.0, np.nan)


def test_the_loops_ask_it_only_where_it_was_made():
    """A model bound to the sensors has the ends of other axes, a millimetre wider; those of its own it holds."""
    _, _, wanted, low, high, *_ = bound(TABLES)
    assert wanted.tolist() == [0, 1, 5, 15]
    assert low.tolist() == [-np.inf, -np.inf, -6.0, -1.0]
    assert high.tolist() == [np.inf, np.inf, 251.0, 81.0]


def test_a_predictor_of_another_axis_is_refused():
    check_axis(TABLES, 1)
    with pytest.raises(ArgumentError, match="model of axis 2"):
        check_axis(TABLES, 2)


def test_less_is_believed_of_it_too():
    careful = Cautious(predictor=TABLES, unsure_mm=0.001)
    assert careful.inputs == TABLES.inputs
    sure = TABLES.error_mm(35.0, -1, 250.0, 0.0)
    assert careful.error_mm(35.0, -1, 250.0, 0.0) == pytest.approx(sure - 0.001, abs=1e-12)


def test_networks_look_at_other_axes_within_their_ends():
    network = LayeredNetwork(
        inputs=("position_3", "direction", "position"),
        middle=[100.0, 0.5, 0.0],
        half=[50.0, 0.5, 10.0],
        hidden=(2,),
        weights=[1.0, -2.0, 0.5, 0.25, 0.3, 0.7, 0.1, -0.1, 3.0, -4.0, 0.2],
        bias_mm=0.001,
        factor_mm=0.002,
    )
    predictor = TrainedNetworks(networks=(network,), range_mm=(-10.0, 10.0))

    def says(x, way, z):
        seen = np.array(
            [(np.clip(z, 50.0, 150.0) - 100.0) / 50.0, 1.0 if way < 0 else -1.0, np.clip(x, -10, 10) / 10.0]
        )
        hidden = 1.0 / (
            1.0 + np.exp(-(np.array(seen) @ np.reshape([1.0, -2.0, 0.5, 0.25, 0.3, 0.7], (3, 2)) + [0.1, -0.1]))
        )
        return 0.001 + 0.002 * (hidden @ [3.0, -4.0] + 0.2)

    assert predictor.inputs == ("position", "direction", "position_3")
    for x, way, z in ((3.0, 1, 70.0), (-4.0, -1, 149.0), (99.0, 1, 10.0), (0.0, -1, 400.0)):
        assert predictor.error_mm(x, way, z) == pytest.approx(says(x, way, z), abs=1e-15)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"of": "direction"}, "of"),
        ({"of": "position_16"}, "position_16"),
        ({"arm": 3}, "arm"),
        ({"direction": 2}, "direction"),
        ({"positions_mm": [0.0, 0.0]}, "positions_mm, row 2"),
        ({"values": [1.0]}, "values"),
        ({"arm_mm": (5.0, 5.0)}, "arm_mm"),
    ],
)
def test_a_table_that_cannot_be(changes, says):
    good = {"of": "position_2", "positions_mm": [0.0, 1.0], "values": [0.0, 1e-3]}
    with pytest.raises(ArgumentError, match=says):
        AxisTable(**(good | changes))


def test_a_file_gives_back_the_same_numbers(tmp_path):
    file = tmp_path / "p.toml"
    write_predictor(file, KnownPredictor(predictor=TABLES, name="angles", source="g.csv", interval_mm=0.002, axis=1))
    known = read_predictor(file)
    assert known.predictor == TABLES
    assert (known.axis, known.interval_mm) == (1, 0.002)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("axis = 1", "axis = 16", "axis"),
        ("axis = 1", 'axis = "x"', "axis"),
        ('of = "position_2"', 'of = "position_0"', "of"),
        ('of = "position_2"', "of = 2", "of"),
        ('arm = "position_12"\n', "", "errors_mm"),
        ('direction = "forward"', 'direction = "up"', "direction"),
        ("arm_mm = [0.0, 80.0]", "arm_mm = [80.0, 0.0]", "arm_mm"),
        ("angles_rad", "angles_deg", "angles_deg"),
        ("angles_rad = [1e-05, ", "angles_rad = [", "angles_rad"),
        ("angles_rad = [1e-05", "angles_rad = [nan", "angles_rad"),
    ],
)
def test_a_bad_file_gives_one_error_with_its_key(tmp_path, old, new, says):
    file = tmp_path / "p.toml"
    write_predictor(file, KnownPredictor(predictor=TABLES, name="angles", axis=1))
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises((ArgumentError, FileFormatError), match=says) as error:
        read_predictor(file)
    assert "p.toml" in str(error.value)
