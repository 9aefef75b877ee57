"""Insertions tried on the bench: at rest, and at every speed, direction, sign and phase between edge and program."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter

import numpy as np

from rtec.campaign.firmware_check_bench import Bench, BenchState
from rtec.campaign.firmware_check_contract import Failed, Stopped
from rtec.campaign.firmware_check_results import Trace
from rtec.controller import ReceiverResult
from rtec.injector import Totals
from rtec.units import PS_PER_S

GOLDEN = 0.618_033_988_749_895
"""Multiples of it, modulo 1, fill an interval evenly however many there are."""

_WARM_UP_READINGS = 3.3
"""Motion before the request, so that no firmware takes the axis for resting."""

_BUDGET_READINGS, _BUDGET_PERIODS = 12, 24
"""An insertion is made within so many readings and encoder periods, or it is refused."""

_SAME_INSERTION_CYCLES = {"12-clock": 30, "one-clock": 60}
"""Changes of drive pins closer than this belong to one insertion; to book it takes longer."""

_MARGIN = 0.6
"""Of the span of an insertion, shown before and behind it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One request of one step, and what the controller is to count.

    Parameters
    ----------
    frequency_hz
        Of the encoder; 0 at rest.
    direction
        Of the motion; at rest, of the way to the state.
    sign
        Of the step.
    state
        The encoder's state at rest, 0..3, counted from that of home (A and B low).
    phase
        Of the first edge, in encoder edges, 0..1.
    """

    frequency_hz: float
    direction: int
    sign: int
    state: int = 0
    phase: float = 0.0
    quiet_readings: float = 4.0
    """After the motion: what was not asked would come then."""

    def __str__(self) -> str:
        asked = f"{self.sign:+d} step"
        if self.frequency_hz == 0.0:
            return f"{asked} at rest in state {self.state + 1}"
        return f"{asked} at {hertz(self.frequency_hz)} in direction {'+' if self.direction > 0 else '-'}"

    def play(self, bench: Bench, home: BenchState) -> Outcome:
        """Make the trial from the home position on."""
        bench.go_back(home)
        if self.frequency_hz == 0.0:
            if self.state:
                bench.travel(self.state * self.direction, 1_000.0)
            bench.run_readings(3.0 + self.phase)
        else:
            bench.move(
                self.frequency_hz, self.direction, after_ps=round(self.phase * PS_PER_S / (4.0 * self.frequency_hz))
            )
            bench.run_readings(_WARM_UP_READINGS)
        asked_ps = bench.now_ps
        bench.board.ask(self.sign)
        budget = _BUDGET_READINGS
        if self.frequency_hz:
            budget += round(_BUDGET_PERIODS * PS_PER_S / self.frequency_hz / bench.reading_ps)
        inserted = bench.await_that(lambda: bench.words.completed == self.sign, readings=budget, looks=2)
        refused, seen_ps = bench.words.refused, bench.now_ps
        totals = Totals([asked_ps], [self.sign]), Totals([seen_ps], [self.sign]) if inserted else Totals()
        if self.frequency_hz:
            bench.run_readings(1.0)
        bench.halt()
        bench.run_readings(self.quiet_readings)
        return Outcome.of(self, bench, inserted=inserted, refused=refused, totals=totals)


def hertz(frequency_hz: float) -> str:
    """Return a frequency for people.

    Examples
    --------
    >>> hertz(5_000.0), hertz(400.0)
    ('5 kHz', '400 Hz')
    """
    return f"{frequency_hz / 1000:.4g} kHz" if frequency_hz >= 1000.0 else f"{frequency_hz:.4g} Hz"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a trial has shown; ``wrong`` says in words what does not fit the contract, "" where all does."""

    trial: Trial
    wrong: str
    wrong_ps: int
    inserted: bool
    refused: int
    latency_ps: int | None
    received: ReceiverResult
    trace: Trace

    @classmethod
    def of(
        cls, trial: Trial, bench: Bench, *, inserted: bool, refused: int, totals: tuple[Totals, Totals]
    ) -> Outcome:
        """Judge what a bench has recorded since the trial began."""
        events = insertions(bench)
        received, completed = bench.received(), bench.words.completed
        added = received.count - bench.encoder_counts
        step = bench.design.step_counts
        first_ps = events[0].first_ps if events else bench.now_ps
        wrong, wrong_ps = "", first_ps
        if received.illegal_transitions:
            illegal = received.first_illegal[0]
            wrong = f"illegal transition ({illegal.kind.value}) at the controller"
            wrong_ps = illegal.time_ps
        elif added != step * completed:
            wrong = f"counts: {added:+d} instead of {step * completed:+d}"
        elif completed not in (0, trial.sign):
            wrong = f"{completed:+d} steps completed, {trial.sign:+d} asked"
            wrong_ps = events[-1].first_ps if events else bench.now_ps
        return cls(
            trial=trial,
            wrong=wrong,
            wrong_ps=wrong_ps,
            inserted=inserted,
            refused=refused,
            latency_ps=max((e.latency_ps for e in events if e.latency_ps is not None), default=None),
            received=received,
            trace=_trace(trial, bench, events, totals, wrong, wrong_ps if wrong else None),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Insertion:
    """The changes of drive pins that belong together."""

    first_ps: int
    last_ps: int
    edge_ps: int | None
    """The encoder's edge before them, in motion."""

    @property
    def latency_ps(self) -> int | None:
        """Return the time from the edge to the last change."""
        return None if self.edge_ps is None else self.last_ps - self.edge_ps


def insertions(bench: Bench) -> list[Insertion]:
    """Return the insertions since the bench began, by the changes of the drive pins.

    The pins of Design B follow the encoder, too: there an insertion is where they change twice after one edge, or
    without one.
    """
    mask = bench.design.pins
    changed = [bench.time_of(cycle) for cycle, before, after in bench.changes(1) if (before ^ after) & mask]
    edges = bench.encoder.times_ps
    moving = edges.size > 8
    groups: list[list[int]] = []
    if bench.design.in_path:
        after = np.searchsorted(edges, changed, side="right").tolist()
        for index, pairs in groupby(zip(after, changed, strict=True), key=itemgetter(0)):
            times = [t for _, t in pairs]
            at_rest = index == 0 or (index == edges.size and times[0] - edges[-1] > bench.reading_ps)
            if len(times) > 1 or at_rest:
                groups.append(times)
    else:
        gap_ps = bench.cycles_ps(_SAME_INSERTION_CYCLES[bench.microcontroller.timing])
        for t in changed:
            if groups and t - groups[-1][-1] < gap_ps:
                groups[-1].append(t)
            else:
                groups.append([t])
    found = []
    for times in groups:
        before = int(np.searchsorted(edges, times[0], side="right"))
        edge_ps = int(edges[before - 1]) if before else None
        in_motion = moving and edge_ps is not None and times[0] - edge_ps < bench.reading_ps
        found.append(Insertion(first_ps=times[0], last_ps=times[-1], edge_ps=edge_ps if in_motion else None))
    return found


def _trace(
    trial: Trial,
    bench: Bench,
    events: list[Insertion],
    totals: tuple[Totals, Totals],
    wrong: str,
    mark_ps: int | None,
) -> Trace:
    """Return the lines around the first insertion, or around the moment that failed."""
    near_ps = bench.cycles_ps(200)
    around = next((e for e in events if mark_ps is None or e.last_ps >= mark_ps - near_ps), None)
    first = around.first_ps if around else (bench.now_ps if mark_ps is None else mark_ps)
    last = around.last_ps if around else first
    edge = around.edge_ps if around else None
    if edge is not None and first - edge > near_ps:
        edge = None
    begin, end = min(first, mark_ps or first, edge or first), max(last, mark_ps or last)
    margin_ps = max(round(_MARGIN * (end - begin)), bench.cycles_ps(8))
    rows = [(bench.time_of(cycle), after) for cycle, _, after in bench.changes(1)]
    start = next(bench.changes(1), (0, bench.latches[1], 0))[1]
    return Trace(
        title=f"{trial}: {wrong}" if wrong else str(trial),
        encoder=bench.encoder,
        controller=bench.controller,
        requested=totals[0],
        completed=totals[1],
        insertions_ps=tuple((event.first_ps, event.last_ps) for event in events),
        pin_times_ps=np.array([t for t, _ in rows], np.int64),
        pin_levels=np.array([level for _, level in rows], np.int64),
        initial_pins=start,
        from_ps=max(begin - margin_ps, bench.begun_ps),
        to_ps=min(end + margin_ps, bench.now_ps),
        zero_ps=edge if edge is not None else first,
        mark_ps=mark_ps,
        cycle_ps=bench.cycle_num / bench.cycle_den,
    )


def rest_trials() -> Iterator[Trial]:
    """Yield the trials at rest: every state, reached from either side, both signs."""
    for state in range(4):
        for direction, sign in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            yield Trial(
                frequency_hz=0.0, direction=direction, sign=sign, state=state if direction > 0 else (4 - state) % 4
            )


def motion_trials(frequency_hz: float, phases: int, quiet_readings: float = 4.0) -> Iterator[Trial]:
    """Yield the trials at a speed: both directions, both signs, many phases between edge and program."""
    for index in range(phases):
        for direction in (1, -1):
            for sign in (1, -1):
                yield Trial(
                    frequency_hz=frequency_hz,
                    direction=direction,
                    sign=sign,
                    phase=(0.5 + index * GOLDEN) % 1.0,
                    quiet_readings=quiet_readings,
                )


@dataclass(slots=True)
class Measured:
    """What the insertions that were right have shown."""

    latency_ps: int | None = None
    separation_ps: int | None = None
    trace: Trace | None = None

    def take(self, outcome: Outcome) -> None:
        """Take the outcome of a trial that was right."""
        latency, separation = outcome.latency_ps, outcome.received.min_separation_ps
        if latency is not None and (self.latency_ps is None or latency > self.latency_ps):
            self.latency_ps, self.trace = latency, outcome.trace
        if separation is not None and (self.separation_ps is None or separation < self.separation_ps):
            self.separation_ps = separation
        if self.trace is None and outcome.inserted:
            self.trace = outcome.trace


class TrialFailed(Failed):
    """A trial that does not fit the contract."""

    def __init__(self, detail: str, time_ps: int, trial: Trial, home: BenchState, outcome: Outcome | None) -> None:
        super().__init__(f"{trial}: {detail}", time_ps)
        self.trial, self.home, self.outcome = trial, home, outcome


def hold_to(trial: Trial, bench: Bench, home: BenchState, measured: Measured) -> Outcome:
    """Make a trial and hold it to the contract.

    Raises
    ------
    TrialFailed
        It does not hold.
    """
    try:
        outcome = trial.play(bench, home)
    except Stopped as stopped:
        raise TrialFailed(stopped.detail, stopped.time_ps, trial, home, None) from stopped
    if outcome.wrong:
        raise TrialFailed(outcome.wrong, outcome.wrong_ps, trial, home, outcome)
    waits = bench.design.one_state and trial.frequency_hz == 0.0 and trial.state != 0
    if not outcome.inserted and not waits:
        refused = f"; its speed gate refused {outcome.refused}" if outcome.refused else ""
        detail = f"nothing inserted within {_BUDGET_READINGS} readings and {_BUDGET_PERIODS} encoder periods{refused}"
        raise TrialFailed(detail, bench.now_ps, trial, home, outcome)
    measured.take(outcome)
    return outcome
