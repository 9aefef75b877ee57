"""Pictures of a diagnosis: drawn for every kind of data, true to the numbers, and without words on words."""

from __future__ import annotations

import io
import itertools

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from rtec.effects import BuildUpShape, Conditions, Observable, Units, distance_since_reversal
from rtec.effects.coulomb import Coulomb
from rtec.effects.viscous import Viscous, ViscousShape
from rtec.inference.model import Model, Term
from rtec.inference.results import Experiment
from rtec.report.diagnosis import comparison_figures, diagnosis_figures
from rtec.report.diagnosis.figures_effects import components_figure
from rtec.report.diagnosis.figures_measured import measured_figure
from rtec.report.diagnosis.figures_model import cosines_figure
from rtec.report.diagnosis.figures_residual import residual_panels
from rtec.report.diagnosis.figures_search import candidates_figure, staircase_figure
from rtec.report.diagnosis.figures_spectra import spectra_figure
from rtec.report.figures_style import figure_style

ALL = ["measured", "staircase", "components", "candidates", "residual", "spectra", "cosines"]


def _experiment() -> Experiment:
    x = np.linspace(0.0, 20.0, 41)
    return Experiment(text="Look just after a reversal.", rivals=("backlash", "windup"), label="way (mm)",
                      abscissa=x, predictions=(np.full(41, 0.006), 0.006 * (1 - np.exp(-x / 4))))  # fmt: skip


def _log(rows: int = 4000) -> Conditions:
    t = np.arange(rows) / 100.0
    x = 100.0 * np.sin(2 * np.pi * t / 10.0)
    v = 20.0 * np.pi * np.cos(2 * np.pi * t / 10.0)
    way, run = np.sign(np.round(v, 1)), np.ones(rows, dtype=np.int64)
    return Conditions(position=x, position_unit="mm", run=run, direction=way, time_s=t, velocity=v,
                      acceleration=np.gradient(v, t), since_reversal=distance_since_reversal(x, way, run),
                      moving=True)  # fmt: skip


def _drive(make_dataset, rows: int = 4000):
    terms = (
        Term(effect=Coulomb(), shape=BuildUpShape(), amplitudes=(20.0,)),
        Term(effect=Viscous(), shape=ViscousShape(), amplitudes=(0.2,)),
    )
    c = _log(rows)
    dataset = make_dataset(conditions=c, terms=terms, observe="force", observable=Observable.DRIVE,
                           units=Units("n", "mm", "s"), cell=np.full(rows, -1))  # fmt: skip
    return dataset, Model(observe="force", units=dataset.units, terms=terms)


def test_all_figures_in_their_order_as_svg_and_png(make_diagnosis):
    drawn = diagnosis_figures(make_diagnosis(experiment=_experiment()))
    assert [figure.name for figure in drawn] == [*ALL, "experiment"]
    for figure in drawn:
        assert figure.svg.startswith(b"<?xml") and figure.caption.endswith(".")
        assert Image.open(io.BytesIO(figure.png)).size[0] == 1500  # ten inches of 150 dots
    assert len({figure.png for figure in drawn}) == len(drawn)


def test_many_rows_make_a_picture_of_bounded_size(make_dataset, make_noise):
    dataset, model = _drive(make_dataset, 40_000)
    noise = make_noise(sigma=0.5, from_repeats=False)
    figures = comparison_figures(dataset, model, noise)
    assert "components" in [figure.name for figure in figures]
    assert all(len(figure.svg) < 2_500_000 for figure in figures)


def _nearly_nothing() -> Conditions:
    return Conditions(position=np.array([0.0, 10.0, 20.0]), position_unit="mm", run=np.ones(3, dtype=np.int64))


def _one_place() -> Conditions:
    return Conditions(position=np.full(12, 5.0), position_unit="deg", run=np.arange(12))


def _over_time() -> Conditions:
    return Conditions(position=np.linspace(0.0, 900.0, 200), position_unit="s", run=np.ones(200, dtype=np.int64),
                      time_s=np.linspace(0.0, 900.0, 200))  # fmt: skip


@pytest.mark.parametrize(
    ("conditions", "observed"),
    [
        *((one, "noise") for one in (_nearly_nothing, _one_place, _over_time, _log)),
        *((one, "constant") for one in (_one_place, _over_time)),
    ],
)
def test_poor_data_are_drawn(make_diagnosis, make_dataset, make_noise, conditions, observed):
    c = conditions()
    values = np.random.default_rng(1).normal(0, 1e-3, c.rows) if observed == "noise" else np.full(c.rows, 0.5)
    dataset = make_dataset(conditions=c, terms=(), observed=values, cell=np.full(c.rows, -1))
    noise = make_noise(from_repeats=False, sigma=float(np.std(values)), degrees_of_freedom=0.0)
    start = make_diagnosis().start
    poor = make_diagnosis(dataset=dataset, model=start, steps=(), candidates=(), noise=noise, rms_before=0.0)
    with figure_style():
        for figure in (
            measured_figure(dataset, start, noise),
            residual_panels(dataset, start, noise),
            spectra_figure(dataset, start, start, noise),
            staircase_figure(poor),
        ):
            if figure is not None:
                figure.draw_without_rendering()
    assert candidates_figure(poor) is None and cosines_figure(None) is None
    assert components_figure(dataset, start, noise) is None


