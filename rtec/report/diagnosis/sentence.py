"""The verdict of a diagnosis in one sentence."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rtec.inference.collinear import tied_groups
from rtec.inference.completeness import ENOUGH
from rtec.inference.model import Term
from rtec.inference.results import Diagnosis, LearnedCurve, NoiseFloor, Unknown, Verdict
from rtec.readable import rounded
from rtec.report.appearance import joined, printable
from rtec.report.diagnosis.quantities import Shown, shown_for
from rtec.units import symbol

if TYPE_CHECKING:
    from rtec.inference.compare import Comparison, Stretch

_ADJECTIVES = frozenset({"cosine", "cyclic", "interpolation", "scale"})
"""Names that say of what kind an error is: in a sentence ``error`` follows them."""
_ROUNDING = 1e-6
"""Share of the RMS below which a mean is none."""
_WORTH_NAMING = 0.1
"""Share of the variance from which on the quantity that it goes with is named."""


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """Return what came out of a search in one sentence, with numbers and units.

    Returns
    -------
    str
        One line; names that come from a file are without signs that cannot be printed.
    """
    shown = shown_for(diagnosis.dataset)
    return {
        Verdict.NAMED: _named,
        Verdict.LIKELY: _likely,
        Verdict.TIED: _tied,
        Verdict.NOT_TESTABLE: _not_testable,
        Verdict.INCONCLUSIVE: _inconclusive,
        Verdict.UNKNOWN: _unknown,
        Verdict.NONE: _none,
    }[diagnosis.verdict](diagnosis, shown)


def spoken(name: str) -> str:
    """Return the name of an effect as a word in a sentence.

    Examples
    --------
    >>> spoken("thermal_growth")
    'thermal growth'
    """
    return printable(name).replace("_", " ")


def term_words(term: Term) -> str:
    """Return the name of an effect, with what is said of it: its sensor where it has one of several.

    Examples
    --------
    >>> from rtec.effects import HeatShape, effect_named
    >>> term_words(Term(effect=effect_named("thermal_shift"), shape=HeatShape("temperature_bed")))
    'thermal shift, bed'
    """
    said = "" if term.shape is None else term.shape.said_of_it
    return spoken(term.name) + (f", {printable(said)}" if said else "")


def noun(name: str) -> str:
    """Return the name of an effect as the subject of a sentence.

    Examples
    --------
    >>> noun("cyclic"), noun("pitch_map")
    ('cyclic error', 'pitch map')
    """
    return f"{spoken(name)} error" if name in _ADJECTIVES else spoken(name)


def explanation_names(diagnosis: Diagnosis) -> list[str]:
    """Return the effects of the model as words, those that the search began with included."""
    return [noun(name) for name in diagnosis.effects]


def floor_words(noise: NoiseFloor, shown: Shown) -> str:
    """Return the noise floor in words, or that there is none.

    Examples
    --------
    >>> floor_words(NoiseFloor(from_repeats=False, sigma=1.0, correlation=0.0, white_share=1.0,
    ...     degrees_of_freedom=9.0, sigma_adjacent=None), Shown(unit="N", symbol="N", factor=1.0))
    'nothing was repeated, so there is no noise floor'
    """
    if noise.floor is None:
        return "nothing was repeated, so there is no noise floor"
    return f"the noise floor from repeats is {shown.with_unit(noise.floor)}"


def comparison_sentence(comparison: Comparison) -> str:
    """Return what a model leaves of a measurement in one sentence, and with what most of that goes."""
    shown = shown_for(comparison.dataset)
    quantity = printable(comparison.dataset.observe).replace("_", " ")
    names = [noun(name) for name in comparison.model.names]
    model = f"The model ({joined(names)})" if names else "A perfect axis"
    most = next(iter(comparison.where), None)
    where = ""
    if most is not None and most.share >= _WORTH_NAMING:
        where = f"; {most.share:.0%} of its variance goes with {printable(most.quantity).replace('_', ' ')}"
    return (
        f"{model} leaves {shown.with_unit(comparison.rms)} RMS of the {quantity} "
        f"(held out {shown.with_unit(comparison.rms_heldout)}); {floor_words(comparison.noise, shown)}{where}."
    )


def stretch_words(stretch: Stretch, unit: str) -> str:
    """Return where a stretch is: its limits with their unit, and the direction where it has one."""
    way = {1: "forward", -1: "backward"}.get(stretch.direction, "")
    if way and not unit:  # the quantity is the direction itself
        return way
    low, high = f"{stretch.low:.5g}", f"{stretch.high:.5g}"
    place = (low if low == high else f"{low} to {high}").replace("-", "−")
    return ", ".join(words for words in (f"{place} {symbol(unit)}".rstrip(), way) if words)


def stretch_mean(stretch: Stretch) -> float:
    """Return the mean of a stretch, 0 where it is the rounding of a sum that is zero."""
    return 0.0 if abs(stretch.mean) < _ROUNDING * stretch.rms else stretch.mean


def heldout_words(heldout_by: str) -> str:
    """Return how readings were held out, as the end of a clause.

    Examples
    --------
    >>> heldout_words("run"), heldout_words("pulses.csv")
    ('run by run', 'pulses.csv')
    """
    name = printable(heldout_by)
    return f"{name} by {name}" if name.isalpha() else name


def row_by_row_words(rms_heldout_rows: float | None, shown: Shown) -> str:
    """Return what single rows held out say where whole blocks are held out, as the end of a clause; else nothing."""
    return "" if rms_heldout_rows is None else f" (row by row: {shown.with_unit(rms_heldout_rows)})"


def _fall(diagnosis: Diagnosis, shown: Shown) -> str:
    before, after = shown.with_unit(diagnosis.rms_before), shown.with_unit(diagnosis.rms_after)
    change = f"falls from {before} to {after}" if diagnosis.rms_after < diagnosis.rms_before else f"stays at {after}"
    return f"{change} RMS (held out {shown.with_unit(diagnosis.rms_heldout)})"


def _quantity(diagnosis: Diagnosis) -> str:
    return f"the {printable(diagnosis.dataset.observe).replace('_', ' ')}"


def _explained(diagnosis: Diagnosis, shown: Shown, sure: str, tail: str) -> str:
    names = explanation_names(diagnosis) or ["the datum alone"]
    verb = "explains" if len(names) == 1 else "explain"
    text = f"{joined(names)}{sure} {verb} {_quantity(diagnosis)}: what is left {_fall(diagnosis, shown)}{tail}."
    return text[:1].upper() + text[1:]


def _named(diagnosis: Diagnosis, shown: Shown) -> str:
    return _explained(diagnosis, shown, "", f"; {floor_words(diagnosis.noise, shown)}")


def _likely(diagnosis: Diagnosis, shown: Shown) -> str:
    why = "What is left is correlated from reading to reading"
    if not diagnosis.noise.from_repeats:
        why = "Nothing was repeated"
    elif diagnosis.noise.degrees_of_freedom < ENOUGH:
        why = "Too little was repeated"
    return _explained(diagnosis, shown, " most likely", f". {why}, so no noise floor says whether that is all")


def _tied(diagnosis: Diagnosis, shown: Shown) -> str:
    groups = tied_groups(diagnosis.candidates)
    either = [f"either {' or '.join(noun(name) for name in group)}" for group in groups] or ["more than one effect"]
    tied = {name for group in groups for name in group}
    beside = [noun(name) for name in diagnosis.effects if name not in tied]
    tail = f" beside {joined(beside)}" if beside and groups else ""
    text = (
        f"{joined(either)} explains {_quantity(diagnosis)}{tail}, and no fit on this plan can tell which: what "
        f"is left {_fall(diagnosis, shown)} one way or the other; {floor_words(diagnosis.noise, shown)}."
    )
    return text[:1].upper() + text[1:]


def _unknown(diagnosis: Diagnosis, shown: Shown) -> str:
    found = explanation_names(diagnosis)
    before = f" after {joined(found)}" if found else ""
    may_be = " or ".join(noun(name) for name in diagnosis.suspected)
    explained = f"may be {may_be}, which this plan cannot show" if may_be else "nothing in the library explains"
    again = "repeats and that " if diagnosis.noise.from_repeats else ""
    return (
        f"Structure is left{before} that {again}{explained}"
        f"{unknown_words(diagnosis.unknown, diagnosis.dataset.units.position)}: {_quantity(diagnosis)} "
        f"{_fall(diagnosis, shown)}; {floor_words(diagnosis.noise, shown)}.{curve_words(diagnosis.curve, shown)}"
    )


def curve_words(curve: LearnedCurve | None, shown: Shown) -> str:
    """Return what a learned curve leaves and is like, as sentences behind the verdict's."""
    if curve is None:
        return ""
    like = f" It is like {curve.descriptions[0]}, which is a description and no name." if curve.descriptions else ""
    return (
        f" A learned curve {printable(curve.shape.said_of_it)} leaves {shown.with_unit(curve.rms)} RMS "
        f"(held out {shown.with_unit(curve.rms_heldout)}).{like}"
    )


