"""How far an algorithm goes: boxes whose limits follow from their times by hand."""

import math
from itertools import pairwise

import numpy as np
import pytest

from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Response, Timing, Totals
from rtec.signal import EdgeStream
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.frequencies import Does, Frequencies, ladder, search
from rtec.verify.contract.speeds import _acceleration as largest_acceleration, measure_speeds
from rtec.verify.contract.trials import Trials

US = 1_000_000
STATE_OF_LEVEL = (0, 1, 3, 2)


class Box:
    """Adds four counts, a change every ``pulse_ps``, once ``gate_ps`` have passed between two edges or at rest.

    An edge less than ``dead_ps`` behind the last one is lost, and one after a time from ``deaf_ps``. Edges during an
    insertion wait for its end: each for itself, or with ``latch`` all of them come at once then, a pulse behind it.
    """

    name = "box"

    def __init__(self, *, pulse_ps=100_000, gate_ps=1, dead_ps=0, deaf_ps=(0, 0), latch=False):
        self.pulse_ps, self.gate_ps, self.dead_ps, self.deaf_ps = pulse_ps, gate_ps, dead_ps, deaf_ps
        self.latch = latch

    def play(self, stimuli):
        return [self.one(stimulus) for stimulus in stimuli]

    def close(self):
        pass

    def one(self, stimulus):
        encoder = stimulus.edges
        state = shown = STATE_OF_LEVEL[encoder.initial]
        events = [(t, 0, level) for t, level in zip(encoder.times_ps.tolist(), encoder.levels.tolist(), strict=True)]
        events += [(t, 1, n) for t, n in zip(stimulus.requests.times_ps, stimulus.requests.totals, strict=True)]
        out, done = [], []
        owed = total = 0
        last_ps, busy_ps = -(10**18), 0

        def insert(at_ps):
            nonlocal owed, busy_ps, shown, total
            sign = 1 if owed > 0 else -1
            at_ps = max(at_ps, busy_ps)
            for k in range(1, 5):
                shown += sign
                out.append((at_ps + k * self.pulse_ps, shown))
            busy_ps, owed, total = at_ps + 4 * self.pulse_ps, owed - sign, total + sign
            done.append((busy_ps, total))

        def rest_until(t_ps):
            # at power-up nobody knows when the last edge was
            while owed and (at_ps := max(max(last_ps, 0) + self.gate_ps, busy_ps, asked_ps)) < t_ps:
                insert(at_ps)

        asked_ps = 0
        for t_ps, kind, value in sorted(events):
            rest_until(t_ps)
            if kind == 1:
                owed, asked_ps = int(value) - total, t_ps
                continue
            move = 1 if (STATE_OF_LEVEL[value] - state) % 4 == 1 else -1
            state = (state + move) % 4
            apart_ps = t_ps - last_ps
            if apart_ps < self.dead_ps:
                continue
            last_ps = t_ps
            if self.deaf_ps[0] <= apart_ps < self.deaf_ps[1]:
                continue
            shown += move
            at_ps = max(t_ps, busy_ps + self.pulse_ps)
            out.append((at_ps, shown))
            busy_ps = busy_ps if self.latch else max(busy_ps, at_ps)
            if owed and min(apart_ps, t_ps) > self.gate_ps:
                insert(t_ps)
        rest_until(stimulus.until_ps)
        states, seen = dict(out), STATE_OF_LEVEL[encoder.initial]
        times, levels = [], []
        for t_ps in sorted(t for t in states if t <= stimulus.until_ps):
            if states[t_ps] % 4 != seen:  # of several changes of one moment the last is what is seen
                times.append(t_ps)
                levels.append(seen := states[t_ps] % 4)
        done = [(t, n) for t, n in done if t <= stimulus.until_ps]
        return Response(
            edges=EdgeStream.from_states(times, levels, STATE_OF_LEVEL[encoder.initial]),
            completed=Totals(*zip(*done, strict=True)) if done else Totals(),
        )


def trials_of(box, **limits):
    trials = Trials(box, Contract(step_counts=4, **limits))
    assert trials.measure_settling() is None
    return trials


def speeds_of(box, **limits):
    return measure_speeds(trials_of(box, **limits))


@pytest.fixture
def no_turns(monkeypatch):
    """Of a test of frequencies or jitter: turns and starts are most of the runs, and are asked for below."""
    monkeypatch.setattr("rtec.verify.contract.speeds._acceleration", lambda trials: 0.0)


