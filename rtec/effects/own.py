"""Effects that somebody wrote: a plain function of quantities, with bounds on its parameters.

Nobody has to know how a search works to have an effect of their own in it. A function says what a unit of the effect
adds; where its parameters may lie is its annotations. From those follow what it needs, the shapes of its scan, and
how it stands in a model file.
"""

from __future__ import annotations

import inspect
import itertools
import math
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, fields, make_dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, overload

import numpy as np

from rtec.effects.conditions import Conditions, Floats
from rtec.effects.own_signature import Within, checked_name, signature_of
from rtec.effects.protocol import Card, Effect, Observable, Over, Quantity, Shape, Tunable, parameter
from rtec.effects.quantities import MEANT, is_slow, meant, missing, quantity_of
from rtec.errors import ArgumentError, unknown

_STEP = 0.9
"""Cosine between neighbours of a scan at least: what lies between two is then missed by 3 % of its size at most."""
_FEWEST, _MOST, _MOST_OF_ONE = 3, 4000, 513
"""Shapes of a scan: of a parameter at least, of all together and of one parameter at most."""
_LOOKS = 33
"""Values of a parameter at which is looked where it shows, and least of a scan of one that shows in places only."""
_ROWS = 2000
"""Rows on which the scan's steps are chosen."""
_LEAST_CHANGE = 1e-9
"""Share of its size by which a contribution has to change over the readings to be seen."""
_ATTRIBUTES = ("amplitude", "amplitude_per", "observable", "data_checks", "card")
_OVER = {"direction": Over.REVERSAL, "since_reversal": Over.REVERSAL, "load": Over.TIME}


