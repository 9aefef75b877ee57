"""A carriage on a ball screw: two masses, the screw and nut between them, friction at both ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from rtec._jit import Record, new_record
from rtec.axis.plant import Plant
from rtec.axis.plants import _drive_kernels as kernels, _plant_kernels
from rtec.axis.plants.cascade import OUTPUTS, Cascade, numbers_of
from rtec.axis.plants.friction import FloatArray, Friction
from rtec.axis.servo import Servo
from rtec.checks import number_within, one_of_types

_ROUNDS = 20
"""Until the motor's place is found: each takes away all but the slope of the runout."""


class Feedback(Enum):
    """What the position loop sees."""

    ROTARY_ENCODER = "rotary encoder"
    LINEAR_SCALE = "linear scale"


@dataclass(frozen=True, slots=True, kw_only=True)
class ScrewRunout:
    """The nut runs ahead and behind once a turn: a linear scale sees it, a rotary encoder does not."""

    amplitude_um: float = 3.0
    phase_deg: float = 0.0

    def __post_init__(self) -> None:
        number_within("amplitude_um", self.amplitude_um, 0.0, 1000.0)
        number_within("phase_deg", self.phase_deg, -360.0, 360.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class TorqueRipple:
    """The screw turns harder once a turn: both encoders see the servo give way, less at high speed."""

    amplitude_nm: float = 0.05
    phase_deg: float = 0.0

    def __post_init__(self) -> None:
        number_within("amplitude_nm", self.amplitude_nm, 0.0, 1000.0, unit="N m")
        number_within("phase_deg", self.phase_deg, -360.0, 360.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class BallScrew:
    """A small biaxial machine as of Erwinski, Paprocki et al.; the paper gives limits and no parameters.

    Raises
    ------
    ArgumentError
        A value outside its range, or a part of another type.

    Notes
    -----
    The motor is a mass ``J (2 pi / lead)^2`` at q, the carriage another at x. Between them
    ``force = k beyond_play(nut(q) - x) + c (nut' v_q - v_x)``: the oil damps within the play, too. A linear scale
    closes the position loop only; the velocity is always the motor's. "Mainly ball-screw runout" (002) is either of
    two hypotheses: `ScrewRunout` or `TorqueRipple`.

    Examples
    --------
    >>> round(BallScrew().motor_mass_kg, 1), round(BallScrew().n_per_a, 1)
    (118.4, 377.0)
    """

    lead_mm: float = 10.0
    motor_inertia_kg_m2: float = 3e-4
    """Rotor, coupling and screw."""
    nm_per_a: float = 0.6
    carriage_kg: float = 40.0
    stiffness_n_um: float = 60.0
    """Screw, nut and bearing in series: with the carriage a resonance of about 220 Hz."""
    damping_n_s_m: float = 4000.0
    """5 % of critical."""
    backlash_um: float = 2.0
    motor_friction: Friction = field(
        default_factory=lambda: Friction(static_n=75.0, coulomb_n=63.0, stribeck_mm_s=10.0, viscous_n_s_m=150.0)
    )
    """Bearings and seals, at the lead: 63 N are 0.1 N m."""
    carriage_friction: Friction = field(
        default_factory=lambda: Friction(static_n=36.0, coulomb_n=30.0, stribeck_mm_s=10.0, viscous_n_s_m=50.0)
    )
    """Guideways and wipers."""
    once_a_turn: ScrewRunout | TorqueRipple | None = field(default_factory=ScrewRunout)
    feedback: Feedback = Feedback.LINEAR_SCALE
    cascade: Cascade = field(default_factory=Cascade)

    def __post_init__(self) -> None:
        number_within("lead_mm", self.lead_mm, 0.1, 1000.0)
        number_within("motor_inertia_kg_m2", self.motor_inertia_kg_m2, 1e-7, 100.0, unit="kg m^2")
        number_within("nm_per_a", self.nm_per_a, 1e-3, 1e3, unit="N m/A")
        number_within("carriage_kg", self.carriage_kg, 1e-2, 1e5, unit="kg")
        number_within("stiffness_n_um", self.stiffness_n_um, 0.1, 1e4, unit="N/um")
        number_within("damping_n_s_m", self.damping_n_s_m, 0.0, 1e6, unit="N s/m")
        number_within("backlash_um", self.backlash_um, 0.0, 1e4)
        one_of_types("motor_friction", self.motor_friction, Friction)
        one_of_types("carriage_friction", self.carriage_friction, Friction)
        one_of_types("once_a_turn", self.once_a_turn, ScrewRunout, TorqueRipple, type(None))
        one_of_types("feedback", self.feedback, Feedback)
        one_of_types("cascade", self.cascade, Cascade)
        self._steps()

    def _steps(self) -> int:
        ends = ((self.motor_mass_kg, self.motor_friction), (self.carriage_kg, self.carriage_friction))
        stiff = sum((1e6 * self.stiffness_n_um + 1e3 * friction.stiffness_n_mm) / mass for mass, friction in ends)
        damped = sum(self.damping_n_s_m / mass for mass, _ in ends)
        return self.cascade.steps(max(stiff, damped**2))

    @property
    def motor_mass_kg(self) -> float:
        """The motor's inertia as a mass at the nut."""
        return float(self.motor_inertia_kg_m2 * (2e3 * math.pi / self.lead_mm) ** 2)

    @property
    def n_per_a(self) -> float:
        """Force at the nut of a current."""
        return self.nm_per_a * 2e3 * math.pi / self.lead_mm

    def _record(self) -> Record:
        s = new_record(kernels.SCREW)
        s.per_motor, s.per_carriage, s.n_per_a = 1e3 / self.motor_mass_kg, 1e3 / self.carriage_kg, self.n_per_a
        s.stiffness, s.damping = 1e3 * self.stiffness_n_um, 1e-3 * self.damping_n_s_m
        s.half_play, s.per_mm = 0.5e-3 * self.backlash_um, 2.0 * math.pi / self.lead_mm
        s.scale = float(self.feedback is Feedback.LINEAR_SCALE)
        if self.once_a_turn is not None:
            s.phase = math.radians(self.once_a_turn.phase_deg)
        if isinstance(self.once_a_turn, ScrewRunout):
            s.runout_mm = 1e-3 * self.once_a_turn.amplitude_um
        elif isinstance(self.once_a_turn, TorqueRipple):
            s.ripple_n = self.once_a_turn.amplitude_nm * 2e3 * math.pi / self.lead_mm
        return s

    def _friction(self) -> FloatArray:
        return np.stack([self.motor_friction.numbers(), self.carriage_friction.numbers()])

    def _cascade(self, *, open_loop: bool = False) -> Record:
        return self.cascade.state(self.motor_mass_kg + self.carriage_kg, self.n_per_a, open_loop=open_loop)

    def servo(self) -> Servo:
        """Return the servo that moves this drive in a closed loop (`rtec.machine`), with encoder and box."""
        s, c = self._record(), self._cascade()
        motor = 0.0
        if s.scale > 0.0:  # the scale reads 0 where the nut is there
            for _ in range(_ROUNDS):
                motor = -s.runout_mm * math.sin(s.per_mm * motor + s.phase)
        c.last_mm = motor
        carriage = motor + s.runout_mm * math.sin(s.per_mm * motor + s.phase)
        memory = kernels.new_memory(2).ravel()
        return self.cascade.servo(
            Plant(
                function=_plant_kernels.ball_screw,
                numbers=np.concatenate([[self._steps()], numbers_of(s), self._friction().ravel()]),
                state=np.concatenate([np.zeros(5), [motor, carriage, 0.0, 0.0, 0.0], numbers_of(c), memory]),
                outputs=OUTPUTS,
            )
        )

    def simulate(self, commands: FloatArray, every: int, finer: int, *, open_loop: bool) -> FloatArray:
        """Return what `run_drive` records, shape (outputs, samples), from commands of shape (4, periods)."""
        s, c, f = self._record(), self._cascade(open_loop=open_loop), self._friction()
        out = kernels.new_outputs(commands, every)
        kernels.run_ball_screw(s, c, f, kernels.new_memory(2), commands, every, finer * self._steps(), out)
        return out
