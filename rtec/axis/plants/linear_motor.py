"""A carriage on a linear motor: one mass, friction, cogging."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from rtec._jit import Record, new_record
from rtec.axis.plant import Plant
from rtec.axis.plants import _drive_kernels as kernels, _plant_kernels
from rtec.axis.plants.cascade import OUTPUTS, Cascade, numbers_of
from rtec.axis.plants.friction import FloatArray, Friction
from rtec.axis.servo import Servo
from rtec.checks import number_within, one_of_types
from rtec.compiled import finite_array


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearMotor:
    """The axis of Erwinski et al. (2019): an iron-core motor with a linear scale and no transmission.

    Raises
    ------
    ArgumentError
        A value outside its range, or a part of another type.

    Notes
    -----
    ``m a = kf i - cogging sin(2 pi x / period + phase) - friction``. The paper's figure 5 runs from 0.4 to 0.9 A,
    with 0.5 A of breakaway: 0.42 A of dry and 0.32 A s/m of viscous friction, and a fade that takes 20 % of the whole
    at 2 m/s and 1 % at 0.5 m/s, where the paper sees the curve bend.

    Examples
    --------
    >>> motor = LinearMotor()
    >>> (motor.friction.steady_n([0, 2000]) / motor.n_per_a).round(2).tolist()
    [0.5, 0.85]
    """

    mass_kg: float = 3.61
    n_per_a: float = 39.0
    friction: Friction = field(
        default_factory=lambda: Friction(
            static_n=19.5, coulomb_n=16.38, stribeck_mm_s=20.0, viscous_n_s_m=12.48, fade_mm_s=2850.0
        )
    )
    cogging_n: float = 5.85
    """0.15 A: the paper's figure 6 has an axis of half an ampere."""
    cogging_period_mm: float = 12.0
    """From north pole to south pole."""
    cogging_phase_deg: float = 0.0
    feedforward_map_a: tuple[float, ...] = ()
    """Currents that the drive adds against cogging, equally spaced over a period; none for no compensation."""
    cascade: Cascade = field(default_factory=Cascade)

    def __post_init__(self) -> None:
        number_within("mass_kg", self.mass_kg, 1e-3, 1e5, unit="kg")
        number_within("n_per_a", self.n_per_a, 1e-3, 1e5, unit="N/A")
        number_within("cogging_n", self.cogging_n, 0.0, 1e5, unit="N")
        number_within("cogging_period_mm", self.cogging_period_mm, 0.1, 1e4)
        number_within("cogging_phase_deg", self.cogging_phase_deg, -360.0, 360.0)
        finite_array("feedforward_map_a", self.feedforward_map_a)
        one_of_types("friction", self.friction, Friction)
        one_of_types("cascade", self.cascade, Cascade)
        self._steps()

    def _steps(self) -> int:
        stiffness = self.friction.stiffness_n_mm + 2.0 * math.pi * self.cogging_n / self.cogging_period_mm
        return self.cascade.steps(1e3 * stiffness / self.mass_kg)

    def _map(self) -> FloatArray:
        return finite_array("feedforward_map_a", self.feedforward_map_a)

    def _record(self) -> Record:
        m = new_record(kernels.MOTOR)
        m.per_mass, m.n_per_a = 1e3 / self.mass_kg, self.n_per_a
        m.per_mm, m.phase = 2.0 * math.pi / self.cogging_period_mm, math.radians(self.cogging_phase_deg)
        m.cogging_n = self.cogging_n
        return m

    def servo(self) -> Servo:
        """Return the servo that moves this drive in a closed loop (`rtec.machine`), with encoder and box."""
        loops = numbers_of(self.cascade.state(self.mass_kg, self.n_per_a))
        steps, memory = self._steps(), kernels.new_memory(1).ravel()
        numbers = [np.array([steps]), numbers_of(self._record()), self.friction.numbers(), self._map()]
        return self.cascade.servo(
            Plant(
                function=_plant_kernels.linear_motor,
                numbers=np.concatenate(numbers),
                state=np.concatenate([np.zeros(5), np.zeros(3), loops, memory]),
                outputs=OUTPUTS,
            )
        )

    def simulate(self, commands: FloatArray, every: int, finer: int, *, open_loop: bool) -> FloatArray:
        """Return what `run_drive` records, shape (outputs, samples), from commands of shape (4, periods)."""
        m = self._record()
        c = self.cascade.state(self.mass_kg, self.n_per_a, open_loop=open_loop)
        out = kernels.new_outputs(commands, every)
        table = self._map().copy()
        held = kernels.new_memory(1)[0]
        kernels.run_linear_motor(
            m, c, self.friction.numbers(), held, commands, table, every, finer * self._steps(), out
        )
        return out
