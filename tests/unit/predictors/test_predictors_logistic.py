"""The logistic function of machine code: against forty digits, at its ends, and the same without a compiler."""

import decimal
import os
import subprocess
import sys

import numpy as np
import pytest

from rtec.predictors._logistic_kernels import logistic

PLACES = [0.0, 1e-300, 1e-17, 0.1, 0.34657, 0.34658, 1.0, 2.5, 19.0, 36.7, 37.0, 100.0, 354.9, 699.9]


def exact(x):
    with decimal.localcontext() as context:
        context.prec = 40
        return float(1 / (1 + (-decimal.Decimal(x)).exp()))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_within_four_units_in_the_last_place(sign):
    places = [*PLACES, *np.random.default_rng(1).normal(0.0, 20.0, 2000)]
    for x in places:
        expected = exact(sign * x)
        assert abs(logistic(sign * x) - expected) <= 4.0 * np.spacing(expected), x


def test_far_away_it_is_0_or_1_and_what_is_no_number_stays_none():
    assert logistic(np.inf) == logistic(1e300) == logistic(701.0) == 1.0
    assert 0.0 < logistic(-np.inf) == logistic(-1e300) == logistic(-701.0) < 1e-303
    assert np.isnan(logistic(np.nan))


def test_without_a_compiler_it_says_the_same():
    places = [sign * x for x in PLACES for sign in (1.0, -1.0)]
    program = (
        "from rtec.predictors._logistic_kernels import logistic\n"
        f"print(*(logistic(x).hex() for x in {[*places, 1e300, -1e300]}), logistic(float('nan')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    *near, high, low, nan = done.stdout.split()
    assert (float.fromhex(high), nan) == (1.0, "nan")
    assert 0.0 < float.fromhex(low) < 1e-303
    for x, found in zip(places, map(float.fromhex, near), strict=True):
        assert abs(found - exact(x)) <= 4.0 * np.spacing(exact(x)), x
