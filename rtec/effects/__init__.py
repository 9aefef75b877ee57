"""Physical effects: what each adds to the error of an axis or to the force of its drive, one effect per file.

An effect explains data (its columns are fitted) and produces them (its contribution is added): one truth. To add one,
write a file like ``backlash.py``, with its card, put the effect in ``library.py``, and run ``tools/effects_page.py``.
"""

from rtec.effects._build_up import BuildUpShape
from rtec.effects._harmonics import WavesShape
from rtec.effects._heat import HeatShape
from rtec.effects.conditions import SAME, Conditions, Floats, distance_since_reversal
from rtec.effects.cyclic import CyclicShape
from rtec.effects.experiments import Rival
from rtec.effects.library import LIBRARY, Library, effect_named
from rtec.effects.pitch_map import MapShape
from rtec.effects.protocol import Amplitude, Card, Effect, Observable, Over, Quantity, Shape, Units

__all__ = [
    "LIBRARY",
    "SAME",
    "Amplitude",
    "BuildUpShape",
    "Card",
    "Conditions",
    "CyclicShape",
    "Effect",
    "Floats",
    "HeatShape",
    "Library",
    "MapShape",
    "Observable",
    "Over",
    "Quantity",
    "Rival",
    "Shape",
    "Units",
    "WavesShape",
    "distance_since_reversal",
    "effect_named",
]
