"""Fitting a model: amplitudes by generalised least squares under its noise, with the uncertainty of its shapes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats, Shape
from rtec.errors import ArgumentError
from rtec.inference.colour import Whitening
from rtec.inference.forms import forms_of
from rtec.inference.model import Model, Term
from rtec.inference.proposals import proposals
from rtec.inference.results import Value
from rtec.inference.scored import Judge, Scored
from rtec.inference.space import Choice, Space

_STEP = 1e-4
"""Of a shape parameter's room, for its numerical derivative."""
_NEAR = 1e-3
"""Of a standard error, by which an amplitude is moved to see what depends on it."""
_CUT = 1e-12
LIKELY = 0.02
"""Of the likeliest noise, that another has to be to count in the standard errors."""


def fitted_terms(judge: Judge, model: Scored) -> tuple[tuple[Term, ...], float]:
    """Return the terms of a model with amplitudes and standard errors, and its datum.

    Amplitudes are those of generalised least squares, not held towards zero. Standard errors hold what is not known
    of the shapes, too, and of the noise: they are averaged over its colours, with what the amplitudes differ between
    them. Under the likeliest alone they cover 70 % instead of 95 % where an effect in time has to be told from slow
    noise.
    """
    terms, datum = _under(judge, model)
    values = np.array([value for _, value in model.colours])
    shares = np.exp(values - values.max(initial=-np.inf))
    likely = [(c, w) for (c, _), w in zip(model.colours, shares.tolist(), strict=True) if w > LIKELY and terms]
    if not [c for c, _ in likely if c != model.colour]:
        return terms, datum
    weights = np.array([w for _, w in likely]) / sum(w for _, w in likely)
    others = [_under(judge, replace(model, colour=c)) if c != model.colour else (terms, datum) for c, _ in likely]
    holder = _holder(terms)
    averaged = []
    for k, term in enumerate(terms):
        each = [found[k] for found, _ in others]
        held = [zero - datum if k == holder else 0.0 for _, zero in others]
        moved = [
            np.subtract(one.amplitudes or (), term.amplitudes or ()) + d for one, d in zip(each, held, strict=True)
        ]
        spread = [np.array(one.covariance) + np.outer(d, d) for one, d in zip(each, moved, strict=True)]
        covariance: Floats = np.tensordot(weights, spread, axes=1)
        of_shapes = np.array([[error for _, error in one.shape_errors] for one in each])
        own = np.sqrt(weights @ of_shapes**2).tolist()
        averaged.append(
            replace(
                term,
                errors=tuple(np.sqrt(np.diag(covariance)).tolist()),
                covariance=_rows(covariance),
                shape_errors=tuple(zip([name for name, _ in term.shape_errors], own, strict=True)),
            )
        )
    return tuple(averaged), datum


