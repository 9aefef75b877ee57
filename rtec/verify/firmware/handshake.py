"""The handshake tried on the bench: start-up, messages, words, position; each is a function that may fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

import numpy as np

from rtec.board.board import GRACE_READINGS, WINDOW_STEPS
from rtec.units import PS_PER_S
from rtec.verify.firmware.bench import Bench, BenchState
from rtec.verify.firmware.contract import DISABLED, DOUBT, FATAL, MESSAGES, NOT_HOMED, OK, PROBING, Failed

ANSWER_CYCLES = 100_000
"""After reset the first words come within so many cycles."""

_ANSWER_READINGS = 8
_MANY_STEPS = 1_000
"""Not all made in some readings, but by the fastest processors."""
_TOO_FAST_HZ = 100e3, 500e3
"""Speeds at which a program inserts nothing, perhaps."""
_GLANCES, _CLOSE_CYCLES = 16, 11
_CARRY = 256
_TRIPS = 400
_PROBE_LATENCY_CYCLES = {"12-clock": 30, "one-clock": 150}
"""From the trip to the reading of the decoder: what docs/firmware.md allows, and some reserve."""


def says(message: int) -> str:
    """Return a message with its name.

    Examples
    --------
    >>> says(4), says(9)
    ("message 4 (I Don't Believe You)", 'message 9 (unknown)')
    """
    return f"message {message} ({MESSAGES.get(message, 'unknown')})"


def _expect(bench: Bench, message: int, when: str) -> None:
    if not bench.await_message(message, readings=_ANSWER_READINGS):
        raise Failed(f"{when}: {says(bench.words.message)} instead of {says(message)}", bench.now_ps)


def _accepts(bench: Bench, total: int) -> bool:
    return bench.await_that(lambda: bench.words.accepted == total, readings=_ANSWER_READINGS)


def _stays(bench: Bench, when: str, *, completed: int, readings: float = 6.0) -> None:
    """Run on, and let nothing be inserted."""
    begun = bench.received().count - bench.encoder_counts
    bench.run_readings(readings)
    now = bench.received().count - bench.encoder_counts
    on_its_way = 1 if bench.design.in_path and bench.motion is not None else 0  # an edge, through the processor
    if abs(now - begun) > on_its_way or bench.words.completed != completed:
        raise Failed(
            f"{when}: {now - begun:+d} counts inserted, {bench.words.completed - completed:+d} steps completed",
            bench.now_ps,
        )


def _owed_waits(bench: Bench, home: BenchState, when: str, forbid: Callable[[], None]) -> str:
    """Forbid insertions while the axis is too fast for those that are owed: then they wait also at rest."""
    for frequency_hz in () if bench.design.in_path else _TOO_FAST_HZ:
        bench.go_back(home)
        bench.move(frequency_hz, 1)
        bench.run_readings(2.0)
        bench.board.ask(WINDOW_STEPS)
        bench.run_readings(3.0)
        if bench.words.accepted == WINDOW_STEPS and bench.words.completed == 0:
            forbid()
            bench.run_readings(GRACE_READINGS + 2.0)
            bench.travel(4 - bench.encoder_counts % 4, 1_000.0)  # to A and B low
            bench.run_readings(1.0)
            _stays(bench, f"{when}, while steps are owed", completed=0)
            return "; steps that are owed wait"
    return ""


def _inserted(bench: Bench, total: int, when: str) -> None:
    """Wait until a total is completed, at rest with A and B low, where every design inserts."""
    readings = _ANSWER_READINGS + 4 * abs(total - bench.words.completed)
    if not bench.await_that(lambda: bench.words.completed == total, readings=readings, looks=4):
        raise Failed(f"{when}: {bench.words.completed:+d} steps completed instead of {total:+d}", bench.now_ps)


def starts(bench: Bench) -> str:
    """Check that the program runs, without a fault, from reset on."""
    cycles = ANSWER_CYCLES
    while bench.cycle_at(bench.now_ps) < cycles and not (bench.valid and bench.publications_ps()):
        bench.run_for(bench.cycles_ps(500))
    bench.run_readings(20.0)
    return f"no fault in {bench.board.cpu.cycles} cycles"


def answers(bench: Bench) -> str:
    """Check that words come, and say that the box is not homed; measure the time between two readings."""
    published = bench.publications_ps()
    if not published:
        low, high = bench.loop_range()
        raise Failed(
            f"never publishes its words: P3.1 has not gone low (Data Valid) in {bench.board.cpu.cycles} cycles; "
            f"the program is between {low:04X}h and {high:04X}h",
            bench.now_ps,
        )
    if len(published) > 2:
        bench.reading_ps = int(np.median(np.diff(published[1:])))
    if not bench.await_message(NOT_HOMED, readings=_ANSWER_READINGS):
        said = f"{says(bench.words.message)} instead of {says(NOT_HOMED)}"
        raise Failed(f"after reset: {said}", bench.now_ps)
    return f"first words after {published[0] / 1e6:.4g} µs, then every {bench.reading_ps / 1e6:.4g} µs"


def takes_home(bench: Bench) -> str:
    """Check that home is taken with a request of zero, and with that alone."""
    bench.travel(-3, 1_000.0)  # below zero no byte of the position is zero, which home has to be
    bench.travel(-1, 1_000.0)  # A and B low again
    bench.board.ask(1, home=True)
    bench.run_readings(4.0)
    if bench.words.message != NOT_HOMED:
        raise Failed(f"home with a request of +1: {says(bench.words.message)}", bench.now_ps)
    bench.board.ask(0)
    bench.run_readings(4.0)
    if bench.words.message != NOT_HOMED:
        raise Failed(f"no home command, a request of 0: {says(bench.words.message)}", bench.now_ps)
    bench.board.ask(0, home=True)
    bench.run_readings(3.0)
    bench.board.ask(0)
    if not bench.await_message(OK, readings=_ANSWER_READINGS):
        low, high = bench.loop_range()
        raise Failed(
            f"home with a request of 0: {says(bench.words.message)} instead of {says(OK)}; the program is between "
            f"{low:04X}h and {high:04X}h",
            bench.now_ps,
        )
    bench.run_readings(2.0)
    if bench.words.position or bench.words.completed:
        found = f"position {bench.words.position}, completed {bench.words.completed}"
        raise Failed(f"at home: {found} instead of 0 and 0", bench.now_ps)
    return "NOT_HOMED until then; after it OK, position 0"


def window(bench: Bench, home: BenchState) -> str:
    """Check that changes by three steps are accepted."""
    bench.go_back(home)
    for total in (3, 0, -3, 0, 1, 3):
        bench.board.ask(total)
        if not _accepts(bench, total):
            said = f"accepted {bench.words.accepted:+d}, {says(bench.words.message)}"
            raise Failed(f"total {total:+d}, within the window: {said}", bench.now_ps)
        _expect(bench, OK, f"total {total:+d}, within the window")
        _inserted(bench, total, f"total {total:+d}")
    return "changes by up to 3 steps are accepted and made"


def disbelief(bench: Bench, home: BenchState) -> str:
    """Check the answers to changes beyond the window: doubt, forgiveness, and the end."""
    for total in (WINDOW_STEPS + 1, -WINDOW_STEPS - 1, 100, -100):
        bench.go_back(home)
        bench.board.ask(total)
        _expect(bench, DOUBT, f"total {total:+d}, beyond the window")
        if bench.words.accepted != 0:
            raise Failed(f"total {total:+d}, beyond the window: accepted", bench.now_ps)
        bench.board.ask(0)
        _expect(bench, OK, f"total {total:+d} taken back in time")
        bench.board.ask(total)
        _expect(bench, DOUBT, f"total {total:+d} once more")
        bench.begin()
        _expect(bench, FATAL, f"total {total:+d} for a third reading")
        # the reading that doubts first was published before
        doubted = len(bench.publications_ps())
        if doubted != GRACE_READINGS:
            found = f"{says(FATAL)} at reading {doubted + 1} beyond the window instead of {GRACE_READINGS + 1}"
            raise Failed(f"total {total:+d}: {found}", bench.now_ps)
        bench.board.ask(1)
        _stays(bench, f"after {says(FATAL)}, total +1", completed=0)
        if bench.words.message != FATAL:
            raise Failed(f"{says(FATAL)} did not stay: {says(bench.words.message)}", bench.now_ps)
    beyond = -1 - WINDOW_STEPS
    owed = _owed_waits(bench, home, f"after {says(FATAL)}", lambda: bench.board.ask(beyond))
    return f"beyond 3 steps: doubted, forgiven when taken back, fatal at the third reading, nothing inserted{owed}"


def large_correction(bench: Bench, home: BenchState) -> str:
    """Check that Large Correction opens the window."""
    for total in (20, -20):
        bench.go_back(home)
        bench.board.ask(total, large=True)
        if not _accepts(bench, total):
            raise Failed(f"total {total:+d} with Large Correction: {says(bench.words.message)}", bench.now_ps)
        _expect(bench, OK, f"total {total:+d} with Large Correction")
        _inserted(bench, total, f"total {total:+d} with Large Correction")
        bench.run_readings(2.0)
        added, wanted = bench.received().count, total * bench.design.step_counts
        if added != wanted:
            raise Failed(
                f"total {total:+d} with Large Correction: {added:+d} counts instead of {wanted:+d}", bench.now_ps
            )
    return "20 steps at once are accepted and made, either way"


def switch(bench: Bench, home: BenchState) -> str:
    """Check that nothing is inserted while the switch is open."""
    bench.go_back(home)
    bench.board.switch(False)
    bench.run_readings(3.0)
    if bench.words.message != OK:
        raise Failed(f"switch open, a request of 0: {says(bench.words.message)}", bench.now_ps)
    bench.board.ask(1)
    _stays(bench, "switch open, total +1", completed=0)
    _expect(bench, DISABLED, "switch open, total +1")
    bench.board.switch(True)
    _expect(bench, OK, "switch closed again")
    _inserted(bench, 1, "switch closed again")
    owed = _owed_waits(bench, home, "switch opened", lambda: bench.board.switch(False))
    bench.go_back(home)
    bench.board.ask(min(bench.design.word_limit, _MANY_STEPS), large=True)
    bench.run_readings(2.0)
    bench.board.switch(False)
    bench.run_readings(1.0)
    _stays(bench, "switch opened during a large correction", completed=bench.words.completed, readings=2.0)
    bench.board.switch(True)
    return f"open: {says(DISABLED)}, nothing inserted; closed: made{owed}"


def probing(bench: Bench, home: BenchState, frequency_hz: float) -> str:
    """Check that nothing is inserted while probing, and that the position at the trip is kept."""
    late_ps = bench.cycles_ps(_PROBE_LATENCY_CYCLES[bench.microcontroller.timing])
    allowed = 1 + int(late_ps * 4.0 * frequency_hz / PS_PER_S)
    worst = 0
    for index in range(12):
        bench.go_back(home)
        direction = 1 if index % 2 else -1
        bench.board.ask(1, probing=True)
        bench.move(frequency_hz, direction)
        bench.run_readings(4.0 + 0.137 * index)
        if bench.words.message != PROBING:
            raise Failed(f"probing: {says(bench.words.message)} instead of {says(PROBING)}", bench.now_ps)
        at, trips, trip_ps = bench.encoder_counts, bench.words.trips, bench.now_ps
        bench.board.probe(True)
        bench.run_readings(2.0)
        bench.board.probe(False)
        _stays(bench, "probing, total +1", completed=0, readings=2.0)
        off = abs(bench.words.trip_position - at)
        if (bench.words.trips - trips) % 256 != 1:
            raise Failed(f"probe tripped once: {bench.words.trips - trips} trips counted", trip_ps)
        if off > allowed:
            found = f"position {bench.words.trip_position} at the trip instead of {at}"
            raise Failed(f"probe: {found}, {allowed} counts allowed at this speed", trip_ps)
        worst = max(worst, off)
    owed = _owed_waits(bench, home, "probing", lambda: bench.board.ask(WINDOW_STEPS, probing=True))
    if bench.microcontroller.timing == "12-clock":  # of a faster one, so many trips would hardly ever meet the moment
        _not_torn_by_trips(bench, home)
    off_by = f"position at the trip off by {worst} of {allowed} counts allowed"
    return f"{says(PROBING)}, nothing inserted{owed}; {off_by}"


def _not_torn_by_trips(bench: Bench, home: BenchState) -> None:
    """Trip the probe at each place of a reading while the count goes over a carry: the position is one of the two."""
    bench.go_back(home)
    bench.travel(_CARRY - 1, 1_000.0)
    bench.run_readings(3.0)
    before = bench.keep()
    for index in range(_TRIPS):
        bench.go_back(before)
        bench.run_readings(index / _TRIPS)
        bench.board.probe(True)
        bench.move(100.0, 1)  # one edge, now
        bench.run_readings(0.9)
        found = bench.words.position
        bench.board.probe(False)
        if bench.valid and found not in (_CARRY - 1, _CARRY):
            raise Failed(
                f"position {found} after a probe trip, the axis was at {_CARRY - 1} and {_CARRY}", bench.now_ps
            )


def position(bench: Bench, home: BenchState, frequency_hz: float) -> str:
    """Check the position far beyond the decoder's 12 bits, and beyond 16, both ways."""
    bench.go_back(home)
    reached = []
    for counts in (5_000, -10_000, 40_000, -70_000):
        bench.travel(counts, frequency_hz)
        bench.run_readings(3.0)
        place = bench.encoder_counts
        if bench.words.position != place:
            raise Failed(f"position {bench.words.position} instead of {place} after {counts:+d} counts", bench.now_ps)
        reached.append(place)
    return f"right at {', '.join(f'{place:+d}' for place in reached)} counts"


