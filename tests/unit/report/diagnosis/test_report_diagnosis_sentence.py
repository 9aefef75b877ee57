"""What is said in a sentence and on the terminal."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from rtec.effects import CyclicShape, effect_named
from rtec.inference.collinear import not_identifiable, tied_groups
from rtec.inference.model import Term
from rtec.inference.results import Experiment, Unknown, Verdict
from rtec.report.diagnosis import comparison_sentence, comparison_table, diagnosis_table, verdict_sentence

HOSTILE = "[red]x[/red] <script>\x1b[31m\x00 {{ 7 * 7 }}"


def _shown(renderable: object, width: int = 80) -> str:
    file = io.StringIO()
    Console(file=file, width=width, color_system=None).print(renderable)
    return file.getvalue()


def test_named_says_what_how_far_and_to_which_floor(make_diagnosis):
    assert verdict_sentence(make_diagnosis()) == (
        "Backlash and cyclic error explain the deviation: what is left falls from 7.00 µm to 1.00 µm RMS "
        "(held out 1.04 µm); the noise floor from repeats is 1.00 µm."
    )


def test_without_repeats_there_is_no_noise_floor(make_diagnosis, make_noise):
    text = verdict_sentence(make_diagnosis(noise=make_noise(from_repeats=False)))
    assert "nothing was repeated, so there is no noise floor" in text and "floor from repeats is" not in text


def test_tied_names_every_rival_and_what_stands_beside(make_diagnosis):
    text = verdict_sentence(make_diagnosis(verdict=Verdict.TIED))
    assert text.startswith("Either backlash or windup explains the deviation beside cyclic error, and no fit")


def test_unknown_says_what_it_depends_on(make_diagnosis):
    unknown = Unknown(depends_on=("position", "run"), period=3.2, frequency_hz=None, description="")
    text = verdict_sentence(make_diagnosis(verdict=Verdict.UNKNOWN, unknown=unknown))
    assert "nothing in the library explains; it depends on position and run, with a period of 3.20 mm:" in text
    assert "after backlash and cyclic error" in text


def test_unknown_says_what_it_may_be(make_diagnosis):
    unknown = Unknown(depends_on=("position",), period=None, frequency_hz=None, description="")
    suspected = ("reversal_spike", "windup")
    text = verdict_sentence(make_diagnosis(verdict=Verdict.UNKNOWN, unknown=unknown, suspected=suspected))
    assert "that may be reversal spike or windup, which this plan cannot show; it depends on position:" in text
    assert "nothing in the library" not in text


def test_inconclusive_gives_the_smallest_effects_that_would_show(make_diagnosis):
    detectable = (("drift", 0.002), ("backlash", 0.0003), ("windup", float("nan")))
    text = verdict_sentence(make_diagnosis(verdict=Verdict.INCONCLUSIVE, minimum_detectable=detectable))
    assert text.endswith("they would show backlash from 0.300 µm RMS on and drift from 2.00 µm on.")


@pytest.mark.parametrize("verdict", list(Verdict))
def test_every_verdict_has_a_sentence_of_one_line_even_with_nothing_found(make_diagnosis, verdict):
    bare = make_diagnosis(verdict=verdict, steps=(), candidates=(), not_testable=(), minimum_detectable=(),
                          model=make_diagnosis().start, rms_after=float("nan"))  # fmt: skip
    text = verdict_sentence(bare)
    assert text.endswith(".") and "\n" not in text and "  " not in text and text[0].isupper()
    assert _shown(diagnosis_table(bare))


def test_what_mimics_for_ever_is_no_tie(make_candidate):
    scale = make_candidate("scale", accepted=True, tied_with=("cosine",), for_ever=("cosine",))
    assert tied_groups((scale,)) == []
    assert not_identifiable((scale,)) == [("scale", "cosine")]
    both = make_candidate("scale", accepted=True, tied_with=("cosine", "drift"), for_ever=("cosine",))
    assert tied_groups((both, make_candidate("drift", tied_with=("scale",)))) == [("scale", "drift")]


def test_the_terminal_shows_steps_candidates_and_what_could_not_be_tested(make_diagnosis):
    text = _shown(diagnosis_table(make_diagnosis()))
    assert max(map(len, text.splitlines())) <= 80
    lines = text.splitlines()
    assert lines[0].strip() == "NAMED"
    # what was found stands before the way to it, with the numbers of the end
    found, first = (next(k for k, line in enumerate(lines) if word in line) for word in ("found", "+ backlash"))
    assert found < first
    assert any(line.split() == ["backlash", "backlash", "12.00", "±", "0.20", "µm"] for line in lines[found:first])
    line = lines[first]
    assert "3.70" in line and "3.89" in line and "< 0.001" in line
    assert any("servo lag" in line and "no velocity or feed column" in line for line in lines)
    assert "Measure next: Measure dense points just after a reversal." in text


def test_text_from_outside_is_shown_and_not_obeyed(make_diagnosis, make_candidate):
    diagnosis = make_diagnosis(
        candidates=(make_candidate(HOSTILE, reason=HOSTILE),),
        not_testable=((HOSTILE, HOSTILE),),
        heldout_by=HOSTILE,
        experiment=Experiment(text=HOSTILE),
    )
    text = _shown(diagnosis_table(diagnosis), width=400)
    assert text.count("[red]x[/red] <script>") >= 4 and "\x1b" not in text and "\x00" not in text


def test_many_parameters_are_counted_on_the_terminal(make_diagnosis):
    wave = Term(effect=effect_named("cyclic"), shape=CyclicShape(6.35, 8), amplitudes=(0.001,) * 16)
    text = _shown(diagnosis_table(make_diagnosis(model=make_diagnosis().start.with_terms((wave,)))))
    assert "amplitude 1" in text and "amplitude 8" not in text and "and 14 more" in text


def test_a_comparison_in_a_sentence_and_a_table(make_comparison):
    comparison = make_comparison()
    assert comparison_sentence(comparison) == (
        "The model (backlash and cyclic error) leaves 1.50 µm RMS of the deviation (held out 1.60 µm); the noise "
        "floor from repeats is 1.00 µm; 60% of its variance goes with position."
    )
    text = _shown(comparison_table(comparison))
    assert "10 to 20 mm, backward" in text and "2.00" in text and "held out run by run" in text
    assert max(map(len, text.splitlines())) <= 80
