"""A live box from its start to its end: orders carried out, changes told, a clean stop."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

from rtec.errors import RtecError
from rtec.live.box_loop import BoxLoop
from rtec.live.events import Events
from rtec.live.orders import HELP, Word, carry_out, parse_order
from rtec.live.quiet import Pace
from rtec.live.stopping import StopWish
from rtec.live.typed import TypedLines
from rtec.live.words import box_words
from rtec.machine.station import Station
from rtec.units import PS_PER_S

MOST_ORDERS = 8
"""Command rate limit: orders carried out between two passes, so that many orders do not stop the axes."""

MOST_REFUSED = 1000
"""Limit of the orders kept from a script, so that a long one does not fill the memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedOrder:
    """An order of a script that was not done.

    Examples
    --------
    >>> str(RefusedOrder(line=2, order="hone", why="order: 'hone' is not an order; use home"))
    "line 2 of the orders, 'hone', was not done: order: 'hone' is not an order; use home"
    """

    line: int
    order: str
    why: str

    def __str__(self) -> str:
        return f"line {self.line} of the orders, {self.order[:60]!r}, was not done: {self.why}"


class BoxRun:
    """Runs the boxes until they are stopped.

    Parameters
    ----------
    loop
        The stations on their bus.
    events
        Where it says what happens.
    stop
        The wish to stop.
    typed
        The operator's lines.
    scripted
        Whether the lines are those of a script, whose mistakes are kept in ``refused``. What comes after a mistake is
        done all the same: an axis that ends in the middle would take the other nodes of the bus with it.
    until_s
        When it ends by itself; None: never.
    show
        Called now and then with the time since the start, to show what there is to see.
    """

    def __init__(
        self,
        loop: BoxLoop,
        *,
        events: Events,
        stop: StopWish,
        typed: TypedLines | None = None,
        scripted: bool = False,
        until_s: float | None = None,
        show: Callable[[float], None] = lambda at_s: None,
    ) -> None:
        self._loop, self._events, self._stop, self._typed, self._show = loop, events, stop, typed, show
        self._until_s, self._scripted = until_s, scripted
        self._begin_ps = loop.transport.now_ps()
        self._orders: deque[str] = deque()
        self._lines = 0
        self.refused: list[RefusedOrder] = []
        """Orders of a script that were not done, the first thousand."""
        self._wait_until_s = 0.0
        self._ended: str | None = None
        self._stalls = 0
        self._forgotten = {station.settings.axis: station.moves_forgotten for station in loop.stations}

    @property
    def at_s(self) -> float:
        """Return the time since the start, on the clock of the bus."""
        return (self._loop.transport.now_ps() - self._begin_ps) / PS_PER_S

    def run(self) -> str:
        """Run; return why it ended: `quit`, `Ctrl-C`, `SIGTERM`, `duration` or `bus lost`."""
        pace = Pace(self._begin_ps)
        while self._ended is None:
            self._loop.step()
            if self._loop.lost is not None or pace.polls(self._loop.transport.now_ps()):
                self._poll()
        return self._ended

    def _poll(self) -> None:
        at_s = self.at_s
        self._take_orders(at_s)
        self._report_forgotten(at_s)
        self._events.compare(at_s, {s.settings.axis: box_words(s.view) for s in self._loop.stations})
        self._show(at_s)
        if self._loop.stalls != self._stalls:
            self._stalls = self._loop.stalls
            self._events.happen(
                at_s,
                f"this process was not let run: its clock stood still, {self._loop.stalled_ps / 1e9:.0f} ms so far",
            )
        if self._ended is not None:
            return
        if self._stop.why is not None:
            self._ended = self._stop.why
        elif self._loop.lost is not None:
            self._lose(at_s)
        elif self._until_s is not None and at_s >= self._until_s:
            self._ended = "duration"

    def _lose(self, at_s: float) -> None:
        """Let the watchdogs of the boxes run out, then end."""
        longest_ps = max(s.settings.supervision.watchdog_ps for s in self._loop.stations)
        self._loop.advance(self._loop.now_ps + 2 * longest_ps)
        self._events.happen(at_s, f"the bus is lost: {self._loop.lost}")
        self._events.compare(at_s, {s.settings.axis: box_words(s.view) for s in self._loop.stations})
        self._ended = "bus lost"

    def _take_orders(self, at_s: float) -> None:
        if self._typed is not None:
            self._orders.extend(self._typed.take(MOST_ORDERS - len(self._orders)))
        while self._orders and at_s >= self._wait_until_s and self._ended is None:
            self._obey(self._orders.popleft(), at_s)

    def _obey(self, text: str, at_s: float) -> None:
        self._lines += 1
        if not text:
            return
        try:
            order = parse_order(text)
            if order.word is Word.QUIT:
                self._ended = "quit"
            elif order.word is Word.HELP:
                for line in HELP:
                    self._events.happen(at_s, line)
                return
            elif order.word is Word.STATUS:
                self._report_status(at_s)
                return
            elif order.word is Word.WAIT:
                self._wait_until_s = at_s + order.wait_s
            else:
                carry_out(order, self._loop.stations)
        except RtecError as error:
            self._refuse(text, error, at_s)
            return
        self._events.happen(at_s, f"order: {text}")

    def _refuse(self, text: str, error: RtecError, at_s: float) -> None:
        if not self._scripted:
            self._events.happen(at_s, f"not done: {error}")
            return
        order = RefusedOrder(line=self._lines, order=text, why=str(error))
        if len(self.refused) < MOST_REFUSED:
            self.refused.append(order)
        self._events.happen(at_s, str(order))

    def _report_forgotten(self, at_s: float) -> None:
        for station in self._loop.stations:
            axis = station.settings.axis
            if station.moves_forgotten != self._forgotten[axis]:
                self._forgotten[axis] = station.moves_forgotten
                self._events.happen(at_s, "the move was interrupted and is forgotten: order it again", axis)

    def _report_status(self, at_s: float) -> None:
        for station in self._loop.stations:
            view = station.view
            numbers = (
                f"{view.position_mm:+.4f} mm, requested {view.requested}, completed {view.completed} steps, "
                f"{sum(view.counters.frames_refused.values())} frames refused"
            )
            self._events.happen(at_s, f"{numbers}; {box_words(view)}", station.settings.axis)


