"""The figures of a report in their order, each with a caption that says what to see."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from rtec.report.appearance import Scale, joined, look_of
from rtec.report.drawn import Illustration, Plate, drawn
from rtec.report.figures_cyclic import cyclic_figure
from rtec.report.figures_feed import feed_figure
from rtec.report.figures_hold import hold_figure
from rtec.report.figures_positioning import positioning_figure
from rtec.report.figures_residual import residual_figure
from rtec.report.figures_shift import shift_figure
from rtec.report.figures_summary import summary_figure
from rtec.report.figures_waveform import waveform_figure
from rtec.report.shift import shift_caption
from rtec.study.results import StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def illustrations(result: StudyResult, scale: Scale) -> list[Illustration]:
    """Draw the figures for which the study has results."""
    return drawn(
        Plate(name, title, caption(result, scale), partial(draw, result, scale))
        for name, title, caption, draw in _ALL
    )


def _summary(result: StudyResult, scale: Scale) -> str:
    return (
        "Each group of bars is one figure of the table, each colour one way of correcting; the colours are the same "
        f"in all figures. The scale is logarithmic: from one labelled line to the next the error ({scale.symbol}) "
        "falls to a tenth, and the lower end of the bars means nothing."
    )


def _positioning(result: StudyResult, scale: Scale) -> str:
    text = (
        "The bidirectional plot of ISO 230-2. Each marker is the mean of all runs at one target, approached forward "
        "(▲, solid) or in reverse (▽, dashed); the band is two standard deviations to either side. The distance "
        "between the two lines is the reversal error; the height of everything with its bands is A. The panels "
        "below the first have their own scale, far finer than that of the first one."
    )
    if result.study.period_mm is not None:
        text += (
            " The slow waves of the first panel are the cyclic error of the screw, met at another phase by each "
            "target: joined by lines it looks longer than it is. The next figure shows its true shape."
        )
    return text


def _cyclic(result: StudyResult, scale: Scale) -> str:
    period = (result.study.period_mm or 0.0) * scale.position_per_mm
    return (
        f"Above, ten turns of the screw ({period:g} {scale.position_unit} each) from the middle of the travel: the "
        "error repeats with every turn, and in reverse with another shape. A correction that depends on the "
        "direction has to follow both. Below, the mean residuals of all targets (▲ forward, ▽ reverse), laid over "
        "one turn: rounding to whole steps scatters them, and a pattern that repeats with the screw would show here."
    )


def _feed(result: StudyResult, scale: Scale) -> str:
    limits = joined(
        f"{look_of(curve.name).label} {scale.feed(curve.follows_up_to_mm_s)}"
        for curve in result.feed_curves
        if math.isfinite(curve.follows_up_to_mm_s)
    )
    text = (
        "The true position less the position that the controller counts, while the axis moves at constant feed: "
        "peak to peak (solid) and RMS (dotted). Slow, the finest step is best. The request may change by no more "
        "than the window between two messages, and so a small step follows a steep error only up to a limited feed "
        "(dashed lines); beyond it the correction comes late, and the order of the designs turns round."
    )
    return text + (f" The limits are: {limits}." if limits else "")


def _waveform(result: StudyResult, scale: Scale) -> str:
    return (
        "A and B as the encoder sends them, A′ and B′ as the controller sees them, and below each pair the number of "
        "the state: 1 is 00, 2 is 10, 3 is 11, 4 is 01 (A, B). Forward motion goes through 1, 2, 3, 4; each change "
        "of state is one count. The changes that the box makes are red. Count the states: between the same real "
        "edges the controller meets more of them than the encoder has sent, and never skips one, which would be an "
        "illegal transition. Time counts from the last real edge before the insertion; each panel has its own scale."
    )


def _hold(result: StudyResult, scale: Scale) -> str:
    return (
        f"The axis stands still, as on a lathe that turns a cylinder, and grows by "
        f"{scale.with_unit(result.study.hold_growth_mm)}. At rest no real edge comes, and insertions just start; "
        "each one makes the servo pull the axis back by a step. The Original inserts in state 1 only (A and B low): "
        "standing in another state it is stuck, and its corrections stay pending."
    )


def _residual(result: StudyResult, scale: Scale) -> str:
    text = (
        "All readings of each row, counted into bins of one width; the line below each is their range. Equal areas "
        "mean equal numbers. Rounding to a step alone would give a flat top as wide as the step."
    )
    if result.study.repeatability_mm > 0.0:
        text += (
            f" Each reading carries a noise of {result.study.repeatability_mm * 1000:g} µm (standard deviation), the "
            "same draws in every row, and so even a perfect correction has a width."
        )
    return text


_ALL: tuple[
    tuple[str, str, Callable[[StudyResult, Scale], str], Callable[[StudyResult, Scale], Figure | None]], ...
] = (
    ("summary", "Before and after", _summary, summary_figure),
    ("shift", "Over a shift", shift_caption, shift_figure),
    ("positioning", "Positioning error in both directions", _positioning, positioning_figure),
    ("cyclic", "Cyclic error", _cyclic, cyclic_figure),
    ("residual", "What is left", _residual, residual_figure),
    ("feed", "Error in motion against feed", _feed, feed_figure),
    ("waveform", "One insertion", _waveform, waveform_figure),
    ("hold", "Axis at rest that grows", _hold, hold_figure),
)
