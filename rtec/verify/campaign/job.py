"""Jobs as plain values: a dotted function, its parameters, a seed; and which parameters a kind of job has."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from typing import Any

from rtec.checks import number_within
from rtec.errors import ArgumentError, meant, unknown
from rtec.units import parse_in
from rtec.verify.campaign.own_files import OwnFile

Value = int | float | str | None
Parameters = Mapping[str, Value]
Record = dict[str, Value]
"""What a job gives: numbers and words. It holds ``result``, one of the four below."""

PASSED, FAILED, EXEMPT, NOT_ACTIVATED = "passed", "failed", "exempt", "not activated"
"""The results of a job. Exempt is harm that supervision cannot prevent; it is counted apart, but not as a
failure. A job whose fault did not take effect proves nothing: it is in no denominator."""

_LISTED = 12
"""Words of a choice up to which a message names all."""
JOB_KINDS = {
    "fault": "rtec.verify.safety.jobs:FAULT",
    "episode": "rtec.verify.safety.jobs:EPISODE",
    "open-fault": "rtec.verify.safety.open_jobs:OPEN_FAULT",
    "envelope": "rtec.verify.envelope.jobs:ENVELOPE",
    "motion": "rtec.verify.contract.jobs:MOTION",
    "check": "rtec.verify.contract.jobs:CHECK",
    "firmware": "rtec.verify.firmware.jobs:FIRMWARE",
    "game": "rtec.blind.jobs:GAME",
    "lathe": "rtec.study.jobs:LATHE",
}
"""Kinds of jobs by the word that plans use; another kind is named by its place, ``package.module:NAME``."""


@cache
def named_at(place: str) -> Any:
    """Return what ``package.module:name`` names."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


