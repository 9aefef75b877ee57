"""Physical effects: what each adds to the error of an axis or to the force of its drive, one effect per file.

An effect explains data (its columns are fitted) and produces them (its contribution is added): one truth. To add one,
write a file like ``backlash.py`` and put the effect in ``library.py``.
"""

from rtec.effects._build_up import BuildUpShape
from rtec.effects._heat import HeatShape, SensorShape
from rtec.effects.acceleration_lag import AccelerationLag
from rtec.effects.asymmetric_friction import AsymmetricFriction
from rtec.effects.backlash import Backlash
from rtec.effects.backlash_map import BacklashMap, ReversalMapShape
from rtec.effects.cogging import Cogging, CoggingShape
from rtec.effects.conditions import SAME, Conditions, Floats, distance_since_reversal
from rtec.effects.cosine import Cosine
from rtec.effects.coulomb import Coulomb
from rtec.effects.cyclic import Cyclic, CyclicShape
from rtec.effects.dead_path import DeadPath
from rtec.effects.drift import Drift
from rtec.effects.eccentricity import Eccentricity, EccentricityShape
from rtec.effects.force_map import ForceMap
from rtec.effects.force_offset import ForceOffset
from rtec.effects.frequency_grid import alias_limit, frequencies, highest_frequency, phases_seen, resolved_harmonics
from rtec.effects.gravity import Gravity, GravityShape
from rtec.effects.hysteresis import Hysteresis, HysteresisShape
from rtec.effects.inertia import Inertia
from rtec.effects.interpolation import Interpolation, InterpolationShape
from rtec.effects.library import CAPTURE_EFFECTS, LIBRARY, effect_named
from rtec.effects.load_friction import LoadFriction
from rtec.effects.lost_counts import LostCounts, StepShape
from rtec.effects.offset import Offset
from rtec.effects.pitch_map import MapShape, PitchMap
from rtec.effects.protocol import (
    Amplitude,
    Card,
    Effect,
    Observable,
    Over,
    Quantity,
    Rival,
    Shape,
    Tunable,
    Units,
    parameter,
)
from rtec.effects.quantisation import Quantisation, QuantisationShape
from rtec.effects.refraction import Refraction, refractivity
from rtec.effects.reversal_spike import ReversalSpike, SpikeShape
from rtec.effects.run_offset import RunOffset, RunShape
from rtec.effects.scale import Scale
from rtec.effects.servo_lag import ServoLag
from rtec.effects.stribeck import Stribeck, StribeckShape
from rtec.effects.thermal_growth import GrowthShape, ThermalGrowth
from rtec.effects.thermal_shift import ThermalShift
from rtec.effects.viscous import Viscous
from rtec.effects.warm_up import WarmShape, WarmUp
from rtec.effects.warm_up_growth import WarmUpGrowth
from rtec.effects.windup import Windup, WindupShape

__all__ = [
    "CAPTURE_EFFECTS",
    "LIBRARY",
    "SAME",
    "AccelerationLag",
    "Amplitude",
    "AsymmetricFriction",
    "Backlash",
    "BacklashMap",
    "BuildUpShape",
    "Card",
    "Cogging",
    "CoggingShape",
    "Conditions",
    "Cosine",
    "Coulomb",
    "Cyclic",
    "CyclicShape",
    "DeadPath",
    "Drift",
    "Eccentricity",
    "EccentricityShape",
    "Effect",
    "Floats",
    "ForceMap",
    "ForceOffset",
    "Gravity",
    "GravityShape",
    "GrowthShape",
    "HeatShape",
    "Hysteresis",
    "HysteresisShape",
    "Inertia",
    "Interpolation",
    "InterpolationShape",
    "LoadFriction",
    "LostCounts",
    "MapShape",
    "Observable",
    "Offset",
    "Over",
    "PitchMap",
    "Quantisation",
    "QuantisationShape",
    "Quantity",
    "Refraction",
    "ReversalMapShape",
    "ReversalSpike",
    "Rival",
    "RunOffset",
    "RunShape",
    "Scale",
    "SensorShape",
    "ServoLag",
    "Shape",
    "SpikeShape",
    "StepShape",
    "Stribeck",
    "StribeckShape",
    "ThermalGrowth",
    "ThermalShift",
    "Tunable",
    "Units",
    "Viscous",
    "WarmShape",
    "WarmUp",
    "WarmUpGrowth",
    "Windup",
    "WindupShape",
    "alias_limit",
    "distance_since_reversal",
    "effect_named",
    "frequencies",
    "highest_frequency",
    "parameter",
    "phases_seen",
    "refractivity",
    "resolved_harmonics",
]
