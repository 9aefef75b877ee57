"""The whole machine: program, servo, axis, encoder, box, PC and controller, run in simulated time."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_model import Fault as ProcessorFault
from rtec._jit import Record, new_record, prepared
from rtec.axis import Encoder, MotionSegments, Servo
from rtec.axis.plant import bound_plant
from rtec.board import Microcontroller
from rtec.controller import Multiplication, ReceiverResult, ReceiverSettings
from rtec.controller._kernels import reset as reset_receiver
from rtec.controller.receiver import result_of
from rtec.errors import ArgumentError
from rtec.heat.binding import bound_heat
from rtec.heat.course import HeatCourse
from rtec.injector import Design, InjectorSettings, Insertions, Processor, Timing
from rtec.injector.box import insertions_of
from rtec.link.simulated import FaultActivation, activations_of
from rtec.machine import _loop_kernels
from rtec.machine.fault_kinds import FaultCategory
from rtec.machine.faults import (
    Fault,
    FaultKind,
    FaultPlace,
    check_apart,
    check_waiting,
    fault_records,
    probing_records,
)
from rtec.machine.firmware_box import FirmwareBox, check_windows
from rtec.machine.laser_readings import Laser, MeasuringRun
from rtec.metrology import Readings
from rtec.predictors import Model, NoError, Predictor
from rtec.predictors.binding import bound, bound_curve, heat_inputs, outside_input, rests
from rtec.predictors.play import check_play
from rtec.requester.settings import HandshakeSettings
from rtec.requester.status import Status
from rtec.units import LONGEST_RUN_PS, PS_PER_S

_LEAST_SLICES, _MOST_SLICES = 100, 1_000_000
_SLICE_WORK = 20_000_000
"""Ticks and edges, at the axis's top speed, between two moments at which a run can be broken off."""
_MOST_EDGES = 1e11
_BOX_FIRST_PS = 300_000_000
_PC_FIRST_PS = 5_500_000_000
TRACE_COLUMNS = ("time_s", "command_mm", "encoder_mm", "true_mm", "controller_mm", "wanted", "completed", "count")
"""What a row of a trace holds, before the outputs of a plant; the totals in steps."""


