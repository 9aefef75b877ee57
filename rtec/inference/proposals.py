"""Which effects might help a model: the best shapes of each against what it leaves; the models one larger or less."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import fdtrc

from rtec.effects import Conditions, Effect, Floats, Shape
from rtec.effects._harmonics import WavesShape
from rtec.effects.frequency_grid import is_uneven, stated_base
from rtec.effects.protocol import own_shape
from rtec.inference.colour import Colour
from rtec.inference.forms import forms_of, is_asked
from rtec.inference.probes import Probe
from rtec.inference.scored import Judge, Scored
from rtec.inference.space import Choice, Part, Scan, Space

PROMISING = 24
"""Proposals of the scan that are weighed under the model's noise."""
CLOSER, CLOSER_GENERIC = 6, 2
"""Proposals beside each model that are scored with their own noise; probes among them, which have many columns."""
MOST_EFFECTS = 9
APART = 0.01
"""Share of a column that has to be new beside the model: what is left of less is rounding, or nearly a constant."""
_STEPS, _FINE_STEPS = 8, 14
"""Of the golden section: a fiftieth of a step of the scan is enough to propose, a thousandth is what is fitted."""
LEVEL_OF_PLACES = 0.01
"""Probability, at most, that one of the periods tried explains as much of what each target shows by chance."""
SLOW = 8.0
"""Nats that an effect in time may lack in the scan: beside slow noise what it explains counts as that, as long as the
noise is not fitted together with it."""
_NO_SPREAD = 1e-8
"""Between the eigenvalues of two columns: at 1e-8 rounding and the bound itself do equally little harm."""
_EACH = 3
"""Shapes of each effect that are looked at more closely."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """An effect in a shape that might help, and its worth by the scan in nats, less its price."""

    choice: Choice
    worth: float


@dataclass(frozen=True, eq=False)
class Beside:
    """What a model leaves under one colour of noise: an orthonormal basis of its columns, and the residual."""

    basis: Floats
    """Shape (columns, rows)."""
    residual: Floats
    rss: float
    parts: Sequence[Part] = ()
    turn: Floats | None = None
    """The basis, but for the constant, in terms of the parts' columns."""

    @cached_property
    def both(self) -> Floats:
        """Basis and residual together, shape (columns + 1, rows)."""
        return np.vstack([self.basis, self.residual])


def beside(space: Space, choices: Sequence[Choice], colour: Colour) -> Beside:
    """Return what a model leaves, by least squares in whitened space."""
    observed = space.observed(colour)
    parts = space.parts_of(choices)
    table = np.vstack([np.empty((0, observed.size)), *(space.white(part, colour) for part in parts)])
    turn = _orthogonalising(table)
    basis = np.vstack([space.view(colour).constant, turn @ table])
    residual = observed - (basis @ observed) @ basis
    return Beside(basis, residual, float(residual @ residual), parts, turn)


def orthonormal(rows: Floats) -> Floats:
    """Return an orthonormal basis of rows of shape (rows, readings); dependent rows add nothing."""
    return _orthogonalising(rows) @ rows


def _orthogonalising(rows: Floats) -> Floats:
    """Return the combinations of rows that are an orthonormal basis of them, shape (basis, rows)."""
    gram = rows @ rows.T
    length = np.sqrt(np.diag(gram))
    scale = np.where(length > 0.0, 1.0 / np.where(length > 0.0, length, 1.0), 0.0)
    # one side after the other: a bump beside all readings may be 1e-157 high
    values, vectors = np.linalg.eigh(gram * scale[:, None] * scale)
    kept = values > 1e-10 * values.max(initial=0.0)
    combined: Floats = (vectors[:, kept] / np.sqrt(values[kept])).T * scale
    return combined


def falls(columns: Floats, back: Beside) -> Floats:
    """Return by how much each shape lowers the residual sum of squares, shape (shapes,).

    Columns are whitened, shape (shapes, amplitudes, rows).
    """
    m, q, n = columns.shape
    both = (columns.reshape(m * q, n) @ back.both.T).reshape(m, q, -1)
    return _explained(np.matmul(columns, columns.transpose(0, 2, 1)), both[:, :, :-1], both[:, :, -1])