class FunctionEffect(Effect):
    """An effect that a function states; `effect` makes it."""

    observable: Observable | None = None

    def __init__(self, function: Callable[..., Any], over: str | None, name: str | None, **more: Any) -> None:
        """Read the function's signature; ``more`` are class attributes of `Effect` that are not as usual."""
        self.function = function
        self.name = checked_name(str(name or getattr(function, "__name__", "")))
        self.quantities, bounds = signature_of(function, self.name)
        self.bounds: Mapping[str, Within] = MappingProxyType(bounds)
        self.over = _over(over, self.quantities, self.name)
        self.other_columns = frozenset(name for name in self.quantities if name not in MEANT)
        self.in_time = any(is_slow(name) for name in self.quantities)
        made = make_dataclass(
            f"{self.name}_shape",
            [(key, float, _field(key, within)) for key, within in bounds.items()],
            bases=(Shape,),
            frozen=True,
            slots=True,
        )
        self.shape_type: type[Shape] = made if bounds else Shape
        self._grids: weakref.WeakKeyDictionary[Conditions, tuple[tuple[Floats, ...], tuple[Shape, ...]]]
        self._grids = weakref.WeakKeyDictionary()
        self.__doc__ = function.__doc__
        code = function.__code__
        needs = ", ".join(dict.fromkeys(meant(name) for name in self.quantities))
        self.card = _card(self, needs, f"{Path(code.co_filename).name}, line {code.co_firstlineno}.")
        for key, value in more.items():
            setattr(self, key, value)

    def __call__(self, *args: Any, **given: Any) -> Any:
        """Call the function itself."""
        return self.function(*args, **given)

    def __repr__(self) -> str:
        """Return its name and what it depends on."""
        return f"<effect {self.name}({', '.join([*self.quantities, *self.bounds])})>"

    def untestable(self, conditions: Conditions) -> str | None:
        """Return why the data cannot show it: a column is missing, or it is constant on these readings."""
        if self.data_checks:
            return super().untestable(conditions)
        for name in self.quantities:
            if quantity_of(conditions, name) is None:
                return missing(conditions, name)
        thin = self._thinned(conditions)
        columns = np.array([self._column(thin, shape) for shape in self._corners()])
        spread, size = np.ptp(columns, axis=1), np.abs(columns).max(axis=1)
        if not (spread > _LEAST_CHANGE * size).any() and not self._shapes_of(conditions):
            return "it is the same at every reading"
        return None

    def shapes(self, conditions: Conditions) -> Sequence[Shape]:
        """Return shapes of which neighbours look alike on these readings, without those that add nothing.

        Notes
        -----
        Steps are halved, one parameter at a time, until the columns of neighbours have a cosine of 0.9, the constant
        taken out, beside settings of the others.
        """
        return (self._shapes_of(conditions) if self.bounds else ()) or (self.shape_type(),)

    def tunables(self, conditions: Conditions, shape: Shape) -> Sequence[Tunable]:
        """Return every parameter, free by two steps of the scan within its bounds."""
        found = []
        for ladder, (name, within) in zip(self._ladders(conditions), self.bounds.items(), strict=True):
            value, (low, high, _) = float(getattr(shape, name)), within.inside
            k = int(np.abs(ladder - value).argmin())
            near = ladder[max(k - 2, 0)], ladder[min(k + 2, ladder.size - 1)]
            found.append(Tunable(name, max(low, min(near[0], value)), min(high, max(near[1], value))))
        return tuple(found)

    def columns(self, conditions: Conditions, shape: Shape) -> Floats:
        return self._column(conditions, shape)[:, None]

    def _column(self, conditions: Conditions, shape: Shape) -> Floats:
        """Return what the function says, shape (rows,); refuse what is no number for each reading."""
        values = []
        for name in self.quantities:
            column = quantity_of(conditions, name)
            values.append(_read_only(self._needed(column, meant(name))))
        given = {item.name: float(getattr(shape, item.name)) for item in fields(shape)}
        said = ", ".join(f"{key} = {value:.6g}" for key, value in given.items()) or "these readings"
        try:
            with np.errstate(all="ignore"):
                found = np.asarray(self.function(*values, **given), dtype=np.float64)
        except Exception as error:  # whatever somebody's function raises is told with its line
            raise self._wrong(f"{_line_of(error, self.function)}: {type(error).__name__}: {error}", said) from error
        if found.shape not in ((), (conditions.rows,)):
            raise self._wrong(
                f"it returns shape {found.shape}", said, f"a number for each of {conditions.rows} readings"
            )
        if not np.isfinite(found).all():
            raise self._wrong(f"it returns {found[~np.isfinite(found)].flat[0]}", said, "finite numbers")
        return np.broadcast_to(found, (conditions.rows,))

    def _wrong(
        self, problem: str, said: str, allowed: str = "a function that works for every reading"
    ) -> ArgumentError:
        return ArgumentError(f"effect {self.name}", "", allowed, problem=f"fails at {said}: {problem[:300]}")

    def _thinned(self, conditions: Conditions) -> Conditions:
        if conditions.rows <= _ROWS:
            return conditions
        return conditions.take(np.linspace(0, conditions.rows - 1, _ROWS).astype(np.int64))

    def _corners(self) -> Iterator[Shape]:
        """Yield shapes with each parameter at a quarter, the middle and three quarters of its bounds."""
        for share in (0.5, 0.25, 0.75):
            yield self.shape_type(**{name: within.at(share) for name, within in self.bounds.items()})

    def _ladders(self, conditions: Conditions) -> tuple[Floats, ...]:
        return self._grid(conditions)[0]

    def _shapes_of(self, conditions: Conditions) -> tuple[Shape, ...]:
        return self._grid(conditions)[1]

    def _grid(self, conditions: Conditions) -> tuple[tuple[Floats, ...], tuple[Shape, ...]]:
        if conditions not in self._grids:
            self._grids[conditions] = self._searched(self._thinned(conditions))
        return self._grids[conditions]

    def _searched(self, thin: Conditions) -> tuple[tuple[Floats, ...], tuple[Shape, ...]]:
        shown, counts = {}, {}
        for name in self.bounds:
            shown[name], counts[name] = self._steps(thin, name)
        while math.prod(counts.values()) > _MOST:
            most = max(counts, key=lambda name: counts[name])
            counts[most] = max(counts[most] * 3 // 4, 2)
        ladders = {
            name: np.array([self.bounds[name].at(s) for s in np.linspace(*shown[name], counts[name]).tolist()])
            for name in self.bounds
        }
        every = [
            self.shape_type(**dict(zip(ladders, values, strict=True)))
            for values in itertools.product(*ladders.values())
        ]
        seen = []
        for shape in every:
            column = self._column(thin, shape)
            if float(np.ptp(column)) > _LEAST_CHANGE * float(np.abs(column).max()):
                seen.append(shape)
        return tuple(ladders.values()), tuple(seen)

    def _steps(self, thin: Conditions, name: str) -> tuple[tuple[float, float], int]:
        """Return the part of a parameter's bounds that shows, as shares, and how many values a scan needs there.

        Both beside settings of the others. Bounds may be far wider than what was measured.
        """
        others = [key for key in self.bounds if key != name]
        settings = list(itertools.islice(itertools.product((0.5, 0.05, 0.95), repeat=len(others)), 9))
        rests = [{key: self.bounds[key].at(s) for key, s in zip(others, one, strict=True)} for one in settings]
        ends = self._shown(thin, name, rests)
        count = _FEWEST
        while count < _MOST_OF_ONE:
            if all(self._close(thin, name, np.linspace(*ends, count), rest) for rest in rests):
                break
            count = 2 * count - 1
        return ends, count

    def _shown(self, thin: Conditions, name: str, rests: Sequence[Mapping[str, float]]) -> tuple[float, float]:
        """Return between which shares of its bounds a parameter changes anything; all where that is nowhere."""
        count = _LOOKS
        while count <= _MOST_OF_ONE:
            shares = np.linspace(0.0, 1.0, count)
            seen = [np.ptp(self._table(thin, name, shares, rest), axis=1) > 0.0 for rest in rests]
            places = np.flatnonzero(np.any(seen, axis=0))
            if places.size:
                return float(shares[max(places[0] - 1, 0)]), float(shares[min(places[-1] + 1, count - 1)])
            count = 4 * count - 3
        return 0.0, 1.0

    def _table(self, thin: Conditions, name: str, shares: Floats, rest: Mapping[str, float]) -> Floats:
        """Return what it adds at shares of one parameter's bounds, shape (shares, rows)."""
        values = [self.bounds[name].at(share) for share in shares.tolist()]
        return np.array([self._column(thin, self.shape_type(**{name: value}, **rest)) for value in values])

    def _close(self, thin: Conditions, name: str, shares: Floats, rest: Mapping[str, float]) -> bool:
        table = self._table(thin, name, shares, rest)
        table = table - table.mean(axis=1, keepdims=True)
        length = np.sqrt((table**2).sum(axis=1))
        shows = length > 0.0
        if shares.size < _LOOKS and (shows[1:] != shows[:-1]).any():  # what shows between two must not be passed over
            return False
        seen = shows[1:] & shows[:-1]
        cosine = (table[1:] * table[:-1]).sum(axis=1)[seen] / (length[1:] * length[:-1])[seen]
        return bool((np.abs(cosine) >= _STEP).all())


@overload
def effect(function: Callable[..., Any], /, **more: Any) -> FunctionEffect: ...
@overload
def effect(
    *, over: str | None = None, name: str | None = None, not_negative: bool = False, **more: Any
) -> Callable[[Callable[..., Any]], FunctionEffect]: ...
def effect(
    function: Callable[..., Any] | None = None,
    /,
    *,
    over: str | None = None,
    name: str | None = None,
    not_negative: bool = False,
    **more: Any,
) -> Any:
    """Make an effect of a function.

    Parameters
    ----------
    function
        Its positional parameters are quantities, as arrays of shape (rows,): ``position`` (mm or deg), ``direction``
        (+1, -1), ``velocity`` (mm/s), ``acceleration``, ``time`` (s), ``temperature`` or ``temperature_NAME`` (degC),
        ``since_reversal`` (mm), ``run``, ``load``, ``pressure`` (hPa), ``humidity`` (%), or the name of a column. Its
        keyword-only parameters are annotated with `Within`. It returns what a unit of the effect adds, shape (rows,).
    over
        What it is drawn over, such as ``position``; the first quantity without.
    name
        That of the function without.
    not_negative
        Whether its amplitude cannot be below zero, as that of a friction.
    more
        Further attributes of `Effect`, as effects of the library state them: ``amplitude`` and ``amplitude_per`` for
        the name and the unit of its amplitude, ``observable``, ``data_checks``, ``card``.

    Raises
    ------
    ArgumentError
        A parameter without bounds, no quantity at all, or a name that no model file could have.

    Examples
    --------
    >>> @effect(over="position")
    ... def dent(position, *, place: Within(0, 500, "mm"), width: Within(2, 40, "mm")):
    ...     "A dent in the way: a bump of some width at some place."
    ...     return np.exp(-(((position - place) / width) ** 2))
    >>> dent
    <effect dent(position, place, width)>
    >>> dent.card.title
    'A dent in the way: a bump of some width at some place'
    """
    if function is None:
        return lambda given: effect(given, over=over, name=name, not_negative=not_negative, **more)
    if not callable(function):
        raise ArgumentError("effect", repr(function)[:60], "a function; @rtec.effect stands above one")
    for key in more:
        if key not in _ATTRIBUTES:
            raise unknown(
                "effect", key, ("over", "name", "not_negative", *_ATTRIBUTES), noun="attribute of an effect"
            )
    return FunctionEffect(function, over, name, not_negative=not_negative, **more)


def as_effects(given: Sequence[object]) -> tuple[Effect, ...]:
    """Return effects that somebody wrote: made by `effect`, or objects or classes derived from `Effect`.

    Raises
    ------
    ArgumentError
        Something that is no effect.

    Examples
    --------
    >>> as_effects([3])
    Traceback (most recent call last):
    ...
    rtec.errors.ArgumentError: effects: 3 is not valid; use effects made by @rtec.effect or derived from rtec.Effect
    """
    found = []
    for one in given:
        made = one() if isinstance(one, type) and issubclass(one, Effect) else one
        if not isinstance(made, Effect):
            raise ArgumentError("effects", repr(one)[:60], "effects made by @rtec.effect or derived from rtec.Effect")
        checked_name(getattr(made, "name", ""))
        if not hasattr(made, "card"):
            made.card = _card(made, "what its author says", f"{type(made).__module__}.")
        found.append(made)
    return tuple(found)


def _card(effect: Effect, needs: str, source: str) -> Card:
    """Return what the docstring of an effect says as a card."""
    title, _, more = inspect.cleandoc(effect.__doc__ or effect.name).partition("\n")
    return Card(
        title=title.strip().rstrip("."),
        formula=f"`{effect.name}`",
        needs=needs,
        plot=f"look at what is left over {effect.over.value}.",
        cause=" ".join(more.split()) or "as its author says.",
        consequence="as its author says.",
        action="as its author says.",
        invariant_to="what it is no function of.",
        source=source,
    )


def _over(said: str | None, quantities: Sequence[str], name: str) -> Over:
    known = {over.value: over for over in Over} | _OVER
    word = quantities[0] if said is None else said
    word = "temperature" if word.startswith("temperature") else word
    if word in known:
        return known[word]
    if said is None or said in quantities:
        return Over.TIME
    raise ArgumentError(f"effect {name}", repr(said)[:60], f"over= one of {', '.join(known)}, or of its quantities")


def _field(name: str, within: Within) -> Any:
    low, high, unit = within.inside
    default = high if high != 0.0 else low  # 0 would mean: not given
    meaning = name.replace("_", " ")
    return field(default=default, metadata=parameter(Quantity.NUMBER, meaning, unit=unit, low=low, high=high))


def _read_only(values: Floats) -> Floats:
    view = values.view()
    view.flags.writeable = False
    return view


def _line_of(error: Exception, function: Callable[..., Any]) -> str:
    """Return the line of the user's file at which their function failed."""
    file, line = function.__code__.co_filename, function.__code__.co_firstlineno
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    return f"{Path(file).name}, line {line}"
