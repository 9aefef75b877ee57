"""The library: every effect of an axis and of a drive, by name."""

from __future__ import annotations

from types import MappingProxyType

from rtec.effects.acceleration_lag import AccelerationLag
from rtec.effects.asymmetric_friction import AsymmetricFriction
from rtec.effects.backlash import Backlash
from rtec.effects.backlash_map import BacklashMap
from rtec.effects.cogging import Cogging
from rtec.effects.cosine import Cosine
from rtec.effects.coulomb import Coulomb
from rtec.effects.cyclic import Cyclic
from rtec.effects.dead_path import DeadPath
from rtec.effects.drift import Drift
from rtec.effects.eccentricity import Eccentricity
from rtec.effects.force_map import ForceMap
from rtec.effects.force_offset import ForceOffset
from rtec.effects.gravity import Gravity
from rtec.effects.hysteresis import Hysteresis
from rtec.effects.inertia import Inertia
from rtec.effects.interpolation import Interpolation
from rtec.effects.load_friction import LoadFriction
from rtec.effects.lost_counts import LostCounts
from rtec.effects.offset import Offset
from rtec.effects.pitch_map import PitchMap
from rtec.effects.protocol import Effect
from rtec.effects.quantisation import Quantisation
from rtec.effects.refraction import Refraction
from rtec.effects.reversal_spike import ReversalSpike
from rtec.effects.run_offset import RunOffset
from rtec.effects.scale import Scale
from rtec.effects.servo_lag import ServoLag
from rtec.effects.stribeck import Stribeck
from rtec.effects.thermal_growth import ThermalGrowth
from rtec.effects.thermal_shift import ThermalShift
from rtec.effects.viscous import Viscous
from rtec.effects.warm_up import WarmUp
from rtec.effects.warm_up_growth import WarmUpGrowth
from rtec.effects.windup import Windup
from rtec.errors import ArgumentError, nearest

LIBRARY: tuple[Effect, ...] = (
    Offset(),
    Scale(),
    PitchMap(),
    Cyclic(),
    Backlash(),
    BacklashMap(),
    Windup(),
    ReversalSpike(),
    Hysteresis(),
    ThermalGrowth(),
    ThermalShift(),
    WarmUp(),
    WarmUpGrowth(),
    RunOffset(),
    Refraction(),
    DeadPath(),
    Drift(),
    ServoLag(),
    AccelerationLag(),
    Interpolation(),
    Eccentricity(),
    LostCounts(),
    Quantisation(),
    Cosine(),
    Inertia(),
    Viscous(),
    Coulomb(),
    AsymmetricFriction(),
    Stribeck(),
    ForceOffset(),
    Cogging(),
    Gravity(),
    ForceMap(),
    LoadFriction(),
)
"""One of each effect: those of the position's deviation, then those of a drive."""

CAPTURE_EFFECTS = ("phase_error", "duty_error", "jitter", "glitch", "bounce", "missed_edge", "skew")
"""Names of effects that belong to captures of A/B signals, not to measurements of an axis."""

_BY_NAME = MappingProxyType({effect.name: effect for effect in LIBRARY})


def effect_named(name: str) -> Effect:
    """Return the effect of a name.

    Raises
    ------
    ArgumentError
        No such effect, with the nearest name; or one that belongs to captures of A/B signals.

    Examples
    --------
    >>> effect_named("backlash").needs
    'both directions'
    >>> effect_named("viscos")
    Traceback (most recent call last):
    ...
    rtec.errors.ArgumentError: effect: 'viscos' is not an effect; use a name of the library; did you mean 'viscous'?
    """
    if name in _BY_NAME:
        return _BY_NAME[name]
    if name in CAPTURE_EFFECTS:
        hint = f"{name} belongs to captures of A/B signals, which hold edges and no positions"
        raise ArgumentError("effect", name, "an effect of an axis or of a drive", hint)
    hint = nearest(name[:60], _BY_NAME)
    raise ArgumentError("effect", repr(name[:60]), "a name of the library", hint, problem="is not an effect")
