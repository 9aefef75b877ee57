"""Faults for a user's test: armed by name and time, and asked afterwards whether they took effect."""

from __future__ import annotations

import random
from collections.abc import Callable
from functools import partial

from rtec.checks import number_within
from rtec.errors import ArgumentError, nearest
from rtec.link._frame_kernels import REQUEST
from rtec.link.simulated import FaultActivation
from rtec.machine.fault_kinds import FaultCategory, FaultKind, FaultPlace, FaultRow
from rtec.machine.faults import PC_NODE, Fault, Trigger, fault_records
from rtec.machine.workbench import Workbench
from rtec.units import PS_PER_S

DELAY_S = 0.003
"""Delay of a frame that is late or duplicated, where none is given."""


def kind_of(name: FaultRow | str) -> FaultRow:
    """Return the class of faults with a name; a row is one itself.

    Raises
    ------
    ArgumentError
        There is none; the nearest is named.

    Examples
    --------
    >>> kind_of("frame lost") is FaultKind.FRAME_LOST, kind_of("BUS_OFF").words
    (True, 'bus off')
    """
    if isinstance(name, FaultRow):
        return name
    known = {kind.name.lower(): kind for kind in FaultKind} | {kind.value.lower(): kind for kind in FaultKind}
    wanted = str(name).lower()
    for spelling in (wanted, wanted.replace(" ", "_").replace("-", "_")):
        if spelling in known:
            return known[spelling]
    hint = nearest(wanted, known)
    raise ArgumentError("fault", repr(name)[:60], "a class of faults", hint, problem="is not a fault")


_Effects = Callable[[], tuple[int, int | None]]


