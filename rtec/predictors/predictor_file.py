"""Trained predictors as TOML files that give back the same numbers.

::

    predictor = "networks"
    version = 1
    name = "network 40 lm"
    source = "z_axis.csv"
    range = ["25.4 mm", "1016 mm"]
    interval = "1.8 um"
    pitch = "6.35 mm"

    [[network]]
    inputs = ["position", "direction", "turn"]
    middle = [520.7, 0.5, 3.175]
    half = [495.3, 0.5, 3.175]
    hidden = [40]
    weights = [...]
    bias_mm = 0.0783
    factor_mm = 0.0351

A ``table`` has ``between`` (linear, cubic), and ``[forward]`` and ``[reverse]`` with ``positions_mm`` and
``errors_mm`` each; of one direction, ``[forward]`` and a ``backlash``. ``tables of axes`` have a ``[[table]]`` for
each part: ``of`` (position, position_2), perhaps a ``direction`` (forward, reverse), ``positions_mm`` and
``errors_mm``; or ``angles_rad`` with an ``arm`` (position_3) and its ends ``arm_mm``. Inputs of networks may be
positions of other axes as well; ``axis`` is the number of the axis itself, where it is known.

A ``narx`` predicts what comes next in a motion; instead of a range and an interval it has a sample time ``period``,
the ``unit`` of its output, the names of its ``inputs``, ``input_delays`` and ``feedback_delays`` in samples,
``neurons``, ``linear``, ``middle`` and ``half`` of the inputs and the output, and its ``weights``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rtec.errors import ArgumentError, FileFormatError
from rtec.io import Section, read_toml, write_lines
from rtec.link._frame_kernels import MOST_AXES
from rtec.predictors._columns import column, span
from rtec.predictors.axis_tables import AxisTable, AxisTables
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
from rtec.predictors.narx import MOST_NEURONS, Narx, NarxShape
from rtec.predictors.protocol import FORWARD, REVERSE, Predictor
from rtec.predictors.tables import Between, BidirectionalTable, UnidirectionalTable
from rtec.units import LENGTH, TIME

VERSION = 1
MOST_BYTES = 16_000_000
"""Of a file: tables of some 200 000 points in each direction."""
NETWORKS, TABLE, AXES, NARX = "networks", "table", "tables of axes", "narx"
_HEAD = ("predictor", "version", "name", "source", "axis")
_OF_POSITION = ("range", "interval")
_NARX = ("input_delays", "feedback_delays", "neurons", "linear", "middle", "half", "weights")
_NETWORK = ("inputs", "middle", "half", "hidden", "weights", "bias_mm", "factor_mm")
_TABLE = ("of", "direction", "arm", "arm_mm", "positions_mm", "errors_mm", "angles_rad")
_WAYS = {"forward": FORWARD, "reverse": REVERSE}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownPredictor:
    """A predictor with what is known of it.

    Parameters
    ----------
    predictor
        A table or networks; or a model of motion, which predicts from what came before.
    name, source
        What it is, and the measurement that it was fitted to.
    interval_mm
        Half width of the interval in which 90 % of readings lie; infinite where that is not known.
    axis
        Number of the axis, None where the measurement did not say it.
    """

    predictor: Predictor | Narx
    name: str
    source: str = ""
    interval_mm: float = math.inf
    axis: int | None = None

    @property
    def of_position(self) -> Predictor:
        """The predictor, where it is one of position and direction.

        Raises
        ------
        ArgumentError
            A model of motion.
        """
        if isinstance(self.predictor, Narx):
            why = "a NARX network predicts from motion, sample by sample"
            raise ArgumentError("predictor", self.name, "tables or networks over position and direction", why)
        return self.predictor


def is_predictor_file(path: str | Path) -> bool:
    """Return whether a TOML file holds a trained predictor, and no model of effects.

    Raises
    ------
    FileFormatError
        No readable TOML.
    """
    return "predictor" in read_toml(Path(path), most_bytes=MOST_BYTES)


def read_predictor(path: str | Path) -> KnownPredictor:
    """Read a trained predictor.

    Raises
    ------
    FileFormatError
        No readable TOML, another version, an unknown key, or one that is missing.
    ArgumentError
        A value that cannot be: it names file and key.
    """
    given = read_toml(Path(path), most_bytes=MOST_BYTES)
    kinds = {
        NETWORKS: (*_OF_POSITION, "pitch", "network"),
        TABLE: (*_OF_POSITION, "between", "backlash", "forward", "reverse"),
        AXES: (*_OF_POSITION, "table"),
        NARX: ("period", "unit", "inputs", *_NARX),
    }
    kind = given.get("predictor")
    if not isinstance(kind, str) or kind not in kinds:
        raise FileFormatError(path, None, f"predictor = {kind!r}"[:80], " or ".join(f'"{name}"' for name in kinds))
    if given.get("version") != VERSION or type(given["version"]) is not int:
        found = f"version = {given.get('version')!r}"[:80]
        raise FileFormatError(path, None, found, f"version = {VERSION}; train it again with this rtec")
    top = Section(path, "", given, {}, optional=(*_HEAD, *kinds[kind]))
    predictor, interval_mm = (_narx(top), math.inf) if kind == NARX else _of_position(top, kind)
    return KnownPredictor(
        predictor=predictor,
        name=top.text("name"),
        source=top.text("source") if top.has("source") else "",
        interval_mm=interval_mm,
        axis=top.whole("axis", 1, MOST_AXES) if top.has("axis") else None,
    )


def _of_position(top: Section, kind: str) -> tuple[Predictor, float]:
    """Return tables or networks, and the half width of their interval in mm."""
    ends = top.texts("range")
    if len(ends) != 2:
        raise ArgumentError(top.where("range"), f"{len(ends)} values", "its lower and its upper end")
    low_mm, high_mm = top.quantities("range", LENGTH)
    predictor: TrainedNetworks | UnidirectionalTable | BidirectionalTable | AxisTables
    with top.naming(range_mm="range", pitch_mm="pitch", networks="network", tables="table"):
        if kind == NETWORKS:
            predictor = _networks(top, low_mm, high_mm)
        elif kind == TABLE:
            predictor = _table(top)
        else:
            predictor = AxisTables(tables=tuple(_axis_tables(top)), range_mm=(low_mm, high_mm))
    if predictor.range_mm != (low_mm, high_mm):
        found = f"{low_mm:g} to {high_mm:g} mm"
        raise ArgumentError(top.where("range"), found, f"{predictor.range_mm[0]:g} to {predictor.range_mm[1]:g} mm")
    interval = top.quantity("interval", LENGTH) if top.has("interval") else math.inf
    if not interval >= 0.0:
        raise ArgumentError(top.where("interval"), f"{interval:g} mm", "a length from 0")
    return predictor, interval


def _narx(top: Section) -> Narx:
    names = tuple(top.texts("inputs"))
    with top.naming(inputs="inputs", period_s="period", **{name: name for name in _NARX}):
        shape = NarxShape(
            channels=len(names),
            neurons=top.whole("neurons", 1, MOST_NEURONS),
            input_delays=tuple(_whole(top, "input_delays")),
            feedback_delays=tuple(_whole(top, "feedback_delays")),
            linear=top.yes_or_no("linear"),
        )
        numbers = {name: _numbers(top, name) for name in ("middle", "half", "weights")}
        return Narx(shape=shape, names=names, period_s=top.quantity("period", TIME), unit=top.text("unit"), **numbers)


def _entries(top: Section, name: str, keys: tuple[str, ...]) -> Iterator[Section]:
    """Yield the tables ``[[name]]`` of a file."""
    entries = top.raw(name)
    if not isinstance(entries, list):
        raise ArgumentError(top.where(name), repr(entries)[:60], f"tables [[{name}]]")
    for number, entry in enumerate(entries, 1):
        yield top.part(f"{name}[{number}]", entry, keys)


def _axis_tables(top: Section) -> Iterator[AxisTable]:
    for part in _entries(top, "table", _TABLE):
        arm = part.text("arm") if part.has("arm") else None
        values = "errors_mm" if arm is None else "angles_rad"
        way = part.text("direction") if part.has("direction") else ""
        if way and way not in _WAYS:
            raise ArgumentError(part.where("direction"), repr(way)[:60], " or ".join(_WAYS))
        with part.naming(of="of", arm="arm", arm_mm="arm_mm", positions_mm="positions_mm", values=values):
            ends = (0.0, 1.0) if arm is None else span("arm_mm", _numbers(part, "arm_mm"))
            yield AxisTable(
                of=part.text("of"),
                positions_mm=_numbers(part, "positions_mm"),
                values=_numbers(part, values),
                direction=_WAYS.get(way, 0),
                arm=arm,
                arm_mm=ends,
            )


def _networks(top: Section, low_mm: float, high_mm: float) -> TrainedNetworks:
    found = []
    for part in _entries(top, "network", _NETWORK):
        with part.naming(**{name: name for name in _NETWORK}):
            found.append(
                LayeredNetwork(
                    inputs=tuple(part.texts("inputs")),
                    middle=_numbers(part, "middle"),
                    half=_numbers(part, "half"),
                    hidden=tuple(_whole(part, "hidden")),
                    weights=_numbers(part, "weights"),
                    bias_mm=part.number("bias_mm", -1e6, 1e6),
                    factor_mm=part.number("factor_mm", -1e6, 1e6),
                )
            )
    pitch_mm = top.quantity("pitch", LENGTH) if top.has("pitch") else 1.0
    if not top.has("pitch") and any("turn" in network.inputs for network in found):
        raise FileFormatError(top.path, None, "no 'pitch' for an input 'turn'", 'pitch = "5 mm"')
    return TrainedNetworks(networks=tuple(found), range_mm=(low_mm, high_mm), pitch_mm=pitch_mm)


def _table(top: Section) -> UnidirectionalTable | BidirectionalTable:
    between = top.choice("between", Between) if top.has("between") else Between.LINES
    columns = ("positions_mm", "errors_mm")
    sides = {side: top.part(side, top.raw(side), columns) for side in ("forward", "reverse") if top.has(side)}
    if "forward" not in sides:
        raise FileFormatError(top.path, None, "no table [forward]", "[forward] with positions_mm and errors_mm")
    numbers = {f"{side}_{name}": _numbers(part, name) for side, part in sides.items() for name in columns}
    if "reverse" not in sides:
        with top.naming(backlash_mm="backlash", **{name: f"forward.{name}" for name in columns}):
            return UnidirectionalTable(
                positions_mm=numbers["forward_positions_mm"],
                errors_mm=numbers["forward_errors_mm"],
                backlash_mm=top.quantity("backlash", LENGTH),
                between=between,
            )
    if top.has("backlash"):
        allowed = "a backlash, or a table [reverse]: the errors of both directions hold it"
        raise FileFormatError(top.path, None, "'backlash' beside [reverse]", allowed)
    with top.naming(**{f"{side}_{name}": f"{side}.{name}" for side in sides for name in columns}):
        return BidirectionalTable(**numbers, between=between)


def _numbers(part: Section, key: str) -> npt.NDArray[np.float64]:
    values = part.raw(key)
    if not isinstance(values, list) or not all(type(value) in (int, float) for value in values):
        raise ArgumentError(part.where(key), repr(values)[:60], "a list of numbers")
    return column(part.where(key), values)


def _whole(part: Section, key: str) -> list[int]:
    values = part.raw(key)
    if not isinstance(values, list) or not all(type(value) is int for value in values):
        raise ArgumentError(part.where(key), repr(values)[:60], "a list of whole numbers")
    return values


def write_predictor(path: str | Path, known: KnownPredictor) -> None:
    """Write a trained predictor; the file appears whole or not at all.

    Raises
    ------
    ArgumentError
        A predictor that is neither a table nor networks nor a NARX network.
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> table = UnidirectionalTable(positions_mm=[0, 10], errors_mm=[0, 0.002], backlash_mm=0.003)
    >>> file = Path(tempfile.mkdtemp()) / "p.toml"
    >>> write_predictor(file, KnownPredictor(predictor=table, name="table"))
    >>> read_predictor(file).predictor == table
    True
    """
    predictor = known.predictor
    if isinstance(predictor, Narx):
        kind, body = NARX, _narx_lines(predictor)
    elif isinstance(predictor, TrainedNetworks):
        kind, body = NETWORKS, _network_lines(predictor)
    elif isinstance(predictor, UnidirectionalTable | BidirectionalTable):
        kind, body = TABLE, _table_lines(predictor)
    elif isinstance(predictor, AxisTables):
        kind, body = AXES, _axis_lines(predictor)
    else:
        raise ArgumentError("predictor", type(predictor).__name__, "tables or networks")
    lines = [f'predictor = "{kind}"', f"version = {VERSION}", f"name = {_text(known.name)}"]
    lines += [f"source = {_text(known.source)}"] if known.source else []
    lines += [f"axis = {known.axis}"] if known.axis is not None else []
    if not isinstance(predictor, Narx):
        low_mm, high_mm = predictor.range_mm
        lines.append(f'range = ["{low_mm!r} mm", "{high_mm!r} mm"]')
        lines += [f'interval = "{known.interval_mm!r} mm"'] if math.isfinite(known.interval_mm) else []
    write_lines(path, [*lines, *body])


def _network_lines(predictor: TrainedNetworks) -> Iterator[str]:
    yield f'pitch = "{predictor.pitch_mm!r} mm"'
    for network in predictor.networks:
        yield from ("", "[[network]]", *_lines_of({key: getattr(network, key) for key in _NETWORK}))


def _table_lines(table: UnidirectionalTable | BidirectionalTable) -> Iterator[str]:
    yield f'between = "{table.between.value}"'
    own = list(table.ways)
    if isinstance(table, UnidirectionalTable):
        yield f'backlash = "{table.backlash_mm!r} mm"'
        del own[1]
    for side, (positions, errors) in zip(_WAYS, own, strict=False):
        yield from ("", f"[{side}]", *_lines_of({"positions_mm": positions, "errors_mm": errors}))


def _axis_lines(predictor: AxisTables) -> Iterator[str]:
    names = {way: name for name, way in _WAYS.items()}
    for table in predictor.tables:
        told: dict[str, object] = {"of": table.of}
        if table.direction:
            told["direction"] = names[table.direction]
        if table.arm is not None:
            told |= {"arm": table.arm, "arm_mm": table.arm_mm}
        told["positions_mm"] = table.positions_mm
        told["errors_mm" if table.arm is None else "angles_rad"] = table.values
        yield from ("", "[[table]]", *_lines_of(told))


def _narx_lines(narx: Narx) -> Iterator[str]:
    yield f'period = "{narx.period_s!r} s"'
    yield f"unit = {_text(narx.unit)}"
    yield "inputs = [" + ", ".join(map(_text, narx.names)) + "]"
    shape = narx.shape
    delays = {"input_delays": shape.input_delays, "feedback_delays": shape.feedback_delays}
    yield from _lines_of(delays | {"neurons": shape.neurons, "linear": shape.linear})
    yield from _lines_of({name: getattr(narx, name) for name in ("middle", "half", "weights")})


def _lines_of(values: Mapping[str, object]) -> Iterator[str]:
    return (f"{key} = {_shown(value)}" for key, value in values.items())


def _shown(value: object) -> str:
    """Return a text, a number or a list of them as it stands in the file."""
    if isinstance(value, np.ndarray | tuple):
        return "[" + ", ".join(map(_shown, np.asarray(value).tolist())) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return _text(value) if isinstance(value, str) else repr(value)


def _text(value: str) -> str:
    plain = "".join(letter if letter.isprintable() and letter not in '"\\' else "?" for letter in value)
    return f'"{plain[:200]}"'
