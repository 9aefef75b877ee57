"""A machine on a bus: several axes with their boxes, one PC and the faults between them, in simulated time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rtec._jit import new_record, prepared
from rtec.axis.command import Moves, lines_of
from rtec.checks import whole_within
from rtec.errors import ArgumentError
from rtec.heat.binding import bound_heat
from rtec.heat.course import HeatCourse
from rtec.link.simulated import FaultActivation, activations_of
from rtec.machine import _cell_kernels
from rtec.machine.axes import Axes
from rtec.machine.faults import Fault, check_apart, fault_records
from rtec.machine.station_settings import StationSettings
from rtec.machine.station_view import StationView
from rtec.predictors import Model
from rtec.predictors._kernels import INSIDE
from rtec.predictors.binding import bound, check_axis, heat_inputs, outside_input
from rtec.requester import _pc_node_kernels
from rtec.requester.settings import PcState
from rtec.requester.status import Status
from rtec.requester.supervision import HoldReason
from rtec.signal import NEVER
from rtec.units import PS_PER_S

US = 1_000_000
_PC_FIRST_PS = 350 * US
_PC_GAP_PS = 120 * US
_BOX_FIRST_PS = 300 * US
_BOX_GAP_PS = 3_333 * US
_MOST_CELL_AXES = 7
_COLD = HeatCourse()


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisOutcome:
    """What came of one axis."""

    view: StationView
    pc_state: PcState
    pc_reason: HoldReason
    box_status: Status
    target_steps: int
    """Total that the prediction asks for where the PC takes the axis to be."""
    off_counts: int
    """Count at the controller, less the true count and the corrections that the prediction asks for."""
    uninserted_counts: int
    """Difference between what the box says it has completed and what its lines have gone ahead."""
    late_steps: int
    """Largest difference between what is wanted and what is inserted, at the PC's turns."""
    travel_mm: float
    deviation_mm: float
    """Where its slide stands, grown by heat, less where the controller takes it to be."""
    outside_s: float
    """For how long the PC's present model has had no answer: an input was outside its ranges."""
    outside_input: str
    """The first of such inputs; empty where there was none."""


