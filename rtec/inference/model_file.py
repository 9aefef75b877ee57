"""Models as TOML files that people can read and change, and that give back the same numbers.

::

    observe = "deviation"
    observed = "mm"
    position = "mm"
    clock = "s"
    datum = "3.2 um"

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

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rtec.effects import Units, effect_named
from rtec.errors import ArgumentError, FileFormatError, nearest
from rtec.inference.model import Model, Term
from rtec.inference.model_entry import ModelEntry, brief, term_lines
from rtec.inference.shape_text import shown_text
from rtec.metrology.text_file import read_text, write_lines
from rtec.units import parse_in, written

MAX_BYTES = 200_000
"""A model is a page of text, with maps of many nodes a few; a larger file is something else."""
MAX_EFFECTS = 200
MAX_DOTS = 500
"""In a line: the parser's time and memory grow with the square of the parts of a dotted key."""
_TOP = ("observe", "observed", "position", "clock", "datum", "effect")
_UNIT = re.compile(r"[a-z][a-z_/0-9^*]{0,15}", re.ASCII | re.IGNORECASE)


def read_model(path: str | Path, units: Units | None = None) -> Model:
    r"""Read a model.

    Parameters
    ----------
    path
        TOML file.
    units
        Units inside of the measurement that the model is for; without, the file itself has to state them, as one
        written by :func:`write_model` does.

    Returns
    -------
    Model
        Its terms have no amplitudes where the file gives none, and no shape where it leaves out a period, a time
        constant or the like.

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
    top = _tables(path)
    model = Model(observe=_observe(path, top), units=_units(path, top, units))
    unit, factor = model.units.shown
    datum = parse_in(top["datum"], unit, name=f"{path}: datum", inside=factor) if "datum" in top else 0.0
    terms: list[Term] = []
    for entry in _effects(path, top):
        terms.append(entry.term(model.units))
        entry.check_place(model.observe, terms)
    return model.with_terms(terms, datum=datum)


def read_observe(path: str | Path) -> str:
    """Return which quantity the model of a file explains, before the measurement is read.

    Raises
    ------
    FileFormatError
        As :func:`read_model`.
    """
    return _observe(path, _tables(path))


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
    >>> term = Term(effect=effect_named("backlash"), shape=Shape(), amplitudes=(0.0123,))
    >>> write_model(file, Model(observe="deviation", units=Units("mm", "mm", "s"), terms=(term,)))
    >>> print(file.read_text().splitlines()[-1])
    backlash = "12.3 um"
    """
    write_lines(path, model_lines(model))


def model_lines(model: Model) -> list[str]:
    """Return the lines of a model's file."""
    units = model.units
    lines = [f"observe = {shown_text(model.observe)}"]
    lines += [f"{key} = {shown_text(getattr(units, key))}" for key in ("observed", "position", "clock")]
    if model.datum != 0.0:
        lines.append(f'datum = "{written(model.datum, units.shown[0], inside=units.shown[1])}"')
    for term in model.terms:
        lines += ["", "[[effect]]", f"name = {shown_text(term.name)}", *term_lines(term, units)]
    return lines


def _tables(path: str | Path) -> dict[str, Any]:
    """Return the tables of the file, with known keys at the top."""
    file = Path(path)
    try:
        size = file.stat().st_size if file.is_file() else 0
    except (OSError, ValueError):  # read_text says what is wrong
        size = 0
    if size > MAX_BYTES:
        raise FileFormatError(path, None, f"{size} bytes", f"a model (TOML) of at most {MAX_BYTES} bytes")
    text = read_text(path)
    for number, line in enumerate(text.split("\n"), start=1):
        if line.count(".") > MAX_DOTS:
            raise FileFormatError(path, number, f"{line.count('.')} dots in a line", f"at most {MAX_DOTS}")
    try:
        top = tomllib.loads(text)
    except RecursionError:
        raise FileFormatError(path, None, "nested too deeply", "a model in TOML") from None
    except FileFormatError:
        raise
    except ValueError as error:  # the parser's own, and that of a number with thousands of digits
        raise FileFormatError(path, None, brief(error), "a model in TOML") from None
    for key in top:
        if key not in _TOP:
            hint = nearest(key, _TOP) if key != "effects" else "write [[effect]]"
            raise FileFormatError(path, None, f"unknown key {brief(key)!r}", f"{', '.join(_TOP)}; {hint}")
    return top


def _observe(path: str | Path, top: Mapping[str, Any]) -> str:
    observe = top.get("observe")
    if not isinstance(observe, str) or not 0 < len(observe) <= 100 or not observe.isprintable():
        problem = "no key 'observe'" if observe is None else f"observe = {brief(repr(observe))}"
        raise FileFormatError(path, None, problem, 'the quantity that is explained, such as observe = "deviation"')
    return observe


def _units(path: str | Path, top: Mapping[str, Any], wanted: Units | None) -> Units:
    found = {key: top[key] for key in ("observed", "position", "clock") if key in top}
    for key, unit in found.items():
        if not isinstance(unit, str) or not _UNIT.fullmatch(unit):
            raise FileFormatError(path, None, f"{key} = {brief(repr(unit))}", "a unit such as mm, deg, n or s")
    if wanted is None:
        if len(found) < 3:
            missing = ", ".join(key for key in ("observed", "position", "clock") if key not in found)
            allowed = 'units, such as observed = "mm", or a measurement that the model is for'
            raise FileFormatError(path, None, f"no unit of: {missing}", allowed)
        return Units(**found)
    for key in ("observed", "position"):
        if found.get(key, getattr(wanted, key)) != getattr(wanted, key):
            problem = f"{key} in {found[key]}, while the measurement has {getattr(wanted, key)}"
            raise FileFormatError(path, None, problem, "a model of the same kind of axis and quantity")
    return wanted


def _effects(path: str | Path, top: Mapping[str, Any]) -> Iterator[ModelEntry]:
    entries = top.get("effect", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise FileFormatError(path, None, "'effect' is no list of tables", "[[effect]] in front of each effect")
    if len(entries) > MAX_EFFECTS:
        raise FileFormatError(path, None, f"{len(entries)} effects", f"at most {MAX_EFFECTS}")
    for number, entry in enumerate(entries, start=1):
        name = entry.get("name")
        if not isinstance(name, str):
            raise FileFormatError(path, None, f"effect {number} has no name", 'such as name = "backlash"')
        try:
            effect = effect_named(name)
        except ArgumentError as error:
            allowed = "; ".join(part for part in (error.allowed, error.hint) if part)
            raise FileFormatError(path, None, f"effect {number}: no effect {brief(name)!r}", allowed) from None
        yield ModelEntry(path, number, effect, entry)
