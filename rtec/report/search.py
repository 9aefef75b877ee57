"""What the calibration of an unknown axis showed, for the page: figures, tables and words of the search."""

from __future__ import annotations

from dataclasses import dataclass, replace

from rtec.report.appearance import joined, number, printable
from rtec.report.diagnosis import chapters, diagnosis_figures
from rtec.report.diagnosis.quantities import Shown, shown_of
from rtec.report.diagnosis.sentence import spoken
from rtec.report.drawn import Illustration, Plate, drawn
from rtec.report.figures_rounds import rounds_figure
from rtec.study.results import Learned, StudyResult

PREFIX = "axis-"
"""Of the figures' names: the correction has figures of its own that are called the same."""
_WHOLE = 1e-6
_ROUNDS = (
    "The readings of the second round took no part in the first search. Above, what its model is off them, below, "
    "what the model of all readings leaves: dots are single readings, ▲ and ▽ the means at each place, forward and "
    "in reverse. What the first targets could not show is the pattern above; where it has gone below, it has a name "
    "now."
)


def search_figures(learned: Learned) -> list[Illustration]:
    """Draw the figures of the search that made the predictor."""
    found = diagnosis_figures(learned.diagnosis)
    shown = shown_of(learned.diagnosis.dataset.units)
    found[1:1] = drawn(
        [Plate("rounds", "What the second round showed", _ROUNDS, lambda: rounds_figure(learned, shown))]
    )
    return [replace(figure, name=PREFIX + figure.name) for figure in found]


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """Everything that the page says of the search."""

    found: chapters.SearchText
    facts: list[tuple[str, str]]
    notes: list[str]
    scores: list[str]
    """RMS of each step against the true error."""
    score: str
    aliases: str
    rounds: list[tuple[str, list[str]]]
    """What is compared, and its value in each round; nothing of a single round."""
    gained: str
    belief: str


def search_of(result: StudyResult) -> Search | None:
    """Return the chapter on the search; None where the predictor was given."""
    learned = result.learned
    if learned is None:
        return None
    shown = shown_of(learned.diagnosis.dataset.units)
    found = chapters.search_text(learned.diagnosis, shown)
    return Search(
        found=found,
        facts=[("Program", _program(learned)), *found.facts],
        notes=[*dict.fromkeys((*found.notes, *found.search_notes))],
        scores=[shown.text(score.rms_mm) for score in learned.scores],
        score=score_words(learned, shown),
        aliases=alias_words(result),
        rounds=round_rows(learned, shown),
        gained=rounds_sentence(learned),
        belief=belief_words(result, learned, shown),
    )


def _program(learned: Learned) -> str:
    plan = learned.plan
    return (
        f"{plan.start_mm:g} to {plan.end_mm:g} mm every {plan.increment_mm:.6g} mm, "
        f"{plan.runs} bidirectional runs, dwell {plan.dwell_s:g} s"
    )


def round_rows(learned: Learned, shown: Shown) -> list[tuple[str, list[str]]]:
    """Return what the rounds of a calibration took and gave, side by side; nothing of a single round."""
    rounds = learned.rounds
    if len(rounds) < 2:
        return []

    return [
        ("targets every", [f"{one.plan.increment_mm:.4g} mm" for one in rounds]),
        ("runs", [f"{one.plan.runs}" for one in rounds]),
        ("readings", [number(one.readings.size) for one in rounds]),
        ("machine time", [f"{one.machine_s / 3600.0:.1f} h" for one in rounds]),
        ("its readings less the model before", [shown.with_unit(one.missed_rms_mm) for one in rounds]),
        ("its readings less the model after", [shown.with_unit(one.left_rms_mm) for one in rounds]),
        ("verdict on all readings so far", [one.diagnosis.verdict.value for one in rounds]),
        ("true error less model, RMS all along the travel", [shown.with_unit(one.score.rms_mm) for one in rounds]),
        ("the same, at worst", [shown.with_unit(one.score.worst_mm) for one in rounds]),
    ]


def rounds_sentence(learned: Learned) -> str:
    """Return in a sentence why the axis was measured again, what that cost and what it gave; nothing of one round."""
    if len(learned.rounds) < 2:
        return ""
    shown = shown_of(learned.diagnosis.dataset.units)
    first, last = learned.rounds[0], learned.rounds[-1]
    hidden = joined(printable(period) for period in first.diagnosis.unseen_periods)
    cost = sum(one.machine_s for one in learned.rounds[1:]) / 3600.0
    apart = last.plan.increment_mm
    went = "fell" if last.score.rms_mm < first.score.rms_mm else "went"
    return (
        f"The targets of the first round cannot show errors with a period of {hidden}, and so the axis was measured "
        f"again, with targets every {apart:.4g} mm. That cost {cost:.1f} h of machine time, and what the model is "
        f"off the true error all along the travel {went} from {shown.with_unit(first.score.rms_mm)} to "
        f"{shown.with_unit(last.score.rms_mm)} RMS."
    )


def score_words(learned: Learned, shown: Shown) -> str:
    """Return how far the model is from the true error, in a sentence."""
    first, last = learned.scores[0], learned.scores[-1]
    return (
        f"Scored against the noise-free curve, the axis's true error at the same targets in both directions: "
        f"{shown.with_unit(first.rms_mm)} RMS before, {shown.with_unit(last.rms_mm)} RMS after, "
        f"{shown.with_unit(last.worst_mm)} at worst."
    )


def alias_words(result: StudyResult) -> str:
    """Return which harmonics of the screw the calibration can tell; empty where its targets meet every phase."""
    if result.learned is None or result.study.period_mm is None:
        return ""
    if len(result.learned.rounds) > 1:
        return ""
    a_turn = result.study.period_mm / result.learned.plan.increment_mm
    if abs(a_turn - round(a_turn)) > _WHOLE * a_turn:
        return ""
    highest = round(a_turn) // 2
    return (
        f"The calibration has {round(a_turn)} targets to a turn of the screw ({result.study.period_mm:g} mm). They "
        f"show harmonics of the cyclic error up to number {highest}; higher ones cannot be told from lower ones "
        "there (they alias) and are not fitted."
    )


def belief_words(result: StudyResult, learned: Learned, shown: Shown) -> str:
    """Return how the PC's predictor was made of the model, and how good it is where it is used."""
    low, high = learned.plan.start_mm, learned.plan.end_mm
    rms, worst = (
        shown.with_unit(value) for value in (result.predictor_score.rms_mm, result.predictor_score.worst_mm)
    )
    points = learned.predictor.forward_positions_mm.size
    words = (
        f"The PC's predictor is this model, its datum included, as a table of {number(points)} points in "
        f"each direction from {low:g} to {high:g} mm, joined by straight lines; beyond its ends their error is held. "
        "The controller's own table is sampled from it. All along the travel, between the calibration's targets, "
        f"too, it is off the true error by {rms} RMS, {worst} at worst."
    )
    if result.study.left_out:
        gone = "; ".join(f"{spoken(left.effect)} ({printable(left.why)})" for left in result.study.left_out)
        return f"{words} Left out of it, because a table knows position and direction alone: {gone}."
    return f"{words} Every effect of the model depends on position and direction alone: nothing was left out."
