"""The open signal path: an encoder at constant speed or in a motion, the box, and the controller's input."""

from __future__ import annotations

from dataclasses import dataclass, field

from rtec._jit import Record, new_record
from rtec.axis import Encoder
from rtec.axis.motion import Motion
from rtec.board import Board, Microcontroller
from rtec.board.board import START_UP_READINGS, reading_ps
from rtec.checks import number_within, whole_within
from rtec.controller import ReceiverResult, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import InjectorSettings, Insertions, RealEdges
from rtec.machine import _open_kernels
from rtec.units import LONGEST_RUN_PS, PS_PER_S

MAX_EDGES = 1 << 40


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenPath:
    """A run of the open path.

    Parameters
    ----------
    injector
        Design, timing and choices of the box.
    encoder
        The encoder with its imperfections.
    receiver
        The controller's input.
    frequency_hz
        Of the encoder's A (or B) square wave.
    cycles
        Length of the motion in cycles of four counts.
    corrections
        Steps asked for, spread evenly over the motion; negative ones take counts away.
    direction
        +1 or -1.
    microcontroller
        A processor that runs the design's firmware in the box, in place of the behavioural model of it. Design and
        hold latch are those of ``injector``; its times are the firmware's own.
    motion
        In place of a constant speed, with times of its own at which it asks for the corrections
        (`rtec.machine.with_motion`).

    Raises
    ------
    ArgumentError
        A value outside its range.

    Examples
    --------
    >>> from rtec.injector import Design, Processor, Timing
    >>> box = InjectorSettings(design=Design.C, timing=Timing.of(Design.C, Processor.FAST))
    >>> path = OpenPath(injector=box, frequency_hz=500e3, cycles=1000, corrections=40)
    >>> from rtec.machine import simulate
    >>> result = simulate(path)
    >>> result.encoder_counts, result.controller_counts, result.audit
    (4000, 4080, True)
    """

    injector: InjectorSettings
    frequency_hz: float
    cycles: int
    corrections: int = 0
    direction: int = 1
    encoder: Encoder = field(default_factory=Encoder)
    receiver: ReceiverSettings = field(default_factory=ReceiverSettings)
    microcontroller: Microcontroller | None = None
    motion: Motion | None = None

    def __post_init__(self) -> None:
        cycles = whole_within("cycles", self.cycles, 1, MAX_EDGES // 4)
        frequency_hz = number_within("frequency_hz", self.frequency_hz, 1e-3, 1e8, unit="Hz")
        if cycles / frequency_hz * PS_PER_S > LONGEST_RUN_PS:
            most = int(LONGEST_RUN_PS / PS_PER_S * frequency_hz)
            raise ArgumentError("cycles", cycles, f"at most {most}, 50 days at this frequency")
        if self.direction not in (1, -1):
            raise ArgumentError("direction", self.direction, "+1 or -1")
        most, why = 16 * cycles, "(at most 4 an edge)"
        word = self.injector.design.word_limit
        if self.microcontroller is not None and word < most:
            most, why = word, "(the total that the firmware's word holds)"
        whole_within("corrections", self.corrections, -most, most, unit=why)
        if self.motion is not None and (wanted := self.motion.requests_ps.size) != abs(self.corrections):
            raise ArgumentError("corrections", self.corrections, f"{wanted}, as the motion asks")

    def state(self) -> Record:
        """Return the kernel's state at the start."""
        state = new_record(_open_kernels.OPEN_PATH)
        self.encoder.fill_steady(state.encoder, self.frequency_hz, 1 if self.direction > 0 else -1)
        self.injector.fill(state.injector)
        self.receiver.fill(state.receiver)
        state.edges = 4 * self.cycles
        state.in_blocks = 1
        state.corrections = abs(self.corrections)
        state.sign = 1 if self.corrections >= 0 else -1
        _open_kernels.start(state)
        return state

    def board(self) -> Board | None:
        """Return the box with its firmware, homed and with its lines through, before time 0."""
        if self.microcontroller is None:
            return None
        board = Board(
            self.injector.design,
            self.microcontroller,
            initial=self.encoder.level_at_home,
            hold_latch=self.injector.real_edges is RealEdges.HOLD,
            start_ps=-2 * START_UP_READINGS * reading_ps(self.microcontroller),
        )
        board.start_up()
        board.idle(until_ps=0)
        board.begin_counting()
        return board


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenPathResult:
    """What came out of a run of the open path."""

    path: OpenPath
    edges: int
    """Real edges of the encoder."""
    encoder_counts: int
    controller_counts: int
    insertions: Insertions
    received: ReceiverResult
    glitches: int
    audit: bool
    """Controller counts less encoder counts equal the completed steps, and so says the monitor at the gates."""
    simulated_s: float
    wall_s: float

    @property
    def step_counts(self) -> int:
        """Return how many counts a step is."""
        return self.path.injector.design.step_counts

    @property
    def top_hz(self) -> float:
        """Return the highest frequency that the motion has reached."""
        return self.path.frequency_hz if self.path.motion is None else self.path.motion.top_hz

    @property
    def pending(self) -> int:
        """Return the steps asked for and not inserted."""
        return self.insertions.requested - self.insertions.completed

    @property
    def good(self) -> bool:
        """Return whether all was inserted and every count is right."""
        return self.audit and self.pending == 0 and self.received.illegal_transitions == 0

    def to_dict(self) -> dict[str, object]:
        """Return the result under the names that scripts rely on."""
        path = self.path
        return {
            "design": path.injector.design.key,
            "frequency_hz": path.frequency_hz,
            "edges": self.edges,
            "encoder_counts": self.encoder_counts,
            "controller_counts": self.controller_counts,
            "corrections_requested": self.insertions.requested,
            "corrections_inserted": self.insertions.completed,
            "corrections_pending": self.pending,
            "step_counts": self.step_counts,
            "illegal_transitions": self.received.illegal_transitions,
            "illegal_simultaneous": self.received.simultaneous,
            "illegal_unresolved": self.received.unresolved,
            "first_illegal_ps": [illegal.time_ps for illegal in self.received.first_illegal],
            "min_separation_ps": self.received.min_separation_ps,
            "filtered_pulses": self.received.filtered,
            "servo_fault_ps": self.received.fault_ps,
            "refused_too_fast": self.insertions.refused,
            "real_edges_inside_insertions": self.insertions.real_inside,
            "longest_insertion_ps": self.insertions.longest_ps,
            "monitor_inserted_counts": self.insertions.ahead_counts,
            "monitor_illegal": self.insertions.illegal,
            "glitches": self.glitches,
            "audit": self.audit,
            "simulated_s": self.simulated_s,
            "wall_s": self.wall_s,
            "edges_per_s": self.edges / self.wall_s if self.wall_s > 0 else None,
            "real_edges": path.injector.real_edges.value,
            "motion": "steady" if path.motion is None else path.motion.kind.value,
            "top_frequency_hz": self.top_hz,
        }
