"""Fitting a model: amplitudes by generalised least squares, shapes by a bounded joint refit, with uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats, Shape, Tunable
from rtec.errors import ArgumentError
from rtec.inference.forms import refined
from rtec.inference.model import Model, Term
from rtec.inference.noise import Noise, noise_from_repeats, noise_from_residual
from rtec.inference.results import Value
from rtec.inference.score import least_squares
from rtec.inference.whitening import Correlation
from rtec.inference.workspace import Choice, Workspace

_STEP = 1e-4
"""Of a shape parameter's room, for its numerical derivative."""
_ROUNDS = 40
MOST_ROWS_REFITTED = 200_000
"""Beyond, shapes stay where the search left them: their uncertainty is far below what matters."""


def solved(workspace: Workspace, choices: Sequence[Choice], *, datum: bool) -> tuple[list[Floats], float]:
    """Return the amplitudes of each effect and the datum that fit best, none below zero where that cannot be."""
    parts = [workspace.columns(effect, shape) for effect, shape in choices]
    sizes = [part.shape[0] for part in parts]
    table = np.vstack([*parts, workspace.constant] if datum else parts) if parts or datum else None
    if table is None:
        return [], 0.0
    numbers = least_squares(table, workspace.observed)
    low = np.concatenate([
        np.full(size, 0.0 if effect.not_negative else -np.inf)
        for size, (effect, _) in zip(sizes, choices, strict=True)
    ] + [np.full(int(datum), -np.inf)])  # fmt: skip
    if (numbers < low).any():
        length = np.maximum(np.sqrt((table**2).sum(axis=1)), 1e-300)
        scaled = (table / length[:, None]).T
        numbers = lsq_linear(scaled, workspace.observed, bounds=(low, np.inf), method="bvls").x / length
    ends = np.cumsum(sizes)
    return np.split(numbers[: int(ends[-1]) if sizes else 0], ends[:-1]) if sizes else [], (
        float(numbers[-1]) if datum else 0.0
    )


def jointly_refitted(workspace: Workspace, choices: Sequence[Choice], *, datum: bool) -> list[Choice]:
    """Return the choices with all continuous shape parameters refitted at once, within their bounds.

    The amplitudes are solved for at each step (variable projection), so that only shapes are searched.
    """
    free = [
        (k, tunable)
        for k, (effect, shape) in enumerate(choices)
        for tunable in effect.tunables(workspace.conditions, shape)
    ]
    if not free or workspace.dataset.rows > MOST_ROWS_REFITTED:
        return list(choices)
    import lmfit  # noqa: PLC0415 - 0.5 s, and only models with shapes need it

    fixed = [None if effect.tunables(workspace.conditions, shape) else workspace.columns(effect, shape)
             for effect, shape in choices]  # fmt: skip
    start = lmfit.Parameters()
    for number, (k, tunable) in enumerate(free):
        value = float(getattr(choices[k][1], tunable.name))
        start.add(f"shape_{number}", value=value, min=tunable.low, max=tunable.high)

    def moved(parameters: lmfit.Parameters) -> list[Choice]:
        found = list(choices)
        for number, (k, tunable) in enumerate(free):
            effect, shape = found[k]
            found[k] = effect, replace(shape, **{tunable.name: float(parameters[f"shape_{number}"].value)})
        return found

    def residual(parameters: lmfit.Parameters) -> Floats:
        parts = [
            workspace.columns(effect, shape) if known is None else known
            for known, (effect, shape) in zip(fixed, moved(parameters), strict=True)
        ]
        table = np.vstack([*parts, workspace.constant] if datum else parts)
        left: Floats = workspace.observed - least_squares(table, workspace.observed) @ table
        return left / workspace.noise.sigma

    table = np.vstack([*(workspace.columns(*choice) for choice in choices), *([workspace.constant] if datum else [])])
    before = (workspace.observed - least_squares(table, workspace.observed) @ table) / workspace.noise.sigma
    found = lmfit.minimize(residual, start, method="least_squares", max_nfev=_ROUNDS * len(free), x_scale="jac")
    after = np.asarray(found.residual)
    return moved(found.params) if after @ after < before @ before else list(choices)


