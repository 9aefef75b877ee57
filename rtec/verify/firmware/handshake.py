"""The handshake tried on the bench: start-up, messages, words, position; each is a function that may fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

import numpy as np

from rtec.board.board import GRACE_READINGS, WINDOW_STEPS, Snapshot
from rtec.requester.status import Status
from rtec.units import PS_PER_S
from rtec.verify.bench import Bench, Failed

OK, NOT_HOMED, PROBING, DISABLED = Status.OK, Status.NOT_HOMED, Status.PROBING, Status.DISABLED
DOUBT, FATAL = Status.I_DONT_BELIEVE_YOU, Status.I_STILL_DONT_BELIEVE_YOU
MESSAGES = {
    **{code.value: code.name for code in (OK, NOT_HOMED, PROBING, DISABLED)},
    **{code.value: code.meaning.partition(":")[0] for code in (DOUBT, FATAL)},
}
"""Names of the messages (docs/firmware.md, "Message codes")."""

ANSWER_CYCLES = 100_000
"""After reset the first words come within so many cycles."""

_ANSWER_READINGS = 8
_GLANCES, _CLOSE_CYCLES = 16, 11
_PROBE_LATENCY_CYCLES = {"12-clock": 30, "one-clock": 150}
"""From the trip to the reading of the decoder: what docs/firmware.md allows, and some reserve."""
_SLOW_HZ = 1_000.0


def says(message: int) -> str:
    """Return a message with its name.

    Examples
    --------
    >>> says(4), says(9)
    ("message 4 (I Don't Believe You)", 'message 9 (unknown)')
    """
    return f"message {int(message)} ({MESSAGES.get(message, 'unknown')})"


def _expect(bench: Bench, message: int, when: str) -> None:
    came = bench.await_message(message, readings=_ANSWER_READINGS)
    bench.require(came, f"{when}: {says(bench.words.message)} instead of {says(message)}")


def _accepts(bench: Bench, total: int) -> bool:
    return bench.await_that(lambda: bench.words.accepted == total, readings=_ANSWER_READINGS)


def _stays(bench: Bench, when: str, *, completed: int, readings: float = 6.0) -> None:
    """Run on, and let nothing be inserted."""
    begun = bench.received().count - bench.encoder_counts
    bench.run_readings(readings)
    added, made = bench.received().count - bench.encoder_counts - begun, bench.words.completed - completed
    bench.require(added == made == 0, f"{when}: {added:+d} counts inserted, {made:+d} steps completed")


def _inserted(bench: Bench, total: int, when: str) -> None:
    """Wait until a total is completed, at rest with A and B low, where every design inserts."""
    readings = _ANSWER_READINGS + 4 * abs(total - bench.words.completed)
    came = bench.await_total(total, readings=readings, looks=4)
    bench.require(came, f"{when}: {bench.words.completed:+d} steps completed instead of {total:+d}")


def _place_of(bench: Bench) -> str:
    """Run on in short steps and return where the program was seen."""
    seen, end_ps = set(), bench.now_ps + bench.cycles_ps(4_000)
    while bench.now_ps < end_ps:
        bench.run_for(bench.cycles_ps(7))
        seen.add(bench.board.cpu.pc)
    return f"the program is between {min(seen):04X}h and {max(seen):04X}h"


def starts(bench: Bench) -> str:
    """Check that the program runs, without a fault, from reset on."""
    while bench.cycle_at(bench.now_ps) < ANSWER_CYCLES and not (bench.valid and len(bench.told)):
        bench.run_for(bench.cycles_ps(500))
    bench.run_readings(20.0)
    return f"no fault in {bench.board.cpu.cycles} cycles"


def answers(bench: Bench) -> str:
    """Check that words come, and say that the box is not homed; measure the time between two readings."""
    told_ps = bench.told[:, 0]
    if told_ps.size == 0:
        place, never = _place_of(bench), "never publishes its words: P3.1 has not gone low (Data Valid)"
        raise Failed(f"{never} in {bench.board.cpu.cycles} cycles; {place}", bench.now_ps)
    if told_ps.size > 2:
        bench.reading_ps = int(np.median(np.diff(told_ps[1:])))
    _expect(bench, NOT_HOMED, "after reset")
    return f"first words after {told_ps[0] / 1e6:.4g} µs, then every {bench.reading_ps / 1e6:.4g} µs"


def takes_home(bench: Bench) -> str:
    """Check that home is taken with a request of zero, and with that alone."""
    bench.travel(3, _SLOW_HZ)
    bench.travel(1, _SLOW_HZ)  # A and B low again
    for total, home, when in ((1, True, "home with a request of +1"), (0, False, "no home command, a request of 0")):
        bench.board.ask(total, home=home)
        bench.run_readings(4.0)
        bench.require(bench.words.message == NOT_HOMED, f"{when}: {says(bench.words.message)}")
    bench.board.ask(0, home=True)
    bench.run_readings(3.0)
    bench.board.ask(0)
    if not bench.await_message(OK, readings=_ANSWER_READINGS):
        said = f"home with a request of 0: {says(bench.words.message)} instead of {says(OK)}"
        raise Failed(f"{said}; {_place_of(bench)}", bench.now_ps)
    bench.run_readings(2.0)
    place, done = bench.words.position, bench.words.completed
    bench.require(place == done == 0, f"at home: position {place}, completed {done} instead of 0 and 0")
    return "NOT_HOMED until then; after it OK, position 0"


START: dict[str, Callable[[Bench], str]] = {"starts": starts, "answers": answers, "home": takes_home}
"""What a program has to do, one after the other, before anything can be asked of it."""


def window(bench: Bench, home: Snapshot) -> str:
    """Check that changes by three steps are accepted."""
    bench.reset(home)
    for total in (3, 0, -3, 0, 1, 3):
        bench.board.ask(total)
        accepted = _accepts(bench, total)
        said = f"accepted {bench.words.accepted:+d}, {says(bench.words.message)}"
        bench.require(accepted, f"total {total:+d}, within the window: {said}")
        _expect(bench, OK, f"total {total:+d}, within the window")
        _inserted(bench, total, f"total {total:+d}")
    return "changes by up to 3 steps are accepted and made"


def disbelief(bench: Bench, home: Snapshot) -> str:
    """Check the answers to changes beyond the window: doubt, forgiveness, and the end."""
    for total in (WINDOW_STEPS + 1, -WINDOW_STEPS - 1, 100, -100):
        bench.reset(home)
        bench.board.ask(total)
        _expect(bench, DOUBT, f"total {total:+d}, beyond the window")
        bench.require(bench.words.accepted == 0, f"total {total:+d}, beyond the window: accepted")
        bench.board.ask(0)
        _expect(bench, OK, f"total {total:+d} taken back in time")
        bench.board.ask(total)
        _expect(bench, DOUBT, f"total {total:+d} once more")
        bench.begin()
        _expect(bench, FATAL, f"total {total:+d} for a third reading")
        # the reading that doubts first was published before
        doubted = len(bench.told)
        found = f"{says(FATAL)} at reading {doubted + 1} beyond the window instead of {GRACE_READINGS + 1}"
        bench.require(doubted == GRACE_READINGS, f"total {total:+d}: {found}")
        bench.board.ask(1)
        _stays(bench, f"after {says(FATAL)}, total +1", completed=0)
        bench.require(bench.words.message == FATAL, f"{says(FATAL)} did not stay: {says(bench.words.message)}")
    return "beyond 3 steps: doubted, forgiven when taken back, fatal at the third reading, nothing inserted"


def large_correction(bench: Bench, home: Snapshot) -> str:
    """Check that Large Correction opens the window."""
    for total in (20, -20):
        when = f"total {total:+d} with Large Correction"
        bench.reset(home)
        bench.board.ask(total, large=True)
        bench.require(_accepts(bench, total), f"{when}: {says(bench.words.message)}")
        _expect(bench, OK, when)
        _inserted(bench, total, when)
        bench.run_readings(2.0)
        added, wanted = bench.received().count, total * bench.design.step_counts
        bench.require(added == wanted, f"{when}: {added:+d} counts instead of {wanted:+d}")
    return "20 steps at once are accepted and made, either way"


def switch(bench: Bench, home: Snapshot) -> str:
    """Check that nothing is inserted while the switch is open."""
    bench.reset(home)
    bench.board.switch(False)
    bench.run_readings(3.0)
    bench.require(bench.words.message == OK, f"switch open, a request of 0: {says(bench.words.message)}")
    bench.board.ask(1)
    _stays(bench, "switch open, total +1", completed=0)
    _expect(bench, DISABLED, "switch open, total +1")
    bench.board.switch(True)
    _expect(bench, OK, "switch closed again")
    _inserted(bench, 1, "switch closed again")
    return f"open: {says(DISABLED)}, nothing inserted; closed: made"


def probing(bench: Bench, home: Snapshot, frequency_hz: float) -> str:
    """Check that nothing is inserted while probing, and that the position at the trip is kept."""
    late_ps = bench.cycles_ps(_PROBE_LATENCY_CYCLES[bench.microcontroller.timing])
    allowed = 1 + int(late_ps * 4.0 * frequency_hz / PS_PER_S)
    worst = 0
    for index in range(12):
        bench.reset(home)
        bench.board.ask(1, probing=True)
        bench.move(frequency_hz, 1 if index % 2 else -1, 10 * bench.reading_ps)
        bench.run_readings(4.0 + 0.137 * index)
        message = bench.words.message
        bench.require(message == PROBING, f"probing: {says(message)} instead of {says(PROBING)}")
        at, trips, trip_ps = bench.encoder_counts, bench.words.trips, bench.now_ps
        bench.board.probe(True)
        bench.run_readings(2.0)
        bench.board.probe(False)
        _stays(bench, "probing, total +1", completed=0, readings=2.0)
        off, counted = abs(bench.words.trip_position - at), bench.words.trips - trips
        if counted % 256 != 1:
            raise Failed(f"probe tripped once: {counted} trips counted", trip_ps)
        if off > allowed:
            found = f"position {bench.words.trip_position} at the trip instead of {at}"
            raise Failed(f"probe: {found}, {allowed} counts allowed at this speed", trip_ps)
        worst = max(worst, off)
    return f"{says(PROBING)}, nothing inserted; position at the trip off by {worst} of {allowed} counts allowed"


def position(bench: Bench, home: Snapshot, frequency_hz: float) -> str:
    """Check the position far beyond the decoder's 12 bits, and beyond 16, both ways."""
    bench.reset(home)
    reached = []
    for counts in (5_000, -10_000, 40_000, -70_000):
        bench.travel(counts, frequency_hz)
        bench.run_readings(3.0)
        said, place = bench.words.position, bench.encoder_counts
        bench.require(said == place, f"position {said} instead of {place} after {counts:+d} counts")
        reached.append(place)
    return f"right at {', '.join(f'{place:+d}' for place in reached)} counts"


