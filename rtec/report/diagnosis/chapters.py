"""What is said of a search, in words and tables: on its page, in the report of a study, on the terminal."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rtec.dataset.dataset import Dataset, warnings_of
from rtec.effects import Card
from rtec.effects.experiments import rival
from rtec.inference.collinear import collinear_pairs, nested, not_identifiable, tied_groups
from rtec.inference.fit import values_of
from rtec.inference.model import Model
from rtec.inference.results import Candidate, Diagnosis, NoiseFloor, Verdict
from rtec.readable import quantity_text
from rtec.report.appearance import joined, number, printable
from rtec.report.diagnosis.quantities import Shown, named_texts, parameter_texts, probability, shown_for
from rtec.report.diagnosis.sentence import (
    floor_words,
    heldout_words,
    row_by_row_words,
    spoken,
    stretch_mean,
    stretch_words,
    term_words,
    verdict_sentence,
)
from rtec.units import symbol

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison

TONES = {
    Verdict.NAMED: "good",
    Verdict.LIKELY: "good",
    Verdict.NONE: "good",
    Verdict.TIED: "mind",
    Verdict.INCONCLUSIVE: "mind",
    Verdict.NOT_TESTABLE: "mind",
    Verdict.UNKNOWN: "bad",
}
"""How each verdict is shown."""

_MOST_PARAMETERS = 12
_CORRELATED = 0.1

DEFINITIONS = (
    ("RMS", "Root mean square. Of the residual: of measured less model, the datum of the instrument taken off."),
    ("training, held out", "Readings that the model was fitted to, and readings that took no part in the fit."),
    (
        "noise floor",
        "Standard deviation of a reading about the mean of all readings under the same conditions (target and "
        "direction). It comes from repeats, never from what a model leaves.",
    ),
    (
        "adjusted p",
        "Probability that noise alone gives so large a statistic anywhere: for any effect of the library and any "
        "period, time constant or other form that was tried. An effect is added below 0.01.",
    ),
    ("predicted", "RMS that an effect would leave beside those found, before everything is fitted again."),
    (
        "minimum detectable",
        "RMS contribution of an effect to these readings that this search should find, by theory 95 times of 100.",
    ),
    (
        "cosine",
        "Of the angle between what two effects contribute to these readings, a constant taken off: 1 means that no "
        "fit to them can tell the two apart.",
    ),
    ("lack of fit", "Test of what is left against the repeats: a small p says that something repeatable is left."),
    ("NAMED", "Effects were found, and what is left is at the noise floor."),
    ("LIKELY", "Effects were found; nothing was repeated, so no noise floor says whether something is left."),
    ("TIED", "Two or more effects explain the data equally; the suggested experiment separates them."),
    ("UNKNOWN", "Repeatable structure is left that nothing in the library explains."),
    ("INCONCLUSIVE", "The data could not have shown what would matter."),
    ("NONE", "There is nothing repeatable to explain."),
    ("NOT_TESTABLE", "What the effects need is not in the data."),
)
"""Terms of the page and what they mean."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StepRow:
    """A line of the table of steps."""

    label: str
    parameters: list[str]
    train: str
    heldout: str
    gain: str
    p: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundEffect:
    """An effect of the model with its card."""

    name: str
    card: Card
    parameters: list[tuple[str, str]]
    mimics: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CandidateRow:
    """A line of the table of candidates."""

    name: str
    accepted: bool
    predicted: str
    achieved: str
    p: str
    parameters: list[str]
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class WhereRow:
    """With what the residual goes, and where it is worst."""

    quantity: str
    share: str
    place: str
    mean: str
    """In the unit of the tables, without it."""
    mean_with_unit: str
    rows: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchText:
    """What is said of a search: on its own page, in the report of a study and on the terminal."""

    tone: str
    """``good``, ``mind`` or ``bad``."""
    verdict: str
    sentence: str
    unit: str
    facts: list[tuple[str, str]]
    notes: list[str]
    """How the numbers were prepared."""
    search_notes: list[str]
    steps: list[StepRow]
    floor: str
    heldout: str
    effects: list[FoundEffect]
    candidates: list[CandidateRow]
    unknown: str
    lack_of_fit: list[tuple[str, str]]
    not_testable: list[tuple[str, str, str]]
    """Effect, why, and what it needs."""
    detectable: list[tuple[str, str]]
    experiment: str
    ties: str
    alike: list[tuple[str, str, str]]


