"""The circle test: figures against formulas, errors of machines made here, files, and what is refused."""

import numpy as np
import pytest
from ballbar_games import Game
from scipy.optimize import minimize

from rtec.errors import ArgumentError, FileFormatError
from rtec.metrology.ballbar import analysed, circle_test, circularity
from rtec.metrology.ballbar.circularity import circular_deviation
from rtec.metrology.ballbar.reading import Stated, read_circle_test

WAY = np.arange(0.0, 360.0, 0.5)
T = np.radians(WAY)
SENSES = np.repeat([1.0, -1.0], WAY.size)


def both(one, other=None, radius_mm=150.0, noise=0.0, **more):
    deviation = np.concatenate([one, one if other is None else other])
    deviation = deviation + np.random.default_rng(5).normal(0.0, 1.0, deviation.size) * noise
    return circle_test(np.tile(WAY, 2), deviation, SENSES, radius_mm=radius_mm, **more)


def test_circular_deviation_is_the_least_of_any_centre():
    angle = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, 300)
    deviation = np.random.default_rng(4).normal(0.0, 2.0, 300) + 40.0 * np.cos(angle - 1.0)

    def size(centre):
        return np.ptp(deviation - centre[0] * np.cos(angle) - centre[1] * np.sin(angle))

    starts = [(20.0, 30.0), (21.6, 33.7), (22.0, 34.0)]
    found = min(minimize(size, s, method="Nelder-Mead", options={"maxiter": 4000, "xatol": 1e-9}).fun for s in starts)
    assert circular_deviation(angle, deviation) == pytest.approx(found, abs=1e-3)


def test_figures_of_two_ovals():
    found = circularity(both(3.0 * np.sin(2 * T) + 7.0, -3.0 * np.sin(2 * T) + 7.0))
    assert found.counter_clockwise == pytest.approx(6.0, abs=0.01)
    assert found.clockwise == pytest.approx(6.0, abs=0.01)
    assert found.both == pytest.approx(6.0, abs=0.01)
    assert found.mean_radial == pytest.approx(7.0, abs=1e-9)
    assert (found.least_radial, found.largest_radial) == pytest.approx((4.0, 10.0), abs=1e-6)
    assert found.diagonals == pytest.approx(0.0, abs=0.1)


def test_squareness_by_the_diagonals_and_diameters_beside_the_reversals():
    skew = 100e-6 * 150e3 / 2.0  # 100 um/m on a radius of 150 mm
    found = circularity(both(skew * np.sin(2 * T) + 5.0 * np.cos(2 * T) + 30.0 * np.isin(WAY, [0, 90, 180, 270])))
    assert found.diagonals == pytest.approx(100.0, rel=0.01)
    assert found.diameters[0] == pytest.approx(10.0, abs=0.6)
    assert found.diameters[1] == pytest.approx(-10.0, abs=0.6)


ONE_OF_EACH = [
    "backlash x", "reversal spike y", "lateral play x", "cyclic error y", "servo mismatch", "squareness",
    "scaling mismatch", "straightness x", "radius change", "vibration", "stick-slip x", "master-slave change-over",
]  # fmt: skip


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", ONE_OF_EACH)
def test_an_error_of_a_machine_is_named_alone(name):
    assert Game([name], seed=31, sigmas=4.0).answer() == [name]


def test_three_errors_at_once_and_none():
    names = ["backlash x", "servo mismatch", "squareness"]
    assert sorted(Game(names, seed=2, sigmas=6.0).answer()) == names
    assert Game([], seed=3).answer() == []


def found_of(game):
    data = game.recorded()
    return analysed(
        circle_test(data["angle"], data["deviation"], data["sense"], radius_mm=game.radius, feed_mm_s=game.feed)
    )


