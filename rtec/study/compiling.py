"""At a first run, what a study needs beside the closed loop is compiled by a process of its own, on another core."""

from __future__ import annotations

import atexit
import subprocess
import sys

import numpy as np

from rtec._jit import is_compiled
from rtec.dataset.load import load_dataset
from rtec.inference.diagnose import diagnose
from rtec.injector import Design
from rtec.jobs import cores
from rtec.machine.closed_loop import compile_end
from rtec.metrology import Readings
from rtec.study.definition import builtin_study
from rtec.study.figures import waveform
from rtec.study.learning import calibration_measurement


def compile_beside() -> None:
    """Begin to compile what a study needs once its first run of the closed loop is over."""
    if cores() == 1 or is_compiled("rtec.machine._loop_kernels"):
        return
    script = f"from {__name__} import compile_rest; compile_rest()"
    silent = subprocess.DEVNULL  # what goes wrong in it goes wrong in the study, too, and is said there
    words = [sys.executable, "-P", "-c", script]  # -P: what lies in the user's folder is not for import
    process = subprocess.Popen(words, stdin=silent, stdout=silent, stderr=silent)  # noqa: S603 - words of ours

    def end() -> None:
        process.terminate()
        process.wait()

    atexit.register(end)


def compile_rest() -> None:
    """Search a small calibration, end a run, and draw an insertion: the kernels of all three are compiled by it."""
    compile_end()
    study = builtin_study()
    waveform(study, Design.C)
    target_mm = np.tile(np.linspace(0.0, 50.0, 11), 4)
    direction = np.repeat([1, -1, 1, -1], 11)
    deviation_mm = 0.002 * direction + np.random.default_rng(0).normal(0.0, 0.001, target_mm.size)
    readings = Readings(
        target_mm=target_mm, deviation_mm=deviation_mm, direction=direction, run=np.repeat([0, 0, 1, 1], 11)
    )
    diagnose(load_dataset(calibration_measurement(readings, study.period_mm)))
