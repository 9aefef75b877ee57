"""The board's kernels against the plain model: the same edges at the same times, the same words, cycle by cycle."""

import random

import numpy as np
import pytest
from board_oracle import FORWARD, BoardOracle

from firmware_model import Mcs51, read_hex
from rtec.board import Board, Microcontroller, board
from rtec.injector import Design
from rtec.signal import EdgeStream

LARGE, PROBING, HOME = 1, 2, 4
ORDER = {"reset": 0, "ask": 1, "switch": 2, "probe": 3, "edge": 4}
PROCESSORS = ["8051-12mhz", "12-clock 11.0592MHz", "one-clock-25mhz", "one-clock-100mhz", "one-clock 24.5MHz"]


def level(pair):
    return pair[0] + 2 * pair[1]


def cycles_of(processor):
    num, den = processor.cycle_ps
    return lambda cycles: cycles * num // den


def reading_cycles(processor):
    return (
        1000
        if processor.timing == "12-clock"
        else {25: 1041, 100: 4166}[100 if processor.clock_hz > 25e6 else 25] * 12
    )


def moves(draw, processor, begin_ps, end_ps):
    """Edges of an axis that stands, runs, hurries, jitters and turns round; many just where the processor looks."""
    time_of = cycles_of(processor)
    cycle_ps = time_of(1000) / 1000
    t, state, direction, edges = begin_ps, 0, 1, []
    while t < end_ps:
        kind = draw.choice(["slow", "steady", "fast", "hurry", "still", "turning", "aligned", "aligned"])
        gap_cycles = {"slow": 150, "steady": 40, "fast": 14, "hurry": 5, "still": 300, "turning": 20, "aligned": 1}[
            kind
        ]
        jitter = draw.choice([0.0, 0.0, 0.2, 0.9])
        if draw.random() < 0.3:
            direction = -direction
        for _ in range(draw.randrange(1, 4 if kind == "still" else 30)):
            if kind == "turning" and draw.random() < 0.3:
                direction = -direction
            t += max(1, round(gap_cycles * cycle_ps * (1 + jitter * draw.uniform(-1, 1))))
            if kind == "aligned":
                t += round(draw.choice([0, 3, 20, 50]) * cycle_ps)
                exact = time_of(round(t / cycle_ps)) + draw.choice([0, 0, 0, processor.sample_ps])
                t = max(t + 1 if t >= exact else t, exact + draw.choice([0, 0, 0, 1, -1]))
            if kind != "aligned" and draw.random() < 0.02:
                t += draw.choice([1, 30_000, 200_000]) - round(gap_cycles * cycle_ps * 0.9)
            t = max(t, (edges[-1][0] if edges else begin_ps - 1) + 1)
            if t >= end_ps:
                break
            state = (state + (2 if draw.random() < 0.003 else direction)) % 4
            edges.append((t, "edge", FORWARD[state]))
    return edges


def script_of(draw, processor, readings):
    """Home, then requests, the switch, the probe, resets, and edges all along."""
    time_of, reading = cycles_of(processor), reading_cycles(processor)

    def at(n):
        return time_of(round(n * reading)) + draw.choice([0, 0, 1, processor.sample_ps, draw.randrange(10**6)])

    end_ps = time_of(readings * reading)
    script = [(at(0.0), "ask", (0, HOME)), (at(2.3), "ask", (0, 0))]
    n, total = 2.5, 0
    while n < readings - 1:
        what = draw.choice(["ask", "ask", "ask", "switch", "probe", "reset"])
        if what == "ask":
            total += draw.choice([1, -1, 2, -2, 3, 3, -3])
            script.append((at(n), "ask", (total, draw.choice([0, 0, 0, LARGE]))))
        elif what == "switch":
            script += [(at(n), "switch", 1), (at(n + 0.8), "switch", 0)]
        elif what == "probe":
            script += [(at(n), "probe", 0), (at(n) + draw.randrange(1, 10**7), "probe", 1)]
        elif draw.random() < 0.5:
            script += [(at(n), "reset", None), (at(n + 0.3), "ask", (0, HOME)), (at(n + 2.6), "ask", (0, 0))]
            n, total = n + 2.6, 0
        n += draw.choice([0.1, 0.7, 1.5])
    script += moves(draw, processor, time_of(draw.choice([10, reading * 2])), end_ps)
    # a reset, now and then, at the very moment of an edge
    edges_ps = [t for t, what, _ in script if what == "edge"]
    for k, (_, what, value) in enumerate(script):
        if what == "reset" and draw.random() < 0.5:
            script[k] = (min(edges_ps, key=lambda t: abs(t - script[k][0])), what, value)
    ordered = sorted((event for event in script if event[0] < end_ps), key=lambda event: (event[0], ORDER[event[1]]))
    return ordered, end_ps