def test_values_are_those_that_were_put_in():
    game = Game(["servo mismatch", "squareness", "backlash y", "cyclic error x"], seed=8, sigmas=15.0)
    errors = {error.name: error for error in found_of(game).errors}
    radial = {name: 1e3 * game.size(name) for name in game.names}
    assert errors["backlash y"].value == pytest.approx(radial["backlash y"], rel=0.05)
    assert errors["squareness"].value == pytest.approx(2e3 * radial["squareness"] / game.radius, rel=0.05)
    assert errors["servo mismatch"].unit == "ms"
    assert errors["servo mismatch"].value == pytest.approx(2.0 * radial["servo mismatch"] / game.feed, rel=0.05)
    assert errors["cyclic error x"].value == pytest.approx(abs(radial["cyclic error x"]), rel=0.05)
    period = game.radius / (2.0 + 18.0 * game.numbers["cyclic error x"][0] ** 2)
    assert errors["cyclic error x"].details["period_mm"] == pytest.approx(period, rel=0.01)
    assert sum(error.share for error in errors.values()) == pytest.approx(1.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_backlash_that_differs_at_both_ends(sign):
    one = sign * 0.5 * (5.0 + 3.0 * np.cos(T)) * np.cos(T) * np.where(WAY < 180.0, 1.0, -1.0)
    (error,) = analysed(both(one, -one, noise=0.1)).errors
    assert error.name == "backlash x"
    assert error.details["at_positive_end_um"] == pytest.approx(8.0 * sign, abs=0.1)
    assert error.details["at_negative_end_um"] == pytest.approx(2.0 * sign, abs=0.1)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_scale_of_one_axis_is_one_error(axis):
    shape = 6.0 * (np.cos(T) if axis == "x" else np.sin(T)) ** 2
    (error,) = analysed(both(shape, noise=0.3)).errors
    assert error.name == "scaling mismatch"
    assert error.value == pytest.approx(12.0 if axis == "x" else -12.0, rel=0.02)  # of the diameters
    assert error.share == 1.0
    names = [e.name for e in analysed(both(shape - 5.0, noise=0.3)).errors]
    assert sorted(names) == ["radius change", "scaling mismatch"]


def test_a_centre_that_is_far_off_shows_no_oval():
    length = np.hypot(100.0 * np.cos(T) + 0.5, 100.0 * np.sin(T) - 0.3)
    found = analysed(both(1e3 * (length - 100.0), radius_mm=100.0, noise=0.05))
    assert found.errors == ()
    assert found.figures.centre == pytest.approx((500.0, -300.0), abs=0.1)
    assert found.figures.both < 0.5


def test_without_a_feed_servo_mismatch_is_a_length():
    (error,) = analysed(both(4.0 * np.sin(2 * T), -4.0 * np.sin(2 * T), noise=0.2)).errors
    assert (error.name, error.unit) == ("servo mismatch", "um")
    assert error.value == pytest.approx(4.0, abs=0.05)


def test_single_readings_that_stand_out_give_no_name():
    noise = np.zeros(WAY.size)
    noise[[33, 200, 511]] = 40.0
    assert analysed(both(noise, noise[::-1], noise=0.3)).errors == ()


def test_the_document_has_the_keys_of_the_contract():
    document = analysed(both(4.0 * np.sin(2 * T), noise=0.2)).document()
    assert {"G", "G_b", "D", "F", "errors"} <= set(document)
    assert {"name", "value", "unit", "share"} <= set(document["errors"][0])


def rows(angle=WAY, deviation=None, senses=("1", "-1")):
    values = 2.0 * np.sin(2.0 * np.radians(angle)) if deviation is None else deviation
    return "\n".join(f"{a:.3f},{d:.4f},{s}" for s in senses for a, d in zip(angle, values, strict=True))


HEAD = "# radius: 150 mm\n# feed: 1000 mm/min\nangle_deg,deviation_um,sense\n"


@pytest.fixture
def read(tmp_path):
    def from_text(text, **stated):
        (tmp_path / "circle.csv").write_text(text)
        return read_circle_test(tmp_path / "circle.csv", Stated(**stated))

    return from_text


def test_tables_of_angle_and_radius(read):
    plain = read(HEAD + rows())
    assert (plain.radius_mm, plain.points_a_revolution) == (150.0, 720)
    assert plain.feed_mm_s == pytest.approx(1000.0 / 60.0)
    words = read(HEAD + rows(senses=("ccw", "cw")))
    np.testing.assert_array_equal(words.sense, plain.sense)
    lengths = "\n".join(
        f"{a};{str(150.0 + 2e-3 * np.sin(2 * np.radians(a))).replace('.', ',')};{s}"
        for s in (1, -1)
        for a in range(360)
    )
    radii = read("Winkel [deg];Radius [mm];Drehsinn\n" + lengths)
    assert radii.radius_known is False
    assert radii.radius_mm == pytest.approx(150.0)
    assert circularity(radii).both == pytest.approx(4.0, abs=0.01)
    assert read("Winkel [deg];Radius [mm];Drehsinn\n" + lengths, radius_mm=149.9).deviation_um.mean() > 99.0


def test_a_table_by_angle_with_both_senses_in_turn(read):
    values = 2.0 * np.sin(2.0 * T)
    text = "\n".join(f"{a},{v:.4f},1\n{a},{-v:.4f},-1" for a, v in zip(WAY, values, strict=True))
    test = read("# radius: 150 mm\nAngle [deg],Radius deviation [um],Direction\n" + text)
    assert test.points_a_revolution == 720
    np.testing.assert_allclose(test.deviation_um, np.concatenate([values, -values]), atol=1e-4)


def test_overshoot_arcs_are_cut_off(read):
    long = np.arange(-45.0, 405.0, 0.5)
    test = read(HEAD + rows(long))
    assert test.points_a_revolution == 720
    assert any("overshoot arcs are cut off: 45" in note for note in test.notes)


def test_a_log_of_two_axes(read):
    game = Game(["squareness"], seed=4, sigmas=20.0)
    way = np.radians(np.arange(-30.0, 390.0, 0.4))
    lines = ["time_s,target_x_mm,actual_x_mm,target_z_mm,actual_z_mm"]
    clock = 0.0
    for turn in (way, way[::-1]):
        start = np.array([np.cos(turn[0]), np.sin(turn[0])])
        feed_in = [start * (100.0 + k / 10.0) for k in range(50, 0, -1)]  # along the radius
        points = [*feed_in, *[100.0 * np.array([np.cos(t), np.sin(t)]) for t in turn]]
        for x, z in points:
            clock += 0.01
            lines.append(f"{clock:.2f},{x + 7:.6f},{x + 1e-4 * z + 7:.6f},{z - 3:.6f},{z - 3:.6f}")
    test = read("\n".join(lines), axes="xz")
    assert test.radius_mm == pytest.approx(100.0, abs=1e-5)
    assert test.feed_mm_s == pytest.approx(100.0 * np.radians(0.4) / 0.01, rel=1e-3)
    (error,) = analysed(test).errors
    assert error.name == "squareness"
    assert error.value == pytest.approx(100.0, rel=0.01)
    assert game.radius > 0.0


BAD = {
    "no sense": ("# radius: 150 mm\nangle_deg,deviation_um\n" + "\n".join(f"{a},1" for a in WAY), "no column sense"),
    "one sense": (HEAD + rows(senses=("1",)), "has no clockwise revolution"),
    "radius 0": (HEAD.replace("150", "0") + rows(), "radius: 0 mm"),
    "no radius": (HEAD.split("\n", 1)[1] + rows(), "--radius is missing"),
    "radius without unit": (HEAD.replace("150 mm", "150") + rows(), "radius.*150"),
    "no unit": (HEAD.replace("angle_deg", "angle") + rows(), "'angle' has no unit"),
    "no unit of deviation": (HEAD.replace("deviation_um", "deviation") + rows(), "'deviation' has no unit"),
    "an arc": (HEAD + rows(np.arange(0.0, 220.0, 0.5)), "covers 220 deg only"),
    "NaN": (HEAD + rows().replace("0.0349", "nan"), "nan|finite"),
    "constant": (HEAD + rows(deviation=np.ones(WAY.size)), "is the same everywhere"),
    "a gap": (HEAD + rows(WAY[(WAY < 100) | (WAY > 130)]), "jumps 31 deg"),
    "few points": (HEAD + rows(np.arange(0.0, 360.0, 6.0)), "60 points"),
    "another sense": (HEAD + rows(senses=("1", "left")), "'left' is no sense"),
    "metres": (HEAD.replace("um", "m") + rows(), "goes up to 2000 mm"),
    "nothing of a circle": ("time_s,current_a\n0,1\n1,2\n", "no axis x and no angle"),
    "no circle": ("time_s,target_x_mm,actual_x_mm,target_y_mm,actual_y_mm\n"
                  + "\n".join(f"{k},{k},{k},{2 * k},{2 * k}" for k in range(300)), "hold no arc"),
}  # fmt: skip


@pytest.mark.parametrize("text, problem", BAD.values(), ids=BAD)
def test_what_is_refused(read, text, problem):
    with pytest.raises((ArgumentError, FileFormatError), match=problem) as caught:
        read(text)
    assert "\n" not in str(caught.value)