class Ending(enum.Enum):
    """How a run ended."""

    FINISHED = _loop_kernels.FINISHED
    HELD = _loop_kernels.HELD
    """The PC held the machine: after "I Still Don't Believe You", or because its model had no answer."""
    FAULTED = _loop_kernels.FAULTED
    """The controller latched a servo fault, or what it moves had no answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """An axis with everything that moves and corrects it.

    Parameters
    ----------
    axis_error
        True error of the axis, actual minus encoder's position; the play lies between its two directions.
    injector
        The box; None where the lines go straight to the controller.
    microcontroller
        A processor that runs the design's firmware in the box, in place of the behavioural model of it. Design and
        hold latch are those of ``injector``; its times, and the box's windows and period, are the firmware's own.
    model
        The PC's model of the axis, a function of its sensors.
    own_table
        The controller's own compensation, ideally applied to the command; none by default.
    encoder, servo, receiver, handshake, laser
        The other parts.
    heat
        What heat does while it runs: by how much the axis is displaced, and what the PC's thermometers say.
    allow_large_correction
        The operator's word for a restart with a hot machine: the PC's first request may exceed the window.
    switch_on
        False: the box's hardware switch forbids corrections.
    faults
        What goes wrong at the axis, its number 1, or with the PC. Without a box, only what happens to the lines.
    probing
        Times (from, until) in ps at which the PC is in its probing mode: nothing is corrected then.

    Raises
    ------
    ArgumentError
        A fault of a bus or of another axis; an error whose reverse curve lies below its forward curve, or that falls
        by more than the axis moves.
    """

    axis_error: Predictor = field(default_factory=NoError)
    injector: InjectorSettings | None = None
    microcontroller: Microcontroller | None = None
    model: Model = field(default_factory=NoError)
    own_table: Predictor = field(default_factory=NoError)
    encoder: Encoder = field(default_factory=Encoder)
    servo: Servo = field(default_factory=Servo)
    receiver: ReceiverSettings = field(default_factory=ReceiverSettings)
    handshake: HandshakeSettings = field(default_factory=HandshakeSettings)
    laser: Laser = field(default_factory=Laser)
    heat: HeatCourse = field(default_factory=HeatCourse)
    allow_large_correction: bool = False
    switch_on: bool = True
    faults: tuple[Fault, ...] = ()
    probing: tuple[tuple[int, int], ...] = ()

    def __post_init__(self) -> None:
        """Check that the true error is one that a play between two flanks can have, and the box one for the loop."""
        heat_inputs(self.heat)
        check_play(self.axis_error)
        for fault in self.faults:
            self._check_fault(fault)
        check_apart(self.faults, self.probing)
        if self.microcontroller is not None:
            check_windows(self.handshake)

    def _check_fault(self, fault: Fault) -> None:
        """Check that a fault can happen here: PC and box exchange words, not frames."""
        kind = fault.kind
        if not kind.among_words:
            hint = "in a cell, or by 'rtec safety', PC and box are on a bus"
            raise ArgumentError("faults", kind.words, "faults of an axis, or 'PC killed'", hint)
        if kind.place is FaultPlace.AXIS and fault.place != 1:
            raise ArgumentError("faults", f"{kind.words} at axis {fault.place}", "axis 1, the only one")
        if kind is FaultKind.SWITCH_THROWN and not self.switch_on:
            raise ArgumentError("faults", kind.words, "a switch that is closed", "leave switch_on as it is")
        if self.injector is None:
            if kind.category is not FaultCategory.ENCODER:
                raise ArgumentError("faults", kind.words, "faults of the lines, where there is no box")
        else:
            check_waiting(fault, self.injector.design, firmware=self.microcontroller is not None)

    def state(self) -> Record:
        """Return the kernel's state at home, everything switched on."""
        state = new_record(_loop_kernels.MACHINE)
        box = self.injector or InjectorSettings(
            design=Design.ORIGINAL, timing=Timing.of(Design.ORIGINAL, Processor.MCS51)
        )
        self.encoder.fill(state.encoder)
        box.fill(state.injector)
        self.receiver.fill(state.receiver)
        count_mm = self.encoder.count_mm
        self.servo.fill(state.servo, count_mm=count_mm, counts_per_unit=4.0 / self.receiver.multiplication.value)
        self.handshake.fill_box(state.node.box, switch_on=self.switch_on)
        self.handshake.fill_pc(
            state.pc, count_mm=count_mm, step_counts=box.design.step_counts, word_limit=box.design.word_limit
        )
        state.pc.large_meant = int(self.allow_large_correction)
        state.node.down.latency_ps = self.handshake.latency_ps
        state.node.up.latency_ps = self.handshake.latency_ps
        state.reader.window_mm = self.laser.window_mm
        state.reader.full_ps = round(self.laser.dwell_s * PS_PER_S)
        state.reader.half_ps = state.reader.full_ps // 2
        state.restless = int(not rests(self.model))
        state.servo.compensates = int(not isinstance(self.own_table, NoError))
        state.correcting = int(self.injector is not None)
        state.skipping = 1
        _loop_kernels.start(state, _BOX_FIRST_PS, _PC_FIRST_PS)
        return state

    def bound_models(self) -> tuple[Any, Any, Any, Any, Any]:
        """Return true error, the PC's model, the controller's own table, the plant and the heat for the kernel."""
        error, own = (bound_curve(getattr(self, name), name) for name in ("axis_error", "own_table"))
        model = bound(self.model, heat_inputs(self.heat), axes=1)
        return error, model, own, bound_plant(self.servo.plant), bound_heat(self.heat)

    def firmware_box(self) -> FirmwareBox | None:
        """Return the box where it runs its firmware."""
        if self.injector is None or self.microcontroller is None:
            return None
        return FirmwareBox(self.injector, self.microcontroller, self.encoder, switch_on=self.switch_on)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoopResult:
    """What came out of a run of the whole machine."""

    ending: Ending
    deviation_mm: NDArray[np.float64]
    """Actual less target of each reading; NaN where none could be taken."""
    insertions: Insertions
    received: ReceiverResult
    encoder_counts: int
    controller_counts: int
    step_counts: int
    wanted_steps: int
    """Total that the prediction asked for in the end."""
    pending_steps: int
    """What of it was not inserted."""
    beyond_word_steps: int
    """Largest excess over what the request's word can hold, at any time."""
    status: Status
    refused: int
    """Requests outside the box's window."""
    exchanges: int
    not_valid: int
    """Readings of the PC that met Data Valid low and were repeated."""
    audit_counts: int
    """By how much the controller's count is off: 0 where the audit holds."""
    following_max_mm: float
    ticks: int
    ticks_skipped: int
    simulated_s: float
    wall_s: float
    trace: NDArray[np.float64] | None
    """Rows of ``TRACE_COLUMNS`` and of the plant's outputs, where one was asked for."""
    cycles: int = 0
    """Cycles of the box's processor, where it runs its firmware."""
    cycles_skipped: int = 0
    """What of them was left out at rest, in whole rounds that change nothing."""
    firmware_fault: ProcessorFault | None = None
    fired: tuple[FaultActivation[Fault], ...] = ()
    """The activation of each fault."""
    outside_s: float = 0.0
    """For how long the model had no answer: an input was outside its ranges."""
    outside_input: str = ""
    """The first of such inputs; empty where there was none."""

    @property
    def audit(self) -> bool:
        """Return whether every count at the controller is accounted for."""
        return self.audit_counts == 0 and self.received.illegal_transitions == 0


