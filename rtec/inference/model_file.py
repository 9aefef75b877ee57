"""Models as TOML files that people can read and change, and that give back the same numbers.

::

    observe = "deviation"
    observed = "mm"
    position = "mm"
    clock = "s"
    range = ["0 mm", "300 mm"]
    datum = "3.2 um"
    interval = "1.7 um"

    [[effect]]
    name = "cyclic"
    period = "6.35 mm"
    harmonics = 2
    amplitudes = ["1.25 um", "-0.4 um", "0.3 um", "0.1 um"]

    [[effect]]
    name = "backlash"
    backlash = "12.3 um"
    backlash_error = "0.4 um"

Only ``observe`` has to be there. Amplitudes that are left out are fitted to the measurement, and a period, a time
constant and the like that are left out are found by a scan.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from rtec.checks import number_within
from rtec.dataset.observed import DRIVE, observable_of
from rtec.effects import LIBRARY, Amplitude, Effect, Library, Observable, Units
from rtec.effects.curve import PREFIX as CURVE
from rtec.errors import ArgumentError, FileFormatError, nearest
from rtec.inference.forms import forms_of
from rtec.inference.model import Model, Term
from rtec.inference.shape_text import (
    field_keys,
    is_continuous,
    read_shape,
    shown_field,
    shown_list,
    shown_text,
    written_fields,
)
from rtec.io import brief, parse_toml, read_text, write_lines
from rtec.units import parse_in, written

MAX_BYTES = 200_000
"""A model is a page of text, with maps of many nodes a few; a larger file is something else."""
MAX_EFFECTS = 200
MAX_DOTS = 500
"""In a line: the parser's time and memory grow with the square of the parts of a dotted key."""
_UNITS = ("observed", "position", "clock")
_TOP = ("observe", *_UNITS, "load", "range", "datum", "interval", "effect")
_LISTS = ("amplitudes", "errors")
_LARGEST = sys.float_info.max
_UNIT = re.compile(r"[a-z][a-z_/0-9^*]{0,15}", re.ASCII | re.IGNORECASE)


def read_model(path: str | Path, units: Units | None = None, library: Library = LIBRARY) -> Model:
    r"""Read a model.

    Its terms have no amplitudes where the file gives none, and no shape where it leaves out a period, a time constant
    or the like. ``units`` are those inside of the measurement that the model is for; without, the file itself has to
    state them, as one written by :func:`write_model` does. An effect that does not come with rtec has to be in
    ``library``: a file names effects, and is never a way to run code.

    Raises
    ------
    FileFormatError
        No readable TOML, an unknown key or effect (the nearest one is suggested), an effect twice that can be there
        once only, or units other than those of the measurement.
    ArgumentError
        A quantity without or with a wrong unit, or out of range; it names file, effect and key.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "m.toml"
    >>> _ = file.write_text('observe = "deviation"\n[[effect]]\nname = "backlash"\nbacklash = "12 um"\n')
    >>> read_model(file, Units("mm", "mm", "s")).terms[0].amplitudes
    (0.012,)
    """
    return model_of_tables(path, model_tables(path), units, library)


def model_of_tables(
    path: str | Path, top: Mapping[str, Any], units: Units | None = None, library: Library = LIBRARY
) -> Model:
    """Return the model that the tables of a file make; ``path`` stands for it in messages.

    Raises
    ------
    FileFormatError, ArgumentError
        As `read_model`.

    Examples
    --------
    >>> model_of_tables("m", {"observe": "deviation", "effect": [{"name": "scale"}]}, Units("mm", "mm", "s")).names
    ('scale',)
    """
    model = Model(observe=observe_of_tables(path, top), units=_units(path, top, units))
    model = replace(model, range=_range(path, top, model.units))
    unit, factor = model.units.shown
    datum = parse_in(top["datum"], unit, name=f"{path}: datum", inside=factor) if "datum" in top else 0.0
    terms: list[Term] = []
    for entry in _effects(path, top, library):
        terms.append(entry.term(model.units))
        entry.check_place(model.observe, terms)
    return replace(model.with_terms(terms, datum=datum), interval=_interval(path, top, model.units))