def fall_of(columns: Floats, back: Beside) -> float:
    """Return the same for one shape, its columns of shape (amplitudes, rows), in a third of the time."""
    both, whole = columns @ back.both.T, columns @ columns.T
    short = 1.0 / np.sqrt(np.maximum(whole.diagonal(), 1e-300))
    inside, along = both[:, :-1], both[:, -1] * short
    gram = (whole - inside @ inside.T) * short * short[:, None]
    if short.size == 1:
        return float(along[0] ** 2 / gram[0, 0]) if gram[0, 0] > APART else 0.0
    values, vectors = np.linalg.eigh(gram)
    usable = values > APART
    return float(((along @ vectors)[usable] ** 2 / values[usable]).sum())


def falls_of_scan(space: Space, scan: Scan, back: Beside, colour: Colour) -> Floats:
    """Return the same for shapes of a scan, shape (shapes,), from products that are known."""
    inside = [scan.onto_part("constant", space.view(colour).constant)]
    if back.parts and back.turn is not None:
        each = [scan.onto_part(part, space.white(part, colour)) for part in back.parts]
        inside.append(np.concatenate(each, axis=2) @ back.turn.T)
    return _explained(scan.gram, np.concatenate(inside, axis=2), scan.onto(back.residual[None])[:, :, 0])


def _explained(whole: Floats, inside: Floats, along: Floats) -> Floats:
    """Return the falls from products of the columns with each other, the model's basis, and the residual."""
    gram = whole - inside @ inside.transpose(0, 2, 1)
    length = np.sqrt(np.maximum(np.diagonal(whole, axis1=1, axis2=2), 1e-300))
    gram = gram / (length[:, :, None] * length[:, None, :])
    along = along / length
    if gram.shape[1] == 2:  # most shapes are single waves: in closed form they take a tenth of the time
        (one, both), other = gram[:, 0].T, gram[:, 1, 1]
        # two columns of equal length at a right angle have none: what is left of it there is rounding
        spread = np.maximum(np.hypot((one - other) / 2.0, both), _NO_SPREAD)
        values = ((one + other) / 2.0)[:, None] + spread[:, None] * np.array([1.0, -1.0])
        turned = (along[:, None, :] @ gram @ along[:, :, None])[:, :, 0]
        onto = np.abs(turned - values[:, ::-1] * (along**2).sum(axis=1)[:, None]) / (2.0 * spread[:, None])
    else:
        values, vectors = np.linalg.eigh(gram)
        onto = (vectors.transpose(0, 2, 1) @ along[:, :, None])[:, :, 0] ** 2
    usable = values > APART
    found: Floats = np.where(usable, onto / np.where(usable, values, 1.0), 0.0).sum(axis=1)
    return found


def by_chance(judge: Judge, model: Scored, k: int) -> bool:
    """Return whether some wave of less than two steps explains as much of the mean error at each target by chance.

    What the targets show may be anything that repeats, which a wave of one of very many periods resembles. An F-test
    over targets, not over readings, adjusted by the periods tried; False for any other effect.
    """
    (effect, shape), c = model.choices[k], judge.space.dataset.coordinates
    if not isinstance(shape, WavesShape) or not is_uneven(c) or shape.period * (c.places.size - 1) > 2.0 * c.span:
        return False
    if stated_base(c, shape.period) is not None or not is_asked("by chance"):
        return False
    fit = judge.fit(model)
    at = np.unique(np.searchsorted(c.places, c.position, side="right"), return_inverse=True)[1]
    rows = np.vstack([judge.left(model) + fit.contribution(k), fit.parts[k].raw])
    means = np.array([np.bincount(at, row) / np.bincount(at) for row in rows])
    means = means - means.mean(axis=1, keepdims=True)
    mean, basis = means[0], orthonormal(means[1:])
    fall, below = float(((basis @ mean) ** 2).sum()), mean.size - 1 - len(basis)
    ratio = (fall / len(basis)) / max((float(mean @ mean) - fall) / max(below, 1), 1e-300)
    return below < 1 or float(fdtrc(len(basis), below, ratio)) * effect.tried(c, shape) > LEVEL_OF_PLACES


def worth_of(fall: float, amplitudes: int, back: Beside, readings: int) -> float:
    """Return half the log of what is left, less half a log of the readings for each amplitude (Schwarz)."""
    left = max(1.0 - fall / max(back.rss, 1e-300), 1e-9)
    return -0.5 * readings * float(np.log(left)) - 0.5 * amplitudes * float(np.log(max(readings, 2)))


