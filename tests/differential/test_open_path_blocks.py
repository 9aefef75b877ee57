"""The open path's blocks against its step functions: the same run with and without a tape ends in the same state.

A run with a tape takes every edge through the step functions one by one; a run without one passes blocks of edges
where nothing but counting happens to them.
"""

import itertools

import numpy as np
import pytest

from rtec.axis import Encoder, Imperfections
from rtec.axis.encoder import crosses_evenly
from rtec.controller import IllegalPolicy, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.injector._wave_kernels import COLUMNS
from rtec.machine import OpenPath, _ahead_kernels, _open_kernels as kernels
from rtec.machine.open_run import move, stop

CYCLES = 601  # 2404 edges: no whole number of blocks
EDGES = 4 * CYCLES
SETTLE_PS = 1_000_000
CACHED = ("reference_ps", "reference_tick")  # where the clock was last looked up, not what it says

FREQUENCIES_HZ = (500e3, 100e3, 333_333.0, 5e3, 20e3, 700e3)
PHASES_DEG = (0.0, 10.0, -40.0, -85.0)  # the last brings edges closer than a clock of the filter
JITTERS_PS = (0, 5_000, 60_000)
CORRECTIONS = (0, 37, -11)
FILTERS = (3, 22, 11, 25)
SWEEP = list(
    itertools.product(
        Design, Processor, FREQUENCIES_HZ, PHASES_DEG, JITTERS_PS, (1, -1), CORRECTIONS, FILTERS, RealEdges
    )
)
THINNED = SWEEP[::23]  # coprime to the length of every axis: all values of any three axes meet


def open_path(design, processor, frequency_hz, phase_deg, jitter_ps, direction, corrections, samples, real_edges):
    return OpenPath(
        injector=InjectorSettings(design=design, timing=Timing.of(design, processor), real_edges=real_edges),
        frequency_hz=frequency_hz,
        cycles=CYCLES,
        corrections=corrections,
        direction=direction,
        receiver=ReceiverSettings(filter_samples=samples),
        encoder=Encoder(imperfections=Imperfections(phase_error_deg=phase_deg, jitter_ps=jitter_ps), seed=3),
    )


def blank_tape():
    return np.zeros((32 * EDGES, COLUMNS), np.int64), np.ones(1, np.int64)


def end_state(path, tape, parts=(EDGES,)):
    """Run the path, cut into ``parts`` edges, and return when all is settled and what is left in the state."""
    state = path.state()
    for edges in parts:
        assert move(state, edges, None, tape) == 0
    settled_ps = stop(state, SETTLE_PS, None, tape)
    fields = {"settled_ps": settled_ps, "due": int(state.due)}
    for part in ("encoder", "injector", "receiver"):
        stage = getattr(state, part)
        fields |= {f"{part}.{name}": stage[name].tolist() for name in stage.dtype.names if name not in CACHED}
    return fields


def differences(configurations, parts=(EDGES,)):
    """Return what differs between the two ways, and how many configurations were run."""
    wrong, run, tape = [], 0, blank_tape()
    for configuration in configurations:
        path = open_path(*configuration)
        try:
            path.state()
        except ArgumentError:  # jitter that would make edges change places
            continue
        run += 1
        tape[1][:] = 1
        stepped, passed = end_state(path, tape), end_state(path, None, parts)
        wrong += [
            (configuration, name, value, passed[name]) for name, value in stepped.items() if value != passed[name]
        ]
    return wrong, run


def test_blocks_give_what_the_steps_give():
    wrong, run = differences(THINNED)
    assert wrong == []
    assert run > 0.7 * len(THINNED)


@pytest.mark.sweep
@pytest.mark.parametrize("design", Design)
def test_blocks_give_what_the_steps_give_everywhere(design):
    wrong, run = differences(configuration for configuration in SWEEP if configuration[0] is design)
    assert wrong == []
    assert run > 0.7 * len(SWEEP) / len(Design)


def test_a_run_cut_into_parts_gives_the_same():
    cuts = np.sort(np.random.default_rng(5).integers(0, EDGES, 30))
    parts = np.diff(cuts, prepend=0, append=EDGES).tolist()
    wrong, _ = differences(SWEEP[::77], parts)
    assert wrong == []


@pytest.mark.parametrize("frequency_hz", [500e3, 499_999.0])
@pytest.mark.parametrize("design", Design)
def test_the_blocks_are_used(design, frequency_hz):
    """Else the comparison above would be one of the step functions with themselves."""
    path = open_path(design, Processor.FAST, frequency_hz, 10.0, 5_000, 1, 0, 3, RealEdges.MERGE)
    state = path.state()
    move(state, 8, None, None)
    soon_ps = int(state.encoder.last_ps) + 300_000  # before the next edge
    kernels.run_box_until(state, None, soon_ps, None)
    assert crosses_evenly(state.encoder)
    assert _ahead_kernels.quiet_until(state, soon_ps, 0, 40, 0, 400_000) in (40, 40 - state.injector.in_path)


def test_an_illegal_transition_is_noted_at_its_time_by_the_blocks_too():
    """A change of the box that falls on an edge is an illegal transition, once noted a block of edges too late."""
    timing = Timing(decide_ps=100_000, step_ps=100_000, recover_ps=3_000_000, latency_ps=100_000, gate_margin=None)
    path = OpenPath(
        injector=InjectorSettings(design=Design.B, timing=timing),
        frequency_hz=500e3,
        cycles=403,
        corrections=16,
        encoder=Encoder(imperfections=Imperfections(phase_error_deg=-40.0, duty_error_b=0.05), seed=3),
        receiver=ReceiverSettings(policy=IllegalPolicy.GUESS),
    )
    edges = (4 * path.cycles,)
    stepped, passed = end_state(path, blank_tape(), edges), end_state(path, None, edges)
    assert stepped["receiver.simultaneous"] > 0
    assert stepped == passed
