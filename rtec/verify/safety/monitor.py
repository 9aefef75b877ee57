"""A machine with faults, monitored: what its controllers count, against what they should, every millisecond."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rtec._jit import prepared
from rtec.axis.command import Move
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine.cell import Cell
from rtec.machine.faults import Fault
from rtec.machine.station import Alarm, StationSettings
from rtec.machine.station_settings import InBox
from rtec.predictors import BidirectionalTable, Model, Predictor
from rtec.predictors.binding import bound_curve
from rtec.requester.settings import PcState
from rtec.requester.status import Status
from rtec.requester.supervision import HoldReason, SupervisionLimits
from rtec.signal import NEVER
from rtec.units import PS_PER_MS, PS_PER_S
from rtec.verify.safety import _kernels as kernels

SLICE_PS = 1 * PS_PER_MS
REST_PS = 200 * PS_PER_MS
"""An axis at rest for so long has nothing under way any more."""
_LAG_S = 0.06
"""From a position to the correction for it, at worst: two cycles of the box, a turn of the PC, an insertion, a frame
lost on either way."""

_ARRIVED_PS = 50 * PS_PER_MS
"""A request is at the box after so long, or lost."""


class Stopper(enum.IntEnum):
    """Who stopped the machine."""

    NOBODY = kernels.NOBODY
    CONTROLLER = kernels.BY_CONTROLLER
    BOX = kernels.BY_BOX
    PC = kernels.BY_PC
    HOMING = kernels.BY_HOMING
    """The box has no home and does not let the axis go."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MonitoredAxis:
    """What came of one axis."""

    encoder_counts: int
    controller_counts: int
    """``encoder_counts``, ``controller_counts``: true count before the cable, and the count at the controller."""
    off_counts: int
    """Counts at the controller less the true counts and the insertions that the box has made."""
    uninserted_counts: int
    """What the lines have been made to go ahead, less what the box says it has completed."""
    pending_steps: int
    asked_counts: float
    """Counts of the total accepted, less the deviation that the healthy prediction has where the axis truly is."""
    bound_counts: float
    """What rounding to steps may leave of that."""
    worst_counts: float
    """Largest difference between controller and healthy prediction until the machine stopped."""
    late_s: float
    """Time for which it was larger than rounding and speed explain."""
    wrong_s: float
    wrong_counts: float
    """``wrong_s``, ``wrong_counts``: longest time for which counts were wrong although nobody said so, and by how
    much."""
    stop_ps: int | None
    """When the axis was stopped; None: it was not."""
    stopped_by: Stopper
    stop_counts: float
    """Difference between controller and healthy prediction then."""
    drift_counts: int
    """Counts that the controller has gone ahead of the encoder since the stop."""
    alarm: Alarm
    pc_reason: HoldReason
    box_status: Status
    """``pc_reason``, ``box_status``: why the PC held, and what the box said, when the first axis of the machine was
    stopped."""
    following_counts: float
    """Largest difference between command and counts beyond the lag of the feed: what a speed check sees."""
    checks: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """Who stopped the machine first, and why, in words; nobody, and nothing, where it was not stopped."""

    by: Stopper = Stopper.NOBODY
    reason: str = ""
    detected_s: float | None = None
    """From the first effect of a fault to the stop; None: not stopped, or before the axis was let go."""
    at_ps: int | None = None
    """When; None: not stopped, or the axis was never let go."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisThen:
    """What an axis was doing at a moment."""

    at_ps: int
    state: int
    """Of the encoder's lines, 1 to 4 as the report counts (docs/state-tables.md)."""
    direction: str
    """``positive``, ``negative`` or ``rest``."""