def fitted_terms(workspace: Workspace, choices: Sequence[Choice], *, datum: bool) -> tuple[tuple[Term, ...], float]:
    """Return the terms with amplitudes and standard errors, and the datum, for given shapes.

    The covariance is that of amplitudes and shape parameters together.
    """
    amplitudes, zero = solved(workspace, choices, datum=datum)
    rows: list[Floats] = []
    tunables: list[list[Tunable]] = []
    for (effect, shape), numbers in zip(choices, amplitudes, strict=True):
        rows.append(workspace.columns(effect, shape))
        own = list(effect.tunables(workspace.conditions, shape))
        tunables.append(own)
        for tunable in own:
            rows.append(_slope(workspace, (effect, shape), tunable, numbers)[None, :])
    if datum:
        rows.append(workspace.constant)
    errors = _errors(workspace, np.vstack(rows)) if rows else np.empty(0)
    terms, at = [], 0
    for (effect, shape), numbers, own in zip(choices, amplitudes, tunables, strict=True):
        middle, end = at + numbers.size, at + numbers.size + len(own)
        terms.append(
            Term(
                effect=effect,
                shape=shape,
                amplitudes=tuple(numbers.tolist()),
                errors=tuple(errors[at:middle].tolist()),
                shape_errors=tuple(zip([t.name for t in own], errors[middle:end].tolist(), strict=True)),
            )
        )
        at = end
    return tuple(terms), zero


def _slope(workspace: Workspace, choice: Choice, tunable: Tunable, numbers: Floats) -> Floats:
    """Return the whitened derivative of a contribution with respect to a shape parameter."""
    effect, shape = choice
    step = _STEP * (tunable.high - tunable.low)
    value = float(getattr(shape, tunable.name))

    def at(moved: float) -> Floats:
        return numbers @ workspace.columns(effect, replace(shape, **{tunable.name: moved}))

    slope: Floats = (at(value + step) - at(value - step)) / (2.0 * step)
    return slope


def _errors(workspace: Workspace, table: Floats) -> Floats:
    """Return the standard errors of the parameters with derivatives ``table``, shape (parameters, rows).

    Ordinary least squares on correlated readings has the covariance ``(A'A)^-1 A'SA (A'A)^-1``.
    """
    length = np.sqrt((table**2).sum(axis=1))
    length[length == 0.0] = np.inf
    scaled = table / length[:, None]
    covariance = np.linalg.pinv(scaled @ scaled.T, rcond=1e-12, hermitian=True)
    if workspace.ordinary and not workspace.noise.correlation.is_white:
        covariance = covariance @ _weighed(scaled, workspace.noise.correlation) @ covariance
    errors: Floats = workspace.noise.sigma * np.sqrt(np.maximum(np.diag(covariance), 0.0)) / length
    return errors


def _weighed(rows: Floats, correlation: Correlation) -> Floats:
    """Return ``A S A'`` for an autoregressive noise with a white part, by the filter that colours white noise."""
    from scipy.signal import lfilter  # noqa: PLC0415 - 0.2 s, for logs without repeats only

    rho, white = correlation.rho, correlation.white
    coloured = lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], rows[:, ::-1], axis=1)
    coloured[:, -1] /= np.sqrt(1.0 - rho**2)  # the first reading has the whole variance, not one step's
    weighed: Floats = (1.0 - white) * (coloured @ coloured.T) + white * (rows @ rows.T)
    return weighed


def values_of(term: Term, model: Model) -> tuple[Value, ...]:
    """Return the numbers of a fitted term as people read them, with standard errors where they have one."""
    if term.shape is None or term.amplitudes is None:
        return ()
    known = {a.name: (e, a.factor) for a, e in zip(
        term.effect.amplitudes(term.shape, model.units), term.errors or (), strict=False)}  # fmt: skip
    known |= {name: (error, 1.0) for name, error in term.shape_errors}
    found = []
    for name, value, unit in term.effect.summary(term.shape, term.amplitudes, model.units):
        error, factor = known.get(name, (None, 1.0))
        found.append(Value(name, value, None if error is None else error * abs(factor), unit))
    return tuple(found)


def fit_model(dataset: Dataset, model: Model, *, all_open: bool = False) -> Model:
    """Fit what a model leaves open; what it states stays.

    Parameters
    ----------
    dataset
        The measurement.
    model
        Terms without shape or amplitudes are fitted, jointly.
    all_open
        Whether to refit the amplitudes that are stated, too, and shapes near the stated ones.

    Returns
    -------
    Model
        Every term with shape and amplitudes. A model with nothing open comes back as it is.

    Raises
    ------
    ArgumentError
        An effect that has to be fitted and that the data cannot show.
    """
    opened = opened_model(dataset, model, all_open=all_open)
    if opened is None:
        return model
    terms, zero = fitted_terms(opened.workspace, opened.choices, datum=opened.datum)
    by_place = iter(terms)
    whole = [next(by_place) if all_open or not term.fitted else term for term in model.terms]
    return model.with_terms(whole, datum=zero if opened.datum else model.datum)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpenedModel:
    """What a model leaves open, with its shapes found: ready for its amplitudes to be fitted."""

    workspace: Workspace
    choices: list[Choice]
    datum: bool


