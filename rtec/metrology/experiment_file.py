"""Experiment plans as TOML that people read and edit, and that give back the same numbers.

::

    # measure both directions in turn, at least five times ...
    reading = "position at rest"
    columns = ["direction", "time"]

    [targets]
    start = "20 mm"
    end = "320 mm"
    number = 21
    spacing = "even"
    shifts = ["0 mm"]

    [runs]
    number = 5
    passes = "both directions"
    feeds = ["40 mm/s"]
    overshoot = "1 mm"
    dwell = "6 s"
    rests_before_reversals = ["2 s", "60 s"]
    zero = "set anew before each run"

    [conditions]
    heating = "steady"
    weather = "steady"

What is left out is as in `ExperimentPlan`. Positions of an axis that turns are in degrees. In motion
``targets.number`` is that of the moves of a run, and ``runs.strokes`` says how they go.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rtec.errors import ArgumentError, FileFormatError
from rtec.io import Section, read_toml, write_lines
from rtec.metrology.experiment_plan import MOST_IN_TURN, ExperimentPlan
from rtec.units import parse_in, written

KEYS: Mapping[str, str] = MappingProxyType(
    {
        "reading": "reading",
        "columns": "columns",
        "start_mm": "targets.start",
        "span_mm": "targets.end",
        "targets": "targets.number",
        "spacing": "targets.spacing",
        "shifts_mm": "targets.shifts",
        "runs": "runs.number",
        "passes": "runs.passes",
        "strokes": "runs.strokes",
        "feeds_mm_s": "runs.feeds",
        "overshoot_mm": "runs.overshoot",
        "dwell_s": "runs.dwell",
        "turn_dwells_s": "runs.rests_before_reversals",
        "zero": "runs.zero",
        "heating": "conditions.heating",
        "weather": "conditions.weather",
        "loads_kg": "conditions.loads",
    }
)
"""Where each field of a plan stands in the file."""
_UNITS = {
    "start_mm": "{}",
    "span_mm": "{}",
    "shifts_mm": "{}",
    "feeds_mm_s": "{}/s",
    "overshoot_mm": "{}",
    "dwell_s": "s",
    "turn_dwells_s": "s",
    "loads_kg": "kg",
}
"""Units in the file of the fields that have one; {} is that of the positions."""
_MOST = {"targets": 2000, "runs": 99}
_TABLES = ("targets", "runs", "conditions")
_AT_REST = frozenset(("spacing", "shifts", "overshoot", "dwell", "rests_before_reversals", "zero"))
_IN_MOTION = frozenset(("strokes",))
"""Keys that mean something at rest, or in motion, only: written elsewhere where they are not as usual."""
_WIDTH = 118


@contextmanager
def naming_keys(path: str | Path) -> Iterator[None]:
    """Let an error about a field of a plan name the file and the key that it came from."""
    try:
        yield
    except ArgumentError as error:
        field = error.name.removeprefix("number of ")
        if field not in KEYS:
            raise
        raise error.of(f"{path}: {KEYS[field]}") from None


def read_experiment(path: str | Path) -> ExperimentPlan:
    r"""Read an experiment plan.

    Raises
    ------
    FileFormatError
        No readable TOML, or an unknown key (the nearest one is suggested).
    ArgumentError
        A quantity without or with a wrong unit, an unknown word, or a value out of range; it names file and key.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "plan.toml"
    >>> _ = file.write_text('[targets]\nstart = "0 inch"\nend = "10 inch"\n[runs]\nnumber = 7\n')
    >>> read_experiment(file).span_mm, read_experiment(file).runs
    (254.0, 7)
    """
    return experiment_of(read_toml(Path(path)), path)


def experiment_of(tables: dict[str, Any], path: str | Path) -> ExperimentPlan:
    """Return the experiment plan that parsed TOML holds; ``path`` is for messages.

    Raises
    ------
    FileFormatError, ArgumentError
        As `read_experiment`.

    Examples
    --------
    >>> experiment_of({"runs": {"number": 3}}, "plan.toml").runs
    3
    """
    for name in _TABLES:
        if not isinstance(tables.get(name, {}), dict):
            raise FileFormatError(path, None, f"{name} is no table", f"a table [{name}]")
    rotary = _turns(tables)
    usual = ExperimentPlan(rotary=rotary)
    default = _tables_of(usual)
    top = {key: value for key, value in default.items() if key not in _TABLES}
    sections = {"": Section(path, "", tables, top, optional=_TABLES)} | {
        name: Section(path, name, tables.get(name, {}), default[name], optional=("loads",) * (name == "conditions"))
        for name in _TABLES
    }
    values: dict[str, Any] = {}
    for field, place in KEYS.items():
        table, _, key = place.rpartition(".")
        if sections[table].has(key):
            values[field] = _read(sections[table], key, field, getattr(usual, field), _unit(field, rotary))
    start, end = values["start_mm"], values.pop("span_mm")
    if end <= start:
        unit = _unit("start_mm", rotary)
        raise ArgumentError(f"{path}: targets.end", f"{end:g} {unit}", f"more than targets.start, {start:g} {unit}")
    with naming_keys(path):
        return ExperimentPlan(rotary=rotary, span_mm=end - start, **values)


def _unit(field: str, rotary: bool) -> str:
    """Return the unit of a field in the file; empty for what has none."""
    return _UNITS.get(field, "").format("deg" if rotary else "mm")


def _read(section: Section, key: str, field: str, usual: object, unit: str) -> object:
    """Return the value of a field, of the kind that its usual value is."""
    if isinstance(usual, Enum):
        return section.choice(key, type(usual))
    if isinstance(usual, int):
        return section.whole(key, 2 if field == "targets" else 1, _MOST[field])
    where = section.where(key)
    if isinstance(usual, float):
        return parse_in(section.raw(key), unit, name=where)
    texts = section.texts(key)
    if not unit:
        return tuple(texts)
    if len(texts) > MOST_IN_TURN:
        raise ArgumentError(where, f"{len(texts)} values", f"at most {MOST_IN_TURN}")
    return tuple(parse_in(text, unit, name=where) for text in texts)


def _turns(tables: Mapping[str, Any]) -> bool:
    """Return whether positions are angles: whether the start is one."""
    start = tables.get("targets", {}).get("start")
    try:
        parse_in(start, "deg", name="start")
    except ArgumentError:
        return False
    return True


def write_experiment(path: str | Path, plan: ExperimentPlan, about: str = "") -> None:
    """Write an experiment plan; the file appears whole or not at all; ``about`` is a comment above it.

    Raises
    ------
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "plan.toml"
    >>> plan = ExperimentPlan(runs=9, feeds_mm_s=(12.5, 0.3))
    >>> write_experiment(file, plan, "measure again")
    >>> print(file.read_text().splitlines()[0], read_experiment(file) == plan)
    # measure again True
    """
    write_lines(path, experiment_lines(plan, about))


def experiment_lines(plan: ExperimentPlan, about: str = "") -> list[str]:
    """Return the lines of the TOML file of an experiment plan.

    Examples
    --------
    >>> experiment_lines(ExperimentPlan())[1]
    'columns = ["direction", "time"]'
    """
    one_line = " ".join("".join(c if c.isprintable() else " " for c in about).split())
    lines = [f"# {line}" for line in textwrap.wrap(one_line, _WIDTH - 2)]
    usual = _tables_of(ExperimentPlan(rotary=plan.rotary))
    idle = _AT_REST if plan.in_motion else _IN_MOTION
    for key, value in _tables_of(plan).items():
        if isinstance(value, dict):
            told = {name: one for name, one in value.items() if name not in idle or one != usual[key][name]}
            lines += ["", f"[{key}]", *(f"{name} = {_shown(one)}" for name, one in told.items())]
        else:
            lines.append(f"{key} = {_shown(value)}")
    return lines


def _tables_of(plan: ExperimentPlan) -> dict[str, Any]:
    tables: dict[str, Any] = {}
    for field, place in KEYS.items():
        table, _, key = place.rpartition(".")
        value = plan.end_mm if field == "span_mm" else getattr(plan, field)
        if value or field != "loads_kg":
            into = tables.setdefault(table, {}) if table else tables
            into[key] = _told(value, _unit(field, plan.rotary))
    return tables


def _told(value: Any, unit: str) -> Any:
    """Return the value of a field as TOML has it: a text, a whole number or a list."""
    if isinstance(value, tuple):
        return [_told(one, unit) for one in value]
    if isinstance(value, Enum):
        return value.value
    return written(value, unit) if unit else value


def _shown(value: str | int | list[str]) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_shown, value))}]"
    return str(value) if isinstance(value, int) else f'"{value}"'
