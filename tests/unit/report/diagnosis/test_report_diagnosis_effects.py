"""Pictures of single effects: everything else taken out, over what the effect depends on, with what is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rtec.effects import Conditions, Shape, Units, distance_since_reversal, effect_named
from rtec.effects.own import effect
from rtec.inference.model import Model, Term
from rtec.report.diagnosis.chapters import found_effects
from rtec.report.diagnosis.effect_panels import effect_panels
from rtec.report.diagnosis.figures_effects import components_figure
from rtec.report.diagnosis.terminal import found_table
from rtec.report.figures_style import figure_style


def drawn(dataset, model, noise):
    with figure_style():
        figure = components_figure(dataset, model, noise)
        figure.draw_without_rendering()
    return figure.axes


TWIN = effect(lambda acceleration: -acceleration, over="velocity", name="twin", amplitude="lag")


def labelled(axes):
    return {line.get_label(): line.get_data() for line in axes.lines}


def term(name, shape=None, *amplitudes, **errors):
    return Term(effect=effect_named(name), shape=shape or Shape(), amplitudes=amplitudes, **errors)


def log(moving=True, rows=2000, strokes=(40.0, 100.0, 60.0, 100.0)):
    """A log that goes out and back, over strokes of several lengths."""
    turns = np.cumsum([0.0, *(way * stroke for way, stroke in zip((1, -1, 1, -1), strokes, strict=True))])
    x = np.interp(np.linspace(0.0, len(strokes), rows), np.arange(len(strokes) + 1), turns)
    way = np.repeat([1.0, -1.0, 1.0, -1.0], rows // 4)
    run = np.ones(rows, dtype=np.int64)
    return Conditions(position=x, position_unit="mm", run=run, direction=way, time_s=np.arange(rows) / 50.0,
                      since_reversal=distance_since_reversal(x, way, run), moving=moving)  # fmt: skip


def test_a_wave_is_folded_over_its_period_with_everything_else_taken_out(make_diagnosis):
    d = make_diagnosis()
    axes = drawn(d.dataset, d.model, d.noise)
    assert [panel.get_xlabel() for panel in axes] == [
        "", "position (mm)", "", "phase within the period of 6.35 mm (turns)"]  # fmt: skip
    lines = labelled(axes[2])
    x, y = lines["model"]
    assert y == pytest.approx(3.0 * np.sin(2 * np.pi * x) + 4.0 * np.cos(2 * np.pi * x), abs=1e-9)
    low, high = axes[2].get_xlim()
    assert (x.min(), x.max()) == (0.0, 1.0) and low < 0.0 and high > 1.0
    for name in ("forward", "backward"):  # 12 um of backlash are not in it
        x, y = lines[name]
        assert np.abs(y - 3.0 * np.sin(2 * np.pi * x) - 4.0 * np.cos(2 * np.pi * x)).max() < 5.0  # five sigma
    left = np.concatenate([line.get_ydata() for line in axes[3].lines if line.get_alpha()])
    assert np.sort(left) == pytest.approx(np.sort(1e3 * (d.dataset.observed - d.model.predict(d.dataset))))


def test_card_table_and_figure_have_the_same_words(make_dataset, make_noise):
    """One place rounds: who compares them finds the same digits."""
    shape = type(effect_named("backlash_map").shapes(make_dataset().conditions)[0])((0.0, 200.0, 400.0))
    map_term = replace(term("backlash_map", shape, 8e-3, 8.5e-3, 9e-3), errors=(2e-4, 1e-4, 2e-4))
    model = Model(observe="deviation", units=Units("mm", "mm", "s"), terms=(map_term,))
    dataset = make_dataset(terms=model.terms)
    ((_, *words),) = [[effect.name, *effect.parameters] for effect in found_effects(model, ())]
    texts = [f"{name} {value}" for name, value in words]
    assert texts[1:4] == ["mean 8.500 ± 0.082 µm", "least 8.00 ± 0.20 µm", "largest 9.00 ± 0.20 µm"]
    title = drawn(dataset, model, make_noise())[0].get_title(loc="left").replace("\n", ", ")
    assert title == f"backlash map: {', '.join(texts[1:])}"
    (_, cells) = found_table(model).columns
    assert [str(cell) for cell in cells.cells] == ["\n".join(texts)]


def test_what_a_curve_cannot_show_is_drawn_as_the_mean_of_neighbours(make_dataset, make_noise):
    """A lag while speeding up and slowing down is no function of the speed alone."""
    c = log()
    speed = np.gradient(c.position, c.time_s)
    c = replace(c, velocity=np.abs(np.sin(np.arange(c.rows) / 70.0)) * np.sign(speed))
    c = replace(c, acceleration=np.random.default_rng(1).normal(0.0, 1.0, c.rows))
    terms = (term("servo_lag", None, 1e-3), term("acceleration_lag", None, 1e-3))
    both = (terms[0], replace(terms[1], effect=TWIN))
    dataset = make_dataset(conditions=c, terms=both, cell=np.full(c.rows, -1))
    model = Model(observe="deviation", units=dataset.units, terms=both)
    x, y = labelled(drawn(dataset, model, make_noise())[0])["model"]
    assert x.size <= 150 and (y + x).std() < 0.6  # a lag is negative; of single readings it would be 1


def test_a_loop_in_motion_is_joined_in_the_order_of_its_readings(make_dataset, make_noise):
    c = log()
    terms = (term("hysteresis", type(effect_named("hysteresis").shapes(c)[0])(12.0), -0.02),)
    dataset = make_dataset(conditions=c, terms=terms, cell=np.full(c.rows, -1))
    model = Model(observe="deviation", units=dataset.units, terms=terms)
    (panel,) = effect_panels(dataset, model)
    assert panel.is_path and panel.rows.all()
    x, y = labelled(drawn(dataset, model, make_noise())[0])["model"]
    assert x == pytest.approx(c.position) and y == pytest.approx(1e3 * panel.part)


def test_what_is_over_soon_after_a_reversal_is_drawn_close_to_it(make_dataset):
    c = log()
    terms = (term("windup", type(effect_named("windup").shapes(c)[0])(0.5), -0.02),)
    model = Model(observe="deviation", units=Units("mm", "mm", "s"), terms=terms)
    (panel,) = effect_panels(make_dataset(conditions=c, terms=terms, cell=np.full(c.rows, -1)), model)
    assert (
        panel.over.name == "since_reversal" and panel.over.values[panel.rows].max() <= 4.0 < panel.over.values.max()
    )


def test_what_grows_with_position_and_heat_is_a_line_for_each_third_of_the_axis(make_dataset, make_noise):
    terms = (term("thermal_growth", effect_named("thermal_growth").shape_type(), 1e-4),)
    dataset = make_dataset(terms=terms)
    model = Model(observe="deviation", units=dataset.units, terms=terms)
    (panel,) = effect_panels(dataset, model)
    assert [sum(group.rows) for group in panel.groups] == [70, 70, 70]
    for group in panel.groups:
        place = dataset.conditions.position[group.rows].mean()
        heat = dataset.conditions.temperatures["temperature"][group.rows] - 20.0
        assert panel.part[group.rows] == pytest.approx(1e-4 * place * heat)
    assert drawn(dataset, model, make_noise())[1].get_xlabel() == "temperature (°C)"


def test_what_time_does_is_one_line_whatever_the_direction(make_dataset, make_noise):
    terms = (term("drift", None, 1e-5), term("backlash", None, 0.01))
    dataset = make_dataset(terms=terms)
    axes = drawn(dataset, Model(observe="deviation", units=dataset.units, terms=terms), make_noise())
    assert axes[1].get_xlabel() == "time (min)"
    x, y = labelled(axes[0])["model"]
    assert x.size == dataset.rows and y == pytest.approx(1e3 * 60.0 * x * 1e-5)
    assert "model, backward" not in labelled(axes[0])
