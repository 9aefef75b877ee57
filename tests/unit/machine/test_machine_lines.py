"""What the lines of an axis do between two turns of box and PC, in the order of their times.

The closed loop, the station on a bus and the cell all run these steps.
"""

import pytest

from rtec.axis import Encoder, Imperfections
from rtec.controller import ReceiverSettings
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing, _kernels as injector_kernels
from rtec.machine import _axis_kernels, _line_kernels
from rtec.machine.station import Station, StationSettings
from rtec.signal import NEVER

FAST = Timing.of(Design.C, Processor.FAST)
T = 10_000_000


def standing(**encoder):
    """Return the state of an axis that stands at home, with Design C in its box."""
    box = InjectorSettings(design=Design.C, timing=FAST, real_edges=RealEdges.MERGE)
    receiver = ReceiverSettings(filter_samples=0)  # it takes every change as it comes
    station = Station(StationSettings(injector=box, encoder=Encoder(**encoder), receiver=receiver))
    state = station._state
    state.event_ps = 0
    state.crossing_ps = NEVER
    state.injector.enabled = 1
    return state


def moving(state, crossing_ps):
    """Let the axis cross its next line forward, and no other one."""
    state.piece.sign = 1
    state.crossing_ps = crossing_ps


def test_changes_of_box_and_encoder_at_one_instant_are_one_change():
    state = standing()
    injector_kernels.request(state.injector, T, 1)
    _line_kernels.fire_between_edges(state)
    assert int(state.injector.ab_out) == 1  # A is inverted
    second_ps = int(state.injector.next_ps)
    state.encoder.count = 1  # and with the inverter of B, the encoder's A rises
    _line_kernels.take_lines(state, None, second_ps)
    assert int(state.injector.ab_out) == 2
    assert int(state.receiver.raw) == 2
    assert int(state.receiver.simultaneous) == 1


def test_an_edge_comes_behind_the_glitch_before_it():
    flaws = Imperfections(glitch_probability=0.5, glitch_ps=70_000)
    state = standing(imperfections=flaws)
    state.encoder.last_ps = T
    state.encoder.glitch_next_ps = T  # at the instant of the last edge, and so one picosecond later
    moving(state, T - 5)  # which jitter has put past this crossing
    _axis_kernels.run_lines(state, None, T + 2, T + 10)
    assert int(state.encoder.count) == 1
    assert int(state.encoder.last_ps) == T + 2
    assert int(state.box_count) + int(state.illegal_in) >= 1


@pytest.mark.parametrize(("until_ps", "over", "count"), [(T + 3, False, 0), (T + 9, True, 1)])
def test_a_turn_is_not_taken_behind_an_edge_that_comes_after_it(until_ps, over, count):
    state = standing()
    state.event_ps = T + 5  # nothing comes before what was there, as with an edge that jitter makes late
    moving(state, T - 1)
    assert _axis_kernels.run_lines(state, None, until_ps, T) is over
    assert int(state.encoder.count) == count
