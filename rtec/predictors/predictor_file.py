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
positions of other axes as well; ``axis`` is the number of the axis itself, where it is known. Models of motion have
other keys (`rtec.predictors.motion_file`), and so have those of warm machines (`rtec.predictors.warm.warm_file`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rtec.errors import ArgumentError, FileFormatError
from rtec.io import Section, read_toml, write_lines
from rtec.link._frame_kernels import MOST_AXES
from rtec.predictors._columns import span
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
from rtec.predictors.axis_tables import AxisTable, AxisTables
from rtec.predictors.layered import LayeredNetwork, TrainedNetworks
from rtec.predictors.motion_file import KnownMotion, head_of, is_motion, read_motion, write_motion
from rtec.predictors.protocol import FORWARD, REVERSE, Predictor
from rtec.predictors.sequences import DynamicModel
from rtec.predictors.tables import Between, BidirectionalTable, UnidirectionalTable
from rtec.predictors.warm import warm_file
from rtec.predictors.warm.warm_model import WarmModel
from rtec.units import LENGTH

_HEAD = ("predictor", "version", "name", "source", "axis", "range", "interval")
_WARM = "warm"
_NETWORK = ("inputs", "middle", "half", "hidden", "weights", "bias_mm", "factor_mm")
_TABLE = ("of", "direction", "arm", "arm_mm", "positions_mm", "errors_mm", "angles_rad")
_WAYS = {"forward": FORWARD, "reverse": REVERSE}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownPredictor:
    """A predictor with what is known of it.

    Parameters
    ----------
    predictor
        A table or networks; or a model of motion or of a warm machine, which predicts from what came before.
    name, source
        What it is, and the measurement that it was fitted to.
    interval_mm
        Half width of the interval in which 90 % of readings lie; infinite where that is not known.
    axis
        Number of the axis, None where the measurement did not say it.
    """

    predictor: Predictor | DynamicModel | WarmModel
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
            A model of motion, or of a warm machine.
        """
        if isinstance(self.predictor, WarmModel):
            why = "a model of a warm machine knows no positions; rtec export makes a table of it at a temperature"
            raise ArgumentError("predictor", self.name, "tables or networks over position and direction", why)
        if not isinstance(self.predictor, Predictor):
            why = "a model of motion predicts sample by sample; rtec compare --model takes it to another log"
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


def is_warm_file(path: str | Path) -> bool:
    """Return whether a TOML file holds a model of a warm machine.

    Raises
    ------
    FileFormatError
        No readable TOML.
    """
    return bool(read_toml(Path(path), most_bytes=MOST_BYTES).get("predictor") == _WARM)


def read_warm_model(path: str | Path, *, cautious: bool = False) -> tuple[KnownPredictor, WarmModel]:
    """Read a model of a warm machine, with what is known of it.

    Parameters
    ----------
    path
        Written by ``rtec train``.
    cautious
        Whether the PC asks for no more than its interval supports.

    Raises
    ------
    RtecError
        As for `read_predictor`, another predictor, or caution with a file that has no interval.
    """
    known = read_predictor(path)
    if not isinstance(known.predictor, WarmModel):
        raise ArgumentError(str(path), known.name, "a model of a warm machine")
    return known, replace(known.predictor, cautious=cautious)


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
    kind = given.get("predictor")
    if is_motion(given):
        motion = read_motion(path)
        return KnownPredictor(predictor=motion.model, name=motion.name, source=motion.source, axis=motion.axis)
    if not isinstance(kind, str) or kind not in (*_KINDS, _WARM):
        allowed = " or ".join(f'"{name}"' for name in (*_KINDS, _WARM))
        raise FileFormatError(path, None, f"predictor = {kind!r}"[:80], allowed)
    check_version(path, given)
    if kind == _WARM:
        return _read_warm(path, given)
    top = Section(path, "", given, {}, optional=(*_HEAD, *_KINDS[kind].keys))
    ends = top.texts("range")
    if len(ends) != 2:
        raise ArgumentError(top.where("range"), f"{len(ends)} values", "its lower and its upper end")
    low_mm, high_mm = top.quantities("range", LENGTH)
    with top.naming(range_mm="range", pitch_mm="pitch", networks="network", tables="table"):
        predictor = _KINDS[kind].read(top, low_mm, high_mm)
    if predictor.range_mm != (low_mm, high_mm):
        found = f"{low_mm:g} to {high_mm:g} mm"
        raise ArgumentError(top.where("range"), found, f"{predictor.range_mm[0]:g} to {predictor.range_mm[1]:g} mm")
    interval = top.quantity("interval", LENGTH) if top.has("interval") else math.inf
    if not interval >= 0.0:
        raise ArgumentError(top.where("interval"), f"{interval:g} mm", "a length from 0")
    return KnownPredictor(
        predictor=predictor,
        name=top.text("name"),
        source=top.text("source") if top.has("source") else "",
        interval_mm=interval,
        axis=top.whole("axis", 1, MOST_AXES) if top.has("axis") else None,
    )


def _read_warm(path: str | Path, given: dict[str, Any]) -> KnownPredictor:
    top = Section(path, "", given, {}, optional=(*(key for key in _HEAD if key != "range"), *warm_file.KEYS))
    model = warm_file.read_warm(top)
    return KnownPredictor(
        predictor=model,
        name=top.text("name"),
        source=top.text("source") if top.has("source") else "",
        interval_mm=model.interval_mm,
        axis=top.whole("axis", 1, MOST_AXES) if top.has("axis") else None,
    )


def _axes(top: Section, low_mm: float, high_mm: float) -> AxisTables:
    return AxisTables(tables=tuple(_axis_tables(top)), range_mm=(low_mm, high_mm))


def _axis_tables(top: Section) -> Iterator[AxisTable]:
    for part in entries(top, "table", _TABLE):
        arm = part.text("arm") if part.has("arm") else None
        values = "errors_mm" if arm is None else "angles_rad"
        way = part.text("direction") if part.has("direction") else ""
        if way and way not in _WAYS:
            raise ArgumentError(part.where("direction"), repr(way)[:60], " or ".join(_WAYS))
        with part.naming(of="of", arm="arm", arm_mm="arm_mm", positions_mm="positions_mm", values=values):
            ends = (0.0, 1.0) if arm is None else span("arm_mm", numbers(part, "arm_mm"))
            yield AxisTable(
                of=part.text("of"),
                positions_mm=numbers(part, "positions_mm"),
                values=numbers(part, values),
                direction=_WAYS.get(way, 0),
                arm=arm,
                arm_mm=ends,
            )


def _networks(top: Section, low_mm: float, high_mm: float) -> TrainedNetworks:
    found = []
    for part in entries(top, "network", _NETWORK):
        with part.naming(**{name: name for name in _NETWORK}):
            found.append(
                LayeredNetwork(
                    inputs=tuple(part.texts("inputs")),
                    middle=numbers(part, "middle"),
                    half=numbers(part, "half"),
                    hidden=tuple(whole_numbers(part, "hidden")),
                    weights=numbers(part, "weights"),
                    bias_mm=part.number("bias_mm", -1e6, 1e6),
                    factor_mm=part.number("factor_mm", -1e6, 1e6),
                )
            )
    pitch_mm = top.quantity("pitch", LENGTH) if top.has("pitch") else 1.0
    if not top.has("pitch") and any("turn" in network.inputs for network in found):
        raise FileFormatError(top.path, None, "no 'pitch' for an input 'turn'", 'pitch = "5 mm"')
    return TrainedNetworks(networks=tuple(found), range_mm=(low_mm, high_mm), pitch_mm=pitch_mm)


def _table(top: Section, low_mm: float, high_mm: float) -> UnidirectionalTable | BidirectionalTable:
    between = top.choice("between", Between) if top.has("between") else Between.LINES
    columns = ("positions_mm", "errors_mm")
    sides = {side: top.part(side, top.raw(side), columns) for side in ("forward", "reverse") if top.has(side)}
    if "forward" not in sides:
        raise FileFormatError(top.path, None, "no table [forward]", "[forward] with positions_mm and errors_mm")
    columns_of = {f"{side}_{name}": numbers(part, name) for side, part in sides.items() for name in columns}
    if "reverse" not in sides:
        with top.naming(backlash_mm="backlash", **{name: f"forward.{name}" for name in columns}):
            return UnidirectionalTable(
                positions_mm=columns_of["forward_positions_mm"],
                errors_mm=columns_of["forward_errors_mm"],
                backlash_mm=top.quantity("backlash", LENGTH),
                between=between,
            )
    if top.has("backlash"):
        allowed = "a backlash, or a table [reverse]: the errors of both directions hold it"
        raise FileFormatError(top.path, None, "'backlash' beside [reverse]", allowed)
    with top.naming(**{f"{side}_{name}": f"{side}.{name}" for side in sides for name in columns}):
        return BidirectionalTable(**columns_of, between=between)


def write_predictor(path: str | Path, known: KnownPredictor) -> None:
    """Write a trained predictor; the file appears whole or not at all.

    Raises
    ------
    ArgumentError
        A predictor that is neither a table nor networks nor a model of motion.
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
    kind = next((name for name, each in _KINDS.items() if isinstance(predictor, each.of)), None)
    if isinstance(predictor, WarmModel):
        write_lines(path, [*_head_lines(_WARM, known), *warm_file.warm_lines(predictor)])
        return
    if not isinstance(predictor, Predictor):
        motion = KnownMotion(
            model=predictor, head=head_of(predictor), name=known.name, source=known.source, axis=known.axis
        )
        write_motion(path, motion)
        return
    if kind is None:
        raise ArgumentError("predictor", type(predictor).__name__, "tables or networks")
    low_mm, high_mm = predictor.range_mm
    lines = _head_lines(kind, known)
    lines.append(f'range = ["{low_mm!r} mm", "{high_mm!r} mm"]')
    lines += [f'interval = "{known.interval_mm!r} mm"'] if math.isfinite(known.interval_mm) else []
    write_lines(path, [*lines, *_KINDS[kind].lines(predictor)])


def _head_lines(kind: str, known: KnownPredictor) -> list[str]:
    lines = [f'predictor = "{kind}"', f"version = {VERSION}", f"name = {quoted(known.name)}"]
    lines += [f"source = {quoted(known.source)}"] if known.source else []
    return lines + ([f"axis = {known.axis}"] if known.axis is not None else [])


def _network_lines(predictor: TrainedNetworks) -> Iterator[str]:
    yield f'pitch = "{predictor.pitch_mm!r} mm"'
    for network in predictor.networks:
        yield from ("", "[[network]]", *lines_of({key: getattr(network, key) for key in _NETWORK}))


def _table_lines(table: UnidirectionalTable | BidirectionalTable) -> Iterator[str]:
    yield f'between = "{table.between.value}"'
    own = list(table.ways)
    if isinstance(table, UnidirectionalTable):
        yield f'backlash = "{table.backlash_mm!r} mm"'
        del own[1]
    for side, (positions, errors) in zip(_WAYS, own, strict=False):
        yield from ("", f"[{side}]", *lines_of({"positions_mm": positions, "errors_mm": errors}))


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
        yield from ("", "[[table]]", *lines_of(told))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kind:
    """How one kind of predictor stands in a file: what it is, its own keys, and from and to TOML."""

    of: tuple[type, ...]
    keys: tuple[str, ...]
    read: Callable[[Section, float, float], Predictor]
    lines: Callable[[Any], Iterator[str]]


_KINDS = {
    "networks": _Kind(of=(TrainedNetworks,), keys=("pitch", "network"), read=_networks, lines=_network_lines),
    "table": _Kind(
        of=(UnidirectionalTable, BidirectionalTable),
        keys=("between", "backlash", "forward", "reverse"),
        read=_table,
        lines=_table_lines,
    ),
    "tables of axes": _Kind(of=(AxisTables,), keys=("table",), read=_axes, lines=_axis_lines),
}
