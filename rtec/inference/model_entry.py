"""One effect of a model's file: its lines, and what they are read as."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from rtec.checks import number_within
from rtec.dataset.observed import DRIVE, observable_of
from rtec.effects import Amplitude, Effect, Observable, Shape, Units
from rtec.errors import ArgumentError, FileFormatError, nearest
from rtec.inference.model import Term
from rtec.inference.shape_text import (
    field_keys,
    is_continuous,
    parameter_unit,
    read_shape,
    shown_field,
    shown_list,
)
from rtec.units import parse_in, written

_LARGEST = sys.float_info.max


def brief(value: object) -> str:
    """Return a value for a message of one line.

    Examples
    --------
    >>> brief("a" * 1000)[-5:], len(brief("a" * 1000))
    ('aa...', 120)
    """
    text = " ".join(str(value).split())
    return text if len(text) <= 120 else text[:117] + "..."


def term_lines(term: Term, units: Units) -> Iterator[str]:
    """Yield the lines of a term behind its name: shape, amplitudes, standard errors, as far as they are known.

    Parameters
    ----------
    term
        Errors that are no finite numbers are left out.
    units
        Units inside.

    Raises
    ------
    ArgumentError
        A parameter that is no finite number.

    Examples
    --------
    >>> from rtec.effects import effect_named
    >>> term = Term(effect=effect_named("backlash"), shape=Shape(), amplitudes=(0.0123,), errors=(0.0004,))
    >>> list(term_lines(term, Units("mm", "mm", "s")))
    ['backlash = "12.3 um"', 'backlash_error = "0.4 um"']
    """
    if term.shape is None:
        return
    errors = dict(term.shape_errors)
    for item in fields(term.shape):
        yield f"{item.name} = {shown_field(item, getattr(term.shape, item.name), units)}"
        error = errors.get(item.name, math.nan)
        if math.isfinite(error):
            yield f'{item.name}_error = "{written(error, parameter_unit(item, units))}"'
    if term.amplitudes is None:
        return
    named = term.effect.amplitudes(term.shape, units)
    single = _single(term.effect, named)
    yield from _amount_lines(single or "amplitudes", term.amplitudes, named, in_list=single is None)
    if term.errors is not None and all(math.isfinite(error) for error in term.errors):
        key = f"{single}_error" if single else "errors"
        yield from _amount_lines(key, term.errors, named, in_list=single is None)


def _amount_lines(key: str, values: Sequence[float], named: Sequence[Amplitude], *, in_list: bool) -> Iterator[str]:
    shown = [
        f'"{written(value, a.unit, inside=a.factor)}"' if a.unit else repr(float(value))
        for value, a in zip(values, named, strict=True)
    ]
    yield f"{key} = {shown_list(shown) if in_list else shown[0]}"


def _single(effect: Effect, named: Sequence[Amplitude]) -> str | None:
    """Return the key of the only amplitude; None where there are more, or where the key means something else."""
    if len(named) != 1 or named[0].name in ("name", "amplitudes", "errors", *field_keys(effect.shape_type)):
        return None
    return named[0].name


@dataclass(frozen=True, slots=True)
class ModelEntry:
    """One ``[[effect]]`` of a file.

    Parameters
    ----------
    path
        The file.
    number
        Of the effect in the file, from 1.
    effect
        That the entry names.
    table
        Its keys.
    """

    path: str | Path
    number: int
    effect: Effect
    table: Mapping[str, Any]

    @property
    def where(self) -> str:
        """How an error message names the entry."""
        return f"{self.path}: effect {self.number} ({self.effect.name})"

    def check_place(self, observe: str, terms: Sequence[Term]) -> None:
        """Refuse what explains another kind of quantity, and a second of what can be there once.

        Parameters
        ----------
        observe
            What the model explains.
        terms
            Of the file so far, this one with them.

        Raises
        ------
        FileFormatError
            Either of the two.
        """
        if self.effect.observable is not observable_of(observe):
            kinds = {Observable.DEVIATION: "a position deviation", Observable.DRIVE: " or ".join(DRIVE)}
            problem = f"{self.effect.name} belongs to {kinds[self.effect.observable]}, not to {observe!r}"
            allowed = f"effects of {kinds[observable_of(observe)]}; 'rtec effects' lists them"
            raise FileFormatError(self.path, None, f"effect {self.number}: {problem}", allowed)
        again = [term for term in terms if term.name == self.effect.name]
        if len(again) > self.effect.at_most:
            problem = f"effect {self.number}: {self.effect.name} stands there {len(again)} times"
            allowed = "once" if self.effect.at_most == 1 else f"{self.effect.at_most} times at most"
            raise FileFormatError(self.path, None, problem, allowed)

    def term(self, units: Units) -> Term:
        """Return the effect with the numbers that the file gives.

        Raises
        ------
        FileFormatError
            An unknown key, amplitudes without the shape that they belong to, or errors without amplitudes.
        ArgumentError
            A value that its key cannot have.
        """
        shape = self._shape(units)
        named = self.effect.amplitudes(self.effect.shape_type() if shape is None else shape, units)
        single = _single(self.effect, named)
        self._check_keys(single)
        amplitudes = self._numbers("amplitudes", single, named)
        errors = self._numbers("errors", f"{single}_error" if single else None, named)
        if shape is None and amplitudes is not None:
            missing = ", ".join(item.name for item in fields(self.effect.shape_type))
            raise FileFormatError(self.path, None, f"effect {self.number}: amplitudes without {missing}", "both")
        if amplitudes is not None and self.effect.not_negative and min(amplitudes) < 0.0:
            raise ArgumentError(f"{self.where}: {single or 'amplitudes'}", min(amplitudes), "from 0")
        if errors is not None and amplitudes is None:
            raise FileFormatError(self.path, None, f"effect {self.number}: errors without amplitudes", "both")
        if errors is not None and min(errors) < 0.0:
            raise ArgumentError(f"{self.where}: {f'{single}_error' if single else 'errors'}", min(errors), "from 0")
        return Term(
            effect=self.effect,
            shape=shape,
            amplitudes=amplitudes,
            errors=errors,
            shape_errors=self._shape_errors(units),
        )

    def _shape(self, units: Units) -> Shape | None:
        given = {key: self.table[key] for key in field_keys(self.effect.shape_type) if key in self.table}
        return read_shape(self.effect, given, units, name=lambda key: f"{self.where}: {key}")

    def _shape_errors(self, units: Units) -> tuple[tuple[str, float], ...]:
        found = []
        for item in fields(self.effect.shape_type):
            key = f"{item.name}_error"
            if key in self.table:
                unit = parameter_unit(item, units)
                found.append((item.name, parse_in(self.table[key], unit, name=f"{self.where}: {key}")))
        return tuple(found)

    def _check_keys(self, single: str | None) -> None:
        shape = field_keys(self.effect.shape_type)
        tuned = [f"{item.name}_error" for item in fields(self.effect.shape_type) if is_continuous(item)]
        own = [single, f"{single}_error"] if single else []
        known = ["name", *shape, *tuned, *own, "amplitudes", "errors"]
        for key in self.table:
            if key not in known:
                problem = f"effect {self.number} ({self.effect.name}): unknown key {brief(key)!r}"
                raise FileFormatError(self.path, None, problem, f"{', '.join(known)}; {nearest(key, known)}")

    def _numbers(self, key: str, single: str | None, named: Sequence[Amplitude]) -> tuple[float, ...] | None:
        """Return amplitudes or their errors; None where the file gives none."""
        if single is not None and single in self.table:
            if key in self.table:
                raise FileFormatError(self.path, None, f"effect {self.number}: {key} and {single}", "one of them")
            return (self._number(single, self.table[single], named[0]),)
        if key not in self.table:
            return None
        values = self.table[key]
        if not isinstance(values, list) or len(values) != len(named):
            what = f"{len(values)} of them" if isinstance(values, list) else brief(repr(values))
            wanted = ", ".join(f"{a.name} in {a.unit}" for a in named)
            raise ArgumentError(f"{self.where}: {key}", what, f"a list of {len(named)}: {brief(wanted)}")
        return tuple(self._number(f"{key} ({a.name})", value, a) for value, a in zip(values, named, strict=True))

    def _number(self, key: str, value: Any, what: Amplitude) -> float:
        name = f"{self.where}: {key}"
        if what.unit:
            return parse_in(value, what.unit, name=name, inside=what.factor)
        return number_within(name, value, -_LARGEST, _LARGEST)
