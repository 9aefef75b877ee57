"""Effects that somebody wrote: what their signature says, their scan, and what is said where they fail."""

import numpy as np
import pytest

import rtec
from rtec.effects import LIBRARY, Conditions, Units
from rtec.effects.own import as_effects
from rtec.effects.own_file import library_of_file
from rtec.errors import ArgumentError

X = np.linspace(0.0, 500.0, 101)


def conditions(**more):
    return Conditions(position=X, position_unit="mm", run=np.ones(X.size, dtype=np.int64), **more)


@rtec.effect(over="position")
def dent(position, *, place: rtec.Within(0, 500, "mm"), width: rtec.Within(2, 40, "mm")):
    """A dent in the way.

    Somebody dropped a part.
    """
    return np.exp(-(((position - place) / width) ** 2))


def test_the_function_is_what_a_unit_adds():
    shape = dent.shape_type(place=250.0, width=20.0)
    assert dent.contribution(conditions(), shape, [0.003]) == pytest.approx(0.003 * dent(X, place=250.0, width=20.0))
    assert dent.amplitudes(shape, Units("mm", "mm", "s"))[0].unit == "um"


def test_its_card_comes_from_its_docstring():
    assert (dent.card.title, dent.card.cause) == ("A dent in the way", "Somebody dropped a part.")
    assert dent.needs == "a position"


def test_no_dent_falls_between_two_shapes_of_the_scan():
    c = conditions()
    scanned = np.array([dent.columns(c, shape)[:, 0] for shape in dent.shapes(c)])
    scanned -= scanned.mean(axis=1, keepdims=True)
    scanned /= np.linalg.norm(scanned, axis=1, keepdims=True)
    rng = np.random.default_rng(0)
    for _ in range(200):
        column = dent(X, place=rng.uniform(20, 480), width=rng.uniform(6, 40))
        column = column - column.mean()
        assert (scanned @ column).max() / np.linalg.norm(column) > 0.93


def test_bounds_are_in_the_units_inside():
    assert rtec.Within(1, 50, "um").inside == (0.001, 0.05, "mm")
    assert rtec.Within(0.1, 2).inside == (0.1, 2.0, "")
    assert rtec.Within(1, 10, "min").inside == (60.0, 600.0, "s")


@pytest.mark.parametrize(
    ("low", "high", "unit", "says"),
    [(2, 1, "mm", "lower one first"), (0, float("inf"), "mm", "finite"), (0, 1, "mms", "did you mean")],
)
def test_bounds_that_are_none(low, high, unit, says):
    with pytest.raises(ArgumentError, match=says):
        rtec.Within(low, high, unit)


def nothing(*, place: rtec.Within(0, 1)):
    return place


def test_a_parameter_without_bounds_and_a_function_of_nothing():
    with pytest.raises(ArgumentError, match="place has no bounds"):
        rtec.effect(lambda position, *, place: position, name="x")
    with pytest.raises(ArgumentError, match="no quantity"):
        rtec.effect(nothing, name="x")
    with pytest.raises(ArgumentError, match="small letters"):
        rtec.effect(lambda position: position)
    with pytest.raises(ArgumentError, match="over= one of"):
        rtec.effect(over="colour")(dent.function)


@pytest.mark.parametrize(
    ("name", "more", "says"),
    [
        ("oil_level", {}, "no column oil_level"),
        ("temperature", {}, "no temperature column"),
        ("temperature", {"temperatures": {"temperature_a": X, "temperature_b": X}}, "say which"),
        ("time", {}, "no time column"),
        ("velocity", {}, "velocity"),
        ("direction", {"direction": np.ones(X.size)}, "the same at every reading"),
    ],
)
def test_what_the_data_lack_is_said(name, more, says):
    function = rtec.effect(eval(f"lambda {name}: {name}"), name="mine")  # noqa: S307 - a name of the table above
    assert says in function.untestable(conditions(**more))


def test_any_column_can_be_a_quantity():
    mine = rtec.effect(lambda oil_level: oil_level**2, name="mine")
    c = conditions(others={"oil_level": X})
    assert mine.untestable(c) is None
    assert mine.other_columns == {"oil_level"}
    assert mine.columns(c, mine.shapes(c)[0])[:, 0] == pytest.approx(X**2)


def fails(position, *, place: rtec.Within(0, 500, "mm")):
    if place > 100.0:
        raise ValueError("too far")
    return position


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (fails, r"test_effects_own.py, line \d+: ValueError: too far"),
        (lambda position: position[:-1], r"shape \(100,\)"),
        (lambda position: np.log(position - 250.0), "returns (nan|-inf)"),
        (lambda position: "x", "ValueError"),
    ],
)
def test_a_function_that_fails_is_told_with_its_line(function, says):
    mine = rtec.effect(function, name="mine")
    with pytest.raises(ArgumentError, match=says):
        mine.untestable(conditions())


def test_what_a_function_is_given_it_cannot_change():
    def greedy(position):
        position += 1.0
        return position

    with pytest.raises(ArgumentError, match="read-only"):
        rtec.effect(greedy).untestable(conditions())
    assert X[0] == 0.0


def test_names_are_not_taken_twice():
    scale = rtec.effect(lambda position: position, name="scale")
    with pytest.raises(ArgumentError, match="comes with rtec"):
        LIBRARY.with_own([scale])
    with pytest.raises(ArgumentError, match="is there already"):
        LIBRARY.with_own([dent, rtec.effect(dent.function)])
    assert LIBRARY.with_own([dent]).named("dent") is dent
    assert "dent" not in LIBRARY


def test_a_class_is_an_effect_as_well():
    class Lean(rtec.Effect):
        """Leans."""

        name = "lean"

        def columns(self, conditions, shape):
            return conditions.position[:, None]

    (lean,) = as_effects([Lean])
    assert lean.card.title == "Leans"
    with pytest.raises(ArgumentError, match="effects made by"):
        as_effects(["scale"])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("def x(:", "line 1 fails: SyntaxError"),
        ("import rtec\nraise OSError('gone')", "line 2 fails: OSError: gone"),
        ("import sys\nsys.exit(3)", "fails: SystemExit"),
        ("x = 3", "has no effect in it"),
    ],
)
def test_files_that_bring_none(tmp_path, text, says):
    file = tmp_path / "mine.py"
    file.write_text(text)
    with pytest.raises(ArgumentError, match=says):
        library_of_file(file)


def test_files_that_are_none(tmp_path):
    with pytest.raises(ArgumentError, match="is no file"):
        library_of_file(tmp_path / "gone.py")
    (tmp_path / "mine.txt").write_text("")
    with pytest.raises(ArgumentError, match="is no Python file"):
        library_of_file(tmp_path / "mine.txt")


@rtec.effect(over="temperature")
def snap(temperature, *, at: rtec.Within(0, 1000, "degC")):
    "A joint that snaps at some temperature."
    return np.where(temperature > at, 1.0, 0.0)


def test_a_scan_finds_what_shows_in_a_small_part_of_the_bounds_only():
    warm = conditions(temperatures={"temperature": np.linspace(20.0, 24.0, X.size)})
    places = [shape.at for shape in snap.shapes(warm)]
    assert len(places) >= 20
    assert min(places) < 20.5
    assert max(places) > 23.5


def test_a_scan_ends_where_a_parameter_changes_nothing():
    steady = conditions(temperatures={"temperature": np.full(X.size, 20.0)})
    assert snap.untestable(steady) == "it is the same at every reading"
