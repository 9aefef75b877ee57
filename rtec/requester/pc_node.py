"""The PC's side of one axis as a node of a bus, frame by frame, on the clock of its caller."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy.typing as npt

from rtec._jit import new_record, prepared
from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError
from rtec.link._frame_kernels import AT_HOME, MOST_AXES, SWITCH_ON
from rtec.link.frame import PAYLOAD_BYTES, Frame
from rtec.predictors import Model
from rtec.predictors._kernels import AXES, INSIDE, OUTSIDE, SAID, SD
from rtec.predictors.binding import bound, check_axis, outside_input, sees_axes
from rtec.requester import _pc_node_kernels, _pc_turn_kernels
from rtec.requester.settings import HandshakeSettings, PcState
from rtec.requester.setup import Setup
from rtec.requester.status import BoxState, Status
from rtec.requester.supervision import HoldReason, SupervisionLimits
from rtec.signal import NEVER
from rtec.units import PS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class PcCounters:
    """What the PC's side of one axis has counted."""

    answered: int
    """Requests that the box has completed."""
    turns: int
    frames_refused: int
    """For their checksum or their order."""
    implausible: int
    """Positions rejected as implausible."""
    trips: int
    trip_position_counts: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PcView:
    """State of the PC's side of one axis."""

    state: PcState
    reason: HoldReason
    held_ps: int | None
    """Since when it holds the machine, on its clock."""
    connected: bool
    """Whether the box has been heard."""
    box_state: BoxState | None
    status: Status | None
    """The box's status word; None before one is received, or for an unknown one."""
    switch_on: bool
    at_home: bool
    """Whether the axis stands on its home switch."""
    session: int
    setup: Setup | None
    """Setup that it expects of the box; None: any."""
    box_setup: Setup | None
    """Setup of the box; None before it is received."""
    position: int
    """Counts from home."""
    direction: int
    target: int
    """Total of steps that the prediction asks for."""
    requested: int
    accepted: int
    completed: int
    counters: PcCounters
    answer_s: float
    """How long the last answer took, from the request to the frame that says it is completed."""
    sd_mm: float | None
    """Standard deviation of the last prediction; None where the model gives none."""
    outside: str
    """Input that is outside the model's ranges now; empty where none is."""
    outside_s: float
    """For how long the present model has had no answer: an input was outside its ranges."""
    outside_input: str
    """The first of such inputs; empty where there was none."""


