"""Models of motion as TOML files that give back the same numbers.

::

    predictor = "arx"
    version = 1
    name = "ARX"
    source = "drive.csv"
    observe = "following_error"
    unit = "um"
    period = "0.001 s"
    inputs = ["velocity", "acceleration"]
    interval = 1.2
    feedback = [1.9, -0.9]
    forward = [[0.1, 0.0], [0.0, 0.002]]
    constant = 0.3

The interval, in ``unit``, holds 90 % of the samples that chose the model. Other kinds have other numbers: ``servo
lag``, ``drive`` (`DriveModel`), ``narx`` (`Narx`), and a ``sum``, of which each ``[[part]]`` is one of these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from rtec.errors import ArgumentError, FileFormatError, unknown
from rtec.io import Section, read_toml, write_lines
from rtec.link._frame_kernels import MOST_AXES
from rtec.predictors._file_text import (
    MOST_BYTES,
    VERSION,
    check_version,
    entries,
    lines_of,
    numbers,
    quoted,
    whole_numbers,
)
from rtec.predictors.drive_model import NUMBERS, DriveModel
from rtec.predictors.linear_models import Arx, ServoLag
from rtec.predictors.model_sum import ModelSum
from rtec.predictors.narx import MOST_NEURONS, Narx, NarxShape
from rtec.predictors.sequences import DynamicModel
from rtec.units import TIME

_HEAD = ("predictor", "version", "name", "source", "axis", "observe", "unit", "period", "inputs", "interval")
_LARGEST = 1e30
MM_OF = MappingProxyType({"um": 1e-3, "mm": 1.0})
"""Units of outputs that are lengths."""
FOLLOWING_ERROR = "following_error"
"""The output where a file names no other."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionHead:
    """What a model of motion predicts, from what, and how often.

    Parameters
    ----------
    observe
        The output, as of `rtec.dataset.dynamic_log.dynamic_log`.
    unit
        Of the output.
    names
        Of the inputs, in their order.
    period_s
        Sample time.
    """

    observe: str
    unit: str
    names: tuple[str, ...]
    period_s: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownMotion:
    """A model of motion with what is known of it.

    Parameters
    ----------
    model
        An ARX model, a servo lag, a drive, a NARX network, or a sum of them.
    head
        What it predicts.
    name, source
        What it is, and the log that it was fitted to.
    interval
        Half width of the interval in which 90 % of samples lie, in the unit of the output; None where that is not
        known.
    axis
        Number of the axis, None where the log did not say it.
    """

    model: DynamicModel
    head: MotionHead
    name: str
    source: str = ""
    interval: float | None = None
    axis: int | None = None

    def trained_on(self, source: str) -> bool:
        """Return whether a log has the name of the one that it was fitted to."""
        return bool(self.source) and Path(source).name == self.source


def head_of(model: DynamicModel, observe: str = FOLLOWING_ERROR) -> MotionHead:
    """Return what a model predicts, from what, and how often; what its output is, a model does not know.

    Raises
    ------
    ArgumentError
        A model that has no file.
    """
    first = model.parts[0] if isinstance(model, ModelSum) else model
    if not isinstance(first, Arx | ServoLag | DriveModel | Narx):
        raise ArgumentError("model", type(first).__name__, "ARX, a servo lag, a drive, or a NARX network")
    return MotionHead(observe=observe, unit=first.unit, names=first.names, period_s=first.period_s)


def is_motion(given: Mapping[str, object]) -> bool:
    """Return whether the keys of a TOML file are those of a model of motion."""
    kind = given.get("predictor")
    return isinstance(kind, str) and kind in _KINDS


def is_motion_file(path: str | Path) -> bool:
    """Return whether a TOML file holds a model of motion.

    Raises
    ------
    FileFormatError
        No readable TOML.
    """
    return is_motion(read_toml(Path(path), most_bytes=MOST_BYTES))