# --- frequency ---
def test_gate_and_dead_time_are_the_limits_in_time(no_turns):
    # it inserts where a quarter of a period is longer than 2 us, and loses edges where it is shorter than 1 us
    speeds = speeds_of(Box(gate_ps=2 * US, dead_ps=US), frequency_hz=200e3)
    found = speeds.frequencies
    assert 125e3 / 1.03 < found.max_inserting_hz < 125e3
    assert 250e3 / 1.03 < found.max_passing_hz <= 250e3
    assert speeds.at_top is Does.PASSES
    assert {does for hertz, does in found.rows if hertz > 250e3} == {Does.FAILS}
    assert found.summary(200e3).startswith("200 kHz: passes; inserts to 12")
    assert np.diff(speeds.first_wrong.case.stream.edges_ps).min() < US


def test_a_box_that_loses_edges_at_the_top_fails_there():
    speeds = speeds_of(Box(gate_ps=2 * US, dead_ps=US), frequency_hz=500e3)
    assert speeds.at_top is Does.FAILS
    assert (speeds.max_jitter_ps, speeds.max_acceleration_hz_s) == (None, None)
    assert [name for name, _ in speeds.data_sheet()] == ["frequency"]


def test_what_fails_at_120_khz_does_not_pass_to_150(no_turns):
    deaf_ps = (round(1e12 / 4.0 / 130e3), round(1e12 / 4.0 / 110e3))
    found = speeds_of(Box(gate_ps=10 * US, deaf_ps=deaf_ps), frequency_hz=500e3).frequencies
    assert found.at(500e3) is Does.PASSES
    assert found.max_passing_hz <= 110e3
    assert found.max_passing_hz > 110e3 / 1.03
    failing = [hertz for hertz, does in found.rows if does is Does.FAILS and hertz < 500e3]
    assert 110e3 < failing[0] < 110e3 * 1.03
    assert 130e3 / 1.03 < failing[-1] < 130e3


def test_a_box_that_inserts_only_in_the_middle_says_so(no_turns):
    # below 1 kHz its edges take longer than it remembers
    class Forgetful(Box):
        def one(self, stimulus):
            slow_ps = int(np.diff(stimulus.edges.times_ps).min(initial=10**15))
            return Box(gate_ps=3 * slow_ps if 250 * US <= slow_ps < 10**15 else 2 * US).one(stimulus)

    found = speeds_of(Forgetful(), frequency_hz=200e3).frequencies
    assert found.max_inserting_hz == 0.0
    middle = [hertz for hertz, does in found.rows if does is Does.INSERTS]
    assert 1e3 <= middle[0] < 1.03e3
    assert 125e3 / 1.03 < middle[-1] < 125e3


def test_bare_wires_insert_at_no_frequency(no_turns):
    class Wires:
        name = "wires"

        def play(self, stimuli):
            return [
                Response(edges=stimulus.edges, completed=Totals(), refusals=((stimulus.until_ps, "wires"),))
                for stimulus in stimuli
            ]

        def close(self):
            pass

    speeds = measure_speeds(Trials(Wires(), Contract(step_counts=4)))
    assert speeds.frequencies.max_inserting_hz == 0.0
    # 60 ns from A to B are asked for: a quarter of a period, or what jitter leaves of 500 ns
    assert 1e12 / 4.0 / 60e3 / 1.03 < speeds.frequencies.max_passing_hz < 1e12 / 4.0 / 60e3
    assert 430_000 < speeds.max_jitter_ps <= 440_000