def play(the_board, script, end_ps, cuts):
    """Play a script on a board, with the runs cut at these times too; return its output edges."""
    times, levels, waiting = [], [], []

    def run(until_ps):
        nonlocal waiting
        if until_ps > the_board.now_ps:
            initial = int(the_board._state.ab_in)
            stream = EdgeStream([t for t, _ in waiting], [code for _, code in waiting], initial=initial)
            out = the_board.process(stream, until_ps=until_ps)
            times.extend(out.times_ps.tolist())
            levels.extend(out.levels.tolist())
            waiting = []

    cuts = sorted(cut for cut in cuts if cut < end_ps)
    for t, what, value in [*script, (end_ps, "end", None)]:
        while cuts and cuts[0] <= t:
            run(cuts.pop(0))
        if what == "edge":
            waiting.append((t, level(value)))
            continue
        run(t)
        if what == "ask":
            total, status = value
            the_board.ask(total, large=bool(status & 1), probing=bool(status & 2), home=bool(status & 4))
        elif what == "switch":
            the_board.switch(not value)
        elif what == "probe":
            the_board.probe(not value)
        elif what == "reset":
            the_board.reset()
    return list(zip(times, levels, strict=True))


def oracle_of(design, processor, hold_latch, script):
    cpu = Mcs51(read_hex(processor.image(design)), processor.part, processor.timing)
    clocks = 12 if processor.timing == "12-clock" else 1
    return BoardOracle(cpu, design.value, processor.clock_hz, clocks, hold_latch, script)


def same_state(ours, peer):
    assert (ours.pc, ours.cycles, ours.instructions) == (peer.pc, peer.cycles, peer.instructions)
    np.testing.assert_array_equal(ours.iram, peer.iram)
    np.testing.assert_array_equal(ours.sfr, peer.sfr)
    np.testing.assert_array_equal(ours.xram[0xFF10:0xFF30], peer.xram[0xFF10:0xFF30])


def compare(design, name, hold_latch, seed, readings, monkeypatch=None):
    draw = random.Random(f"{design} {name} {hold_latch} {seed}")  # noqa: S311 - no secret
    processor = Microcontroller.named(name)
    script, end_ps = script_of(draw, processor, readings)
    peer = oracle_of(design, processor, hold_latch, script)
    peer.run(end_ps)
    ours = Board(design, processor, hold_latch=hold_latch)
    changes = play(ours, script, end_ps, [])
    assert changes == [(t, level(pair)) for t, pair in peer.changes]
    same_state(ours.cpu, peer.cpu)
    return draw, processor, script, end_ps, ours, changes


@pytest.mark.one_in(3)
@pytest.mark.parametrize("hold_latch", [False, True])
@pytest.mark.parametrize(
    "name", [*PROCESSORS[:3], *(pytest.param(n, marks=pytest.mark.sweep) for n in PROCESSORS[3:])]
)
@pytest.mark.parametrize("design", list(Design))
def test_the_board_does_what_the_plain_model_does(design, name, hold_latch, monkeypatch):
    for seed in (0,):
        draw, processor, script, end_ps, whole, changes = compare(design, name, hold_latch, seed, 7)
        monkeypatch.setattr(board, "_ROOM", 1)  # as small as it can be: each change of the box ends a turn
        cut = Board(design, processor, hold_latch=hold_latch)
        cuts = [draw.randrange(1, end_ps) for _ in range(60)]
        cuts += [
            t + draw.choice([0, 1]) for t, what, _ in draw.sample(script, min(60, len(script))) if what == "edge"
        ]
        assert play(cut, script, end_ps, cuts) == changes
        same_state(cut.cpu, whole.cpu)
        monkeypatch.undo()


@pytest.mark.sweep
@pytest.mark.parametrize("seed", range(2, 60))
@pytest.mark.parametrize("design", list(Design))
def test_many_random_scripts(design, seed):
    compare(design, PROCESSORS[seed % len(PROCESSORS)], bool(seed & 8), seed, 12)
