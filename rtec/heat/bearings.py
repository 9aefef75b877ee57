"""Where the heat of a machine comes from and where it goes: bearings, oils, motors and slides, convection."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.heat._network_kernels import COLDEST_DEGC, HEAT_W, HOTTEST_DEGC, LAMINAR

AIR_W_M_K, AIR_MM2_S, AIR_PRANDTL = 0.026, 15.7, 0.71
"""Conductivity, kinematic viscosity and Prandtl number of air at 25 degC."""
_KELVIN = 273.15


@dataclass(frozen=True, slots=True, kw_only=True)
class Oil:
    """A lubricant by its viscosity at two temperatures, as its data sheet gives it.

    Parameters
    ----------
    at_40_mm2_s, at_100_mm2_s
        Kinematic viscosity at 40 and at 100 degC; the default is a mineral oil ISO VG 32 with a viscosity index near
        100.

    Raises
    ------
    ArgumentError
        A viscosity at 100 degC that is not below that at 40 degC, or outside 1 to 5000 mm2/s.

    Notes
    -----
    Walther's equation, log10 log10 (nu + 0.7) = A - B log10 T with T in kelvin (ASTM D341). The number of a viscosity
    class is that at 40 degC (ISO 3448).

    Examples
    --------
    >>> [round(Oil().viscosity_mm2_s(degc), 1) for degc in (20.0, 40.0, 60.0, 100.0)]
    [86.3, 32.0, 15.2, 5.4]
    """

    at_40_mm2_s: float = 32.0
    at_100_mm2_s: float = 5.4

    def __post_init__(self) -> None:
        for name in ("at_40_mm2_s", "at_100_mm2_s"):
            number_within(name, getattr(self, name), 1.0, 5000.0, unit="mm2/s")
        if self.at_100_mm2_s >= self.at_40_mm2_s:
            raise ArgumentError("at_100_mm2_s", self.at_100_mm2_s, f"less than the {self.at_40_mm2_s:g} at 40 degC")

    @property
    def constants(self) -> tuple[float, float]:
        """A and B of ln ln (nu + 0.7) = A - B ln T."""
        thick, thin = (math.log(math.log(nu + 0.7)) for nu in (self.at_40_mm2_s, self.at_100_mm2_s))
        b = (thick - thin) / math.log((100.0 + _KELVIN) / (40.0 + _KELVIN))
        return thick + b * math.log(40.0 + _KELVIN), b

    def viscosity_mm2_s(self, degc: float) -> float:
        """Return the kinematic viscosity at a temperature; beyond -40 and 200 degC it stays as it is there."""
        a, b = self.constants
        kelvin = min(max(degc, COLDEST_DEGC), HOTTEST_DEGC) + _KELVIN
        return math.exp(math.exp(a - b * math.log(kelvin))) - 0.7


@dataclass(frozen=True, slots=True, kw_only=True)
class Bearing:
    """A rolling bearing, or a set of equal ones, between two nodes of a network; half of its heat goes to each ring.

    Parameters
    ----------
    name
        Of the source of heat.
    inner, outer
        Nodes of its rings.
    mean_diameter_mm
        Of the circle on which the rolling elements run.
    f0, f1
        Factors of the oil and of the load: for a pair of bearings twice that of one. f0 is 1.7 to 2 for angular
        contact ball bearings with oil-air or grease.
    preload_n
        At equal temperature of the rings.
    preload_n_k
        By how much the preload rises for each kelvin that the inner ring is warmer than the outer one; it is never
        negative.
    force_share
        Of the cutting force that the bearing carries.
    oil
        Its viscosity is taken at the mean temperature of the rings.

    Notes
    -----
    Palmgren, with moments in N mm, viscosity nu in mm2/s, speed n in rev/min and the mean diameter dm in mm:

    - M0 = 1e-7 f0 (nu n)^(2/3) dm^3 where nu n >= 2000, else 160e-7 f0 dm^3
    - M1 = f1 F dm
    - heat = 1.047e-4 n (M0 + M1) in W

    Oil becomes thin as the bearing warms, so the heat falls: negative feedback. The inner ring becomes warmer than
    the outer one, so the preload and the heat rise: positive feedback.

    References
    ----------
    A. Palmgren, Ball and roller bearing engineering, 3rd ed. (1959). T. A. Harris, M. N. Kotzalas, Rolling bearing
    analysis, 5th ed. (2006), bearing friction. B. Bossmanns, J. F. Tu, A thermal model for high speed motorized
    spindles, International Journal of Machine Tools and Manufacture 39 (1999) 1345: preload by temperature.

    Examples
    --------
    >>> front = Bearing(name="front", inner="a", outer="b", mean_diameter_mm=60.0, f0=2.0, f1=0.00035)
    >>> [round(front.heat_w(rpm, viscosity_mm2_s=20.0)) for rpm in (1250, 2500, 5000, 10_000, 20_000)]
    [5, 16, 51, 159, 500]
    """

    name: str
    inner: str
    outer: str
    mean_diameter_mm: float
    f0: float = 2.0
    f1: float = 0.00035
    preload_n: float = 200.0
    preload_n_k: float = 0.0
    force_share: float = 0.0
    oil: Oil = Oil()

    def __post_init__(self) -> None:
        limits = {"mean_diameter_mm": (1.0, 2000.0, "mm"), "f0": (0.0, 100.0, ""), "f1": (0.0, 1.0, ""),
                  "preload_n": (0.0, 1e6, "N"), "preload_n_k": (0.0, 1e4, "N/K"),
                  "force_share": (0.0, 10.0, "")}  # fmt: skip
        for field, (low, high, unit) in limits.items():
            number_within(f"bearing {self.name}: {field}", getattr(self, field), low, high, unit=unit)

    def moments_nmm(self, rpm: float, *, viscosity_mm2_s: float, load_n: float | None = None) -> tuple[float, float]:
        """Return M0 and M1 at a speed, a viscosity and a load: the preload where none is given."""
        warm = viscosity_mm2_s * abs(rpm)
        fluid = 1e-7 * warm ** (2.0 / 3.0) if warm >= LAMINAR else 160e-7
        load = self.preload_n if load_n is None else load_n
        return self.f0 * fluid * self.mean_diameter_mm**3, self.f1 * load * self.mean_diameter_mm

    def heat_w(self, rpm: float, *, viscosity_mm2_s: float, load_n: float | None = None) -> float:
        """Return the heat at a speed, a viscosity and a load: the preload where none is given."""
        oil, load = self.moments_nmm(rpm, viscosity_mm2_s=viscosity_mm2_s, load_n=load_n)
        return HEAT_W * abs(rpm) * (oil + load)


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss:
    """Heat of a motor, a drive, a nut or a guide.

    Parameters
    ----------
    name
        Of the source of heat.
    node
        Whose temperature counts, and which gets ``share`` of the heat.
    other
        Node that gets the rest; empty: all goes to ``node``.
    share
        0 to 1.
    of_feed
        Whether its speed is that of the feed in mm/s instead of the spindle's in rev/min.
    per_speed_w
        W for each unit of speed: hysteresis of iron, dry friction (1 N at 1 mm/s is 0.001 W).
    per_speed2_w
        W for each unit of speed squared: eddy currents, viscous friction.
    force2_w
        W at 20 degC for each N2 of cutting force, while the speed is not 0: copper, as the current follows the load.
    oil
        With one, ``per_speed2_w`` holds at 40 degC and follows its viscosity.

    Notes
    -----
    heat = v (a + b v nu(T) / nu(40)) + c F^2 (1 + 0.00393 (T - 20)): iron of motors after Steinmetz with hysteresis
    proportional to the frequency and eddy currents to its square; resistance of copper after IEC 60028.

    Examples
    --------
    >>> Loss(name="iron", node="stator", per_speed_w=0.03, per_speed2_w=6e-6).heat_w(5000.0, 40.0)
    300.0
    """

    name: str
    node: str
    other: str = ""
    share: float = 1.0
    of_feed: bool = False
    per_speed_w: float = 0.0
    per_speed2_w: float = 0.0
    force2_w: float = 0.0
    oil: Oil | None = None

    def __post_init__(self) -> None:
        for field, high in (("share", 1.0), ("per_speed_w", 1e4), ("per_speed2_w", 1e4), ("force2_w", 1e4)):
            number_within(f"loss {self.name}: {field}", getattr(self, field), 0.0, high)

    def heat_w(self, speed: float, degc: float, force_n: float = 0.0) -> float:
        """Return the heat at a speed, a temperature of its node and a cutting force."""
        v = abs(speed)
        thick = 1.0 if self.oil is None else self.oil.viscosity_mm2_s(degc) / self.oil.at_40_mm2_s
        copper = self.force2_w * force_n**2 * (1.0 + 0.00393 * (degc - 20.0)) if v > 0.0 else 0.0
        return v * (self.per_speed_w + self.per_speed2_w * v * thick) + copper


def rotating_w_m2_k(diameter_mm: float, rpm: float) -> float:
    """Return the heat transfer of a cylinder that rotates in air, in W/(m2 K).

    Notes
    -----
    Nu = 0.133 Re^(2/3) Pr^(1/3) with Re = u d / nu (B. Bossmanns, J. F. Tu 1999).

    Examples
    --------
    >>> [round(rotating_w_m2_k(100.0, rpm), 1) for rpm in (1000.0, 5000.0)]
    [32.0, 93.5]
    """
    speed_mm_s = math.pi * diameter_mm * abs(rpm) / 60.0
    nusselt: float = 0.133 * (speed_mm_s * diameter_mm / AIR_MM2_S) ** (2.0 / 3.0) * AIR_PRANDTL ** (1.0 / 3.0)
    return nusselt * AIR_W_M_K / (diameter_mm * 1e-3)


def jacket_w_m2_k(diameter_mm: float, flow_l_min: float, *, glycol: bool = False) -> float:
    """Return the heat transfer in the channel of a cooling jacket, in W/(m2 K).

    Parameters
    ----------
    diameter_mm
        Hydraulic diameter of the channel.
    flow_l_min
        Through it.
    glycol
        Whether it is water with 30 % of ethylene glycol instead of water, at 20 degC.

    Raises
    ------
    ArgumentError
        A flow that is not turbulent: Re below 10 000.

    Notes
    -----
    Dittus-Boelter for a fluid that is heated: Nu = 0.023 Re^0.8 Pr^0.4 (F. P. Incropera, D. P. DeWitt, Fundamentals
    of heat and mass transfer, internal flow).

    Examples
    --------
    >>> round(jacket_w_m2_k(10.0, 8.0), -2)
    7300.0
    """
    conductivity, viscosity_mm2_s, prandtl = (0.49, 2.2, 16.5) if glycol else (0.60, 1.0, 7.0)
    speed_mm_s = flow_l_min * 1e6 / 60.0 / (math.pi / 4.0 * diameter_mm**2)
    reynolds = speed_mm_s * diameter_mm / viscosity_mm2_s
    if reynolds < 1e4:
        raise ArgumentError("flow_l_min", flow_l_min, "more flow or a narrower channel", f"Re is {reynolds:.0f}",
                            problem="is not turbulent")  # fmt: skip
    nusselt: float = 0.023 * reynolds**0.8 * prandtl**0.4
    return nusselt * conductivity / (diameter_mm * 1e-3)
