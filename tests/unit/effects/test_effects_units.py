"""Units in which people read amplitudes and shapes."""

import pytest

from rtec.effects import HeatShape, Shape, Units
from rtec.effects.lost_counts import LostCounts, StepShape
from rtec.effects.offset import Offset
from rtec.effects.scale import scale
from rtec.effects.stribeck import Stribeck, StribeckShape
from rtec.effects.thermal_growth import GrowthShape, ThermalGrowth
from rtec.effects.thermal_shift import ThermalShift
from rtec.effects.warm_up import WarmShape, WarmUp

LINEAR, ROTARY = Units("mm", "mm", "s"), Units("deg", "deg", "reading")


@pytest.mark.parametrize(
    "effect, shape, units, unit, factor",
    [
        (Offset(), Shape(), LINEAR, "um", 1e3),
        (scale, Shape(), LINEAR, "um/m", 1e6),
        (scale, Shape(), ROTARY, "arcsec/deg", 3600.0),
        (scale, Shape(), Units("deg", "s", "s"), "arcsec/s", 3600.0),
        (scale, Shape(), Units("mm", "deg", "s"), "um/deg", 1e3),
        (ThermalGrowth(), GrowthShape(), LINEAR, "um/m/K", 1e6),
        (ThermalGrowth(), GrowthShape(), ROTARY, "arcsec/deg/K", 3600.0),
        (ThermalShift(), HeatShape(), LINEAR, "um/K", 1e3),
        (LostCounts(), StepShape(), ROTARY, "arcsec", 3600.0),
        (Stribeck(), StribeckShape(), Units("n", "mm", "s"), "N", 1.0),
    ],
)
def test_units_of_an_amplitude(effect, shape, units, unit, factor):
    (amplitude,) = effect.amplitudes(shape, units)
    assert (amplitude.unit, amplitude.factor) == (unit, factor)


@pytest.mark.parametrize(
    "effect, shape, units, lines",
    [
        (scale, Shape(), LINEAR, (("scale", pytest.approx(20.0), "um/m"),)),
        (WarmUp(), WarmShape(600.0), LINEAR, (("time_constant", 600.0, "s"), ("final", pytest.approx(0.02), "um"))),
        (
            LostCounts(),
            StepShape(7.5),
            ROTARY,
            (("moment", 7.5, "reading"), ("step", pytest.approx(0.072), "arcsec")),
        ),
        (
            Stribeck(),
            StribeckShape(0.3, speed=5.0),
            Units("n", "mm", "s"),
            (("distance", 0.3, "mm"), ("speed", 5.0, "mm/s"), ("stribeck", pytest.approx(20e-6), "N")),
        ),
        (ThermalGrowth(), GrowthShape(), LINEAR, (("expansion", pytest.approx(20.0), "um/m/K"),)),
    ],
)
def test_what_people_read(effect, shape, units, lines):
    assert effect.summary(shape, [20e-6], units) == lines


def test_as_many_amplitudes_as_the_shape_has():
    with pytest.raises(ValueError, match="argument 2"):
        scale.summary(Shape(), [1.0, 2.0], LINEAR)
