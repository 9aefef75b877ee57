"""Models of warm machines as TOML files that give back the same numbers.

::

    predictor = "warm"
    version = 1
    name = "lags of 3 sensors"
    source = "spindle.csv"
    observe = "ch3"
    unit = "um"
    sign = -1
    interval = 3.2

    [ranges]
    temperature_t1 = [20.1, 41.5]
    spindle_speed = [0.0, 5000.0]

    [[feature]]
    of = "temperature_t1"
    lag = "600.0 s"
    begin = [20.3, 39.8, 1.2, 0.94]

    [[feature]]
    of = "spindle_speed"
    lag = "1800.0 s"
    heat = true

    [regressor]
    kind = "linear"
    ...

The interval, in ``unit``, holds 90 % of the readings that chose the model. The keys of ``regressor`` are those of its
kind (`rtec.predictors.warm.kinds`). Features that lag may tell where they begin (`rtec.predictors.warm.begin`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from rtec.errors import ArgumentError, FileFormatError, meant, unknown
from rtec.io import Section
from rtec.predictors._file_text import entries, lines_of, numbers
from rtec.predictors.warm._warm_kernels import BEGIN_HEAD
from rtec.predictors.warm.begin import Begin, lagging, seen_at_once
from rtec.predictors.warm.features import Feature
from rtec.predictors.warm.kinds import REGRESSORS, kept, regressor_of
from rtec.predictors.warm.regressor import Regressor
from rtec.predictors.warm.warm_model import WarmModel
from rtec.units import TIME

KEYS = ("observe", "unit", "sign", "ranges", "feature", "regressor")
_FEATURE = ("of", "lag", "heat", "begin")
_LARGEST = 1e30


def read_warm(top: Section) -> WarmModel:
    """Return the model of a file.

    Raises
    ------
    ArgumentError
        An unknown key, one that is missing, or a value that cannot be: it names file and key.
    """
    parts = list(entries(top, "feature", _FEATURE))
    features = tuple(
        Feature(
            of=part.text("of"),
            lag_s=part.quantity("lag", TIME) if part.has("lag") else 0.0,
            heat=part.yes_or_no("heat") if part.has("heat") else False,
        )
        for part in parts
    )
    values: dict[str, Any] = {
        "regressor": _regressor(top),
        "observe": top.text("observe"),
        "unit": top.text("unit"),
        "ranges": dict(_ranges(top, {one.of for one in features})),
        "interval": top.number("interval", 0.0, _LARGEST) if top.has("interval") else None,
        "begin": _begin(parts, features),
        "sign": top.whole("sign", -1, 1) if top.has("sign") else 1,
    }
    try:
        return WarmModel(features=features, **values)
    except ArgumentError as error:
        raise error.of(top.where(error.name)) from None


def _begin(parts: list[Section], features: tuple[Feature, ...]) -> Begin | None:
    """Return where what lags begins: all features that lag tell it, or none."""
    told = [k for k, part in enumerate(parts) if part.has("begin")]
    if not told:
        return None
    behind, size = lagging(features), BEGIN_HEAD + len(seen_at_once(features))
    for k in sorted(set(told) ^ set(behind)):
        found = "one that does not lag" if k in told else "none"
        raise ArgumentError(parts[k].where("begin"), found, "numbers for each feature that lags, or for none")
    rows = [numbers(parts[k], "begin") for k in behind]
    for k, row in zip(behind, rows, strict=True):
        if row.size != size:
            raise ArgumentError(parts[k].where("begin"), f"{row.size} numbers", f"{size} numbers")
    return Begin(features=features, numbers=np.stack(rows))


def _ranges(top: Section, inputs: set[str]) -> Iterator[tuple[str, tuple[float, float]]]:
    if not top.has("ranges"):
        return
    part = top.part("ranges", top.raw("ranges"), tuple(sorted(inputs)))
    for name in sorted(inputs):
        if part.has(name):
            ends = part.raw(name)
            if not (isinstance(ends, list) and len(ends) == 2 and all(type(end) in (int, float) for end in ends)):
                raise ArgumentError(part.where(name), repr(ends)[:60], "its lower and its upper end")
            yield name, (float(ends[0]), float(ends[1]))


def _regressor(top: Section) -> Regressor:
    given = top.raw("regressor")
    where = top.where("regressor")
    if not isinstance(given, dict):
        raise ArgumentError(where, repr(given)[:60], "a table [regressor] with its kind")
    kind = given.get("kind")
    if not isinstance(kind, str) or kind not in REGRESSORS:
        raise unknown(f"{where}.kind", str(kind)[:60], REGRESSORS)
    try:
        found = regressor_of(kind, {key: value for key, value in given.items() if key != "kind"})
    except ArgumentError as error:
        raise error.of(f"{where}.{error.name}") from None
    for key in given:
        if key != "kind" and key not in found.plain:
            raise FileFormatError(top.path, None, f"unknown key 'regressor.{key[:60]}'", meant(key, found.plain))
    return found


def warm_lines(model: WarmModel) -> Iterator[str]:
    """Yield the lines of a file, behind those that every predictor has."""
    told: dict[str, object] = {"observe": model.observe, "unit": model.unit}
    if model.sign != 1:
        told["sign"] = model.sign
    if model.interval is not None:
        told["interval"] = float(model.interval)
    yield from lines_of(told)
    if model.ranges:
        yield from ("", "[ranges]", *lines_of({name: tuple(map(float, ends)) for name, ends in model.ranges.items()}))
    begins = {} if model.begin is None else dict(zip(lagging(model.features), model.begin.numbers, strict=True))
    for k, one in enumerate(model.features):
        own: dict[str, object] = {"of": one.of}
        if one.lag_s > 0.0:
            own["lag"] = f"{float(one.lag_s)!r} s"
        if one.heat:
            own["heat"] = True
        if k in begins:
            own["begin"] = begins[k].tolist()
        yield from ("", "[[feature]]", *lines_of(own))
    regressor = kept(model.regressor)
    yield from ("", "[regressor]", *lines_of({"kind": regressor.kind, **regressor.plain}))
