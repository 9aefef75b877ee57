"""Faults of the lines against a model that knows every picosecond, whole and window by window."""

import itertools
from pathlib import Path

import line_fault_oracle as oracle
import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.machine.fault_kinds import GLITCHES, ActivatedBy, FaultCategory, FaultKind, FaultRow
from rtec.machine.faults import Fault, fault_records
from rtec.machine.line_faults import burst, differences, line_fault
from rtec.machine.open_fault_kinds import (
    LINE_A,
    LINE_B,
    ONLY_OPEN,
    OPEN_FAULTS,
    PULSES,
    OpenFaultRow,
    open_fault_named,
    place_of,
    word_of,
)
from rtec.signal import NEVER, EdgeStream

LENGTH, BEGIN, OVER = 3_000, 1_013, 2_004
SMALL = OpenFaultRow(
    "burst", PULSES, FaultCategory.ENCODER, ActivatedBy.CABLE, "small", line=LINE_A | LINE_B, number=15,
    lasts_ps=(3, 60), within_ps=700,
)  # fmt: skip


def stream(seed):
    """Edges that turn now and then, at uneven times, some at the very times of a fault."""
    rng = np.random.default_rng(seed)
    times = np.unique([*rng.integers(1, LENGTH - 200, 60), *[BEGIN, OVER][: rng.integers(0, 3)]])
    moves = np.where(rng.random(times.size) < 0.2, -1, 1) * (1 if seed % 2 else -1)
    start = int(rng.integers(4))
    return EdgeStream.from_states(times, (start + np.cumsum(moves)) % 4, start)


def signal_of(edges, until=LENGTH):
    levels = edges.levels_at(np.arange(until))
    return [(int(level) & 1, int(level) >> 1) for level in levels]


def expected(word, signal, fault):
    begin, over = fault.from_ps, min(fault.over_ps, LENGTH)
    if "stuck" in word:
        return oracle.stuck(signal, word[0] == "b", word.endswith("high"), begin, over)
    whole = {
        "encoder-cable-open": oracle.cable_open,
        "a-and-b-swapped": oracle.exchanged,
        "one-line-of-a-pair-broken": oracle.line_broken,
    }
    if word in whole:
        return whole[word](signal, begin, over)
    if word == "missed-edge":
        return oracle.missed_edge(signal, begin)
    if word == "phase-error":
        return oracle.late_edges(signal, oracle.B, 1 / 3, begin, over, falls_only=False)
    if word == "duty-error":
        return oracle.late_edges(signal, oracle.A, 1 / 5, begin, over, falls_only=True)
    times, masks = burst(fault)
    half = times.size // 2
    spans = zip(masks[:half].tolist(), times[:half].tolist(), times[half:].tolist(), strict=True)
    return oracle.pulses(signal, [(mask - 1, a, b) for mask, a, b in spans])


LINES = [
    word_of(row) for row in OPEN_FAULTS
    if row.category is FaultCategory.ENCODER and row.code not in (GLITCHES, PULSES)
]  # fmt: skip


@pytest.mark.parametrize("word", [*LINES, "burst"])
@pytest.mark.parametrize("over_ps", [None, OVER])
def test_levels_are_those_of_the_model_at_every_picosecond(word, over_ps):
    row = SMALL if word == "burst" else open_fault_named(word)
    until_ps = None if row.over_at_once else over_ps
    for seed in range(6):
        edges = stream(seed)
        fault = Fault(kind=row, place=1, from_ps=BEGIN, until_ps=until_ps, seed=seed)
        right = signal_of(edges)
        wanted = expected(word, right, fault)
        whole = line_fault(fault, edges.initial).through(edges, 0, NEVER)
        assert signal_of(whole) == wanted
        # the same in windows, each of which ends with the next edge
        stage, cuts, parts = line_fault(fault, edges.initial), [0, 7, 8, 23, 40, len(edges)], []
        for first, last in itertools.pairwise(cuts):
            until = NEVER if last == len(edges) else int(edges.times_ps[last])
            parts.append(stage.through(edges.part(first, last), int(edges.times_ps[first]) if first else 0, until))
        assert EdgeStream.concatenate(parts) == whole
        changed = [t for t in range(LENGTH) if wanted[t] != right[t]]
        assert differences(edges, whole)[0] == (changed[0] if changed else None)


