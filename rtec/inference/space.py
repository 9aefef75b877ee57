"""A data set in the space in which a model is judged: columns, whitened by a colour of noise, and their products."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rtec.dataset.dataset import Dataset
from rtec.effects import Effect, Floats, Observable, Shape
from rtec.inference.colour import COLOURS, Colour, Whitening, gaps_of
from rtec.inference.evidence import Sums
from rtec.inference.forms import forms_of
from rtec.inference.probes import Probe, probes_of

Choice: TypeAlias = tuple[Effect, Shape]
"""An effect with its shape."""

_KEPT_BYTES = 100_000_000
_AT_ONCE_BYTES = 100_000_000
_IN_CACHE_BYTES = 500_000
_ROUNDING = 1e-10
"""Share of the readings' square that may be lost: a model that explains everything leaves that."""
TURNED_FROM = 24
"""Columns of a part from which on its principal ones stand for them: to average over these takes no elimination."""
LEAST_WHITE_IN_MOTION = 0.3


@dataclass(frozen=True, eq=False)
class Part:
    """Columns that share one prior scale: an effect of a model.

    ``unit`` brings the columns to a mean square of 1 over the readings, so that scales have its unit. What is known
    of a part is kept under the part itself.
    """

    raw: Floats
    """Shape (columns, rows), in the observed unit inside."""
    unit: float


@dataclass(eq=False)
class Scan:
    """A stretch of the shapes of an effect in whitened space, and its products with what models are made of.

    Single precision is enough to find what is worth a closer look, and takes half the time. The products are kept:
    most of a model that is looked at has been in one before.
    """

    columns: NDArray[np.float32]
    """The constant not taken out; shape (shapes, amplitudes, rows)."""
    _products: dict[object, Floats] = field(default_factory=dict)

    @cached_property
    def gram(self) -> Floats:
        """Products of the columns of each shape with each other, shape (shapes, amplitudes, amplitudes)."""
        found: Floats = np.matmul(self.columns, self.columns.transpose(0, 2, 1)).astype(np.float64)
        return found

    def onto(self, rows: Floats) -> Floats:
        """Return the products with rows of shape (others, rows): shape (shapes, amplitudes, others)."""
        m, q, n = self.columns.shape
        return (self.columns.reshape(m * q, n) @ rows.T.astype(np.float32)).astype(np.float64).reshape(m, q, -1)

    def onto_part(self, key: object, rows: Floats) -> Floats:
        """Return the same for a part of models, known by a key."""
        if key not in self._products:
            self._products[key] = self.onto(rows)
        return self._products[key]


@dataclass(eq=False)
class View:
    """What is known of a data set under one colour of noise."""

    space: Space
    whitening: Whitening
    white: dict[Part, Floats] = field(default_factory=dict)
    products: dict[Part, dict[Part, Floats]] = field(default_factory=lambda: defaultdict(dict))
    """Products of the columns of one part with those of another."""
    principal: dict[Part, tuple[Part, Floats]] = field(default_factory=dict)
    scans: dict[str, Scan] = field(default_factory=dict)

    @cached_property
    def _ones(self) -> Floats:
        return self.whitening.of(np.ones((1, self.space.dataset.rows)))

    @cached_property
    def constant(self) -> Floats:
        """The whitened constant, of length 1, shape (1, rows); of no rows where it is an effect."""
        length = float(np.sqrt((self._ones**2).sum()))
        return self._ones / length if self.space.has_datum else self._ones[:0]

    @cached_property
    def log_determinant(self) -> float:
        """Of the noise's covariance, with the constant's share."""
        found = self.whitening.log_determinant
        return found + float(np.log((self._ones**2).sum())) if self.space.has_datum else found

    def project(self, columns: Floats, unit: float = 1.0) -> Floats:
        """Return columns, shape (columns, rows), times ``unit``, whitened, without the constant unless an effect."""
        return self.whitening.of(columns, unit, self.constant)