def test_a_poll_in_step_with_round_frequencies_is_found_out(no_turns):
    # looks every 2 us: edges 1.98 us apart or less are lost unless all of them fall between the same two looks
    class Poll(Box):
        def one(self, stimulus):
            edges = stimulus.edges
            looks = -(-edges.times_ps // (2 * US))
            if (looks[1:] == looks[:-1]).any():  # two edges between two looks
                return Response(edges=EdgeStream([], [], edges.initial), completed=Totals())
            return Box.one(self, stimulus)

    found = speeds_of(Poll(gate_ps=20 * US), frequency_hz=100e3).frequencies
    assert 1e12 / 4.0 / (2 * US) / 1.03 < found.max_passing_hz <= 1e12 / 4.0 / (2 * US)


# --- jitter ---
def test_jitter_may_use_up_what_a_dead_time_leaves(no_turns):
    # edges 1.25 us apart, a dead time of 1 us
    speeds = speeds_of(Box(gate_ps=2 * US, dead_ps=US), frequency_hz=200e3)
    assert 0.24 * US - 0.02 * US < speeds.max_jitter_ps <= 0.25 * US


def test_jitter_where_insertions_end_counts_too(no_turns):
    # at 100 kHz it is harmless; behind 4 us, where it still inserts, an edge more than 0.2 us early is lost
    class Busy(Box):
        def one(self, stimulus):
            response = Box.one(self, stimulus)
            apart = stimulus.edges.times_ps[1:] - stimulus.edges.times_ps[:-1]
            if any(3 * US < t < 3.8 * US for t in apart.tolist()):
                return Response(edges=EdgeStream([], [], stimulus.edges.initial), completed=Totals())
            return response

    trials = Trials(Busy(gate_ps=4 * US), Contract(step_counts=4, frequency_hz=100e3))
    trials.measure_settling()
    speeds = measure_speeds(trials)
    assert 60e3 < speeds.frequencies.max_inserting_hz < 62.5e3
    assert 0.17 * US < speeds.max_jitter_ps < 0.33 * US


# --- acceleration ---
def test_acceleration_is_limited_where_two_edges_fall_into_one_insertion():
    insertion_us = 10.0
    # A latch lets all edges through at the end of an insertion: two of them are an illegal transition. An axis that
    # rests a count before an edge comes over it and the next 1 and sqrt(2) times sqrt(1 / (2 a)) later.
    box = Box(pulse_ps=round(insertion_us / 5.0 * US), gate_ps=round(2.5 * insertion_us * US), latch=True)
    found = largest_acceleration(trials_of(box, frequency_hz=1e6 / insertion_us, separation_ps=0))
    expected = (math.sqrt(2.0) - 1.0) ** 2 / (2.0 * (insertion_us * 1e-6) ** 2)
    assert 0.9 * expected < found < 1.5 * expected


def test_a_box_that_loses_an_edge_over_and_back_stands_no_acceleration():
    speeds = speeds_of(Box(gate_ps=2 * US, dead_ps=US), frequency_hz=200e3)
    assert speeds.max_acceleration_hz_s == 0.0
    assert "slow turns" in dict(speeds.data_sheet())["acceleration"]


def test_a_box_that_holds_every_edge_stands_any():
    speeds = speeds_of(Box(gate_ps=2 * US), frequency_hz=200e3)
    assert dict(speeds.data_sheet())["acceleration"] == "any"


def test_plain_gates_stand_no_turn_during_an_insertion():
    # the report's circuits: a real edge during an insertion is merged into it
    mcs51 = Timing.of(Design.C, Processor.MCS51)
    for real_edges, safe in ((RealEdges.MERGE, False), (RealEdges.HOLD, True)):
        box = BuiltIn(InjectorSettings(design=Design.C, timing=mcs51, real_edges=real_edges))
        trials = Trials(box, Contract.of(Design.C))
        trials.measure_settling()
        assert (largest_acceleration(trials) > 1e8) is safe


# --- the search alone ---
@pytest.mark.parametrize("limit_hz", [777.0, 12_345.0, 499_000.0, 1.1e6])
def test_limits_are_found_to_three_per_cent_from_below(limit_hz):
    found = search(lambda hz: Does.INSERTS if hz <= limit_hz else Does.FAILS, 500e3, from_hz=500.0, to_hz=5e6)
    assert limit_hz / 1.03 <= found.max_inserting_hz <= limit_hz
    assert found.max_passing_hz == found.max_inserting_hz


def test_all_three_between_two_rungs_are_found():
    def does(hertz):
        return Does.INSERTS if hertz < 105e3 else Does.PASSES if hertz < 115e3 else Does.FAILS

    found = search(does, 500e3, from_hz=500.0, to_hz=5e6)
    assert 105e3 / 1.03 < found.max_inserting_hz < 105e3
    assert 115e3 / 1.03 < found.max_passing_hz < 115e3


def test_lower_frequencies_are_tried_where_the_lowest_does_not_insert():
    found = search(lambda hz: Does.INSERTS if hz < 20.0 else Does.PASSES, 500e3, from_hz=500.0, to_hz=5e6)
    assert 0.0 < found.max_inserting_hz < 20.0


def test_no_two_rungs_are_further_apart_than_a_quarter():
    levels = ladder(500.0, 5e6, 123_456.0)
    assert max(high / low for low, high in pairwise(levels)) < 1.26
    assert (levels[0], levels[-1], 123_456.0 in levels) == (500.0, 5e6, True)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("IIPPFF", "400 Hz: passes; inserts to 200 Hz; passes to 400 Hz"),
        ("IIII", "400 Hz: inserts; inserts beyond 400 Hz"),
        ("IFPPF", "400 Hz: passes; inserts to 100 Hz; fails to 200 Hz; passes to 400 Hz"),
        ("PIPP", "400 Hz: passes; passes to 100 Hz; inserts to 200 Hz; passes beyond 400 Hz"),
        ("FFFF", "400 Hz: fails; fails beyond 400 Hz"),
    ],
)  # fmt: skip
def test_the_line_for_a_data_sheet(rows, said):
    words = {"I": Does.INSERTS, "P": Does.PASSES, "F": Does.FAILS}
    tried = tuple((100.0 * (k + 1), words[row]) for k, row in enumerate(rows))
    assert Frequencies(rows=tried).summary(400.0) == said


def test_what_fails_at_the_lowest_frequency_passes_to_none():
    tried = Frequencies(rows=((1.0, Does.FAILS), (2.0, Does.PASSES)))
    assert tried.max_passing_hz == 0.0
