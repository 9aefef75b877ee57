"""Faults of box, bus, PC and encoder: what, where, when, with which seed, and how often they took effect."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rtec._jit import Record
from rtec.checks import whole_within
from rtec.errors import ArgumentError
from rtec.injector import DesignRow
from rtec.link import _bus_kernels as _bus
from rtec.link._frame_kernels import MOST_AXES
from rtec.machine import _fault_kernels
from rtec.machine.fault_kinds import INSIDE_BOX, LATCH_STUCK, FaultKind, FaultPlace, FaultRow
from rtec.signal import NEVER
from rtec.units import PS_PER_S

__all__ = ["PC_NODE", "Fault", "FaultKind", "FaultPlace", "FaultRow", "Trigger", "fault_records"]


PC_NODE = _fault_kernels.PC_PLACE
"""Node of the PC; the box of axis n is node n."""


class Trigger(enum.Enum):
    """When a fault at an axis begins."""

    AT_ONCE = "at once"
    WHILE_INSERTING = "while inserting"
    """At the first moment from ``from_ps`` on at which an insertion is under way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One fault.

    Parameters
    ----------
    kind
        Its class, or a row of one's own.
    place
        On the bus, the node that sends the frames (0: the PC, n: the box of axis n; None: any); at an axis, its
        number; None for the PC.
    from_ps, until_ps
        When it begins, and when it is over; None: it stays.
    identifier
        Of the frames that it affects; None: all.
    most
        Number of frames that it affects.
    delay_ps
        Delay of frames, or jump of the clock.
    seed
        Of the bits that it flips.
    trigger
        At once, or during an insertion.

    Raises
    ------
    ArgumentError
        A place, a time or a delay that the class cannot have.

    Examples
    --------
    >>> Fault(kind=FaultKind.FRAME_LOST, place=PC_NODE, from_ps=10**12, most=3).kind.place.name
    'BUS'
    """

    kind: FaultRow
    place: int | None = None
    from_ps: int
    until_ps: int | None = None
    identifier: int | None = None
    most: int = 1
    delay_ps: int = 0
    seed: int = 0
    trigger: Trigger = Trigger.AT_ONCE

    def __post_init__(self) -> None:
        where = self.kind.place
        whole_within("from_ps", self.from_ps, 0, NEVER - 1, unit="ps")
        if self.until_ps is not None:
            whole_within("until_ps", self.until_ps, self.from_ps + 1, NEVER, unit="ps (after from_ps)")
        if self.identifier is not None:
            whole_within("identifier", self.identifier, 0, 0x7FF)
        whole_within("most", self.most, 1, 1 << 40)
        whole_within("delay_ps", self.delay_ps, 0, NEVER - 1, unit="ps")
        whole_within("seed", self.seed, 0, (1 << 62) - 1)
        if where is FaultPlace.AXIS:
            whole_within("place", self.place, 1, MOST_AXES)
        elif self.place is not None:
            whole_within("place", self.place, 0, _bus.NODES - 1)
        if self.kind.delayed and self.delay_ps == 0:
            raise ArgumentError("delay_ps", 0, "at least 1 ps", f"say how far: {self.kind.words}")
        if self.kind.code == _bus.OFF and self.place is None:
            raise ArgumentError("place", "None", "a node: 0 is the PC, n the box of axis n")
        waits = self.trigger is Trigger.WHILE_INSERTING
        if waits and self.kind is LATCH_STUCK:
            raise ArgumentError("trigger", self.trigger.value, "at once", "an insertion closes the latch itself")
        if waits and where is not FaultPlace.AXIS:
            raise ArgumentError("trigger", self.trigger.value, "at once", f"{self.kind.words} is none of an axis")

    @property
    def over_ps(self) -> int:
        """Return when it is over: a restart and a trip of the probe are so at once, others may stay."""
        if self.trigger is Trigger.AT_ONCE and self.kind.over_at_once:
            return self.from_ps
        return NEVER if self.until_ps is None else self.until_ps

    def __str__(self) -> str:
        ends = "" if self.until_ps is None else f" to {self.until_ps / PS_PER_S:g} s"
        waits = f", {self.trigger.value}" if self.trigger is Trigger.WHILE_INSERTING else ""
        return f"{self.kind.words} from {self.from_ps / PS_PER_S:g} s{ends}{waits}"

    def fill(self, record: Record) -> None:
        """Write the fault into a kernel's record.

        Raises
        ------
        ArgumentError
            A fault that only the open path has.
        """
        open_only = _fault_kernels.FIRST_OPEN <= self.kind.code <= _fault_kernels.LAST_OPEN
        if open_only and self.kind not in INSIDE_BOX:
            raise ArgumentError(
                "kind", repr(self.kind.words), "a fault of a cell, or rtec simulate --fault",
                problem="is a fault of the open path alone",
            )  # fmt: skip
        record.kind = self.kind.code
        record.place = _bus.ANY if self.place is None else self.place
        if self.kind.place is FaultPlace.PC:
            record.place = PC_NODE
        record.identifier = _bus.ANY if self.identifier is None else self.identifier
        record.from_ps = self.from_ps
        record.until_ps = NEVER if self.until_ps is None else self.until_ps
        record.most = self.most
        record.delay_ps = self.delay_ps
        record.seed = self.seed
        record.activation = self.kind.activated_by
        record.cable = self.kind.cable
        share, record.glitch_ps = self.kind.glitches
        record.glitch_level = round(share * 2**16)
        record.while_inserting = int(self.trigger is Trigger.WHILE_INSERTING)


def fault_records(faults: Sequence[Fault]) -> Record:
    """Return the faults as the kernels want them, shape (n,)."""
    records = np.rec.array(np.zeros(len(faults), dtype=_bus.FAULT))
    for record, fault in zip(records, faults, strict=True):
        fault.fill(record)
    return records


def probing_records(probing: Sequence[tuple[int, int]]) -> Record:
    """Return the times (from, until) in ps at which the PC probes as the kernels want them, shape (n,)."""
    records = np.rec.array(np.zeros(len(probing), dtype=_bus.FAULT))
    for record, (from_ps, until_ps) in zip(records, probing, strict=True):
        whole_within("probing", from_ps, 0, NEVER - 1, unit="ps")
        whole_within("probing", until_ps, from_ps + 1, NEVER - 1, unit="ps (after its begin)")
        record.kind = _fault_kernels.PC_PROBING
        record.from_ps, record.until_ps = from_ps, until_ps
    return records


def check_apart(faults: Sequence[Fault], probing: Sequence[tuple[int, int]] = ()) -> None:
    """Check that what shares a part of the axis does not overlap in time; else the end of one would end both.

    Raises
    ------
    ArgumentError
        Two faults of one part, two that wait for an insertion, or two intervals of probing, that overlap.
    """
    faults = [fault for fault in faults if fault.kind.place is FaultPlace.AXIS]  # several may affect one frame
    spans = [((str(fault.kind.part), str(fault.place)), fault) for fault in faults]
    spans += [(("waiting", str(fault.place)), fault) for fault in faults if fault.trigger is Trigger.WHILE_INSERTING]
    times = [(part, fault.from_ps, fault.over_ps, "faults", str(fault)) for part, fault in spans]
    times += [
        (("probing", ""), a, b, "probing", f"from {a / PS_PER_S:g} s to {b / PS_PER_S:g} s") for a, b in probing
    ]
    for (part, _, over_ps, _, words), (other, from_ps, _, name, later) in pairwise(sorted(times)):
        if part == other and from_ps < over_ps:
            raise ArgumentError(name, later, f"one that begins when this is over: {words}")


def check_waiting(fault: Fault, design: DesignRow, *, firmware: bool, own: bool = False) -> None:
    """Check that a fault can happen to a box, and that the box shows an insertion if the fault waits for one.

    Raises
    ------
    ArgumentError
        The firmware of Design B: it writes its lines all the time, and none of its outputs tells an insertion; a
        fault inside a box that runs its firmware, or an algorithm of the user (``own``); a latch where the lines pass
        through the processor.
    """
    if fault.kind in INSIDE_BOX and (firmware or own):
        raise ArgumentError(
            "kind", fault.kind.words, "a box that is modelled", "rtec simulate --fault has it on boards"
        )
    if fault.kind is LATCH_STUCK and design.in_path:
        raise ArgumentError(
            "kind", fault.kind.words, "a design with a hold latch: its lines pass through the processor"
        )
    if fault.trigger is Trigger.WHILE_INSERTING and firmware and design.in_path:
        raise ArgumentError(
            "trigger",
            Trigger.WHILE_INSERTING.value,
            "'at once' with the firmware of Design B, whose outputs do not tell an insertion",
            "let the fault begin at a time, or take the model of the box",
        )
