"""What is said of the plan for the next hour at the machine: a sentence, a document, and three files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from rtec.effects import Units
from rtec.inference.next_plan import ENOUGH, NextPlan
from rtec.io import strict, write_lines
from rtec.metrology import ExperimentPlan, Passes, Spacing, Strokes, write_experiment
from rtec.metrology.plan_program import plan_csv, plan_program
from rtec.readable import quantity_text
from rtec.report.appearance import joined
from rtec.report.diagnosis.sentence import spoken

_MOST_SAID = 6


def next_plan_sentence(found: NextPlan, units: Units) -> str:
    """Return what to do and what it will show, in sentences."""
    plan = found.plan
    parts = [f"The next {quantity_text(plan.duration_s / 60.0, 'min', digits=2)}: {_what(plan)}."]
    if plan.dwell_s < found.repeated.dwell_s and not plan.in_motion:
        parts.append(
            f"The rests of {plan.dwell_s:.3g} s are shorter than the {found.repeated.dwell_s:.3g} s of before: see "
            "that repeated readings stay as close together."
        )
    told = [f"{spoken(one)} from {spoken(other)}" for one, other, nats in found.apart if nats >= ENOUGH]
    if told:
        parts.append(f"It will tell {joined(told)}.")
    open_ties = [f"{spoken(one)} from {spoken(other)}" for one, other, nats in found.apart if nats < ENOUGH]
    if open_ties:
        parts.append(f"No plan of this length will tell {joined(open_ties)}.")
    known = [one for one in found.sharper if math.isfinite(one.planned)]
    errors = [
        f"{spoken(one.effect)}{'' if one.parameter == one.effect else f' ({spoken(one.parameter)})'} "
        f"{quantity_text(one.planned, one.unit, digits=2)}{_instead(one.repeated, one.unit)}"
        for one in known[:_MOST_SAID]
    ]
    if errors:
        more = f" and {len(known) - _MOST_SAID} more" if len(known) > _MOST_SAID else ""
        parts.append(f"Standard errors then: {', '.join(errors)}{more}.")
    unit, factor = units.shown
    least = sorted((value, name) for name, value in found.detectable if math.isfinite(value))
    if least:
        value, name = least[len(least) // 2]
        parts.append(
            f"An effect such as {spoken(name)} shows from {quantity_text(value * factor, unit, digits=2)} RMS on."
        )
    return " ".join(parts)


def _what(plan: ExperimentPlan) -> str:
    unit = "deg" if plan.rotary else "mm"
    feeds = joined(f"{feed:.3g}" for feed in plan.feeds_mm_s)
    ways = "in both directions" if plan.passes is Passes.BOTH else "forward"
    span = f"from {plan.start_mm:.6g} to {plan.end_mm:.6g} {unit}"
    runs = f"{plan.runs} run{'s' if plan.runs > 1 else ''}"
    if plan.in_motion:
        how = "end to end" if plan.strokes is Strokes.FULL else f"{plan.targets} short strokes"
        return f"{runs} of {how} {span}, {ways}, at {feeds} {unit}/s in turn"
    lie = ", closer together at the ends" if plan.spacing is Spacing.DENSE_AT_ENDS else ""
    heat = "" if plan.heating.value == "steady" else f", {plan.heating.value}"
    return f"{runs} over {plan.targets} targets {span}{lie}, {ways}, at {feeds} {unit}/s{heat}"


def _instead(repeated: float, unit: str) -> str:
    if not math.isfinite(repeated):
        return ""
    return f" ({quantity_text(repeated, unit, digits=2)} by repeating what was measured)"


def next_plan_document(found: NextPlan, units: Units, files: dict[str, str]) -> dict[str, Any]:
    """Return the plan as plain data: what stands under ``plan`` with ``--next``."""
    plan, factor = found.plan, units.shown[1]
    document = {
        "text": next_plan_sentence(found, units),
        "duration_s": plan.duration_s,
        "readings": plan.readings,
        "runs": plan.runs,
        "targets": plan.targets,
        "start": plan.start_mm,
        "end": plan.end_mm,
        "feeds": list(plan.feeds_mm_s),
        "dwell_s": plan.dwell_s,
        "columns": list(plan.columns),
        "told_apart": [{"effects": [a, b], "nats": nats} for a, b, nats in found.apart],
        "standard_errors": [
            {
                "effect": s.effect,
                "parameter": s.parameter,
                "unit": s.unit,
                "planned": s.planned,
                "repeated": s.repeated,
            }
            for s in found.sharper
        ],
        "minimum_detectable": {name: value * factor for name, value in found.detectable},
        "files": files,
    }
    cleaned: dict[str, Any] = strict(document)
    return cleaned


def write_next_plan(path: Path, found: NextPlan, units: Units) -> dict[str, str]:
    """Write the plan as TOML to ``path``, and beside it as CSV and as G-code; return the files by kind.

    Raises
    ------
    OutputError
        A file cannot be written.
    """
    files = {"plan": path, "csv": path.with_suffix(".csv"), "gcode": path.with_suffix(".nc")}
    write_experiment(path, found.plan, next_plan_sentence(found, units))
    write_lines(files["csv"], plan_csv(found.plan))
    write_lines(files["gcode"], plan_program(found.plan))
    return {kind: str(file) for kind, file in files.items()}
