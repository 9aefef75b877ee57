"""A bus log played to a live node, and its answers held to the log."""

from __future__ import annotations

import contextlib
from array import array
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path

from rtec.errors import FileFormatError, LinkError
from rtec.link._frame_kernels import AT_HOME, AXIS_BITS, CORRECTIONS_ACCEPTED, field
from rtec.link._log_formats import Logged
from rtec.link.frame import PAYLOAD_BYTES, Frame
from rtec.link.logs import read_log
from rtec.link.messages import Kind, MessageSet
from rtec.link.replay import replay
from rtec.link.transport import Received, Transport
from rtec.live.compared import ReplayComparison
from rtec.live.figures import spread_ms
from rtec.live.played import CYCLE_PS, Role, Survey, kind_of
from rtec.live.replayed_side import ReplayedSide, resealed
from rtec.live.steady import SteadyTransport
from rtec.requester.status import BoxState
from rtec.units import PS_PER_MS, PS_PER_S

CYCLES = 5
"""Tolerance in cycles: box and PC themselves tolerate a silence of that length (`watchdog_ps`)."""


def tolerance_of(found: Survey) -> int:
    """Return the tolerance that the log justifies, in whole ms: five cycles, as box and PC wait for each other.

    Examples
    --------
    >>> tolerance_of(Survey(role=Role.PC, cycle_ps=20 * 10**9)) // 10**9
    100
    """
    return round(CYCLES * max(found.cycle_ps, CYCLE_PS) / PS_PER_MS) * PS_PER_MS


QUIET_PS, LONGEST_DRAIN_PS = 2 * PS_PER_MS, PS_PER_S
"""Silence after which nothing old waits to be read any more; longest wait for it on a bus that is never silent."""

_STATE_BITS = 7


def _beginning(status: Frame | None, corrections: Frame | None) -> str | None:
    """Return what decides whether a box can follow a log from its beginning, in words; None: it has not said so."""
    if status is None or len(status.data) != PAYLOAD_BYTES:
        return None
    state = status.data[3] & _STATE_BITS
    words = BoxState(state).name if state in list(BoxState) else f"in state {state}"
    words += ", at home" if status.data[3] & AT_HOME else ", not at home"
    if corrections is not None and len(corrections.data) == PAYLOAD_BYTES:
        words += f", with a total of {field(corrections.payload, *CORRECTIONS_ACCEPTED)}"
    return words