def unknown_words(unknown: Unknown | None, position_unit: str) -> str:
    """Return what an unknown structure depends on, as the end of a clause.

    Examples
    --------
    >>> unknown_words(Unknown(depends_on=("position",), period=3.2, frequency_hz=None, description=""), "mm")
    '; it depends on position, with a period of 3.20 mm'
    """
    if unknown is None:
        return ""
    parts = []
    if unknown.depends_on:
        parts.append(f"depends on {joined(printable(name).replace('_', ' ') for name in unknown.depends_on)}")
    if unknown.period is not None:
        parts.append(f"with a period of {rounded(unknown.period, 3)} {symbol(position_unit)}")
    elif unknown.frequency_hz is not None:
        parts.append(f"with a line at {rounded(unknown.frequency_hz, 3)} Hz")
    if not parts:
        return ""
    start = "it " if unknown.depends_on else "it is strongest "
    return f"; {start}" + ", ".join(parts)


def _inconclusive(diagnosis: Diagnosis, shown: Shown) -> str:
    detectable = sorted((value, name) for name, value in diagnosis.minimum_detectable if math.isfinite(value))
    least = ""
    if detectable:
        (low, easiest), (high, hardest) = detectable[0], detectable[-1]
        least = f"; they would show {noun(easiest)} from {shown.with_unit(low)} RMS on"
        least += f" and {noun(hardest)} from {shown.with_unit(high)} on" if len(detectable) > 1 else ""
    return (
        f"These data cannot decide: {_quantity(diagnosis)} has {shown.with_unit(diagnosis.rms_after)} RMS left, and "
        f"{floor_words(diagnosis.noise, shown)}{least}."
    )


def _none(diagnosis: Diagnosis, shown: Shown) -> str:
    return (
        f"There is nothing repeatable to explain: {_quantity(diagnosis)} scatters by "
        f"{shown.with_unit(diagnosis.rms_after)} RMS, and {floor_words(diagnosis.noise, shown)}."
    )


def _not_testable(diagnosis: Diagnosis, shown: Shown) -> str:
    reasons = joined(dict.fromkeys(printable(reason) for _, reason in diagnosis.not_testable[:3]))
    why = f" ({reasons})" if reasons else ""
    return (
        f"No effect of the library could be tested on these data{why}: {_quantity(diagnosis)} has "
        f"{shown.with_unit(diagnosis.rms_before)} RMS, and {floor_words(diagnosis.noise, shown)}."
    )
