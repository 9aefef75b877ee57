"""Faults of the open signal path as jobs of a campaign."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rtec.axis import Encoder
from rtec.axis.motion import NAMES, MotionKind
from rtec.injector import Design, DesignRow, InjectorSettings, Processor, RealEdges, Timing, Totals
from rtec.injector._wave_kernels import COMPLETED, LEVEL_IN, LEVEL_OUT, REQUESTED, TIME
from rtec.machine import OpenPath, with_motion
from rtec.machine.fault_kinds import FaultRow
from rtec.machine.faults import Fault
from rtec.machine.line_faults import stream_of
from rtec.machine.open_fault_kinds import (
    BOX_CODES,
    LATCH,
    LINE_CODES,
    OPEN_FAULTS,
    place_of,
    why_not,
    word_of,
)
from rtec.machine.open_fault_outcome import NOT_ACTIVATED as WITHOUT_EFFECT, SILENT
from rtec.machine.open_faults import Kept, faults_at, length_ps, simulate_faults
from rtec.machine.windows import Source
from rtec.readable import hertz_text
from rtec.signal import gray
from rtec.units import PS_PER_S
from rtec.verify.campaign.job import (
    EXEMPT,
    FAILED,
    NOT_ACTIVATED,
    PASSED,
    Choice,
    JobKind,
    Number,
    Parameters,
    Record,
)
from rtec.verify.campaign.trace import Trace

_NONE = "none"
_CYCLES, _STEPS = 60, 12
_ROWS = {word_of(row): row for row in OPEN_FAULTS}
_CLASSES = {
    "place": {word: place_of(row) for word, row in _ROWS.items()},
    "category": {word: "-".join(row.category.value.lower().replace("'", "").split()) for word, row in _ROWS.items()},
}


def inject_open(parameters: Parameters, seed: int, run: int) -> Record:
    """Inject one fault, or two, on the open path, at a phase of an edge in the middle half of a short motion.

    Parameters
    ----------
    parameters
        ``design``, ``processor``, ``motion``, ``fault``, ``second`` (another fault, or none): words;
        ``frequency_hz``, the highest of the motion; ``phase``, the share of the interval between two edges.
    seed, run
        Of the plan; number of the run. They draw the edge, direction and sign, the state at home, and what a fault
        draws.

    Examples
    --------
    >>> words = {"design": "c", "processor": "fast", "motion": "steady", "fault": "missed-edge", "second": "none"}
    >>> record = inject_open(words | {"frequency_hz": 1e5, "phase": 0.5}, seed=1, run=0)
    >>> record["result"], record["outcome"], abs(record["off_counts"])
    ('exempt', 'silent corruption', 4)
    """
    path, faults = _injection(parameters, seed, run)
    found = simulate_faults(path, faults)
    first, *second = found.outcome.effects
    beyond = next((where for one in faults if (where := beyond_supervision(one.kind, path.injector.design))), None)
    # without the fault, too: nothing follows about the fault
    proves = found.outcome.word != WITHOUT_EFFECT and found.outcome.sound_without
    harm = proves and found.outcome.word == SILENT
    moment_ps = first.fault.from_ps if first.activated_ps is None else first.activated_ps
    level = next(Source(path).windows()).edges.level_at(moment_ps)
    record: Record = {
        "result": (EXEMPT if beyond else FAILED) if harm else PASSED if proves else NOT_ACTIVATED,
        "outcome": found.outcome.word,
        "beyond_supervision": beyond,
        "moment_ps": first.fault.from_ps,
        "activated_ps": first.activated_ps,
        "fired": first.changes,
        "state": int(gray.states_of_levels([level])[0]) + 1,
        "direction": "positive" if path.direction > 0 else "negative",
        "noticed": ", ".join(found.outcome.noticed),
        "encoder_counts": found.result.encoder_counts,
        "controller_counts": found.result.controller_counts,
        "off_counts": found.outcome.off_counts,
        "corrections_inserted": found.result.insertions.completed,
        "corrections_pending": found.result.pending,
        "illegal_transitions": found.result.received.illegal_transitions,
    }
    if second:
        record |= {"second_moment_ps": second[0].fault.from_ps, "second_activated_ps": second[0].activated_ps,
                   "second_fired": second[0].changes}  # fmt: skip
    return record


def trace_of(parameters: Parameters, seed: int, run: int) -> Trace:
    """Return what there is to see of a job, as `inject_open` takes it."""
    path, faults = _injection(parameters, seed, run)
    kept = Kept((path.encoder.level_at_home, int(path.state().receiver.raw)))
    found = simulate_faults(path, faults, seen=kept)
    rows = kept.taken()
    times, last = np.unique(rows[::-1, TIME], return_index=True)  # the last row of each moment
    rows = rows[::-1][last]
    sides = [stream_of(times[1:], rows[1:, side], int(rows[0, side])) for side in (LEVEL_IN, LEVEL_OUT)]
    totals = [
        Totals(times[1:][changed], rows[1:, which][changed])
        for which in (REQUESTED, COMPLETED)
        for changed in [np.diff(rows[:, which]) != 0]
    ]
    marks = [(one.activated_ps, one.fault.kind.words) for one in found.outcome.effects if one.activated_ps]
    return Trace(
        title=", ".join((
            path.injector.design.title, *(str(parameters[name]) for name in ("processor", "motion")),
            hertz_text(float(parameters["frequency_hz"] or 0.0)),
            " and ".join(fault.kind.words for fault in faults), found.outcome.word,
        )),
        encoder=sides[0], controller=sides[1], requested=totals[0], completed=totals[1],
        until_ps=round(found.result.simulated_s * PS_PER_S),
        marks=tuple(marks) or ((faults[0].from_ps, faults[0].kind.words),),
    )  # fmt: skip


def beyond_supervision(row: FaultRow, design: DesignRow) -> str | None:
    """Return where wrong counts begin that no comparison of box and controller can catch; None: it can.

    Examples
    --------
    >>> from rtec.machine.open_fault_kinds import open_fault_named
    >>> [beyond_supervision(open_fault_named(name), Design.C) for name in ("glitches", "clock slow")]
    ['before the box', None]
    """
    if row.code in LINE_CODES:
        return "before the box"
    return "with the processor" if design.in_path and row.code in BOX_CODES else None


def _wanted(parameters: Parameters) -> Iterator[FaultRow]:
    for name in ("fault", "second"):
        if parameters[name] != _NONE:
            yield _ROWS[str(parameters[name])]


def _box(parameters: Parameters) -> InjectorSettings:
    design = Design.named(str(parameters["design"]))
    timing = Timing.of(design, Processor(parameters["processor"]))
    return InjectorSettings(design=design, timing=timing, real_edges=RealEdges.HOLD)


def _injection(parameters: Parameters, seed: int, run: int) -> tuple[OpenPath, tuple[Fault, ...]]:
    """Return what a job runs and injects."""
    generator = np.random.default_rng([seed, run])
    path, own_seed = _path(parameters, generator)
    edges, moments = next(Source(path).windows()).edges, []
    for row in _wanted(parameters):
        k = int(generator.integers(len(edges) // 4, 3 * len(edges) // 4))
        from_ps, next_ps = (int(edges.times_ps[i]) for i in (k, k + 1))
        moments.append((row, from_ps + int(float(parameters["phase"] or 0.0) * (next_ps - from_ps)), None))
    return path, faults_at(length_ps(path), moments, own_seed)


def _path(parameters: Parameters, generator: np.random.Generator) -> tuple[OpenPath, int]:
    """Return the run, and the seed of its motion and of its faults."""
    direction, sign = (int(way) for way in generator.choice([1, -1], 2))
    home, seed = int(generator.integers(4)), int(generator.integers(1 << 31))
    path = OpenPath(
        injector=_box(parameters), frequency_hz=float(parameters["frequency_hz"] or 0.0), cycles=_CYCLES,
        corrections=sign * _STEPS, direction=direction, encoder=Encoder(home_state=home, seed=seed),
    )  # fmt: skip
    return with_motion(path, MotionKind(parameters["motion"]), seed=seed), seed


def _impossible(parameters: Parameters) -> str | None:
    """Return why a job cannot prove anything; None: it can."""
    box, rows = _box(parameters), list(_wanted(parameters))
    for row in rows:
        reason = why_not(row, box.design, box.real_edges)
        if reason is not None:
            return reason
        if row.code == LATCH and row.words.endswith("open") and parameters["motion"] == MotionKind.STEADY.value:
            return "at a steady speed that the gate lets through no real edge comes within an insertion"
    if len(rows) == 2 and rows[0] is rows[1]:
        return "a fault is no second one beside itself"
    if box.design.in_path and float(parameters["frequency_hz"] or 0.0) > box.timing.limit_hz(box.design):
        return "lines that pass through a processor are lost at this frequency without any fault"
    return None


OPEN_FAULT = JobKind(
    does="A fault, or two, come on the open path at a phase of an edge, and the controller's count is judged.",
    function=f"{__name__}:inject_open",
    parameters=(
        Choice(name="processor", words=tuple(one.value for one in Processor), default=(Processor.FAST.value,)),
        Choice(name="design", words=tuple(design.value for design in Design)),
        Choice(name="motion", words=NAMES, default=(MotionKind.STEADY.value,)),
        Choice(name="fault", words=tuple(_ROWS), classes=_CLASSES),
        Choice(name="second", words=(_NONE, *_ROWS), default=(_NONE,), classes=_CLASSES),
        Number(name="frequency_hz", unit="Hz", low=1.0, high=5e6, default=100e3),
        Number(name="phase", low=0.0, high=1.0, default=0.5),
    ),
    by=("fault", "design"),
    trace=f"{__name__}:trace_of",
    proves=("fault", "design"),
    impossible=_impossible,
)
