"""Parts that many tests of machines share."""

from rtec.axis import Limits
from rtec.injector import InjectorSettings, Processor, RealEdges, Timing
from rtec.predictors import UnidirectionalTable
from rtec.requester.pc_node import PcNode
from rtec.requester.settings import HandshakeSettings
from rtec.requester.supervision import SupervisionLimits

LIMITS = Limits(max_speed_mm_s=100.0, max_acceleration_mm_s2=500.0, rapid_mm_s=100.0)
SLOPE = UnidirectionalTable(positions_mm=[-1.0, 0.0, 9.0], errors_mm=[0.0, 0.0, 0.18], backlash_mm=0.0)
"""20 µm a millimetre."""


def box_of(design, real_edges=RealEdges.HOLD):
    """Return a box at the pace of the report's 8051."""
    return InjectorSettings(design=design, timing=Timing.of(design, Processor.MCS51), real_edges=real_edges)


def requester(design, predictor=SLOPE, **others):
    return PcNode(
        HandshakeSettings(), SupervisionLimits(), axis=1, predictor=predictor, count_mm=0.001,
        step_counts=design.step_counts, word_limit=design.word_limit, **others,
    )  # fmt: skip


def talk(station, pc, until_ps, look_ps=10**9, looked=lambda: None):
    """Run an axis and its PC, frames without delay; ``looked`` is called behind each look."""
    while station.now_ps < until_ps:
        for at_ps, frame in station.advance(until_ps=station.now_ps + look_ps):
            pc.receive(frame, at_ps=at_ps)
        if pc.due_ps <= station.now_ps:
            for frame in pc.turn(at_ps=station.now_ps):
                station.receive(frame)
        looked()