def read_motion(path: str | Path) -> KnownMotion:
    """Read a model of motion.

    Raises
    ------
    FileFormatError
        No readable TOML, another kind or version, an unknown key, or one that is missing.
    ArgumentError
        A value that cannot be: it names file and key.
    """
    given = read_toml(Path(path), most_bytes=MOST_BYTES)
    if not is_motion(given):
        found = f"predictor = {given.get('predictor')!r}"[:80]
        raise FileFormatError(path, None, found, " or ".join(f'"{name}"' for name in _KINDS))
    check_version(path, given)
    kind = _KINDS[str(given["predictor"])]
    top = Section(path, "", given, {}, optional=(*_HEAD, *kind.keys))
    head = MotionHead(
        observe=top.text("observe") if top.has("observe") else FOLLOWING_ERROR,
        unit=top.text("unit") if top.raw("unit") else "",
        names=tuple(top.texts("inputs")),
        period_s=top.quantity("period", TIME),
    )
    if not head.period_s > 0.0:
        raise ArgumentError(top.where("period"), f"{head.period_s:g} s", "a time above 0 s")
    with top.naming(inputs="inputs"):
        model = kind.read(top, head)
    return KnownMotion(
        model=model,
        head=head,
        name=top.text("name"),
        source=top.text("source") if top.has("source") else "",
        interval=top.number("interval", 0.0, _LARGEST) if top.has("interval") else None,
        axis=top.whole("axis", 1, MOST_AXES) if top.has("axis") else None,
    )


def write_motion(path: str | Path, known: KnownMotion) -> None:
    """Write a model of motion; the file appears whole or not at all.

    Raises
    ------
    ArgumentError
        A model of another kind.
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> head = MotionHead(observe="following_error", unit="um", names=("velocity", "acceleration"), period_s=1e-3)
    >>> lag = ServoLag(names=head.names, period_s=1e-3, unit="um", per_velocity=16.1)
    >>> file = Path(tempfile.mkdtemp()) / "lag.toml"
    >>> write_motion(file, KnownMotion(model=lag, head=head, name="servo lag"))
    >>> read_motion(file).model == lag
    True
    """
    head = known.head
    kind = _kind_of(known.model)
    lines = [f'predictor = "{kind}"', f"version = {VERSION}", f"name = {quoted(known.name)}"]
    lines += [f"source = {quoted(known.source)}"] if known.source else []
    lines += [f"axis = {known.axis}"] if known.axis is not None else []
    lines += [f"observe = {quoted(head.observe)}", f"unit = {quoted(head.unit)}", f'period = "{head.period_s!r} s"']
    lines.append(f"inputs = [{', '.join(map(quoted, head.names))}]")
    lines += [f"interval = {known.interval!r}"] if known.interval is not None else []
    write_lines(path, [*lines, *_KINDS[kind].lines(known.model)])


def _kind_of(model: DynamicModel) -> str:
    for name, kind in _KINDS.items():
        if isinstance(model, kind.of):
            return name
    raise ArgumentError("model", type(model).__name__, " or ".join(kind.of.__name__ for kind in _KINDS.values()))


def _read_arx(part: Section, head: MotionHead) -> Arx:
    forward = part.raw("forward")
    square = isinstance(forward, list) and all(
        isinstance(row, list) and len(row) == len(forward[0]) for row in forward
    )
    if not square or not all(type(value) in (int, float) for row in forward for value in row):
        raise ArgumentError(part.where("forward"), repr(forward)[:60], "a list of numbers for each input")
    return Arx(
        names=head.names,
        period_s=head.period_s,
        unit=head.unit,
        feedback=numbers(part, "feedback"),
        forward=np.array(forward, dtype=np.float64),
        constant=part.number("constant", -_LARGEST, _LARGEST),
    )


def _arx_lines(model: Arx) -> Iterator[str]:
    yield from lines_of({"feedback": model.feedback})
    yield f"forward = {model.forward.tolist()!r}"
    yield f"constant = {model.constant!r}"


