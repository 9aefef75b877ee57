"""The exhaustive sweep: every design and processor, 1 kHz to 500 kHz, all offsets of the insertion through a cycle.

Two kinds of run. *Right after an edge*, as the box does it: the encoder's phase against the processor's clock is
swept, and the speed gate decides. *At any time*: the gate is off and the axis counts as at rest at once, so that an
insertion begins wherever the request comes; whatever then goes wrong must be seen by the monitor, exactly as two
independent decoders see it.
"""

import itertools
from collections import Counter

import numba
import numpy as np
import pytest

from rtec._jit import new_record
from rtec.injector import Design, InjectorSettings, Processor, Timing, _kernels
from rtec.injector._state_kernels import INJECTOR

NS, US = 1_000, 1_000_000
CLOCK_PS = {Processor.MCS51: US, Processor.FAST: 10 * NS}
# counts of "before * 4 + after" for level codes A + 2 B, written down from the report's state table; 2: both lines
DECODE = np.array([0, 1, -1, 2, -1, 0, 2, 1, 1, 2, 0, -1, 2, -1, 1, 0])
FORWARD = [0, 1, 3, 2]
EDGES = 32
WARM = 16
"""Edges that pass before anything is asked, so that the gate has timed the motion."""


@numba.njit
def run_all(states, times, levels, offsets_ps, shifts_ps, sign, table, net, jumps):
    """Ask each box for one step so long after an edge, all edges shifted; decode what comes out."""
    out_ps = np.empty(6 * times.size + 64, np.int64)
    out = np.empty(6 * times.size + 64, np.uint8)
    for i in range(offsets_ps.size):
        moved = times + shifts_ps[i]
        asked_ps = moved[WARM - 1] + offsets_ps[i]
        split = np.searchsorted(moved, asked_ps)
        end_ps = moved[-1] + 60 * US
        early = _kernels.inject(states[i], moved[:split], levels[:split], -(2**60), asked_ps, out_ps, out)
        _kernels.request(states[i], asked_ps, sign)
        late = _kernels.inject(
            states[i], moved[split:], levels[split:], asked_ps, end_ps, out_ps[early:], out[early:]
        )
        before = 0
        for k in range(early + late):
            if k > 0 and out_ps[k] <= out_ps[k - 1]:
                raise ValueError("edges out of order")
            step = table[before * 4 + int(out[k])]
            if step == 2:
                jumps[i] += 1
            else:
                net[i] += step
            before = int(out[k])


def sweep(design, timing, frequency_hz, direction, sign, offsets_ps, shifts_ps):
    """Return the states of the boxes, and by how much and with how many jumps the controller's side went ahead."""
    quarter_ps = 10**12 / (4 * frequency_hz)
    times = np.round(quarter_ps * (np.arange(EDGES) + 1)).astype(np.int64)
    levels = np.array([FORWARD[direction * (k + 1) % 4] for k in range(EDGES)], dtype=np.uint8)
    fresh = new_record(INJECTOR)
    InjectorSettings(design=design, timing=timing).fill(fresh)
    _kernels.reset(fresh, 0)
    states = np.rec.array(np.full(offsets_ps.size, np.void(fresh), dtype=INJECTOR))
    net, jumps = np.zeros(offsets_ps.size, np.int64), np.zeros(offsets_ps.size, np.int64)
    run_all(states, times, levels, offsets_ps, shifts_ps, sign, DECODE, net, jumps)
    return states, net - direction * EDGES, jumps


