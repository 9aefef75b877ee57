"""Axes with their boxes on a bus: advanced as the bus' clock goes on, at their readings and when frames arrive."""

from __future__ import annotations

from collections.abc import Sequence

from rtec.checks import number_within
from rtec.errors import ArgumentError, LinkError
from rtec.link.transport import Transport
from rtec.machine.station import Station

SLOWEST, FASTEST = 0.1, 100.0
"""Limits of the speed: cycles of 1 ms to 1 s on the axes' clock."""

LONGEST_STALL_PS = 20_000_000_000
"""On the bus' clock."""


class BoxLoop:
    """Several stations on one transport.

    The axes' clock goes with the transport's, ``speed`` times as fast. Where this process was not let run for longer
    than `LONGEST_STALL_PS`, the axes' clock stands still for that time, as it does in a debugger: else a box would
    see a silence of the PC that was none.

    Parameters
    ----------
    stations
        The axes, all at the same time of theirs.
    transport
        The way to the bus.
    speed
        Picoseconds of the axes in a picosecond of the bus.

    Raises
    ------
    ArgumentError
        No station, two with the same number, or a value outside its range.

    Notes
    -----
    The time of the axes is worked out from the beginning each time, so that nothing drifts.
    """

    def __init__(
        self,
        stations: Sequence[Station],
        transport: Transport,
        *,
        speed: float = 1.0,
    ) -> None:
        axes = [station.settings.axis for station in stations]
        if not axes or len(set(axes)) != len(axes):
            raise ArgumentError("stations", axes, "at least one, each with a number of its own")
        self.stations = tuple(stations)
        self.transport = transport
        self.speed = number_within("speed", speed, SLOWEST, FASTEST)
        self._begin_ps = stations[0].now_ps
        self._zero_ps = transport.now_ps()
        self.stalls = 0
        """Number of times that the process was stalled."""
        self.stalled_ps = 0
        """Total time of the stalls."""
        self.lost: LinkError | None = None
        """Why the bus was lost; None while it is there."""

    @property
    def now_ps(self) -> int:
        """Return the time of the axes."""
        return self.stations[0].now_ps

    @property
    def due_ps(self) -> int:
        """Return the time of the next reading that matters to the bus, on its clock."""
        return self._on_bus_ps(min(station.awaited_ps for station in self.stations))

    def step(self) -> None:
        """Wait for the next reading or frame, and carry it out.

        A bus that vanishes is kept in ``lost``; the axes go on, and their boxes find out by themselves.
        """
        due_ps = self.due_ps
        received = None
        if self.lost is None:
            try:
                received = self.transport.receive(due_ps)
            except LinkError as error:
                self.lost = error
        # without a bus the clock is that of the readings, which follow each other at once
        now_ps = self.transport.now_ps() if self.lost is None else due_ps
        late_ps = now_ps - max(due_ps, self._on_bus_ps(self.now_ps))
        if late_ps > LONGEST_STALL_PS:
            self.stalls += 1
            self.stalled_ps += late_ps
            self._zero_ps += late_ps
        self.advance(self._begin_ps + round((now_ps - self._zero_ps) * self.speed))
        if received is not None:
            for station in self.stations:
                station.receive(received.frame)

    def advance(self, until_ps: int) -> None:
        """Carry the axes on to ``until_ps`` of their time, and send what their boxes have to say."""
        for station in self.stations:
            # a reading at the very moment is due, too
            frames = station.advance(until_ps=max(until_ps + 1, station.now_ps))
            if self.lost is None:
                try:
                    for _, frame in frames:
                        self.transport.send(frame)
                except LinkError as error:
                    self.lost = error

    def _on_bus_ps(self, axes_ps: int) -> int:
        return self._zero_ps + round((axes_ps - self._begin_ps) / self.speed)