def proposals(
    judge: Judge, model: Scored, effects: Iterable[Effect], *, least: float = 0.0, families: bool = True
) -> list[Proposal]:
    """Return the most promising shapes of each effect beside a model, the most promising first.

    Only those are returned that are worth more than ``least``, in nats; without ``families`` waves one by one.
    """
    space = judge.space
    colour = model.colour.bounded
    back = beside(space, model.choices, colour)
    found: list[Proposal] = []
    for effect in effects:
        best = _best_shapes(space, effect, back, colour, families=families)
        variants = [effect.variants(space.dataset.conditions, shape) for shape in best]
        if effect.is_wave and not families:
            variants = [forms[:1] for forms in variants]  # the simplest: the wave itself
        others = [other for one, other in model.choices if one is effect]
        every = dict.fromkeys(itertools.chain(*variants))
        forms = [(effect, form) for form in every if bearable(space.dataset.conditions, effect, form, others)]
        worth = {form: _worth(judge, form, back, colour) for form in forms}
        # the many columns of a probe cost less than half a logarithm each: the full score decides
        bar = -np.inf if isinstance(effect, Probe) else least - (SLOW if effect.in_time else 0.0)
        promising = sorted((form for form in forms if worth[form] > bar), key=lambda form: -worth[form])
        sound = (form for form in promising if _is_plausible(space, form, back, colour))
        for form in itertools.islice(sound, _EACH):
            refined = refine(judge, form, back, colour, _STEPS)
            found.append(Proposal(refined, _worth(judge, refined, back, colour)))
    return sorted({p.choice: p for p in found}.values(), key=lambda proposal: -proposal.worth)


def bearable(conditions: Conditions, effect: Effect, shape: Shape, others: Sequence[Shape]) -> bool:
    """Return whether data can bear out a shape of an effect, and tell it from others of the same effect."""
    forms = forms_of(effect)
    return forms.doubtful(conditions, shape) is None and forms.crowded(conditions, shape, others, np.inf) is None


def _worth(judge: Judge, choice: Choice, back: Beside, colour: Colour) -> float:
    columns = judge.space.white(judge.space.part_of(choice), colour)
    fall = fall_of(columns, back)
    return worth_of(fall, columns.shape[0], back, judge.space.readings) - judge.price(choice)


def _is_plausible(space: Space, choice: Choice, back: Beside, colour: Colour) -> bool:
    """Return whether a family would be one of its period beside a model: other effects may be anything."""
    effect, shape = choice
    columns = space.white(space.part_of(choice), colour)
    if not effect.is_wave or columns.shape[0] <= 2:
        return True
    new = columns - (columns @ back.basis.T) @ back.basis
    numbers = np.asarray(np.linalg.lstsq(new @ new.T, new @ back.residual, rcond=APART)[0], np.float64)
    return forms_of(effect).implausible(space.dataset.conditions, shape, numbers) is None


def _best_shapes(space: Space, effect: Effect, back: Beside, colour: Colour, *, families: bool) -> list[Shape]:
    """Return the best shapes of the scan grid: local maxima of what they explain.

    Waves one by one are longer than a step between targets: any sum of long waves looks a little like some short one.
    """
    shapes, _ = space.shapes(effect)
    if not shapes:
        return []
    if effect.is_map:
        return list(shapes)
    found = peaks(space, effect, back, colour)
    if effect.is_wave and not families:
        found = [one for one in found if not is_within_a_step(space.dataset.coordinates, one)]
    return found[:_EACH]


def is_within_a_step(conditions: Conditions, shape: Shape) -> bool:
    """Return whether a wave is shorter than the usual step between places."""
    return own_shape(shape, WavesShape).period < float(np.median(np.diff(conditions.places)))


def peaks(space: Space, effect: Effect, back: Beside, colour: Colour) -> list[Shape]:
    """Return the shapes of the scan grid that explain more than their neighbours, the best first.

    Shapes of which different things are said, as of two sensors, are no neighbours.
    """
    shapes, sound = space.shapes(effect)
    fall = np.concatenate([falls_of_scan(space, scan, back, colour) for scan in space.scan(effect, shapes, colour)])
    fall[~sound] = 0.0
    peak = np.ones(fall.size, dtype=np.bool_)
    apart = np.array([one.said_of_it != other.said_of_it for one, other in itertools.pairwise(shapes)], np.bool_)
    peak[1:] &= (fall[1:] >= fall[:-1]) | apart
    peak[:-1] &= (fall[:-1] > fall[1:]) | apart
    order = np.flatnonzero(peak & (fall > 0.0))
    return [shapes[k] for k in order[np.argsort(-fall[order])]]


