from rtec.effects.conditions import Conditions, distance_since_reversal
from rtec.effects.offset import Offset
from rtec.effects.scale import Scale
from rtec.effects.drift import Drift
from rtec.effects.backlash import Backlash
from rtec.effects.pitch_map import PitchMap, BacklashMap
from rtec.effects.cyclic import Cyclic
from rtec.effects.timed import *
from rtec.effects.conditions import Floats
from rtec.effects.protocol import *
