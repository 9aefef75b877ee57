"""Plans, noise and physics of the second family of games: written from the formulas of docs/effects.md alone."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rng = np.random.Generator
TAU = 2 * np.pi


@dataclass(slots=True, kw_only=True)
class Plan:
    """Where and when the readings are taken; lengths in mm (deg), times in s, deviations in um (arcsec).

    Parameters
    ----------
    kind
        What sort of measurement.
    rotary
        Whether ``x`` is an angle in deg.
    x, d, run, t, r, v, a
        One of each a reading: position, direction, run, time, distance since the reversal, velocity, acceleration.
    columns
        What the file tells besides position and the observed quantity.
    facts
        Lines of the head of the file.
    heat
        Temperatures that act, in degC, by the name of their column.
    air, load
        Refractive index less that of standard air, in 1e-6; load in kg; None where there is none.
    twice
        Whether the logger wrote each sample twice.
    """

    kind: str
    rotary: bool
    x: Array
    d: Array
    run: Array
    t: Array
    r: Array
    v: Array
    a: Array
    columns: dict[str, Array] = field(default_factory=dict)
    facts: dict[str, str] = field(default_factory=dict)
    heat: dict[str, Array] = field(default_factory=dict)
    air: Array | None = None
    load: Array | None = None
    twice: bool = False

    @property
    def span(self) -> float:
        """Distance between the ends."""
        return float(np.ptp(self.x))

    @property
    def moving(self) -> bool:
        """Whether it is a log."""
        return self.kind in ("log", "drive")

    @property
    def closes(self) -> bool:
        """Whether it is about one turn, over which a smooth curve is a wave."""
        return self.rotary and 270 <= self.span <= 540

    @property
    def returns(self) -> bool:
        """Whether places are passed again, so that time and position are apart."""
        return self.moving or self.run[-1] > 1 or float(np.ptp(self.d)) > 1

    @property
    def of_force(self) -> bool:
        """Whether a force is observed."""
        return self.kind in ("drive", "held")

    @property
    def places(self) -> int:
        """Different positions."""
        return len(np.unique(np.round(self.x, 9)))


def between(rng: Rng, low: float, high: float) -> float:
    """Return a number that is log-uniform between two."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


# plans


def _targets(rng: Rng, span: float, number: int) -> Array:
    even = np.linspace(0, span, number)
    sort = rng.choice(["even", "jitter", "uneven"], p=[0.4, 0.35, 0.25])
    if sort == "even":
        return even
    if sort == "jitter":
        return np.round(even + rng.uniform(-0.35, 0.35, number) * span / (number - 1), 3)
    return np.round(np.sort(np.concatenate([[0, span], rng.uniform(0, span, number - 2)])), 3)


