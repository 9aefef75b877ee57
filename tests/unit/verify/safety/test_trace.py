"""What is recorded of a trial, against what is known of it otherwise."""

import numpy as np
import pytest

from rtec.injector.waves import counts_along
from rtec.verify.safety.jobs import inject
from rtec.verify.safety.trace import trace_of


@pytest.mark.parametrize(
    ("phase", "fault"), [("insertion", "masquerade-for-good-pc-to-box"), ("rapid", "power-lost-for-5-ms")]
)
def test_lines_words_and_totals_of_a_trial_agree(phase, fault):
    words = {"design": "c", "phase": phase, "fault": fault, "second": "none"}
    record, trace = inject(words, 1, 1), trace_of(words, 1, 1)
    assert [t_ps for t_ps, _ in trace.marks] == [record["activated_ps"], record["detected_ps"]]
    of = {(word.scope, word.name): word for word in trace.words}
    travelled = np.ptp(of["axis", "true_count"].values)
    moved = {side: counts_along(getattr(trace, side))[-1] for side in ("encoder", "controller")}
    assert moved["encoder"] == travelled > 20
    completed = trace.completed.totals
    assert moved["controller"] - moved["encoder"] == 2 * (completed[-1] - completed[0])
    # the record names who stopped it and why; so does what was recorded
    who, _, why = record["reason"].partition(": ")
    scope, row = {"box": ("box", "state" if why == "no power" else "status"), "PC": ("pc", "hold")}[who]
    said = of[scope, row]
    assert why in {said.texts[value] for value in said.values.tolist()}


def test_a_broken_line_shows_what_the_box_did_not_get():
    words = {"design": "c", "phase": "cutting", "fault": "encoder-cable-open-for-50-ms", "second": "none"}
    record, trace = inject(words, 1, 0), trace_of(words, 1, 0)
    true = next(word for word in trace.words if word.name == "true_count").values
    lost = counts_along(trace.encoder)[-1] - (true[-1] - true[0])
    assert lost == record["left_counts"] < -50
