"""What holds for all tests: threads of numpy, which cases of a long table are tried, and in what order files run."""

import functools
import os
import signal
from collections import Counter
from pathlib import Path

import pytest

from tests.terminals import Terminal

# one thread for each small matrix: several would wait for each other, above all where two test runs share a machine;
# numpy reads it once
for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# a run that was started in the background ignores Ctrl-C, and so would all its children
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


HERE = Path(__file__).parent
LONG = (
    "unit/verify/firmware/test_firmware_check.py", "unit/verify/safety/test_safety.py", "recovery", "unit/machine",
    "unit/verify", "differential", "unit/cli", "unit/inference",
)  # fmt: skip
"""Files and folders that take longest begin, so that no worker is left alone with one in the end.

The first two need different kernels: where none is compiled yet, each worker compiles what the other does not.
"""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Leave every n-th case of a table marked ``one_in(n)`` to the default selection, the others to the sweep."""
    seen = Counter()
    for item in items:
        if mark := item.get_closest_marker("one_in"):
            name = item.nodeid.partition("[")[0]
            if seen[name] % mark.args[0]:
                item.add_marker(pytest.mark.sweep)
            seen[name] += 1
    items.sort(key=lambda item: _turn_of(item.path))


@functools.cache
def _turn_of(file):
    return next((k for k, name in enumerate(LONG) if file.is_relative_to(HERE / name)), len(LONG))


@pytest.fixture(scope="session", autouse=True)
def no_word_of_compiling():
    """Let no command say that it compiles first: whether it does depends on which tests have run before."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rtec.cli._console.LONG", {})
        yield


@pytest.fixture
def terminal(tmp_path):
    """Start programs of rtec, each in a terminal of its own."""
    opened = []

    def start(*words):
        opened.append(Terminal(tmp_path, *words))
        return opened[-1]

    yield start
    for each in opened:
        each.close()
