"""Exhaustive search: proofs and counterexamples, held against the benches, the judge and limits found by hand."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from rtec.errors import ArgumentError, RtecError
from rtec.examples import designs, mutants
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.exhaustive import _box_event_kernels as events, class_search
from rtec.verify.contract.exhaustive._box_state_kernels import fields_of, unpack
from rtec.verify.contract.exhaustive.box_search import BoxSearch, Grid
from rtec.verify.contract.exhaustive.class_search import ClassSearch
from rtec.verify.contract.exhaustive.encoder import EncoderModel
from rtec.verify.contract.exhaustive.prove import prove
from rtec.verify.contract.exhaustive.result import Ending
from rtec.verify.contract.judge import Fault
from rtec.verify.contract.random_streams import random_stream
from rtec.verify.contract.streams import Stream, can_be
from rtec.verify.contract.trials import Case, Trials
from tests.played import InProcess, Wires


def box(design, *, edges=RealEdges.HOLD, processor=Processor.FAST, **timing):
    return BuiltIn(
        InjectorSettings(design=design, timing=replace(Timing.of(design, processor), **timing), real_edges=edges)
    )


def confirmed(found):
    """Play the counterexample from its own text; return what the judge says."""
    stream = Stream.read(str(found.worst.case.stream))
    assert can_be(stream, found.contract)
    return stream


# --- verdicts ---
@pytest.mark.parametrize("design", Design)
@pytest.mark.parametrize(("processor", "hertz"), [(Processor.FAST, 500e3), (Processor.MCS51, 15e3)])
def test_every_design_is_proved_on_its_timing_profile(design, processor, hertz):
    found = prove(box(design, processor=processor), Contract.of(design, frequency_hz=hertz))
    assert found.ending is Ending.PROVED
    assert found.passed and found.waiting == 0 and found.states > 1000
    assert found.delay_ps < (600_000 if processor is Processor.FAST else 30_000_000)  # an insertion with its latch


@pytest.mark.parametrize(
    ("design", "processor", "finer"),
    [
        *((design, Processor.FAST, 2) for design in Design),
        *((design, Processor.MCS51, 2) for design in Design if design is not Design.B),
        *(pytest.param(design, Processor.FAST, 10, marks=pytest.mark.sweep) for design in Design),
        *(pytest.param(design, Processor.MCS51, 4, marks=pytest.mark.sweep) for design in Design),
    ],
)
def test_a_finer_grid_has_more_states_and_the_same_verdict(design, processor, finer):
    contract = Contract.of(design, frequency_hz=500e3 if processor is Processor.FAST else 15e3)
    coarse, fine = (prove(box(design, processor=processor), contract, finer=k) for k in (1, finer))
    assert coarse.ending is fine.ending is Ending.PROVED
    assert fine.grid_ps * finer == coarse.grid_ps
    assert fine.states > 1.5 * coarse.states


@pytest.mark.parametrize(
    ("design", "processor", "hertz"),
    [
        (Design.C, Processor.FAST, 500e3),
        (Design.ORIGINAL, Processor.MCS51, 15e3),
        (Design.A, Processor.MCS51, 15e3),
        pytest.param(Design.C, Processor.MCS51, 15e3, marks=pytest.mark.sweep),
        pytest.param(Design.A, Processor.FAST, 500e3, marks=pytest.mark.sweep),
    ],
)
def test_gates_without_a_latch_are_broken_and_the_judge_confirms_it(design, processor, hertz):
    bench = box(design, processor=processor, edges=RealEdges.MERGE)
    found = prove(bench, Contract.of(design, frequency_hz=hertz))
    assert found.ending is Ending.BROKEN and not found.passed
    again = Trials(bench, found.contract).one(Case(title="again", stream=confirmed(found), must_finish=False))
    assert again.fault is found.worst.fault


@pytest.mark.parametrize(("hertz", "ending"), [(781.25e3, Ending.PROVED), (830e3, Ending.BROKEN)])
def test_the_limit_without_a_speed_gate_is_the_one_found_by_hand(hertz, ending):
    # The latch opens 100 + 3 * 100 + 100 ns behind the transition that the insertion follows, and lets one edge out.
    # The second edge comes 60 ns later at least where 2 * 0.9 * quarter >= 560 ns: up to 803 kHz.
    found = prove(box(Design.ORIGINAL, gate_margin=None), Contract.of(Design.ORIGINAL, frequency_hz=hertz))
    assert found.ending is ending
    if ending is Ending.BROKEN:
        assert found.worst.fault is Fault.SEPARATION


def test_an_axis_without_limits_of_acceleration_breaks_the_original():
    contract = Contract.of(Design.ORIGINAL, acceleration_hz_s=1e15)
    found = prove(box(Design.ORIGINAL), contract)
    assert found.ending is Ending.BROKEN
    assert found.worst.fault in {Fault.ILLEGAL, Fault.SEPARATION}  # two edges of a start in one insertion at rest


def test_a_latch_that_opens_too_late_for_the_delay_is_found():
    found = prove(box(Design.C), Contract.of(Design.C, delay_ps=300_000))
    assert found.ending is Ending.BROKEN
    assert found.worst.fault is Fault.DELAY


def test_the_copies_of_b_lose_an_edge_on_the_8051_above_their_limit():
    # a copy takes 8 us, the look included: two edges within it are one change of both lines at the controller
    found = prove(box(Design.B, processor=Processor.MCS51), Contract.of(Design.B, frequency_hz=50e3))
    assert found.ending is Ending.BROKEN and found.worst.fault is Fault.ILLEGAL
    confirmed(found)


def test_what_is_too_large_is_not_decided_and_says_how_far_it_came():
    found = prove(box(Design.B), Contract.of(Design.B), finer=20, most_states=100_000)
    assert found.ending is Ending.UNDECIDED and not found.passed
    assert found.waiting > 0
    assert "too many states" in found.reason and str(found.states) in found.reason


def test_what_declares_no_finite_state_is_refused():
    with pytest.raises(RtecError, match="wires: --exhaustive takes a design of rtec"):
        prove(Wires(), Contract(step_counts=2))


def test_a_grid_that_cannot_be_divided_so_is_refused():
    with pytest.raises(ArgumentError, match="finer"):
        Grid.of(box(Design.C).settings, Contract.of(Design.C), finer=7)


# --- the model against the bench ---
@pytest.mark.parametrize("design", Design)
def test_ways_through_the_model_end_as_the_bench_ends(design):
    bench, contract = box(design), Contract.of(design)
    # the grid divides the time of the gate, so that each comparison is the bench's
    search = BoxSearch(bench.settings, contract, finer=1 if design is Design.C else 5)
    assert search.run() is Ending.PROVED
    rng = np.random.default_rng(5)
    same = inserted = 0
    for number in rng.integers(4, search.found, 250).tolist():
        way = search.way_to(number)
        if any(event.close for event in way.events) or search._fields()["after"][number] == 0:
            continue  # another order of one instant than the bench's
        edges = [(event.time_ps, event.move) for event in way.events if event.move]
        asked = [(max(event.time_ps, 1), event.total) for event in way.events if not event.move]
        response = bench.play([Stream.of(way.state, edges, asked, way.end_ps + 1).stimulus()])[0]
        assert response.completed.final == way.completed
        assert response.edges.levels_at([way.end_ps])[0] == way.levels
        same, inserted = same + 1, inserted + (way.completed != 0)
    assert same > 8 and inserted > 0


def followers(search, states, moves, level):
    """Return states in which the edges of a point have come and the levels are right, before time goes on."""
    box, model, layer, seen = search._box, search._model, [(state, 0) for state in states], set()
    while layer:
        seen |= set(layer)
        after = set()
        for (first, second, by, sense), come in layer:
            for kind in (events.DOWN, events.UP, events.FIRE, events.REQUEST):
                edge = kind in (events.DOWN, events.UP)
                if edge and (come == len(moves) or sense * moves[come] != kind - events.WAIT):
                    continue
                unpack(first, second, box, model)
                if not events.may_come(box, model, kind):
                    continue
                owed = range(events.least_owed(box, kind), events.most_owed(box, kind) + 1)
                equal = events.equal_sides(box, model, kind)
                for signs, sides in product(owed, [k for k in range(8) if not k & ~equal]):
                    code = int(events.code_of(kind, signs, sides, 0))
                    assert events.follow(first, second, code, box, model) == events.KEPT
                    turned = by + sense * int(model.by), sense * int(model.sense)
                    after.add(((int(model.first), int(model.second), turned[0] % 4, turned[1]), come + edge))
        layer = list(after - seen)

    def there(state):
        levels = int(fields_of(np.int64(state[0]), np.int64(state[1]))["levels"])
        return (state[2] + state[3] * (levels ^ levels >> 1)) % 4 == (level ^ level >> 1)

    return {state for state, come in seen if come == len(moves) and there(state)}


@pytest.mark.parametrize("design", Design)
def test_every_run_of_a_bench_is_one_of_the_model_on_a_grid_that_it_does_not_know(design):
    bench, contract = box(design), Contract.of(design)
    search = BoxSearch(bench.settings, contract)
    grid_ps, rng, runs, inserted = search.grid.grid_ps, np.random.default_rng(4), 0, 0
    while runs < 5:
        gaps = rng.choice([100, 130, 460, 900, 1500], 6) * 1000 + rng.integers(0, 50_000, 6)
        edges = list(zip(np.cumsum(gaps).tolist(), rng.choice([-1, 1], 6).tolist(), strict=True))
        asked_ps = np.sort(rng.integers(1, 5_000_000, 5))
        asked = list(zip(asked_ps.tolist(), rng.integers(-2, 3, 5).tolist(), strict=True))
        stream = Stream.of(0, edges, asked, 12_000_000)
        if not can_be(stream, contract):
            continue
        response, up_from = bench.play([stream.stimulus()])[0], rng.uniform() * grid_ps
        out = list(zip(response.edges.times_ps.tolist(), response.edges.levels.tolist(), strict=True))
        come, left = ([(t // grid_ps + (t % grid_ps > up_from), what) for t, what in each] for each in (edges, out))
        states = {(int(s["first"]), int(s["second"]), 0, 1) for s in search._states[:1]}
        for point in range(max(come + left)[0] + 1):
            level = [response.edges.initial, *(what for t, what in left if t <= point)][-1]
            states = followers(search, states, [move for t, move in come if t == point], level)
            waited = set()
            for first, second, by, sense in states:
                unpack(first, second, search._box, search._model)
                if events.may_come(search._box, search._model, events.WAIT):
                    events.follow(first, second, events.WAIT + 8, search._box, search._model)
                    waited.add((int(search._model.first), int(search._model.second), by, sense))
            states = waited
            assert states, f"{stream} at {point}"
        runs, inserted = runs + 1, inserted + len(response.completed)
    assert inserted > 1


@pytest.mark.parametrize("design", Design)
def test_a_bench_does_the_same_from_each_state_and_in_a_mirror(design):
    bench, contract = box(design), Contract.of(design)
    trials = Trials(bench, contract)
    trials.measure_settling()
    rng, made = np.random.default_rng(8), 0

    def counts(stream, sense):
        response = bench.play([stream.stimulus()])[0]
        levels = response.edges.levels.astype(int)
        states = (levels ^ (levels >> 1)) - stream.state
        done = response.completed
        return (
            response.edges.times_ps.tolist(),
            (sense * states % 4).tolist(),
            done.times_ps.tolist(),
            (sense * done.totals).tolist(),
        )

    for _ in range(60):
        stream = random_stream(trials, rng)
        stream = replace(stream, until_ps=stream.last_ps + 3_000_000_000)
        made += len(bench.play([stream.stimulus()])[0].completed)
        for state in [0] if design.one_state else range(4):
            turned = replace(stream, state=(stream.state + state) % 4)
            assert counts(turned, 1) == counts(stream, 1)
            mirrored = replace(turned, state=-turned.state % 4, moves=-turned.moves, totals=-turned.totals)
            assert counts(mirrored, -1) == counts(stream, 1)
    assert made > 20


def admitted(model, points, moves):
    """Return whether the model of the encoder takes edges at points of the grid."""
    motion, direction, last = 0, 0, 0
    for point, move in zip(points, moves, strict=True):
        since = point - last
        least = model.least_same[motion] if motion == 0 or move == direction else model.least_turn[motion]
        if since < least:
            return False
        motion = model.motion_after(motion, since, turns=move != direction)
        direction, last = move, point
    return True


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_the_encoder_takes_every_stream_of_the_contract_rounded_by_one_rule(share):
    bench, contract = box(Design.C), Contract.of(Design.C)
    trials = Trials(bench, contract)
    trials.measure_settling()
    grid_ps = 25_000
    model = EncoderModel.of(contract, grid_ps=grid_ps, quiet=80)
    rng, taken = np.random.default_rng(3), 0
    for _ in range(600):
        stream = random_stream(trials, rng)
        if not can_be(stream, contract):
            continue
        whole, rest = np.divmod(stream.edges_ps, grid_ps)
        points = whole + (rest > share * grid_ps)  # Henzinger, Manna and Pnueli 1992
        points += 1  # power-up lies on the grid; the first edge may come at once
        assert admitted(model, points.tolist(), stream.moves.tolist()), str(stream)
        taken += 1
    assert taken > 300


def test_the_encoder_refuses_a_turn_at_speed_and_a_start_at_once():
    model = EncoderModel.of(Contract.of(Design.C), grid_ps=25_000, quiet=80)
    assert not admitted(model, [1, 21, 41, 61], [1, 1, 1, -1])
    assert not admitted(model, [500, 518], [1, 1])
    assert admitted(model, [1, 21, 41, 61], [1, 1, 1, 1])


# --- users' classes ---
@pytest.mark.parametrize("name", ["COrder", "CRawPins", "BOffset", "BTooSoon", "ARawPins", "CPowerUp", "ANotWoken"])
def test_a_mutant_is_broken_and_the_judge_confirms_it(name):
    kind = getattr(mutants, name)
    contract = Contract.of(Design.named(name[0].lower()))
    search = ClassSearch(kind, contract, together=True)
    assert search.run(most_s=60) is Ending.BROKEN
    run = search.way().played(Trials(InProcess(kind), contract), 100_000_000)
    assert run is not None and not run.right


def test_the_search_breaks_the_shown_design_c_where_no_hunt_did():
    # an axis that trembles at 5 MHz over one edge, and a step asked for each time it comes back
    tremble = [(50_000 + 100_000 * k, 1 if k % 2 else -1) for k in range(1, 502)]
    asked = [(50_000 + 200_000 * k, -1 - k) for k in range(251)]
    contract = Contract.of(Design.C)
    stream = Stream.of(0, [(t, -move) for t, move in tremble], asked, 151_000_000)
    assert can_be(stream, contract)
    run = Trials(InProcess(designs.C), contract).one(Case(title="trembles", stream=stream, must_finish=False))
    assert run.fault is Fault.DELAY


@pytest.mark.sweep
def test_the_shown_design_b_is_proved():
    search = ClassSearch(designs.B, Contract.of(Design.B))
    assert search.run() is Ending.PROVED and search.waiting == 0


class Wired:
    """Passes every edge, and says nothing of its state."""

    def step(self, t_ps, ab, requested):
        return ab, 0, 0


def test_a_class_that_does_not_declare_its_state_is_told_what_is_missing():
    with pytest.raises(RtecError, match="TIMES, TOTALS, GRID_PS, FORGETS_PS missing"):
        ClassSearch(Wired, Contract(step_counts=2))


def test_a_grid_coarser_than_a_turn_is_refused():
    kind = type("Coarse", (Wired,), {"TIMES": (), "TOTALS": (), "GRID_PS": 200_000, "FORGETS_PS": 0})
    with pytest.raises(RtecError, match=r"Coarse.GRID_PS is 200000; 1 to 100000 ps"):
        ClassSearch(kind, Contract(step_counts=2))


def test_wires_that_declare_their_state_leave_a_step_undone():
    kind = type("Told", (Wired,), {"TIMES": (), "TOTALS": (), "GRID_PS": 100_000, "FORGETS_PS": 0})
    search = ClassSearch(kind, Contract(step_counts=2))
    assert search.run() is Ending.BROKEN
    run = search.way().played(Trials(InProcess(kind), search.contract), 100_000_000)
    assert run.fault is Fault.UNFINISHED


def test_an_attribute_that_grows_without_end_is_named(monkeypatch):
    class Counts(Wired):
        TIMES, TOTALS, GRID_PS, FORGETS_PS = (), (), 100_000, 0
        calls = 0

        def step(self, t_ps, ab, requested):
            self.calls += 1
            return ab, 0, 0

    monkeypatch.setattr(class_search, "_MANY", 5)
    search = ClassSearch(Counts, Contract(step_counts=2), window=0)
    assert search.run(most_states=5_000) is Ending.UNDECIDED
    assert "calls takes more than 5 values" in search.hint()


def test_a_time_that_is_not_declared_is_an_error():
    class Remembers(Wired):
        TIMES, TOTALS, GRID_PS, FORGETS_PS = (), (), 100_000, 0
        edge_ps = 0

        def step(self, t_ps, ab, requested):
            self.edge_ps = t_ps
            return ab, 0, 0

    with pytest.raises(RtecError, match="edge_ps holds a time and is not one of TIMES"):
        ClassSearch(Remembers, Contract(step_counts=2)).run()
