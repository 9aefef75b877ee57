"""Figures of LS-SVMs: a grid of widths and gammas by leaving out blocks, and training beside scikit-learn."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt
from figures import Bar, Figure, Setting, Spread, skipped
from open_path_job import WrongResultError

from rtec.predictors.fitting.warm.lssvm import GAMMAS, WIDTHS, fit_ls_svm, train_ls_svm

Floats = npt.NDArray[np.float64]
THIS = "python benchmarks/measure.py --only ls-svm"
SENSORS = 17
ROWS = (300, 1000, 3000, 10_000)
WIDTH, GAMMA = 5.0, 10.0
"""Of the trainings that are compared; in scikit-learn's words gamma = 1 / (2 width ** 2), alpha = 1 / gamma."""


def ls_svm(setting: Setting) -> Iterator[Figure]:
    """Measure the grid of leave-block-out, and one training beside `KernelRidge`."""
    yield from _grid(setting)
    for rows in ROWS[: setting.of(len(ROWS), 3)]:
        yield _beside_kernel_ridge(rows, setting.of(5, 2))


def _readings(rows: int) -> tuple[Floats, Floats]:
    """Return scaled columns that do not depend on each other, the worst case for a grid, and an output."""
    draw = np.random.default_rng(0)
    columns = draw.normal(size=(rows, SENSORS))
    return columns, np.sin(columns[:, 0]) + 0.1 * draw.normal(size=rows)


def _timed(work: Callable[[], object]) -> tuple[float, float]:
    """Return the wall time and the processor time of some work."""
    wall, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - processor


def _grid(setting: Setting) -> Iterator[Figure]:
    columns, output = _readings(1000)
    block = np.arange(1000) // 100
    what = f"{len(WIDTHS)} widths x {len(GAMMAS)} gammas by leaving out 10 blocks, 1000 rows of {SENSORS} columns"
    took = [_timed(lambda: fit_ls_svm(columns, output, block)) for _ in range(setting.of(5, 2))]
    for name, at in (("processor time", 1), ("wall time", 0)):
        spread = Spread(tuple(one[at] for one in took))
        yield Figure(
            what=f"{what}, {name}",
            measured=spread.text(lambda s: f"{s:.2f} s"),
            value=spread.best,
            bar=Bar(value=3.0, unit="s", at_most=True),
            command=THIS,
        )


def _beside_kernel_ridge(rows: int, rounds: int) -> Figure:
    what, bar = f"Training with {rows} rows, beside `KernelRidge`", Bar(value=1.0, unit="x scikit-learn")
    try:
        from sklearn.kernel_ridge import KernelRidge
    except ImportError:
        return skipped(what, "scikit-learn is not installed", THIS, bar)
    columns, output = _readings(rows)
    both = np.stack([output, np.ones(rows)], axis=1)  # its solutions for the output and for ones make the bias
    peer = KernelRidge(alpha=1.0 / GAMMA, kernel="rbf", gamma=0.5 / WIDTH**2)
    ours, theirs = [], []
    for _ in range(rounds):
        ours.append(_timed(lambda: train_ls_svm(columns, output, width=WIDTH, gamma=GAMMA)))
        theirs.append(_timed(lambda: peer.fit(columns, both)))
    asked = columns[:500] + 0.1
    bias = peer.dual_coef_[:, 0].sum() / peer.dual_coef_[:, 1].sum()
    of_output, of_ones = peer.predict(asked).T
    found, _ = train_ls_svm(columns, output, width=WIDTH, gamma=GAMMA).predict(asked)
    apart = float(np.abs(of_output + bias * (1.0 - of_ones) - found).max())
    if apart > 1e-8:
        raise WrongResultError(f"predictions differ by {apart:g}")
    (wall, own), (peer_wall, other) = (
        [Spread(tuple(one[at] for one in took)) for at in (0, 1)] for took in (ours, theirs)
    )
    return Figure(
        what=what,
        measured=f"{other.best / own.best:.1f} x (medians {other.median / own.median:.1f} x): {own.best:.3g} against "
        f"{other.best:.3g} s; wall time {peer_wall.best / wall.best:.1f} x; predictions differ by {apart:.0e}",
        value=other.best / own.best,
        bar=bar,
        command=THIS,
    )