def refine(judge: Judge, choice: Choice, back: Beside, colour: Colour, steps: int = _FINE_STEPS) -> Choice:
    """Return an effect with its continuous shape parameters moved to where they explain most, one after the other."""
    effect, shape = choice
    data, whiten = judge.space.scanned(effect), judge.space.view(colour).whitening.of
    for tunable in effect.tunables(judge.space.dataset.conditions, shape):

        def explained(value: float, shape: Shape = shape, name: str = tunable.name) -> float:
            columns = data.columns(effect, replace(shape, **{name: value}))
            return fall_of(whiten(columns.T), back)

        now = float(getattr(shape, tunable.name))
        best = golden(explained, tunable.low, tunable.high, steps)
        if explained(best) > explained(now):
            shape = replace(shape, **{tunable.name: best})
    return effect, shape


def golden(function: Callable[[float], float], low: float, high: float, steps: int = _FINE_STEPS) -> float:
    """Return where a function of one hump is largest, by the golden section.

    Examples
    --------
    >>> round(golden(lambda x: -((x - 0.3) ** 2), 0.0, 1.0), 2)
    0.3
    """
    share = (np.sqrt(5.0) - 1.0) / 2.0
    left, right = high - share * (high - low), low + share * (high - low)
    at_left, at_right = function(left), function(right)
    for _ in range(steps):
        if at_left > at_right:
            high, right, at_right = right, left, at_left
            left = high - share * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + share * (high - low)
            at_right = function(right)
    return float((low + high) / 2.0)


@dataclass(slots=True, eq=False)
class Neighbours:
    """The models next to one; the effects ``given`` stay, those ``barred`` are not looked for.

    Waves are looked for one by one if ``single``, else as families of harmonics.
    """

    judge: Judge
    given: tuple[Choice, ...] = ()
    barred: frozenset[str] = frozenset()
    single: bool = False
    _children: dict[object, list[Scored]] = field(default_factory=dict)

    def effects_for(self, model: Scored) -> list[Effect]:
        """Return the effects that may be added to a model."""
        names = list(model.names)
        return [
            effect
            for effect in self.judge.space.library
            if names.count(effect.name) < forms_of(effect).at_most
            and effect.name not in self.barred
            and not (effect.builds_on and not effect.builds_on & set(names))
        ]

    def without(self, model: Scored, k: int) -> Scored:
        """Return a model without its effect ``k``, and without what builds on that."""
        return self.judge.score(self.rest(model, k), model)

    def rest(self, model: Scored, k: int) -> list[Choice]:
        """Return the choices of that."""
        rest = [choice for i, choice in enumerate(model.choices) if i != k]
        held = {effect.name for effect, _ in rest}
        return [c for c in rest if not c[0].builds_on or c[0].builds_on & held or c in self.given]

    def children(self, model: Scored) -> list[Scored]:
        """Return the models one effect larger that the scan proposes, scored."""
        key = model.key, self.barred, self.single
        if key not in self._children:
            self._children[key] = self.proposed(model, self.effects_for(model))
        return self._children[key]

    def pairs(self, model: Scored) -> list[Scored]:
        """Return the models with an effect and one that builds on it, scored: the first alone may explain little."""
        if len(model.choices) + 2 > MOST_EFFECTS:
            return []
        held, library = set(model.names), self.judge.space.library
        waiting = [e for e in library if e.builds_on and not e.builds_on & held and not isinstance(e, Probe)]
        found = []
        for base in self.effects_for(model):
            more = [effect for effect in waiting if base.name in effect.builds_on]
            for begun in proposals(self.judge, model, [base], least=-np.inf)[:1] if more else ():
                with_base = self.judge.score([*model.choices, begun.choice], model)
                best = {p.choice[0]: p.choice for p in reversed(proposals(self.judge, with_base, more))}
                found += [self.judge.score([*with_base.choices, choice], with_base) for choice in best.values()]
        return found

    def proposed(self, model: Scored, effects: Iterable[Effect]) -> list[Scored]:
        """Return the models with one of the effects besides that the scan proposes, scored."""
        if len(model.choices) >= MOST_EFFECTS:
            return []
        found = proposals(self.judge, model, effects, families=not self.single)
        generic = [p.choice for p in found if isinstance(p.choice[0], Probe)]
        promising = [p.choice for p in found if p.choice not in generic][:PROMISING]
        worth = {choice: self.judge.quickly([*model.choices, choice], model) for choice in (*generic, *promising)}
        closer = sorted(worth, key=lambda choice: -worth[choice])[:CLOSER]
        probes = [choice for choice in closer if isinstance(choice[0], Probe)]
        return [self.judge.score([*model.choices, c], model) for c in closer if c not in probes[CLOSER_GENERIC:]]
