"""One axis with its box as a node of a bus, on simulated time: moves and frames in, frames and counts out."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rtec._jit import Record, new_record, prepared
from rtec.axis.encoder import Encoder
from rtec.axis.plant import bound_plant
from rtec.axis.servo import Servo
from rtec.checks import number_within, whole_within
from rtec.controller import IllegalPolicy, Multiplication, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.link._frame_kernels import MOST_AXES
from rtec.link.frame import PAYLOAD_BYTES, Frame, IdentifierFormat
from rtec.machine import _line_kernels, _station_kernels
from rtec.machine.faults import FaultKind, FaultPlace
from rtec.requester import BoxState, Conversation, Precautions, Status
from rtec.signal import NEVER


class Alarm(enum.IntEnum):
    """Why the controller has stopped the drive."""

    NONE = _line_kernels.NO_ALARM
    FOLLOWING = _line_kernels.FOLLOWING
    """The axis does not follow its command: the counts that come back are too far off."""
    ILLEGAL = _line_kernels.ILLEGAL_LINES
    """Its input saw an illegal transition, and its policy is to stop."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """A way to a position, and a rest there.

    Parameters
    ----------
    target_mm
        Position from home.
    speed_mm_s
        Feed.
    rest_s
        How long it rests there.

    Raises
    ------
    ArgumentError
        A value outside its range.
    """

    target_mm: float
    speed_mm_s: float
    rest_s: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        number_within("target_mm", self.target_mm, -1e6, 1e6, unit="mm")
        number_within("speed_mm_s", self.speed_mm_s, 1e-6, 1e4, unit="mm/s")
        number_within("rest_s", self.rest_s, 0.0, 1e6, unit="s")


def _hold_edges() -> InjectorSettings:
    design = Design.A
    return InjectorSettings(design=design, timing=Timing.of(design, Processor.MCS51), real_edges=RealEdges.HOLD)


@dataclass(frozen=True, slots=True, kw_only=True)
class StationSettings:
    """An axis with its box.

    Parameters
    ----------
    axis
        Its number, 1 to 15.
    injector
        Design and timing of the box; real edges are held back by default (decision 8).
    encoder, servo, receiver, conversation, precautions
        The other parts. The receiver stops the drive at an illegal transition by default, as a controller's encoder
        supervision does.
    acceleration_mm_s2
        Of the moves.
    hold_ramp_s
        Time in which the feed override goes from 1 to 0 when the machine is held.
    following_limit_mm
        Lag beyond that of the feed (speed / Kv, as a position loop follows it) at which the controller stops the
        drive.

    Raises
    ------
    ArgumentError
        A value outside its range; a receiver whose counts are coarser than the encoder's.
    """

    axis: int = 1
    injector: InjectorSettings = field(default_factory=_hold_edges)
    encoder: Encoder = field(default_factory=Encoder)
    servo: Servo = field(default_factory=Servo)
    receiver: ReceiverSettings = field(default_factory=lambda: ReceiverSettings(policy=IllegalPolicy.FAULT))
    conversation: Conversation = field(default_factory=Conversation)
    precautions: Precautions = field(default_factory=Precautions)
    acceleration_mm_s2: float = 500.0
    hold_ramp_s: float = 0.05
    following_limit_mm: float = 1.0
    switch_on: bool = True

    def __post_init__(self) -> None:
        """Check the ranges, and that box and controller count alike."""
        whole_within("axis", self.axis, 1, MOST_AXES)
        number_within("acceleration_mm_s2", self.acceleration_mm_s2, 1e-3, 1e6, unit="mm/s²")
        number_within("hold_ramp_s", self.hold_ramp_s, 1e-3, 100.0, unit="s")
        number_within("following_limit_mm", self.following_limit_mm, 1e-6, 1e6, unit="mm")
        if self.receiver.multiplication is not Multiplication.X4:
            raise ArgumentError("multiplication", self.receiver.multiplication.value, "4 (x4) in a corrected machine")

    def fill(self, state: Record) -> None:
        """Write the parameters into a kernel's state."""
        count_mm = self.encoder.count_mm
        self.encoder.fill(state.encoder)
        self.injector.fill(state.injector)
        self.receiver.fill(state.receiver)
        self.servo.fill(state.servo, count_mm=count_mm, counts_per_unit=1.0)
        self.conversation.fill_box(state.node.box, switch_on=self.switch_on)
        self.precautions.fill_box(state.node)
        if self.precautions.limit_steps == 0:
            state.node.limit_steps = self.injector.design.word_limit
        state.node.axis = self.axis
        state.acceleration = self.acceleration_mm_s2 / count_mm
        state.ramp_s = self.hold_ramp_s
        state.following_limit = self.following_limit_mm / count_mm


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
    requested: int
    """Total that the box has accepted."""
    completed: int
    inserted_counts: int
    """Counts by which the controller's side went ahead, by ideal decoders on both sides."""
    step_counts: int
    gate_refused: int
    requests: int
    requests_refused: int
    frames_refused: dict[str, int]
    powered: bool
    switch_on: bool
    probing: bool
    trips: int
    trip_position: int
    held: bool
    homing: bool
    """Taken home by the operator; there it stays until the PC starts up and the position becomes zero."""
    alarm: Alarm
    illegal: int
    """Illegal transitions that the controller saw."""
    moves: int
    """Moves of the program made."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LineChange:
    """A change of the lines on either side of the box.

    Parameters
    ----------
    time_ps
        When.
    lines, lines_out
        Levels from then on at the encoder's side and at the controller's, A + 2 B.
    """

    time_ps: int
    lines: int
    lines_out: int


def move_arrays(
    moves: Sequence[Move], count_mm: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return targets in counts, speeds in counts/s and rests in ps, each of shape (n,)."""
    targets = np.array([move.target_mm / count_mm for move in moves])
    speeds = np.array([move.speed_mm_s / count_mm for move in moves])
    rests = np.array([round(move.rest_s * 1e12) for move in moves], dtype=np.int64)
    return targets, speeds, rests


