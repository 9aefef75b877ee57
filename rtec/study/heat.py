"""The table ``[heat]`` of a study: a machine that warms over a shift, and a predictor that sees its thermometers."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from rtec.errors import ArgumentError, unknown
from rtec.heat.duty import Duty, Piece
from rtec.heat.machines import THERMOMETERS
from rtec.injector import Design
from rtec.io import Section
from rtec.metrology import MeasuringPlan
from rtec.predictors import read_predictor
from rtec.predictors.warm.warm_model import WarmModel
from rtec.training.warm_methods import warm_methods
from rtec.units import LENGTH, SPEED, TIME, parse_quantity

OPTIONAL = ("increment", "model")
DEFAULTS = {
    "duty": "paper", "training": "steps", "machine": 1, "seed": 1, "axis": "z", "every": "30 min", "design": "b",
    "fit": "first-order lags", "thermometers": [], "speed": False,
}  # fmt: skip
AXES = ("x", "y", "z")
_NAMED = ("paper", "steps", "shop")
_STEPS_RPM = (1500.0, 3000.0, 4500.0, 6000.0)
_FEED_MM_S = 20.0
_LONGEST_H = 200.0
_TARGETS = 4
_PIECE = re.compile(r"(?P<time>.+?) at (?P<rpm>[0-9.e+]+) ?rpm(?:, feed (?P<feed>.+))?")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeatStudy:
    """A machine that warms, calibrated again and again.

    Parameters
    ----------
    duty, training
        What it does over the shift, and while its predictor was measured: another duty cycle.
    machine, seed
        Which machine (`rtec.heat.warm_machine`), and what its thermometers' offsets are drawn from.
    axis
        x, y or z.
    every_s
        From one calibration to the next.
    plan
        What is measured each time.
    design
        Of the box that corrects.
    fit
        Name of the method that fits the predictor (`rtec.training.warm_methods`); not used where there are models.
    models
        Predictors of files: one for the whole axis, or two for the first and the last target; empty: one is fitted.
    thermometers
        What the predictor may look at; empty: all.
    speed
        Whether a further row is corrected by a predictor that sees the speed of the spindle, too.
    """

    duty: Duty
    training: Duty
    machine: int
    seed: int
    axis: str
    every_s: float
    plan: MeasuringPlan
    design: Design
    fit: str
    models: tuple[WarmModel, ...] = ()
    thermometers: tuple[str, ...] = ()
    speed: bool = False

    def __str__(self) -> str:
        hours, minutes = self.duty.duration_s / 3600.0, self.every_s / 60.0
        return f"number {self.machine}, axis {self.axis}, calibrated every {minutes:g} min over {hours:.3g} h"


def heat_of(section: Section, plan: MeasuringPlan, folder: Path) -> HeatStudy:
    """Return what a table ``[heat]`` asks for; ``plan`` is the study's program, ``folder`` that of its files.

    Raises
    ------
    ArgumentError
        A value outside its range, a duty that cannot be read, a method or a thermometer that does not exist.
    """
    travel_mm = plan.end_mm - plan.start_mm
    increment_mm = section.quantity("increment", LENGTH) if section.has("increment") else travel_mm / _TARGETS
    if not 0.0 < increment_mm <= travel_mm:
        raise section.refused("increment", f"more than 0 mm, up to the travel of {travel_mm:g} mm")
    every_s = section.quantity("every", TIME)
    if not 1.0 <= every_s <= _LONGEST_H * 3600.0:
        raise section.refused("every", f"1 s to {_LONGEST_H:g} h")
    if section.text("axis") not in AXES:
        raise unknown(section.where("axis"), section.text("axis"), AXES, noun="axis")
    seed = section.whole("seed", 0, 1 << 60)
    return HeatStudy(
        duty=_duty(section, "duty", seed),
        training=_duty(section, "training", seed + 1),
        machine=section.whole("machine", 0, 1 << 60),
        seed=seed,
        axis=section.text("axis"),
        every_s=every_s,
        plan=_plan(section, plan, increment_mm),
        design=section.choice("design", Design),
        fit=_method(section),
        models=_models(section, folder),
        thermometers=_thermometers(section),
        speed=section.yes_or_no("speed"),
    )


def _plan(section: Section, plan: MeasuringPlan, increment_mm: float) -> MeasuringPlan:
    steps = max(round((plan.end_mm - plan.start_mm) / increment_mm), 1)
    with section.naming(increment_mm="increment"):
        return replace(plan, increment_mm=(plan.end_mm - plan.start_mm) / steps, runs=1)


def _duty(section: Section, key: str, seed: int) -> Duty:
    given = section.raw(key)
    if isinstance(given, list):
        pieces = tuple(_piece(text, section.where(key)) for text in section.texts(key))
        if not pieces:
            raise section.refused(key, 'one piece or more, such as "2.5 h at 8000 rpm"')
        duty = Duty(pieces)
    elif given == "paper":
        duty = Duty.paper(spindle_rpm=_STEPS_RPM[-1], feed_mm_s=_FEED_MM_S)
    elif given == "steps":
        duty = Duty.steps(_STEPS_RPM, running_h=2.0, resting_h=2.0, feed_mm_s=_FEED_MM_S)
    elif given == "shop":
        duty = Duty.shop(seed, hours=8.0)
    else:
        raise unknown(section.where(key), str(given), _NAMED, noun="duty")
    if duty.duration_s > _LONGEST_H * 3600.0:
        raise section.refused(key, f"at most {_LONGEST_H:g} h")
    return duty


def _piece(text: str, where: str) -> Piece:
    """Return a piece as people write it.

    Examples
    --------
    >>> _piece("90 min at 4000 rpm, feed 1200 mm/min", "duty").feed_mm_s
    20.0
    """
    found = _PIECE.fullmatch(text) if isinstance(text, str) else None
    allowed = 'a time and a speed, such as "2.5 h at 8000 rpm" or "2 h at 0 rpm, feed 20 mm/s"'
    if found is None:
        raise ArgumentError(where, repr(text)[:60], allowed)
    try:
        rpm = float(found["rpm"])
    except ValueError:
        raise ArgumentError(where, repr(text)[:60], allowed) from None
    feed = found["feed"]
    feed_mm_s = 0.0 if feed is None else parse_quantity(feed, SPEED, name=where)
    duration_s = parse_quantity(found["time"], TIME, name=where)
    try:
        return Piece(duration_s=duration_s, spindle_rpm=rpm, feed_mm_s=feed_mm_s)
    except ArgumentError as error:
        raise error.of(f"{where}, {text!r}") from None


def _method(section: Section) -> str:
    names = [method.name for method in warm_methods()]
    if section.text("fit") not in names:
        raise unknown(section.where("fit"), section.text("fit"), names, noun="method")
    return section.text("fit")


def _models(section: Section, folder: Path) -> tuple[WarmModel, ...]:
    if not section.has("model"):
        return ()
    given = section.raw("model")
    names = section.texts("model") if isinstance(given, list) else [section.text("model")]
    if not 1 <= len(names) <= 2:
        raise section.refused("model", "one file, or two: for the first and the last target")
    if section.yes_or_no("speed"):
        raise section.refused("speed", "false with a model of a file, which says itself what it sees")
    found = []
    for name in names:
        model = read_predictor(folder / name).predictor
        if not isinstance(model, WarmModel):
            raise section.refused("model", "a predictor of temperatures, as rtec train writes it of a warm machine")
        found.append(model)
    return tuple(found)


def _thermometers(section: Section) -> tuple[str, ...]:
    names = tuple(section.texts("thermometers"))
    for name in names:
        if name not in THERMOMETERS:
            raise unknown(section.where("thermometers"), name, THERMOMETERS, noun="thermometer")
    return names
