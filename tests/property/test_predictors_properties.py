"""Properties of every table and every position."""

import bisect

from hypothesis import given, settings, strategies as st

from rtec.predictors import FORWARD, REVERSE, BidirectionalTable, UnidirectionalTable

POSITIONS = st.lists(st.integers(-(10**6), 10**6), min_size=2, max_size=40, unique=True).map(
    lambda whole: [n / 1000 for n in sorted(whole)]
)
ERRORS = st.lists(st.integers(-1000, 1000).map(lambda n: n / 1000), min_size=40, max_size=40)
WHERE = st.floats(-2000, 2000)


def interpolated(positions: list[float], errors: list[float], x: float) -> float:
    """Return the error on the chord between the neighbours, held at the ends."""
    after = bisect.bisect_right(positions, x)
    if after == 0:
        return errors[0]
    if after == len(positions):
        return errors[-1]
    left, right = positions[after - 1], positions[after]
    slope = (errors[after] - errors[after - 1]) / (right - left)
    return errors[after - 1] + slope * (x - left)


@settings(deadline=None)  # the first call may wait for the compiler
@given(POSITIONS, ERRORS, ERRORS, WHERE)
def test_a_table_is_its_chords_and_stays_between_its_neighbours(positions, forward, reverse, x):
    n = len(positions)
    table = BidirectionalTable(
        forward_positions_mm=positions,
        forward_errors_mm=forward[:n],
        reverse_positions_mm=positions[::-1],
        reverse_errors_mm=reverse[:n][::-1],
    )
    for direction, errors in ((FORWARD, forward[:n]), (REVERSE, reverse[:n])):
        error = float(table.error_mm(x, direction))
        assert abs(error - interpolated(positions, errors, x)) < 1e-9
        assert min(errors) - 1e-15 <= error <= max(errors) + 1e-15
        assert table.error_mm(positions, direction).tolist() == errors


@settings(deadline=None)
@given(POSITIONS, ERRORS, st.integers(-500, 500), WHERE)
def test_backlash_is_the_same_everywhere(positions, errors, backlash, x):
    table = UnidirectionalTable(
        positions_mm=positions, errors_mm=errors[: len(positions)], backlash_mm=backlash / 1000
    )
    assert abs(float(table.error_mm(x, REVERSE) - table.error_mm(x, FORWARD)) - backlash / 1000) < 1e-12