_LAG = ("constant", "per_velocity", "per_acceleration")


def _read_lag(part: Section, head: MotionHead) -> ServoLag:
    values = {name: part.number(name, -_LARGEST, _LARGEST) for name in _LAG}
    return ServoLag(names=head.names, period_s=head.period_s, unit=head.unit, **values)


def _lag_lines(model: ServoLag) -> Iterator[str]:
    return lines_of({name: getattr(model, name) for name in _LAG})


def _read_drive(part: Section, head: MotionHead) -> DriveModel:
    values: dict[str, Any] = {name: part.number(name, -_LARGEST, _LARGEST) for name in NUMBERS}
    return DriveModel(
        names=head.names,
        period_s=head.period_s,
        unit=head.unit,
        output_per_error=part.number("output_per_error", -_LARGEST, _LARGEST),
        gains=tuple(numbers(part, "gains").tolist()),
        **values,
    )


def _drive_lines(model: DriveModel) -> Iterator[str]:
    return lines_of({name: getattr(model, name) for name in ("output_per_error", *NUMBERS, "gains")})


_NARX = ("neurons", "input_delays", "feedback_delays", "linear", "middle", "half", "weights")


def _read_narx(part: Section, head: MotionHead) -> Narx:
    with part.naming(**{name: name for name in _NARX}, inputs="inputs"):
        shape = NarxShape(
            channels=len(head.names),
            neurons=part.whole("neurons", 1, MOST_NEURONS),
            input_delays=tuple(whole_numbers(part, "input_delays")),
            feedback_delays=tuple(whole_numbers(part, "feedback_delays")),
            linear=part.yes_or_no("linear"),
        )
        return Narx(
            shape=shape,
            names=head.names,
            period_s=head.period_s,
            unit=head.unit,
            middle=numbers(part, "middle"),
            half=numbers(part, "half"),
            weights=numbers(part, "weights"),
        )


def _narx_lines(model: Narx) -> Iterator[str]:
    return lines_of({name: getattr(model if hasattr(model, name) else model.shape, name) for name in _NARX})


def _read_sum(top: Section, head: MotionHead) -> ModelSum:
    keys = {key for name, kind in _KINDS.items() if name != "sum" for key in kind.keys}
    parts = []
    for part in entries(top, "part", ("predictor", *sorted(keys))):
        name = part.text("predictor")
        if name not in _KINDS or name == "sum":
            raise unknown(part.where("predictor"), name, [known for known in _KINDS if known != "sum"])
        parts.append(_KINDS[name].read(part, head))
    if not parts:
        raise ArgumentError(top.where("part"), "no part", "tables [[part]]")
    return ModelSum(parts=tuple(parts))


def _sum_lines(model: ModelSum) -> Iterator[str]:
    for part in model.parts:
        kind = _kind_of(part)
        yield from ("", "[[part]]", f'predictor = "{kind}"', *_KINDS[kind].lines(part))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kind:
    """How one kind of model stands in a file: what it is, its own keys, and from and to TOML."""

    of: type
    keys: tuple[str, ...]
    read: Callable[[Section, MotionHead], DynamicModel]
    lines: Callable[[Any], Iterator[str]]


_KINDS = {
    "arx": _Kind(of=Arx, keys=("feedback", "forward", "constant"), read=_read_arx, lines=_arx_lines),
    "servo lag": _Kind(of=ServoLag, keys=_LAG, read=_read_lag, lines=_lag_lines),
    "drive": _Kind(of=DriveModel, keys=("output_per_error", *NUMBERS, "gains"), read=_read_drive, lines=_drive_lines),
    "narx": _Kind(of=Narx, keys=_NARX, read=_read_narx, lines=_narx_lines),
    "sum": _Kind(of=ModelSum, keys=("part",), read=_read_sum, lines=_sum_lines),
}
