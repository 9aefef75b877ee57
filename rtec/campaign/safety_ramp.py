"""A PC that goes wrong within every window: what only a limit of the plausible can catch."""

from __future__ import annotations

from dataclasses import dataclass

from rtec.campaign.safety_matrix import Outcome, is_wrong, reason_of
from rtec.campaign.safety_monitor import sinusoidal_table
from rtec.campaign.safety_phases import END_PS, Phase, new_cell
from rtec.injector import Design
from rtec.requester.supervision import SupervisionLimits
from rtec.units import PS_PER_MS, PS_PER_S

LIMIT_MM = 0.050
"""The healthy table stays within 30 um."""
_FROM_PS = 1_500 * PS_PER_MS
_EVERY_PS = 50 * PS_PER_MS
_RAMP_MM_S = 0.060
_STEPS = 60
_AFTER_STOP_PS = 400 * PS_PER_MS


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """What came of a PC whose prediction runs away by 60 um a second, for three seconds.

    Parameters
    ----------
    design, limit
        Of the box; which option was set, in words.
    outcome, reason
        What happened, and who stopped the machine.
    off_mm
        By how much the axis was off when the machine stopped, or is in the end.
    """

    design: Design
    limit: str
    outcome: Outcome
    reason: str
    off_mm: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RampJob:
    """A PC that runs away, and what is set against it."""

    design: Design
    limit: str
    supervision: SupervisionLimits

    def run(self) -> Ramp:
        """Let it run away."""
        cell = new_cell(Phase.CUTTING, self.design, 0, supervision=self.supervision)
        cell.monitor(until_ps=_FROM_PS)
        for k in range(1, _STEPS + 1):
            cell.predict_by(sinusoidal_table(offset_mm=k * _RAMP_MM_S * _EVERY_PS / PS_PER_S))
            cell.monitor(until_ps=_FROM_PS + k * _EVERY_PS, stop_after_ps=_AFTER_STOP_PS)
        cell.monitor(until_ps=END_PS, stop_after_ps=_AFTER_STOP_PS)
        axes = cell.monitored
        stops = [axis for axis in axes if axis.stop_ps is not None]
        if stops:
            outcome, off_counts = Outcome.SAFE_STOP, max(abs(axis.stop_counts) for axis in axes)
            reason = reason_of(axes, min(stops, key=lambda axis: axis.stop_ps or 0))
        else:
            wrong = any(is_wrong(axis, axis) for axis in axes)
            outcome, reason = Outcome.UNDETECTED if wrong else Outcome.TOLERATED, ""
            off_counts = max(abs(axis.asked_counts) for axis in axes)
        return Ramp(design=self.design, limit=self.limit, outcome=outcome, reason=reason, off_mm=off_counts * 0.001)


def ramp_jobs(design: Design) -> tuple[RampJob, ...]:
    """Return a PC that runs away without a limit, with the box's, and with its own."""
    steps = round(LIMIT_MM / (0.001 * design.step_counts))
    limits = {
        "none": SupervisionLimits(),
        f"limit_steps = {steps}": SupervisionLimits(limit_steps=steps),
        f"limit_mm = {LIMIT_MM}": SupervisionLimits(limit_mm=LIMIT_MM),
    }
    return tuple(RampJob(design=design, limit=limit, supervision=set_) for limit, set_ in limits.items())
