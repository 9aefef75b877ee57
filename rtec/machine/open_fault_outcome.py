"""What becomes of faults on the open path: whether they took effect, who noticed, which counts are wrong."""

from __future__ import annotations

from dataclasses import dataclass

from rtec.machine.faults import Fault
from rtec.machine.open_fault_kinds import place_of, word_of

NOT_ACTIVATED, MASKED, DETECTED, SILENT = "not activated", "masked", "detected", "silent corruption"
"""What becomes of faults. One that did not take effect proves nothing; a masked one left every count right and nobody
noticed; a silent one left a wrong count, and nobody noticed."""


@dataclass(slots=True, kw_only=True)
class FaultEffect:
    """What shows that a fault took effect."""

    fault: Fault
    activated_ps: int | None = None
    """When it took effect first; None: it did not."""
    changes: int = 0
    """Moments at which the lines behind it, or output and completed total of the box, differed from what they would
    have been without it."""

    def add(self, found: tuple[int | None, int]) -> None:
        """Take what a window shows: when first, how often."""
        if self.activated_ps is None:
            self.activated_ps = found[0]
        self.changes += found[1]

    def to_dict(self) -> dict[str, object]:
        """Return it under the names that scripts rely on."""
        fault = self.fault
        return {
            "fault": word_of(fault.kind),
            "place": place_of(fault.kind),
            "from_ps": fault.from_ps,
            "until_ps": fault.until_ps,
            "activated": self.activated_ps is not None,
            "activated_ps": self.activated_ps,
            "changes": self.changes,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultOutcome:
    """What became of the faults of a run."""

    effects: tuple[FaultEffect, ...]
    noticed: tuple[str, ...]
    """By whom, or by what, more than in the run without faults; empty where nobody noticed."""
    off_counts: int
    """Counts of the controller less those of the encoder itself and of the completed steps."""
    good_without: bool
    """Whether the run is good without the faults."""
    sound_without: bool
    """Whether every count is right without the faults, whatever is left over."""

    @property
    def activated(self) -> bool:
        """Return whether each fault took effect."""
        return all(effect.activated_ps is not None for effect in self.effects)

    @property
    def word(self) -> str:
        """Return the class of the outcome.

        Examples
        --------
        >>> FaultOutcome(effects=(), noticed=(), off_counts=-4, good_without=True, sound_without=True).word
        'silent corruption'
        """
        if not self.activated:
            return NOT_ACTIVATED
        if self.noticed:
            return DETECTED
        return SILENT if self.off_counts else MASKED

    def to_dict(self) -> dict[str, object]:
        """Return it under the names that scripts rely on."""
        return {
            "faults": [effect.to_dict() for effect in self.effects],
            "outcome": self.word,
            "off_counts": self.off_counts,
            "noticed": list(self.noticed),
            "good_without_faults": self.good_without,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched:
    """What those who can notice a fault see at the end of a run."""

    illegal: int
    """Illegal transitions at the controller."""
    illegal_in: int
    """Changes of both lines at once that go into the box."""
    agrees: bool
    """Whether controller and box, which sees the lines behind the cable, agree about the counts."""
    pending: int
    """Steps still owed."""
    stopped: bool
    """Whether the controller has latched a servo fault."""

    def noticed(self, twin: Watched) -> tuple[str, ...]:
        """Return who noticed more than in the run without faults."""
        return tuple(
            who
            for who, more in (
                ("controller: illegal", self.illegal > twin.illegal),
                ("controller: servo fault", self.stopped and not twin.stopped),
                ("box: encoder fault", self.illegal_in > twin.illegal_in),
                ("audit: count mismatch", twin.agrees and not self.agrees),
                ("audit: corrections left over", abs(self.pending) > abs(twin.pending)),
            )
            if more
        )