class Cell:
    """Several axes, one PC and a bus, with faults.

    Parameters
    ----------
    stations
        The axes, numbered 1, 2, ... in order.
    moves
        The program of each, over and over; or lines that all follow together, once.
    predictor
        What the PC knows of the axes' errors: one model for all of them, or one for each.
    heat
        What heat does while it runs, one course for all axes or one for each: by how much the axis is displaced, and
        what the PC's thermometers say.
    faults
        What goes wrong.
    bitrate
        Of the bus, bit/s.

    Raises
    ------
    ArgumentError
        Axes that are not numbered in order, a program for each missing, a fault at an axis that is not there,
        faults that overlap at one axis.

    Examples
    --------
    >>> from rtec.predictors import NoError
    >>> from rtec.axis.command import Move
    >>> cell = Cell([StationSettings()], [[Move(target_mm=1.0, speed_mm_s=5.0)]], NoError())
    >>> cell.run(until_ps=10**12)
    >>> cell.axes[0].pc_state.name, cell.held_ps is None
    ('ACTIVE', True)

    A program of two axes:

    >>> lines = [Move(target_mm=(3.0, 4.0), speed_mm_s=10.0), Move(target_mm=(0.0, 4.0), speed_mm_s=10.0)]
    >>> cell = Cell([StationSettings(), StationSettings(axis=2)], lines, NoError())
    >>> cell.run(until_ps=5 * 10**12)
    >>> [round(axis.view.position_mm, 2) for axis in cell.axes]
    [0.0, 4.0]
    """

    def __init__(
        self,
        stations: Sequence[StationSettings],
        moves: Moves,
        predictor: Model | Sequence[Model],
        *,
        faults: Sequence[Fault] = (),
        heat: HeatCourse | Sequence[HeatCourse] = _COLD,
        bitrate: int = 500_000,
    ) -> None:
        count = whole_within("stations", len(stations), 1, _MOST_CELL_AXES)
        if [station.axis for station in stations] != list(range(1, count + 1)):
            raise ArgumentError("stations", [station.axis for station in stations], "axes 1, 2, ... in order")
        if not lines_of(moves) and (len(moves) != count or not all(moves)):
            raise ArgumentError("moves", f"{len(moves)} programs", f"{count}, one with a move at least for each axis")
        for fault in faults:
            if fault.place is not None and fault.place > count:
                raise ArgumentError("place", fault.place, f"0 (the PC) to {count}")
            if fault.place:
                stations[fault.place - 1].check_fault(fault)
        check_apart(faults)
        self._run: Any = None  # prepared once it is wanted: a cell that is monitored runs by another kernel
        self.settings = tuple(stations)
        self.faults = tuple(faults)
        self._cell = new_record(_cell_kernels.CELL)
        first_ps = [_BOX_FIRST_PS + i * _BOX_GAP_PS for i in range(count)]
        self._axes = Axes(stations, moves, start_ps=0, first_ps=first_ps, sessions=range(1, count + 1))
        self._stations = self._axes.records
        self._pcs = np.rec.array(np.zeros(count, dtype=_pc_node_kernels.PC_NODE))
        self._faults = fault_records(faults)
        for i, (station, pc) in enumerate(zip(stations, self._pcs, strict=True)):
            design = station.injector.design
            count_mm = station.encoder.count_mm
            station.handshake.fill_pc(
                pc.pc, count_mm=count_mm, step_counts=design.step_counts, word_limit=design.word_limit
            )
            station.supervision.fill_pc(pc, count_mm=count_mm)
            pc.axis = i + 1
            pc.setup = station.setup.word
            pc.requester = 1
        bit_ps = PS_PER_S // whole_within("bitrate", bitrate, 10_000, 1_000_000, unit="bit/s")
        _cell_kernels.start(self._cell, self._pcs, bit_ps, _PC_FIRST_PS, _PC_GAP_PS)
        self._heat = [heat] * count if isinstance(heat, HeatCourse) else list(heat)
        if len(self._heat) != count:
            raise ArgumentError("heat", f"{len(self._heat)} courses", f"one for all axes, or {count}, one for each")
        self.predict_by(predictor)

    def run(self, *, until_ps: int) -> None:
        """Run to ``until_ps``; time never runs back."""
        until_ps = whole_within("until_ps", until_ps, self.now_ps, NEVER - 1, unit="ps (time never runs back)")
        if self._run is None:
            self._run = prepared(_cell_kernels.run, *self._parts, until_ps, self._models)
        self._run(*self._parts, until_ps, self._models)
        self._axes.check()

    def settle(self) -> None:
        """Let what is under way at every axis come to its end, so that the counts can be compared."""
        self._axes.settle()
        self._axes.check()

    def probe(self, probing: bool) -> None:
        """Let the PC enter or leave the probing mode on all axes."""
        for pc in self._pcs:
            pc.pc.probing = int(probing)

    def allow_large_correction(self) -> None:
        """Let the PC's next requests exceed the window, once."""
        for pc in self._pcs:
            pc.pc.large_meant = 1

    def predict_by(self, predictor: Model | Sequence[Model]) -> None:
        """Give the PC another predictor from now on, or another one for each axis."""
        count = len(self._pcs)
        each = [predictor] * count if isinstance(predictor, Model) else list(predictor)
        if len(each) != count:
            raise ArgumentError("predictor", f"{len(each)} models", f"one for all axes, or {count}, one for each")
        for axis, (pc, one) in enumerate(zip(self._pcs, each, strict=True), 1):
            check_axis(one, axis)
            pc.pc.outside_turns, pc.pc.outside_input = 0, INSIDE
            pc.low_mm, pc.high_mm = max(one.range_mm[0], -1e9), min(one.range_mm[1], 1e9)
        self._predictors = each
        models = [
            (bound(one, heat_inputs(heat), axes=count), bound_heat(heat))
            for one, heat in zip(each, self._heat, strict=True)
        ]
        self._models = (*models, *models[-1:] * (_MOST_CELL_AXES - count))
        self._parts = self._cell, *self._axes.parts, self._axes.steps, self._pcs, self._faults
        self._run = None

    @property
    def now_ps(self) -> int:
        """Return the time reached."""
        return int(self._cell.now_ps)

    @property
    def positions_mm(self) -> tuple[float, ...]:
        """Return where the axes stand, by their encoders."""
        pairs = zip(self._stations, self.settings, strict=True)
        return tuple(float(state.servo.x * settings.encoder.count_mm) for state, settings in pairs)

    @property
    def held_ps(self) -> int | None:
        """Return when the machine was first held, None if it never was."""
        return None if self._cell.held_at_once_ps == NEVER else int(self._cell.held_at_once_ps)

    @property
    def exchanges(self) -> int:
        """Return the turns that the PC has taken, all axes together."""
        return int(self._cell.turns)

    @property
    def fired(self) -> tuple[FaultActivation[Fault], ...]:
        """Return the activation of every fault."""
        return activations_of(self.faults, self._faults)

    @property
    def axes(self) -> tuple[AxisOutcome, ...]:
        """Return what came of each axis so far; after :meth:`settle` the counts can be compared."""
        outcomes = []
        for i, (settings, view) in enumerate(zip(self.settings, self._axes.views, strict=True)):
            state, pc = self._stations[i], self._pcs[i]
            step = settings.injector.design.step_counts
            count_mm = settings.encoder.count_mm
            position_mm = view.position * count_mm
            grown_mm = self._heat[i].growth_mm(self.now_ps / PS_PER_S, position_mm)
            outcomes.append(
                AxisOutcome(
                    view=view,
                    pc_state=PcState(int(pc.pc.state)),
                    pc_reason=HoldReason(int(pc.reason)),
                    box_status=Status(int(state.node.box.status)),
                    target_steps=int(pc.pc.target),
                    off_counts=view.controller_count - view.position - step * int(pc.pc.target),
                    uninserted_counts=view.inserted_counts - step * view.completed,
                    late_steps=int(self._cell.late_steps[i]),
                    travel_mm=float(state.travel_mm),
                    outside_s=int(pc.pc.outside_turns) * settings.handshake.pc_period_ps / PS_PER_S,
                    outside_input=outside_input(self._predictors[i], int(pc.pc.outside_input)),
                    deviation_mm=position_mm + grown_mm - view.controller_count * count_mm,
                )
            )
        return tuple(outcomes)