class PcNode:
    """The PC's side of one axis: give it frames, call its turns when they are due, send the frames that it returns.

    Parameters
    ----------
    handshake
        Windows and periods.
    supervision
        Watchdog timeout and limits.
    axis
        Number of the axis, 1 to 15.
    predictor
        The model of the axis: a curve over the position, or any other model.
    count_mm
        Travel of one count.
    step_counts
        Counts of one step of the box.
    word_limit
        Largest total of steps that the request's word holds.
    requester
        Number of this PC, 0 to 7.
    start_ps
        Time of its first turn.
    first_sequence
        First sequence number of its frames, so that a restarted PC does not repeat itself.
    home_mm
        Position of home in the coordinates of the predictor.
    margin_mm
        How far beyond the ends of its range the predictor is still evaluated.
    setup
        Setup that it sends as expected and compares with the box's; None: neither.
    heat
        Inputs of heat that it is told (`see_heat`): ``temperature_NAME``, ``spindle_speed``.

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    Before the box is heard, it has nothing to say:

    >>> from rtec.predictors import NoError
    >>> pc = PcNode(HandshakeSettings(), SupervisionLimits(), axis=1, predictor=NoError(), count_mm=0.001,
    ...     step_counts=4, word_limit=127)
    >>> pc.turn(at_ps=0), pc.due_ps, pc.view.state.name
    ([], 10000000000, 'WAITING')
    """

    def __init__(
        self,
        handshake: HandshakeSettings,
        supervision: SupervisionLimits,
        *,
        axis: int,
        predictor: Model,
        count_mm: float,
        step_counts: int,
        word_limit: int,
        requester: int = 1,
        start_ps: int = 0,
        first_sequence: int = 0,
        home_mm: float = 0.0,
        margin_mm: float = 0.0,
        setup: Setup | None = None,
        heat: tuple[str, ...] = (),
    ) -> None:
        self.axis = whole_within("axis", axis, 1, MOST_AXES)
        number_within("count_mm", count_mm, 1e-9, 1e3, unit="mm")
        whole_within("step_counts", step_counts, 1, 1 << 20)
        whole_within("word_limit", word_limit, 0, 32767)
        self._node = node = new_record(_pc_node_kernels.PC_NODE)
        handshake.fill_pc(node.pc, count_mm=count_mm, step_counts=step_counts, word_limit=word_limit)
        supervision.fill_pc(node, count_mm=count_mm)
        node.axis = axis
        node.setup = 0 if setup is None else setup.word
        node.requester = whole_within("requester", requester, 0, 7)
        node.pc.home_mm = number_within("home_mm", home_mm, -1e6, 1e6, unit="mm")
        self._margin_mm = number_within("margin_mm", margin_mm, 0.0, 1e3, unit="mm")
        self._heat = heat
        self.predict_by(predictor)
        _pc_node_kernels.pc_node_start(node, start_ps, whole_within("first_sequence", first_sequence, 0, 255))

    def predict_by(self, predictor: Model) -> None:
        """Take another predictor from now on; home has to lie in its range."""
        check_axis(predictor, self.axis)
        model = bound(predictor, self._heat, margin_mm=self._margin_mm)
        low_mm, high_mm = predictor.range_mm
        home_mm, margin_mm = float(self._node.pc.home_mm), self._margin_mm
        if not low_mm <= home_mm <= high_mm:
            allowed = f"{low_mm:g} to {high_mm:g} mm, the range of the predictor"
            raise ArgumentError("home_mm", f"{home_mm:g} mm", allowed, "say where the axis' home is in it")
        self._node.low_mm, self._node.high_mm = max(low_mm - margin_mm, -1e9), min(high_mm + margin_mm, 1e9)
        self._model = model
        self._predictor = predictor
        self._node.pc.outside_turns, self._node.pc.outside_input = 0, INSIDE
        self.sees_axes = sees_axes(predictor)
        self._turn = prepared(_pc_turn_kernels.turn, self._node, 0, self._model)

    def see_heat(self, values: npt.ArrayLike) -> None:
        """Take what sensors of heat say, shape (inputs,), in the order of ``heat``; NaN where one says nothing."""
        self._model[SAID][:] = values

    def see_axis(self, axis: int, position_mm: float) -> None:
        """Take the position of an axis, this one or another."""
        self._node.pc.sensors[AXES + whole_within("axis", axis, 1, MOST_AXES) - 1] = position_mm

    @property
    def position_mm(self) -> float:
        """Return the position in the coordinates of the predictor; NaN before the axis was homed."""
        n = self._node
        return float(n.pc.home_mm + n.position * n.pc.count_mm) if n.has_position and n.valid else math.nan

    @property
    def due_ps(self) -> int:
        """Return the time of the next turn."""
        return int(self._node.pc.next_ps)

    def receive(self, frame: Frame, *, at_ps: int) -> None:
        """Receive a frame from the bus; other messages are ignored."""
        if len(frame.data) == PAYLOAD_BYTES and not frame.extended:
            _pc_node_kernels.pc_receive(self._node, at_ps, frame.identifier, frame.payload)

    def turn(self, *, at_ps: int) -> list[Frame]:
        """Take a turn; return the frames to send."""
        self._turn(self._node, at_ps, self._model)
        out = self._node.out
        frames = [Frame.of_payload(int(out.identifier[k]), int(out.payload[k])) for k in range(int(out.waiting))]
        out.waiting = 0
        return frames

    def hold(self, reason: HoldReason, *, at_ps: int) -> None:
        """Hold the machine for a reason of the caller; the first reason is kept."""
        _pc_node_kernels.pc_hold(self._node, at_ps, int(reason))

    def allow_large_correction(self) -> None:
        """Let the next request exceed the window, once (restart with a hot machine)."""
        self._node.pc.large_meant = 1

    def probe(self, probing: bool) -> None:
        """Enter or leave the probing mode: nothing is corrected in it."""
        self._node.pc.probing = int(probing)

    def acknowledge(self) -> None:
        """Acknowledge the box's fatal error at the start: it is asked to wait for home again."""
        self._node.reset_meant = 1

    @property
    def view(self) -> PcView:
        """Return its state."""
        n = self._node
        heard = bool(n.has_status)
        flags = int(n.box_flags)
        return PcView(
            state=PcState(int(n.pc.state)),
            reason=HoldReason(int(n.reason)),
            held_ps=None if n.held_ps == NEVER else int(n.held_ps),
            connected=heard,
            box_state=BoxState(flags & 7) if heard and flags & 7 in set(BoxState) else None,
            status=Status(int(n.code)) if heard and int(n.code) in set(Status) else None,
            switch_on=bool(flags & SWITCH_ON),
            at_home=bool(flags & AT_HOME),
            session=int(n.session),
            setup=Setup.of_word(int(n.setup)),
            box_setup=Setup.of_word(int(n.box_setup)),
            position=int(n.position),
            direction=int(n.pc.direction),
            target=int(n.pc.target),
            requested=int(n.pc.sent),
            accepted=int(n.accepted),
            completed=int(n.completed),
            counters=PcCounters(
                answered=int(n.answered),
                turns=int(n.pc.requests),
                frames_refused=int(n.wrong_checksum + n.out_of_order),
                implausible=int(n.implausible),
                trips=int(n.trips),
                trip_position_counts=int(n.trip_position),
            ),
            answer_s=int(n.answer_ps) / PS_PER_S,
            outside=outside_input(self._predictor, int(self._model[OUTSIDE][0])),
            outside_s=int(n.pc.outside_turns * n.pc.period_ps) / PS_PER_S,
            outside_input=outside_input(self._predictor, int(n.pc.outside_input)),
            sd_mm=None if math.isnan(sd_mm := float(self._model[SD][0])) else sd_mm,
        )