def search_text(diagnosis: Diagnosis, shown: Shown) -> SearchText:
    """Return everything that is said of a search, lengths and the like in one unit."""
    d = diagnosis
    return SearchText(
        tone=TONES[d.verdict],
        verdict=d.verdict.value,
        sentence=verdict_sentence(d),
        unit=shown.symbol,
        facts=facts(d.dataset, d.noise, d.heldout, d.heldout_by),
        notes=[printable(note) for note in (*warnings_of(d.dataset, d.heldout), *d.dataset.notes)],
        search_notes=[printable(note) for note in d.notes],
        steps=step_rows(d, shown),
        floor=floor_words(d.noise, shown),
        heldout=heldout_words(d.heldout_by) + row_by_row_words(d.rms_heldout_rows, shown),
        effects=found_effects(d.model, d.candidates),
        candidates=candidate_rows(d, shown),
        unknown="" if d.unknown is None else printable(d.unknown.description),
        lack_of_fit=pairs_text(d.lack_of_fit, probability),
        not_testable=unmeasured(d),
        detectable=pairs_text(d.minimum_detectable, shown.with_unit),
        experiment=printable(d.experiment.text),
        ties=tie_words(d),
        alike=collinear_rows(d),
    )


def where_rows(comparison: Comparison, shown: Shown) -> list[WhereRow]:
    """Return with what the residual of a comparison goes, the largest share first."""
    rows = []
    for where in comparison.where:
        worst = where.worst[0] if where.worst else None
        rows.append(
            WhereRow(
                quantity=printable(where.quantity).replace("_", " "),
                share=f"{where.share:.0%}",
                place="" if worst is None else stretch_words(worst, where.unit),
                mean="" if worst is None else shown.text(stretch_mean(worst)),
                mean_with_unit="" if worst is None else shown.with_unit(stretch_mean(worst)),
                rows="" if worst is None else str(worst.rows),
            )
        )
    return rows


def facts(dataset: Dataset, noise: NoiseFloor, heldout: Dataset | None, heldout_by: str) -> list[tuple[str, str]]:
    """Return what was measured, as label and value."""
    c, shown, unit = dataset.coordinates, shown_for(dataset), symbol(dataset.units.position)
    found = [
        ("File", printable(dataset.source)),
        ("Explained", f"{printable(dataset.observe).replace('_', ' ')}, shown in {shown.symbol}"),
        ("Readings", f"{number(dataset.rows)}, {'of a moving axis' if c.moving else 'at rest'}"),
    ]
    low, high = float(c.position.min()), float(c.position.max())
    place = "Time" if c.time_is_coordinate else "Position"
    found.append((place, f"{low:.6g} to {high:.6g} {unit}, {number(c.places.size)} distinct".replace("-", "−")))
    runs = len(set(c.run.tolist()))
    found.append(("Runs", number(runs)))
    if c.both_directions:
        found.append(("Directions", "both"))
    else:
        found.append(("Directions", "not told by the data" if c.direction is None else "one only"))
    if c.time_s is not None and not c.time_is_coordinate:
        found.append(("Duration", quantity_text(float(np.ptp(c.time_s)), "s")))
    for name, heat in c.temperatures.items():
        label = printable(name).replace("_", " ").capitalize()
        found.append((label, f"{float(heat.min()):.4g} to {float(heat.max()):.4g} °C".replace("-", "−")))
    if c.spindle_rpm is not None:
        found.append(("Spindle", f"{float(c.spindle_rpm.min()):.4g} to {float(c.spindle_rpm.max()):.4g} rev/min"))
    for label, value in (("Screw pitch", c.screw_pitch), ("Scale signal period", c.signal_period)):
        if value is not None:
            found.append((label, f"{quantity_text(value, c.position_unit, digits=6)}, as stated"))
    found.append(("Noise of a reading", noise_text(noise, shown)))
    other = f", {number(heldout.rows)} readings" if heldout is not None else ""
    found.append(("Held out", heldout_words(heldout_by) + other))
    unknown = [printable(name) for name, _ in dataset.unknown]
    if unknown:
        found.append(("Columns of unknown meaning", ", ".join(unknown)))
    return found


def noise_text(noise: NoiseFloor, shown: Shown) -> str:
    """Return the noise of a reading, where it comes from, and how far readings depend on each other."""
    if noise.from_repeats:
        freedom = f"{noise.degrees_of_freedom:.0f} degrees of freedom"
        text = f"{shown.with_unit(noise.sigma)} (standard deviation from repeats, {freedom})"
    else:
        text = f"nothing was repeated; {shown.with_unit(noise.sigma)} is the standard deviation of what is left"
    if noise.correlation > _CORRELATED:
        text += (
            f"; correlated by {noise.correlation:.2f} from reading to reading, {noise.white_share:.0%} of it white"
        )
    if noise.sigma_adjacent is not None:
        text += f"; from adjacent repeats alone {shown.with_unit(noise.sigma_adjacent)}"
    return text


