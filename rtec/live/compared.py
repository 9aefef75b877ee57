"""What a node answers, held to what a log holds: the same values at the same times, within a tolerance of time."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

from rtec.link._frame_kernels import AXIS_BITS
from rtec.link.frame import Frame
from rtec.link.messages import Kind, MessageSet, Verdict
from rtec.units import PS_PER_S

FIELDS = {
    "Hold": ("Reason",),
    "Setup": ("Design", "Cycle", "Step"),
    "Expected": ("Design", "Cycle", "Step"),
    "Status": ("Code", "State", "SwitchOn", "Probing", "HoldWanted", "AtHome"),
    "Request": ("Total", "LargeCorrection", "Probing", "GoHome", "Enable", "Reset"),
    "Corrections": ("Completed", "Accepted"),
    "Position": ("Position", "DataValid"),
    "Probe": ("Position", "Trips"),
}
"""What is compared. Checksums, sequences, sessions and counters of refusals belong to one run only."""

MOVING = {("Position", "Position"), ("Request", "Total"), ("Corrections", "Completed")}
"""Fields that change with the axis: what lies between the values of the window is right, too. While they change, and
of a position always, so is one more or less."""

MOST_DIFFERENCES = 1000

Values = dict[str, int | str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """A stretch of time in which the node says something else than the log."""

    axis: int
    message: str
    field: str
    """Where."""
    from_s: float
    to_s: float
    """When, on the clock of the log."""
    frames: int
    """Frames of log and node that have no counterpart."""
    logged: int | str | None
    said: int | str | None
    """What the log holds and what the node says, at the beginning; None: nothing at that time."""


class _Track:
    """The frames of one message of one axis, on one side."""

    def __init__(self) -> None:
        self.frames: deque[tuple[int, Values]] = deque()
        self.checked = 0
        """How many of them have been compared."""

    def around(self, at_ps: int, reach_ps: int) -> list[tuple[int, Values]]:
        """Return what was said about a time, and when."""
        return [(t_ps, values) for t_ps, values in self.frames if abs(t_ps - at_ps) <= reach_ps]

    def forget(self, before_ps: int) -> None:
        """Drop frames that have been compared and are too old to be compared with."""
        while self.checked > 0 and self.frames[0][0] < before_ps:
            self.frames.popleft()
            self.checked -= 1


class ReplayComparison:
    """Frames of a log and of a live node, compared as they come.

    A frame of either side agrees where the other side says the same within the tolerance before or after it. What is
    said before time zero is compared with, and not compared itself.

    Parameters
    ----------
    kinds
        The messages that are compared.
    tolerance_ps
        On the clock of the log.

    Examples
    --------
    The node accepts the total 20 ms later than in the log, which is within 50 ms, and then another one, which is not:

    >>> messages = MessageSet.load()
    >>> def accepted(total):
    ...     return messages.encode("Corrections", 1, {"Accepted": total})
    >>> comparison = ReplayComparison([Kind.CORRECTIONS], tolerance_ps=50 * 10**9)
    >>> for t_ms in range(0, 300, 10):
    ...     comparison.log_says(t_ms * 10**9, accepted(3 if t_ms >= 100 else 0))
    ...     comparison.node_says(t_ms * 10**9, accepted(4 if t_ms >= 200 else 3 if t_ms >= 120 else 0))
    >>> comparison.finish(290 * 10**9)
    >>> [(found.field, found.from_s, found.logged, found.said) for found in comparison.differences]
    [('Accepted', 0.2, 3, 4)]
    """

    def __init__(self, kinds: Collection[Kind], *, tolerance_ps: int) -> None:
        self._kinds = frozenset(kinds)
        self._tolerance_ps = tolerance_ps
        self._messages = MessageSet.load()
        self._tracks: dict[tuple[str, int], tuple[_Track, _Track]] = {}
        self._logged_ps = self._said_ps = self._compared_ps = 0
        self._held_ps: dict[int, int] = {}
        self._fastest: dict[int, float] = {}
        self._places: dict[int, tuple[int, int]] = {}
        self._found: list[Difference] = []
        self._open: dict[tuple[str, int, str], int] = {}
        self.logged = self.said = 0
        """Frames that were compared, of the log and of the node."""
        self.garbled = 0
        """Frames of the node with a wrong checksum."""
        self.more = 0
        """Differences beyond the first thousand."""

    @property
    def differences(self) -> list[Difference]:
        """Return what was found, in order of time."""
        return sorted(self._found, key=lambda found: found.from_s)

    @property
    def heard_ps(self) -> int:
        """Return when the node was heard last."""
        return self._said_ps

    def log_says(self, at_ps: int, frame: Frame) -> None:
        """Take a frame of the log."""
        if self._put(0, at_ps, frame):
            self.logged += 1
        self._logged_ps = max(self._logged_ps, at_ps)

    def node_says(self, at_ps: int, frame: Frame) -> None:
        """Take a frame of the node, at its time on the clock of the log."""
        if self._put(1, at_ps, frame):
            self.said += 1
        self._said_ps = max(self._said_ps, at_ps)
        ready_ps = min(self._logged_ps, self._said_ps) - self._tolerance_ps  # both are known that far and further
        if ready_ps >= self._compared_ps + self._tolerance_ps:
            self._compare(ready_ps)

    def finish(self, end_ps: int) -> None:
        """Compare what is left, up to the end of the log; what follows is unknown."""
        self._compare(end_ps - self._tolerance_ps)
        self._compare(end_ps, sides=(0,))

    def _put(self, side: int, at_ps: int, frame: Frame) -> bool:
        message = self._messages.decode(frame.identifier, frame.data)
        if message is None or Kind[message.name.upper()] not in self._kinds:
            return False
        if message.verdict is not Verdict.RIGHT:
            self.garbled += side
            return False
        axis = message.axis if message.name == "Hold" else frame.identifier & AXIS_BITS
        tracks = self._tracks.setdefault((message.name, axis), (_Track(), _Track()))
        values = {field: message.values[field] for field in FIELDS[message.name]}
        tracks[side].frames.append((at_ps, values))
        if side == 0:
            self._follow(message.name, axis, at_ps, values)
        return True

    def _compare(self, until_ps: int, *, sides: tuple[int, ...] = (0, 1)) -> None:
        self._compared_ps = until_ps
        for (name, axis), tracks in self._tracks.items():
            for side in sides:
                for at_ps, values in _unchecked(tracks[side], until_ps):
                    self._check(name, axis, at_ps, values, tracks[1 - side], from_log=side == 0)
            for track in tracks:
                track.forget(until_ps - 2 * self._tolerance_ps)

    def _check(self, name: str, axis: int, at_ps: int, values: Values, other: _Track, *, from_log: bool) -> None:
        near = other.around(at_ps, self._tolerance_ps)
        for field, value in values.items():
            if _is_among(name, field, value, [each[field] for _, each in near], self._beside(name, axis, at_ps)):
                continue
            theirs = min(near, key=lambda each: abs(each[0] - at_ps))[1][field] if near else None
            logged, said = (value, theirs) if from_log else (theirs, value)
            self._note(name, axis, field, at_ps, logged, said)

    def _beside(self, name: str, axis: int, at_ps: int) -> int:
        """Return how far a position may lie beside those of the window.

        Where a hold stops the axis depends on when it comes: by as much as the axis goes in the tolerance.
        """
        held_ps = self._held_ps.get(axis)
        if name != "Position" or held_ps is None or at_ps < held_ps - self._tolerance_ps:
            return 0
        return math.ceil(self._fastest.get(axis, 0.0) * self._tolerance_ps)

    def _follow(self, name: str, axis: int, at_ps: int, values: Values) -> None:
        """Take from the log how fast the axis goes, and when it is held."""
        if name == "Status" and values["HoldWanted"]:
            self._held_ps.setdefault(axis, at_ps)
        elif name == "Status":
            self._held_ps.pop(axis, None)
        elif name == "Position" and isinstance(position := values["Position"], int):
            last_ps, last = self._places.get(axis, (at_ps, position))
            if at_ps > last_ps:
                self._fastest[axis] = max(self._fastest.get(axis, 0.0), abs(position - last) / (at_ps - last_ps))
            self._places[axis] = (at_ps, position)

    def _note(
        self, name: str, axis: int, field: str, at_ps: int, logged: int | str | None, said: int | str | None
    ) -> None:
        """Keep a difference, or let the one before it go on."""
        at_s = at_ps / PS_PER_S
        key = (name, axis, field)
        if (index := self._open.get(key)) is not None:
            found = self._found[index]
            if at_s - found.to_s <= 2 * self._tolerance_ps / PS_PER_S:
                begun = min(found.from_s, at_s)
                self._found[index] = replace(found, from_s=begun, to_s=max(found.to_s, at_s), frames=found.frames + 1)
                return
        if len(self._found) >= MOST_DIFFERENCES:
            self.more += 1
            return
        self._open[key] = len(self._found)
        self._found.append(
            Difference(
                axis=axis, message=name, field=field, from_s=at_s, to_s=at_s, frames=1, logged=logged, said=said
            )
        )


def _unchecked(track: _Track, until_ps: int) -> Iterator[tuple[int, Values]]:
    while track.checked < len(track.frames) and track.frames[track.checked][0] <= until_ps:
        track.checked += 1
        if track.frames[track.checked - 1][0] >= 0:
            yield track.frames[track.checked - 1]


def _is_among(name: str, field: str, value: int | str, others: list[int | str], beside: int) -> bool:
    """Return whether a value is one of those said at its time, or of what moves between or so much beside them."""
    if value in others:
        return True
    numbers = [other for other in others if isinstance(other, int)]
    if (name, field) not in MOVING or not numbers or not isinstance(value, int):
        return False
    low, high = min(numbers), max(numbers)
    beside += low < high or name == "Position"
    return low - beside <= value <= high + beside
