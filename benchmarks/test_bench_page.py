"""The script behind docs/benchmarks.md, started as the page says: without pytest's paths."""

import subprocess
import sys
from pathlib import Path

from figures_house import KINDS, kinds_of

HERE = Path(__file__).parent


def test_it_starts_without_the_paths_of_the_tests():
    done = subprocess.run(
        [sys.executable, HERE / "measure.py", "--help"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_every_line_of_a_module_is_of_one_kind():
    source = '"""Title.\n\nMore.\n"""\n# why\n\nx = """\ntext\n"""\n'
    assert dict(kinds_of(source)) == dict(zip(KINDS, (3, 4, 1, 1), strict=True))
