"""The parameters of an effect's shape (period, time constant, nodes, ...) as people write them."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import Any

from rtec.checks import number_within, whole_within
from rtec.effects import Effect, Quantity, Shape, Units
from rtec.effects.protocol import Parameter
from rtec.errors import ArgumentError
from rtec.units import parse_in, written

MOST_NODES = 10_000
_LARGEST_COUNT = 1000
_LARGEST_RUN = 2**31
_LARGEST = 1e300
_SMALLEST = 1e-12
"""Of a period, a distance and the like: beyond it and its inverse a column of it is no more than rounding."""
_CONTINUOUS = (Quantity.POSITION, Quantity.SPEED, Quantity.CLOCK, Quantity.NUMBER)


def field_keys(shape_type: type[Shape]) -> tuple[str, ...]:
    """Return the names of a shape's parameters.

    Examples
    --------
    >>> from rtec.effects import effect_named
    >>> field_keys(effect_named("cyclic").shape_type)
    ('period', 'harmonics', 'by_direction', 'step_at')
    """
    return tuple(item.name for item in fields(shape_type))


def is_continuous(item: Parameter) -> bool:
    """Return whether a parameter is a quantity with a unit, which a refit can move."""
    return item.metadata["quantity"] in _CONTINUOUS and not _is_list(item)


def written_fields(shape: Shape) -> tuple[Parameter, ...]:
    """Return the parameters of a shape that a file needs: without those that are 0 where they are not given.

    Examples
    --------
    >>> from rtec.effects import CyclicShape
    >>> [item.name for item in written_fields(CyclicShape(6.35))]
    ['period', 'harmonics', 'by_direction']
    """
    return tuple(x for x in fields(shape) if not (_is_optional(x) and getattr(shape, x.name) == x.default))


def _is_optional(item: Parameter) -> bool:
    """Return whether a parameter means nothing where it is not given."""
    return bool(item.metadata.get("optional")) or (is_continuous(item) and item.default == 0.0)


def _is_list(item: Parameter) -> bool:
    return isinstance(item.default, tuple)


def read_shape(
    effect: Effect, given: Mapping[str, object], units: Units, *, name: Callable[[str], str]
) -> Shape | None:
    """Return the shape of an effect that values as they stand in a file make, in units inside.

    Parameters
    ----------
    given
        Values by the name of the parameter: quantities with their units as text, lists of them for nodes, whole
        numbers, true or false. None comes back where there are none although a period, a time constant or the like
        is needed: a scan has to find it.
    name
        How an error message calls a parameter.

    Raises
    ------
    ArgumentError
        A value that its parameter cannot have, or some parameters without one that is needed beside them.

    Examples
    --------
    >>> from rtec.effects import effect_named
    >>> cyclic, units = effect_named("cyclic"), Units("mm", "mm", "s")
    >>> read_shape(cyclic, {"period": "0.25 inch", "harmonics": 2}, units, name=str).period
    6.35
    >>> read_shape(cyclic, {}, units, name=str) is None
    True
    """
    items = fields(effect.shape_type)
    # what has no sensible value of its own, not even 0, is given or found by a scan
    of_data = [item for item in items if item.metadata["quantity"] in (*_CONTINUOUS, Quantity.TEXT)]
    wanted = [item.name for item in of_data if not _is_optional(item)]
    if wanted and not given:
        return None
    values = {item.name: _value(item, given[item.name], units, name) for item in items if item.name in given}
    for key in wanted:
        if key not in given:
            allowed = f"a value beside {', '.join(given)}, or none of them: then a scan finds all"
            raise ArgumentError(name(key), None, allowed)
    try:
        return effect.shape_type(**values)
    except ArgumentError as error:  # a shape knows no units: its range ends with a number in that of the parameter
        unit = {item.name: units.of(item) for item in items}[error.name]
        found = repr(given.get(error.name, error.value))[:60]
        allowed = f"{error.allowed} {unit}".rstrip()
        raise ArgumentError(name(error.name), found, allowed, error.hint, problem=error.problem) from None


def _value(item: Parameter, value: object, units: Units, name: Callable[[str], str]) -> object:
    quantity, key = item.metadata["quantity"], name(item.name)
    if quantity is Quantity.COUNT:
        return _numbers(key, value) if _is_list(item) else whole_within(key, value, 1, _LARGEST_COUNT)
    if quantity is Quantity.CHOICE:
        if not isinstance(value, bool):
            raise ArgumentError(key, repr(value)[:60], "true or false")
        return value
    if quantity is Quantity.TEXT:
        if not isinstance(value, str) or not 0 < len(value) <= 200 or not value.isprintable():
            raise ArgumentError(key, repr(value)[:60], "a printable text of 1 to 200 characters in quotes")
        return value
    unit = units.of(item)
    if quantity is Quantity.NUMBER:
        return _number_of(item, key, value, unit)
    if _is_list(item):
        return _places(key, value, unit)
    number = parse_in(value, unit, name=key)  # type: ignore[arg-type]  # refuses what is no text
    if not (_SMALLEST <= number <= 1.0 / _SMALLEST or number == item.default == 0.0):
        nothing = "0, or " if item.default == 0.0 else ""
        raise ArgumentError(key, repr(value)[:60], f"{nothing}{_SMALLEST:g} to {1.0 / _SMALLEST:g} {unit}")
    return number


def _number_of(item: Parameter, key: str, value: object, unit: str) -> object:
    """Return a parameter with bounds of its own, or a list of numbers that ascend."""
    if _is_list(item):
        return _ascending(key, _listed(key, value, "numbers that ascend, such as [0.0, 10.0]"))
    if unit:
        value = parse_in(value, unit, name=key)  # type: ignore[arg-type]  # refuses what is no text
    return number_within(key, value, item.metadata["low"], item.metadata["high"], unit=unit)


def _listed(key: str, value: object, what: str) -> list[Any]:
    if not isinstance(value, list) or not 2 <= len(value) <= MOST_NODES:
        found = f"{len(value)} of them" if isinstance(value, list) else repr(value)[:60]
        raise ArgumentError(key, found, f"a list of 2 to {MOST_NODES} {what}")
    return value


def _numbers(key: str, value: object) -> tuple[int, ...]:
    several = _listed(key, value, "whole numbers, such as [1, 2, 3]")
    found = tuple(whole_within(key, one, -_LARGEST_RUN, _LARGEST_RUN) for one in several)
    if len(set(found)) < len(found):
        raise ArgumentError(key, repr(value)[:60], "each number once")
    return found


def _places(key: str, value: object, unit: str) -> tuple[float, ...]:
    several = _listed(key, value, f"positions, such as ['0 {unit}', '10 {unit}']")
    places = tuple(parse_in(text, unit, name=key) for text in several)
    return _ascending(key, places, unit)


def _ascending(key: str, several: Sequence[object], unit: str = "") -> tuple[float, ...]:
    numbers = tuple(number_within(key, one, -_LARGEST, _LARGEST) for one in several)
    for before, after in itertools.pairwise(numbers):
        if not before < after:
            raise ArgumentError(
                key, f"{after:g} {unit} behind {before:g} {unit}".replace(" ", " "), "places that ascend"
            )
    return numbers


def shown_field(item: Parameter, value: object, units: Units) -> str:
    """Return a parameter as it stands in a TOML file.

    Raises
    ------
    ArgumentError
        A number that is not finite, or a text with letters that cannot be printed.

    Examples
    --------
    >>> from rtec.effects import effect_named
    >>> period, harmonics, by_direction, _ = fields(effect_named("cyclic").shape_type)
    >>> units = Units("mm", "mm", "s")
    >>> shown_field(period, 6.35, units), shown_field(harmonics, 2, units), shown_field(by_direction, True, units)
    ('"6.35 mm"', '2', 'true')
    """
    unit = units.of(item)
    if isinstance(value, tuple):
        return shown_list([f'"{written(place, unit)}"' if unit else str(place) for place in value])
    if unit:
        return f'"{written(float(value), unit)}"'  # type: ignore[arg-type]  # a number, as it has a unit
    if isinstance(value, str):
        return shown_text(value)
    return str(value).lower()


def shown_list(values: list[str]) -> str:
    """Return values of TOML as a list, one to a line where they are many.

    Examples
    --------
    >>> shown_list(['"0 mm"', '"10 mm"'])
    '["0 mm", "10 mm"]'
    """
    joined = ", ".join(values)
    return f"[{joined}]" if len(joined) <= 100 else "[\n" + "".join(f"    {value},\n" for value in values) + "]"


def shown_text(text: str) -> str:
    r"""Return a text in quotes, as TOML has it.

    Raises
    ------
    ArgumentError
        Letters that cannot be printed.

    Examples
    --------
    >>> shown_text('say "x"')
    '"say \\"x\\""'
    """
    if not text.isprintable():
        raise ArgumentError("text", repr(text)[:60], "printable letters")
    return json.dumps(text, ensure_ascii=False)
