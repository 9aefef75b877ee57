"""The library as a whole: names, cards, confounded effects, invariants that hold for every effect, and its page."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtec.effects import LIBRARY, Conditions, HeatShape, Observable, Shape, Units, effect_named
from rtec.effects.gravity import LEAST_SPAN_DEG
from rtec.effects.library import CAPTURE_EFFECTS
from rtec.effects.lost_counts import StepShape
from rtec.effects.run_offset import MOST_RUNS
from rtec.effects.thermal_growth import GrowthShape
from rtec.effects.windup import WindupShape
from rtec.errors import ArgumentError
from rtec.inference.forms import forms_of
from tools import effects_page, look_alikes

ROOT = Path(__file__).parents[3]
NAMES = (
    "offset scale pitch_map cyclic backlash backlash_map windup reversal_spike hysteresis "
    "thermal_growth thermal_shift warm_up warm_up_growth run_offset refraction dead_path drift servo_lag "
    "acceleration_lag interpolation eccentricity lost_counts quantisation cosine "
    "inertia viscous coulomb asymmetric_friction stribeck force_offset cogging gravity force_map load_friction"
).split()
DRIVE = set(NAMES[24:])
UNITS = [Units("mm", "mm", "s"), Units("deg", "deg", "reading"), Units("n", "mm", "s"), Units("a", "deg", "s")]


def identity(effect):
    return effect.name


@pytest.fixture(scope="session")
def everything(bidirectional):
    """Conditions with every column, at which every effect can be tested."""
    targets = np.linspace(3.0, 397.0, 21) + np.random.default_rng(5).uniform(-5, 5, 21)
    rows = 210
    direction = bidirectional(targets).direction
    speed = np.tile([0.5, 2.0, 10.0, 50.0, 100.0, 7.0], 35)
    return bidirectional(
        targets,
        velocity=direction * speed,
        acceleration=np.random.default_rng(6).normal(size=rows),
        temperatures={"temperature": np.linspace(20.0, 26.0, rows), "air": np.linspace(22.0, 20.0, rows)},
        signal_period=0.02,
        revolution=360.0,
        pressure_hpa=np.linspace(990.0, 1020.0, rows),
        load=np.linspace(5.0, 50.0, rows),
    )


def test_the_library_holds_the_effects_in_the_agreed_order():
    assert [effect.name for effect in LIBRARY] == NAMES
    assert {effect.name for effect in LIBRARY if effect.observable is Observable.DRIVE} == DRIVE


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(ArgumentError, match="did you mean 'thermal_growth'"):
        effect_named("thermal_grwth")
    with pytest.raises(ArgumentError, match="known: offset, scale"):
        effect_named("?" * 10_000)


@pytest.mark.parametrize("name", ["phase_error", "duty_error", "jitter", "glitch", "bounce", "missed_edge", "skew"])
def test_effects_of_captures_say_where_they_belong(name):
    assert name in CAPTURE_EFFECTS
    with pytest.raises(ArgumentError, match=f"{name} belongs to captures"):
        effect_named(name)


@pytest.mark.parametrize("effect", LIBRARY, ids=identity)
def test_every_card_is_filled_in(effect):
    card = effect.card
    assert "card" in vars(type(effect)) | vars(effect), "not that of its base"
    for part in (card.title, card.plot, card.cause, card.consequence, card.action, card.invariant_to, card.source):
        assert part.strip() == part
        assert len(part) > 4
    for sentence in (card.plot, card.cause, card.consequence, card.action, card.invariant_to, card.source):
        assert sentence.endswith("."), sentence
        assert len(sentence) > 15
    assert effect.needs


@pytest.mark.parametrize("effect", LIBRARY, ids=identity)
def test_confounded_effects_name_each_other_with_one_experiment(effect):
    for rival in effect.rivals:
        other = effect_named(rival.name)
        assert other.observable is effect.observable
        (back,) = [again for again in other.rivals if again.name == effect.name]
        assert back.experiment == rival.experiment
        assert back.permanent is rival.permanent
        assert len(rival.experiment) > 40


def test_cosine_is_not_identifiable_and_a_weight_on_a_linear_axis():
    permanent = {(effect.name, rival.name) for effect in LIBRARY for rival in effect.rivals if rival.permanent}
    assert permanent == {("scale", "cosine"), ("cosine", "scale")}
    lengths = {(effect.name, rival.name) for effect in LIBRARY for rival in effect.rivals if rival.on_lengths}
    assert lengths == {("force_offset", "gravity"), ("gravity", "force_offset")}
    for unit, ranked in (("mm", False), ("deg", True)):
        c = Conditions(position=np.linspace(0.0, 90.0, 9), position_unit=unit, run=np.ones(9, dtype=np.int64))
        weight, constant = effect_named("gravity"), effect_named("force_offset")
        for one, other in ((weight, constant), (constant, weight)):
            (found,) = [rival for rival in one.rivals if rival.name == other.name]
            assert found.lasts(c) is not ranked


@pytest.mark.parametrize("effect", LIBRARY, ids=identity)
def test_simpler_effects_are_of_the_library_and_observed_alike(effect):
    for name in forms_of(effect).contains:
        assert effect_named(name).observable is effect.observable


@pytest.mark.parametrize("effect", LIBRARY, ids=identity)
def test_a_shape_is_chosen_from_as_many_as_are_tried(effect, everything):
    """At least one; a stated period is one of few, a scanned one of as many as the scan has."""
    shapes = effect.shapes(everything)
    assert all(effect.tried(everything, shape) >= 1.0 for shape in shapes)
    # their scan holds the richest form only; of viscous friction a straight line is no choice, of heat no lag
    free = ("gravity", "eccentricity", "viscous", "thermal_shift", "thermal_growth")
    if not effect.is_wave and effect.name not in free:
        assert effect.tried(everything, shapes[0]) == len(shapes)
        assert all(forms_of(effect).doubtful(everything, shape) is None for shape in shapes)


@pytest.mark.parametrize("effect", LIBRARY, ids=identity)
def test_columns_scan_and_contribution_agree(effect, everything):
    # over one turn of a rotary axis there is no map: its end is its beginning
    if effect.name == "hysteresis":  # of a log
        ways = np.sin(np.arange(210) / 8.0) * np.where(np.arange(210) < 100, 20.0, 150.0)
        everything = replace(everything, moving=True, position=ways, direction=np.sign(np.gradient(ways)))
    fit = {"revolution": None} if effect.is_map else {}
    assert effect.untestable(replace(everything, **fit)) is None
    turning = effect.name == "gravity"  # another effect on a linear axis
    if turning:
        everything = replace(everything, position_unit="deg")
    shapes = list(effect.shapes(everything))
    assert shapes
    for shape in shapes[:: max(1, len(shapes) // 7)]:
        assert type(shape) is effect.shape_type
        columns = effect.columns(everything, shape)
        assert columns.dtype == np.float64
        assert columns.shape[0] == everything.rows
        assert np.isfinite(columns).all()
        assert np.abs(columns).max() > 0
        for units in (one for one in UNITS if not turning or one.position == "deg"):
            assert len(effect.amplitudes(shape, units)) == columns.shape[1]
        values = np.linspace(-1.0, 2.0, columns.shape[1])
        by_hand = sum(value * column for value, column in zip(values, columns.T, strict=True))
        assert effect.contribution(everything, shape, values) == pytest.approx(
            by_hand, abs=1e-9 * np.abs(by_hand).max()
        )


@pytest.mark.parametrize("effect", LIBRARY, ids=identity)
def test_a_scan_holds_the_columns_of_each_shape(effect, everything):
    shapes = list(effect.shapes(everything))
    width = effect.columns(everything, shapes[0]).shape[1]
    alike = [shape for shape in shapes if effect.columns(everything, shape).shape[1] == width]
    scan = effect.scan(everything, alike)
    assert scan.shape == (len(alike), width, everything.rows)
    for found, shape in zip(scan, alike, strict=True):
        expected = effect.columns(everything, shape).T
        assert np.abs(found - expected).max() <= 1e-9 * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("effect", LIBRARY, ids=identity)
def test_variants_hold_the_shape_or_its_wave_and_refits_stay_near_it(effect, everything):
    shape = list(effect.shapes(everything))[1 % len(effect.shapes(everything))]
    variants = effect.variants(everything, shape)
    if effect.name == "cogging":
        # snapped to whole cycles a turn, by less than the data can tell
        away = [abs(1 / variant.period - 1 / shape.period) * everything.span for variant in variants]
        assert min(away) <= 0.5
    else:
        assert any(variant == shape for variant in variants)
    for variant in variants:
        for tunable in effect.tunables(everything, variant):
            least = getattr(effect.shape_type(), tunable.name)  # 0 of what may be nothing, as an overshoot
            assert min(0.0, least) <= tunable.low <= getattr(variant, tunable.name) < tunable.high
            assert tunable.low > 0.0 or least == 0.0


@pytest.mark.parametrize("effect", LIBRARY, ids=identity)
def test_data_that_lack_a_column_are_refused_in_words(effect):
    """A model may name an effect that the data cannot hold: an answer or a clear error, never a traceback."""
    c = Conditions(position=np.array([0.0, 5.0, 10.0]), position_unit="mm", run=np.ones(3, dtype=np.int64))
    reason = effect.untestable(c)
    assert reason is None or len(reason) > 8
    shape = effect.shape_type()
    if effect.name in ("pitch_map", "backlash_map", "force_map"):
        shape = effect.shape_type((0.0, 5.0, 10.0))
    try:
        columns = effect.columns(c, shape)
    except ArgumentError as error:
        assert "data" in str(error)
        assert reason is not None
    else:
        assert columns.shape[0] == c.rows


@pytest.mark.parametrize("effect", [e for e in LIBRARY if e.shape_type is not Shape], ids=identity)
def test_a_foreign_shape_is_refused(effect, everything):
    with pytest.raises(ArgumentError, match=effect.shape_type.__name__):
        effect.columns(everything, Shape())


def test_importing_the_room_loads_no_heavy_library():
    heavy = ("scipy", "numba", "matplotlib", "pint", "lmfit")
    code = f"import sys, rtec.effects; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_needs_state_the_limits_of_the_code():
    limits = {"thermal_growth": "0.5 K", "thermal_shift": "0.5 K"}
    limits |= {"run_offset": f"{MOST_RUNS} at most", "gravity": f"{LEAST_SPAN_DEG:g} deg"}
    assert all(words in effect_named(name).needs for name, words in limits.items())


def test_the_pages_are_those_of_the_library():
    written = effects_page.PAGE.read_text(encoding="utf-8")
    assert written == effects_page.page(written), "python -m tools.effects_page"
    assert re.findall(r"^\| `(\w+)` \|", written, re.MULTILINE)[: len(NAMES)] == NAMES
    assert (ROOT / "docs" / "look-alikes.md").read_text(encoding="utf-8") == look_alikes.page()


@pytest.mark.parametrize(
    "name, idle, there, read",
    [
        ("thermal_growth", GrowthShape("s"), GrowthShape("s", 60.0), ("lag", 60.0, "s")),
        ("thermal_shift", HeatShape("s"), HeatShape("s", 60.0), ("lag", 60.0, "s")),
        ("windup", WindupShape(7.0), WindupShape(7.0, overshoot=0.5), ("overshoot", 0.5, "mm")),
        ("lost_counts", StepShape(9.0), StepShape(9.0, over=2.0), ("over", 2.0, "s")),
    ],
)
def test_a_summary_leaves_out_what_is_zero_where_it_is_not_given(name, idle, there, read):
    effect = effect_named(name)
    without, beside = (effect.summary(shape, [1.0], UNITS[0]) for shape in (idle, there))
    assert read not in without
    assert set(beside) == {*without, read}
