"""Rows of the envelope as jobs of a campaign."""

from __future__ import annotations

from rtec.board import MICROCONTROLLERS, Microcontroller
from rtec.injector import Design
from rtec.readable import hertz_text
from rtec.verify.campaign.job import FAILED, PASSED, Choice, JobKind, Number, Parameters, Record, Value
from rtec.verify.envelope.rows import EnvelopePlan, EnvelopeRow, find_envelope


def row(parameters: Parameters, seed: int, run: int) -> Record:
    """Find the envelope of one design on one processor: one row of ``rtec envelope``, with the same numbers.

    Parameters
    ----------
    parameters
        ``design``, ``processor``, ``hold_latch`` (yes or no), ``sweep`` (short or exhaustive): words; ``jitter_ps``.
    seed, run
        Nothing is random.
    """
    plan = EnvelopePlan(
        designs=[Design.named(str(parameters["design"]))],
        processors=[Microcontroller.named(str(parameters["processor"]))],
        hold_latch=parameters["hold_latch"] == "yes",
        jitter_ps=int(parameters["jitter_ps"] or 0),
        exhaustive=parameters["sweep"] == "exhaustive",
    )
    return row_record(find_envelope(plan)[0])


def row_record(found: EnvelopeRow) -> Record:
    """Return a row as numbers and words; it fails where nothing is safe, or a count is wrong above the gate."""
    plain: Record = {}
    for key, value in found.to_dict().items():
        if key in ("failing", "data_sheet") and isinstance(value, dict):
            plain |= {f"{key}: {name}": _plain(one) for name, one in value.items()}
        elif key == "frequencies" and isinstance(value, list):
            plain[key] = ", ".join(f"{one['frequency_hz']:g} Hz {one['does']}" for one in value)
        else:
            plain[key] = _plain(value)
    right = found.max_safe_hz > 0.0 and found.counts_right is not False
    outcome = f"safe to {hertz_text(found.max_safe_hz, 4)}, {found.limited_by.value}"
    return {"result": PASSED if right else FAILED, "outcome": outcome, **plain}


def _plain(value: object) -> Value:
    return value if value is None or isinstance(value, str | int | float) else str(value)


ENVELOPE = JobKind(
    does="The largest safe frequency of a design on a processor is found on the running firmware.",
    function=f"{__name__}:row",
    parameters=(
        Choice(name="design", words=tuple(design.value for design in Design)),
        Choice(name="processor", words=tuple(MICROCONTROLLERS)),
        Choice(name="hold_latch", words=("no", "yes"), default=("no",)),
        Choice(name="sweep", words=("short", "exhaustive"), default=("short",)),
        Number(name="jitter_ps", unit="ps", low=0.0, high=1e9, default=0.0, whole=True),
    ),
    by=("design", "processor", "hold_latch"),
)
