"""One thread for each small matrix: several would wait for each other, above all where two test runs share a machine.

Set before anything loads numpy, which reads it once.
"""

import os

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