def run_machine(
    machine: Machine,
    task: MeasuringRun | MotionSegments,
    *,
    trace_every: int = 0,
    progress: Callable[[float], None] | None = None,
    skip_rest: bool = True,
) -> LoopResult:
    """Run the machine through a measuring run, or through a motion without readings.

    Parameters
    ----------
    machine
        The parts.
    task
        What it does.
    trace_every
        Keep a row of ``TRACE_COLUMNS``, and of the plant's outputs, every so many servo ticks; 0 keeps none.
    progress
        Called with the share done, now and then.
    skip_rest
        False computes every servo tick, also those in which nothing can change; the result is the same.

    Raises
    ------
    ArgumentError
        A model that looks at what the PC does not sense; a receiver whose counts are coarser than the encoder's, with
        a box that corrects by single counts; a run longer than 50 days, or with more than 1e11 edges.
    """
    if machine.injector is not None and machine.receiver.multiplication is not Multiplication.X4:
        raise ArgumentError(
            "multiplication",
            machine.receiver.multiplication.value,
            "4 (x4) in a corrected machine",
            "the box's steps are counts of the x4 decoder",
        )
    motion = task.motion if isinstance(task, MeasuringRun) else task
    state = machine.state()
    models = machine.bound_models()
    firmware = machine.firmware_box()
    box = None if firmware is None else firmware.of(state)
    if firmware is not None:
        reset_receiver(state.receiver, firmware.board.state.ab_out)
        state.pc.valid_after_ps = 0  # the firmware's own Data Valid says when
    state.skipping = int(skip_rest)
    total_ps = motion.total_ps or PS_PER_S
    slices = _slices(machine, motion, total_ps)
    readings, arrays = _arrays(machine, task, motion)
    outputs = () if machine.servo.plant is None else machine.servo.plant.outputs
    trace = _trace(total_ps // machine.servo.period_ps + 1, trace_every, len(outputs))
    records = np.concatenate([fault_records(machine.faults), probing_records(machine.probing)]).view(np.recarray)
    advance = prepared(_loop_kernels.run, state, 0, *arrays, models, trace, box, records)
    begun = time.perf_counter()
    for part in range(1, slices + 1):
        until_ps = total_ps * part // slices
        advance(state, until_ps, *arrays, models, trace, box, records)
        if progress is not None:
            progress(part / slices)
        if state.status not in (_loop_kernels.FINISHED, _loop_kernels.RUNNING):
            break
    prepared(_loop_kernels.come_to_rest, state, box, records)(state, box, records)
    wall_s = time.perf_counter() - begun
    target = task.target_mm if isinstance(task, MeasuringRun) else np.empty(0)
    rows = trace[0][: trace[2][0]] if trace_every > 0 else None
    fired = activations_of(machine.faults, records[: len(machine.faults)])
    result = replace(_result(machine, state, firmware, readings - target, rows, wall_s), fired=fired)
    if firmware is None:
        return result
    skipped, board = firmware.cycles_skipped, firmware.board
    return replace(result, cycles=board.cpu.cycles + skipped, cycles_skipped=skipped, firmware_fault=board.fault)


def compile_end() -> None:
    """Compile what ends a run; it is needed only once the run is over."""
    state, records = Machine().state(), fault_records(()).view(np.recarray)
    prepared(_loop_kernels.come_to_rest, state, None, records)


def _slices(machine: Machine, motion: MotionSegments, total_ps: int) -> int:
    """Return into how many parts a run is cut, so that progress shows and it can be broken off in each."""
    if total_ps > LONGEST_RUN_PS:
        days = total_ps / PS_PER_S / 86_400
        raise ArgumentError("task", f"{days:.1f} days", "a run of at most 50 days", "shorten the dwells")
    count_mm = machine.encoder.count_mm
    path_mm = float(np.abs(np.diff(np.append(motion.x0_mm, motion.end_mm))).sum())
    if path_mm > _MOST_EDGES * count_mm:
        raise ArgumentError(
            "count_mm",
            count_mm,
            f"at most {_MOST_EDGES:g} edges in a run, {path_mm:g} mm long",
            "take coarser counts",
        )
    ticks = total_ps // machine.servo.period_ps
    edges_a_tick = machine.servo.max_speed_mm_s / count_mm * machine.servo.period_ps / PS_PER_S
    return round(min(max(ticks * (1.0 + edges_a_tick) / _SLICE_WORK, _LEAST_SLICES), _MOST_SLICES))


def _arrays(
    machine: Machine, task: MeasuringRun | MotionSegments, motion: MotionSegments
) -> tuple[NDArray[np.float64], Any]:
    """Return the array of readings to fill, and motion and schedule as the kernel wants them."""
    per_mm = 1.0 / machine.encoder.count_mm
    columns = [motion.x0_mm, motion.v0_mm_s, motion.a0_mm_s2, motion.j0_mm_s3]
    shape = np.ascontiguousarray(np.stack(columns) * per_mm)
    if isinstance(task, MeasuringRun):
        schedule = (task.target_mm, task.begins_ps, task.ends_ps)
    else:
        schedule = (np.empty(0), np.empty(0, np.int64), np.empty(0, np.int64))
    readings = np.full(schedule[0].size, np.nan)
    command = tuple(np.array(part) for part in (motion.start_ps, motion.duration_ps, shape))
    return readings, (command, (*map(np.array, schedule), readings))


def _trace(ticks: int, every: int, outputs: int) -> tuple[NDArray[np.float64], int, NDArray[np.int64]]:
    """Return room for a row every so many ticks, or for none: each type of it would be one more loop to compile."""
    rows = ticks // every + 2 if every > 0 else 0
    if rows > 20_000_000:
        raise ArgumentError("trace_every", every, f"at least {ticks // 10_000_000}", "a trace is held in memory")
    return np.zeros((rows, len(TRACE_COLUMNS) + outputs)), max(every, 1), np.zeros(1, np.int64)


def _result(
    machine: Machine,
    state: Record,
    firmware: FirmwareBox | None,
    deviation: NDArray[np.float64],
    trace: NDArray[np.float64] | None,
    wall_s: float,
) -> LoopResult:
    insertions = insertions_of(state.injector, None if firmware is None else firmware.board.state)
    received = result_of(state.receiver)
    step = machine.injector.design.step_counts if machine.injector else 0
    encoder_counts = int(state.encoder.count)
    due = machine.receiver.counted(encoder_counts + insertions.completed * step, machine.encoder.home_state)
    # the count before it wraps: modulo a narrow counter's width, a loss of whole turns would go unseen
    off = received.count - due
    wanted = int(state.pc.target) if machine.injector else 0
    return LoopResult(
        ending=Ending(int(state.status)),
        deviation_mm=deviation,
        insertions=insertions,
        received=received,
        encoder_counts=encoder_counts,
        controller_counts=machine.receiver.wrapped(received.count),
        step_counts=step,
        wanted_steps=wanted,
        pending_steps=wanted - insertions.completed if machine.injector else 0,
        beyond_word_steps=int(state.pc.beyond_word_max),
        status=Status(int(state.node.box.status)) if machine.injector else Status.OK,
        refused=int(state.node.box.refused),
        exchanges=int(state.pc.requests),
        not_valid=int(state.pc.not_valid),
        audit_counts=off if off else insertions.ahead_counts - insertions.completed * step,
        following_max_mm=float(state.servo.following_max) * machine.encoder.count_mm,
        ticks=int(state.servo.ticks),
        ticks_skipped=int(state.servo.skipped),
        simulated_s=int(state.servo.now_ps) / PS_PER_S,
        wall_s=wall_s,
        trace=trace,
        outside_s=int(state.pc.outside_turns) * machine.handshake.pc_period_ps / PS_PER_S,
        outside_input=outside_input(machine.model, int(state.pc.outside_input)),
    )


def readings_of(task: MeasuringRun, deviation_mm: NDArray[np.float64]) -> Readings:
    """Return the readings of a run as the laser system would hand them over.

    Raises
    ------
    ArgumentError
        A reading that could not be taken: the axis never came within the laser's window, or left it too early.
    """
    missing = np.flatnonzero(~np.isfinite(deviation_mm))
    if missing.size:
        first = int(missing[0])
        raise ArgumentError(
            "readings",
            f"{missing.size} of {deviation_mm.size} missing, the first at {task.target_mm[first]:.4f} mm",
            "a dwell longer than the laser's, at a target that the axis reaches",
            "lengthen the dwell of the plan",
        )
    return Readings(target_mm=task.target_mm, deviation_mm=deviation_mm, direction=task.direction, run=task.run)
