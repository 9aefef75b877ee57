"""The figures of a diagnosis and of a comparison in their order, each with a caption that says what to see."""

from __future__ import annotations

from rtec.dataset.dataset import Dataset
from rtec.inference.model import Model
from rtec.inference.results import Diagnosis, NoiseFloor
from rtec.report.diagnosis.effect_panels import effect_panels
from rtec.report.diagnosis.figures_curve import curve_figure
from rtec.report.diagnosis.figures_effects import components_figure
from rtec.report.diagnosis.figures_measured import measured_figure
from rtec.report.diagnosis.figures_model import cosines_figure, experiment_figure
from rtec.report.diagnosis.figures_residual import residual_panels
from rtec.report.diagnosis.figures_search import candidates_figure, staircase_figure
from rtec.report.diagnosis.figures_spectra import spectra_figure
from rtec.report.diagnosis.quantities import shown_for
from rtec.report.diagnosis.readings import MOST_DOTS
from rtec.report.diagnosis.sentence import heldout_words
from rtec.report.drawn import Illustration, Plate, drawn


def diagnosis_figures(diagnosis: Diagnosis) -> list[Illustration]:
    """Draw the figures for which the search has results.

    Returns
    -------
    list
        ``measured``, ``staircase``, ``components``, ``candidates``, ``curve``, ``residual``, ``spectra``, ``cosines``
        and ``experiment``, those that there is something to show for.
    """
    return drawn(diagnosis_plates(diagnosis))


def diagnosis_plates(diagnosis: Diagnosis) -> list[Plate]:
    """Return the figures of a search, not drawn yet; one that there is nothing to show for is drawn as None."""
    d = diagnosis
    held = heldout_words(d.heldout_by)
    measured, components, residual, spectra = _plates(d.dataset, d.start, d.model, d.noise, d)
    return [
        measured,
        Plate(
            "staircase",
            "The staircase",
            "What is left after each step, everything refitted each time: in training (line) and on "
            f"readings that took no part in the fit (diamonds; held out {held}). A step that helps in training "
            "and not held out explains noise. Below the band of the noise floor there is nothing repeatable to "
            "explain.",
            lambda: staircase_figure(d),
        ),
        components,
        Plate(
            "candidates",
            "Candidates, ranked",
            "Each effect of the library that these data can show. The upper bar runs from the RMS at "
            "which the effect was judged to the one that was promised without fitting the rest again, the lower "
            "one to what was reached when it was added and everything refitted. The scale is logarithmic.",
            lambda: candidates_figure(d),
        ),
        Plate(
            "curve",
            "What is left, as a curve",
            "The readings less all effects (dots), and a smooth curve that was learned from them, with a band of two "
            "standard errors. It is a description and no name: an effect of the library that did this would have "
            "been found. Of a curve over two quantities three cuts are drawn.",
            lambda: curve_figure(d.dataset, d.curve),
        ),
        residual,
        spectra,
        Plate(
            "cosines",
            "Which effects are collinear on this plan",
            "The size of the cosine between what two effects contribute to these readings: 0 where "
            "they have nothing in common, 1 where no fit can tell them apart. Framed: above 0.95, which counts "
            "as a tie; dotted where one effect is a special case of the other, so that the simpler one wins.",
            lambda: cosines_figure(d.cosines),
        ),
        Plate(
            "experiment",
            "The rivals in the suggested experiment",
            "What each of the rivals predicts there, with the amplitudes fitted here: measure where the curves part.",
            lambda: experiment_figure(d.experiment, d.dataset),
        ),
    ]


def comparison_figures(dataset: Dataset, model: Model, noise: NoiseFloor) -> list[Illustration]:
    """Draw measured against model, each effect in the readings, the residual against each column, and its spectra."""
    return drawn(comparison_plates(dataset, model, noise))


def comparison_plates(dataset: Dataset, model: Model, noise: NoiseFloor) -> list[Plate]:
    """Return the same figures, not drawn yet."""
    return _plates(dataset, None, model, noise, None)


def _plates(
    dataset: Dataset, before: Model | None, model: Model, noise: NoiseFloor, diagnosis: Diagnosis | None
) -> list[Plate]:
    unknown = None if diagnosis is None else diagnosis.unknown
    moving = dataset.coordinates.moving and dataset.coordinates.time_s is not None
    return [
        Plate(
            "measured",
            "Measured and model",
            (_OVER_TIME if moving else _OVER_PLACE) + _noise_words(dataset, noise),
            lambda: measured_figure(dataset, model, noise),
        ),
        Plate(
            "components",
            "Each effect in the readings",
            "Above, the readings less all other effects (pale; means of neighbours on top where they are "
            "many) and the model (black), over what the effect depends on: a wave over its period, what a "
            "reversal does as a loop, friction against speed. Below, what is left of the readings, on a scale of "
            "its own." + _largest(dataset, model) + _noise_words(dataset, noise),
            lambda: components_figure(dataset, model, noise),
        ),
        Plate(
            "residual",
            "What is left, and what it depends on",
            "Measured less model against each column of the data. The lines are means of neighbours, their "
            "bands two standard errors as if readings were independent of each other; where a band leaves zero again "
            "and again, something that depends on that column is left."
            + _thinned(dataset)
            + _noise_words(dataset, noise),
            lambda: residual_panels(dataset, model, noise, unknown),
        ),
        Plate(
            "spectra",
            "Spectra of what is left",
            "Amplitude of the best-fitting wave at each frequency. Noise alone, as correlated from reading "
            "to reading as the repeats are, passes the red line anywhere in a panel with a probability of 0.01 only. "
            "Filled marks stand at the lines of the model, hollow ones where targets that stand at regular distances "
            "show the same line again: beyond half a cycle per target nothing can be told from its mirror image.",
            lambda: spectra_figure(dataset, before, model, noise),
        ),
    ]


_OVER_PLACE = (
    "Above, each reading (▲ forward, ▼ backward), those of a pass joined by a thin line where they are few, and the "
    "model, mean of all runs; the model's waves are drawn between the targets, too. Where targets are many, the grey "
    "stretch is drawn larger in the middle. Below, the difference at a scale of its own."
)
_OVER_TIME = (
    "Above, the whole log: the range of each stretch where rows stand closer than the picture resolves; in the "
    "middle the stretch in which the model changes most; below, the difference at a scale of its own."
)


def _largest(dataset: Dataset, model: Model) -> str:
    shown = sum(len(panel.terms) for panel in effect_panels(dataset, model))
    hidden = sum(term.fitted for term in model.terms) - shown
    return f" The {hidden} smallest effects are left out." if hidden else ""


def _thinned(dataset: Dataset) -> str:
    if dataset.rows <= MOST_DOTS:
        return ""
    return f" Of each direction at most {MOST_DOTS} readings are drawn, chosen at random; lines and bands use all."


def _noise_words(dataset: Dataset, noise: NoiseFloor) -> str:
    shown = shown_for(dataset)
    source = "from repeats" if noise.from_repeats else "of what is left, for nothing was repeated"
    sigma = f"{shown.with_unit(noise.sigma)}, {source}"
    return f" The pale band is two standard deviations of a reading ({sigma}) wide to either side."