def test_a_drives_log_is_drawn_over_time_and_its_friction_over_velocity(make_dataset, make_noise):
    dataset, model = _drive(make_dataset)
    with figure_style():
        measured = measured_figure(dataset, model, make_noise(sigma=0.5, from_repeats=False))
        parts = components_figure(dataset, model, make_noise(sigma=0.5, from_repeats=False))
    assert measured.axes[-1].get_xlabel() == "time (s)" and measured.axes[0].get_ylabel() == "force (N)"
    assert [axes.get_xlabel() for axes in parts.axes] == ["", "velocity (mm/s)"]  # one curve, what is left below
    assert parts.axes[0].get_title(loc="left") == "coulomb: 20 N\nviscous: 200 N/(m/s)"


def test_residual_panels_show_every_column_and_mark_what_lies_beyond(make_diagnosis):
    d = make_diagnosis()
    far = d.dataset.observed.copy()
    far[3] += 1.0
    dataset = type(d.dataset)(**{name: getattr(d.dataset, name) for name in d.dataset.__slots__} | {"observed": far})
    with figure_style():
        figure = residual_panels(dataset, d.model, d.noise)
    labels = [axes.get_xlabel() for axes in figure.axes]
    assert labels == ["position (mm)", "time (min)", "temperature (°C)", "distance since the last reversal (mm)",
                      "phase within the period of 6.35 mm (turns)"]  # fmt: skip
    assert figure.axes[0].get_title(loc="left") == "1 of 210 readings lie beyond the panels"


def test_spectra_mark_the_line_and_its_mirror_image(make_dataset, make_diagnosis, make_noise):
    n = 400
    x = np.tile(np.arange(n) * 0.635, 2)
    way, run = np.repeat([1.0, -1.0], n), np.ones(2 * n, dtype=np.int64)
    c = Conditions(position=x, position_unit="mm", run=run, direction=way)
    model = make_diagnosis().model
    dataset = make_dataset(conditions=c, terms=model.terms)
    with figure_style():
        axes = spectra_figure(dataset, make_diagnosis().start, model, make_noise()).axes[0]
    words = [text.get_text() for text in axes.texts if text.get_text()]
    assert "6.350 mm" in words and "alias of 6.350 mm" in words
    assert any("Nyquist" in text and "mirrored" in text for text in words)
    places = {text.get_text(): text.xy[0] for text in axes.texts}
    assert places["6.350 mm"] == pytest.approx(1 / 6.35)
    assert places["alias of 6.350 mm"] == pytest.approx(1 / 0.635 - 1 / 6.35)
    before = next(line for line in axes.lines if line.get_label() == "before")
    after = next(line for line in axes.lines if line.get_label() == "left by the model")
    k = int(np.argmin(np.abs(before.get_xdata() - 1 / 6.35)))
    assert before.get_ydata()[k - 3 : k + 4].max() == pytest.approx(5.0, rel=0.05)  # µm
    assert after.get_ydata()[k] < 0.3


def test_the_staircase_goes_down_by_the_steps(make_diagnosis):
    with figure_style():
        axes = staircase_figure(make_diagnosis()).axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    assert lines["training"].get_ydata()[:-1] == pytest.approx([7.0, 6.8, 3.7, 0.99])
    assert lines["held out"].get_ydata()[1:] == pytest.approx([7.14, 3.885, 1.0395])
    labels = [label.get_text() for label in axes.get_xticklabels()]
    assert labels == ["start:\nno effect", "+ scale", "+ backlash", "+ cyclic"]
    low, high = next(patch for patch in axes.patches if "noise floor" in patch.get_label()).get_extents().get_points()
    assert low[1] < high[1]


def test_bars_run_from_what_was_there_to_what_was_promised_and_reached(make_diagnosis):
    with figure_style():
        axes = candidates_figure(make_diagnosis()).axes[0]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == ["drift", "scale", "cyclic", "backlash"]  # the best on top
    bars = sorted((round(bar.get_x(), 4), round(bar.get_x() + bar.get_width(), 4)) for bar in axes.patches)
    assert bars == sorted([(3.8, 6.8), (3.7, 6.8), (1.1, 3.7), (0.99, 3.7), (0.98, 0.99), (0.98, 0.99)])
    words = [text.get_text() for text in axes.texts]
    assert words == ["not added, p 0.2", "not added, p 0.4", "found", "found; like windup"]


def _overlapping(figure) -> list[tuple[str, str]]:
    """Return pairs of words that cover each other."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw_without_rendering()
    found = []
    for axes in figure.axes:
        level = [text for text in axes.get_xticklabels() if text.get_rotation() == 0]
        words = [text for text in [*axes.texts, *level, axes.xaxis.label, axes.title] if text.get_text()]
        boxes = [(text.get_text(), text.get_window_extent(renderer).padded(-1.0)) for text in words]
        found += [(a, b) for (a, one), (b, two) in itertools.combinations(boxes, 2) if one.overlaps(two)]
    return found


def test_the_words_of_spectra_and_bars_do_not_cover_each_other(make_diagnosis):
    d = make_diagnosis()
    with figure_style():
        assert _overlapping(spectra_figure(d.dataset, d.start, d.model, d.noise)) == []
        assert _overlapping(candidates_figure(d)) == []
