"""Methods that predict a warm machine: each chooses its features and settings by leaving out blocks."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rtec.predictors._columns import Floats
from rtec.predictors.fitting.warm.linear import fit_least_squares, fit_ridge
from rtec.predictors.fitting.warm.lssvm import GAMMAS, WIDTHS, fit_ls_svm
from rtec.predictors.fitting.warm.rows import rms, thin_by_blocks
from rtec.predictors.warm.features import SPINDLE_SPEED, Feature
from rtec.predictors.warm.linear import Linear
from rtec.predictors.warm.regressor import Regressor, RegressorFit
from rtec.training.warm_parts import Places, WarmParts
from rtec.training.warm_results import WarmKind
from rtec.training.warm_scout import SHARES, BlockSums

LAGS_S = ((1000.0, 10_000.0), (300.0, 3000.0), (3000.0, 30_000.0))
"""Time constants that are tried: of a spindle and of a column; then those of smaller and of larger machines."""
CLEARLY = 0.9
"""Times the error by blocks of the usual features: others have to be better than that to be taken, for the lowest of
many errors is low by chance, too."""
LAGS = "first-order lags"
_SPEED_UNIT = 1000.0
_FOLDS = 5
_SCOUT_ROWS, _MOST_ROWS = 400, 1000
FeatureSet = tuple[Feature, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelFit:
    """One method, fitted to one channel.

    Parameters
    ----------
    features, regressor
        The model.
    rows
        Rows of the log that the fit saw, shape (rows,).
    left_out
        Their displacement less what a fit without their block says, in um, shape (rows,); None with one block.
    rms_rows_um
        Root mean square of what fits to other random rows leave of rows; None where that was not asked for.
    """

    features: FeatureSet
    regressor: Regressor
    rows: Places
    left_out: Floats | None
    rms_rows_um: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WarmFit:
    """One method, fitted to all channels."""

    channels: Mapping[str, ModelFit]
    notes: tuple[str, ...] = ()


@dataclass(slots=True, kw_only=True, eq=False)
class WarmTask:
    """What methods are fitted to, and what earlier ones found.

    Parameters
    ----------
    parts
        The rows.
    seed
        Draws random rows.
    until_s
        On the clock of `time.perf_counter`: when settings are no longer tried.
    lags
        Features that the first-order lags chose, for the methods after them.
    """

    parts: WarmParts
    seed: int = 0
    until_s: float = np.inf
    lags: FeatureSet | None = None

    @property
    def plain(self) -> FeatureSet:
        """All inputs as they are."""
        return tuple(Feature(of=name) for name in self.parts.log.inputs)

    @property
    def folds(self) -> Places:
        """A random part of each row that a fit sees, as others hold out rows."""
        draws = np.random.default_rng(self.seed)
        return draws.permutation(self.parts.rows.size) % _FOLDS


@dataclass(frozen=True, slots=True, kw_only=True)
class WarmMethod:
    """One row of the table.

    Parameters
    ----------
    name, kind
        What it is.
    fit
        Fits it to every channel.
    needs_blocks
        Whether it has no figure where a single block trains.
    """

    name: str
    kind: WarmKind
    fit: Callable[[WarmTask], WarmFit]
    needs_blocks: bool = True


def warm_methods() -> tuple[WarmMethod, ...]:
    """Return the methods, the plain ones first."""
    return (
        WarmMethod(name="mean", kind=WarmKind.NONE, fit=_fit_mean, needs_blocks=False),
        WarmMethod(name="least squares", kind=WarmKind.LINEAR, fit=_fit_plain),
        WarmMethod(name="ridge", kind=WarmKind.LINEAR, fit=_fit_plain_ridge),
        WarmMethod(name=LAGS, kind=WarmKind.PHYSICAL, fit=_fit_lags),
        WarmMethod(name="LS-SVM", kind=WarmKind.KERNEL, fit=_fit_ls_svm),
    )


def _fit_mean(task: WarmTask) -> WarmFit:
    parts, features = task.parts, task.plain[:1]
    centre = parts.columns(features).mean(axis=0)
    found = {}
    for name in parts.log.outputs:
        output = parts.outputs[name]
        left_out = None
        if parts.blocks > 1:
            rest = [output[parts.block != number].mean() for number in parts.block]
            left_out = output - np.array(rest)
        mean = Linear(centre=centre, intercept=float(output.mean()), slopes=np.zeros(1))
        found[name] = ModelFit(
            features=features, regressor=mean, rows=parts.rows, left_out=left_out, rms_rows_um=float(output.std())
        )
    return WarmFit(channels=found)


def _fit_plain(task: WarmTask) -> WarmFit:
    return _fitted(task, task.plain, task.parts.rows, fit_least_squares, ())


def _fit_plain_ridge(task: WarmTask) -> WarmFit:
    found, share = _best_set(task, [task.plain])
    return _fit_shared_ridge(task, found, share)


def _fit_lags(task: WarmTask) -> WarmFit:
    features, share = _best_set(task, lag_sets(tuple(task.parts.log.inputs)))
    task.lags = features
    return _fit_shared_ridge(task, features, share)


def _fit_shared_ridge(task: WarmTask, features: FeatureSet, share: float) -> WarmFit:
    weights = weights_of(features, task.parts.columns(features))

    def fit(columns: Floats, output: Floats, block: Places) -> RegressorFit:
        return fit_ridge(columns, output, block, shares=(share,), weights=weights)

    return _fitted(task, features, task.parts.rows, fit, (described(features),))


def _fitted(
    task: WarmTask,
    features: FeatureSet,
    rows: Places,
    fit: Callable[[Floats, Floats, Places], RegressorFit],
    notes: tuple[str, ...],
) -> WarmFit:
    """Fit every channel that is observed to the same features, and once more to random rows."""
    parts = task.parts
    at = np.searchsorted(parts.rows, rows)
    columns, block, folds = parts.columns(features)[at], parts.block[at], task.folds[at]
    found, said = {}, []
    for name in parts.log.outputs:
        output = parts.outputs[name][at]
        one = fit(columns, output, block)
        by_rows = rms(fit(columns, output, folds).left_out)
        found[name] = ModelFit(
            features=features, regressor=one.regressor, rows=rows, left_out=one.left_out, rms_rows_um=by_rows
        )
        said.append((name, one.notes))
    alike = len({each for _, each in said}) == 1
    each = said[0][1] if alike else [f"{name}: {note}" for name, notes_of in said for note in notes_of]
    return WarmFit(channels=found, notes=(*notes, *each))


def lag_sets(inputs: Sequence[str]) -> list[FeatureSet]:
    """Return sets of features, the usual one first.

    Temperatures as they are and behind by two time constants, and the heat of the spindle behind by both; for each
    pair of time constants. Then the same without temperatures that are behind.

    Examples
    --------
    >>> [len(features) for features in lag_sets(["temperature_a", "temperature_b", "spindle_speed"])]
    [8, 8, 8, 4, 4, 4]
    """
    heats = tuple(Feature(of=name) for name in inputs if name != SPINDLE_SPEED)
    found: dict[bool, list[FeatureSet]] = {True: [], False: []}
    for lags in LAGS_S:
        behind = tuple(Feature(of=one.of, lag_s=lag_s) for lag_s in lags for one in heats)
        heat = tuple(Feature(of=SPINDLE_SPEED, lag_s=lag_s, heat=True) for lag_s in lags)
        heat = heat if SPINDLE_SPEED in inputs else ()
        found[True].append(heats + behind + heat)
        found[False].append(heats + heat)
    return [one for one in dict.fromkeys(found[True] + found[False]) if one]


def few_columns(inputs: Sequence[str]) -> FeatureSet:
    """Return the usual features without those temperatures that are behind, where there is a speed."""
    sets = lag_sets(inputs)
    return sets[len(LAGS_S)] if SPINDLE_SPEED in inputs else sets[0]


def _best_set(task: WarmTask, sets: Sequence[FeatureSet]) -> tuple[FeatureSet, float]:
    """Return features and their ridge parameter, chosen by the error by blocks over all channels together."""
    parts = task.parts
    every = tuple(dict.fromkeys(one for features in sets for one in features))
    place = {one: k for k, one in enumerate(every)}
    scaled = scaled_columns(every, parts.columns(every))
    sums = BlockSums.of(scaled, np.stack(list(parts.outputs.values()), axis=1), parts.block)
    tried: list[tuple[float, float, FeatureSet]] = []
    for features in sets:
        if tried and time.perf_counter() > task.until_s:
            break
        tried.append((*sums.best_share([place[one] for one in features], SHARES), features))
    lowest = min(tried, key=lambda one: one[0])
    _, share, features = lowest if lowest[0] < CLEARLY * tried[0][0] else tried[0]
    return features, share


def weights_of(features: FeatureSet, columns: Floats) -> Floats:
    """Return the weights of columns in a ridge regression: the root of the standard deviation in K or 1000 rev/min.

    A sensor that hardly moves shall not count as much as one that heats by 10 K, nor a ten times hotter one ten times
    as much.

    References
    ----------
    van den Berg et al. 2006: Pareto scaling.
    """
    unit = np.array([_SPEED_UNIT if one.of == SPINDLE_SPEED and not one.heat else 1.0 for one in features])
    return np.asarray(np.sqrt(columns.std(axis=0) / unit))


def scaled_columns(features: FeatureSet, columns: Floats) -> Floats:
    """Return columns, shape (rows, features), with the weights of features as their standard deviations."""
    spread = columns.std(axis=0)
    return np.asarray(columns * weights_of(features, columns) / np.where(spread > 0.0, spread, 1.0))


def described(features: FeatureSet) -> str:
    """Return features in words.

    Examples
    --------
    >>> described((Feature(of="temperature_a"), Feature(of="spindle_speed", heat=True, lag_s=1200.0)))
    'Features: 1 temperature as it is; heat of the spindle (speed^(5/3)) behind by 20 min.'
    """
    heats = [one for one in features if one.of != SPINDLE_SPEED]
    lists = {
        f"{len({one.of for one in heats})} temperature{'s' * (len({one.of for one in heats}) > 1)}": heats,
        "heat of the spindle (speed^(5/3))": [one for one in features if one.of == SPINDLE_SPEED and one.heat],
        "speed": [one for one in features if one.of == SPINDLE_SPEED and not one.heat],
    }
    words = []
    for what, which in lists.items():
        lags = sorted({one.lag_s for one in which})
        if lags:
            behind = " and ".join(f"{lag_s / 60.0:.4g}" for lag_s in lags if lag_s > 0.0)
            as_is = ("as it is" if len(heats) < 2 else "as they are") if 0.0 in lags else ""
            words.append(f"{what} {' and '.join(filter(None, (as_is, f'behind by {behind} min' if behind else '')))}")
    return f"Features: {'; '.join(words)}."


def _fit_ls_svm(task: WarmTask) -> WarmFit:
    parts = task.parts
    sets = [task.plain, *([task.lags] if task.lags else [])]
    tried: list[tuple[float, int, FeatureSet]] = []
    scouts = parts.rows[thin_by_blocks(parts.block, most_rows=min(_SCOUT_ROWS, parts.rows.size))]
    at = np.searchsorted(parts.rows, scouts)
    for features in sets:
        columns, block = parts.columns(features)[at], parts.block[at]
        squares = np.zeros(len(WIDTHS) * len(GAMMAS))
        for output in parts.outputs.values():
            if tried and time.perf_counter() > task.until_s:
                break
            figures = [figure for _, figure in fit_ls_svm(columns, output[at], block).tried]
            squares += np.square(figures)
        else:
            best = int(np.argmin(squares))
            tried.append((float(squares[best]), best, features))
    _, best, features = min(tried, key=lambda one: one[0])
    width, gamma = WIDTHS[best // len(GAMMAS)], GAMMAS[best % len(GAMMAS)]

    def fit(columns: Floats, output: Floats, block: Places) -> RegressorFit:
        return fit_ls_svm(columns, output, block, widths=(width,), gammas=(gamma,))

    rows = parts.rows[thin_by_blocks(parts.block, most_rows=min(_MOST_ROWS, parts.rows.size))]
    thinned = (f"Fitted to {rows.size} of {parts.rows.size} rows.",) if rows.size < parts.rows.size else ()
    return _fitted(task, features, rows, fit, (described(features), *thinned))