def read_observe(path: str | Path) -> str:
    """Return which quantity the model of a file explains, before the measurement is read.

    Raises
    ------
    FileFormatError
        As :func:`read_model`.
    """
    return observe_of_tables(path, model_tables(path))


def write_model(path: str | Path, model: Model) -> None:
    """Write a model; the file appears whole or not at all.

    A standard error that is no finite number is left out.

    Raises
    ------
    ArgumentError
        A parameter that is no finite number.
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from rtec.effects import Shape
    >>> file = Path(tempfile.mkdtemp()) / "m.toml"
    >>> term = Term(effect=LIBRARY.named("backlash"), shape=Shape(), amplitudes=(0.0123,))
    >>> write_model(file, Model(observe="deviation", units=Units("mm", "mm", "s"), terms=(term,)))
    >>> print(file.read_text().splitlines()[-1])
    backlash = "12.3 um"
    """
    units = model.units
    lines = [f"observe = {shown_text(model.observe)}"]
    lines += [f"{key} = {shown_text(getattr(units, key))}" for key in (*_UNITS, *(["load"] if units.load else []))]
    if model.range is not None:
        ends = [f'"{written(end, units.position)}"' for end in model.range]
        lines.append(f"range = {shown_list(ends)}")
    if model.datum != 0.0:
        lines.append(f'datum = "{written(model.datum, units.shown[0], inside=units.shown[1])}"')
    if model.interval is not None:
        lines.append(f'interval = "{written(model.interval, units.shown[0], inside=units.shown[1])}"')
    for term in model.terms:
        lines += ["", "[[effect]]", f"name = {shown_text(term.name)}", *_term_lines(term, units)]
    write_lines(path, lines)


def _term_lines(term: Term, units: Units) -> Iterator[str]:
    """Yield the lines of a term behind its name: shape, amplitudes, standard errors, as far as they are known."""
    if term.shape is None:
        return
    shape_errors = dict(term.shape_errors)
    for item in written_fields(term.shape):
        yield f"{item.name} = {shown_field(item, getattr(term.shape, item.name), units)}"
        error = shape_errors.get(item.name, math.nan)
        if math.isfinite(error):
            yield f"{item.name}_error = {shown_field(item, error, units)}"
    if term.amplitudes is None:
        return
    named = term.effect.amplitudes(term.shape, units)
    amounts, errors = _amount_keys(term.effect, named)
    yield _amount_line(amounts, term.amplitudes, named)
    if term.errors is not None and all(math.isfinite(error) for error in term.errors):
        yield _amount_line(errors, term.errors, named)


def _amount_line(key: str, values: Sequence[float], named: Sequence[Amplitude]) -> str:
    shown = [
        f'"{written(value, a.unit, inside=a.factor)}"' if a.unit else repr(float(value))
        for value, a in zip(values, named, strict=True)
    ]
    return f"{key} = {shown_list(shown) if key in _LISTS else shown[0]}"


def _amount_keys(effect: Effect, named: Sequence[Amplitude]) -> tuple[str, str]:
    """Return the keys of amplitudes and errors: the name of the only amplitude, unless it means something else."""
    if len(named) != 1 or named[0].name in ("name", *_LISTS, *field_keys(effect.shape_type)):
        return _LISTS
    return named[0].name, f"{named[0].name}_error"


def model_tables(path: str | Path) -> dict[str, Any]:
    """Return the tables of a model's file, with known keys at the top."""
    text = read_text(path, "a model in TOML", most_bytes=MAX_BYTES)
    for number, line in enumerate(text.split("\n"), start=1):
        if line.count(".") > MAX_DOTS:
            raise FileFormatError(path, number, f"{line.count('.')} dots in a line", f"at most {MAX_DOTS}")
    top = parse_toml(text, path)
    for key in top:
        if key not in _TOP:
            hint = nearest(key, _TOP) if key != "effects" else "write [[effect]]"
            raise FileFormatError(path, None, f"unknown key {brief(key)!r}", f"{', '.join(_TOP)}; {hint}")
    return top


