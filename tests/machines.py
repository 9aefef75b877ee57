"""Parts that many tests of machines share."""

from rtec.axis import Limits
from rtec.injector import InjectorSettings, Processor, RealEdges, Timing
from rtec.predictors import UnidirectionalTable

LIMITS = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
SLOPE = UnidirectionalTable(positions_mm=[-1.0, 0.0, 9.0], errors_mm=[0.0, 0.0, 0.18], backlash_mm=0.0)
"""20 µm a millimetre."""


def box_of(design, real_edges=RealEdges.HOLD):
    """Return a box at the pace of the report's 8051."""
    return InjectorSettings(design=design, timing=Timing.of(design, Processor.MCS51), real_edges=real_edges)
