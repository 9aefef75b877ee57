"""Which effects may be confounded with each other, and the experiment that separates the two.

An experiment is one sentence for both of a pair, and what it asks of a plan.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType

from rtec.effects.conditions import Conditions


class Ask(enum.Enum):
    """What an experiment asks of a measuring plan, as far as a plan can say it."""

    FIVE_RUNS = "at least five runs"
    MORE_RUNS = "four times as many runs"
    BOTH_DIRECTIONS = "both directions"
    SPEEDS = "three speeds"
    CREEP = "creep, besides"
    AFTER_REVERSALS = "dense readings after reversals"
    COLD_AND_HOT = "the machine cold and hot in turn"
    OTHER_DAYS = "days of another air pressure"
    LOADS = "three loads"
    WHOLE_TURN = "a whole turn"
    THREE_HOURS = "at least three hours"
    IN_MOTION = "readings in motion, by short strokes"
    FINE_STEPS = "targets in steps of a twentieth of the shortest stated period"
    MORE_TARGETS = "twice as many targets"
    SHIFTED_TARGETS = "targets shifted from run to run"
    TEMPERATURES = "temperatures recorded"
    ZERO_KEPT = "the zero kept between two runs"


THREE_FEEDS = (
    "approach the same targets from both sides at three feeds, creep among them, and once so slowly that the axis "
    "stands before each reading: a lag shrinks with the feed, play stays"
)
AFTER_REVERSAL = (
    "after each reversal take readings a few hundredths of the wind-up distance apart until nothing changes any "
    "more: play is there at once, wind-up builds up, and a spike "
    "dies away"
)
INTERLEAVE = (
    "measure both directions in turn, at least five times, return to the datum target every few readings, and mix "
    "the order of the targets: a drift shows at the datum, a scale error does not"
)
COLD_AND_HOT = (
    "measure the same targets cold and hot with a temperature column from screw and scale: a map stays, what "
    "heat does follows the temperature"
)
REPEAT_CYCLES = (
    "repeat the whole cycle of both directions and check the index (reference mark) before and after each: lost "
    "counts stay lost after the next reversal, play comes back with every one"
)
INDEX_OFTEN = (
    "return to the index (reference mark) every few readings: lost counts show as one step of whole counts, a slow "
    "change shows at every return"
)
SECOND_INSTRUMENT = (
    "realign the laser with the axis at full travel and measure again, or measure with a second instrument: the same "
    "set-up cannot tell the two apart"
)
FRACTIONS_OF_SIGNAL = (
    "measure a few signal periods of the scale in steps of a twentieth of a period, then one screw turn in steps of "
    "a twentieth of a turn: each period shows in its own sweep only"
)
FINE_STEPS = (
    "move over two signal periods of the scale in steps of a twentieth of a period, with a second reference of finer "
    "resolution: rounding is a sawtooth of the recording's step, interpolation a smooth wave of the signal period"
)
LONGER = (
    "measure one target again and again for at least three hours, from a cold start: a warm-up levels off, a drift "
    "goes on"
)
OTHER_HEAT = (
    "let the machine cool down, or change the room's temperature, with time and temperature recorded: what heat "
    "does follows the temperature both ways, a warm-up follows the time since the start"
)
HOT_AT_BOTH_ENDS = (
    "measure targets close to the fixed bearing and far from it, cold and hot with the temperature recorded: growth "
    "is larger far from the bearing, a shift of the zero is the same everywhere"
)
COOL_AGAIN = (
    "let the machine cool down again and go on measuring one target, with time and temperature recorded: a shift by "
    "heat goes back with the temperature, a drift goes on and a step stays"
)
SEVERAL_TURNS = (
    "measure several turns in steps of a fraction of a turn, then move the encoder by half a turn against the shaft "
    "and repeat: eccentricity stays with the encoder, the error of gear or screw with the shaft"
)
PAST_A_TURN = (
    "measure a whole turn and go on into the next, in steps of a twentieth of a turn: what the encoder's disc does "
    "comes back there, a smooth error of the drive goes on"
)
MANY_REVERSALS = (
    "turn round at many positions along the axis, and after each reversal take readings close together: a map "
    "depends on where the axis is, wind-up on how far it has come since it turned"
)
TWO_STROKES = (
    "move with the same amplitude at two frequencies, or at constant speed: what follows the acceleration grows with "
    "the square of the frequency, what follows the position stays"
)
SEVERAL_SPEEDS = (
    "move at several constant speeds in both directions: dry friction is the same at each, and so is the way over "
    "which it builds up, viscous friction grows with the speed"
)
CREEP = (
    "move at constant speeds down to creep (a hundredth of the highest and less) in both directions: friction that "
    "falls as motion begins shows at creep only"
)
SPEEDS_EACH_WAY = (
    "move at several constant speeds in both directions and hold still between: a constant force is there at every "
    "speed and at rest, a difference by direction grows with the speed"
)
OVER_A_PERIOD = (
    "move at one creep speed over several pole pitches in both directions, or hold positions closely spaced: cogging "
    "comes back with the pitch and averages out, a constant force does not"
)
SEVERAL_LOADS = (
    "make the same moves with two or three loads, recorded in a column: friction that a load presses on grows with "
    "it, what seals and preload cause stays"
)
OTHER_WEATHER = (
    "measure again on a day of another air pressure, with pressure, air temperature and humidity recorded: what the "
    "air does to the laser's wavelength follows them, what heat does to the machine follows its temperature"
)
NEAR_AND_FAR = (
    "measure targets close to the laser and far from it on days of another air pressure: an error of the wavelength "
    "grows with the distance, that of a dead path is the same everywhere"
)
FAR_AND_WARM = (
    "measure targets close to the fixed bearing and far from it again and again from a cold start: growth is larger "
    "far from the bearing, a shift of the zero is the same everywhere"
)
SHORT_AND_LONG = (
    "move to and fro by short strokes within long ones, and read while the axis moves: hysteresis with memory draws "
    "small loops that close where they began, play and wind-up begin each of them anew"
)
ZERO_AGAIN = (
    "measure at least five runs, check the zero (index mark or datum target) at the beginning and the end of each, "
    "and set nothing anew between two of them: what changes only where something was set anew belongs to the run"
)
WHOLE_TURN = (
    "turn the axis slowly through a whole turn, or from stop to stop, in both directions: a weight gives one wave a "
    "turn, a constant force is the same everywhere, and what a cable or a spring does is no sine"
)
OTHER_WEIGHT = (
    "turn a rotary axis slowly through a whole turn: a weight gives one wave a turn, a constant force is the same "
    "everywhere; measure a linear axis again with another load, or inclined: a weight changes with it, the zero of "
    "the amplifier stays"
)
SPEEDS_OVER_ANGLES = (
    "turn over a wide range of angles at several speeds in both directions: a weight depends on the angle alone, "
    "friction on the speed and the direction alone"
)
SPEEDS_OF_SCREW = (
    "move at several constant speeds from creep to the highest: what a runout of the screw leaves grows until the "
    "position loop is too slow for it, and stays; what a torque ripple leaves falls again at high speed; an error of "
    "the scale is the same at each"
)

ASKS: Mapping[str, frozenset[Ask]] = MappingProxyType(
    {
        THREE_FEEDS: frozenset((Ask.SPEEDS, Ask.BOTH_DIRECTIONS, Ask.FIVE_RUNS)),
        AFTER_REVERSAL: frozenset((Ask.AFTER_REVERSALS, Ask.BOTH_DIRECTIONS, Ask.FIVE_RUNS)),
        INTERLEAVE: frozenset((Ask.BOTH_DIRECTIONS, Ask.FIVE_RUNS)),
        COLD_AND_HOT: frozenset((Ask.COLD_AND_HOT, Ask.FIVE_RUNS)),
        REPEAT_CYCLES: frozenset((Ask.BOTH_DIRECTIONS, Ask.FIVE_RUNS)),
        INDEX_OFTEN: frozenset((Ask.FIVE_RUNS,)),
        SECOND_INSTRUMENT: frozenset(),
        FRACTIONS_OF_SIGNAL: frozenset((Ask.FINE_STEPS,)),
        FINE_STEPS: frozenset(),
        LONGER: frozenset((Ask.THREE_HOURS, Ask.FIVE_RUNS)),
        OTHER_HEAT: frozenset((Ask.COLD_AND_HOT, Ask.FIVE_RUNS)),
        HOT_AT_BOTH_ENDS: frozenset((Ask.COLD_AND_HOT, Ask.FIVE_RUNS)),
        COOL_AGAIN: frozenset((Ask.COLD_AND_HOT, Ask.FIVE_RUNS)),
        SEVERAL_TURNS: frozenset(),
        PAST_A_TURN: frozenset((Ask.WHOLE_TURN,)),
        MANY_REVERSALS: frozenset((Ask.AFTER_REVERSALS, Ask.BOTH_DIRECTIONS, Ask.FIVE_RUNS)),
        TWO_STROKES: frozenset((Ask.SPEEDS, Ask.BOTH_DIRECTIONS)),
        SEVERAL_SPEEDS: frozenset((Ask.SPEEDS, Ask.BOTH_DIRECTIONS)),
        CREEP: frozenset((Ask.SPEEDS, Ask.CREEP, Ask.BOTH_DIRECTIONS)),
        SPEEDS_EACH_WAY: frozenset((Ask.SPEEDS, Ask.BOTH_DIRECTIONS)),
        OVER_A_PERIOD: frozenset((Ask.SPEEDS, Ask.BOTH_DIRECTIONS)),
        SEVERAL_LOADS: frozenset((Ask.LOADS,)),
        OTHER_WEATHER: frozenset((Ask.OTHER_DAYS,)),
        NEAR_AND_FAR: frozenset((Ask.OTHER_DAYS,)),
        FAR_AND_WARM: frozenset((Ask.FIVE_RUNS,)),
        SHORT_AND_LONG: frozenset((Ask.IN_MOTION, Ask.SPEEDS, Ask.BOTH_DIRECTIONS)),
        ZERO_AGAIN: frozenset((Ask.FIVE_RUNS, Ask.BOTH_DIRECTIONS, Ask.ZERO_KEPT)),
        WHOLE_TURN: frozenset((Ask.WHOLE_TURN, Ask.SPEEDS, Ask.BOTH_DIRECTIONS)),
        OTHER_WEIGHT: frozenset((Ask.WHOLE_TURN, Ask.BOTH_DIRECTIONS)),
        SPEEDS_OVER_ANGLES: frozenset((Ask.WHOLE_TURN, Ask.SPEEDS, Ask.BOTH_DIRECTIONS)),
        SPEEDS_OF_SCREW: frozenset((Ask.SPEEDS, Ask.CREEP, Ask.BOTH_DIRECTIONS)),
    }
)
"""What each experiment asks of a measuring plan; nothing where no plan can say it, but a person can do it."""


@dataclass(frozen=True, slots=True)
class Rival:
    """An effect that it may be confounded with, and what to measure to separate the two."""

    name: str
    experiment: str
    permanent: bool = False
    """The two are not identifiable from each other with the same instrument."""
    on_lengths: bool = False
    """Permanent on a linear axis, where the columns of the two are the same."""
    limit: bool = False
    """The effect is a limit of this rival, which therefore explains as much: where it explains hardly more, it is not
    preferred."""

    def lasts(self, conditions: Conditions) -> bool:
        """Return whether no other measurement of this kind can separate the two.

        Examples
        --------
        >>> import numpy as np
        >>> c = Conditions(position=np.zeros(2), position_unit="mm", run=np.ones(2, dtype=np.int64))
        >>> Rival("gravity", "tilt the axis", on_lengths=True).lasts(c)
        True
        """
        return self.permanent or (self.on_lengths and conditions.position_unit == "mm")


CONFOUNDED: tuple[tuple[str, Rival], ...] = (
    ("scale", Rival("cosine", SECOND_INSTRUMENT, permanent=True)),
    ("scale", Rival("drift", INTERLEAVE)),
    ("pitch_map", Rival("thermal_growth", COLD_AND_HOT)),
    ("scale", Rival("thermal_growth", COLD_AND_HOT)),
    ("cyclic", Rival("interpolation", FRACTIONS_OF_SIGNAL)),
    ("cyclic", Rival("eccentricity", SEVERAL_TURNS)),
    ("pitch_map", Rival("eccentricity", PAST_A_TURN)),
    ("backlash", Rival("servo_lag", THREE_FEEDS)),
    ("backlash", Rival("windup", AFTER_REVERSAL, limit=True)),  # over less than the way to the first reading
    ("backlash", Rival("lost_counts", REPEAT_CYCLES)),
    ("backlash_map", Rival("windup", MANY_REVERSALS)),
    ("windup", Rival("reversal_spike", AFTER_REVERSAL)),
    ("backlash", Rival("reversal_spike", AFTER_REVERSAL)),
    ("backlash_map", Rival("reversal_spike", MANY_REVERSALS)),
    ("windup", Rival("hysteresis", SHORT_AND_LONG)),
    ("backlash", Rival("hysteresis", SHORT_AND_LONG)),
    ("reversal_spike", Rival("hysteresis", SHORT_AND_LONG)),
    ("warm_up", Rival("drift", LONGER)),
    ("thermal_growth", Rival("warm_up", OTHER_HEAT)),
    ("thermal_growth", Rival("thermal_shift", HOT_AT_BOTH_ENDS)),
    ("scale", Rival("thermal_shift", COLD_AND_HOT)),
    ("scale", Rival("acceleration_lag", TWO_STROKES)),
    ("thermal_shift", Rival("warm_up", OTHER_HEAT)),
    ("warm_up", Rival("warm_up_growth", FAR_AND_WARM)),
    ("thermal_growth", Rival("warm_up_growth", OTHER_HEAT)),
    ("thermal_shift", Rival("warm_up_growth", OTHER_HEAT)),
    ("scale", Rival("warm_up_growth", INTERLEAVE)),
    ("refraction", Rival("dead_path", NEAR_AND_FAR)),
    ("scale", Rival("refraction", OTHER_WEATHER)),
    ("thermal_growth", Rival("refraction", OTHER_WEATHER)),
    ("drift", Rival("lost_counts", INDEX_OFTEN)),
    ("thermal_shift", Rival("drift", COOL_AGAIN)),
    ("thermal_shift", Rival("lost_counts", COOL_AGAIN)),
    ("thermal_shift", Rival("dead_path", OTHER_WEATHER)),
    ("warm_up_growth", Rival("drift", LONGER)),
    ("refraction", Rival("drift", OTHER_WEATHER)),
    ("warm_up_growth", Rival("refraction", OTHER_WEATHER)),
    ("dead_path", Rival("drift", OTHER_WEATHER)),
    ("warm_up", Rival("dead_path", OTHER_WEATHER)),
    ("dead_path", Rival("lost_counts", OTHER_WEATHER)),
    ("run_offset", Rival("lost_counts", ZERO_AGAIN)),
    ("run_offset", Rival("drift", ZERO_AGAIN)),
    ("warm_up", Rival("run_offset", ZERO_AGAIN)),
    ("thermal_shift", Rival("run_offset", ZERO_AGAIN)),
    ("run_offset", Rival("dead_path", ZERO_AGAIN)),
    ("interpolation", Rival("quantisation", FINE_STEPS)),
    ("inertia", Rival("cogging", TWO_STROKES)),
    ("viscous", Rival("coulomb", SEVERAL_SPEEDS)),
    ("coulomb", Rival("stribeck", CREEP)),
    ("asymmetric_friction", Rival("force_offset", SPEEDS_EACH_WAY)),
    ("force_offset", Rival("cogging", OVER_A_PERIOD)),
    ("gravity", Rival("force_map", WHOLE_TURN)),
    ("force_offset", Rival("gravity", OTHER_WEIGHT, on_lengths=True)),
    ("viscous", Rival("gravity", SPEEDS_OVER_ANGLES)),
    ("viscous", Rival("force_offset", SPEEDS_EACH_WAY)),
    ("coulomb", Rival("gravity", SPEEDS_OVER_ANGLES)),
    ("inertia", Rival("gravity", TWO_STROKES)),
    ("inertia", Rival("force_map", TWO_STROKES)),
    ("coulomb", Rival("load_friction", SEVERAL_LOADS)),
    ("screw_runout", Rival("torque_ripple", SPEEDS_OF_SCREW)),
    ("screw_runout", Rival("cyclic", SPEEDS_OF_SCREW)),
    ("torque_ripple", Rival("cyclic", SPEEDS_OF_SCREW)),
)
"""Each pair once; an effect looks at its rivals in this order."""


@cache
def rivals() -> Mapping[str, tuple[Rival, ...]]:
    """Return the rivals of each effect that has any, by its name: a pair counts for both.

    Examples
    --------
    >>> [one.name for one in rivals()["servo_lag"]]
    ['backlash']
    """
    found: dict[str, list[Rival]] = {}
    for name, one in CONFOUNDED:
        found.setdefault(name, []).append(one)
        found.setdefault(one.name, []).append(replace(one, name=name, limit=False))
    return {name: tuple(several) for name, several in found.items()}


def rival(name: str, other: str) -> Rival | None:
    """Return what separates the effect ``name`` from ``other``, or None where they are not confounded."""
    return next((one for one in rivals().get(name, ()) if one.name == other), None)