def observe_of_tables(path: str | Path, top: Mapping[str, Any]) -> str:
    """Return which quantity a model explains."""
    observe = top.get("observe")
    if not isinstance(observe, str) or not 0 < len(observe) <= 100 or not observe.isprintable():
        problem = "no key 'observe'" if observe is None else f"observe = {brief(repr(observe))}"
        raise FileFormatError(path, None, problem, 'the quantity that is explained, such as observe = "deviation"')
    return observe


def _units(path: str | Path, top: Mapping[str, Any], wanted: Units | None) -> Units:
    found = {key: top[key] for key in (*_UNITS, "load") if key in top}
    for key, unit in found.items():
        if not isinstance(unit, str) or not _UNIT.fullmatch(unit):
            raise FileFormatError(path, None, f"{key} = {brief(repr(unit))}", "a unit such as mm, deg, n or s")
    if wanted is None:
        if missing := ", ".join(key for key in _UNITS if key not in found):
            allowed = 'units, such as observed = "mm", or a measurement that the model is for'
            raise FileFormatError(path, None, f"no unit of: {missing}", allowed)
        return Units(**found)
    for key in ("observed", "position", "load"):
        if found.get(key, getattr(wanted, key)) != getattr(wanted, key):
            problem = f"{key} in {found[key]}, while the measurement has {getattr(wanted, key) or 'none'}"
            raise FileFormatError(path, None, problem, "a model of the same kind of axis and quantity")
    return wanted


def _range(path: str | Path, top: Mapping[str, Any], units: Units) -> tuple[float, float] | None:
    """Return the positions that the model was measured at, from the first to the last."""
    ends = top.get("range")
    if ends is None:
        return None
    if not isinstance(ends, list) or len(ends) != 2:
        problem = f"range = {brief(repr(ends))}"
        raise FileFormatError(
            path, None, problem, f"two positions, such as ['0 {units.position}', '300 {units.position}']"
        )
    low, high = (parse_in(end, units.position, name=f"{path}: range") for end in ends)
    if not low <= high:
        raise FileFormatError(path, None, f"range from {low:g} to {high:g} {units.position}", "the lower end first")
    return low, high


def _interval(path: str | Path, top: Mapping[str, Any], units: Units) -> float | None:
    """Return how far readings lie from what the model says, where the file states it."""
    if "interval" not in top:
        return None
    unit, factor = units.shown
    half = parse_in(top["interval"], unit, name=f"{path}: interval", inside=factor)
    if half < 0.0:
        raise ArgumentError(f"{path}: interval", brief(repr(top["interval"])), "0 or more")
    return half