class ReplayRun:
    """Plays a log to the node under test.

    Parameters
    ----------
    path
        The log.
    transport
        The way to the bus.
    found
        What it holds (`rtec.live.played.survey`).
    speed
        2 plays twice as fast; the node's own times stay what they are.
    tolerance_ps
        On the clock of the bus.
    start_up_s
        Longest wait for the node.
    show
        Called with the share that is done.
    """

    def __init__(
        self,
        path: Path,
        transport: Transport,
        found: Survey,
        *,
        speed: float,
        tolerance_ps: int,
        start_up_s: float,
        show: Callable[[float], None] = lambda share: None,
    ) -> None:
        self.found, self.speed, self.tolerance_ps = found, speed, tolerance_ps
        self._path, self._transport = path, SteadyTransport(transport)
        self._start_up_s, self._show = start_up_s, show
        self._within_ps = round(tolerance_ps * speed)
        absent = {Kind.SETUP, Kind.EXPECTED} - found.kinds  # logs from before these messages
        self.comparison = ReplayComparison(found.role.other.kinds - absent, tolerance_ps=self._within_ps)
        self._side = ReplayedSide()
        self._begin_ps: int | None = None
        self.met = False
        """Whether the node under test was heard at all."""
        self.stale: list[int] = []
        """Axes whose box is not as that of the log at its beginning; nothing is played then."""
        self.lost = False
        """Whether the bus vanished before the end."""
        self.late_ps = array("q")
        """How late each frame was sent."""
        self.rivals = 0
        """Frames of another node that sends as the side that is played."""
        self.run_s = 0.0
        """How long it took, on the clock of the bus."""
        self.notes: list[str] = []
        """What the user should know before relying on it."""
        # its machine code is loaded before it counts
        frame = resealed(Frame(identifier=Kind.REQUEST + 1, data=bytes(PAYLOAD_BYTES)), {})
        MessageSet.load().decode(frame.identifier, frame.data)
        self._heard: dict[int, Frame] = {}
        self._recent: deque[Received] = deque()

    @property
    def passed(self) -> bool:
        """Return whether the node answered as in the log."""
        went = self.met and not self.stale and not self.lost
        return went and not self.comparison.differences and not self.comparison.garbled

    def run(self) -> None:
        """Meet the node, play the log, compare."""
        self.met = self._meet()
        if not self.met:
            return
        self._drain()
        if self.found.role is Role.PC and self.found.homes:
            self._find_stale()
        if self.stale:
            return
        self._begin_ps, stalled_before_ps = self._transport.now_ps(), self._transport.stalled_ps
        for received in self._recent:
            self._compare(received)
        length_ps = self.found.end_ps - self.found.entry_ps
        try:
            replay(
                self._frames(),
                self._transport,
                speed=self.speed,
                on_received=self._take,
                as_sent=self._sent,
            )
            self._listen(self._begin_ps + round((length_ps + self._within_ps) / self.speed))
        except LinkError as error:  # the node may have ended, and its line with it: what it said until then counts
            self.notes.append(f"the bus was lost: {error}")
            length_ps = self.comparison.heard_ps
            self.lost = True
        self.comparison.finish(length_ps)
        if stalled_ps := self._transport.stalled_ps - stalled_before_ps:
            self.notes.append(
                f"this process was not let run: its clock stood still, {stalled_ps / PS_PER_MS:.0f} ms "
                "in all; where the box ran on meanwhile, it may have lost the PC of the log"
            )
        self.run_s = (self._transport.now_ps() - self._begin_ps) / PS_PER_S

    def _meet(self) -> bool:
        """Wait for the node under test: a box says its status, a PC answers a box that says its own."""
        found = self.found
        until_ps = self._transport.now_ps() + round(self._start_up_s * PS_PER_S)
        if not found.homes:
            self.notes.append(
                f"the log takes no axis home: a {found.role.other.words} that has just started cannot follow it"
            )
        if found.role is Role.PC:
            wanted = {Kind.STATUS + axis for axis in found.axes}
        else:
            wanted = {Kind.REQUEST + found.first_axis}
        while not wanted <= self._heard.keys():
            now_ps = self._transport.now_ps()
            if now_ps >= until_ps:
                missing = ", ".join(str(identifier & AXIS_BITS) for identifier in sorted(wanted - self._heard.keys()))
                self.notes.append(f"the {found.role.other.words} of axis {missing} was not heard")
                return False
            for frame in found.before.values() if found.role is Role.BOX else ():
                self._transport.send(self._side.repeated(frame))
            while not wanted <= self._heard.keys():
                received = self._transport.receive(min(now_ps + CYCLE_PS, until_ps))
                if received is None:
                    break
                self._take(received)
        return True

    def _drain(self) -> None:
        """Take what was said before now and still waits to be read: it is no answer to what is played."""
        until_ps = self._transport.now_ps() + LONGEST_DRAIN_PS
        while (now_ps := self._transport.now_ps()) < until_ps:
            received = self._transport.receive(now_ps + QUIET_PS)
            if received is None:
                return
            self._take(received)

    def _find_stale(self) -> None:
        """Note which boxes are not as those of the log were before the PC spoke."""
        for axis in sorted(self.found.axes):
            logged, now = (
                _beginning(frames.get(Kind.STATUS + axis), frames.get(Kind.CORRECTIONS + axis))
                for frames in (self.found.before, self._heard)
            )
            if None not in (logged, now) and logged != now:
                self.stale.append(axis)
                self.notes.append(
                    f"the box of axis {axis} is not as that of the log at its beginning: it is {now}, that was "
                    f"{logged}; start 'rtec box' anew"
                )

    def _take(self, received: Received) -> None:
        frame = received.frame
        kind = kind_of(frame)
        if kind in self.found.role.kinds:
            self.rivals += 1
        elif kind is not None and len(frame.data) == PAYLOAD_BYTES:
            self._side.said.take(frame)
            if self._begin_ps is not None:
                self._compare(received)
                return
            self._heard[frame.identifier] = frame
            self._recent.append(received)
            while received.arrival_ps - self._recent[0].arrival_ps > self._within_ps / self.speed:
                self._recent.popleft()

    def _compare(self, received: Received) -> None:
        at_ps = round((received.arrival_ps - (self._begin_ps or 0)) * self.speed)
        self.comparison.node_says(at_ps, received.frame)

    def _frames(self) -> Iterator[Logged]:
        """Yield what is to be played, and hand on what it is compared with."""
        with contextlib.suppress(*([FileFormatError] if self.found.cut_off is not None else [])):
            for logged in read_log(self._path):
                if logged.time_ps > self.found.end_ps:
                    return
                at_ps, kind = logged.time_ps - self.found.entry_ps, kind_of(logged.frame)
                if kind in self.found.role.kinds:
                    if at_ps >= 0:
                        yield replace(logged, time_ps=at_ps)
                elif kind is not None:
                    self._side.logged.take(logged.frame)
                    if at_ps >= -self._within_ps:
                        self.comparison.log_says(at_ps, logged.frame)

    def _sent(self, logged: Logged) -> Frame:
        begin_ps = self._begin_ps or 0
        self.late_ps.append(self._transport.now_ps() - begin_ps - round(logged.time_ps / self.speed))
        self._show(logged.time_ps / max(self.found.end_ps - self.found.entry_ps, 1))
        return self._side.translated(logged.frame)

    def _listen(self, until_ps: int) -> None:
        while (received := self._transport.receive(until_ps)) is not None:
            self._take(received)
            if self._transport.now_ps() >= until_ps:
                return


def replay_document(run: ReplayRun) -> dict[str, object]:
    """Return the report of a replay."""
    found, compared = run.found, run.comparison
    return {
        "as": found.role.value,
        "passed": run.passed,
        "met": run.met,
        "stale": run.stale,
        "lost": run.lost,
        "speed": run.speed,
        "tolerance_ms": run.tolerance_ps / PS_PER_MS,
        "played": len(run.late_ps),
        "left_out": found.others,
        "logged": compared.logged,
        "said": compared.said,
        "garbled": compared.garbled,
        "rivals": run.rivals,
        "run_s": round(run.run_s, 3),
        "late": spread_ms(run.late_ps, per_ms=PS_PER_MS),
        "differences": [asdict(difference) for difference in compared.differences],
        "differences_left_out": compared.more,
        "cut_off": found.cut_off,
        "notes": run.notes,
    }
