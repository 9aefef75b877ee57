"""Boxes with their axes on a simulated bus, to test another PC program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Generic, TypeVar, cast

from rtec.axis.encoder import Encoder
from rtec.checks import number_within, whole_within
from rtec.errors import ArgumentError, unknown
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.link.simulated import SimulatedBus
from rtec.machine.station import Alarm, Station, StationSettings
from rtec.requester.settings import HandshakeSettings
from rtec.requester.status import BoxState, Status
from rtec.requester.supervision import SupervisionLimits
from rtec.units import PS_PER_MS

_MOST_AXES = 7
_T = TypeVar("_T")


class _Seen(Generic[_T]):
    """A part of what there is to see of a box, as an attribute of the box."""

    def __init__(self, part: str) -> None:
        self._part = attrgetter(f"view.{part}")

    def __get__(self, box: Station | None, owner: type) -> _T:
        return cast("_T", self if box is None else self._part(box))


class BenchBox(Station):
    """A box with its axis on a workbench: what a test does to it and sees of it.

    Only the program under test lets time pass, by waiting on its bus.
    """

    state = _Seen[BoxState]("box_state")
    """What the box is doing."""
    status = _Seen[Status]("status")
    """What the box's status says."""
    position = _Seen[int]("position")
    """The true position of the axis, in counts from home."""
    position_mm = _Seen[float]("position_mm")
    """The true position of the axis, in mm from home."""
    step_counts = _Seen[int]("step_counts")
    """How many counts a step of a total is: 4, 4, 1, 2 for the designs Original, A, B, C."""
    requested = _Seen[int]("requested")
    """The total that the box has accepted, in steps."""
    completed = _Seen[int]("completed")
    """The total that the box says it has inserted, in steps."""
    inserted_counts = _Seen[int]("inserted_counts")
    """What was inserted on the lines since home, in counts, as ideal decoders on both sides see it."""
    controller_counts = _Seen[int]("controller_count")
    """The position that the controller counts."""
    requests_refused = _Seen[int]("counters.requests_refused")
    """How many requests were outside the box's window."""
    frames_refused = _Seen[dict[str, int]]("counters.frames_refused")
    """How many frames the box refused for what they are, by the reason."""
    held = _Seen[bool]("held")
    """Whether the machine is held: by the PC, by the box's hold contact, or by the controller's alarm."""
    alarm = _Seen[Alarm]("alarm")
    """Why the controller has stopped the drive, if it has."""

    def __repr__(self) -> str:
        view = self.view
        return (
            f"<box of axis {self.axis}: {view.box_state.name}, {view.status.name}, at {view.position} counts, "
            f"requested {view.requested}, completed {view.completed}>"
        )

    @property
    def axis(self) -> int:
        """Return the number of the axis."""
        return self.settings.axis


def bench_of(
    *,
    design: Design | str = Design.ORIGINAL,
    count_um: float = 1.0,
    window_steps: int = 3,
    grace_readings: int = 2,
    watchdog_ms: int = 50,
    axes: int = 1,
    bitrate: int = 500_000,
) -> Workbench:
    """Return a workbench with boxes of one kind.

    Parameters
    ----------
    design
        Original, A, B or C, also by name; real edges are held back during insertions (decision 8).
    count_um
        Travel of one count, µm.
    window_steps
        Largest change of the requested total that the box accepts.
    grace_readings
        Further readings outside the window that it tolerates.
    watchdog_ms
        Longest silence of the PC, ms.
    axes
        Axes 1 to this number.
    bitrate
        In bit/s.

    Raises
    ------
    ArgumentError
        A value outside its range, or a design that is none.

    Examples
    --------
    >>> bench_of(design="c", axes=2).boxes[2].step_counts
    2
    """
    if not isinstance(design, Design):
        names = {known.value: known for known in Design}
        if design not in names:
            raise unknown("design", str(design), names, noun="design")
        design = names[design]
    whole_within("axes", axes, 1, _MOST_AXES)
    timing = Timing.of(design, Processor.MCS51)
    station = StationSettings(
        injector=InjectorSettings(design=design, timing=timing, real_edges=RealEdges.HOLD),
        encoder=Encoder(count_mm=number_within("count_um", count_um, 1e-6, 1e6, unit="µm") / 1000.0),
        handshake=HandshakeSettings(window_steps=window_steps, grace_readings=grace_readings),
        supervision=SupervisionLimits(
            watchdog_ps=whole_within("watchdog_ms", watchdog_ms, 1, 100_000, unit="ms") * PS_PER_MS
        ),
    )
    return Workbench([replace(station, axis=axis) for axis in range(1, axes + 1)], bitrate=bitrate)


class Workbench:
    """A bus in simulated time with a box for each axis, and a free place for the PC.

    Parameters
    ----------
    stations
        The axes; the box of axis n is node n, the PC node 0.
    bitrate
        In bit/s.

    Raises
    ------
    ArgumentError
        An axis number twice, or above 7.

    Examples
    --------
    >>> bench = Workbench([StationSettings()])
    >>> pc = bench.bus.transport(0)
    >>> received = pc.receive(10**12)
    >>> hex(received.frame.identifier), bench.boxes[1].status.name
    ('0x181', 'NOT_HOMED')
    """

    def __init__(self, stations: Sequence[StationSettings], *, bitrate: int = 500_000) -> None:
        self.bus = SimulatedBus(bitrate=bitrate)
        self.boxes: dict[int, BenchBox] = {}
        for settings in stations:
            if settings.axis in self.boxes or settings.axis > _MOST_AXES:
                raise ArgumentError("axis", settings.axis, f"1 to {_MOST_AXES}, each once")
            box = self.boxes[settings.axis] = BenchBox(settings, session=settings.axis)
            self.bus.attach(box, settings.axis)