def test_a_pulse_that_ends_with_a_window_is_one_change_with_the_next_edge():
    row = OpenFaultRow("p", PULSES, FaultCategory.ENCODER, ActivatedBy.CABLE, "", line=1, number=1, lasts_ps=(40, 40))
    edges, fault = EdgeStream([10, 20, 60], [1, 3, 2], 0), Fault(kind=row, place=1, from_ps=20)
    stage = line_fault(fault, 0)
    parts = [stage.through(edges.part(0, 2), 0, 60), stage.through(edges.part(2, 3), 60, NEVER)]
    # A falls with the edge at 60 and the pulse is over: it stays low
    assert EdgeStream.concatenate(parts) == EdgeStream([10, 20], [1, 2], 0)


def test_glitches_follow_edges_one_at_a_time():
    row = FaultRow("g", GLITCHES, FaultCategory.ENCODER, ActivatedBy.GLITCHES, "", glitches=(0.25, 40))
    edges = EdgeStream.from_states(np.arange(1, 4001) * 100, np.arange(1, 4001) % 4, 0)
    wrong = line_fault(Fault(kind=row, place=1, from_ps=100_000, until_ps=300_000, seed=2), 0).through(
        edges, 0, NEVER
    )
    right, seen = (np.array(one.levels_at(np.arange(401_000))) for one in (edges, wrong))
    inverted = right ^ seen
    begins = np.flatnonzero((inverted > 0) & (np.concatenate([[0], inverted[:-1]]) == 0))
    ends = np.flatnonzero((inverted > 0) & (np.concatenate([inverted[1:], [0]]) == 0)) + 1
    assert set((ends - begins).tolist()) == {40}
    assert 100_000 < begins.min() and begins.max() < 300_100
    assert set(inverted[begins].tolist()) == {1, 2}
    # a quarter of 2000 edges, but none begins in another
    assert 400 < begins.size < 600


@pytest.mark.parametrize(("word", "number", "shortest", "longest", "within"), [
    ("noise-burst", 20, 50_000, 300_000, 20_000_000), ("glitch-on-a", 1, 300_000, 300_000, 0),
])  # fmt: skip
def test_pulses_are_those_that_the_table_says(word, number, shortest, longest, within):
    times, masks = burst(Fault(kind=open_fault_named(word), place=1, from_ps=7, seed=1))
    lasts = times[number:] - times[:number]
    assert (len(times), lasts.min() >= shortest, lasts.max() <= longest) == (2 * number, True, True)
    assert times[:number].min() >= 7 and times[:number].max() <= 7 + within
    assert set(masks.tolist()) == ({1} if word == "glitch-on-a" else {1, 2})


@pytest.mark.parametrize("row", [row for row in ONLY_OPEN if row.code >= PULSES], ids=word_of)
def test_a_cell_refuses_what_it_does_not_know(row):
    with pytest.raises(ArgumentError, match=f"{row.words}.*is a fault of the open path alone"):
        fault_records([Fault(kind=row, place=1, from_ps=1)])


def test_names_are_those_of_the_safety_case_and_say_where_others_belong():
    assert open_fault_named("A and B swapped") is FaultKind.LINES_SWAPPED
    assert open_fault_named("power_lost") is FaultKind.POWER_LOST
    for name, said in (
        ("bus off", "is a fault of the bus; use rtec safety --fault bus-off"),
        ("pc killed", "is a fault of the PC; use rtec safety --fault pc-killed"),
        ("frame corrupted", "is a fault of the bus; use rtec safety --fault frame-corrupted"),
        ("probe trip", "is a fault of the box's node; use rtec safety --fault probe-trip"),
        ("missed edges", "did you mean 'missed-edge'"),
    ):
        with pytest.raises(ArgumentError, match=said):
            open_fault_named(name)


def test_the_reference_lists_the_classes_as_the_table_has_them():
    text = (Path(__file__).parents[3] / "docs" / "reference.md").read_text(encoding="utf-8")
    listed = [f"| `{word_of(row)}` | {place_of(row)} | {row.meaning} |" for row in OPEN_FAULTS]
    assert "\n".join(listed) in text
