"""How fast the encoder may go, roughly: where a firmware begins to refuse, or to break."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rtec.campaign.firmware_check_bench import Bench, BenchState
from rtec.campaign.firmware_check_contract import Stopped
from rtec.campaign.firmware_check_insertion import motion_trials

_FACTOR, _CLOSE = 1.5, 1.06
"""From one speed to the next on the way up; how close good and bad come in the end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """How far up all was right, and what happened above."""

    good_hz: float | None
    bad_hz: float | None
    failing: Literal["refuses", "breaks"] | None


def speed_limit(bench: Bench, home: BenchState, *, from_hz: float, phases: int, to_hz: float = 4e6) -> Limit:
    """Look for the lowest speed at which the firmware refuses to insert, or breaks, to a few percent.

    Parameters
    ----------
    bench, home
        A box that has been homed.
    from_hz
        A speed that it is known to manage.
    phases
        Phases tried at each speed.
    to_hz
        The highest speed tried.
    """
    good, bad = from_hz, from_hz * _FACTOR
    while (failing := _failing(bench, home, bad, phases)) is None:
        if bad >= to_hz:
            return Limit(good_hz=bad, bad_hz=None, failing=None)
        good, bad = bad, bad * _FACTOR
    while bad / good > _CLOSE:
        middle = (good * bad) ** 0.5
        found = _failing(bench, home, middle, phases)
        good, bad, failing = (good, middle, found) if found else (middle, bad, failing)
    return Limit(good_hz=good, bad_hz=bad, failing=failing)


def _failing(bench: Bench, home: BenchState, frequency_hz: float, phases: int) -> Literal["refuses", "breaks"] | None:
    """Return how the firmware fails at a speed, or None."""
    for trial in motion_trials(frequency_hz, phases, quiet_readings=1.5):
        try:
            outcome = trial.play(bench, home)
        except Stopped:
            return "breaks"
        if outcome.wrong:
            return "breaks"
        if not outcome.inserted:
            return "refuses"
    return None
