"""What changes at the axes, as a list of moments: for plain lines, the view and the report at the end."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

MOST_EVENTS = 10_000
"""Events kept for the report at the end; older ones are dropped."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened."""

    at_s: float
    """Since the start."""
    axis: int | None
    """At which axis; None: to the whole process."""
    text: str
    """In words."""

    def __str__(self) -> str:
        where = "" if self.axis is None else f"axis {self.axis}: "
        return f"{self.at_s:9.3f} s  {where}{self.text}"


class Events:
    """A list of events, reported one by one as it grows.

    Parameters
    ----------
    tell
        Called with each new event.
    """

    def __init__(self, tell: Callable[[Event], None]) -> None:
        self.tell = tell
        self._said: dict[int, str] = {}
        self.all: deque[Event] = deque(maxlen=MOST_EVENTS)

    def happen(self, at_s: float, text: str, axis: int | None = None) -> None:
        """Report an event."""
        event = Event(at_s=at_s, axis=axis, text=text)
        self.all.append(event)
        self.tell(event)

    def compare(self, at_s: float, words: Mapping[int, str]) -> None:
        """Report each axis whose state in words has changed."""
        for axis, text in words.items():
            if self._said.get(axis) != text:
                self._said[axis] = text
                self.happen(at_s, text, axis)

    def latest(self, number: int) -> list[Event]:
        """Return the last few."""
        return list(self.all)[-number:]

    def to_list(self) -> list[dict[str, object]]:
        """Return the events for a report."""
        return [{"at_s": event.at_s, "axis": event.axis, "text": event.text} for event in self.all]
