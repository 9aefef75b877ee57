"""The phases of a machine's operation in which faults are injected, each a short program of two axes."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rtec.axis.command import Move
from rtec.errors import unknown
from rtec.injector import Design
from rtec.link.simulated import FaultActivation
from rtec.machine.fault_kinds import ActivatedBy
from rtec.machine.faults import Fault, Trigger
from rtec.machine.station_settings import InBox, StationSettings
from rtec.predictors import Predictor
from rtec.requester.supervision import SupervisionLimits
from rtec.units import PS_PER_MS, PS_PER_US
from rtec.verify.safety.monitor import SLICE_PS, AxisThen, MonitoredCell, sinusoidal_table, station_settings

END_PS = 8_000 * PS_PER_MS
_AFTER_STOP_PS = 400 * PS_PER_MS
"""A held machine is monitored for so long: the feed takes 50 ms to come down, the axis a little longer."""
_HOT_MM = 0.060
_FOR_GOOD_S = 1000.0


class Phase(enum.Enum):
    """What the machine is doing when the fault is injected at axis 1; axis 2 goes on cutting."""

    START_UP = "start-up"
    """Homing: switched on, the box takes its home, the PC waits for it."""
    AT_REST = "at rest"
    CUTTING = "cutting"
    """At 2 mm/s, with a correction every 100 ms or so."""
    RAPID = "rapid"
    """At 7 m/min, where the speed gate refuses."""
    REVERSAL = "reversal"
    INSERTION = "insertion"
    """The exchange and the pulses of one correction."""
    PROBING = "probing"
    LARGE = "large correction"
    """The table of a hot machine, 60 um away, comes at once under the flag Large Correction."""

    @classmethod
    def named(cls, text: str) -> Phase:
        """Return the phase of a name, with spaces or hyphens, in any case of letters.

        Raises
        ------
        ArgumentError
            Another name.

        Examples
        --------
        >>> Phase.named("at-rest")
        <Phase.AT_REST: 'at rest'>
        """
        known = {hyphened(phase.value): phase for phase in cls}
        if (word := hyphened(text)) not in known:
            raise unknown("phase", text, known, noun="phase")
        return known[word]


class Order(enum.Enum):
    """What the operator does."""

    PROBE = "probe"
    CUT = "cut"
    LARGE = "large correction"


Orders = list[tuple[int, Order]]
"""What he does at which time, ps."""


def hyphened(text: str) -> str:
    """Return a name in words as one word of a command line.

    Examples
    --------
    >>> hyphened("PC killed")
    'pc-killed'
    """
    return "-".join(text.lower().split())


@dataclass(frozen=True, slots=True, kw_only=True)
class Twin:
    """A fault-free run of a phase, and when its phase is."""

    cell: MonitoredCell
    moment_ps: int
    """First moment at which a fault is within the phase."""
    span_ps: int
    """For how long it is."""


def moves_of(phase: Phase, seed: int) -> list[list[Move]]:
    """Return the programs of both axes; the seed moves the ends by 0 to 3 counts, so that rests meet every state."""
    by_mm = 0.001 * (seed % 4)
    end = Move(target_mm=6.0 + by_mm, speed_mm_s=2.0, rest_s=_FOR_GOOD_S)
    cut = Move(target_mm=2.0 + by_mm, speed_mm_s=2.0, rest_s=0.0)
    programs = {
        Phase.START_UP: [Move(target_mm=0.0, speed_mm_s=2.0, rest_s=0.3), end],
        Phase.AT_REST: [Move(target_mm=2.0 + by_mm, speed_mm_s=2.0, rest_s=2.0), end],
        Phase.CUTTING: [Move(target_mm=9.0 + by_mm, speed_mm_s=2.0, rest_s=_FOR_GOOD_S)],
        Phase.RAPID: [
            Move(target_mm=1.0, speed_mm_s=2.0),
            Move(target_mm=101.0 + by_mm, speed_mm_s=117.0),
            Move(target_mm=104.0 + by_mm, speed_mm_s=2.0, rest_s=_FOR_GOOD_S),
        ],
        Phase.REVERSAL: [
            Move(target_mm=3.0 + by_mm, speed_mm_s=2.0),
            Move(target_mm=0.5 + by_mm, speed_mm_s=2.0),
            Move(target_mm=3.5 + by_mm, speed_mm_s=2.0, rest_s=_FOR_GOOD_S),
        ],
        Phase.INSERTION: [Move(target_mm=9.0 + by_mm, speed_mm_s=2.0, rest_s=_FOR_GOOD_S)],
        Phase.PROBING: [cut, Move(target_mm=2.0 + by_mm, speed_mm_s=2.0, rest_s=0.4), end],
        Phase.LARGE: [Move(target_mm=0.0 + by_mm, speed_mm_s=2.0, rest_s=2.0), end],
    }
    other = [
        Move(target_mm=3.0, speed_mm_s=2.0, rest_s=0.05),
        Move(target_mm=0.5, speed_mm_s=1.5, rest_s=0.05),
        Move(target_mm=4.0 + by_mm, speed_mm_s=2.0, rest_s=_FOR_GOOD_S),
    ]
    return [programs[phase], other]


def new_cell(
    phase: Phase,
    design: Design,
    seed: int,
    *,
    faults: tuple[Fault, ...] = (),
    supervision: SupervisionLimits | None = None,
    algorithm: InBox | None = None,
) -> MonitoredCell:
    """Return a machine of two axes that is about to run a phase's program."""
    return MonitoredCell(*cell_parts(phase, design, seed, supervision, algorithm), faults=faults)


