"""What ``rtec export`` reads: a model or a predictor, how warm the machine is, and the range of the table."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rtec.checks import number_within
from rtec.errors import ArgumentError
from rtec.units import NUMBER, UNITS, Kind

if TYPE_CHECKING:
    from rtec.inference.model import Model
    from rtec.inference.warmth import Warmth
    from rtec.predictors import KnownPredictor, Predictor

SPINDLE = Kind("speed of a spindle", "rpm", "3000 rpm, 50 rev/s")
_TEMPERATURE = re.compile(rf"(?:(?P<name>[a-z][a-z0-9_]*)\s*=)?\s*(?P<number>{NUMBER})\s*(?P<unit>degC|degF|K)", re.I)
_SHORTEST_MM = 1e-3
_FARTHEST_MM = 1e6
EVERYWHERE_MM = (-_FARTHEST_MM, _FARTHEST_MM)


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """What is exported."""

    name: str
    predictor: Predictor | Model
    warmth: Warmth | None
    """None where the errors do not depend on it."""
    trained: KnownPredictor | None = None
    shift_mm: float | None = None
    """Of a model that knows no positions: the error everywhere."""

    @property
    def at(self) -> str:
        """How warm the machine is, in words that begin with a comma; empty where it does not matter."""
        return "" if self.warmth is None else f", {self.warmth}"


def warmth_of(since_on_s: float | None, temperatures: Sequence[str], spindle_rpm: float | None) -> Warmth | None:
    """Return how warm the machine is, as the options say; None where they say nothing.

    Raises
    ------
    ArgumentError
        What is no temperature, or one that is given twice.
    """
    from rtec.inference.warmth import TEMPERATURE, Warmth

    degrees: dict[str, float] = {}
    for said in temperatures:
        found = _TEMPERATURE.fullmatch(said.strip())
        if found is None:
            allowed = "a thermometer and its temperature, such as screw=22degC or screw=71.6degF"
            raise ArgumentError("--temperature", repr(said[:60]), allowed)
        bare = (found["name"] or TEMPERATURE).lower().removeprefix(f"{TEMPERATURE}_")
        name = TEMPERATURE if bare == TEMPERATURE else f"{TEMPERATURE}_{bare}"
        if name in degrees:
            raise ArgumentError("--temperature", f"{bare} twice", "each thermometer once")
        unit = next(UNITS[unit] for unit in ("degC", "degF", "K") if unit.lower() == found["unit"].lower())
        degrees[name] = (float(found["number"]) + unit.offset) * unit.factor
    if since_on_s is None and not degrees and spindle_rpm is None:
        return None
    return Warmth(since_on_s=since_on_s, temperatures_degc=degrees, spindle_rpm=spindle_rpm)


def known_of(path: Path, trained: KnownPredictor | None, warmth: Warmth | None, effects: Path | None) -> Known:
    """Return what a file holds, on a machine of this warmth.

    Raises
    ------
    RtecError
        A file that cannot be read, no model of an axis, or one of heat without the warmth that it asks for.
    """
    from rtec.inference.warmth import check_followed, check_warmth, heat_terms, wanted_of
    from rtec.predictors.warm.warm_model import WarmModel

    if trained is None:
        model = _error_model(path, effects)
        of_heat = heat_terms(model)
        if warmth is not None:
            if not of_heat:
                raise ArgumentError("--temperature", "", "a model of heat", problem=f"means nothing for {path}")
            check_followed(warmth, (name for term in of_heat for name in wanted_of(term)))
        check_warmth(model, warmth)
        return Known(name=path.name, predictor=model, warmth=warmth)
    if isinstance(trained.predictor, WarmModel):
        return _warm(trained, trained.predictor, warmth)
    if warmth is not None:
        raise ArgumentError("--temperature", "", "a model of heat", problem=f"means nothing for {trained.name}")
    return Known(name=trained.name, predictor=trained.of_position, warmth=None, trained=trained)


def _warm(trained: KnownPredictor, model: object, warmth: Warmth | None) -> Known:
    import numpy as np

    from rtec.inference.warmth import Warmth, check_followed
    from rtec.predictors import BidirectionalTable
    from rtec.predictors.motion_file import MM_OF
    from rtec.predictors.warm.features import SPINDLE_SPEED
    from rtec.predictors.warm.warm_model import WarmModel

    assert isinstance(model, WarmModel)  # noqa: S101 - the caller looked
    wanted = model.inputs[1:]
    given = Warmth() if warmth is None else warmth
    check_followed(given, wanted)
    values = dict(given.temperatures_degc) | ({} if given.spindle_rpm is None else {SPINDLE_SPEED: given.spindle_rpm})
    for name in wanted:
        if name not in values:
            bare = name.removeprefix("temperature_")
            what = "--spindle" if name == SPINDLE_SPEED else "--temperature"
            allowed = "3000rpm" if name == SPINDLE_SPEED else f"{bare}=22degC"
            raise ArgumentError(what, None, f"{allowed}: {trained.name} follows it")
        low, high = model.ranges.get(name, (-math.inf, math.inf))
        number_within(f"{name} of {trained.name}", values[name], low, high)
    if given.since_on_s is not None and SPINDLE_SPEED not in wanted:
        raise ArgumentError("--at", "", "it for models of time", problem="means nothing without a spindle's speed")
    if model.unit not in MM_OF:
        raise ArgumentError(
            "MODEL.toml", f"of {model.observe} in {model.unit}", "a model of a displacement in um or mm"
        )
    since_s = math.inf if given.since_on_s is None else given.since_on_s
    shift_mm = model.sign * MM_OF[model.unit] * model.balanced(values, since_s)
    if not math.isfinite(shift_mm):
        raise ArgumentError("--temperature", str(given), "temperatures for which the model has an answer")
    ends, errors = np.array(EVERYWHERE_MM), np.full(2, shift_mm)
    table = BidirectionalTable(
        forward_positions_mm=ends, forward_errors_mm=errors, reverse_positions_mm=ends, reverse_errors_mm=errors
    )
    return Known(name=trained.name, predictor=table, warmth=given, trained=trained, shift_mm=shift_mm)


def _error_model(path: Path, effects: Path | None) -> Model:
    """Return the model of an error of position that a file holds; in mm where it does not say otherwise."""
    from rtec.effects import Units
    from rtec.effects.own_file import library_of_file
    from rtec.errors import FileFormatError
    from rtec.inference.model_file import read_model, read_observe
    from rtec.inference.static_predictor import check_of_positions

    observe = read_observe(path)
    if observe != "deviation":
        why = "a table corrects positions, and no force, torque or current"
        raise ArgumentError(f"{path}: observe", repr(observe)[:60], "a model of a deviation", why)
    library = library_of_file(effects)
    try:
        model = read_model(path, None, library)  # one that was written by rtec states its units
    except FileFormatError:
        model = read_model(path, Units("mm", "mm", "s"), library)
    check_of_positions(model)  # before a range of positions is asked for, which a model over time has not
    return model


def range_of(known: Known, start_mm: float | None, end_mm: float | None) -> tuple[float, float]:
    """Return the range of the table in mm: as given, else where the model was measured, else that of its maps.

    Raises
    ------
    ArgumentError
        An end that nobody states, or ends that are no range.
    """
    from rtec.inference.model import Model

    low: float | None
    high: float | None
    if known.shift_mm is not None:
        low, high = None, None
    elif isinstance(known.predictor, Model):
        nodes = [x for term in known.predictor.terms for x in getattr(term.shape, "nodes", ())]
        low, high = known.predictor.range or ((min(nodes), max(nodes)) if nodes else (None, None))
    else:
        low, high = known.predictor.range_mm
    low = low if start_mm is None else start_mm
    high = high if end_mm is None else end_mm
    if low is None or high is None:
        what = "--from" if low is None else "--to"
        raise ArgumentError(what, None, "a position such as '0 mm'", "the model does not say where it was measured")
    for name, place_mm in (("--from", low), ("--to", high)):
        number_within(name, place_mm, -_FARTHEST_MM, _FARTHEST_MM, unit="mm")
    if not high >= low + _SHORTEST_MM:
        if end_mm is None:
            raise ArgumentError("--from", f"{low:g} mm", f"a position at least a micrometre before {high:g} mm")
        raise ArgumentError("--to", f"{high:g} mm", f"a position at least a micrometre beyond {low:g} mm")
    return low, high
