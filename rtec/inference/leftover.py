"""What is left that nothing in the library explains: what it depends on, and its strongest line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rtec.effects import Floats
from rtec.effects._periodic import fill
from rtec.effects.frequency_grid import frequencies
from rtec.inference import tails
from rtec.inference.repeat_space import equal_runs, repeat_space
from rtec.inference.results import Unknown
from rtec.inference.score import Background, gains, orthonormal
from rtec.inference.structure import SIGNIFICANT
from rtec.inference.workspace import Choice, Workspace

MATTERS = 0.1
"""Share of the noise floor below which repeatable structure is of no interest, however significant."""
_LINE = 1e-3
_COLUMN = 1e-4
_MOST_LINES = 2000


def describe_leftover(
    workspace: Workspace, choices: Sequence[Choice], p_means: float | None, p_changes: Mapping[str, float]
) -> Unknown | None:
    """Return what repeatable structure is left, or None where what is left is noise.

    Parameters
    ----------
    workspace, choices
        The data and the model.
    p_means
        Probability that the means over repeats fit, or None.
    p_changes
        Probability of the changes left between repeats, by what they depend on.
    """
    changing = [name for name, p in p_changes.items() if p < SIGNIFICANT]
    steady = p_means is not None and p_means < SIGNIFICANT and _excess(workspace, choices) > MATTERS
    if not (changing or steady):
        return None
    depends: list[str] = []
    period = frequency = None
    if steady:
        depends += _position_or_direction(workspace, choices)
        period = _strongest_period(workspace, choices)
    for name in changing:
        depends += {"time": ["time"], "direction": ["direction", "run"], "position": ["position", "run"]}[name]
    depends += _unknown_columns(workspace, choices)
    if period is not None and workspace.conditions.time_is_coordinate:
        frequency = 1.0 / period
    depends = list(dict.fromkeys(depends))
    unit = workspace.conditions.position_unit
    line = "" if period is None else f"; the strongest line has a period of {period:.4g} {unit}"
    changes = "changes from run to run" if changing and not steady else "repeats from run to run"
    if changing and steady:
        changes = "partly repeats and partly changes from run to run"
    return Unknown(
        depends_on=tuple(depends),
        period=period,
        frequency_hz=frequency,
        description=f"what is left depends on {', '.join(depends)} and {changes}{line}",
    )


def _mean_run(workspace: Workspace, choices: Sequence[Choice]) -> Floats:
    """Return the residual's mean over equal runs at each reading of the data, whitened, shape (rows,)."""
    back = workspace.background(choices)
    space = repeat_space(workspace.dataset)
    if space is None or space.slots is None:
        return back.residual
    return np.tile(back.residual.reshape(space.runs, -1).mean(axis=0), space.runs)


def _excess(workspace: Workspace, choices: Sequence[Choice]) -> float:
    """Return the RMS of the repeatable part of the residual beyond what noise gives, in units of the noise."""
    space = repeat_space(workspace.dataset)
    if space is None:
        return 0.0
    mean = _mean_run(workspace, choices)
    runs = space.runs if space.slots is not None else 1
    parameters = workspace.background(choices).basis.shape[1]
    slots = workspace.dataset.rows / runs
    expected = workspace.noise.sigma**2 / runs * max(1.0 - parameters / slots, 0.0)
    return float(np.sqrt(max(np.mean(mean**2) - expected, 0.0))) / workspace.noise.sigma


def _position_or_direction(workspace: Workspace, choices: Sequence[Choice]) -> list[str]:
    """Return whether the repeatable part is common to both directions, differs between them, or both."""
    c = workspace.conditions
    if not c.both_directions or c.direction is None:
        return ["position"]
    mean = _mean_run(workspace, choices)
    places = np.searchsorted(c.places, c.position + 1e-7 * c.span) - 1
    both, differing = _variance_by(places, mean), _variance_by(places, mean * c.direction)
    scale = max(both, differing)
    found = ["position"]
    if differing > 0.25 * scale:
        found.append("direction")
    return found


def _variance_by(places: np.ndarray, values: Floats) -> float:
    number = np.maximum(places, 0)
    count = np.bincount(number)
    means = np.bincount(number, weights=values) / np.maximum(count, 1)
    return float(np.mean(means[count > 0] ** 2))


def _strongest_period(workspace: Workspace, choices: Sequence[Choice]) -> float | None:
    """Return the period of the strongest line in position, where there is one above chance."""
    grid = frequencies(workspace.conditions)[:_MOST_LINES]
    if not grid.size:
        return None
    residual = _mean_run(workspace, choices)
    rows = equal_runs(workspace.dataset)
    slots = workspace.dataset.rows if rows is None else rows[1]
    place, left = workspace.conditions.position[:slots], residual[:slots]
    waves = np.empty((grid.size, 2, place.size))
    fill(grid, place, waves)
    m, q, n = waves.shape
    empty = Background(basis=np.empty((n, 0)), residual=left * np.sqrt(workspace.dataset.rows / slots))
    fall = gains(workspace.whitened_part(waves.reshape(m * q, n)).reshape(m, q, n), empty)
    k = int(np.argmax(fall))
    p = grid.size * float(tails.chi_squared(fall[k] / workspace.noise.sigma**2, 2))
    return float(1.0 / grid[k]) if p < _LINE else None


def _unknown_columns(workspace: Workspace, choices: Sequence[Choice]) -> list[str]:
    """Return the headings of columns that no effect uses and that go with what is left, alone or by direction."""
    dataset = workspace.dataset
    back = workspace.background(choices)
    direction = dataset.coordinates.direction
    found = []
    for heading, values in dataset.unknown:
        if np.ptp(values) == 0.0:
            continue
        shifted = values - values.mean()
        columns = [shifted] if direction is None else [shifted, shifted * direction]
        basis = orthonormal(workspace.whitened(np.array(columns)), back.basis)
        if basis.shape[1]:
            fall = float(((basis.T @ back.residual) ** 2).sum())
            spread = back.rss / back.residual.size
            if tails.chi_squared(fall / spread, basis.shape[1]) < _COLUMN:
                found.append(heading)
    return found
