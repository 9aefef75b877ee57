"""What one table of a study alone cannot know: whether program, axis, laser and tables fit together."""

from __future__ import annotations

from rtec.axis import Limits
from rtec.errors import ArgumentError
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
            raise ArgumentError(section.where(key), f"{end_mm:g} mm", f"{low:g} to {high:g} mm, the range of {what}")


def check_feed(program: Section, plan: MeasuringPlan, limits: Limits) -> None:
    """Refuse a feed that the axis cannot reach."""
    if plan.feed_mm_s > limits.max_speed_mm_s * (1.0 + 1e-9):
        raise ArgumentError(
            program.where("feed"),
            f"{plan.feed_mm_s:g} mm/s",
            f"at most {limits.max_speed_mm_s:g} mm/s, axis.max_speed",
        )


def check_dwells(laser: Section, plan: MeasuringPlan, settings: Laser, whose: str) -> None:
    """Refuse a reading that takes longer than the axis stands in the plan of the table ``whose``."""
    if settings.dwell_s >= plan.dwell_s:
        raise ArgumentError(
            laser.where("dwell"), f"{settings.dwell_s:g} s", f"less than {plan.dwell_s:g} s, {whose}.dwell"
        )


def check_calibration(section: Section, plan: MeasuringPlan) -> None:
    """Refuse a calibration that would take too long to be looked through."""
    readings = plan.number_of_readings
    if readings > MAX_CALIBRATION:
        raise ArgumentError(
            section.where("increment"),
            f"{plan.increment_mm:g} mm",
            f"at most {MAX_CALIBRATION} readings, not {readings}",
        )


def check_sizes(program: Section, controller: Section, plan: MeasuringPlan, table_interval_mm: float) -> None:
    """Refuse a measurement or a table that would fill the memory."""
    travel_mm = plan.end_mm - plan.start_mm
    readings = 2 * plan.runs * (travel_mm / plan.increment_mm + 1)
    if readings > MAX_READINGS:
        raise ArgumentError(
            program.where("increment"),
            f"{plan.increment_mm:g} mm",
            f"at most {MAX_READINGS} readings, not {readings:.0f}",
        )
    points = travel_mm / table_interval_mm
    if points > MAX_TABLE_POINTS:
        raise ArgumentError(
            controller.where("table_interval"),
            f"{table_interval_mm:g} mm",
            f"at most {MAX_TABLE_POINTS} points, not {points:.0f}",
        )
