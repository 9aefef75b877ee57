"""The open path: the fused loop against the stages one after the other, its audit, and what its result says."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
from steady_edges import steady_edges

from rtec._jit import new_record
from rtec.axis import Encoder, Imperfections, _kernels
from rtec.board import Microcontroller
from rtec.controller import IllegalPolicy, Multiplication, Receiver, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import Design, Injector, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine import _open_kernels as open_kernels
from rtec.machine.open_path import OpenPath
from rtec.machine.open_run import box_of, simulate, stop
from rtec.signal import EdgeStream

TWELVE_MHZ = Microcontroller.named("8051-12mhz")
FLAWED = Imperfections(phase_error_deg=10.0, duty_error_a=0.02, jitter_ps=20_000)


def path_of(design, processor=Processor.FAST, *, gate=True, hold=False, **changes):
    profile = Timing.of(design, processor)
    fields = {name: getattr(profile, name) for name in Timing.__dataclass_fields__}
    timing = profile if gate else Timing(**fields | {"gate_margin": None})
    real_edges = RealEdges.HOLD if hold else RealEdges.MERGE
    box = InjectorSettings(design=design, timing=timing, real_edges=real_edges)
    return OpenPath(injector=box, **{"frequency_hz": 100e3, "cycles": 250, "corrections": 20} | changes)


def by_stages(path):
    """Run the same job by the faces: encoder, box, receiver, each on its own."""
    total = 4 * path.cycles
    state = new_record(_kernels.ENCODER)
    path.encoder.fill_steady(state, path.frequency_hz, path.direction)
    _kernels.encoder_reset(state, 0)
    times, levels = [], []
    while int(state.serial) < total:
        t, ab = np.empty(3, np.int64), np.empty(3, np.uint8)
        n = steady_edges(state, t, ab)
        times += t[:n].tolist()
        levels += ab[:n].tolist()
    stream = EdgeStream(times, levels, initial=0)
    # a correction is due whenever another of its shares of the edges has passed, the first with the first edge
    sign = 1 if path.corrections >= 0 else -1
    due, box = total - 1, Injector(path.injector)
    out, done = [], 0
    for k, t in enumerate(times):
        due += abs(path.corrections)
        if due >= total:
            out.append(box.process(stream.part(done, k), until_ps=t))
            done = k
            box.request(box.insertions.requested + sign * (due // total), at_ps=t)
            due %= total
    # nothing is begun at rest
    out.append(box.process(stream.part(done, total), until_ps=times[-1] + path.injector.timing.rest_ps))
    receiver = Receiver(path.receiver)
    for part in out:
        receiver.process(part)
    return stream, box.insertions, receiver.result(at_ps=times[-1] + 2 * path.injector.timing.rest_ps)


CASES = [
    (design, processor, direction, sign, frequency, flaws, hold)
    for design, processor in itertools.product(Design, (Processor.MCS51, Processor.FAST))
    for direction, sign in itertools.product((1, -1), (1, -1))
    for frequency, flaws, hold in ((7e3, FLAWED, False), (100e3, Imperfections(), True), (510e3, FLAWED, False))
]


@pytest.mark.one_in(11)
@pytest.mark.parametrize(("design", "processor", "direction", "sign", "frequency", "flaws", "hold"), CASES)
@pytest.mark.parametrize("gate", [True, False])
def test_the_loop_is_its_stages(design, processor, direction, sign, frequency, flaws, hold, gate):
    path = path_of(
        design,
        processor,
        gate=gate,
        hold=hold,
        direction=direction,
        corrections=20 * sign,
        frequency_hz=frequency,
        encoder=Encoder(imperfections=flaws, seed=9),
        receiver=ReceiverSettings(policy=IllegalPolicy.FAULT),
    )
    stream, insertions, received = by_stages(path)
    result = simulate(path)
    assert result.insertions == insertions
    assert result.received == received
    assert (result.edges, result.encoder_counts) == (len(stream), stream.counts().net)


def empty_tape(ab_out):
    """Return a tape with much room; the encoder begins in state 1."""
    rows = np.zeros((1 << 16, 6), np.int64)
    rows[0, 2] = ab_out
    return rows, np.ones(1, np.int64)


def taped(tape, side):
    """Return one side of the box as it stands on a tape."""
    rows, column = tape[0][: tape[1][0]], {"encoder": 1, "controller": 2}[side]
    at = np.flatnonzero(np.diff(rows[:, column])) + 1
    return EdgeStream(rows[at, 0], rows[at, column], initial=int(rows[0, column]))


def test_what_the_gate_refuses_stays_pending_and_the_counts_right():
    result = simulate(path_of(Design.ORIGINAL, Processor.MCS51, frequency_hz=30e3))
    assert (result.insertions.completed, result.pending, result.audit, result.good) == (0, 20, True, False)
    assert result.insertions.refused == 250
    assert result.controller_counts == 1000


def test_gate_off_the_audit_says_what_the_controller_cannot_see():
    result = simulate(path_of(Design.ORIGINAL, Processor.MCS51, frequency_hz=30e3, gate=False, cycles=2000))
    assert result.received.illegal_transitions == 0
    lost = result.encoder_counts + 4 * result.insertions.completed - result.controller_counts
    assert lost > 0 and lost % 4 == 0
    assert not result.audit
    assert result.insertions.ahead_counts == 4 * result.insertions.completed - lost


@pytest.mark.parametrize("multiplication", list(Multiplication))
@pytest.mark.parametrize("bits", [8, 32])
def test_the_audit_holds_for_every_multiplication_and_a_counter_that_wraps(multiplication, bits):
    receiver = ReceiverSettings(multiplication=multiplication, counter_bits=bits)
    result = simulate(path_of(Design.C, receiver=receiver, cycles=1000))
    assert result.audit
    counts = 4040 * multiplication.value // 4
    half = 1 << (bits - 1)
    assert (result.controller_counts - counts) % (2 * half) in (0, 1, 2 * half - 1)
    assert -half <= result.controller_counts < half


def test_the_result_is_one_json_document_with_the_names_of_the_contract():
    found = json.loads(json.dumps(simulate(path_of(Design.B)).to_dict()))
    assert found.keys() >= {
        "design", "frequency_hz", "edges", "encoder_counts", "controller_counts", "corrections_requested",
        "corrections_inserted", "step_counts", "illegal_transitions", "min_separation_ps", "audit", "simulated_s",
        "wall_s", "edges_per_s",
    }  # fmt: skip
    assert (found["design"], found["edges"], found["step_counts"]) == ("b", 1000, 1)


@pytest.mark.parametrize(("name", "value"), [("cycles", 0), ("cycles", 2.5), ("corrections", 4001)])
def test_runs_that_cannot_be_are_named(name, value):
    with pytest.raises(ArgumentError, match=name):
        path_of(Design.C, **{name: value})


@pytest.mark.one_in(3)
@pytest.mark.parametrize("hold", [False, True])
@pytest.mark.parametrize("design", list(Design))
def test_a_running_program_in_the_open_path_is_the_board_between_the_same_edges(design, hold):
    path = path_of(design, Processor.MCS51, hold=hold, frequency_hz=3e3, cycles=60, corrections=9, direction=-1)
    path = replace(path, microcontroller=TWELVE_MHZ, encoder=Encoder(imperfections=FLAWED))
    state, alone = path.state(), path.board()
    box = box_of(state, path.board())
    tape = empty_tape(int(state.receiver.raw))
    assert open_kernels.run(state, None, 4 * path.cycles, box, tape) == 0
    end_ps = stop(state, 0, box, tape)
    edges, seen = taped(tape, "encoder"), taped(tape, "controller")
    due, asked, out, done = len(edges) - 1, 0, [], 0
    for k, t_ps in enumerate(edges.times_ps.tolist()):
        due += 9
        if due >= len(edges):
            due -= len(edges)
            out.append(alone.process(edges.part(done, k), until_ps=t_ps))
            done, asked = k, asked + 1
            alone.ask(asked, large=True)
    out.append(alone.process(edges.part(done, len(edges)), until_ps=t_ps + 1))
    alone.switch(False)
    out.append(alone.idle(until_ps=end_ps))
    assert np.array_equal(seen.times_ps, np.concatenate([part.times_ps for part in out]))
    assert np.array_equal(seen.levels, np.concatenate([part.levels for part in out]))
    assert int(state.injector.completed) == alone.words.completed > 5
    assert simulate(path).audit