@dataclass(frozen=True, slots=True)
class Job:
    """One job of a plan; wherever it is run, it gives the same record.

    Examples
    --------
    >>> job = Job("rtec.verify.safety.jobs:inject", {"design": "c"}, seed=1, run=0)
    >>> job.address("some code") == job.address("some code"), job.address("some code") == job.address("other code")
    (True, False)
    """

    function: str
    """``package.module:name``; it is called with the parameters, the seed and the run."""
    parameters: Parameters
    seed: int
    """Of the plan."""
    run: int
    """Number of the job among those with equal parameters; seed and run give everything that is random."""

    def address(self, code: str) -> str:
        """Return the content address: a digest of the job and of the code that carries it out."""
        content = [self.function, self.parameters, self.seed, self.run, code]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:24]

    def carry_out(self) -> Record:
        """Carry it out."""
        function: Callable[[Parameters, int, int], Record] = named_at(self.function)
        with redirect_stdout(sys.stderr):  # what a user's algorithm prints is no result
            return function(self.parameters, self.seed, self.run)


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A parameter whose value is one of some words."""

    name: str
    words: tuple[str, ...]
    """In lower case, with hyphens."""
    default: tuple[str, ...] = ()
    """What a plan tries that does not say; all of them where this is empty."""
    classes: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    """Classifications by name, with the class of each word: ``place=bus`` stands for all words of the class."""

    @property
    def key(self) -> str:
        """Return the key of a plan."""
        return self.name

    @property
    def usual(self) -> tuple[Value, ...]:
        """Return what a plan tries that does not say."""
        return self.default or self.words

    def read(self, given: object, where: str) -> tuple[Value, ...]:
        """Return the values that a word of a plan stands for.

        Raises
        ------
        ArgumentError
            It stands for none.
        """
        found = self.meant(str(given)) if isinstance(given, str) else ()
        if not found:
            known = [*self.words, *self._class_names()]
            raise ArgumentError(where, repr(given)[:60], self.listed(), meant(str(given)[:60].lower(), known))
        return found

    def listed(self) -> str:
        """Return the words for a message; of many a few."""
        if len(self.words) <= _LISTED:
            return ", ".join(self.words)
        more = f", or {', '.join(self._class_names())}" if self.classes else ""
        return f"one of {len(self.words)}, such as {', '.join(self.words[:_LISTED:4])}{more}"

    def meant(self, text: str) -> tuple[str, ...]:
        """Return the words that a text stands for: the word itself, those that contain it, or those of a class.

        Examples
        --------
        >>> fault = Choice(name="fault", words=("bus-off", "cable-open-for-good", "glitches"),
        ...                classes={"place": {"bus-off": "bus", "cable-open-for-good": "axis", "glitches": "axis"}})
        >>> fault.meant("cable-open"), fault.meant("place=axis"), fault.meant("open-for-bad")
        (('cable-open-for-good',), ('cable-open-for-good', 'glitches'), ())
        """
        word = "-".join(text.lower().replace(",", " ").split())
        if word in self.words:
            return (word,)
        if "=" in word:
            name, _, wanted = word.partition("=")
            return tuple(one for one in self.words if self.classes.get(name, {}).get(one) == wanted)
        return tuple(one for one in self.words if word and f"-{word}-" in f"-{one}-")

    def _class_names(self) -> list[str]:
        return [f"{name}={one}" for name, of in self.classes.items() for one in dict.fromkeys(of.values())]


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """A parameter that is a number, with a unit where it has one."""

    name: str
    """Ends in its unit."""
    unit: str | None = None
    """Of the value that a job receives, as `rtec.units.UNITS` has it; None for a pure number."""
    low: float
    high: float
    default: float
    whole: bool = False
    """Whether jobs receive it rounded to a whole number."""

    @property
    def key(self) -> str:
        """Return the key of a plan: the name without its unit."""
        return self.name if self.unit is None else self.name.removesuffix("_" + self.unit.replace("/", "_").lower())

    @property
    def usual(self) -> tuple[Value, ...]:
        """Return what a plan tries that does not say."""
        return (self.rounded(self.default),)

    def rounded(self, value: float) -> float | int:
        """Return a value as jobs receive it."""
        return round(value) if self.whole else float(value)

    def read(self, given: object, where: str) -> tuple[Value, ...]:
        """Return the value of a text with its unit, or of a pure number.

        Raises
        ------
        ArgumentError
            No number, no unit or one of another dimension, or a value outside the range.

        Examples
        --------
        >>> Number(name="frequency_hz", unit="Hz", low=1.0, high=1e7, default=5e5).read("20 kHz", "plan: frequency")
        (20000.0,)
        """
        return (self.rounded(self.one(given, where)),)

    def one(self, given: object, where: str) -> float:
        """Return the value, not rounded; as `read`."""
        if self.unit is not None:
            value = parse_in(str(given), self.unit, name=where)
            return number_within(where, value, self.low, self.high, unit=self.unit)
        return number_within(where, given, self.low, self.high)


Parameter = Choice | Number | OwnFile


@dataclass(frozen=True, slots=True, kw_only=True)
class JobKind:
    """What jobs do, and which parameters they have."""

    does: str
    """A sentence."""
    function: str
    """As of `Job`."""
    parameters: tuple[Parameter, ...]
    by: tuple[str, ...]
    """Parameters by which the records are counted where a plan does not say."""
    trace: str = ""
    """``package.module:name`` of what returns a job's `rtec.verify.campaign.trace.Trace`, called as its function is;
    empty where there are no lines to be seen."""
    proves: tuple[str, ...] = ()
    """For each combination of these at least one job has to be activated, or there is a hole in the evidence."""
    impossible: Callable[[Parameters], str | None] = lambda parameters: None
    """Returns why a job with these parameters cannot prove anything; None: it can."""
    observed: tuple[Choice, ...] = ()
    """Words of the record that count as dimensions of the coverage, beside the parameters."""
    unreachable: Callable[[Parameters], str | None] = lambda parameters: None
    """Returns why no job takes effect with these parameters and observed words; None: one can."""

    def parameter(self, key: str) -> Parameter | None:
        """Return the parameter that a plan's key or a job's name stands for."""
        return next((one for one in self.parameters if key in (one.key, one.name)), None)


def job_kind(word: str, where: str) -> JobKind:
    """Return the kind of jobs that a plan names.

    Raises
    ------
    ArgumentError
        There is none of this name.
    """
    place = JOB_KINDS.get(word, word)
    if ":" not in place:
        raise unknown(where, word[:60], JOB_KINDS, noun="kind of job")
    try:
        kind = named_at(place)
    except (ImportError, AttributeError, ValueError) as error:
        raise ArgumentError(where, repr(word[:60]), "package.module:NAME of a JobKind", str(error)) from error
    if not isinstance(kind, JobKind):
        raise ArgumentError(where, repr(word[:60]), "package.module:NAME of a JobKind")
    return kind
