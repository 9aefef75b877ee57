"""Which combinations of parameters and of what was observed took effect, and which that can have not been hit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product

from rtec.verify.campaign.job import NOT_ACTIVATED, Parameters, Value
from rtec.verify.campaign.plan import Plan
from rtec.verify.campaign.store import Done

Key = tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Combination:
    """Values of all dimensions, and what came of them."""

    values: Mapping[str, str]
    jobs: int
    """That took effect so."""
    reason: str
    """Why none can; empty where one can, or has."""

    @property
    def hole(self) -> bool:
        """Return whether it can be, and no job has shown it."""
        return not (self.jobs or self.reason)


@dataclass(slots=True)
class Group:
    """Combinations that differ only in the first dimension."""

    hit: list[str]
    holes: list[str]
    left_out: dict[str, list[str]]
    """``hit``, ``holes``, ``left_out``: values of that dimension; the last ones by the reason why they cannot be."""


class Coverage:
    """Counts the combinations of a plan, job by job.

    Parameters
    ----------
    plan
        Whose jobs observe something: `rtec.verify.campaign.job.JobKind.observed`.

    Examples
    --------
    >>> from rtec.verify.campaign.plan import read_plan
    >>> coverage = Coverage(read_plan("safety").only(["pc-killed", "glitches-for-good", "cutting", "c"]))
    >>> coverage.dimensions, coverage.possible, coverage.hit
    (('fault', 'state', 'direction'), 8, 0)
    >>> coverage.groups()["1", "positive"].holes
    ['pc-killed', 'glitches-for-good']
    """

    def __init__(self, plan: Plan) -> None:
        self._plan, self._taken = plan, Counter[Key]()
        names = [name for name in (*plan.kind.proves, *plan.grid) if len(plan.grid.get(name, ())) > 1]
        observed = [one.name for one in plan.kind.observed]
        proved = [name for name in plan.kind.proves if name in names]
        self.dimensions = tuple(dict.fromkeys([*proved, *observed, *names]))
        """Parameters with several values, what has to be proved first, and what is observed."""
        self.named = self.dimensions[0]
        """The one whose values a hole names."""

    def take(self, done: Done) -> None:
        """Count a job."""
        if done.record["result"] != NOT_ACTIVATED:
            self._taken[self._key({**done.job.parameters, **done.record})] += 1

    def _key(self, values: Mapping[str, Value]) -> Key:
        return tuple(str(values.get(name)) for name in self.dimensions)

    def combinations(self) -> Iterator[Combination]:
        """Yield all of them, in the order of the plan."""
        kind = self._plan.kind
        for row in self._plan.rows():
            never = kind.impossible(row)
            for words in product(*(one.words for one in kind.observed)):
                observed: Parameters = dict(zip((one.name for one in kind.observed), words, strict=True))
                values = dict(zip(self.dimensions, self._key({**row, **observed}), strict=True))
                jobs = self._taken[tuple(values.values())]
                reason = "" if jobs else never or kind.unreachable({**row, **observed}) or ""
                yield Combination(values=values, jobs=jobs, reason=reason)

    def groups(self) -> dict[Key, Group]:
        """Return the combinations by all dimensions but `named`."""
        found: dict[Key, Group] = {}
        for one in self.combinations():
            key = tuple(value for name, value in one.values.items() if name != self.named)
            group = found.setdefault(key, Group([], [], {}))
            name = one.values.get(self.named, "")
            if one.reason:
                group.left_out.setdefault(one.reason, []).append(name)
            else:
                (group.hit if one.jobs else group.holes).append(name)
        return found

    @property
    def possible(self) -> int:
        """Return how many combinations can be."""
        return sum(not one.reason for one in self.combinations())

    @property
    def hit(self) -> int:
        """Return how many were."""
        return sum(one.jobs > 0 for one in self.combinations())

    def to_dict(self) -> dict[str, object]:
        """Return counts, holes by name, and reasons as plain data."""
        others = [name for name in self.dimensions if name != self.named]
        groups = self.groups()
        reasons = Counter(
            {reason: 0 for group in groups.values() for reason in group.left_out}
        )  # in the order of the plan
        for group in groups.values():
            reasons.update({reason: len(names) for reason, names in group.left_out.items()})
        return {
            "dimensions": list(self.dimensions),
            "possible": sum(len(group.hit) + len(group.holes) for group in groups.values()),
            "hit": sum(len(group.hit) for group in groups.values()),
            "holes": [
                dict(zip(others, key, strict=True)) | {self.named: group.holes}
                for key, group in groups.items() if group.holes
            ],
            "left_out": [{"reason": reason, "combinations": number} for reason, number in reasons.items()],
        }  # fmt: skip
