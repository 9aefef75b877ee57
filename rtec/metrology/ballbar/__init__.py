"""The circle test after ISO 230-4: its figures, and the errors of a machine that the shape of the circle shows."""

from rtec.metrology.ballbar.analysis import Found, FoundError, analysed
from rtec.metrology.ballbar.circle_test import CircleTest, circle_test
from rtec.metrology.ballbar.circularity import Circularity, circularity

__all__ = ["CircleTest", "Circularity", "Found", "FoundError", "analysed", "circle_test", "circularity"]
