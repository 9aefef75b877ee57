"""Supervision of the bus by box and PC, beyond the report's windows; and the reasons why the PC holds the machine."""

from __future__ import annotations

from dataclasses import dataclass

from rtec._jit import Record
from rtec.checks import number_within, whole_within
from rtec.requester import _pc_node_kernels as _codes
from rtec.requester.status import Code
from rtec.units import PS_PER_MS


class HoldReason(Code):
    """Why the PC holds the machine; the numbers are those of the message Hold.

    Examples
    --------
    >>> HoldReason.BOX_SILENT.meaning
    'nothing was heard from the box for longer than the watchdog timeout: look at its power and the bus'
    """

    NONE = _codes.NONE, "the machine is not held"
    BOX_STILL_DOUBTS = (
        _codes.BOX_STILL_DOUBTS,
        "the box says I Still Don't Believe You: look at the predictor, then home again",
    )
    BOX_SILENT = (
        _codes.BOX_SILENT,
        "nothing was heard from the box for longer than the watchdog timeout: look at its power and the bus",
    )
    BOX_RESTARTED = _codes.BOX_RESTARTED, "the box has started again and lost its totals: home again"
    CORRECTIONS_DISABLED = (
        _codes.CORRECTIONS_DISABLED,
        "the box's switch forbids corrections, and one was asked for: close the switch",
    )
    BOX_LOST_LINK = (
        _codes.BOX_LOST_LINK,
        "the box has not heard this PC for longer than the watchdog timeout: look at the bus",
    )
    BOX_HELD = _codes.BOX_HELD, "the box was told to hold by a message on the bus"
    AXIS_TAKEN = _codes.AXIS_TAKEN, "two boxes have the same axis number: give each axis its own"
    POSITION_IMPLAUSIBLE = (
        _codes.POSITION_IMPLAUSIBLE,
        "the box's position jumps, or does not agree with what the box has added up",
    )
    PREDICTOR_OUT_OF_RANGE = _codes.PREDICTOR_OUT_OF_RANGE, "the axis has left the range that the predictor knows"
    CLOCK_JUMP = _codes.CLOCK_JUMP, "this PC stood still, or its clock jumped, for longer than the watchdog timeout"
    ANOTHER_PC = _codes.ANOTHER_PC, "another PC talks to this axis' box: only one may"
    BUS_OFF = _codes.BUS_OFF, "this PC is off the bus"
    OTHER_AXIS = _codes.OTHER_AXIS, "another axis of the machine is held"
    ENCODER_FAULT = _codes.ENCODER_FAULT, "the box saw both encoder lines change at once: look at the encoder's cable"
    BOX_IMPLAUSIBLE = _codes.BOX_IMPLAUSIBLE, "the box was asked for a total beyond its limit"
    DEVIATION_LIMIT = _codes.DEVIATION_LIMIT, "the predictor asks for more than the limit of the deviation"
    COMPLETED_WRONG = _codes.COMPLETED_WRONG, "the box has accepted a total that this PC never asked for"
    OPERATOR = _codes.OPERATOR, "the operator held the machine"
    NOT_COMPLETED = (
        _codes.NOT_COMPLETED,
        "the box has not inserted what it accepted for longer than the completion timeout",
    )
    ANSWER_LATE = (
        _codes.ANSWER_LATE,
        "the box answers requests that are too old: the bus delays what it carries, or loses it",
    )
    STATUS_WRONG = _codes.STATUS_WRONG, "the box says a state or a code that no box has, or that do not go together"
    BEYOND_WORD = _codes.BEYOND_WORD, "the predictor asks for more steps than the request's word of this design holds"
    SETUP_DIFFERS = (
        _codes.SETUP_DIFFERS,
        "box and PC are set up for another design, step or cycle: start both with the same",
    )
    DRIVE_STOPPED = (
        _codes.DRIVE_STOPPED,
        "the controller has stopped the drive (following error or encoder fault): correct that, then home again",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SupervisionLimits:
    """Timeouts and limits by which box and PC supervise each other and the bus.

    Raises
    ------
    ArgumentError
        A value outside its range; a watchdog timeout of fewer than three or more than six cycles: with more frames
        missing, a sequence counter no longer tells their order.

    Examples
    --------
    >>> SupervisionLimits().watchdog_ps // 10**9
    50
    """

    cycle_ps: int = 10 * PS_PER_MS
    """The box sends position, corrections and status this often."""
    watchdog_ps: int = 50 * PS_PER_MS
    """Watchdog timeout: longest silence of the other side, a few cycles; beyond it the machine is held."""
    gap_ps: int = 2 * PS_PER_MS
    """Least time between two requests that the box judges. Whatever goes wrong on the bus, a total moves by no more
    than the window in this time."""
    completion_timeout_ps: int = 0
    """Longest time that an accepted total may stay unfinished; 0 for no limit. A long rapid beyond the speed gate
    needs a long one: nothing is inserted then."""
    limit_steps: int = 0
    """Largest total that the box accepts; 0 for what the request's word of the design holds."""
    limit_mm: float = 0.0
    """Largest deviation that the PC corrects; 0 for no limit."""
    most_mm_s: float = 1000.0
    """Largest speed of the axis: a position that implies a higher one is rejected as implausible."""
    speed: float = 1.0
    """Picoseconds of the node's own clock per picosecond of the bus; the times above are on the node's clock."""

    def __post_init__(self) -> None:
        whole_within("cycle_ps", self.cycle_ps, PS_PER_MS, 1000 * PS_PER_MS, unit="ps")
        whole_within("watchdog_ps", self.watchdog_ps, PS_PER_MS, 100_000 * PS_PER_MS, unit="ps")
        whole_within("completion_timeout_ps", self.completion_timeout_ps, 0, 10**17, unit="ps")
        whole_within("limit_steps", self.limit_steps, 0, 32767)
        number_within("limit_mm", self.limit_mm, 0.0, 1e3, unit="mm")
        number_within("most_mm_s", self.most_mm_s, 1e-3, 1e5, unit="mm/s")
        number_within("speed", self.speed, 0.1, 100.0)
        whole_within("gap_ps", self.gap_ps, 0, self.cycle_ps // 2, unit="ps (at most half a cycle)")
        cycle_ps = self.cycle_ps
        whole_within("watchdog_ps", self.watchdog_ps, 3 * cycle_ps, 6 * cycle_ps, unit="ps (three to six cycles)")

    @property
    def bus_cycle_ps(self) -> int:
        """Return the cycle on the clock of the bus."""
        return round(self.cycle_ps / self.speed)

    def fill_box(self, node: Record) -> None:
        """Write the box's share into its node's state."""
        node.cycle_ps = self.cycle_ps
        node.watchdog_ps = self.watchdog_ps
        node.gap_ps = self.gap_ps
        node.limit_steps = self.limit_steps

    def fill_pc(self, node: Record, *, count_mm: float) -> None:
        """Write the PC's share into its node's state."""
        node.watchdog_ps = self.watchdog_ps
        node.completion_timeout_ps = self.completion_timeout_ps
        node.limit_mm = self.limit_mm
        node.most_counts_per_s = self.most_mm_s / count_mm