def box_document(
    loop: BoxLoop, events: Events, *, ended: str, run_s: float, refused: Sequence[RefusedOrder] = ()
) -> dict[str, object]:
    """Return the report of a run."""
    traffic = loop.transport.traffic
    return {
        "ended": ended,
        "run_s": round(run_s, 3),
        "axes": [_axis_document(station) for station in loop.stations],
        "frames_sent": traffic.sent,
        "frames_received": traffic.received,
        "frames_unsent": traffic.unsent,
        "garbled": traffic.garbled,
        "stalls": loop.stalls,
        "stalled_s": loop.stalled_ps / PS_PER_S,
        "orders_refused": [{"line": one.line, "order": one.order, "why": one.why} for one in refused],
        "events": events.to_list(),
    }


def _axis_document(station: Station) -> dict[str, object]:
    view, settled = station.view, station.settled_view
    return {
        "axis": station.settings.axis,
        "state": view.box_state.name,
        "status": view.status.name,
        "words": box_words(view),
        "held": view.held,
        "alarm": view.alarm.name,
        "powered": view.powered,
        "session": view.session,
        "setup": str(view.setup),
        "position_mm": view.position_mm,
        "encoder_counts": settled.position,
        "controller_counts": settled.controller_count,
        "requested": view.requested,
        "completed": settled.completed,
        "inserted_counts": settled.inserted_counts,
        "step_counts": view.step_counts,
        "audit": station.audit,
        **asdict(view.counters),
    }
