"""The search for a limit, on functions whose limit is known."""

import pytest

from rtec.verify.envelope.trials import largest_safe


@pytest.mark.parametrize("limit_hz", [1_500.0, 26_999.0, 430_000.0])
def test_the_limit_is_met_to_a_percent_from_below(limit_hz):
    found = largest_safe(lambda hz: "late" if hz > limit_hz else None, 1_000.0, 1e6)
    assert limit_hz / 1.01 <= found.safe <= limit_hz
    assert found.failure == "late"


def test_a_safe_island_above_the_first_failure_does_not_count():
    # 2 to 3 kHz fails, 3 to 10 kHz is safe again
    found = largest_safe(lambda hz: hz if 2_000 <= hz < 3_000 or hz > 10_000 else None, 1_000.0, 1e6)
    assert 1_980 <= found.safe < 2_000 <= found.failure < 2_020


def test_what_never_fails_and_what_always_fails():
    never = largest_safe(lambda hz: None, 1_000.0, 5_000.0)
    assert (never.safe, never.failure) == (5_000.0, None)
    always = largest_safe(lambda hz: "no", 1_000.0, 5_000.0)
    assert (always.safe, always.failure) == (0.0, "no")