def opened_model(dataset: Dataset, model: Model, *, all_open: bool = False) -> OpenedModel | None:
    """Return the open part of a model with its shapes found, what is stated taken off; None where nothing is open."""
    open_terms = [term for term in model.terms if all_open or not term.fitted]
    if not open_terms:
        return None
    _check_testable(dataset, open_terms)
    stated = model.with_terms([term for term in model.terms if not (all_open or not term.fitted)])
    rest = replace(dataset, observed=residual_of(dataset, stated)) if stated.terms else dataset
    noise = noise_from_repeats(rest) or noise_from_residual(rest, rest.observed - rest.observed.mean(), 1)
    workspace = Workspace(rest, noise)
    choices = shapes_found(workspace, open_terms)
    datum = needs_datum(workspace, choices) and not stated.terms
    choices = jointly_refitted(workspace, choices, datum=datum)
    return OpenedModel(
        workspace=Workspace(rest, noise_after(workspace, choices, datum=datum)), choices=choices, datum=datum
    )


def residual_of(dataset: Dataset, model: Model) -> Floats:
    """Return what a fitted model leaves, shape (rows,), in the observed unit inside."""
    left = dataset.observed - model.datum
    for term in model.terms:
        if term.shape is not None and term.amplitudes is not None:
            left = left - dataset.columns(term.effect, term.shape) @ np.array(term.amplitudes)
    return left


def needs_datum(workspace: Workspace, choices: Sequence[Choice]) -> bool:
    """Return whether the constant of the readings is fitted beside the effects: where there are any but itself."""
    return workspace.has_datum and bool(choices) and all(effect.name != "offset" for effect, _ in choices)


def noise_after(workspace: Workspace, choices: Sequence[Choice], *, datum: bool) -> Noise:
    """Return the noise estimated again with a model taken out."""
    found = noise_from_repeats(workspace.dataset, choices)
    if found is not None:
        return found
    amplitudes, zero = solved(workspace, choices, datum=datum)
    left = workspace.dataset.observed - zero
    for (effect, shape), numbers in zip(choices, amplitudes, strict=True):
        left = left - workspace.dataset.columns(effect, shape) @ numbers
    return noise_from_residual(workspace.dataset, left, sum(a.size for a in amplitudes) + int(datum))


def shapes_found(workspace: Workspace, terms: Sequence[Term]) -> list[Choice]:
    """Return a shape for each term: its own, or the best of its scan beside those that are known already.

    Effects without shape parameters are known from the start, wherever they stand. Each shape found is looked for
    once more when all others are known: the first was found while what these explain still stood in its way.
    """
    shapes = [Shape() if term.effect.shape_type is Shape else term.shape for term in terms]
    looked_for = [k for k, shape in enumerate(shapes) if shape is None]
    for k in looked_for + looked_for * (len(terms) > 1):
        effect = terms[k].effect
        known = [
            (t.effect, s) for i, (t, s) in enumerate(zip(terms, shapes, strict=True)) if i != k and s is not None
        ]
        best = workspace.best_of_scan(effect, workspace.beside(known, effect))
        found = None if best is None else refined(workspace, best, known, workspace.background(known))
        before = shapes[k]
        if before is None:
            shapes[k] = effect.shape_type() if found is None else found.shape
        elif (
            found is not None
            and found.evidence > workspace.judge(effect, before, workspace.background(known)).evidence
        ):
            shapes[k] = found.shape
    return [(term.effect, shape) for term, shape in zip(terms, shapes, strict=True) if shape is not None]


def _check_testable(dataset: Dataset, terms: Sequence[Term]) -> None:
    for term in terms:
        if term.effect.observable is not dataset.observable:
            raise ArgumentError(
                f"effect {term.name}", f"for {dataset.observe}", f"effects of {dataset.observable.value} data"
            )
        reason = term.effect.untestable(dataset.conditions)
        if reason is not None:
            raise ArgumentError(
                f"effect {term.name}", f"not testable ({reason})", "an effect that the data can show",
                f"it needs {term.effect.needs}",
            )  # fmt: skip
