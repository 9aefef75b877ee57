"""A live PC from its start to its end: waiting for the boxes, correcting, holding the machine, leaving."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass

from rtec.live.events import Events
from rtec.live.figures import spread_ms
from rtec.live.pc_loop import PcLoop
from rtec.live.quiet import Pace
from rtec.live.stopping import StopWish
from rtec.live.words import hold_words, pc_words, waiting_words
from rtec.requester.pc_node import PcView
from rtec.requester.settings import PcState
from rtec.requester.status import BoxState
from rtec.requester.supervision import HoldReason
from rtec.units import PS_PER_MS, PS_PER_S

LINGER_S = 1.0
"""Time for which a PC that holds the machine goes on reporting it."""
GOODBYE_TURNS = 10
"""Number of reports when the operator ends it."""
FATAL_S = 0.5
"""Time to wait for a box that has stopped for good, in case it is being restarted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PcEnding:
    """How a run ended."""

    why: str
    """`Ctrl-C`, `SIGTERM`, `duration`, `held`, `nobody answers` or `box stopped`."""
    text: str
    """In words."""
    good: bool
    """Whether it ended because it was asked to."""


class PcRun:
    """Runs the PC until it is stopped.

    Parameters
    ----------
    loop
        The nodes on their bus.
    events
        Where it says what happens.
    stop
        The wish to stop.
    until_s
        When it ends by itself; None: never.
    start_up_s
        Longest time until every box is homed and answers.
    waited_s
        How much of that had gone by before the bus was there.
    acknowledged
        Whether the operator has acknowledged a box that has stopped for good.
    line_of_box
        Whether the bus is the box's own line, which goes when the box's program does.
    turn_s
        Time between two turns.
    show
        Called now and then with the time since the start, to show what there is to see.
    """

    def __init__(
        self,
        loop: PcLoop,
        *,
        events: Events,
        stop: StopWish,
        until_s: float | None = None,
        start_up_s: float = 60.0,
        waited_s: float = 0.0,
        acknowledged: bool = False,
        line_of_box: bool = False,
        turn_s: float = 0.01,
        show: Callable[[float], None] = lambda at_s: None,
    ) -> None:
        self._loop, self._events, self._stop, self._show = loop, events, stop, show
        self._until_s, self._start_up_s, self._turn_s = until_s, start_up_s, turn_s
        self._waited_s = waited_s
        self._acknowledged, self._line_of_box = acknowledged, line_of_box
        self._begin_ps = loop.transport.now_ps()
        self._leave_at_s: float | None = None
        self._leaving: PcEnding | None = None
        self._fatal_since_s: float | None = None
        self._ready = False
        self._loss_reported = False
        self._unsent = 0

    @property
    def at_s(self) -> float:
        """Return the time since the start, on the clock of the bus."""
        return (self._loop.transport.now_ps() - self._begin_ps) / PS_PER_S

    def run(self) -> PcEnding:
        """Run; return how it ended."""
        pace = Pace(self._begin_ps)
        left_s = max(self._start_up_s - self._waited_s, 0.0)
        axes = ", ".join(str(node.axis) for node in self._loop.nodes)
        self._events.happen(0.0, f"waiting up to {left_s:.4g} s for the box of axis {axes}")
        while True:
            self._loop.step()
            if pace.polls(self._loop.transport.now_ps()) or self._loop.lost is not None:
                ending = self._poll()
                if ending is not None:
                    return ending

    def _poll(self) -> PcEnding | None:
        at_s = self.at_s
        nodes = self._loop.nodes
        if self._loop.lost is not None and not self._loss_reported:
            self._lose(at_s)
        views = [node.view for node in nodes]
        words = {node.axis: pc_words(view) for node, view in zip(nodes, views, strict=True)}
        self._events.compare(at_s, words)
        self._show(at_s)
        self._report_unsent(at_s)
        if self._leaving is None:
            self._leaving = self._reason_to_leave(at_s, views)
        if self._leaving is None or self._leave_at_s is None:
            return None
        return self._leaving if at_s >= self._leave_at_s or self._loop.lost is not None else None

    def _reason_to_leave(self, at_s: float, views: list[PcView]) -> PcEnding | None:
        """Return why to leave, if there is a reason, and set when."""
        self._leave_at_s = at_s
        for node, view in zip(self._loop.nodes, views, strict=True):
            if view.state is PcState.HOLD and view.reason is not HoldReason.OTHER_AXIS:
                self._leave_at_s = at_s + LINGER_S
                text = f"axis {node.axis}: the machine is held: {hold_words(view)}"
                return PcEnding(why="held", text=text, good=False)
        if self._loop.lost is not None and all(view.state is not PcState.ACTIVE for view in views):
            return PcEnding(why="bus lost", text=f"the bus is lost: {self._loop.lost}", good=False)
        if self._stop.why is not None or (self._until_s is not None and at_s >= self._until_s):
            if any(view.state is PcState.ACTIVE for view in views):
                self._loop.hold(HoldReason.OPERATOR)
                self._leave_at_s = at_s + GOODBYE_TURNS * self._turn_s
            return PcEnding(why=self._stop.why or "duration", text="ended as asked; the machine is held", good=True)
        return self._start_up(at_s, views)

    def _start_up(self, at_s: float, views: list[PcView]) -> PcEnding | None:
        waiting = [
            (node.axis, view)
            for node, view in zip(self._loop.nodes, views, strict=True)
            if view.state is PcState.WAITING
        ]
        if not waiting:
            if not self._ready:
                self._ready = True
                self._events.happen(at_s, "every axis is homed and corrected")
            return None
        fatal = [(axis, view) for axis, view in waiting if view.box_state is BoxState.FATAL]
        if fatal and not self._acknowledged:
            self._fatal_since_s = at_s if self._fatal_since_s is None else self._fatal_since_s
            if at_s - self._fatal_since_s >= FATAL_S:
                axis, view = fatal[0]
                words = waiting_words(view).removeprefix("waiting: ")
                text = (
                    f"axis {axis}: {words}; correct that, then start with --reset, and take the axis home at the box"
                )
                return PcEnding(why="box stopped", text=text, good=False)
        else:
            self._fatal_since_s = None
        if at_s + self._waited_s >= self._start_up_s and not self._ready:
            axis, view = waiting[0]
            words = f"axis {axis}: not ready after {self._start_up_s:g} s: {waiting_words(view)}{self._others(view)}"
            if len(waiting) < len(self._loop.nodes):  # the others are corrected already: their boxes are told
                self._loop.hold(HoldReason.OTHER_AXIS)
                self._leave_at_s = at_s + GOODBYE_TURNS * self._turn_s
            return PcEnding(why="nobody answers" if not view.connected else "not ready", text=words, good=False)
        return None

    def _others(self, view: PcView) -> str:
        """Return who else was heard, which explains most silences."""
        if view.connected:
            return ""
        mine = {node.axis for node in self._loop.nodes}
        others = sorted(self._loop.heard_axes - mine)
        if others:
            return f"; there is a box with axis {', '.join(map(str, others))}: is --axis right?"
        if self._loop.heard_axes:
            return f"; heard are {', '.join(map(str, sorted(self._loop.heard_axes)))}: are --axis and --axes right?"
        if self._loop.strangers:
            return f"; {self._loop.strangers} frames of others were heard, none of a box"
        garbled = self._loop.transport.traffic.garbled
        if garbled:
            return f"; {garbled} pieces of input were no frames: is the bitrate, or the protocol, another?"
        return "; nothing at all was heard: does 'rtec box' run, on this bus?"

    def _lose(self, at_s: float) -> None:
        self._loss_reported = True
        if self._line_of_box:
            self._events.happen(at_s, "the line is gone: the box's program has ended or was killed")
        else:
            self._events.happen(at_s, f"the bus is lost: {self._loop.lost}")
            if any(node.view.state is PcState.ACTIVE for node in self._loop.nodes):
                self._loop.hold(HoldReason.BUS_OFF)

    def _report_unsent(self, at_s: float) -> None:
        unsent = self._loop.transport.traffic.unsent
        if unsent and not self._unsent:
            self._events.happen(at_s, "frames find no room on the bus and are dropped: does anybody listen?")
        self._unsent = unsent