def words(bench: Bench, home: BenchState, frequency_hz: float) -> str:
    """Check that words change under low Data Valid alone, and that no position is torn."""
    bench.go_back(home)
    bench.travel(-40, frequency_hz)  # a carry runs through all three bytes on the way back
    bench.run_readings(3.0)
    bench.move(frequency_hz, 1)
    bench.board.ask(2)
    before, valid, looks = bench.words, bench.valid, 0
    places = [bench.encoder_counts] * 3  # after an insertion, the position of the reading before is still out
    end_ps = bench.now_ps + round(4 * bench.reading_ps + 80 * PS_PER_S / (4.0 * frequency_hz))
    while bench.now_ps < end_ps:
        # most of the time nothing happens; where something does, it is looked at closely
        if bench.quiet_for(bench.reading_ps // _GLANCES):
            bench.run_for(bench.reading_ps // _GLANCES)
            continue
        published = len(bench.publications_ps())
        bench.run_for(bench.cycles_ps(_CLOSE_CYCLES))
        now, still = bench.words, bench.valid
        if now != before and valid and still and len(bench.publications_ps()) == published:
            changed = [each.name for each in fields(now) if getattr(now, each.name) != getattr(before, each.name)]
            raise Failed(f"words change while Data Valid is high: {', '.join(changed)}", bench.now_ps)
        if len(bench.publications_ps()) > published:
            looks += 1
            places.append(bench.encoder_counts)
            if still and not places[-4] - 1 <= now.position <= places[-1]:
                found = f"position {now.position} published, the axis was between {places[-4]} and {places[-1]}"
                raise Failed(f"torn: {found}", bench.now_ps)
        before, valid = now, still
    return f"{looks} publications, none torn; words change under low Data Valid alone"
