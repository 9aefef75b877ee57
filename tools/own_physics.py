"""Effects as a user writes them, and physics outside the library for logs, of the games of tools/own_games.py."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

import rtec
from rtec.metrology import Measurement, Reading

Array = np.ndarray
Rng = np.random.Generator
Quantities = dict[str, Array]


@rtec.effect(over="position")
def dent(position, *, place: rtec.Within(0, 700, "mm"), width: rtec.Within(4, 80, "mm")):
    "A bump of some width at some place."
    return np.exp(-(((position - place) / width) ** 2))


@rtec.effect(over="velocity")
def saturation(velocity, *, speed: rtec.Within(1, 60, "mm/s")):
    "A friction that grows with speed and saturates."
    return np.tanh(velocity / speed)


@rtec.effect(over="time")
def settling(time, position, *, constant: rtec.Within(20, 20000, "s")):
    "A length that settles from the start."
    return position * np.exp(-(time - time[0]) / constant)


@rtec.effect(over="temperature")
def snap(temperature, *, at: rtec.Within(15, 30, "degC")):
    "A joint that snaps at some temperature."
    return np.where(temperature > at, 1.0, 0.0)


@rtec.effect(over="oil_level")
def dry(oil_level, *, least: rtec.Within(0, 10, "")):
    "A film that thins below some level of oil."
    return np.maximum(least - oil_level, 0.0)


STATIC = ("scale", "pitch_map", "cyclic", "backlash", "backlash_map")
FORCES = ("inertia", "viscous", "cogging", "force_offset")
OWN = MappingProxyType({
    "dent": (dent, ("scale", "cyclic", "backlash", "backlash_map", "drift")),
    "saturation": (saturation, FORCES),
    "settling": (settling, ("cyclic", "backlash", "backlash_map")),
    "snap": (snap, (*STATIC, "drift")),
    "dry": (dry, (*STATIC, "drift")),
})  # fmt: skip
"""Effects that somebody wrote, and those of the library that are hidden beside them: none that looks like them."""


def own_numbers(name: str, q: Quantities, rng: Rng) -> dict[str, float]:
    """Return numbers of an own effect that the readings can show."""
    x, t = q.get("position", np.zeros(1)), q["time"]
    if name == "dent":
        gap = np.ptp(x) / max(np.unique(np.round(x)).size - 1, 1)
        width = float(np.clip(np.ptp(x) * rng.uniform(0.03, 0.1), max(4.0, 2.0 * gap), 80.0))
        return {"place": float(x.min() + np.ptp(x) * rng.uniform(0.15, 0.85)), "width": width}
    if name == "saturation":
        return {"speed": float(rng.uniform(3.0, 25.0))}
    if name == "settling":
        return {"constant": float(np.ptp(t) * rng.uniform(0.1, 0.4))}
    column, key = {"snap": ("temperature", "at"), "dry": ("oil_level", "least")}[name]
    return {key: float(np.quantile(q[column], rng.uniform(0.3, 0.7)))}


@dataclass(frozen=True, slots=True)
class OfLogs:
    """Physics outside the library in a log: how it was read, what it adds, and what it is a function of."""

    reading: Reading
    added: Callable[[Quantities, Rng], Array]
    over: tuple[str, ...]


def _resonance(q: Quantities, rng: Rng) -> Array:
    return np.exp(-(((np.abs(q["velocity"]) / rng.uniform(15, 40) - 1) / 0.3) ** 2))


def _room(q: Quantities, rng: Rng) -> Array:
    return np.sin(rng.uniform(2.2, 5) * 2 * np.pi * q["time"] / q["time"][-1] + rng.uniform(0, 6))


def _sticky_place(q: Quantities, rng: Rng) -> Array:
    where = (q["share"] - rng.uniform(0.2, 0.8)) / rng.uniform(0.08, 0.15)
    return np.sign(q["velocity"]) * np.exp(-(where**2))


def _thick_oil(q: Quantities, rng: Rng) -> Array:
    return q["velocity"] * np.cos(np.pi * rng.uniform(1, 2) * q["share"] + rng.uniform(0, 6))


def _soft_loop(q: Quantities, rng: Rng) -> Array:
    return q["velocity"] * np.abs(q["velocity"])


def _squat(q: Quantities, rng: Rng) -> Array:
    return np.abs(q["acceleration"])


def _lift(q: Quantities, rng: Rng) -> Array:
    return np.abs(q["velocity"]) / (np.abs(q["velocity"]) + rng.uniform(5, 20))


LOGS = MappingProxyType({
    "resonance": OfLogs(Reading.DRIVE, _resonance, ("velocity",)),
    "room": OfLogs(Reading.DRIVE, _room, ("time",)),
    "sticky_place": OfLogs(Reading.DRIVE, _sticky_place, ("direction", "position")),
    "thick_oil": OfLogs(Reading.DRIVE, _thick_oil, ("position", "velocity")),
    "soft_loop": OfLogs(Reading.MOVING, _soft_loop, ("velocity",)),
    "squat": OfLogs(Reading.MOVING, _squat, ("acceleration",)),
    "lift": OfLogs(Reading.MOVING, _lift, ("velocity",)),
    "slow_wave": OfLogs(Reading.MOVING, _room, ("time",)),
})  # fmt: skip
_BY_OVER = MappingProxyType({
    "position": "chirped_cyclic growing_wave partial_wave missing_tooth scale_joints gib_dents",
    "time": "room_wave pump_cycle weather turning_drift",
    "time, direction run": "lost_at_reversals",
    "position time": "fading_wave breathing_ribs travelling_wave passing_chip snapping_map swaying_map "
    "day_and_night breathing_scale",
    "position run, position time": "moving_bump sliding_joint worn_in",
    "direction position time": "late_map twisting_play",
    "direction position run, direction position time": "one_way_bump",
    "direction position run, position time": "slipping_wave",
    "direction time": "breathing_play",
    "direction run, direction time": "counting_play flipping_play",
    "direction dwell_s": "dwell_reversal",
    "run since_reversal, since_reversal time": "creep_after_rest",
    "": "stick_slip",
})  # fmt: skip
OVER = {
    kind: tuple(tuple(one.split()) for one in over.split(","))
    for over, kinds in _BY_OVER.items()
    for kind in kinds.split()
} | {name: (kind.over,) for name, kind in LOGS.items()}
"""What each error outside the library is a function of, or as well of; nothing where it is one of no column."""


def quantities(m: Measurement) -> Quantities:
    """Return what an error may depend on at each reading, in the order of the file."""
    found = {name: m.columns[name].values for name in ("time", "velocity") if name in m.columns}
    found["position"] = m.columns["target" if "target" in m.columns else "actual"].values
    found["share"] = (found["position"] - found["position"].min()) / np.ptp(found["position"])
    if "velocity" in found:
        found["acceleration"] = np.gradient(found["velocity"], found["time"])
    phase = 2 * np.pi * found["time"] / found["time"][-1]
    for name, low in (("temperature", 20.0), ("oil_level", 5.0)):
        found[name] = np.round(low + 1.5 * np.sin(2.3 * phase + len(name)) + 0.8 * np.cos(3.7 * phase), 2)
    return found