def _effects(path: str | Path, top: Mapping[str, Any], library: Library) -> Iterator[_Entry]:
    entries = top.get("effect", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise FileFormatError(path, None, "'effect' is no list of tables", "[[effect]] in front of each effect")
    if len(entries) > MAX_EFFECTS:
        raise FileFormatError(path, None, f"{len(entries)} effects", f"at most {MAX_EFFECTS}")
    for number, entry in enumerate(entries, start=1):
        name = entry.get("name")
        if not isinstance(name, str):
            raise FileFormatError(path, None, f"effect {number} has no name", 'such as name = "backlash"')
        if name == CURVE and isinstance(entry.get("over"), str):
            ways = ["direction"] if entry.get("by_direction") is True else []
            name = f"{CURVE}:{'*'.join([entry['over'], *([entry['across']] if entry.get('across') else []), *ways])}"
        try:
            effect = library.named(name)
        except ArgumentError as error:
            near = error.hint if not error.hint.startswith("known") else ""
            somebodys = "'rtec effects' lists those of the library, --effects FILE.py brings your own"
            allowed = "; ".join(part for part in (error.allowed, near, somebodys) if part)
            raise FileFormatError(path, None, f"effect {number}: no effect {brief(name)!r}", allowed) from None
        yield _Entry(path, number, effect, entry)


@dataclass(frozen=True, slots=True)
class _Entry:
    """One ``[[effect]]`` of a file, its number from 1, the effect that it names, and its keys."""

    path: str | Path
    number: int
    effect: Effect
    table: Mapping[str, Any]

    def check_place(self, observe: str, terms: Sequence[Term]) -> None:
        """Refuse what explains another kind of quantity, and a second of what can be there once.

        ``terms`` are those of the file so far, this one with them.
        """
        if self.effect.observable is not None and self.effect.observable is not observable_of(observe):
            kinds = {Observable.DEVIATION: "a position deviation", Observable.DRIVE: " or ".join(DRIVE)}
            problem = f"{self.effect.name} belongs to {kinds[self.effect.observable]}, not to {observe!r}"
            raise self._wrong(problem, f"effects of {kinds[observable_of(observe)]}; 'rtec effects' lists them")
        again = sum(term.name == self.effect.name for term in terms)
        if again > (most := forms_of(self.effect).at_most):
            allowed = "once" if most == 1 else f"{most} times at most"
            raise self._wrong(f"{self.effect.name} stands there {again} times", allowed)

    def term(self, units: Units) -> Term:
        """Return the effect with the numbers that the file gives."""
        items = fields(self.effect.shape_type)
        given = {item.name: self.table[item.name] for item in items if item.name in self.table}
        shape = read_shape(self.effect, given, units, name=self._name)
        named = self.effect.amplitudes(self.effect.shape_type() if shape is None else shape, units)
        keys = _amount_keys(self.effect, named)
        self._check_keys(keys)
        amplitudes, errors = (self._numbers(*both, named) for both in zip(_LISTS, keys, strict=True))
        if shape is None and amplitudes is not None:
            raise self._wrong(f"amplitudes without {', '.join(item.name for item in items)}", "both")
        if amplitudes is not None and self.effect.not_negative and min(amplitudes) < 0.0:
            raise ArgumentError(self._name(keys[0]), min(amplitudes), "0 or more")
        if errors is not None and amplitudes is None:
            raise self._wrong("errors without amplitudes", "both")
        if errors is not None and min(errors) < 0.0:
            raise ArgumentError(self._name(keys[1]), min(errors), "0 or more")
        shape_errors = []
        for item in items:
            key = f"{item.name}_error"
            if key in self.table:
                error = self._number(key, self.table[key], Amplitude(key, units.of(item), 1.0))
                shape_errors.append((item.name, error))
        own = tuple(shape_errors)
        return Term(effect=self.effect, shape=shape, amplitudes=amplitudes, errors=errors, shape_errors=own)

    def _name(self, key: str) -> str:
        return f"{self.path}: effect {self.number} ({self.effect.name}): {key}"

    def _wrong(self, problem: str, allowed: str) -> FileFormatError:
        return FileFormatError(self.path, None, f"effect {self.number}: {problem}", allowed)

    def _check_keys(self, amounts: tuple[str, str]) -> None:
        tuned = [f"{item.name}_error" for item in fields(self.effect.shape_type) if is_continuous(item)]
        own = () if amounts == _LISTS else amounts
        known = ["name", *field_keys(self.effect.shape_type), *tuned, *own, *_LISTS]
        for key in self.table:
            if key not in known:
                problem = f"effect {self.number} ({self.effect.name}): unknown key {brief(key)!r}"
                raise FileFormatError(self.path, None, problem, f"{', '.join(known)}; {nearest(key, known)}")

    def _numbers(self, key: str, single: str, named: Sequence[Amplitude]) -> tuple[float, ...] | None:
        """Return amplitudes or their errors, from a list or the key of the only one; None where there are none."""
        if single != key and single in self.table:
            if key in self.table:
                raise self._wrong(f"{key} and {single}", "one of them")
            return (self._number(single, self.table[single], named[0]),)
        if key not in self.table:
            return None
        values = self.table[key]
        if not isinstance(values, list) or len(values) != len(named):
            what = f"{len(values)} of them" if isinstance(values, list) else brief(repr(values))
            wanted = ", ".join(f"{a.name} in {a.unit}" for a in named)
            raise ArgumentError(self._name(key), what, f"a list of {len(named)}: {brief(wanted)}")
        return tuple(self._number(f"{key} ({a.name})", value, a) for value, a in zip(values, named, strict=True))

    def _number(self, key: str, value: Any, what: Amplitude) -> float:
        if what.unit:
            return parse_in(value, what.unit, name=self._name(key), inside=what.factor)
        return number_within(self._name(key), value, -_LARGEST, _LARGEST)
