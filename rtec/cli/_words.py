"""Words that the shell completes. Plain text: at completion nothing that computes is imported; tests hold it true."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

EFFECTS = (
    "offset", "scale", "pitch_map", "cyclic", "backlash", "backlash_map", "windup", "reversal_spike", "hysteresis",
    "thermal_growth", "thermal_shift", "warm_up", "warm_up_growth", "run_offset", "refraction", "dead_path", "drift",
    "servo_lag", "acceleration_lag", "interpolation", "eccentricity", "lost_counts", "quantisation", "cosine",
    "inertia", "viscous", "coulomb", "asymmetric_friction", "stribeck", "force_offset", "cogging", "gravity",
    "force_map", "load_friction", "screw_runout", "torque_ripple",
)  # fmt: skip
"""Of the library."""
PROCESSORS = ("8051-12mhz", "8051-24mhz", "one-clock-25mhz", "one-clock-100mhz")
MOTIONS = ("steady", "ramp", "reversal", "dither", "adversary")
FAULTS = (
    "frame-lost", "frame-late", "frame-duplicated", "frames-reordered", "frame-corrupted", "masquerade",
    "bit-flipped-in-the-total", "request-stuck", "babbling-node", "bus-off", "stale-data-valid",
    "torn-position-word", "pc-killed", "box-restarted", "power-lost", "pc-clock-jumps-forward",
    "pc-clock-jumps-back", "encoder-cable-open", "a-and-b-swapped", "one-line-of-a-pair-broken", "glitches",
    "disable-switch-thrown", "probe-trip", "processor-hung", "hold-latch-stuck-closed",
)  # fmt: skip
"""Classes of ``rtec safety``."""
OPEN_FAULTS = (
    "encoder-cable-open", "a-and-b-swapped", "one-line-of-a-pair-broken", "glitches", "power-lost", "box-restarted",
    "disable-switch-thrown", "a-stuck-low", "a-stuck-high", "b-stuck-low", "b-stuck-high", "glitch-on-a",
    "glitch-on-b", "noise-burst", "missed-edge", "phase-error", "duty-error", "processor-hung", "clock-fast",
    "clock-slow", "hold-latch-stuck-closed", "hold-latch-stuck-open", "request-corrupted",
)  # fmt: skip
"""Of ``rtec simulate``."""
PHASES = ("start-up", "at-rest", "cutting", "rapid", "reversal", "insertion", "probing", "large-correction")
"""Of the machine, of ``rtec safety``."""
CAMPAIGNS = (
    "safety", "pairs", "open-faults", "soak", "envelope", "motions", "check", "firmware", "blind", "sensitivity",
)  # fmt: skip
"""Plans of ``rtec campaign``."""
QUANTITIES = ("deviation", "force", "torque", "current", "voltage")
INTERFACES = (
    "canalystii", "cantact", "etas", "gs_usb", "iscan", "ixxat", "kvaser", "neousys", "neovi", "nican", "nixnet",
    "pcan", "robotell", "seeedstudio", "serial", "slcan", "socketcan", "socketcand", "systec", "udp_multicast",
    "usb2can", "vector", "virtual",
)  # fmt: skip
"""Of python-can."""
PLANS = (
    "base", "dwell", "temperature", "right_forward", "dense", "moving", "drive", "soft_drive", "joint", "one_speed",
    "loads", "weather", "one_day", "turn", "single_pass", "one_feed", "turned_once", "two_runs", "sparse", "one_way",
    "one_pose", "one_heating",
)  # fmt: skip
"""Of the game."""
PREDICTORS = (
    "table-uni-directional-linear", "table-uni-directional-cubic", "table-bi-directional-linear",
    "table-bi-directional-cubic", "squareness", "straightness", "angles", "effects",
    *(f"network-{size}-{by}" for size in ("40", "30-10", "30-+-8") for by in ("lm", "rprop", "scg", "bfgs")),
)  # fmt: skip
"""Rows of ``rtec train``, as one word each."""
MOTION_MODELS = ("servo-lag", "ARX", "physical", "NARX", "hybrid")
"""Rows of ``rtec train --dynamic``, likewise."""
WARM_MODELS = (
    "least-squares", "ridge", "first-order-lags", "LS-SVM", "fuzzy-network-product", "fuzzy-network-minimum",
    "Bayesian-network", "Bayesian-network-mode", "Bayesian-network-with-LS-SVM", "named-effects",
)  # fmt: skip
"""Rows of ``rtec train`` on a warm machine, likewise."""
_OF_OPTION = {"--processor": PROCESSORS, "--interface": INTERFACES, "--observe": QUANTITIES, "--motion": MOTIONS}
"""Of options whose metavar does not list them."""

Completer = Callable[[str], list[str]]


def completing(words: Sequence[str]) -> Completer:
    """Return what completes these words, in any case of letters.

    Examples
    --------
    >>> completing(("original", "a", "b"))("O")
    ['original']
    """

    def complete(incomplete: str) -> list[str]:
        return [word for word in words if word.lower().startswith(incomplete.lower())]

    return complete


def among(metavar: str, option: str = "") -> Completer | None:
    """Return what completes an option: the words that its metavar lists, or what its name stands for.

    Examples
    --------
    >>> among("mm|inch|FILE")("")
    ['mm', 'inch']
    >>> among("500kHz") is None, among("NAME", "--processor")("8051-1")
    (True, ['8051-12mhz'])
    """
    if option in _OF_OPTION:
        return completing(_OF_OPTION[option])
    parts = metavar.split("|")
    listed = [part for part in parts if re.fullmatch(r"[a-z0-9,+-][a-z0-9,-]*", part)]
    return completing(listed) if len(parts) > 1 and listed else None


def files_ending(*suffixes: str) -> Completer:
    """Return what completes files of some kinds, and folders on the way to them.

    Examples
    --------
    >>> files_ending(".no-such-suffix")("no such folder/x")
    []
    """

    def complete(incomplete: str) -> list[str]:
        folder, _, begun = incomplete.rpartition("/")
        place = Path(f"{folder}/" if "/" in incomplete else ".")
        found = []
        for entry in sorted(place.iterdir()) if place.is_dir() else []:
            if entry.name.startswith(begun) and (begun.startswith(".") or not entry.name.startswith(".")):
                text = f"{folder}/{entry.name}" if "/" in incomplete else entry.name
                if entry.is_dir():
                    found.append(f"{text}/")
                elif entry.name.lower().endswith(suffixes):
                    found.append(text)
        return found

    return complete