def step_rows(diagnosis: Diagnosis, shown: Shown) -> list[StepRow]:
    """Return the table of steps, the start first."""
    names = joined(spoken(name) for name in diagnosis.start.names)
    heldout = shown.text(diagnosis.rms_heldout_before) if math.isfinite(diagnosis.rms_heldout_before) else ""
    start = StepRow(label=f"start: {names or 'no effect'}", parameters=[], gain="", p="",
                    train=shown.text(diagnosis.rms_before), heldout=heldout, reason="")  # fmt: skip
    rows = [start]
    for step in diagnosis.steps:
        gain = error = math.nan
        if math.isfinite(step.gain):
            gain, error = step.gain * shown.factor**2, step.gain_error * shown.factor**2
        rows.append(
            StepRow(
                label=f"+ {spoken(step.effect)}",
                parameters=parameter_texts(step.params, _MOST_PARAMETERS),
                train=shown.text(step.rms_train),
                heldout=shown.text(step.rms_heldout),
                gain=quantity_text(gain, "", error, digits=3),
                p=probability(step.p_adjusted),
                reason=printable(step.reason),
            )
        )
    return rows


def found_effects(model: Model, candidates: tuple[Candidate, ...]) -> list[FoundEffect]:
    """Return the effects of a model in their order, each with its card and its final numbers."""
    for_ever: dict[str, list[str]] = {}
    for name, other in not_identifiable(candidates):
        for_ever.setdefault(name, []).append(spoken(other))
    found = []
    for term in model.terms:
        pairs = named_texts(values_of(term, model))
        if len(pairs) > _MOST_PARAMETERS:
            left = len(pairs) - _MOST_PARAMETERS
            pairs = [*pairs[:_MOST_PARAMETERS], ("and", f"{left} more: the model's file has all")]
        mimics = joined(for_ever.get(term.name, []))
        found.append(FoundEffect(name=term_words(term), card=term.effect.card, parameters=pairs, mimics=mimics))
    return found


def candidate_rows(diagnosis: Diagnosis, shown: Shown) -> list[CandidateRow]:
    """Return the table of candidates in the order in which the search ranks them."""
    rows = []
    for one in diagnosis.candidates:
        ties = f"confounded with {joined(spoken(name) for name in one.tied_with)}" if one.tied_with else ""
        if ties and one.cosine is not None and math.isfinite(one.cosine):
            ties += f" (cosine {abs(one.cosine):.2f})"
        rows.append(
            CandidateRow(
                name=spoken(one.effect),
                accepted=one.accepted,
                predicted=shown.text(one.predicted_rms),
                achieved=shown.text(one.achieved_rms),
                p=probability(one.p_adjusted),
                parameters=parameter_texts(one.params, 4),
                reason="; ".join(words for words in (printable(one.reason), ties) if words),
            )
        )
    return rows


def collinear_rows(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """Return the collinear effects of this plan: both names, the cosine, and what separates them."""
    rows = []
    for first, second, cosine in collinear_pairs(diagnosis.cosines):
        known = rival(first, second)
        if nested(first, second):
            words = "one is a special case of the other: the simpler one wins where it explains the data"
        elif known is None:
            words = "no experiment is known to the library; vary what only one of them depends on"
        else:
            words = f"{'not identifiable with this instrument: ' if known.permanent else ''}{known.experiment}"
        rows.append((f"{spoken(first)} and {spoken(second)}", f"{abs(cosine):.3f}", words))
    return rows


def tie_words(diagnosis: Diagnosis) -> str:
    """Return which effects are tied, as a sentence; empty where none is."""
    groups = [f"{joined(spoken(name) for name in group)}" for group in tied_groups(diagnosis.candidates)]
    return f"Tied here: {'; '.join(groups)}." if groups else ""


def unmeasured(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """Return what could not be tested, why, and what the effect needs."""
    library = diagnosis.dataset.library
    needs = {name: library.named(name).needs if name in library else "" for name, _ in diagnosis.not_testable}
    return [(spoken(name), printable(why), needs[name]) for name, why in diagnosis.not_testable]


def pairs_text(pairs: Iterable[tuple[str, float]], text: Callable[[float], str]) -> list[tuple[str, str]]:
    """Return names as words with their figures as text."""
    return [(printable(name).replace("_", " "), text(value)) for name, value in pairs]