def words(bench: Bench, home: Snapshot, frequency_hz: float) -> str:
    """Check that words change under low Data Valid alone, and that no position is torn."""
    bench.reset(home)
    bench.travel(-40, frequency_hz)  # a carry runs through all three bytes on the way back
    bench.run_readings(3.0)
    duration_ps = round(4 * bench.reading_ps + 80 * PS_PER_S / (4.0 * frequency_hz))
    bench.move(frequency_hz, 1, duration_ps + bench.reading_ps)
    bench.board.ask(2)
    before, valid, looks = bench.words, bench.valid, 0
    places = [bench.encoder_counts] * 3  # after an insertion, the position of the reading before is still out
    end_ps = bench.now_ps + duration_ps
    while bench.now_ps < end_ps:
        # most of the time nothing happens; where something does, it is looked at closely
        if bench.quiet_for(bench.reading_ps // _GLANCES):
            bench.run_for(bench.reading_ps // _GLANCES)
            continue
        published = bench.board.published
        bench.run_for(bench.cycles_ps(_CLOSE_CYCLES))
        now, still = bench.words, bench.valid
        told = bench.board.published > published
        if now != before and valid and still and not told:
            changed = [each.name for each in fields(now) if getattr(now, each.name) != getattr(before, each.name)]
            raise Failed(f"words change while Data Valid is high: {', '.join(changed)}", bench.now_ps)
        if told:
            looks += 1
            places.append(bench.encoder_counts)
            found = f"position {now.position} published, the axis was between {places[-4]} and {places[-1]}"
            bench.require(not still or places[-4] - 1 <= now.position <= places[-1], f"torn: {found}")
        before, valid = now, still
    return f"{looks} publications, none torn; words change under low Data Valid alone"
