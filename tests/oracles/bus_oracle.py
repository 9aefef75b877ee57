"""A bus on which the lowest identifier passes first, and what can go wrong on it: a slow, readable model.

Every frame takes the same time. A node's frames leave in the order in which it wants to send them.
Nothing here imports rtec.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

FRAME_BITS = 135
BABBLER = 7


@dataclass
class Fault:
    """Something that goes wrong with some frames for some time."""

    kind: str
    node: int | None = None
    identifier: int | None = None
    begin_ps: int = 0
    end_ps: int = 1 << 60
    most: int = 1 << 60
    delay_ps: int = 0
    fired: int = 0
    kept: tuple | None = None

    def active(self, t_ps: int) -> bool:
        return self.begin_ps <= t_ps < self.end_ps

    def meets(self, t_ps: int, node: int, identifier: int) -> bool:
        right_place = self.node in (None, node) and self.identifier in (None, identifier)
        return right_place and self.active(t_ps) and self.fired < self.most


@dataclass
class Bus:
    """The frames that wait, the one on the wires, those that are late, and those delivered so far."""

    bit_ps: int
    faults: list[Fault] = field(default_factory=list)
    queues: dict = field(default_factory=dict)
    wire: tuple | None = None  # when it ends, node, identifier, payload
    late: list = field(default_factory=list)
    delivered: list = field(default_factory=list)  # time, node, identifier, payload

    def submit(self, t_ps: int, node: int, identifier: int, payload: int) -> None:
        self.run(t_ps)
        for fault in self.faults:
            if fault.kind == "OFF" and fault.node == node and fault.active(t_ps):
                fault.fired += 1
                return
            if fault.kind == "STUCK" and fault.meets(t_ps, node, identifier):
                if fault.kept is None:
                    fault.kept = (identifier, payload)
                elif fault.kept[0] == identifier:
                    payload = fault.kept[1]
                    fault.fired += 1
        self.queues.setdefault(node, deque()).append((identifier, payload))
        self._arbitrate(t_ps)

    def run(self, until_ps: int) -> None:
        """Carry out everything up to this moment."""
        while True:
            ends_ps = self.wire[0] if self.wire else 1 << 62
            late_ps = min((frame[0] for frame in self.late), default=1 << 62)
            t_ps = min(ends_ps, late_ps)
            if t_ps > until_ps:
                return
            if ends_ps == t_ps:
                frame, self.wire = self.wire, None
                self._arrive(*frame)
                self._arbitrate(t_ps)
            else:
                frame = next(frame for frame in self.late if frame[0] == t_ps)
                self.late.remove(frame)
                self._deliver(*frame)

    def _arbitrate(self, t_ps: int) -> None:
        if self.wire:
            return
        for fault in self.faults:
            if fault.kind == "OFF" and fault.active(t_ps) and self.queues.get(fault.node):
                self.queues[fault.node].clear()
                fault.fired += 1
        ends_ps = t_ps + FRAME_BITS * self.bit_ps
        for fault in self.faults:
            if fault.kind == "BABBLING" and fault.active(t_ps):
                fault.fired += 1  # two that babble at once lie over each other
                self.wire = (ends_ps, BABBLER, 0, 0)
        if self.wire:
            return
        waiting = [(queue[0][0], node) for node, queue in self.queues.items() if queue]
        if waiting:
            _, node = min(waiting)
            self.wire = (ends_ps, node, *self.queues[node].popleft())

    def _arrive(self, t_ps: int, node: int, identifier: int, payload: int) -> None:
        if node == BABBLER:
            return
        for fault in self.faults:
            if fault.kind == "REORDERED" and fault.kept and fault.kept[:2] == (node, identifier):
                # the one held back comes right behind this one
                self.late.append((t_ps + 1, *fault.kept))
                fault.kept = None
                fault.fired += 1
                continue
            if fault.kind not in ("LOST", "LATE", "DUPLICATED", "REORDERED") or not fault.meets(
                t_ps, node, identifier
            ):
                continue
            if fault.kind == "REORDERED":
                if fault.kept is None:
                    fault.kept = (node, identifier, payload)
                    return
                continue
            fault.fired += 1
            if fault.kind in ("LATE", "DUPLICATED"):
                self.late.append((t_ps + fault.delay_ps, node, identifier, payload))
            if fault.kind in ("LOST", "LATE"):
                return
        self._deliver(t_ps, node, identifier, payload)

    def _deliver(self, t_ps: int, node: int, identifier: int, payload: int) -> None:
        if not any(fault.kind == "OFF" and fault.node == node and fault.active(t_ps) for fault in self.faults):
            self.delivered.append((t_ps, node, identifier, payload))