def _under(judge: Judge, model: Scored) -> tuple[tuple[Term, ...], float]:
    """Return terms with amplitudes and errors, and the datum, under the noise of a model alone."""
    space = judge.space
    weights = space.weights(model.colour)
    whiten = space.view(weights).whitening.of
    raw = [space.part_of(choice).raw for choice in model.choices]
    sizes = [columns.shape[0] for columns in raw]
    none = np.empty((0, space.dataset.rows))
    if space.has_datum:
        raw.append(np.ones((1, space.dataset.rows)))
    table = np.vstack([none, *map(whiten, raw)])
    observed = whiten(space.dataset.observed[None, :])[0]
    numbers = _solved(table, observed)
    low = np.concatenate([
        np.full(size, 0.0 if effect.not_negative else -np.inf)
        for size, (effect, _) in zip(sizes, model.choices, strict=True)
    ] + [np.full(table.shape[0] - sum(sizes), -np.inf)])  # fmt: skip
    if (numbers < low).any():
        from scipy.optimize import lsq_linear  # noqa: PLC0415 - 0.1 s, for effects that cannot be below zero only

        length = np.maximum(np.sqrt((table**2).sum(axis=1)), 1e-300)
        numbers = lsq_linear((table / length[:, None]).T, observed, bounds=(low, np.inf), method="bvls").x / length
    noise = space.view(model.colour).whitening
    left = noise.of((space.dataset.observed - numbers @ np.vstack([none, *raw]))[None, :])[0]
    variance = float(left @ left) / max(observed.size - numbers.size, 1)
    ends = np.cumsum([0, *sizes])
    amplitudes = [numbers[a:b] for a, b in itertools.pairwise(ends)]
    slopes = [_slopes(space, choice, a) for choice, a in zip(model.choices, amplitudes, strict=True)]
    moved = np.vstack([table, *(whiten(s) for s in slopes if s.size)])
    covariance = variance * _covariance(moved, noise if weights != model.colour else None)
    if moved.size and space.dataset.conditions.moving and space.dataset.rounding > 0.0:
        covariance += _of_rounding(moved, numbers @ np.vstack([none, *raw]), variance, space.dataset.rounding)
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    holder = _holder([Term(effect=effect) for effect, _ in model.choices]) if space.has_datum else None
    terms, at = [], table.shape[0]
    for k, (effect, shape) in enumerate(model.choices):
        read = np.eye(covariance.shape[0])[ends[k] : ends[k + 1]]
        read[:, ends[-1] : ends[-1] + int(k == holder)] = 1.0
        block = read @ covariance @ read.T
        names = [t.name for t in effect.tunables(space.dataset.conditions, shape)]
        own = errors[at : at + len(names)].tolist()
        at += len(names)
        terms.append(
            Term(
                effect=effect,
                shape=shape,
                amplitudes=tuple(amplitudes[k].tolist()),
                errors=tuple(np.sqrt(np.maximum(np.diag(block), 0.0)).tolist()),
                covariance=_rows(block),
                shape_errors=tuple(zip(names, own, strict=True)),
            )
        )
    return tuple(terms), float(numbers[ends[-1]]) if space.has_datum else 0.0


def _solved(table: Floats, observed: Floats) -> Floats:
    if not table.size:
        return np.empty(0)
    length = np.maximum(np.sqrt((table**2).sum(axis=1)), 1e-150)  # its square is no zero
    scaled = table / length[:, None]
    found: Floats = np.linalg.pinv(scaled @ scaled.T, rcond=_CUT, hermitian=True) @ (scaled @ observed) / length
    return found


def _covariance(table: Floats, noise: Whitening | None) -> Floats:
    """Return the covariance of the parameters with derivatives ``table`` for noise of variance 1.

    Plain least squares under a correlated ``noise`` have the covariance ``(A'A)^-1 A'SA (A'A)^-1``.
    """
    if not table.size:
        return np.empty((0, 0))
    length = np.sqrt((table**2).sum(axis=1))
    length[length == 0.0] = np.inf
    scaled = table / length[:, None]
    covariance: Floats = np.linalg.pinv(scaled @ scaled.T, rcond=_CUT, hermitian=True)
    if noise is not None:
        covariance = covariance @ (scaled @ noise.coloured(scaled).T) @ covariance
    covariance /= np.multiply.outer(length, length)
    return covariance


def _of_rounding(table: Floats, said: Floats, variance: float, step: float) -> Floats:
    """Return the covariance of parameters that rounding brings, whose error is the same wherever the model says so.

    Notes
    -----
    Of noise of standard deviation ``s`` before rounding, the mean of what is rounded to ``step`` is off by a wave of
    amplitude ``step / pi * exp(-2 (pi s / step)^2)`` over the true value (B. Widrow, I. Kollar, Quantization Noise,
    2008, appendix on bias). Values half a step apart are off independently of each other.
    """
    noise = max(variance - step**2 / 4.0, 0.0)  # rounding adds up to that, halfway between two steps
    square = step**2 / (2.0 * np.pi**2) * np.exp(-4.0 * np.pi**2 * noise / step**2)
    level = np.unique(np.round(2.0 * said / step), return_inverse=True)[1]
    sums = np.array([np.bincount(level, column) for column in table])
    inverse = _covariance(table, None)
    found: Floats = square * inverse @ (sums @ sums.T) @ inverse
    return found


