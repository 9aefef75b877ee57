"""A homed box: how long it waits for a silent PC, and what a torn position word is."""

from node_oracle import ENABLE, GO_HOME, POSITION, REQUEST, Request

from rtec.axis.command import Move
from rtec.injector import Design, InjectorSettings, Processor, Timing
from rtec.link.frame import Frame
from rtec.machine.faults import FaultKind
from rtec.machine.station import Station, StationSettings
from rtec.requester.status import BoxState, Status
from rtec.requester.supervision import SupervisionLimits

MS = 10**9


def ask(station, sequence, flags):
    """Let 5 ms pass and send a request; return the frames of the time before it."""
    sent = station.advance(until_ps=station.now_ps + 5 * MS)
    data = Request(sequence, 0, flags, 1, station.view.session).packed(1)
    station.receive(Frame(identifier=REQUEST + 1, data=data))
    return [frame for _, frame in sent]


def homed(moves=()):
    injector = InjectorSettings(design=Design.A, timing=Timing.of(Design.A, Processor.MCS51))
    station = Station(StationSettings(axis=1, injector=injector), moves)
    ask(station, 1, GO_HOME)
    ask(station, 2, ENABLE)
    return station


def test_a_silent_pc_stops_it_after_the_watchdog_timeout_and_not_before():
    station = homed()
    heard_ps = station.now_ps
    station.advance(until_ps=heard_ps + SupervisionLimits().watchdog_ps - MS)
    assert station.view.box_state is BoxState.RUNNING
    station.advance(until_ps=heard_ps + SupervisionLimits().watchdog_ps + 2 * MS)
    assert (station.view.box_state, station.view.status) == (BoxState.FATAL, Status.LINK_LOST)


def test_a_torn_word_has_the_upper_bytes_of_an_earlier_reading():
    station = homed([Move(target_mm=2.0, speed_mm_s=20.0)])
    station.begin(FaultKind.TORN_POSITION)
    frames = [frame for sequence in range(3, 43) for frame in ask(station, sequence, ENABLE)]
    said = [int.from_bytes(f.data[2:6], "little", signed=True) for f in frames if f.identifier == POSITION + 1]
    assert station.view.position > 1_000
    assert len(set(said)) > 3
    assert {word >> 8 for word in said[1:]} == {said[1] >> 8}