def pc_document(loop: PcLoop, events: Events, *, ending: PcEnding, run_s: float) -> dict[str, object]:
    """Return the report of a run."""
    traffic = loop.transport.traffic
    return {
        "ended": ending.why,
        "text": ending.text,
        "run_s": round(run_s, 3),
        "axes": [_axis_document(node.axis, node.view) for node in loop.nodes],
        "handshake": spread_ms(loop.answer_s, per_ms=0.001),
        "turn_lateness": spread_ms(loop.late_ps, per_ms=PS_PER_MS),
        "frames_sent": traffic.sent,
        "frames_received": traffic.received,
        "frames_unsent": traffic.unsent,
        "strangers": loop.strangers,
        "garbled": traffic.garbled,
        "events": events.to_list(),
    }


def _axis_document(axis: int, view: PcView) -> dict[str, object]:
    return {
        "axis": axis,
        "state": view.state.name,
        "reason": view.reason.name,
        "words": pc_words(view),
        "box_state": None if view.box_state is None else view.box_state.name,
        "status": None if view.status is None else view.status.name,
        "session": view.session,
        "setup": None if view.setup is None else str(view.setup),
        "box_setup": None if view.box_setup is None else str(view.box_setup),
        "position_counts": view.position,
        "direction": view.direction,
        "target": view.target,
        "requested": view.requested,
        "accepted": view.accepted,
        "completed": view.completed,
        "outside_s": view.outside_s,
        "outside_input": view.outside_input,
        **asdict(view.counters),
    }
