"""A plan: which jobs there are. Read from TOML, or built in."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from rtec.checks import whole_within
from rtec.errors import ArgumentError, FileFormatError, meant, unknown
from rtec.io import Section, parse_toml, read_text
from rtec.verify.campaign.job import Choice, Job, JobKind, Number, Parameter, Parameters, Value, job_kind
from rtec.verify.campaign.own_files import OwnFile

BUILT_IN = (
    "safety", "pairs", "open-faults", "soak", "envelope", "motions", "check", "firmware", "blind", "sensitivity",
)  # fmt: skip
"""Plans that come with rtec, each a file of this folder."""
MOST_JOBS = 100_000
"""A larger product has to be meant."""
_MOST_POINTS, _MOST_RUNS = 10_000, 10_000_000
_TOP = ("about", "job", "seed", "runs", "by", "requirement", "try", "only")
_RANGE = ("from", "to", "points", "spacing", "draw")
_ID = re.compile(r"[^\s,]{1,60}")
_CHOICES = (("spacing", ("linear", "log")), ("draw", ("random", "latin", "sobol")))


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """Numbers drawn anew for each run, from one to another."""

    low: float
    high: float
    log: bool
    """Whether their logarithms are drawn."""
    draw: str
    """``random``; ``latin``: stratified together with all others that are, a Latin hypercube over the runs;
    ``sobol``: in the order of Saltelli, for Sobol indices."""

    def at(self, share: float) -> float:
        """Return the number at a share of the way."""
        if self.log:
            return self.low * math.exp(share * math.log(self.high / self.low))
        return self.low + share * (self.high - self.low)


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """Which rows of the product are tried: where all of ``where`` holds, all of ``keep`` has to."""

    where: Mapping[str, tuple[Value, ...]]
    keep: Mapping[str, tuple[Value, ...]]

    def holds(self, row: Parameters) -> bool:
        """Return whether a row is tried."""
        concerned = all(row[name] in values for name, values in self.where.items())
        return not concerned or all(row[name] in values for name, values in self.keep.items())


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """What some jobs of a plan are evidence for."""

    id: str
    """As its specification has it, without spaces."""
    where: Mapping[str, tuple[Value, ...]]
    """Jobs with one of these values of each parameter; all of the plan's where this is empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What is tried: every combination of values, so many runs each.

    Examples
    --------
    >>> plan = read_plan("safety").only(["glitches", "cable-open", "c"])
    >>> plan.size, sum(1 for _ in plan.jobs())
    (96, 87)
    """

    name: str
    about: str
    kind: JobKind
    seed: int
    """Of everything that is random."""
    runs: int
    """Jobs of each combination, each with random numbers of its own; of Sobol indices the size of the base sample."""
    by: tuple[str, ...]
    """Parameters by which the records are counted."""
    grid: Mapping[str, tuple[Value, ...]]
    """Values of each parameter that has some."""
    drawn: Mapping[str, Range]
    """Ranges of the others."""
    conditions: tuple[Condition, ...]
    requirements: tuple[Requirement, ...] = ()

    def __post_init__(self) -> None:
        if self.sobol and len(self.sobol) < len(self.drawn):
            raise ArgumentError("draw", "sobol for some parameters", "it for all that are drawn, or for none")
        if self.sobol and self.runs & (self.runs - 1):
            raise ArgumentError("runs", self.runs, "a power of two for Sobol indices, as 256", problem="is none")

    @property
    def sobol(self) -> list[str]:
        """Return the parameters of which Sobol indices are wanted."""
        return [name for name, one in self.drawn.items() if one.draw == "sobol"]

    @property
    def repeats(self) -> int:
        """Return the number of jobs of each combination."""
        return self.runs * (len(self.sobol) + 2) if self.sobol else self.runs

    @property
    def size(self) -> int:
        """Return the number of jobs before any condition."""
        return math.prod(len(values) for values in self.grid.values()) * self.repeats

    def rows(self) -> Iterator[dict[str, Value]]:
        """Yield the combinations of the grid that the conditions let through."""
        names = list(self.grid)
        for values in product(*self.grid.values()):
            row = dict(zip(names, values, strict=True))
            if all(condition.holds(row) for condition in self.conditions):
                yield row

    def jobs(self) -> Iterator[Job]:
        """Yield the jobs that can prove something.

        Raises
        ------
        ArgumentError
            There is none.
        """
        draws, some, reasons = self._draws(), False, dict[str, None]()
        for run in range(self.repeats):
            for row in self.rows():
                reason = self.kind.impossible(row)
                if reason is not None:
                    reasons[reason] = None
                    continue
                some = True
                yield Job(self.kind.function, row | {name: each[run] for name, each in draws.items()}, self.seed, run)
        if not some:
            because = "; ".join(reasons) or "no combination meets its conditions"
            raise ArgumentError(f"plan {self.name}", "no job of it can prove anything", "other values", because)

    def requirement_ids(self, parameters: Parameters) -> list[str]:
        """Return the ids of the requirements that a job with these parameters is evidence for.

        Examples
        --------
        >>> plan = replace(read_plan("pairs"), requirements=(Requirement(id="SR-12", where={"design": ("c",)}),))
        >>> plan.requirement_ids({"design": "c"}), plan.requirement_ids({"design": "a"})
        (['SR-12'], [])
        """
        met = (one.id for one in self.requirements if all(parameters[name] in of for name, of in one.where.items()))
        return list(dict.fromkeys(met))

    def _draws(self) -> dict[str, list[Value]]:
        """Return the values of each drawn parameter, one a run."""
        generator = np.random.default_rng([self.seed, len(self.drawn)])
        latin, sobol = [name for name, one in self.drawn.items() if one.draw == "latin"], self.sobol
        shares = {name: generator.random(self.runs) for name in self.drawn if name not in (*latin, *sobol)}
        if latin or sobol:
            from scipy.stats import qmc  # noqa: PLC0415 - half a second, and most plans draw nothing
        if latin:
            sample = qmc.LatinHypercube(d=len(latin), seed=generator).random(self.runs)
            shares |= {name: sample[:, k] for k, name in enumerate(latin)}
        if sobol:
            # two independent samples A and B, then A with one column after the other from B (Saltelli et al. 2010)
            first, second = np.split(qmc.Sobol(d=2 * len(sobol), seed=generator).random(self.runs), 2, axis=1)
            mixed = [np.where(np.arange(len(sobol)) == k, second, first) for k in range(len(sobol))]
            sample = np.vstack([first, second, *mixed])
            shares |= {name: sample[:, k] for k, name in enumerate(sobol)}
        found: dict[str, list[Value]] = {}
        for name, one in self.drawn.items():
            parameter = self.kind.parameter(name)
            if isinstance(parameter, Number):
                found[name] = [parameter.rounded(one.at(float(share))) for share in shares[name]]
        return found

    def only(self, words: Iterable[str]) -> Plan:
        """Return the plan with fewer values.

        Parameters
        ----------
        words
            Values of its choices (``glitches``), classes of values (``place=bus``), or ``parameter=value``. Those of
            one parameter are tried all.

        Raises
        ------
        ArgumentError
            A word that means nothing in this plan.
        """
        chosen: dict[str, list[Value]] = {}
        for word in words:
            parameter, values = self._meant(word)
            chosen.setdefault(parameter.name, []).extend(values)
        kept = {name: tuple(v for v in values if v in chosen.get(name, values)) for name, values in self.grid.items()}
        return replace(self, grid=kept)

    def counted_by(self, words: Iterable[str]) -> Plan:
        """Return the plan with its records counted by other parameters.

        Raises
        ------
        ArgumentError
            A word that is no parameter.
        """
        by, keys = tuple(words), [one.key for one in self.kind.parameters]
        for word in by:
            if self.kind.parameter(word) is None:
                raise unknown("by", word[:60], keys, noun="parameter")
        return replace(self, by=by)

    def _meant(self, word: str) -> tuple[Parameter, Sequence[Value]]:
        key, equals, text = word.partition("=")
        named = self.kind.parameter(key) if equals else None
        places = [named] if named is not None else [one for one in self.kind.parameters if isinstance(one, Choice)]
        found: list[tuple[Parameter, Sequence[Value]]] = []
        for one in places:
            tried = self.grid.get(one.name, ())
            if not isinstance(one, Number):
                meant_here: Sequence[Value] = one.meant(text if named else word)
            else:
                meant_here = one.read(_plain(text), f"--only {key}")
            values = [value for value in meant_here if value in tried]
            if word in values:
                return one, [word]
            if values:
                found.append((one, values))
        if len(found) > 1:
            names = " or ".join(f"{one.key}={word}" for one, _ in found)
            raise ArgumentError("--only", repr(word), names, problem="means several things")
        if found:
            return found[0]
        words = [str(value) for one in places for value in self.grid.get(one.name, ())]
        allowed = "; ".join(f"{one.key}: {one.listed()}" for one in places if isinstance(one, Choice))
        near = meant(text if named else word, words)
        raise ArgumentError("--only", repr(word)[:60], allowed or "a value that the plan tries", near)


def _plain(text: str) -> object:
    """Return a pure number as a number, and anything else as it is."""
    try:
        return float(text)
    except ValueError:
        return text


def plan_text(word: str) -> tuple[str, str]:
    """Return name and text of a plan: a built-in one, or a file.

    Raises
    ------
    ArgumentError
        Neither of them.
    FileFormatError
        A file that cannot be read.
    """
    if word in BUILT_IN:
        return word, (Path(__file__).parent / f"{word}.toml").read_text(encoding="utf-8")
    if not word.endswith(".toml"):
        allowed = f"a FILE.toml, or one of {', '.join(BUILT_IN)}"
        raise ArgumentError("plan", repr(word[:60]), allowed, meant(word, BUILT_IN))
    return Path(word).stem, read_text(word, "a plan in TOML")


def read_plan(word: str) -> Plan:
    """Read a plan.

    Parameters
    ----------
    word
        Name of a built-in plan, or a file.

    Raises
    ------
    ArgumentError, FileFormatError
        No plan of this name, unknown keys, values out of range, units that do not fit.

    Examples
    --------
    >>> plan = read_plan("motions")
    >>> plan.kind.does
    'A design inserts a step in a motion of the axis, and every count is judged.'
    """
    name, text = plan_text(word)
    path = f"{name}.toml" if word in BUILT_IN else word
    top = Section(path, "", parse_toml(text, path), {"seed": 1, "runs": 1, "try": {}, "only": []}, optional=_TOP)
    kind = job_kind(top.text("job"), top.where("job"))
    keys = tuple(one.key for one in kind.parameters)
    tried = top.part("try", top.raw("try"), keys)
    grid: dict[str, tuple[Value, ...]] = {}
    drawn: dict[str, Range] = {}
    for one in kind.parameters:
        given = tried.raw(one.key) if tried.has(one.key) else None
        if isinstance(given, dict) and isinstance(one, Number) and "draw" in given:
            drawn[one.name] = _drawn(tried, one, given)
        else:
            grid[one.name] = one.usual if given is None else _values(tried, one, given)
        if isinstance(one, OwnFile) and grid[one.name] != one.usual:
            one.check_beside(tried.has(one.beside), tried.where(one.key))
    rules = top.raw("only")
    if not isinstance(rules, list):
        raise FileFormatError(path, None, "only is no list of tables", "[[only]]")
    with top.naming(runs="runs", by="by"):
        plan = Plan(
            name=name, about=top.text("about") if top.has("about") else kind.does, kind=kind,
            seed=top.whole("seed", 0, (1 << 32) - 1), runs=top.whole("runs", 1, _MOST_RUNS), by=kind.by, grid=grid,
            drawn=drawn, conditions=tuple(_condition(top, kind, grid, rule) for rule in rules),
            requirements=_requirements(top, kind, grid),
        )  # fmt: skip
        return plan.counted_by(top.texts("by")) if top.has("by") else plan


def _values(tried: Section, one: Parameter, given: object) -> tuple[Value, ...]:
    """Return the values that a key stands for: one, a list, or points of a range."""
    where = tried.where(one.key)
    if isinstance(given, dict):
        if not isinstance(one, Number):
            raise ArgumentError(where, "a table", "words: they have no range")
        return _points(tried, one, given)
    every = given if isinstance(given, list) else [given]
    folder = (Path(tried.path).parent,) if isinstance(one, OwnFile) else ()
    found = dict.fromkeys(value for each in every for value in one.read(each, where, *folder))
    if not found:
        raise ArgumentError(where, "an empty list", "at least one value")
    return tuple(found)


def _range(tried: Section, one: Number, given: dict[str, Any]) -> tuple[Section, Range]:
    section = tried.part(f"try.{one.key}", given, _RANGE)
    low, high = (one.one(section.raw(key), section.where(key)) for key in ("from", "to"))
    if not low < high:
        raise section.refused("to", "a value above that of from", problem="is not above it")
    spacing, draw = (section.raw(key) if section.has(key) else words[0] for key, words in _CHOICES)
    for (key, words), word in zip(_CHOICES, (spacing, draw), strict=True):
        if word not in words:
            raise unknown(section.where(key), str(word), words)
    if spacing == "log" and low <= 0.0:
        raise section.refused("from", "a value above zero", problem="has no logarithm")
    return section, Range(low=low, high=high, log=spacing == "log", draw=str(draw))


def _drawn(tried: Section, one: Number, given: dict[str, Any]) -> Range:
    section, found = _range(tried, one, given)
    if section.has("points"):
        raise section.refused("points", "either points or draw", problem="does not go with draw")
    return found


def _points(tried: Section, one: Number, given: dict[str, Any]) -> tuple[Value, ...]:
    section, found = _range(tried, one, given)
    points = whole_within(section.where("points"), section.raw("points"), 2, _MOST_POINTS)
    return tuple(dict.fromkeys(one.rounded(found.at(k / (points - 1))) for k in range(points)))


def _requirements(top: Section, kind: JobKind, grid: Mapping[str, tuple[Value, ...]]) -> tuple[Requirement, ...]:
    """Return the requirements: one id for the whole plan, or tables with an id and the jobs that it is for."""
    if not top.has("requirement"):
        return ()
    given = top.raw("requirement")
    found = []
    for one in given if isinstance(given, list) else [{"id": given}]:
        section = top.part("requirement", one, ("id", "if"))
        name = section.raw("id") if section.has("id") else None
        if not isinstance(name, str) or not _ID.fullmatch(name):
            raise ArgumentError(section.where("id"), repr(name)[:60], "an id such as SR-12, without spaces or commas")
        found.append(Requirement(id=name, where=_where(section, "requirement", kind, grid)))
    return tuple(found)


def _where(
    section: Section, name: str, kind: JobKind, grid: Mapping[str, tuple[Value, ...]]
) -> dict[str, tuple[Value, ...]]:
    """Return the values that a table ``if`` names."""
    some = [one for one in kind.parameters if one.name in grid]
    given = section.raw("if") if section.has("if") else {}
    part = section.part(f"{name}.if", given, tuple(one.key for one in some))
    return {one.name: _values(part, one, part.raw(one.key)) for one in some if part.has(one.key)}


def _condition(top: Section, kind: JobKind, grid: Mapping[str, tuple[Value, ...]], rule: object) -> Condition:
    keys = tuple(one.key for one in kind.parameters if one.name in grid)
    section = top.part("only", rule, ("if", *keys))
    some = [one for one in kind.parameters if one.name in grid and section.has(one.key)]
    keep = {one.name: _values(section, one, section.raw(one.key)) for one in some}
    found = Condition(where=_where(section, "only", kind, grid), keep=keep)
    if not found.keep:
        raise FileFormatError(top.path, None, "a table [[only]] that keeps everything", f"one of {', '.join(keys)}")
    return found
