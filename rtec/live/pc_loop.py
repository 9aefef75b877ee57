"""The PC's side of several axes on a bus: turns on a grid of the bus' clock, frames as they arrive."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence

from rtec.errors import ArgumentError, LinkError
from rtec.link._frame_kernels import AXIS_BITS, HOLD, MOST_AXES, STATUS
from rtec.link.frame import Frame
from rtec.link.transport import BusState, Transport
from rtec.live.heat_file import HeatFile
from rtec.requester.pc_node import PcNode
from rtec.requester.settings import PcState
from rtec.requester.supervision import HoldReason

MOST_KEPT = 1 << 20
"""Turns and answers that are kept for the figures at the end: three hours at 10 ms."""


class PcLoop:
    """The nodes of one PC, an axis each, on one transport.

    Once one of them holds the machine, the others do, too.

    Parameters
    ----------
    nodes
        One for each axis.
    transport
        The way to the bus.
    heat
        What thermometers say, for nodes that are told; None: nothing.

    Raises
    ------
    ArgumentError
        No node, or two of the same axis.
    """

    def __init__(self, nodes: Sequence[PcNode], transport: Transport, heat: HeatFile | None = None) -> None:
        axes = [node.axis for node in nodes]
        if not axes or len(set(axes)) != len(axes):
            raise ArgumentError("nodes", axes, "at least one, each of an axis of its own")
        self.nodes = tuple(nodes)
        self.transport = transport
        self.heat = heat
        self.late_ps = array("q")
        """How late each turn was on the grid of its axis."""
        self.answer_s = array("d")
        """How long the boxes took for each request, from the request to the frame that says it is completed."""
        self._answered = [node.view.counters.answered for node in nodes]
        self.strangers = 0
        """Frames that none of this PC's boxes sends."""
        self.heard_axes: set[int] = set()
        """Axes whose boxes were heard, of this PC or not."""
        self.lost: LinkError | None = None
        """Why the bus was lost; None while it is there."""

    @property
    def due_ps(self) -> int:
        """Return the time of the next turn."""
        return min(node.due_ps for node in self.nodes)

    def step(self) -> None:
        """Wait for the next frame or turn, and carry it out.

        A bus that vanishes is kept in ``lost``; the nodes go on taking turns, and hear nothing.
        """
        due_ps = self.due_ps
        now_ps = due_ps
        if self.lost is None:
            try:
                received = self.transport.receive(due_ps)
                now_ps = self.transport.now_ps()
                if received is not None:
                    self._take(received.frame, received.arrival_ps)
            except LinkError as error:
                self.lost = error
        for k, node in enumerate(self.nodes):
            if node.due_ps <= now_ps:
                self._turn(k, node, now_ps)

    def hold(self, reason: HoldReason) -> None:
        """Hold the machine for a reason of this PC's own."""
        for node in self.nodes:
            node.hold(reason, at_ps=self.transport.now_ps())

    def _take(self, frame: Frame, at_ps: int) -> None:
        for node in self.nodes:
            node.receive(frame, at_ps=at_ps)
        base = not frame.extended
        axis = frame.identifier & AXIS_BITS
        if base and len(frame.data) == 8 and frame.identifier & ~AXIS_BITS == STATUS and 1 <= axis <= MOST_AXES:
            self.heard_axes.add(axis)
        if not base or (frame.identifier != HOLD and all(axis != node.axis for node in self.nodes)):
            self.strangers += 1

    def _time(self, k: int, node: PcNode, now_ps: int) -> None:
        view = node.view
        if view.counters.answered != self._answered[k]:
            self._answered[k] = view.counters.answered
            if len(self.answer_s) < MOST_KEPT:
                self.answer_s.append(view.answer_s)
        if len(self.late_ps) < MOST_KEPT:
            self.late_ps.append(now_ps - node.due_ps)

    def _send(self, frames: Iterable[Frame]) -> None:
        if self.lost is None:
            try:
                for frame in frames:
                    self.transport.send(frame)
            except LinkError as error:
                self.lost = error

    def _turn(self, k: int, node: PcNode, now_ps: int) -> None:
        self._time(k, node, now_ps)
        if self.transport.state is BusState.OFF:
            node.hold(HoldReason.BUS_OFF, at_ps=now_ps)
        if node.sees_axes:
            for other in self.nodes:
                node.see_axis(other.axis, other.position_mm)
        if self.heat is not None:
            node.see_heat(self.heat.values())
        self._send(node.turn(at_ps=now_ps))
        if node.view.state is PcState.HOLD:
            for other in self.nodes:
                other.hold(HoldReason.OTHER_AXIS, at_ps=now_ps)
