"""What there is to see of an axis with its box on a bus."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from rtec._jit import Record
from rtec.machine import _line_kernels
from rtec.machine.station_settings import StationSettings
from rtec.requester.setup import Setup
from rtec.requester.status import BoxState, Status
from rtec.signal import NEVER


class Alarm(enum.IntEnum):
    """Why the controller has stopped the drive."""

    NONE = _line_kernels.NO_ALARM
    FOLLOWING = _line_kernels.FOLLOWING
    """The axis does not follow its command: the counts that come back are too far off."""
    ILLEGAL = _line_kernels.ILLEGAL_LINES
    """Its input saw an illegal transition, and its policy is to stop."""


_REFUSED = (
    "wrong_checksum", "repeated", "disordered", "jumped",
    "wrong_session", "wrong_requester", "contradictory", "hasty",
)  # fmt: skip
"""Why a box refuses frames."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxCounters:
    """What a box, its gates and its axis have counted."""

    requests: int
    requests_refused: int
    frames_refused: dict[str, int]
    gate_refused: int
    illegal_transitions: int
    """Those that the controller saw."""
    trips: int
    trip_position_counts: int
    moves: int
    """Moves of the program made."""

    @classmethod
    def of(cls, state: Record) -> BoxCounters:
        """Return what a kernel's state has counted."""
        node, receiver = state.node, state.receiver
        return cls(
            requests=int(node.requests),
            requests_refused=int(node.box.refused),
            frames_refused={name: int(getattr(node, name)) for name in _REFUSED if getattr(node, name)},
            gate_refused=int(state.injector.refused),
            illegal_transitions=int(receiver.simultaneous + receiver.unresolved),
            trips=int(node.box.trips),
            trip_position_counts=int(node.box.trip_position),
            moves=int(state.moves),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class StationView:
    """What happens at one axis."""

    now_ps: int
    position: int
    """True count of the encoder, from home."""
    position_mm: float
    speed_mm_s: float
    controller_count: int
    lines: int
    """Levels at the encoder's side of the box, A + 2 B."""
    lines_out: int
    """Levels at the controller."""
    box_state: BoxState
    status: Status
    session: int
    setup: Setup
    expected: Setup | None
    """What the PC that was heard last expects of the box; None where it has not said so."""
    requested: int
    """Total that the box has accepted."""
    completed: int
    inserted_counts: int
    """Counts by which the controller's side went ahead, by ideal decoders on both sides."""
    step_counts: int
    powered: bool
    switch_on: bool
    probing: bool
    held: bool
    homing: bool
    """Taken home by the operator; there it stays until the PC starts up and the position becomes zero."""
    alarm: Alarm
    counters: BoxCounters
    refused_since_heard: dict[tuple[int, str], int]
    """Frames that the running box has refused since the PC's last sign of life, by identifier and reason."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LineChange:
    """A change of the lines on either side of the box."""

    time_ps: int
    """When."""
    lines: int
    lines_out: int
    """``lines``, ``lines_out``: levels from then on at the encoder's side and at the controller's, A + 2 B."""


def station_view(
    state: Record, settings: StationSettings, refused: Mapping[tuple[int, str], int] = MappingProxyType({})
) -> StationView:
    """Return what a kernel's state says, with the frames that were refused."""
    node, injector = state.node, state.injector
    return StationView(
        now_ps=int(state.servo.now_ps),
        position=int(state.encoder.count),
        position_mm=float(state.servo.x) * settings.encoder.count_mm,
        speed_mm_s=float(state.servo.v) * settings.encoder.count_mm,
        controller_count=int(state.receiver.count),
        lines=int(state.lines),
        lines_out=int(injector.ab_out),
        box_state=BoxState(int(node.box.state)),
        status=Status(int(node.code) if node.box.state != BoxState.FATAL else int(node.box.status)),
        session=int(node.session),
        setup=settings.setup,
        expected=Setup.of_word(int(node.expected)),
        requested=int(node.box.accepted),
        completed=int(injector.completed),
        inserted_counts=int(injector.ahead),
        step_counts=settings.injector.design.step_counts,
        powered=bool(state.powered),
        switch_on=bool(node.box.switch_on),
        probing=bool(node.box.probing),
        held=bool(state.held_ps != NEVER),
        homing=bool(state.going_home),
        alarm=Alarm(int(state.alarm)),
        counters=BoxCounters.of(state),
        refused_since_heard=dict(refused),
    )
