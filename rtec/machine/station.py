"""One axis with its box as a node of a bus, on simulated time: moves and frames in, frames and counts out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from rtec._jit import Record, prepared
from rtec.axis.command import Move
from rtec.checks import whole_within
from rtec.errors import ArgumentError
from rtec.link.frame import PAYLOAD_BYTES, Frame
from rtec.machine import _station_kernels
from rtec.machine.axes import Axes
from rtec.machine.fault_kinds import FaultCategory
from rtec.machine.faults import Fault, FaultKind, FaultPlace, FaultRow, Trigger, fault_records
from rtec.machine.station_settings import StationSettings
from rtec.machine.station_view import Alarm, LineChange, StationView, station_view
from rtec.requester.refused_frames import TAKEN, refusals, why_refused
from rtec.requester.status import BoxState
from rtec.signal import NEVER
from rtec.units import PS_PER_MS

__all__ = ["Alarm", "LineChange", "Move", "Station", "StationSettings", "StationView"]

_LINES_SETTLE_PS = PS_PER_MS
"""A change of the lines has passed box and filter, and is decoded by the controller, after so long."""
_MOST_REFUSED = 100


class Station:
    """One axis with its box, advanced by the owner of the clock.

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
        first_ps = start_ps + settings.handshake.box_period_ps
        session = whole_within("session", session, 0, 255)
        self._axes = Axes([settings], [moves], start_ps=start_ps, first_ps=[first_ps], sessions=[session])
        self._state = self._axes.records[0]
        self._run = prepared(_station_kernels.run, *self._axes.parts, self._axes.steps, 0)
        self._now_ps = start_ps
        self._heard = False
        self._begun: dict[FaultRow, Record] = {}
        self._goes_home_ps: int | None = None
        self._lines_settled_ps = start_ps
        self._was_running = self._was_held = self._interrupted = False
        self._refused: Counter[tuple[int, str]] = Counter()
        self.moves_forgotten = 0
        """Moves of :meth:`go` and :meth:`follow` that were interrupted before they came to their end."""

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
            goal_ps = until_ps if self._goes_home_ps is None else min(until_ps, self._goes_home_ps)
            self._now_ps = int(self._run(*self._axes.parts, self._axes.steps, goal_ps))
            for k in range(int(out.waiting)):
                sent.append((self._now_ps, Frame.of_payload(int(out.identifier[k]), int(out.payload[k]))))
            out.waiting = 0
            if self._goes_home_ps is not None and self._now_ps >= self._goes_home_ps:
                self._start_home()
            self._note_interruption()
        self._axes.check()
        return sent

    @property
    def due_ps(self) -> int:
        """Return the time of the box's next reading."""
        return int(self._state.node.box.next_ps)

    @property
    def awaited_ps(self) -> int:
        """Return the time of the next reading after which there may be something to send.

        While the box has nothing to judge and nothing to insert, that is the next of its cycle. What changes by
        itself in between (a watchdog that runs out, a probe that trips) is told then.
        """
        node = self._state.node
        next_ps, period_ps = self.due_ps, int(node.box.period_ps)
        if self._heard or node.box.accepted != self._state.injector.completed:
            return next_ps
        return next_ps + max(-((next_ps - int(node.cycle_next_ps)) // period_ps), 0) * period_ps

    def receive(self, frame: Frame) -> None:
        """Hand the box a frame at the present time; what is none of its messages is passed over."""
        self._heard = True
        watches = self._is_running
        before = refusals(self._state.node) if watches else ()
        if len(frame.data) == PAYLOAD_BYTES and not frame.extended:
            _station_kernels.receive(self._state, self._now_ps, frame.identifier, frame.payload)
        if watches:
            self._note_refusal(frame, why_refused(frame, self.settings.axis, before, refusals(self._state.node)))

    def follow(self, moves: Sequence[Move]) -> None:
        """Make other moves from here on, one after the other.

        Once they are interrupted, by a hold, a restart of the box or an order to go home, they are forgotten: after
        the next homing the axis stands at home.
        """
        self._axes.follow([moves])
        self._was_running, self._interrupted = self._is_running, False
        self._state.repeats = 0
        self._state.moving_to = 0
        self._state.arrived_ps = NEVER

    def go(self, target_mm: float, speed_mm_s: float = 10.0) -> None:
        """Go to a position and stay there, once the box is homed and the machine is not held."""
        self.follow([Move(target_mm=target_mm, speed_mm_s=speed_mm_s)])

    def go_home(self) -> None:
        """Take the axis back to its home, held or not, as the operator would, and clear the controller's alarm.

        Where a fault of the lines has just ended, it begins a millisecond later: until then the controller may still
        see the lines jump.
        """
        self._goes_home_ps = max(self._lines_settled_ps, self._now_ps)
        if self._goes_home_ps == self._now_ps:
            self._start_home()

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

    def begin(self, kind: FaultRow, *, while_inserting: bool = False) -> None:
        """Let a fault of the axis begin: now, or at the first moment at which an insertion is under way.

        Raises
        ------
        ArgumentError
            A fault that is none of an axis.
        """
        record = self._record_of(kind, Trigger.WHILE_INSERTING if while_inserting else Trigger.AT_ONCE)
        self._begun[kind] = record
        self.change(record, begins=True)

    def end(self, kind: FaultRow) -> None:
        """Let a fault of the axis end."""
        if kind.category is FaultCategory.ENCODER:
            self._lines_settled_ps = self._now_ps + _LINES_SETTLE_PS
        record = self._begun.pop(kind, None)
        self.change(self._record_of(kind, Trigger.AT_ONCE) if record is None else record, begins=False)

    def change(self, record: Record, *, begins: bool) -> None:
        """Let the fault that a kernel's record tells begin or end; the record then tells how often it took effect."""
        record.kept, record.ended = 1, int(not begins)
        self._axes.change_fault(0, record, self._now_ps, begins=begins)

    def effects(self, record: Record) -> int:
        """Return how often the fault that a kernel's record tells has taken effect so far."""
        if record.kept and not record.ended:
            return int(_station_kernels.effects(self._state, record, self._now_ps))
        return int(record.fired)

    def keep_insertions(self) -> None:
        """Keep the changes of the lines around each insertion from now on, for :meth:`last_insertion`."""
        self._state.keeps = 1
        self._state.seen_inserted = self._state.injector.inserted

    def last_insertion(self) -> tuple[LineChange, ...]:
        """Return the changes of the lines up to and a few after the last insertion; none before the first."""
        state = self._state
        number = int(_station_kernels.show_insertion(state))
        rows = state.aside_rows[:number].tolist()
        return tuple(LineChange(time_ps=t_ps, lines=lines, lines_out=out) for t_ps, lines, out in rows)

    def settle(self) -> None:
        """Let what is under way come to its end, so that the counts can be compared."""
        self._axes.settle()

    @property
    def held_since_ps(self) -> int | None:
        """Return since when the machine is held; None: it is not."""
        held_ps = int(self._state.held_ps)
        return None if held_ps == NEVER else held_ps

    @property
    def settled_view(self) -> StationView:
        """Return what would be seen once what is under way has come to its end; nothing is changed by looking."""
        return self._axes.settled_views()[0]

    @property
    def audit(self) -> bool:
        """Return whether the controller counts the true position and what the box says it has inserted, no more.

        What is under way is brought to its end on a copy, so that looking changes nothing.
        """
        view = self.settled_view
        inserted = view.step_counts * view.completed
        return view.inserted_counts == inserted and view.controller_count == view.position + inserted

    @property
    def view(self) -> StationView:
        """Return what happens."""
        return station_view(self._state, self.settings, self._refused)

    @property
    def _is_running(self) -> bool:
        return bool(self._state.node.box.state == BoxState.RUNNING)

    def _note_refusal(self, frame: Frame, why: str | None) -> None:
        """Keep what was refused since the PC's last sign of life; of many kinds of frames, the first."""
        if why == TAKEN:
            self._refused.clear()
        elif why is not None and (len(self._refused) < _MOST_REFUSED or (frame.identifier, why) in self._refused):
            self._refused[frame.identifier, why] += 1

    def _start_home(self) -> None:
        self._goes_home_ps = None
        _station_kernels.go_home(self._state)
        if not self._state.repeats:
            self._forget_moves()

    def _note_interruption(self) -> None:
        """Forget the moves that were interrupted once the feed is down; a program begins anew when it is homed."""
        state = self._state
        running, held = self._is_running, bool(state.held_ps != NEVER)
        stops = (held and not self._was_held) or (self._was_running and not running)
        self._was_running, self._was_held = running, held
        self._interrupted = (self._interrupted or stops) and not state.repeats
        if self._interrupted and (running or state.override == 0.0):
            self._forget_moves()

    def _forget_moves(self) -> None:
        targets = self._axes.parts[0][1][0][0]
        self.moves_forgotten += int(self._state.moving_to < targets.size)
        self.follow([])

    def _record_of(self, kind: FaultRow, trigger: Trigger) -> Record:
        if kind.place is not FaultPlace.AXIS:
            raise ArgumentError(
                "kind", kind.words, "a fault of an axis", "faults of bus and PC have their place there"
            )
        fault = Fault(kind=kind, place=self.settings.axis, from_ps=max(self._now_ps, 0), trigger=trigger)
        self.settings.check_fault(fault)
        return fault_records([fault])[0]
