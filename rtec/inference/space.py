"""A data set in the space in which a model is judged: columns, whitened by a colour of noise, and their products."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import LIBRARY, Effect, Floats, Observable, Shape
from rtec.inference.colour import COLOURS, Colour, Whitening, gaps_of
from rtec.inference.evidence import Sums
from rtec.inference.probes import Probe, probes_of

Choice: TypeAlias = tuple[Effect, Shape]
"""An effect with its shape."""

_KEPT_BYTES = 400_000_000
_AT_ONCE_BYTES = 100_000_000
LEAST_WHITE_IN_MOTION = 0.3
MOST_ZEROS = 40
"""Runs, at most, that may each have a zero of their own: with more, such a zero is one more kind of slow noise."""


@dataclass(frozen=True, eq=False)
class Part:
    """Columns that share one prior scale: an effect of a model, or what goes with the noise.

    ``unit`` brings the columns to a mean square of 1 over the readings, so that scales have its unit.
    """

    key: object
    raw: Floats
    """Shape (columns, rows), in the observed unit inside."""
    unit: float
    optional: bool = False


@dataclass(eq=False)
class Space:
    """One data set, looked at under colours of noise.

    Parameters
    ----------
    dataset
        The readings.
    """

    dataset: Dataset
    _parts: dict[object, Part] = field(default_factory=dict)
    _white: dict[tuple[Colour, object], Floats] = field(default_factory=dict)
    _products: dict[tuple[Colour, object, object], Floats] = field(default_factory=dict)
    _scans: dict[tuple[Colour, str], NDArray[np.float32]] = field(default_factory=dict)
    _whitenings: dict[Colour, Whitening] = field(default_factory=dict)
    _shapes: dict[str, tuple[Sequence[Shape], NDArray[np.bool_]]] = field(default_factory=dict)
    _bytes: int = 0

    @cached_property
    def gap(self) -> Floats:
        """Readings from each to the one before, infinite where a chain begins; shape (rows,)."""
        return gaps_of(self.dataset)

    @cached_property
    def colours(self) -> frozenset[Colour]:
        """What the noise may be.

        The readings of a log know their neighbours closely, whatever the model lacks. A noise without a white part
        would take that for itself, and judge an effect by its smallest steps alone, where delays of the sensors and
        the form of each start and stop decide.
        """
        least = LEAST_WHITE_IN_MOTION if self.dataset.conditions.moving else 0.0
        return frozenset(colour for colour in COLOURS if colour.white >= least)

    def weights(self, colour: Colour) -> Colour:
        """Return the colour by which amplitudes are weighed: that of the noise, or none in a log.

        What a log leaves is mostly what its model lacks. Weighing it as noise would fit the smallest steps best, and
        foretell another log worse than plain least squares do.
        """
        return Colour() if self.dataset.conditions.moving else colour

    @property
    def has_datum(self) -> bool:
        """Whether the constant of the readings only says where the instrument was set to zero."""
        return self.dataset.observable is Observable.DEVIATION

    @property
    def readings(self) -> int:
        """Readings, less the constant where it is none of the effects."""
        return self.dataset.rows - int(self.has_datum)

    @cached_property
    def reasons(self) -> dict[str, str | None]:
        """Why an effect cannot be tested, by name; None where it can."""
        kind = self.dataset.observable
        return {e.name: e.untestable(self.dataset.conditions) for e in LIBRARY if e.observable is kind}

    @cached_property
    def library(self) -> tuple[Effect, ...]:
        """The effects that the data can show."""
        return tuple(
            effect
            for effect in LIBRARY
            if self.reasons.get(effect.name, "") is None
            and not effect.never_ranked
            and not (effect.is_datum and self.has_datum)
        ) + probes_of(self.dataset)

    @cached_property
    def at_rows(self) -> Dataset:
        """The same readings with conditions at the rows: a decimated log's waves, but for its low pass."""
        if self.dataset.resample is None:
            return self.dataset
        return replace(self.dataset, conditions=self.dataset.coordinates, resample=None)

    @cached_property
    def nuisances(self) -> tuple[Part, ...]:
        """What goes with the noise of every model: a zero of its own for each run, where that is likely."""
        c = self.dataset.coordinates
        numbers, place = np.unique(c.run, return_inverse=True)
        if self.dataset.observable is not Observable.DEVIATION or not 2 <= numbers.size <= MOST_ZEROS:
            return ()
        raw = (place == np.arange(numbers.size)[:, None]).astype(np.float64)
        return (self.part("zero of each run", raw, optional=True),)

    def whitening(self, colour: Colour) -> Whitening:
        """Return the filter for a colour."""
        if colour not in self._whitenings:
            self._whitenings[colour] = Whitening(self.gap, colour)
        return self._whitenings[colour]

    def part(self, key: object, raw: Floats, *, optional: bool = False) -> Part:
        """Return columns of shape (columns, rows) as a part of models."""
        shown = raw - raw.mean(axis=1, keepdims=True) if self.has_datum else raw
        size = float(np.sqrt((shown**2).sum() / raw.shape[1]))
        return Part(key=key, raw=raw, unit=1.0 / size if size > 0.0 else 1.0, optional=optional)

    def part_of(self, choice: Choice) -> Part:
        """Return the columns of an effect."""
        effect, shape = choice
        key = effect.name, shape
        if key not in self._parts:
            self._parts[key] = self.part(key, self.raw(choice))
        return self._parts[key]

    def raw(self, choice: Choice) -> Floats:
        """Return the columns of an effect at the rows, shape (columns, rows), in the observed unit inside."""
        effect, shape = choice
        columns = effect.at(self.dataset) if isinstance(effect, Probe) else self.dataset.columns(effect, shape)
        return np.ascontiguousarray(columns.T)

    def parts_of(self, choices: Sequence[Choice]) -> list[Part]:
        """Return the parts of a model: its effects, then what goes with the noise."""
        return [*map(self.part_of, choices), *self.nuisances]

    @cached_property
    def _constants(self) -> dict[Colour, Floats]:
        return {}

    def _constant(self, colour: Colour) -> Floats:
        """Return the whitened constant, of length 1."""
        if colour not in self._constants:
            white = self.whitening(colour).of(np.ones((1, self.dataset.rows)))[0]
            self._constants[colour] = white / np.sqrt(white @ white)
        return self._constants[colour]

    def project(self, columns: Floats, colour: Colour) -> Floats:
        """Return columns, shape (columns, rows), whitened, without the constant where it is no effect."""
        white = self.whitening(colour).of(columns)
        if not self.has_datum:
            return white
        constant = self._constant(colour)
        return white - (white @ constant)[:, None] * constant

    def observed(self, colour: Colour) -> Floats:
        """Return the readings in whitened space, shape (rows,)."""
        key = colour, "observed"
        if key not in self._white:
            self._white[key] = self.project(self.dataset.observed[None, :], colour)
        found: Floats = self._white[key][0]
        return found

    def white(self, part: Part, colour: Colour) -> Floats:
        """Return a part's columns in whitened space and units of their own, shape (columns, rows)."""
        key = colour, part.key
        if key not in self._white:
            if self._bytes > _KEPT_BYTES:
                self._white.clear()
                self._bytes = 0
            self._white[key] = self.project(part.raw * part.unit, colour)
            self._bytes += self._white[key].nbytes
        return self._white[key]

    def log_determinant(self, colour: Colour) -> float:
        """Return the logarithm of the determinant of the noise's covariance, with the constant's share."""
        found = self.whitening(colour).log_determinant
        if self.has_datum:
            white = self.whitening(colour).of(np.ones((1, self.dataset.rows)))[0]
            found += float(np.log(white @ white))
        return found

    def _product(self, one: Part, other: Part, colour: Colour) -> Floats:
        key = colour, one.key, other.key
        if key not in self._products:
            mirrored = colour, other.key, one.key
            if mirrored in self._products:
                return self._products[mirrored].T
            self._products[key] = self.white(one, colour) @ self.white(other, colour).T
        return self._products[key]

    def _along(self, part: Part, colour: Colour) -> Floats:
        key = colour, part.key, "observed"
        if key not in self._products:
            self._products[key] = self.white(part, colour) @ self.observed(colour)
        return self._products[key]

    def sums(self, parts: Sequence[Part], colour: Colour) -> Sums:
        """Return the products that a model with these parts needs."""
        observed = self.observed(colour)
        key = colour, "observed", "observed"
        if key not in self._products:
            self._products[key] = np.array([[observed @ observed]])
        total = float(self._products[key][0, 0])
        if not parts:
            return Sums(np.empty((0, 0)), np.empty(0), total, self.readings)
        ends = np.cumsum([0, *(part.raw.shape[0] for part in parts)]).tolist()
        gram = np.empty((ends[-1], ends[-1]))
        for i, one in enumerate(parts):
            for j in range(i + 1):
                product = self._product(one, parts[j], colour)
                gram[ends[i] : ends[i + 1], ends[j] : ends[j + 1]] = product
                if j < i:
                    gram[ends[j] : ends[j + 1], ends[i] : ends[i + 1]] = product.T
        along = np.concatenate([self._along(part, colour) for part in parts])
        return Sums(gram, along, total, self.readings)

    def constant(self, colour: Colour) -> Floats:
        """Return the whitened constant as a basis of shape (1, rows), or of no rows where it is an effect."""
        return self._constant(colour)[None, :] if self.has_datum else np.empty((0, self.dataset.rows))

    def shapes(self, effect: Effect) -> tuple[Sequence[Shape], NDArray[np.bool_]]:
        """Return the scan grid of an effect, and which of its shapes the data could bear out."""
        if effect.name not in self._shapes:
            c = self.dataset.conditions
            shapes = effect.shapes(c)
            sound = np.array([effect.doubtful(c, shape) is None for shape in shapes], dtype=np.bool_)
            self._shapes[effect.name] = shapes, sound
        return self._shapes[effect.name]

    def scan(self, effect: Effect, shapes: Sequence[Shape], colour: Colour) -> Iterator[NDArray[np.float32]]:
        """Yield stretches of a scan in whitened space, the constant not taken out; shape (shapes, amplitudes, rows).

        Single precision is enough to find what is worth a closer look, and takes half the time.
        """
        key = colour, effect.name
        if key in self._scans:
            yield self._scans[key]
            return
        # a wave slower than the decimation's limit passes it unchanged: taken at the rows it costs a tenth
        data = self.at_rows if effect.is_wave else self.dataset
        at_once = max(1, _AT_ONCE_BYTES // (8 * data.rows))
        keep = len(shapes) <= at_once
        for begin in range(0, len(shapes), at_once):
            raw = data.scan(effect, shapes[begin : begin + at_once])
            m, q, n = raw.shape
            white = self.whitening(colour).of(raw.reshape(m * q, n)).reshape(m, q, n).astype(np.float32)
            if keep:
                self._scans[key] = white
            yield white


def blocks_of(parts: Sequence[Part]) -> NDArray[np.int64]:
    """Return the number of the part that each column of a model belongs to, shape (columns,)."""
    return np.repeat(np.arange(len(parts)), [part.raw.shape[0] for part in parts])


def names_of(choices: Iterable[Choice]) -> tuple[str, ...]:
    """Return the names of a model's effects, in order."""
    return tuple(effect.name for effect, _ in choices)
