"""The library: every effect of an axis and of a drive, by name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from rtec.effects.acceleration_lag import acceleration_lag
from rtec.effects.asymmetric_friction import AsymmetricFriction
from rtec.effects.backlash import backlash
from rtec.effects.backlash_map import BacklashMap
from rtec.effects.cogging import Cogging
from rtec.effects.cosine import Cosine
from rtec.effects.coulomb import Coulomb
from rtec.effects.curve import PREFIX as CURVE, Curve
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
from rtec.effects.scale import scale
from rtec.effects.screw_runout import ScrewRunout
from rtec.effects.servo_lag import servo_lag
from rtec.effects.stribeck import Stribeck
from rtec.effects.thermal_growth import ThermalGrowth
from rtec.effects.thermal_shift import ThermalShift
from rtec.effects.torque_ripple import TorqueRipple
from rtec.effects.viscous import Viscous
from rtec.effects.warm_up import WarmUp
from rtec.effects.warm_up_growth import WarmUpGrowth
from rtec.effects.windup import Windup
from rtec.errors import ArgumentError, nearest


@dataclass(frozen=True)
class Library:
    """Effects by name: those that come with rtec, and beside them those that somebody wrote.

    Examples
    --------
    >>> [effect.name for effect in LIBRARY][:3], LIBRARY.named("backlash").needs
    (['offset', 'scale', 'pitch_map'], 'both directions')
    """

    effects: tuple[Effect, ...]
    own: tuple[Effect, ...] = ()

    def __iter__(self) -> Iterator[Effect]:
        return iter((*self.effects, *self.own))

    def __len__(self) -> int:
        return len(self.effects) + len(self.own)

    @cached_property
    def _by_name(self) -> dict[str, Effect]:
        return {effect.name: effect for effect in self}

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def named(self, name: str) -> Effect:
        """Return the effect of a name.

        Raises
        ------
        ArgumentError
            No such effect, with the nearest name; or one that belongs to captures of A/B signals.

        Examples
        --------
        >>> LIBRARY.named("viscos")  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        rtec.errors.ArgumentError: effect: 'viscos' is not an effect; ... did you mean 'viscous'?
        """
        if name in self:
            return self._by_name[name]
        what, colon, over = name.partition(":")
        if what == CURVE:  # learned, and no name
            return Curve(over) if colon else Curve()
        for effect in OF_LOOP:  # looked for where a model of motion knows the rest
            if effect.name == name:
                return effect
        if name in CAPTURE_EFFECTS:
            hint = f"{name} belongs to captures of A/B signals, which hold edges and no positions"
            raise ArgumentError("effect", name, "an effect of an axis or of a drive", hint)
        hint = nearest(name[:60], self._by_name)
        raise ArgumentError("effect", repr(name[:60]), "a name of the library", hint, problem="is not an effect")

    def with_own(self, own: Sequence[Effect]) -> Library:
        """Return the library with effects that somebody wrote.

        Raises
        ------
        ArgumentError
            One has the name of another, or of one that comes with rtec.

        Examples
        --------
        >>> LIBRARY.with_own([]) is LIBRARY
        True
        """
        found: list[Effect] = [*self.own]
        for effect in own:
            if effect in found:
                continue
            if effect.name in (*CAPTURE_EFFECTS, CURVE) or effect.name in {
                one.name for one in (*self.effects, *found)
            }:
                whose = "comes with rtec" if effect.name in {one.name for one in self.effects} else "is there already"
                allowed = "a name of its own"
                raise ArgumentError("effect", effect.name, allowed, problem=f"has the name of an effect that {whose}")
            found.append(effect)
        return Library(self.effects, tuple(found)) if len(found) > len(self.own) else self


LIBRARY = Library(
    (
        Offset(),
        scale,
        PitchMap(),
        Cyclic(),
        backlash,
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
        servo_lag,
        acceleration_lag,
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
)
"""One of each effect: those of the position's deviation, then those of a drive."""

OF_LOOP: tuple[Effect, ...] = (ScrewRunout(), TorqueRipple())
"""What the position loop answers: looked for in what a model of motion leaves, where the loop itself is known."""

CAPTURE_EFFECTS = ("phase_error", "duty_error", "jitter", "glitch", "bounce", "missed_edge", "skew")
"""Names of effects that belong to captures of A/B signals, not to measurements of an axis."""

effect_named = LIBRARY.named
"""Return an effect that comes with rtec by its name; see `Library.named`."""