class MonitoredCell(Cell):
    """A machine with faults whose counts are looked at every millisecond.

    Parameters
    ----------
    stations, moves, predictor, faults
        As of a :class:`~rtec.machine.cell.Cell`.
    slice_ps
        Between two looks.

    Examples
    --------
    >>> from rtec.predictors import NoError
    >>> cell = MonitoredCell([StationSettings()], [[Move(target_mm=1.0, speed_mm_s=5.0, rest_s=9.0)]], NoError())
    >>> cell.monitor(until_ps=10**12)
    >>> cell.monitored[0].off_counts, cell.monitored[0].stop_ps
    (0, None)
    """

    def __init__(
        self,
        stations: Sequence[StationSettings],
        moves: Sequence[Sequence[Move]],
        predictor: Predictor,
        *,
        faults: Sequence[Fault] = (),
        slice_ps: int = SLICE_PS,
    ) -> None:
        self._run_monitored: Any = None
        super().__init__(stations, moves, predictor, faults=faults)
        self._slice_ps = slice_ps
        self._freeze_ps = NEVER
        self._truth = bound_curve(predictor, "truth")
        self._monitors = np.rec.array(np.zeros(len(stations), dtype=kernels.MONITOR))
        for record, station in zip(self._monitors, stations, strict=True):
            step_counts = station.injector.design.step_counts
            record.step_counts = step_counts
            record.count_mm = station.encoder.count_mm
            record.reversal_counts = station.handshake.reversal_mm / station.encoder.count_mm
            record.bound = step_counts * (0.5 + station.handshake.rounding_margin) + 1e-6
            record.lag = _slope(predictor) * _LAG_S
            record.rest_ps = REST_PS
        kernels.begin(self._monitors)
        self._start = [record.copy() for record in self._records], (self._predictors, self._models, self._truth)
        self._start_boxes = self._axes.kept_boxes()

    @property
    def _records(self) -> list[Any]:
        """Return all that changes while it runs."""
        return [self._cell, self._stations, self._pcs, self._faults, self._monitors]

    def rewind(self) -> None:
        """Go back to the beginning, to run the same again and look closer."""
        records, (self._predictors, self._models, self._truth) = self._start
        for record, start in zip(self._records, records, strict=True):
            for name in record.dtype.names:
                record[name] = start[name]
        self._axes.take_back(self._start_boxes)
        self._freeze_ps = NEVER

    def monitor(self, *, until_ps: int, stop_after_ps: int = NEVER // 4, slice_ps: int | None = None) -> None:
        """Run to ``until_ps``, or until an axis has been stopped for ``stop_after_ps``; or with other looks."""
        if self._freeze_ps <= until_ps:
            freeze_ps, self._freeze_ps = self._freeze_ps, NEVER
            self.monitor(until_ps=freeze_ps, stop_after_ps=stop_after_ps, slice_ps=slice_ps)
            if self.now_ps < freeze_ps:
                return
            self._monitors.frozen = 1
        arguments = (
            *self._parts, self._monitors, until_ps, slice_ps or self._slice_ps, stop_after_ps, self._models,
            self._truth,
        )  # fmt: skip
        if self._run_monitored is None:
            self._run_monitored = prepared(kernels.monitor, *arguments)
        self._run_monitored(*arguments)
        self._axes.check()

    def predict_by(self, predictor: Model | Sequence[Model]) -> None:
        """Give the PC another predictor from now on, or another one for each axis."""
        super().predict_by(predictor)
        self._run_monitored = None

    def set_reference(self, predictor: Predictor) -> None:
        """Take another prediction for the healthy one from now on."""
        self._truth = bound_curve(predictor, "truth")
        self._run_monitored = None

    def probe(self, probing: bool) -> None:
        """Let the PC enter or leave the probing mode; totals are to stay once the last requests have arrived."""
        super().probe(probing)
        self._freeze_ps = self.now_ps + _ARRIVED_PS if probing else NEVER
        self._monitors.frozen = 0

    def sent_steps(self, axis: int) -> int:
        """Return the total that the PC last asked for."""
        return int(self._pcs[axis - 1].pc.sent)

    @property
    def running(self) -> bool:
        """Return whether every axis is homed and its PC active."""
        return all(int(pc.pc.state) == PcState.ACTIVE for pc in self._pcs)

    def true_count(self, axis: int) -> int:
        """Return the count of an encoder, before its cable."""
        return int(self._stations[axis - 1].encoder.count)

    def axis_then(self, axis: int) -> AxisThen:
        """Return what an axis is doing now."""
        servo, home_state = self._stations[axis - 1].servo, self.settings[axis - 1].encoder.home_state
        moves = abs(servo.v) > servo.standstill
        return AxisThen(
            at_ps=self.now_ps,
            state=(self.true_count(axis) + home_state) % 4 + 1,
            direction="rest" if not moves else "positive" if servo.v > 0.0 else "negative",
        )

    @property
    def monitored(self) -> tuple[MonitoredAxis, ...]:
        """Return what came of every axis so far."""
        return tuple(self._monitored_axis(i) for i in range(len(self.settings)))

    def stop(self, fired_ps: int | None) -> Stop:
        """Return who has stopped the machine; ``fired_ps`` is when a fault first took effect, None where none has."""
        axes = self.monitored
        stops = [axis for axis in axes if axis.stop_ps is not None]
        if not stops:
            return Stop() if self.running else Stop(by=Stopper.HOMING, reason="the axis is not let go")
        first = min(stops, key=lambda axis: axis.stop_ps or 0)
        at_ps = first.stop_ps or 0
        detected_s = None if fired_ps is None else max(0.0, (at_ps - fired_ps) / PS_PER_S)
        return Stop(by=first.stopped_by, reason=_reason_of(axes, first), detected_s=detected_s, at_ps=at_ps)

    def _monitored_axis(self, i: int) -> MonitoredAxis:
        state, record = self._stations[i], self._monitors[i]
        injector, box = state.injector, state.node.box
        step_counts = int(record.step_counts)
        ahead = int(state.receiver.count - state.encoder.count)
        stopped = record.stop_ps != NEVER
        wanted = ahead - float(record.error)
        return MonitoredAxis(
            encoder_counts=int(state.encoder.count),
            controller_counts=int(state.receiver.count),
            off_counts=ahead - int(injector.ahead),
            uninserted_counts=int(injector.ahead) - step_counts * int(injector.completed),
            pending_steps=int(box.accepted) - int(injector.completed),
            asked_counts=step_counts * int(box.accepted) - wanted,
            bound_counts=float(record.bound),
            worst_counts=float(record.worst),
            late_s=int(record.late_slices) * self._slice_ps / PS_PER_S,
            wrong_s=int(record.wrong_ps) / PS_PER_S,
            wrong_counts=float(record.wrong),
            stop_ps=int(record.stop_ps) if stopped else None,
            stopped_by=Stopper(int(record.stopped_by)),
            stop_counts=float(record.stop_error),
            drift_counts=ahead - int(record.stop_ahead) if stopped else 0,
            alarm=Alarm(int(state.alarm)),
            pc_reason=HoldReason(int(record.seen_reason)),
            box_status=Status(int(record.seen_status)),
            following_counts=float(record.following),
            checks=int(record.checks),
        )


def station_settings(
    axis: int,
    design: Design,
    *,
    supervision: SupervisionLimits | None = None,
    algorithm: InBox | None = None,
) -> StationSettings:
    """Return an axis with a box of a design as the campaigns have it: on the report's 8051, Design B on fast logic.

    On the 8051, Design B loses its lines in a rapid traverse of 30 kHz, without any fault. An algorithm, or a
    processor with its program, inserts in the place of the design.
    """
    processor = Processor.FAST if design.in_path else Processor.MCS51
    box = InjectorSettings(design=design, timing=Timing.of(design, processor), real_edges=RealEdges.HOLD)
    settings = StationSettings(
        axis=axis,
        injector=box,
        supervision=supervision or SupervisionLimits(),
    )
    return settings if algorithm is None else settings.inserting_by(algorithm)


def sinusoidal_table(
    *, offset_mm: float = 0.0, amplitude_mm: float = 0.02, backlash_mm: float = 0.010
) -> BidirectionalTable:
    """Return an error that changes by up to 20 um a millimetre, with a backlash; a hot machine has an offset."""
    positions_mm = np.linspace(-20.0, 120.0, 281)
    forward_mm = amplitude_mm * np.sin(positions_mm) + offset_mm
    return BidirectionalTable.on_grid(positions_mm, forward_mm, forward_mm + backlash_mm)


def _slope(predictor: Predictor) -> float:
    low_mm, high_mm = predictor.range_mm
    grid_mm = np.linspace(max(low_mm, -1e3), min(high_mm, 1e3), 2001)
    steepest = 0.0
    for direction in (+1, -1):
        errors_mm = predictor.error_mm(grid_mm, direction)
        steepest = max(steepest, float(np.max(np.abs(np.diff(errors_mm) / np.diff(grid_mm)))))
    return steepest


def _reason_of(axes: Sequence[MonitoredAxis], first: MonitoredAxis) -> str:
    """Return who stopped the machine and why; what only follows from that is passed over."""
    if first.stopped_by is Stopper.CONTROLLER:
        return f"controller: {_words(first.alarm)}"
    for axis in axes:
        if axis.box_status in _OWN_REASONS:
            return f"box: {_words(axis.box_status)}"
    for axis in axes:
        if axis.pc_reason not in (HoldReason.NONE, HoldReason.OTHER_AXIS):
            return f"PC: {_words(axis.pc_reason)}"
    return "box: not homed" if first.stopped_by is Stopper.HOMING else "box: no power"


_OWN_REASONS = (
    Status.I_STILL_DONT_BELIEVE_YOU,
    Status.LINK_LOST,
    Status.AXIS_TAKEN,
    Status.IMPLAUSIBLE,
    Status.ENCODER_FAULT,
)


def _words(code: enum.IntEnum) -> str:
    """Return a code in words.

    Examples
    --------
    >>> _words(HoldReason.BOX_SILENT)
    'box silent'
    """
    return code.name.lower().replace("_", " ")