def cell_parts(
    phase: Phase,
    design: Design,
    seed: int,
    supervision: SupervisionLimits | None = None,
    algorithm: InBox | None = None,
) -> tuple[list[StationSettings], list[list[Move]], Predictor]:
    """Return axes, programs and table of such a machine."""
    stations = [station_settings(axis, design, supervision=supervision, algorithm=algorithm) for axis in (1, 2)]
    return stations, moves_of(phase, seed), sinusoidal_table()


def run_through(cell: MonitoredCell, phase: Phase, *, until_ps: int = END_PS) -> None:
    """Run a machine through its phase, the operator's part included; a held machine is left soon."""
    orders = [order for order in _ORDERS.get(phase, []) if order[0] < until_ps]
    for at_ps, order in (*orders, (until_ps, None)):
        cell.monitor(until_ps=at_ps, stop_after_ps=_AFTER_STOP_PS)
        if cell.now_ps < at_ps:
            break
        if order is not None:
            carry_out(cell, order, sinusoidal_table(offset_mm=_HOT_MM))
    if any(axis.stop_ps is not None for axis in cell.monitored):
        cell.settle()


def first_effect(cell: MonitoredCell, phase: Phase, activation: FaultActivation[Fault]) -> AxisThen | None:
    """Return when a fault first took effect, and what axis 1 was doing; None: it did not.

    The machine, which has been through the phase, is taken there once more. What a fault of lines or word has done is
    noted a look later; here looks come closer and closer.
    """
    fault, first_ps = activation.fault, activation.first_ps
    if first_ps is None:
        return None
    if fault.kind.activated_by in _NOTED_LATER and fault.trigger is Trigger.AT_ONCE:
        for wide_ps, close_ps in pairwise((SLICE_PS, *_CLOSER_PS)):
            cell.rewind()
            run_through(cell, phase, until_ps=max(first_ps - wide_ps, fault.from_ps))
            cell.monitor(until_ps=first_ps, slice_ps=close_ps)
            first_ps = cell.fired[cell.faults.index(fault)].first_ps or first_ps
    cell.rewind()
    run_through(cell, phase, until_ps=first_ps)
    return cell.axis_then(1)


_NOTED_LATER = (ActivatedBy.CABLE, ActivatedBy.WORD, ActivatedBy.GLITCHES, ActivatedBy.EDGES)
_CLOSER_PS = PS_PER_US, PS_PER_US // 100
_ORDERS: dict[Phase, Orders] = {
    Phase.PROBING: [(1_200 * PS_PER_MS, Order.PROBE), (4_200 * PS_PER_MS, Order.CUT)],
    Phase.LARGE: [(1_000 * PS_PER_MS, Order.LARGE)],
}


def carry_out(cell: MonitoredCell, order: Order, hot: Predictor) -> None:
    """Do what the operator does; ``hot`` is the prediction of the machine once it is hot."""
    if order is not Order.LARGE:
        cell.probe(order is Order.PROBE)
        return
    cell.predict_by(hot)
    cell.set_reference(hot)
    cell.allow_large_correction()


_MOMENTS = {
    Phase.AT_REST: (1_600 * PS_PER_MS, 600 * PS_PER_MS),
    Phase.CUTTING: (1_500 * PS_PER_MS, 600 * PS_PER_MS),
    Phase.RAPID: (850 * PS_PER_MS, 300 * PS_PER_MS),
    Phase.PROBING: (1_900 * PS_PER_MS, 900 * PS_PER_MS),
    Phase.LARGE: (1_000 * PS_PER_MS, 1 * PS_PER_MS),
}


def twin_of(phase: Phase, design: Design, seed: int, algorithm: InBox | None = None) -> Twin:
    """Run a phase without a fault, and find its moment where that depends on what PC and box do."""
    if phase in _MOMENTS:
        moment_ps, span_ps = _MOMENTS[phase]
    else:
        cell = new_cell(phase, design, seed, algorithm=algorithm)
        moment_ps, span_ps = _found(phase, cell, 1_500 * PS_PER_MS + 97 * PS_PER_MS * (seed % 7))
    cell = new_cell(phase, design, seed, algorithm=algorithm)
    run_through(cell, phase)
    return Twin(cell=cell, moment_ps=moment_ps, span_ps=span_ps)


def _found(phase: Phase, cell: MonitoredCell, from_ps: int) -> tuple[int, int]:
    """Return the beginning and the length of a phase that is found by looking."""
    if phase is Phase.START_UP:
        while not cell.running:
            cell.monitor(until_ps=cell.now_ps + SLICE_PS)
        return 0, cell.now_ps - 5 * PS_PER_MS
    if phase is Phase.REVERSAL:
        highest, highest_ps = 0, 0
        while cell.now_ps < 2_500 * PS_PER_MS:
            cell.monitor(until_ps=cell.now_ps + SLICE_PS)
            if cell.true_count(1) > highest:
                highest, highest_ps = cell.true_count(1), cell.now_ps
        return highest_ps - 5 * PS_PER_MS, 30 * PS_PER_MS
    cell.monitor(until_ps=from_ps)
    before = cell.sent_steps(1)
    while cell.sent_steps(1) == before:
        cell.monitor(until_ps=cell.now_ps + SLICE_PS)
    return cell.now_ps - SLICE_PS, 1


def moment_within(twin: Twin, generator: np.random.Generator) -> int:
    """Return a random moment of the phase."""
    return twin.moment_ps + int(generator.integers(0, max(twin.span_ps, 1)))
