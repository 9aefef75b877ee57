"""What is recorded of a trial, against what is known of it otherwise."""

from dataclasses import replace

import numpy as np
import pytest

from rtec.board import Microcontroller
from rtec.injector import Design
from rtec.injector.waves import counts_along
from rtec.machine.fault_kinds import PROCESSOR_HUNG
from rtec.machine.faults import Fault
from rtec.verify.safety.jobs import FAULT, inject
from rtec.verify.safety.phases import Phase, new_cell, run_through
from rtec.verify.safety.trace import trace_of


@pytest.mark.parametrize(
    ("phase", "fault"), [("insertion", "masquerade-for-good-pc-to-box"), ("rapid", "power-lost-for-5-ms")]
)
def test_lines_words_and_totals_of_a_trial_agree(phase, fault, rtec_record):
    words = {"design": "c", "phase": phase, "fault": fault, "second": "none"}
    record, trace = inject(words, 1, 1), trace_of(words, 1, 1)
    rtec_record.update(words | record)
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


def cut(stream, t_ps):
    """The counts that a stream makes from a time on."""
    counts = counts_along(stream)
    return counts[-1] - counts[np.searchsorted(stream.times_ps, t_ps, side="right")]


@pytest.mark.parametrize(
    ("design", "fault", "second"),
    [
        ("c", "hold-latch-stuck-closed", "none"),
        ("c", "processor-hung", "none"),
        ("b", "processor-hung", "none"),
        ("c", "processor-hung", "hold-latch-stuck-closed"),
    ],
)
def test_inside_the_box_a_hung_program_and_a_stuck_latch_do_what_they_say(design, fault, second):
    words = {"design": design, "phase": "cutting", "fault": fault, "second": second}
    record, trace = inject(words, 1, 0), trace_of(words, 1, 0)
    assert (record["result"], record["outcome"]) == ("passed", "safe stop")
    last_ps = max(record["activated_ps"], record.get("second_activated_ps") or 0)
    moved, passed = cut(trace.encoder, last_ps), cut(trace.controller, last_ps)
    assert moved > 50
    if fault == "hold-latch-stuck-closed":  # behind it the axis rests, and steps of two counts are made as at rest
        totals = trace.completed.totals[np.searchsorted(trace.completed.times_ps, last_ps, side="right") - 1 :]
        assert abs(passed - 2 * (totals[-1] - totals[0])) <= 2
    elif design == "b" or second == "hold-latch-stuck-closed":  # Design B's lines end at its program
        assert abs(passed) <= 2
    else:
        assert passed == moved
    said = {word.name: word for word in trace.words if word.scope == "box"}["state"]
    assert ("hung" in {said.texts[value] for value in said.values.tolist()}) == ("processor-hung" in (fault, second))
    if fault == "processor-hung" and design == "c" and second == "none":
        assert record["reason"] == "PC: box silent"


def test_a_restart_ends_a_hang_and_a_box_without_power_has_none():
    """Faults of different parts of one box go together; what finds nothing to act on is not activated."""
    words = {"design": "c", "phase": "cutting", "second": "none"}
    hung = inject(words | {"fault": "power-lost-for-good", "second": "processor-hung"}, 1, 1)
    first, second = hung["moment_ps"], hung["second_moment_ps"]
    assert (hung["second_fired"] == 0) == (first < second)
    impossible = FAULT.impossible(
        words | {"fault": "stale-data-valid-for-good", "second": "torn-position-word-for-good"}
    )
    assert "the end of one would end both" in impossible
    assert FAULT.impossible(words | {"fault": "box-restarted", "second": "processor-hung"}) is None
    assert "without a hold latch" in FAULT.impossible(words | {"design": "b", "fault": "hold-latch-stuck-closed"})


def test_a_hang_that_ends_is_a_restart():
    fault = Fault(kind=PROCESSOR_HUNG, place=1, from_ps=1_600 * 10**9, until_ps=1_620 * 10**9)
    cell = new_cell(Phase.CUTTING, Design.C, 0, faults=(fault,))
    run_through(cell, Phase.CUTTING, until_ps=1_610 * 10**9)
    hung = cell.axes[0].view.session
    run_through(cell, Phase.CUTTING, until_ps=1_630 * 10**9)
    assert cell.axes[0].view.session != hung


@pytest.mark.sweep  # boxes with a program compile for half a minute
def test_boxes_with_a_program_go_back_to_the_beginning():
    chip = Microcontroller.named("8051-12mhz")
    cell = new_cell(Phase.CUTTING, Design.C, 0, algorithm=replace(chip, program=chip.image(Design.C)))
    counts = []
    for _ in range(2):
        run_through(cell, Phase.CUTTING)
        counts.append([axis.controller_counts for axis in cell.monitored])
        cell.rewind()
    assert counts[0] == counts[1] != [0, 0]
