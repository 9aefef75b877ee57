"""What one table of a study alone cannot know: whether program, axis, laser and tables fit together."""

from __future__ import annotations

from rtec.axis import Limits
from rtec.io import Section
from rtec.machine import Laser
from rtec.metrology import MeasuringPlan
from rtec.predictors import Predictor

MAX_READINGS = 200_000
"""Of a measurement: sixteen times the thesis's calibration."""
MAX_CALIBRATION = 50_000
"""Four times the thesis's: the search for effects takes time in proportion."""
MAX_TABLE_POINTS = 1_000_000


def check_range(section: Section, plan: MeasuringPlan, what: str, predictor: Predictor) -> None:
    """Refuse targets outside a predictor's range; overshoots may lie outside, there it is held."""
    low, high = predictor.range_mm
    for key, end_mm in (("start", plan.start_mm), ("end", plan.end_mm)):
        if not low - 1e-8 <= end_mm <= high + 1e-8:
            raise section.refused(key, f"{low:g} to {high:g} mm", problem=f"is outside the range of {what}")


def check_feed(program: Section, plan: MeasuringPlan, limits: Limits) -> None:
    """Refuse a feed that the axis cannot reach."""
    if plan.feed_mm_s > limits.max_speed_mm_s * (1.0 + 1e-9):
        allowed = f"at most {limits.max_speed_mm_s:g} mm/s"
        raise program.refused("feed", allowed, problem="is faster than axis.max_speed")


def check_dwells(laser: Section, plan: MeasuringPlan, settings: Laser, whose: str) -> None:
    """Refuse a reading that takes longer than the axis stands in the plan of the table ``whose``."""
    if settings.dwell_s >= plan.dwell_s:
        raise laser.refused("dwell", f"less than {plan.dwell_s:g} s", problem=f"is not less than {whose}.dwell")


def check_calibration(section: Section, plan: MeasuringPlan) -> None:
    """Refuse a calibration that would take too long to be looked through."""
    _check_number(section, "increment", plan.number_of_readings, MAX_CALIBRATION, "readings")


def check_sizes(program: Section, controller: Section, plan: MeasuringPlan, table_interval_mm: float) -> None:
    """Refuse a measurement or a table that would fill the memory."""
    _check_number(program, "increment", plan.number_of_readings, MAX_READINGS, "readings")
    points = (plan.end_mm - plan.start_mm) / table_interval_mm
    _check_number(controller, "table_interval", points, MAX_TABLE_POINTS, "points")


def _check_number(section: Section, key: str, number: float, most: int, what: str) -> None:
    if number > most:
        raise section.refused(key, f"a longer one: at most {most} {what}", problem=f"makes {number:.0f} {what}")
