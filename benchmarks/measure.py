"""Measure every figure of docs/benchmarks.md in one run and print the page.

Example::

    python benchmarks/measure.py --quick
    python benchmarks/measure.py -o docs/benchmarks.md
    python benchmarks/measure.py --only verilator --only handshake
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import figures_bayes
import figures_c_source
import figures_check
import figures_command
import figures_contour
import figures_diagnosis
import figures_firmware
import figures_heat
import figures_house
import figures_link
import figures_live
import figures_lssvm
import figures_machine
import figures_narx
import figures_predictors
import figures_signal
import figures_train
from figures import Figure, Setting, on_cores
from page import page

GROUPS: dict[str, Callable[[Setting], Iterator[Figure]]] = {
    "open-path": figures_signal.open_path,
    "steps": figures_signal.steps,
    "verilator": figures_signal.verilator,
    "memory": figures_command.memory,
    "calibration": figures_machine.calibration,
    "run": figures_command.run,
    "diagnosis": figures_diagnosis.diagnosis,
    "scan": figures_diagnosis.scan,
    "train": figures_train.train,
    "predictors": figures_predictors.predictors,
    "narx": figures_narx.narx,
    "ls-svm": figures_lssvm.ls_svm,
    "bayes": figures_bayes.bayes,
    "train-command": figures_predictors.train_command,
    "handshake": figures_machine.handshake,
    "link": figures_link.link,
    "live": figures_live.live,
    "soak": figures_live.soak,
    "start-up": figures_command.start_up,
    "first-run": figures_command.first_run,
    "check": figures_check.check,
    "contour": figures_contour.contour,
    "heat": figures_heat.heat,
    "c-source": figures_c_source.c_source,
    "sigrok": figures_signal.receiver_and_sigrok,
    "vcd": figures_signal.vcd,
    "firmware": figures_firmware.firmware,
    "stages": figures_signal.stages,
    "house": figures_house.house,
}
"""What can be measured, in the order of the page."""


def measure(names: list[str], setting: Setting) -> dict[str, list[Figure]]:
    """Measure groups of figures on one core and say on stderr how far it is."""
    measured: dict[str, list[Figure]] = {}
    with on_cores({setting.core}):
        for name in names:
            measured[name] = []
            for figure in GROUPS[name](setting):
                sys.stderr.write(f"{figure.verdict:9} {figure.what}: {figure.measured}\n")
                measured[name].append(figure)
    return measured


def main() -> int:
    """Measure what is asked for and write the page."""
    parser = argparse.ArgumentParser(description="Measure the figures of docs/benchmarks.md.")
    parser.add_argument("--quick", action="store_true", help="shorter runs, without the hour and the first rtec run")
    parser.add_argument("--only", action="append", choices=list(GROUPS), help="one group; may be given several times")
    parser.add_argument("--core", type=int, default=_cores()[-1], help="the core to measure on")
    parser.add_argument("-o", "--output", type=Path, help="file to write the page to, instead of stdout")
    given = parser.parse_args()
    others = [core for core in _cores() if core != given.core]
    setting = Setting(core=given.core, second_core=(others or [given.core])[-1], quick=given.quick)
    busy = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    before = given.output.read_text() if given.only and given.output and given.output.exists() else ""
    text = page(measure(given.only or list(GROUPS), setting), setting, busy, before)
    if given.output is None:
        sys.stdout.write(text)
    else:
        given.output.write_text(text)
    return 0


def _cores() -> list[int]:
    return sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]


ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

if __name__ == "__main__":
    # on one core two threads of a matrix product only wait for each other, a peer's as ours; numpy, which is loaded
    # by now, reads this when it starts
    if any(name not in os.environ for name in ONE_THREAD):
        os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
        os.execv(sys.executable, [sys.executable, *sys.argv])  # noqa: S606 - this very command
    sys.exit(main())
