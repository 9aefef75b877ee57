"""A measured figure beside its bar, and how often and on which core it is measured."""

from __future__ import annotations

import os
import statistics
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """How the figures are measured.

    Parameters
    ----------
    core
        Number of the core that everything runs on unless a figure says otherwise.
    second_core
        The other one where a figure says two; the same where there is only one.
    quick
        Shorter runs and fewer of them: to see that all works, and roughly how fast.
    """

    core: int
    second_core: int
    quick: bool

    @property
    def rounds(self) -> int:
        """Return how often a short measurement is repeated after its warm-up."""
        return 3 if self.quick else 15

    def of(self, whole: int, quick: int) -> int:
        """Return the size of a run."""
        return quick if self.quick else whole


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """What a figure is to reach.

    Parameters
    ----------
    value
        The bar itself.
    unit
        What it is counted in.
    at_most
        True where less is better.
    """

    value: float
    unit: str
    at_most: bool = False

    def __str__(self) -> str:
        """Return the bar as the table shows it."""
        return f"{'≤' if self.at_most else '≥'} {number(self.value)} {self.unit}"

    def margin(self, measured: float) -> float:
        """Return how many times better than the bar a figure is; 1 and more is met."""
        return self.value / measured if self.at_most else measured / self.value


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One row of the table.

    Parameters
    ----------
    what
        What is measured.
    measured
        The figure with its unit, as text.
    command
        What repeats it.
    value
        The figure in the unit of the bar; None where nothing was measured.
    bar
        What is to be reached; None where the figure is only recorded.
    binding
        False where the bar is that of another figure, shown in brackets for comparison.
    """

    what: str
    measured: str
    command: str
    value: float | None = None
    bar: Bar | None = None
    binding: bool = True

    @property
    def verdict(self) -> str:
        """Return whether the bar is met."""
        if self.value is None:
            return "skipped"
        if self.bar is None or not self.binding:
            return "recorded"
        return "met" if self.bar.margin(self.value) >= 1.0 else "NOT MET"

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Return what, bar, figure and ratio as the page shows them."""
        margin = f"{self.bar.margin(self.value):.2g}" if self.bar is not None and self.value is not None else ""
        bar = "" if self.bar is None else f"{self.bar}" if self.binding else f"({self.bar})"
        return self.what, bar, self.measured, f"{margin}, missed" if self.verdict == "NOT MET" else margin


def skipped(what: str, why: str, command: str, bar: Bar | None = None) -> Figure:
    """Return the row of something that could not be measured here."""
    return Figure(what=what, measured=why.replace("\n", " ")[:200], command=command, bar=bar)


@dataclass(frozen=True, slots=True)
class Spread:
    """Times of several runs of the same work, seconds each."""

    seconds: tuple[float, ...]

    @property
    def best(self) -> float:
        """Return the time of the run that was disturbed least."""
        return min(self.seconds)

    @property
    def median(self) -> float:
        """Return the time of the run in the middle."""
        return statistics.median(self.seconds)

    def text(self, of_seconds: Callable[[float], str]) -> str:
        """Return the best run and the median, each written by ``of_seconds``."""
        return f"{of_seconds(self.best)} (median {of_seconds(self.median)})"


def number(value: float) -> str:
    """Return a number with three digits, large ones by powers of ten.

    Examples
    --------
    >>> number(33_400_000.0), number(500.0), number(0.31)
    ('33.4e6', '500', '0.31')
    """
    if abs(value) < 10_000:
        return f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"
    power = 9 if abs(value) >= 1e9 else 6 if abs(value) >= 1e6 else 3
    return f"{value / 10.0**power:.3g}e{power}"


@contextmanager
def on_cores(cores: set[int]) -> Iterator[None]:
    """Run on these cores only, where the system can be told so; children inherit it."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