@dataclass(eq=False)
class Space:
    """One data set, looked at under colours of noise; that of a log may lack a white part with ``any_noise``."""

    dataset: Dataset
    any_noise: bool = False
    _parts: dict[object, Part] = field(default_factory=dict)
    _views: dict[Colour, View] = field(default_factory=dict)
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
        least = LEAST_WHITE_IN_MOTION if self.dataset.conditions.moving and not self.any_noise else 0.0
        return frozenset(colour for colour in COLOURS if colour.white >= least)

    def weights(self, colour: Colour) -> Colour:
        """Return the colour by which amplitudes are weighed: that of the noise, or none in a log and beside blocks.

        What a log leaves is mostly what its model lacks. Weighing it as noise would fit the smallest steps best, and
        foretell another log, or block, worse than plain least squares do.
        """
        return Colour() if self.dataset.conditions.moving or self.dataset.in_blocks else colour

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
        return {e.name: e.untestable(self.dataset.conditions) for e in self.dataset.library if e.explains(kind)}

    @cached_property
    def library(self) -> tuple[Effect, ...]:
        """The effects that the data can show."""
        return tuple(
            effect
            for effect in self.dataset.library
            if self.reasons.get(effect.name, "") is None and forms_of(effect).ranked(self.dataset.conditions)
        ) + probes_of(self.dataset)

    @cached_property
    def suspected(self) -> tuple[Effect, ...]:
        """The effects that the data cannot show, and that may be what they show of others."""
        c = self.dataset.conditions
        return tuple(
            e for e in self.dataset.library if self.reasons.get(e.name) is not None and forms_of(e).suspects(c)
        )

    @cached_property
    def _at_rows(self) -> Dataset:
        return replace(self.dataset, conditions=self.dataset.coordinates, resample=None)

    def scanned(self, effect: Effect) -> Dataset:
        """Return the data in which shapes of an effect are looked for.

        A wave slower than the decimation's limit passes it unchanged: taken at the rows it costs a tenth.
        """
        return self._at_rows if effect.is_wave else self.dataset

    def view(self, colour: Colour) -> View:
        """Return what is known of the readings under a colour."""
        if colour not in self._views:
            self._views[colour] = View(self, Whitening(self.gap, colour))
        return self._views[colour]

    def part(self, raw: Floats) -> Part:
        """Return columns of shape (columns, rows) as a part of models."""
        shown = raw - raw.mean(axis=1, keepdims=True) if self.has_datum else raw
        size = float(np.sqrt((shown**2).sum() / raw.shape[1]))
        return Part(raw=raw, unit=1.0 / size if size > 0.0 else 1.0)

    def part_of(self, choice: Choice) -> Part:
        """Return the columns of an effect."""
        effect, shape = choice
        key = effect.name, shape
        if key not in self._parts:
            self._parts[key] = self.part(self.raw(choice))
        return self._parts[key]

    def raw(self, choice: Choice) -> Floats:
        """Return the columns of an effect at the rows, shape (columns, rows), in the observed unit inside."""
        effect, shape = choice
        columns = effect.at(self.dataset) if isinstance(effect, Probe) else self.dataset.columns(effect, shape)
        return np.ascontiguousarray(columns.T)

    def parts_of(self, choices: Sequence[Choice]) -> list[Part]:
        """Return the parts of a model: its effects."""
        return [self.part_of(choice) for choice in choices]

    @cached_property
    def observed_part(self) -> Part:
        """The readings, as if they were a part of models."""
        return Part(raw=self.dataset.observed[None, :], unit=1.0)

    def observed(self, colour: Colour) -> Floats:
        """Return the readings in whitened space, shape (rows,)."""
        found: Floats = self.white(self.observed_part, colour)[0]
        return found

    def white(self, part: Part, colour: Colour) -> Floats:
        """Return a part's columns in whitened space and units of their own, shape (columns, rows)."""
        return self._white(self.view(colour), part)

    def _white(self, view: View, part: Part) -> Floats:
        found = view.white.get(part)
        if found is None:
            if self._bytes > _KEPT_BYTES:
                for other in self._views.values():
                    other.white.clear()
                self._bytes = 0
            found = view.white[part] = view.project(part.raw, part.unit)
            self._bytes += found.nbytes
        return found

    def sums(self, parts: Sequence[Part], colour: Colour) -> Sums:
        """Return the products that a model with these parts needs; of a large one those of its principal columns."""
        view, every = self.view(colour), [*parts, self.observed_part]
        sizes = [part.raw.shape[0] for part in every]
        most, turned, turn = max(sizes), slice(0), None
        ends = list(itertools.accumulate(sizes, initial=0))
        if most >= TURNED_FROM:
            k = sizes.index(most)
            turned = slice(ends[k], ends[k + 1])
            every[k], turn = self._principal(view, every[k])
        products = np.empty((ends[-1], ends[-1]))
        for i, one in enumerate(every):
            known, rows = view.products[one], slice(ends[i], ends[i + 1])
            for j in range(i + 1):
                other, columns = every[j], slice(ends[j], ends[j + 1])
                block = known.get(other)
                if block is None:
                    block = known[other] = self._white(view, one) @ self._white(view, other).T
                    view.products[other][one] = block.T
                products[rows, columns] = block
                if j < i:
                    products[columns, rows] = block.T
        products[-1, -1] *= 1.0 + _ROUNDING
        return Sums(products, self.readings, turned, turn)

    def _principal(self, view: View, part: Part) -> tuple[Part, Floats]:
        """Return the principal columns of a part, and those of the part in terms of them."""
        if part not in view.principal:
            white = self._white(view, part)
            turn = np.linalg.eigh(white @ white.T)[1]
            view.principal[part] = Part(raw=turn.T @ part.raw, unit=part.unit), turn
        return view.principal[part]

    def shapes(self, effect: Effect) -> tuple[Sequence[Shape], NDArray[np.bool_]]:
        """Return the scan grid of an effect, and which of its shapes the data could bear out."""
        if effect.name not in self._shapes:
            c = self.dataset.conditions
            shapes, doubtful = effect.shapes(c), forms_of(effect).doubtful
            sound = np.array([doubtful(c, shape) is None for shape in shapes], dtype=np.bool_)
            self._shapes[effect.name] = shapes, sound
        return self._shapes[effect.name]

    def scan(self, effect: Effect, shapes: Sequence[Shape], colour: Colour) -> Iterator[Scan]:
        """Yield a scan in whitened space in stretches that the memory holds; a single one is kept."""
        scans = self.view(colour).scans
        if effect.name in scans:
            yield scans[effect.name]
            return
        data = self.scanned(effect)
        whiten = self.view(colour).whitening.of
        size, amplitudes = 8 * data.rows, len(effect.amplitudes(shapes[0], data.units))
        at_once = max(1, _AT_ONCE_BYTES // size)
        keep = len(shapes) <= at_once
        for begin in range(0, len(shapes), at_once):
            stretch = shapes[begin : begin + at_once]
            columns = np.empty((len(stretch), amplitudes, data.rows), np.float32)
            for k in range(0, len(stretch), step := max(1, _IN_CACHE_BYTES // size)):
                raw = data.scan(effect, stretch[k : k + step])
                columns[k : k + step] = whiten(raw.reshape(-1, data.rows)).reshape(raw.shape)
            scan = Scan(columns)
            if keep:
                scans[effect.name] = scan
            yield scan


def blocks_of(parts: Sequence[Part]) -> NDArray[np.int64]:
    """Return the number of the part that each column of a model belongs to, shape (columns,)."""
    return np.repeat(np.arange(len(parts)), [part.raw.shape[0] for part in parts])