def at_rest(rng: Rng, kind: str) -> Plan:
    """Return readings at targets.

    Parameters
    ----------
    rng
        Draws all of it.
    kind
        ``rest``, ``scan`` (many targets once), ``dense`` (many readings after reversals), ``fine`` (a few signal
        periods), ``weather`` (several days), ``fly`` (several feeds), ``warm`` (hours) or ``held`` (a force).
    """
    rotary = bool(rng.random() < 0.3) and kind not in ("fine", "weather")
    span = float(rng.choice([180, 360, 360, 720, 1080])) if rotary else float(np.round(between(rng, 80, 3000)))
    runs = int(between(rng, 1, 11)) if kind in ("rest", "dense") else 1
    number = int(between(rng, 5, 60))
    if kind in ("scan", "held", "dense"):
        number = int(between(rng, 60, 200) if kind != "dense" else between(rng, 25, 60))
    elif kind == "fine":
        period = float(rng.choice([0.004, 0.02, 0.02, 0.04, 0.1]))
        span, number = period * rng.integers(5, 12), int(rng.integers(60, 160))
    elif kind in ("weather", "fly"):
        runs, number = int(rng.integers(4, 9)), int(rng.integers(6, 21))
    elif kind == "warm":
        runs, number = int(rng.integers(12, 60)), int(rng.integers(2, 8))
    targets = _targets(rng, span, number) if kind != "fine" else np.linspace(0, span, number)
    both = bool(rng.random() < 0.75) or kind == "dense"
    runs = min(max(runs, math.ceil(8 / (number * (1 + both)))), max(1, 400 // (number * (1 + both))))
    x, d, run, r = _tour(rng, targets, runs, both=both, free=kind == "rest")
    pause = between(rng, 1, 900) if kind != "warm" else between(rng, 60, 600)
    clock = bool(rng.random() < 0.6) or kind == "warm"
    t = np.cumsum(np.full(len(x), rng.uniform(3, 30)) * (rng.uniform(0.8, 1.4, len(x)) if clock else 1))
    if clock:
        t += pause * (run - 1) + (86400 * (run - 1) if kind == "weather" else 0)
    zero = np.zeros(len(x))
    plan = Plan(kind=kind, rotary=rotary, x=x, d=d, run=run, t=t - t[0], r=r, v=zero, a=zero)
    if clock:
        plan.columns[str(rng.choice(["time_s", "time_min", "time_h"]))] = plan.t
    if runs > 1 or rng.random() < 0.5:
        plan.columns["run"] = run
    if both or rng.random() < 0.5:
        plan.columns["direction"] = d
    if kind == "fine":
        plan.facts["scale_signal_period"] = f"{period * 1000:g} um"
    _conditions(rng, plan, runs, clock=clock)
    return plan


def _tour(rng: Rng, targets: Array, runs: int, *, both: bool, free: bool) -> tuple[Array, Array, Array, Array]:
    """Return positions, directions, runs and distances since the reversal."""
    number = len(targets)
    up, size = np.arange(number), number * (1 + both)
    run = np.repeat(np.arange(1, runs + 1), size).astype(float)
    sort = rng.choice(["there and back", "steps", "any order"], p=[0.7, 0.15, 0.15]) if free else "there and back"
    if sort == "any order":
        order = np.concatenate([rng.permutation(np.tile(up, 1 + both)) for _ in range(runs)])
        way = np.diff(targets[order], prepend=-np.inf if order[0] else targets[0] - 1)
        d = np.where(way == 0, 1.0, np.sign(way))
        return targets[order], d, run, np.abs(np.where(np.isfinite(way), way, 1))
    if sort == "steps" and both:
        x, d = targets[np.tile(np.repeat(up, 2), runs)], np.tile([1.0, -1.0], number * runs)
        return x, d, run, np.full(len(x), float(np.ptp(targets)) / number)
    x = targets[np.tile(np.concatenate([up, up[::-1]]) if both else up, runs)]
    d = np.tile(np.repeat([1.0, -1.0], number) if both else np.ones(number), runs)
    return x, d, run, np.abs(x - np.where(d > 0, targets[0], targets[-1]))


def _conditions(rng: Rng, plan: Plan, runs: int, *, clock: bool) -> None:
    """Add columns of feed, load, heat and weather, of which not all act."""
    kind, day = plan.kind, plan.run.astype(int) - 1
    if kind == "fly":
        feeds = rng.permutation(np.geomspace(300, rng.uniform(3000, 20000), runs))
        plan.v = plan.d * feeds[day] / 60
        plan.columns["feed_deg_s" if plan.rotary else "feed_mm_min"] = np.abs(plan.v) * (1 if plan.rotary else 60)
    elif not plan.rotary and rng.random() < 0.15:
        plan.columns["feed_mm_min"] = np.full(len(plan.x), 1000.0)
    if rng.random() < 0.1:
        plan.columns["load_kg"] = np.round(rng.choice([10.0, 50, 120], runs))[day]
    if kind == "warm" or (clock and rng.random() < 0.35):
        _heat(rng, plan)
    if kind == "weather":
        _weather(rng, plan, runs)


def _heat(rng: Rng, plan: Plan) -> None:
    """Add what one to three sensors show while the machine is heated, and left to cool or not."""
    t, end = plan.t, plan.t[-1]
    rise, lag = rng.uniform(2, 15), end * rng.uniform(0.1, 0.4)
    off = end * rng.uniform(0.4, 0.75) if rng.random() < 0.7 else np.inf
    level = 1 - np.exp(-t / lag)
    warm = np.where(t < off, level, (1 - np.exp(-min(off, end) / lag)) * np.exp(-np.maximum(t - off, 0) / lag))
    screw = 20 + rng.uniform(-1, 1) + rise * warm
    room = 20 + rng.uniform(0.3, 1.5) * np.sin(TAU * t / end * rng.uniform(0.5, 2.5) + rng.uniform(0, 6))
    plan.heat["screw"] = screw
    others = {"room": room, "head": 20 + rise * 0.6 * warm**1.6 + 0.4 * (room - 20)}
    shown = {"screw": screw} | {name: others[name] for name in list(others)[: int(rng.integers(0, 3))]}
    digits, unit = int(rng.choice([1, 2, 3])), rng.choice(["degc", "degc", "degf"])
    for name, value in shown.items():
        seen = np.round(value + rng.normal(0, 0.02, len(t)), digits)
        plan.columns[f"temperature_{name}_{unit}"] = seen * 1.8 + 32 if unit == "degf" else seen


def _within(plan: Plan) -> Array:
    """Return the share of a run that has passed."""
    size = int(np.sum(plan.run == 1))
    return np.arange(len(plan.x)) % size / size


def _weather(rng: Rng, plan: Plan, runs: int) -> None:
    day = plan.run.astype(int) - 1
    pressure = np.round(rng.uniform(980, 1030, runs)[day] + rng.uniform(-6, 6, runs)[day] * _within(plan), 1)
    celsius = np.round(rng.uniform(19, 22, runs)[day] + rng.normal(0, 0.05, len(day)), 2)
    humid = np.round(rng.uniform(30, 65, runs)[day], 0)
    plan.columns |= {"pressure_hpa": pressure, "temperature_air_degc": celsius, "humidity_percent": humid}
    steam = humid / 100 * 6.112 * np.exp(17.62 * celsius / (243.12 + celsius))  # hPa (Magnus)
    dense = 288.6 * (pressure / 1013.25) * 288.15 / (celsius + 273.15) * 0.9629  # 1e-6, near 271.8 at 20 degC
    plan.air = dense - 0.0373 * steam - (288.6 * 288.15 / 293.15 * 0.9629 - 0.0373 * 11.69)


def in_motion(rng: Rng, kind: str) -> Plan:
    """Return a log of moves between random places: ``log`` (of a deviation) or ``drive`` (of a force or current)."""
    rotary = bool(rng.random() < 0.35)
    span = float(rng.choice([90, 360, 720])) if rotary else between(rng, 60, 1500)
    moves, fast = int(rng.integers(6, 16)), between(rng, 0.3, 2) * span
    ends = rng.uniform(0, span, moves + 1)
    ends[:2] = 0, span
    for k in range(2, moves + 1):  # there and back again, by different lengths
        ends[k] = rng.uniform(ends[k - 1] * 0.5 + 0.5 * span, span) if k % 2 else rng.uniform(0, 0.6 * ends[k - 1])
    if rng.random() < 0.5:
        ends = span - ends
    takes = np.abs(np.diff(ends)) / (fast * 10 ** rng.uniform(-1.3, 0, moves)) + 0.02
    rests = kind == "drive" and rng.random() < 0.5
    dwell = rng.uniform(0.02, 0.2, moves) * takes.mean() if rests else np.zeros(moves)
    total, rows = float(np.sum(takes + dwell)), int(between(rng, 500, 2500))
    fine = np.linspace(0, total, rows * 8)
    begins = np.concatenate([[0], np.cumsum(takes + dwell)[:-1]])
    form, x = rng.choice(["cycloid", "harmonic", "ramp"]), np.full(len(fine), ends[0])
    for k in range(moves):
        share = np.clip((fine - begins[k]) / takes[k], 0, 1)
        x += (ends[k + 1] - ends[k]) * _profile(str(form), share)
    v = np.gradient(x, fine)
    a = np.gradient(v, fine)
    d = np.where(np.abs(v) > 1e-6 * np.abs(v).max(), np.sign(v), 0.0)
    r = np.abs(x - ends[np.clip(np.searchsorted(begins, fine, side="right") - 1, 0, moves)])
    step = total / rows
    at = (np.arange(rows) + (rng.uniform(-0.1, 0.1, rows) if rng.random() < 0.4 else 0)) * step
    twice = bool(rng.random() < 0.15)
    if twice:
        at = np.repeat((at + np.zeros(rows))[::2], 2)[:rows]
    taken = np.clip(np.searchsorted(fine, at), 0, len(fine) - 1)
    plan = Plan(
        kind=kind,
        rotary=rotary,
        x=x[taken],
        d=d[taken],
        run=np.ones(rows),
        t=fine[taken],
        r=r[taken],
        v=v[taken],
        a=a[taken],
        twice=twice,
    )
    plan.columns["time_s" if rng.random() < 0.7 else "time_ms"] = np.arange(rows) * step
    if rng.random() < 0.35:
        blur = rng.normal(0, 0.002 * fast, rows)
        seen = plan.v + (np.repeat(blur[::2], 2)[:rows] if twice else blur)
        plan.columns["velocity_deg_s" if rotary else "velocity_mm_s"] = seen
    if kind == "drive" and rng.random() < 0.3:
        loads = rng.choice([5.0, 20, 40, 80], moves)
        plan.load = loads[np.clip(np.searchsorted(begins, plan.t, side="right") - 1, 0, moves - 1)]
        plan.columns["load_kg"] = plan.load
    return plan


def _profile(form: str, share: Array) -> Array:
    if form == "cycloid":
        return share - np.sin(TAU * share) / TAU
    if form == "harmonic":
        return (1 - np.cos(np.pi * share)) / 2
    grid = np.linspace(0, 1, 2001)
    speed = np.minimum(1, np.minimum(grid, 1 - grid) / 0.2)
    way = np.cumsum(speed * speed * (3 - 2 * speed))
    return np.interp(share, grid, (way - way[0]) / (way[-1] - way[0]))


# noise of RMS 1

NOISES = ("gauss", "student", "laplace", "uniform", "rounded", "wander", "direction", "along")


def noise_of(rng: Rng, plan: Plan, sort: str) -> Array:
    """Return a draw of one sort of noise, of an RMS near 1."""
    size = len(plan.x)
    white = rng.normal(size=size)
    if sort == "student":
        white = rng.standard_t(4, size) / np.sqrt(2)
    elif sort == "laplace":
        white = rng.laplace(0, np.sqrt(0.5), size)
    elif sort == "uniform":
        white = rng.uniform(-np.sqrt(3), np.sqrt(3), size)
    elif sort == "wander":
        slow = _memory(white, 1 - 1 / min(20, size / 6))
        white = 0.6 * slow / np.std(slow) + 0.8 * rng.normal(size=size)
    elif sort == "direction":
        white *= np.where(plan.d > 0, 0.7, 1.3)
    elif sort == "along":
        white *= 0.6 + 0.8 * plan.x / plan.span
    return white


# effects of the library, each a column of arbitrary size; None where the plan cannot show it


def _curve(rng: Rng, plan: Plan) -> Array:
    s = plan.x / plan.span
    sort = rng.integers(3)
    if sort == 0:
        return np.polynomial.legendre.legval(2 * s - 1, np.append([0, 0], rng.normal(size=4) / [1, 1, 1.5, 2]))
    if sort == 1:
        return sum(rng.normal() * np.exp(-(((s - at) / rng.uniform(0.2, 0.4)) ** 2)) for at in (0.1, 0.5, 0.8))
    return sum(rng.normal() / k * np.sin(np.pi * k * s + rng.uniform(0, TAU)) for k in (1, 2, 3))


def _wave(rng: Rng, plan: Plan, period: float, harmonics: int = 3) -> Array:
    phase = TAU * plan.x / period
    high = rng.uniform(0, 0.6, harmonics)
    high[0] = 1
    return sum(h * np.sin((k + 1) * phase + rng.uniform(0, TAU)) for k, h in enumerate(high))


def _cyclic(rng: Rng, plan: Plan) -> Array | None:
    places = np.unique(plan.x)
    step = float(np.abs(np.diff(plan.x)).max()) if plan.moving else plan.span / (len(places) - 1)
    low, high = 3.3 * step, min(plan.span / 6, 100.0 if plan.rotary else np.inf)
    if len(places) < 14 or low > high:
        return None
    period = between(rng, low, high)
    if plan.rotary:
        period = 360 / max(4, round(360 / period))
    elif rng.random() < 0.5:
        period = float(f"{period:.2g}")
        plan.facts["screw_pitch"] = f"{period:g} mm"
    harmonics = 1 if period < 7 * step else int(rng.integers(1, 4))
    wave = _wave(rng, plan, period, harmonics)
    if not plan.of_force and np.ptp(plan.d) > 1 and rng.random() < 0.25:
        wave = np.where(plan.d > 0, wave, _wave(rng, plan, period, harmonics))
    return wave


def _both(plan: Plan) -> bool:
    return bool(np.ptp(plan.d) > 1)


def _after(rng: Rng, plan: Plan) -> Array | None:
    if not _both(plan) or (plan.kind != "dense" and not plan.moving):
        return None
    return np.exp(-plan.r / (plan.span * between(rng, 0.06, 0.2)))


def _timed(plan: Plan) -> bool:
    return any(name.startswith("time") for name in plan.columns)


def _settled(rng: Rng, plan: Plan) -> Array | None:
    if plan.moving or not _timed(plan) or not plan.returns:
        return None
    return 1 - np.exp(-plan.t / (plan.t[-1] * between(rng, 0.1, 0.4)))


def _steps(rng: Rng, plan: Plan) -> Array | None:
    if not _timed(plan) or len(plan.x) < 16 or not plan.returns:
        return None
    return (np.arange(len(plan.x)) >= int(len(plan.x) * rng.uniform(0.15, 0.85))).astype(float)


def _springs(rng: Rng, plan: Plan) -> Array | None:
    if plan.kind != "log":
        return None
    widths = np.linspace(0.03, 1, 12) * plan.span * between(rng, 0.15, 0.6)
    bent, found = np.zeros(12), np.zeros(len(plan.x))
    for k, move in enumerate(np.diff(plan.x, prepend=plan.x[0])):
        bent = np.clip(bent + move, -widths, widths)
        found[k] = np.mean(bent / widths)
    return found


def _when(good: bool, column: Callable[[], Array]) -> Array | None:
    return column() if good else None


OF_POSITION: dict[str, Callable[[Rng, Plan], Array | None]] = {
    "scale": lambda g, p: p.x,
    "pitch_map": lambda g, p: _when(p.places >= 9 and p.kind != "fine" and not p.closes, lambda: _curve(g, p)),
    "cyclic": lambda g, p: None if p.kind == "fine" else _cyclic(g, p),
    "backlash": lambda g, p: _when(_both(p), lambda: p.d),
    "backlash_map": lambda g, p: _when(_both(p) and p.places >= 9 and not p.closes, lambda: p.d * (1 + _curve(g, p))),
    "windup": lambda g, p: None if (e := _after(g, p)) is None else p.d * (1 - e),
    "reversal_spike": lambda g, p: None if (e := _after(g, p)) is None else p.d * e,
    "hysteresis": _springs,
    "thermal_growth": lambda g, p: _when(
        bool(p.heat) and p.returns, lambda: (p.x - g.uniform(0, 1) * p.span) * (p.heat["screw"] - 20)
    ),
    "thermal_shift": lambda g, p: _when(bool(p.heat) and p.returns, lambda: p.heat["screw"] - 20),
    "warm_up": _settled,
    "warm_up_growth": lambda g, p: None if (s := _settled(g, p)) is None else s * p.x,
    "run_offset": lambda g, p: _when(
        3 <= p.run[-1] <= 10 and p.kind != "weather", lambda: g.normal(size=11)[p.run.astype(int)]
    ),
    "refraction": lambda g, p: _when(p.air is not None, lambda: p.x * p.air / 1000),
    "dead_path": lambda g, p: _when(p.air is not None, lambda: p.air),
    "drift": lambda g, p: _when(p.returns, lambda: p.t),
    "servo_lag": lambda g, p: _when(bool(np.any(p.v)), lambda: -p.v),
    "acceleration_lag": lambda g, p: _when(p.kind == "log", lambda: -p.a),
    "interpolation": lambda g, p: _when(
        p.kind == "fine", lambda: _wave(g, p, float(p.facts["scale_signal_period"][:-3]) / 1000, 2)
    ),
    "eccentricity": lambda g, p: _when(p.rotary and p.span >= 350 and p.places >= 16, lambda: _wave(g, p, 360.0, 2)),
    "lost_counts": _steps,
}
OF_FORCE: dict[str, Callable[[Rng, Plan], Array | None]] = {
    "inertia": lambda g, p: _when(p.moving, lambda: p.a),
    "viscous": lambda g, p: _when(p.moving, lambda: p.v),
    "coulomb": lambda g, p: _when(
        p.moving, lambda: p.d * (1 - np.exp(-p.r / p.span * between(g, 60, 300)) if g.random() < 0.25 else 1)
    ),
    "asymmetric_friction": lambda g, p: _when(p.moving, lambda: np.abs(p.v)),
    "stribeck": lambda g, p: _when(
        p.moving, lambda: p.d * np.exp(-((p.v / (np.abs(p.v).max() * between(g, 0.03, 0.2))) ** 2))
    ),
    "force_offset": lambda g, p: np.ones(len(p.x)),
    "cogging": _cyclic,
    "gravity": lambda g, p: _when(p.rotary, lambda: np.sin(np.radians(p.x) + g.uniform(0, TAU))),
    "force_map": lambda g, p: _when(not p.rotary, lambda: _curve(g, p)),
    "load_friction": lambda g, p: _when(p.load is not None and np.ptp(p.load) > 0, lambda: p.load * p.d),
}
POSITIVE = {"inertia", "viscous", "coulomb", "stribeck", "load_friction", "refraction", "dead_path"}
CLASHES = (
    {"scale", "pitch_map"},
    {"backlash", "backlash_map"},
    {"windup", "reversal_spike"},
    {"windup", "hysteresis"},
    {"windup", "backlash_map"},
    {"reversal_spike", "backlash_map"},
    {"thermal_growth", "thermal_shift"},
    {"eccentricity", "pitch_map"},
    {"warm_up", "warm_up_growth"},
    {"eccentricity", "cyclic"},
    {"gravity", "force_map"},
    {"hysteresis", "reversal_spike"},
    {"hysteresis", "backlash_map"},
)
"""Never planted together: one contains the other, or both are one curve."""
CAPS = {
    "scale": 1.0,  # um/mm
    "thermal_growth": 0.03,  # um/mm/K
    "thermal_shift": 40.0,  # um/K
    "refraction": 1.5,
    "dead_path": 3.0,  # m
    "servo_lag": 100.0,  # ms
}
"""Largest amplitudes of a linear axis that are plausible."""
IN_TIME = ("drift", "warm_up", "warm_up_growth", "lost_counts", "thermal_growth", "thermal_shift", "run_offset")
NEEDS = {"asymmetric_friction": "viscous", "stribeck": "coulomb"}
SAME_SIGN = {"backlash", "windup", "reversal_spike", "hysteresis"}


def rivals(plan: Plan) -> dict[str, Array]:
    """Return columns of look-alikes that an effect must differ from, as matrices by name."""
    x, d, t = plan.x / plan.span, plan.d, plan.t / max(plan.t[-1], 1e-9)
    found = {"scale": x[:, None], "drift": t[:, None], "backlash": d[:, None]}
    curves = np.polynomial.legendre.legvander(2 * x - 1, 8 if plan.places > 12 else 3)
    if plan.of_force:
        return {"viscous": plan.v[:, None], "coulomb": d[:, None], "inertia": plan.a[:, None], "force_map": curves}
    found |= {"pitch_map": curves, "backlash_map": curves * d[:, None]}
    for lag in (0.1, 0.2, 0.4, 1):
        found[f"warm_up {lag}"] = (1 - np.exp(-t / lag))[:, None]
        found[f"warm_up_growth {lag}"] = (x * (1 - np.exp(-t / lag)))[:, None]
    for name, heat in plan.heat.items():
        found |= {f"thermal_shift {name}": heat[:, None], f"thermal_growth {name}": (x * heat)[:, None]}
    if 1 < plan.run[-1] <= 10:
        found["run_offset"] = (plan.run[:, None] == np.unique(plan.run)[None]).astype(float)
    if plan.air is not None:
        found |= {"dead_path": plan.air[:, None], "refraction": (x * plan.air)[:, None]}
    if plan.kind == "log":
        for length in (0.01, 0.03, 0.1, 0.3):
            found[f"windup {length}"] = np.stack([d, d * np.exp(-plan.r / plan.span / length)], 1)
    if np.any(plan.v):
        found |= {"servo_lag": plan.v[:, None], "acceleration_lag": plan.a[:, None]}
    return found


# physics outside the library, each a column of arbitrary size, or the whole observed course where it is no sum


def _since(flags: Array, t: Array) -> Array:
    """Return the time since the last reading that was flagged."""
    last = np.maximum.accumulate(np.where(flags, np.arange(len(t)), 0))
    return t - t[last]


def _chaos(size: int, every: int = 1) -> Array:
    at, found = np.array([1.0, 1.0, 20.0]), np.zeros(size)
    for k in range(size * every):
        x, y, z = at
        at = at + 0.01 * np.array([10 * (y - x), x * (28 - z) - y, x * y - 8 / 3 * z])
        found[k // every] = at[0]
    return found


def _memory(of: Array, keep: float) -> Array:
    found = np.zeros(len(of))
    for k in range(1, len(of)):
        found[k] = keep * found[k - 1] + (1 - keep) * of[k]
    return found


def _part(plan: Plan, low: float, high: float) -> Array:
    s = np.arange(len(plan.x)) / len(plan.x)
    return ((s > low) & (s < high)).astype(float)


def _stops(plan: Plan) -> Array:
    """Return the time since each start, stop or reversal."""
    return _since(np.abs(np.diff(plan.d, prepend=plan.d[0])) > 0, plan.t)


def _hz(plan: Plan, share: float) -> Array:
    """Return the phase of an oscillation, by the share of the sampling rate."""
    return TAU * share * np.arange(len(plan.x))


def _teeth(rng: Rng, plan: Plan) -> Array:
    return sum(rng.choice([-1.0, 1.0]) * (plan.x > plan.span * at) for at in rng.uniform(0.1, 0.9, 3))


def _telegraph(rng: Rng, plan: Plan) -> Array:
    return np.where(np.cumsum(rng.random(len(plan.x)) < max(0.05, 12 / len(plan.x))) % 2, 1.0, -1.0)


OUTSIDE_AT_REST: dict[str, Callable[[Rng, Plan], Array]] = {
    "hunting of the drive": lambda g, p: np.sign(np.sin(p.t * g.uniform(0.5, 2))) * np.abs(np.sin(p.t * 3.1)),
    "local dent": lambda g, p: np.exp(-(((p.x / p.span - g.uniform(0.2, 0.8)) / g.uniform(0.01, 0.025)) ** 2)),
    "jump of the pitch": lambda g, p: (p.x > p.span * g.uniform(0.25, 0.75)).astype(float),
    "missing teeth": _teeth,
    "cable drag with memory": lambda g, p: _memory(
        p.x * g.uniform(0, 1, 99)[p.run.astype(int)], g.uniform(0.8, 0.97)
    ),
    "thermostat": lambda g, p: np.abs((p.t / p.t[-1] * g.uniform(6, 14)) % 2 - 1),
    "chaotic creep": lambda g, p: _chaos(len(p.x), int(g.integers(2, 8))),
    "mode switch": lambda g, p: p.x * _part(p, g.uniform(0.2, 0.4), g.uniform(0.55, 0.8)),
    "gain that swings": lambda g, p: p.x * np.sin(TAU * p.t / p.t[-1] * g.uniform(1.2, 4) + g.uniform(0, TAU)),
    "cosine drift": lambda g, p: -p.x * (p.t / p.t[-1] + g.uniform(-0.7, 0)) ** 2,
    "cross-talk of a hidden axis": lambda g, p: np.sin(np.arange(len(p.x)) * g.uniform(0.4, 1.2) + g.uniform(0, 6)),
    "heat of load cycles": lambda g, p: _memory(np.sign(np.sin(np.arange(len(p.x)) * 0.05)), g.uniform(0.9, 0.97)),
    "beats along the axis": lambda g, p: (
        np.sin(TAU * 8 * p.x / p.span + 1) * np.sin(TAU * g.uniform(1, 1.6) * p.x / p.span)
    ),
    "wave that changes its period": lambda g, p: np.sin(
        TAU * (7 * p.x / p.span + g.uniform(2, 4) * (p.x / p.span) ** 2)
    ),
    "wave that fades": lambda g, p: np.sin(TAU * g.uniform(6, 9) * p.x / p.span) * np.exp(-3 * p.x / p.span),
    "backlash that wears by the run": lambda g, p: p.d * (p.run - 1) ** 1.5,
    "backlash of odd runs": lambda g, p: p.d * (p.run % 2),
    "backlash by the clock": lambda g, p: p.d * np.sin(TAU * p.t / p.t[-1] * g.uniform(1, 3)),
    "settling after rests of each length": lambda g, p: (
        g.uniform(-0.5, 2, 99)[p.run.astype(int)]
        * np.exp(-_since(np.diff(p.run, prepend=0) > 0, p.t) / (p.t[-1] / p.run[-1] * g.uniform(0.05, 0.2)))
    ),
    "random telegraph": _telegraph,
    "scale of odd runs": lambda g, p: p.x * (-1) ** p.run,
    "heat squared": lambda g, p: p.x * (p.heat["screw"] - p.heat["screw"].mean()) ** 2 if p.heat else p.x * p.t**2,
    "error by the parity of targets": lambda g, p: (-1.0) ** np.searchsorted(np.unique(p.x), p.x),
    "resonance at a feed": lambda g, p: (
        p.d / (1 + ((np.abs(p.v) - np.median(np.abs(p.v))) / (0.1 * np.abs(p.v).max() + 1e-9)) ** 2) * p.x
    ),
    "reading clipped": lambda g, p: np.clip(p.x / p.span + g.uniform(0.6, 1.4) * p.t / p.t[-1] - 1, -0.3, 0.25),
}
OF_DRIVES = ("friction by place", "impact after each reversal", "friction that falls with heat")
"""Of a force only: a deviation of such a course has a name."""
BY_PLACE = ("dent", "pitch", "teeth", "beats", "wave", "parity")
"""Courses along the axis: too fast for a map only where there are many places."""
OUTSIDE_IN_MOTION: dict[str, Callable[[Rng, Plan], Array]] = {
    "ringing after stops": lambda g, p: np.exp(-_stops(p) / p.t[-1] * 60) * np.sin(_stops(p) / p.t[-1] * TAU * 200),
    "stick-slip at creep": lambda g, p: (
        (np.abs(p.v) < 0.15 * np.abs(p.v).max()) * ((p.x / p.span * g.uniform(40, 90)) % 1 - 0.5) * p.d
    ),
    "hunting at low speed": lambda g, p: np.sin(_hz(p, 0.03)) / (1 + (p.v / (0.1 * np.abs(p.v).max())) ** 2),
    "beats of two motors": lambda g, p: np.sin(_hz(p, 0.041)) + np.sin(_hz(p, 0.041 + g.uniform(0.002, 0.004))),
    "clock skew": lambda g, p: p.t * p.v,
    "gain that drifts": lambda g, p: p.a / p.a.std() * p.t / p.t[-1],
    "friction that falls with heat": lambda g, p: p.d * np.exp(-3 * p.t / p.t[-1]),
    "friction by place": lambda g, p: p.d * np.sin(TAU * p.x / p.span * g.uniform(0.8, 2) + g.uniform(0, 6)),
    "drag by the square of speed": lambda g, p: p.v * np.abs(p.v),
    "dead zone": lambda g, p: np.sign(p.v) * np.maximum(np.abs(p.v) - 0.4 * np.abs(p.v).max(), 0),
    "friction with memory of rests": lambda g, p: (
        p.d * np.exp(-_stops(p) / p.t[-1] * 25) * np.log1p(np.cumsum(_stops(p) == 0) % 5)
    ),
    "mode switch": lambda g, p: p.v * _part(p, 0.3, g.uniform(0.5, 0.8)),
    "ripple by the load": lambda g, p: p.a * np.sin(TAU * p.x / p.span * g.uniform(8, 20)),
    "cross-talk of a hidden axis": lambda g, p: np.sin(_hz(p, g.uniform(0.004, 0.02)) + 2 * np.sin(_hz(p, 0.003))),
    "cable with memory": lambda g, p: _memory(p.x / p.span, 1 - 12 / len(p.x)),
    "jerk": lambda g, p: np.gradient(p.a, p.t + 1e-9 * np.arange(len(p.t))),
    "eddy currents": lambda g, p: p.v / (1 + (p.v / (0.25 * np.abs(p.v).max())) ** 2),
    "impact after each reversal": lambda g, p: p.d * np.exp(-_stops(p) / p.t[-1] * 150) * (np.abs(p.v) > 0),
    "chaos": lambda g, p: _chaos(len(p.x), 2),
    "saturation": lambda g, p: np.clip(p.a, -0.5 * p.a.std(), 0.5 * p.a.std()),
    "wave that changes its period": lambda g, p: np.sin(TAU * (9 * p.x / p.span + 6 * (p.x / p.span) ** 2)),
}
