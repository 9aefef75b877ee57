"""The same tests without the compiler, and compiled with every index checked.

numba and Python differ in overflow, division and indexing; a kernel that passes both ways means the same in both.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
UNIT = "tests/unit/"
BOTH = [
    "tests/differential/test_signal_path_injector.py",
    "tests/differential/test_signal_path_receiver.py",
    UNIT + "requester/test_requester_dialogue.py",
    UNIT + "axis/test_axis_encoder.py",
    *(UNIT + f"link/test_{name}_kernels.py" for name in ("crc", "frame", "bus")),
]
ONCE = {"X1": "GUESS", "X2": "IGNORE", "X4": "FAULT"}
"""Each multiplication with one of the policies, where both are tried with each other compiled."""
LONG = [
    "drift", "cruise", "gives_the_edges", "triangular", "as_often", "chunks", "crowds", "three_axes",
    *(f"{by}-IllegalPolicy.{policy}" for by in ONCE for policy in ONCE.values() if policy != ONCE[by]),
]  # fmt: skip
MODES = {
    # the long ones are left out; draws of random bits wrap on purpose, of which numpy warns uncompiled
    "NUMBA_DISABLE_JIT": [
        *BOTH,
        "-W", "ignore:overflow encountered:RuntimeWarning",
        "-k", " and ".join(f"not {word}" for word in LONG),
    ],
    "NUMBA_BOUNDSCHECK": BOTH,
}  # fmt: skip


# indices are checked in Python, too; compiling everything anew for the other takes longer than all of its tests
@pytest.mark.parametrize("mode", ["NUMBA_DISABLE_JIT", pytest.param("NUMBA_BOUNDSCHECK", marks=pytest.mark.sweep)])
def test_kernels_pass_in_this_mode(mode, tmp_path):
    # the cache of machine code does not tell the modes apart
    environment = {**os.environ, mode: "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", *MODES[mode]]
    result = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert result.returncode == 0, result.stdout[-3000:] + result.stderr[-1000:]
    assert int(result.stdout.split(" passed")[0].split()[-1]) > 100