def _rows(square: Floats) -> tuple[tuple[float, ...], ...]:
    return tuple(map(tuple, square.tolist()))


def _slopes(space: Space, choice: Choice, amplitudes: Floats) -> Floats:
    """Return the derivatives of a contribution with respect to its shape parameters, shape (parameters, rows)."""
    effect, shape = choice
    found = []
    for tunable in effect.tunables(space.dataset.conditions, shape):
        step = _STEP * (tunable.high - tunable.low)
        value = float(getattr(shape, tunable.name))
        up, down = (
            amplitudes @ space.raw((effect, replace(shape, **{tunable.name: value + way * step}))) for way in (1, -1)
        )
        found.append((up - down) / (2.0 * step))
    return np.array(found).reshape(len(found), space.dataset.rows)


def values_of(term: Term, model: Model) -> tuple[Value, ...]:
    """Return the numbers of a fitted term as people read them, with standard errors where they have one.

    Notes
    -----
    Where a number is made of several amplitudes (a length and a phase of a wave, the mean of a map), their covariance
    is propagated to first order; of a term without one, as read from a file, the errors as independent ones.
    """
    if term.shape is None or term.amplitudes is None:
        return ()
    read = term.effect.summary(term.shape, term.amplitudes, model.units)
    errors = _propagated(term, model, [value for _, value, _ in read]) | dict(term.shape_errors)
    return tuple(Value(name, value, errors.get(name), unit) for name, value, unit in read)


def _propagated(term: Term, model: Model, read: list[float]) -> dict[str, float]:
    """Return the standard errors of what people read of a term, without those of its shape, by name."""
    if term.shape is None or term.amplitudes is None:
        return {}
    errors = np.array(term.errors or ())
    covariance = np.diag(errors**2) if term.covariance is None else np.array(term.covariance)
    slopes, names = np.zeros((len(read), errors.size)), [""] * len(read)
    for k in np.flatnonzero(errors):
        # so small a step that no phase passes half a turn
        step = _NEAR * errors[k]
        moved = [value + (step if i == k else 0.0) for i, value in enumerate(term.amplitudes)]
        found = term.effect.summary(term.shape, moved, model.units)
        names = [name for name, _, _ in found]
        slopes[:, k] = (np.array([value for _, value, _ in found]) - read) / step
    square = np.einsum("ik,kl,il->i", slopes, covariance, slopes)
    return {name: float(np.sqrt(total)) for name, total in zip(names, square, strict=True) if total > 0.0}


def residual_of(dataset: Dataset, model: Model) -> Floats:
    """Return what a fitted model leaves, shape (rows,), in the observed unit inside."""
    return dataset.observed - model.predict(dataset)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpenedModel:
    """What a model leaves open, with its shapes found and its noise fitted."""

    judge: Judge
    scored: Scored
    stated: Model
    """What is not open; its contribution is taken off the readings of ``judge``."""


def fit_model(dataset: Dataset, model: Model, *, all_open: bool = False) -> Model:
    """Fit what a model leaves open; what it states stays, and a model with nothing open comes back as it is.

    Parameters
    ----------
    model
        Terms without shape or amplitudes are fitted, jointly.
    all_open
        Whether to refit the amplitudes that are stated, too, and shapes near the stated ones.

    Raises
    ------
    ArgumentError
        An effect that has to be fitted and that the data cannot show.
    """
    opened = opened_model(dataset, model, all_open=all_open)
    if opened is None:
        return model
    terms, datum = fitted_terms(opened.judge, opened.scored)
    by_place = iter(terms)
    whole = [next(by_place) if all_open or not term.fitted else term for term in model.terms]
    return holding_datum(model.with_terms(whole, datum=opened.stated.datum + datum))