def cases(frequencies, most_offsets):
    """Yield every design, processor, frequency, direction and sign, with the offsets of a cycle, a clock apart."""
    for design, processor, frequency in itertools.product(Design, CLOCK_PS, frequencies):
        offsets = np.arange(0, int(1e12 / frequency), CLOCK_PS[processor])
        offsets = offsets[:: max(1, offsets.size // most_offsets)]
        for direction, sign in itertools.product((+1, -1), (+1, -1)):
            yield design, processor, frequency, direction, sign, offsets


def agree(condition, *what):
    """Fail with the first offset at which ``condition`` does not hold."""
    wrong = np.flatnonzero(~condition)
    assert not wrong.size, (*what[:-1], int(what[-1][wrong[0]]))


def check_behind_edges(frequencies, most_offsets):
    """Sweep the phase of the encoder against the polling loop, the gate on; return what the gate did."""
    seen = Counter()
    for design, processor, frequency, direction, sign, offsets in cases(frequencies, most_offsets):
        where = (design, processor, frequency, direction, sign, offsets)
        timing = Timing.of(design, processor)
        # asked just behind an edge; the phase moves by the same offset, and a little within the clock's period
        phases = offsets + offsets // CLOCK_PS[processor] % 7
        states, ahead, jumps = sweep(design, timing, frequency, direction, sign, np.ones_like(offsets), phases)
        done = states.completed == sign
        agree(done | (states.completed == 0), *where)
        agree(states.illegal_out == jumps, *where)
        if design is not Design.B or 10**12 / (4 * frequency) >= timing.poll_ps + timing.latency_ps:
            agree((ahead == sign * design.step_counts * done) & (jumps == 0), *where)
            agree((states.ahead == ahead) & (states.real_inside == 0), *where)
        else:  # too fast for Design B's copying
            agree(states.completed == 0, *where)
            agree((jumps > 0) | (states.ahead == ahead), *where)
            continue
        # a gate that refuses does so for the whole of a steady motion
        agree(done == (states.refused == 0), *where)
        assert done.all() or not done.any(), where
        seen[(design, processor, "done" if done.all() else "refused")] += 1
        fast_enough = frequency * 1.16 <= 1e12 / (4 * timing.worst_ps(design))
        assert done.all() == fast_enough or frequency * 1.14 <= 1e12 / (4 * timing.worst_ps(design)), where
    return seen


def check_anywhere(frequencies, most_offsets):
    """Sweep the moment of an insertion through a cycle, the gate off; return how many were spoilt."""
    seen = Counter()
    for design, processor, frequency, direction, sign, offsets in cases(frequencies, most_offsets):
        where = (design, processor, frequency, direction, sign, offsets)
        profile = Timing.of(design, processor)
        fields = {name: getattr(profile, name) for name in Timing.__dataclass_fields__}
        timing = Timing(**fields | {"gate_margin": None, "rest_ps": 1})
        states, ahead, jumps = sweep(design, timing, frequency, direction, sign, offsets + 1, np.zeros_like(offsets))
        agree(states.illegal_out == jumps, *where)
        agree((jumps > 0) | (states.ahead == ahead), *where)
        expected = states.completed * design.step_counts
        right = (ahead == expected) & (jumps == 0)
        # the invariant that a run's audit checks: nothing is wrong without one of the two saying so
        agree(right == ((states.ahead == expected) & (states.illegal_out == 0)), *where)
        if design is not Design.B:
            # a real edge at the very instant of the last change is a jump, not inside
            agree(right | (states.real_inside > 0) | (jumps > 0), *where)
        seen[(design, processor, "right")] += np.count_nonzero(right)
        seen[(design, processor, "silent")] += np.count_nonzero(~right & (jumps == 0))
        seen[(design, processor, "illegal")] += np.count_nonzero(jumps)
    return seen


def log_grid(points):
    return np.geomspace(1e3, 500e3, points)


def test_thinned_sweep_behind_edges():
    seen = check_behind_edges(log_grid(13), 40)
    for design, processor in itertools.product(Design, CLOCK_PS):
        assert seen[(design, processor, "done")] > 0
        if processor is Processor.MCS51:
            assert seen[(design, processor, "refused")] > 0


def test_thinned_sweep_anywhere():
    seen = check_anywhere(log_grid(13), 60)
    for design, processor in itertools.product(Design, CLOCK_PS):
        assert seen[(design, processor, "right")] > 0
        if design is not Design.B:
            # wrong counts without an illegal transition: what the controller cannot notice, the monitor does
            assert seen[(design, processor, "silent")] > 0


@pytest.mark.sweep
def test_full_sweep_behind_edges():
    assert check_behind_edges(log_grid(28), 10**9)[(Design.C, Processor.FAST, "done")] == 4 * 28


@pytest.mark.sweep
def test_full_sweep_anywhere():
    assert sum(check_anywhere(log_grid(28), 10**9).values()) > 7_000_000
