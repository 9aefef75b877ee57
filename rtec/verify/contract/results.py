"""What the suite gives back: each check, how far the algorithm goes, the worst case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rtec.readable import time_text
from rtec.verify.contract.contract import STATES, Contract
from rtec.verify.contract.endurance import KINDS, Endured
from rtec.verify.contract.speeds import Speeds
from rtec.verify.contract.trials import Margin, Run


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One point of the contract."""

    name: str
    """The point, in one or two words."""
    passed: bool | None
    """None where it could not be tried."""
    reason: str
    """What was tried, or what is wrong and when."""
    run: Run | None = None
    """The run that is wrong, or None."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """All checks of an algorithm, and what was measured."""

    algorithm: str
    """Its name."""
    contract: Contract
    """What was asked of it."""
    checks: tuple[Check, ...]
    """Every point, in the order in which they were tried."""
    speeds: Speeds | None
    """How far it goes; None where it does not insert."""
    worst: Run | None
    """The shortest run found that breaks the contract; where none does, the one with the smallest separation."""
    margin: Margin
    """The narrowest that was right."""
    endured: Mapping[str, Endured]
    """How deep the checks of endurance went, by their names."""
    settle_ps: int
    """Within so long a step at rest is completed, with reserve."""
    runs: int
    """How many were made."""
    seed: int
    """Of the hunt."""

    @property
    def passed(self) -> bool:
        """Return whether every point was tried and holds."""
        return all(check.passed is True for check in self.checks)

    def data_sheet(self) -> list[tuple[str, str]]:
        """Return what was measured as rows of a data sheet: name and value."""
        contract, margin, speeds = self.contract, self.margin, self.speeds
        rows = [
            ("step", f"{contract.step_counts} counts"),
            ("inserts at rest in", ", ".join(STATES[state] for state in contract.states)),
        ]
        if speeds is not None:
            rows += speeds.data_sheet()
        for kind in KINDS:
            if (found := self.endured.get(kind.name)) is not None:
                rows.append((kind.name, found.text(kind)))
        if margin.separation_ps is not None:
            least = time_text(contract.separation_ps)
            rows.append(("from A to B at the controller", f"{time_text(margin.separation_ps)} ({least} at least)"))
        if margin.pulse_ps is not None:
            rows.append(("shortest pulse there", time_text(margin.pulse_ps)))
        rows.append(("longest delay", f"{time_text(margin.delay_ps)} ({time_text(contract.delay_ps)} at most)"))
        return rows

    def to_dict(self) -> dict[str, Any]:
        """Return the verdict as plain data under the names that scripts rely on."""
        speeds, margin, worst = self.speeds, self.margin, self.worst
        violation = None if worst is None else worst.judgement.violation
        return {
            "algorithm": self.algorithm,
            "passed": self.passed,
            "checks": [
                {
                    "name": check.name,
                    "passed": check.passed,
                    "reason": check.reason,
                    "stream": None if check.run is None else str(check.run.case.stream),
                }
                for check in self.checks
            ],
            "max_inserting_hz": None if speeds is None else speeds.frequencies.max_inserting_hz,
            "max_passing_hz": None if speeds is None else speeds.frequencies.max_passing_hz,
            "frequencies": []
            if speeds is None
            else [{"frequency_hz": hertz, "does": what.value} for hertz, what in speeds.frequencies.rows],
            "max_jitter": None if speeds is None else speeds.max_jitter,
            "max_jitter_ps": None if speeds is None else speeds.max_jitter_ps,
            "max_acceleration_hz_s": None if speeds is None else speeds.max_acceleration_hz_s,
            "endurance": {
                kind.key: self.endured[kind.name].depth if kind.name in self.endured else None for kind in KINDS
            },
            "min_separation_ps": margin.separation_ps,
            "min_pulse_ps": margin.pulse_ps,
            "max_delay_ps": margin.delay_ps,
            "data_sheet": dict(self.data_sheet()),
            "worst_stream": None if worst is None else str(worst.case.stream),
            "worst_reason": None if violation is None else str(violation),
            "runs": self.runs,
            "seed": self.seed,
        }