def holding_datum(model: Model) -> Model:
    """Return a model whose map of position holds the datum, if it has such a map.

    A fit cannot tell the constant of a map from the zero of the instrument and splits it at will; a table of errors,
    as people write it, holds both.

    Examples
    --------
    >>> from rtec.effects import MapShape, Units, effect_named
    >>> bent = Term(effect=effect_named("pitch_map"), shape=MapShape((0.0, 50.0, 100.0)), amplitudes=(1.0, 2.0, 4.0))
    >>> held = holding_datum(Model(observe="deviation", units=Units("mm", "mm", "s"), terms=(bent,), datum=0.5))
    >>> held.terms[0].amplitudes, held.datum
    ((1.5, 2.5, 4.5), 0.0)
    """
    k = _holder(model.terms)
    if k is None or (amplitudes := model.terms[k].amplitudes) is None:
        return model
    raised = replace(model.terms[k], amplitudes=tuple(value + model.datum for value in amplitudes))
    return model.with_terms([*model.terms[:k], raised, *model.terms[k + 1 :]], datum=0.0)


def _holder(terms: Sequence[Term]) -> int | None:
    """Return which term holds the datum: the first map of position; None where there is none."""
    maps = (k for k, term in enumerate(terms) if term.effect.is_map and "offset" in forms_of(term.effect).contains)
    return next(maps, None)


def opened_model(dataset: Dataset, model: Model, *, all_open: bool = False) -> OpenedModel | None:
    """Return the open part of a model with its shapes found, what is stated taken off; None where nothing is open."""
    open_terms = [term for term in model.terms if all_open or not term.fitted]
    if not open_terms:
        return None
    check_testable(dataset, open_terms)
    stated = model.with_terms([term for term in model.terms if not (all_open or not term.fitted)])
    if all_open:
        stated = replace(stated, datum=0.0)
    judge = Judge(Space(replace(dataset, observed=residual_of(dataset, stated))))
    return OpenedModel(judge=judge, scored=shapes_found(judge, open_terms), stated=stated)


def shapes_found(judge: Judge, terms: Sequence[Term]) -> Scored:
    """Return a model with a shape for each term: its own, or the best of its scan beside those known already.

    Effects without shape parameters are known from the start, wherever they stand. Each shape found is looked for
    once more when all others are known: the first was found while what these explain still stood in its way. Of
    several, the first may be the last.
    """
    unknown = [k for k, term in enumerate(terms) if term.shape is None and term.effect.shape_type is not Shape]
    orders = [unknown] if len(unknown) < 2 else [unknown, unknown[::-1]]
    return max((_looked_for(judge, terms, order) for order in orders), key=lambda model: model.score)


def _looked_for(judge: Judge, terms: Sequence[Term], unknown: Sequence[int]) -> Scored:
    """Return a model whose unknown shapes were looked for in an order."""
    shapes = [Shape() if term.effect.shape_type is Shape else term.shape for term in terms]
    for k in [*unknown, *unknown] if len(terms) > 1 else unknown:
        effect = terms[k].effect
        known = [
            (t.effect, s) for i, (t, s) in enumerate(zip(terms, shapes, strict=True)) if i != k and s is not None
        ]
        beside = judge.score(known)
        found = proposals(judge, beside, [effect], least=-np.inf)
        if found:
            shapes[k] = max(found, key=lambda p: judge.quickly([*known, p.choice], beside)).choice[1]
        elif shapes[k] is None:
            shapes[k] = next(iter(effect.shapes(judge.space.dataset.conditions)), effect.shape_type())
    return judge.score([(t.effect, s) for t, s in zip(terms, shapes, strict=True) if s is not None])


def check_testable(dataset: Dataset, terms: Sequence[Term]) -> None:
    """Refuse effects that a measurement cannot show.

    Raises
    ------
    ArgumentError
        An effect of another kind of quantity, or one for which something is missing.
    """
    for term in terms:
        if not term.effect.explains(dataset.observable):
            raise ArgumentError(
                f"effect {term.name}", f"for {dataset.observe}", f"effects of {dataset.observable.value} data"
            )
        reason = term.effect.untestable(dataset.conditions)
        if reason is not None:
            raise ArgumentError(
                f"effect {term.name}", f"not testable ({reason})", "an effect that the data can show",
                f"it needs {term.effect.needs}",
            )  # fmt: skip
