"""Friction with memory: presliding and reversal spikes, the Stribeck fall, viscous friction that flattens."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rtec.axis.plants import _drive_kernels as kernels
from rtec.checks import number_within
from rtec.compiled import finite_array
from rtec.errors import ArgumentError

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """A generalised Maxwell-slip model of four elements.

    Raises
    ------
    ArgumentError
        A value outside its range, less static than Coulomb friction, or other than four distances.

    Notes
    -----
    Each element is a spring in series with a slider. All sliders together hold
    ``s(v) = coulomb + (static - coulomb) exp(-(v / stribeck)^2)``, in equal shares, and slip at once where they are
    asked for more. Viscous friction ``viscous v / (1 + (v / fade)^2)`` is added. Without speed dependence this is the
    Maxwell-slip (Prandtl-Ishlinskii) operator: loops close, and the way back turns where the way out did.

    References
    ----------
    F. Al-Bender, V. Lampaert, J. Swevers, "The generalized Maxwell-slip model", IEEE Trans. Autom. Control 50 (2005).

    Examples
    --------
    >>> Friction(static_n=19.5, coulomb_n=16.4).steady_n([0.0, 1000.0]).tolist()
    [19.5, 16.4]
    """

    static_n: float
    """Force that sets the axis in motion."""
    coulomb_n: float
    """Dry friction beyond the Stribeck speed."""
    stribeck_mm_s: float = 20.0
    viscous_n_s_m: float = 0.0
    fade_mm_s: float = 1e9
    """Speed at which viscous friction is half of what a linear one would be; it is largest there."""
    yield_um: tuple[float, ...] = (1.0, 3.0, 8.0, 20.0)
    """Ways from rest after which the elements slip."""

    def __post_init__(self) -> None:
        number_within("static_n", self.static_n, 0.0, 1e5, unit="N")
        number_within("coulomb_n", self.coulomb_n, 0.0, self.static_n, unit="N (static_n)")
        number_within("stribeck_mm_s", self.stribeck_mm_s, 0.01, 1e4)
        number_within("viscous_n_s_m", self.viscous_n_s_m, 0.0, 1e5, unit="N s/m")
        number_within("fade_mm_s", self.fade_mm_s, 1.0, 1e9)
        if len(self.yield_um) != kernels.ELEMENTS:
            raise ArgumentError("yield_um", f"{len(self.yield_um)} distances", f"{kernels.ELEMENTS} distances")
        for distance in self.yield_um:
            number_within("yield_um", distance, 0.1, 1e4)

    def steady_n(self, speed_mm_s: npt.ArrayLike) -> FloatArray:
        """Return the friction of steady motion at speeds without sign, in N."""
        v = np.abs(np.asarray(speed_mm_s, dtype=np.float64))
        dry = self.coulomb_n + (self.static_n - self.coulomb_n) * np.exp(-((v / self.stribeck_mm_s) ** 2))
        return np.asarray(dry + 1e-3 * self.viscous_n_s_m * v / (1.0 + (v / self.fade_mm_s) ** 2))

    def along_n(self, position_mm: npt.ArrayLike, speed_mm_s: npt.ArrayLike = 0.0) -> FloatArray:
        """Return the force against the motion along positions, shape (samples,), in N; it begins without a force."""
        way = np.diff(finite_array("position_mm", position_mm), prepend=np.ravel(position_mm)[:1])
        speed = np.broadcast_to(finite_array("speed_mm_s", speed_mm_s), way.shape).copy()
        force = np.empty(way.size)
        kernels.friction_along(self.numbers(), np.zeros(kernels.ELEMENTS), way, speed, force)
        return force

    @property
    def stiffness_n_mm(self) -> float:
        """Force a way at rest, before any element slips."""
        return float(self.numbers()[kernels.STIFFNESS :].sum())

    def numbers(self) -> FloatArray:
        """Return the row of numbers of the kernels."""
        share = 1.0 / kernels.ELEMENTS
        stiffness = [share * self.static_n / (1e-3 * distance) for distance in self.yield_um]
        viscous = 1e-3 * self.viscous_n_s_m
        dry = [self.coulomb_n, self.static_n - self.coulomb_n, 1.0 / self.stribeck_mm_s]
        return np.array([*dry, viscous, 1.0 / self.fade_mm_s, *[share] * kernels.ELEMENTS, *stiffness])
