"""Axes with their boxes side by side, as the kernels of stations want them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rtec._jit import Record, by_address, new_record, prepared
from rtec.axis.command import Moves, lines_of, move_arrays
from rtec.axis.plant import bound_plant
from rtec.controller._kernels import reset as reset_receiver
from rtec.errors import ArgumentError
from rtec.injector.protocol import Attached
from rtec.link._bus_kernels import FAULT
from rtec.machine import _line_kernels, _station_kernels
from rtec.machine.firmware_box import side_by_side
from rtec.machine.station_settings import StationSettings
from rtec.machine.station_view import StationView, station_view


class Axes:
    """Axes that stand at home, everything switched on, nothing homed.

    Parameters
    ----------
    settings
        The parts of each.
    moves
        The program of each, over and over; or lines that all follow together, once.
    start_ps
        When they are switched on.
    first_ps
        The first reading of each box.
    sessions
        The number of each box's first session.

    Raises
    ------
    ArgumentError
        Axes with plants of several kinds, or some with a firmware and some without; lines for axes that do not
        accelerate alike.
    """

    def __init__(
        self,
        settings: Sequence[StationSettings],
        moves: Moves,
        *,
        start_ps: int,
        first_ps: Sequence[int],
        sessions: Sequence[int],
    ) -> None:
        self.settings = tuple(settings)
        self.records = np.rec.array(np.zeros(len(settings), dtype=_line_kernels.STATION))
        """Their states, shape (axes,)."""
        boxes = [box for each in settings if (box := each.firmware_box(start_ps)) is not None]
        if len(boxes) not in (0, len(settings)):
            found = f"{len(boxes)} of {len(settings)} with a microcontroller"
            raise ArgumentError("stations", found, "all axes of a cell, or none")
        self._boxes = side_by_side(boxes, self.records[0]) if boxes else None
        self._attached: list[tuple[int, Attached]] = []
        for i, (state, each) in enumerate(zip(self.records, settings, strict=True)):
            each.fill(state)
            if each.algorithm is not None:
                self._attached.append((i, each.algorithm.attach(state.injector.own)))
            state.repeats = 0 if lines_of(moves) else 1
            _station_kernels.start(state, start_ps, first_ps[i], sessions[i])
            if boxes:
                reset_receiver(state.receiver, boxes[i].board.state.ab_out)
        self._plant = _plant_of(settings)
        self.follow(moves)
        fault = new_record(FAULT)
        self.steps: Any = (
            by_address(_station_kernels.advance, *self.parts, 0, 0, True),
            by_address(_station_kernels.change_fault, *self.parts, 0, fault, 0, True),
        )
        """Addresses of the steps by which the owner of the clock runs them."""
        self._settle: Any = prepared(_station_kernels.settle, *self.parts, 0)
        self._change: Any = prepared(_station_kernels.change_fault, *self.parts, 0, fault, 0, True)

    def follow(self, moves: Moves) -> None:
        """Let them follow other moves from here on."""
        together = bool(lines_of(moves))
        paces = {(each.acceleration_mm_s2, each.hold_ramp_s, each.servo.period_ps) for each in self.settings}
        if together and len(paces) > 1:
            raise ArgumentError("stations", "several paces", "one acceleration, hold ramp and servo period for lines")
        for state, each in zip(self.records, self.settings, strict=True):
            state.line_acceleration = each.acceleration_mm_s2 if together else 0.0
        arrays = move_arrays(moves, [each.encoder.count_mm for each in self.settings])
        self.parts: Any = (self.records, arrays, self._plant), self._boxes
        """What the kernels take (`rtec.machine._station_kernels`)."""

    def change_fault(self, i: int, fault: Record, t_ps: int, *, begins: bool) -> None:
        """Let a fault begin or end at an axis, which has been run up to ``t_ps``."""
        self._change(*self.parts, i, fault, t_ps, begins)

    def settle(self) -> None:
        """Let what is under way come to its end, so that the counts can be compared."""
        for i in range(len(self.records)):
            self._settle(*self.parts, i)

    def check(self) -> None:
        """Raise what has ended an algorithm of a user's in a box (`rtec.injector.BoxAlgorithm`).

        Raises
        ------
        RtecError
            It raised, or returned what no algorithm may.
        """
        for _, each in self._attached:
            each.check()

    def kept_boxes(self) -> Any:
        """Return a copy of what boxes with a program hold, for `take_back`; the rest stands in the records."""
        return _copied(self._boxes)

    def take_back(self, kept: Any) -> None:
        """Let boxes with a program hold what they held."""
        _put_back(self._boxes, kept)

    @property
    def views(self) -> tuple[StationView, ...]:
        """Return what happens at each axis."""
        return _views(self.records, self.settings)

    def settled_views(self) -> tuple[StationView, ...]:
        """Return what would be seen once what is under way has come to its end; nothing is changed by looking."""
        copied = _copied(self.parts)
        records = copied[0][0]
        at_work = [one.copied_to(records[i].injector.own) for i, one in self._attached]
        for i in range(len(self.records)):
            self._settle(*copied, i)
        del at_work  # it was, up to here
        return _views(records, self.settings)


def _views(records: Any, settings: Sequence[StationSettings]) -> tuple[StationView, ...]:
    return tuple(station_view(state, each) for state, each in zip(records, settings, strict=True))


def _copied(part: Any) -> Any:
    if isinstance(part, tuple):
        return tuple(_copied(each) for each in part)
    return part.copy() if isinstance(part, np.ndarray) else part


def _put_back(part: Any, kept: Any) -> None:
    if isinstance(part, tuple):
        for each, was in zip(part, kept, strict=True):
            _put_back(each, was)
    elif isinstance(part, np.ndarray):
        part[...] = kept


def _plant_of(stations: Sequence[StationSettings]) -> tuple[Any, ...]:
    """Return what moves at every axis: all are rigid, or of one kind."""
    plant = stations[0].servo.plant
    if any(station.servo.plant is not plant for station in stations):
        raise ArgumentError("stations", "several plants", "one plant for all axes of a cell, or none")
    return bound_plant(plant, places=len(stations))
