"""An axis with its box on a bus: its parts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from rtec._jit import Record
from rtec.axis.encoder import Encoder
from rtec.axis.servo import Servo
from rtec.board import Microcontroller
from rtec.checks import number_within, whole_within
from rtec.controller import IllegalPolicy, Multiplication, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.injector import BoxAlgorithm, Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.link._frame_kernels import MOST_AXES
from rtec.machine.faults import Fault, check_waiting
from rtec.machine.firmware_box import FirmwareBox, check_windows
from rtec.requester.settings import HandshakeSettings
from rtec.requester.setup import Setup
from rtec.requester.supervision import SupervisionLimits

InBox = BoxAlgorithm | Microcontroller
"""What works in a box in the place of a design: an algorithm, or a processor that runs a program."""


def _hold_edges() -> InjectorSettings:
    design = Design.A
    return InjectorSettings(design=design, timing=Timing.of(design, Processor.MCS51), real_edges=RealEdges.HOLD)


@dataclass(frozen=True, slots=True, kw_only=True)
class StationSettings:
    """An axis with its box.

    Raises
    ------
    ArgumentError
        A value outside its range; a receiver whose counts are coarser than the encoder's.
    """

    axis: int = 1
    """Its number, 1 to 15."""
    injector: InjectorSettings = field(default_factory=_hold_edges)
    """Design and timing of the box; real edges are held back by default (decision 8)."""
    microcontroller: Microcontroller | None = None
    """A processor that runs the design's firmware in the box, behind its node on the bus; its times and windows are
    the firmware's own. None: the injector models it."""
    algorithm: BoxAlgorithm | None = None
    """Inserts in the place of the injector, which says how many counts a step has, and what its circuits do without
    power; the node before it is the same."""
    encoder: Encoder = field(default_factory=Encoder)
    servo: Servo = field(default_factory=Servo)
    receiver: ReceiverSettings = field(default_factory=lambda: ReceiverSettings(policy=IllegalPolicy.FAULT))
    handshake: HandshakeSettings = field(default_factory=HandshakeSettings)
    supervision: SupervisionLimits = field(default_factory=SupervisionLimits)
    """The other parts. The receiver stops the drive at an illegal transition by default, as a controller's encoder
    supervision does."""
    acceleration_mm_s2: float = 500.0
    """Of the moves."""
    hold_ramp_s: float = 0.05
    """Time in which the feed override goes from 1 to 0 when the machine is held."""
    following_limit_mm: float = 1.0
    """Lag beyond that of the feed (speed / Kv, as a position loop follows it) at which the controller stops the
    drive."""
    switch_on: bool = True

    def __post_init__(self) -> None:
        """Check the ranges, and that box and controller count alike."""
        whole_within("axis", self.axis, 1, MOST_AXES)
        number_within("acceleration_mm_s2", self.acceleration_mm_s2, 1e-3, 1e6, unit="mm/s²")
        number_within("hold_ramp_s", self.hold_ramp_s, 1e-3, 100.0, unit="s")
        number_within("following_limit_mm", self.following_limit_mm, 1e-6, 1e6, unit="mm")
        if self.receiver.multiplication is not Multiplication.X4:
            raise ArgumentError("multiplication", self.receiver.multiplication.value, "4 (x4) in a corrected machine")
        if self.microcontroller is not None:
            check_windows(self.handshake)
            if self.algorithm is not None:
                raise ArgumentError("algorithm", self.algorithm.name, "no microcontroller beside it")

    def firmware_box(self, start_ps: int = 0) -> FirmwareBox | None:
        """Return the box where it runs its firmware, switched on before ``start_ps``."""
        if self.microcontroller is None:
            return None
        return FirmwareBox(
            self.injector, self.microcontroller, self.encoder, switch_on=self.switch_on, start_ps=start_ps
        )

    def inserting_by(self, works: InBox) -> StationSettings:
        """Return the axis with something else in its box, in the place of the design."""
        if isinstance(works, Microcontroller):
            return replace(self, microcontroller=works)
        return replace(self, algorithm=works)

    @property
    def setup(self) -> Setup:
        """Return what a PC must have alike."""
        design = self.injector.design
        return Setup(
            design=design.key,
            step_mm=design.step_counts * self.encoder.count_mm,
            cycle_ps=self.supervision.bus_cycle_ps,
        )

    def check_fault(self, fault: Fault) -> None:
        """Check that a fault can happen to this box."""
        firmware = self.microcontroller is not None
        check_waiting(fault, self.injector.design, firmware=firmware, own=self.algorithm is not None)

    def fill(self, state: Record) -> None:
        """Write the parameters into a kernel's state."""
        count_mm = self.encoder.count_mm
        self.encoder.fill(state.encoder)
        self.injector.fill(state.injector)
        self.receiver.fill(state.receiver)
        self.servo.fill(state.servo, count_mm=count_mm, counts_per_unit=1.0)
        self.handshake.fill_box(state.node.box, switch_on=self.switch_on)
        self.supervision.fill_box(state.node)
        if self.supervision.limit_steps == 0:
            state.node.limit_steps = self.injector.design.word_limit
        state.node.axis = self.axis
        state.node.setup = self.setup.word
        state.acceleration = self.acceleration_mm_s2 / count_mm
        state.ramp_s = self.hold_ramp_s
        state.following_limit = self.following_limit_mm / count_mm
