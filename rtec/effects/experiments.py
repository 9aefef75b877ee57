"""Experiments that separate confounded effects: one sentence for both of a pair, and what it asks of a plan."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from types import MappingProxyType


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
    }
)
"""What each experiment asks of a measuring plan; nothing where no plan can say it, but a person can do it."""