class BenchFaults:
    """What goes wrong on a workbench.

    Parameters
    ----------
    bench
        The workbench.
    jump_clock
        Lets the PC's time of day jump by so many picoseconds, and calls back once the PC has looked at it.

    Examples
    --------
    >>> from rtec.machine.workbench import bench_of
    >>> bench = bench_of()
    >>> faults = BenchFaults(bench, lambda by_ps, note: None)
    >>> faults.arm("frame lost", at_s=0.1)
    >>> bench.bus.run(until_ps=PS_PER_S)
    >>> faults.unfired
    []
    """

    def __init__(self, bench: Workbench, jump_clock: Callable[[int, Callable[[], None]], None]) -> None:
        self._bench = bench
        self._jump_clock = jump_clock
        self._armed: list[tuple[Fault, _Effects]] = []
        self._optional: list[Fault] = []

    def arm(
        self,
        kind: FaultRow | str,
        *,
        at_s: float | tuple[float, float],
        lasting_s: float | None = None,
        place: int | None = None,
        identifier: int | None = None,
        most: int = 1,
        delay_s: float | None = None,
        seed: int = 0,
        while_inserting: bool = False,
        must_fire: bool = True,
    ) -> None:
        """Let a fault happen; the test fails if it takes no effect.

        Parameters
        ----------
        kind
            Its class, or the name of it: ``"frame lost"``, ``"bus_off"``; or a row of one's own.
        at_s
            Simulated time at which it begins, or two between which the seed chooses.
        lasting_s
            How long it lasts; None: to the end of the test.
        place
            On the bus, the node that sends the frames (0: the PC, n: the box of axis n; None: any); at an axis, its
            number. None: a fault of the total affects the requests for axis 1, one of an axis affects axis 1.
        identifier
            Of the frames that it affects; None: all.
        most
            Number of frames that it affects.
        delay_s
            Delay of frames, or jump of the PC's time of day, which it sees as ``rtec_bus.clock.time()``.
        seed
            Of the bits that it flips, and of its time.
        while_inserting
            Whether it waits for the first insertion from then on.
        must_fire
            Whether the test fails if it takes no effect.

        Raises
        ------
        ArgumentError
            A class, a time or a place that it cannot have; a fault of the PC's program, which is the user's own.
        """
        kind = kind_of(kind)
        low_s, high_s = at_s if isinstance(at_s, tuple) else (at_s, at_s)
        number_within("at_s", low_s, 0.0, 1e6, unit="s")
        number_within("at_s", high_s, low_s, 1e6, unit="s")
        from_ps = round(random.Random(seed).uniform(low_s, high_s) * PS_PER_S)  # noqa: S311 - a draw, no secret
        if kind.category is FaultCategory.TOTAL and place is None and identifier is None:
            place, identifier = PC_NODE, REQUEST + 1
        if kind.place is FaultPlace.AXIS and place is None:
            place = 1
        if delay_s is None:
            delay_s = DELAY_S if kind.delayed and kind.place is FaultPlace.BUS else 0.0
        fault = Fault(
            kind=kind,
            place=place,
            from_ps=from_ps,
            until_ps=None if lasting_s is None else from_ps + round(lasting_s * PS_PER_S),
            identifier=identifier,
            most=most,
            delay_ps=round(number_within("delay_s", delay_s, 0.0, 1e6, unit="s") * PS_PER_S),
            seed=seed,
            trigger=Trigger.WHILE_INSERTING if while_inserting else Trigger.AT_ONCE,
        )
        self._armed.append((fault, self._start(fault)))
        if not must_fire:
            self._optional.append(fault)

    @property
    def times(self) -> dict[str, int]:
        """Return how often each armed fault took effect so far, in words."""
        return {_words(fault): effects()[0] for fault, effects in self._armed}

    @property
    def activations(self) -> list[FaultActivation[Fault]]:
        """Return how often each armed fault took effect so far, and when first."""
        return [
            FaultActivation(fault=fault, times=times, first_ps=first_ps)
            for fault, effects in self._armed
            for times, first_ps in [effects()]
        ]

    @property
    def unfired(self) -> list[str]:
        """Return the armed faults that took no effect although they must, in words."""
        return [
            _words(fault)
            for fault, effects in self._armed
            if effects()[0] == 0 and not any(fault is optional for optional in self._optional)
        ]

    def _start(self, fault: Fault) -> _Effects:
        """Let a fault happen at its time; return what says how often it took effect so far, and when first."""
        kind, bench = fault.kind, self._bench
        bus = bench.bus
        if fault.from_ps < bus.now_ps:
            raise ArgumentError("from_ps", fault.from_ps, f"{bus.now_ps} ps or later (time never runs back)")
        if kind.category is FaultCategory.CLOCK:
            read_ps: list[int] = []
            by_ps = fault.delay_ps if kind is FaultKind.CLOCK_JUMP_FORWARD else -fault.delay_ps
            bus.at(fault.from_ps, lambda: self._jump_clock(by_ps, lambda: read_ps.append(bus.now_ps)))
            return lambda: (len(read_ps), min(read_ps, default=None))
        if kind.place is FaultPlace.PC:
            raise ArgumentError("kind", kind.words, "a fault of the bus or of an axis", "this PC is your own program")
        if kind.place is FaultPlace.BUS:
            number = len(bus.fired)
            bus.add_fault(fault)
            return lambda: (bus.fired[number].times, bus.fired[number].first_ps)
        if fault.place not in bench.boxes:
            raise ArgumentError("place", fault.place, f"an axis: {', '.join(map(str, bench.boxes))}")
        box = bench.boxes[fault.place]
        box.settings.check_fault(fault)
        record = fault_records([fault])[0]
        bus.at(fault.from_ps, partial(box.change, record, begins=True))
        if fault.until_ps is not None:
            bus.at(fault.until_ps, partial(box.change, record, begins=False))
        return lambda: (times, int(record.fired_ps)) if (times := box.effects(record)) else (0, None)


def _words(fault: Fault) -> str:
    place = "" if fault.place is None else f", {fault.kind.place.value} {fault.place}"
    return f"{fault.kind.words} at {fault.from_ps / PS_PER_S:g} s{place}"