class Station:
    """One axis with its box, advanced by whoever owns the clock.

    Parameters
    ----------
    settings
        The parts.
    moves
        Its program, over and over; empty: it stands until it is told to :meth:`go`.
    start_ps
        Time at which it is switched on.
    session
        Number of the box's first session, 0 to 255.

    Examples
    --------
    It tells where it is before anybody asks:

    >>> station = Station(StationSettings(axis=2))
    >>> sent = station.advance(until_ps=20 * 10**9)
    >>> [hex(frame.identifier) for _, frame in sent[:3]]
    ['0x182', '0x282', '0x302']
    >>> station.view.status.name
    'NOT_HOMED'
    """

    def __init__(
        self, settings: StationSettings, moves: Sequence[Move] = (), *, start_ps: int = 0, session: int = 1
    ) -> None:
        self.settings = settings
        self._state = new_record(_line_kernels.STATION)
        settings.fill(self._state)
        self._moves = move_arrays(moves, settings.encoder.count_mm)
        self._plant = bound_plant(settings.servo.plant)
        self._run = prepared(_station_kernels.run, self._state, 0, *self._moves, self._plant)
        self._state.repeats = 1
        first_ps = start_ps + settings.conversation.box_period_ps
        _station_kernels.start(self._state, start_ps, first_ps, whole_within("session", session, 0, 255))
        self._now_ps = start_ps
        self._heard = False

    @property
    def now_ps(self) -> int:
        """Return the time up to which it has been advanced."""
        return self._now_ps

    def advance(self, *, until_ps: int) -> list[tuple[int, Frame]]:
        """Run to ``until_ps``; return the frames that the box sends meanwhile, with their times.

        Raises
        ------
        ArgumentError
            A time before the last one.
        """
        until_ps = whole_within("until_ps", until_ps, self._now_ps, NEVER - 1, unit="ps (time never runs back)")
        if until_ps > self.due_ps:
            self._heard = False
        sent: list[tuple[int, Frame]] = []
        out = self._state.node.out
        while self._now_ps < until_ps:
            self._now_ps = int(self._run(self._state, until_ps, *self._moves, self._plant))
            for k in range(int(out.waiting)):
                sent.append((self._now_ps, Frame.of_payload(int(out.identifier[k]), int(out.payload[k]))))
            out.waiting = 0
        return sent

    @property
    def due_ps(self) -> int:
        """Return the time of the box's next reading."""
        return int(self._state.node.box.next_ps)

    @property
    def awaited_ps(self) -> int:
        """Return the time of the next reading after which there may be something to send.

        While the box has nothing to judge and nothing to insert, that is the next of its cycle. What changes by
        itself in between (a watch that runs out, a probe that trips) is told then.
        """
        node = self._state.node
        next_ps, period_ps = self.due_ps, int(node.box.period_ps)
        if self._heard or node.box.accepted != self._state.injector.completed:
            return next_ps
        return next_ps + max(-((next_ps - int(node.cycle_next_ps)) // period_ps), 0) * period_ps

    def receive(self, frame: Frame) -> None:
        """Hand the box a frame at the present time; what is none of its messages is passed over."""
        self._heard = True
        if len(frame.data) == PAYLOAD_BYTES and frame.identifier_format is IdentifierFormat.BASE:
            _station_kernels.receive(self._state, self._now_ps, frame.identifier, frame.payload)

    def follow(self, moves: Sequence[Move], *, repeats: bool) -> None:
        """Take another program from here on."""
        self._moves = move_arrays(moves, self.settings.encoder.count_mm)
        self._state.repeats = int(repeats)
        self._state.moving_to = 0
        self._state.arrived_ps = NEVER

    def go(self, target_mm: float, speed_mm_s: float) -> None:
        """Go to a position and stay there."""
        self.follow([Move(target_mm=target_mm, speed_mm_s=speed_mm_s)], repeats=False)

    def go_home(self) -> None:
        """Take the axis back to its home, held or not, as the operator would, and clear the controller's alarm."""
        _station_kernels.go_home(self._state)

    def trip(self) -> None:
        """Trip the probe."""
        self.begin(FaultKind.PROBE_TRIPPED)

    def switch(self, on: bool) -> None:
        """Throw the hardware switch that allows corrections."""
        self.begin(FaultKind.SWITCH_THROWN) if not on else self.end(FaultKind.SWITCH_THROWN)

    def power(self, on: bool) -> None:
        """Take the box's power away or give it back."""
        if on != bool(self._state.powered):
            self.begin(FaultKind.POWER_LOST) if not on else self.end(FaultKind.POWER_LOST)

    def restart(self) -> None:
        """Let the box's processor start again."""
        self.begin(FaultKind.BOX_RESTARTED)

    def hold(self) -> None:
        """Hold the axis' feed, as a PC does by the controller's own input."""
        self._state.pc_holds = 1

    def begin(self, kind: FaultKind, *, while_inserting: bool = False) -> None:
        """Let a fault of the axis begin: now, or at the first moment at which an insertion is under way.

        Raises
        ------
        ArgumentError
            A fault that is none of an axis.
        """
        self._check(kind)
        if while_inserting:
            self._state.lurking = kind.code
            self._state.struck_ps = 0
        else:
            _station_kernels.fault(self._state, self._now_ps, kind.code, 1)

    def end(self, kind: FaultKind) -> None:
        """Let a fault of the axis end."""
        self._check(kind)
        if self._state.lurking == kind.code:
            self._state.lurking = _line_kernels.NO_FAULT
        else:
            _station_kernels.fault(self._state, self._now_ps, kind.code, 0)

    def keep_insertions(self) -> None:
        """Keep the changes of the lines around each insertion from now on, for :meth:`last_insertion`."""
        self._state.keeps = 1
        self._state.seen_inserted = self._state.injector.inserted

    def last_insertion(self) -> tuple[LineChange, ...]:
        """Return the changes of the lines up to and a few after the last insertion; none before the first."""
        state = self._state
        number = int(_station_kernels.show_insertion(state))
        return tuple(
            LineChange(
                time_ps=int(state.aside_ps[k]), lines=int(state.aside_in[k]), lines_out=int(state.aside_out[k])
            )
            for k in range(number)
        )

    def settle(self) -> None:
        """Let what is under way come to its end, so that the counts can be compared."""
        _station_kernels.settle(self._state)

    @property
    def view(self) -> StationView:
        """Return what happens."""
        return station_view(self._state, self.settings)

    def _check(self, kind: FaultKind) -> None:
        if kind.place is not FaultPlace.AXIS:
            raise ArgumentError(
                "kind", kind.value, "a fault of an axis", "faults of bus and PC have their place there"
            )


def station_view(state: Record, settings: StationSettings) -> StationView:
    """Return what a kernel's state says."""
    node, injector = state.node, state.injector
    refused = (
        "wrong_checksum",
        "repeated",
        "disordered",
        "jumped",
        "wrong_session",
        "wrong_requester",
        "contradictory",
        "hasty",
    )
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
        requested=int(node.box.accepted),
        completed=int(injector.completed),
        inserted_counts=int(injector.ahead),
        step_counts=settings.injector.design.step_counts,
        gate_refused=int(injector.refused),
        requests=int(node.requests),
        requests_refused=int(node.box.refused),
        frames_refused={name: int(getattr(node, name)) for name in refused if getattr(node, name)},
        powered=bool(state.powered),
        switch_on=bool(node.box.switch_on),
        probing=bool(node.box.probing),
        trips=int(node.box.trips),
        trip_position=int(node.box.trip_position),
        held=bool(state.held_ps != NEVER),
        homing=bool(state.going_home),
        alarm=Alarm(int(state.alarm)),
        illegal=int(state.receiver.simultaneous + state.receiver.unresolved),
        moves=int(state.moves),
    )
