"""Plant faults in the program, one at a time, and see which of them the tests find.

::

    python -m tools.planted
    python -m tools.planted --room windows --only 3 --only 4
    python -m tools.planted --tests HEAD~5

The program is that of the working tree. ``--tests REVISION`` takes the tests of an earlier commit: after tests were
cut, as many faults have to be found as before. A fault that no test finds is a test to write.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]
PROGRAM = ("rtec", "firmware_model", "docs", "README.md", "CHANGELOG.md", "CONTRIBUTING.md")
OF_THE_TESTS = ("tests", "benchmarks", "tools", "pyproject.toml")
LONGEST_S = 1800.0
NOTHING_COLLECTED = 5
"""Exit code of pytest."""
LAST = ("diagnose", "games", "judgement", "probes", "search", "fuzz", "stateful")
"""Words of the test files that take longest: they run last."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One replacement in one file of the program."""

    file: str
    old: str
    new: str
    wrong: str
    """What is wrong then."""


@dataclass(frozen=True, slots=True)
class Room:
    """Faults of one part of the program, and the tests that have to find them."""

    tests: tuple[str, ...]
    """Files and folders. Files named after the module that holds the fault come first."""
    compiled: bool
    """Whether the tests run compiled: plain kernels are quicker where each fault would compile them anew."""
    faults: tuple[Fault, ...]


_RECEIVER, _SIGNAL = "rtec/controller/_kernels.py", "rtec/signal/"
DECODER = (
    Fault(_RECEIVER, "return rx.reference_tick + tick + (1 if rest > 0 else 0)", "return rx.reference_tick + tick",
          "a change just after a tick of the filter's clock is seen by that tick"),
    Fault(_RECEIVER, "rx.reference_tick += seconds * rx.clock_hz", "rx.reference_tick += rx.clock_hz",
          "ticks are lost after a rest of two seconds and more"),
    Fault(_RECEIVER, "(rx.multiplication == X2 or after_ab & 2 == 0)", "(rx.multiplication == X2 or after_ab & 2)",
          "x1 counts while B is high"),
    Fault(_RECEIVER, "if n < LOG_LENGTH:", "if n < LOG_LENGTH - 1:", "the last place of the log stays empty"),
    Fault(_RECEIVER, "first = 1 if apart_ps > 0 else 2", "first = 1",
          "of two changes in one clock period A is always taken first"),
    Fault(_RECEIVER, "if ready_b < min(ready_a, tick):", "if ready_b < tick:",
          "a line B that settles after A is taken before it, and again"),
    Fault(_RECEIVER, "        rx.dipped_b_ps = rx.changed_b_ps", "        rx.dipped_b_ps = rx.changed_a_ps",
          "a dip of B is dated by A"),
    Fault(_RECEIVER, "and t_ps - rx.last_ps > rx.sure_ps\n", "and t_ps - rx.last_ps > 0\n",
          "the quick way takes over a level before the filter has seen it often enough"),
    Fault(_SIGNAL + "stream.py", 'np.searchsorted(self.times_ps, moments, side="right")',
          'np.searchsorted(self.times_ps, moments, side="left")', "at the time of an edge the level is the old one"),
    Fault(_SIGNAL + "gray.py", "before[1:] = after[:-1]", "before[1:] = after[1:]", "no transition has a count"),
)  # fmt: skip

_BOX, _NODE, _TURN = (f"rtec/requester/_box_{name}kernels.py" for name in ("", "node_", "turn_"))
WINDOWS = (
    Fault(_BOX, "elif -b.window <= change <= b.window or", "elif -b.window <= change < b.window or",
          "a change of exactly the window is refused upwards"),
    Fault(_BOX, "if b.doubts > b.grace:", "if b.doubts >= b.grace:", "the box stops one reading too early"),
    Fault(_BOX, "    if change == 0:\n        b.doubts = 0\n", "    if change == 0:\n",
          "doubts add up over requests that were right in between"),
    Fault(_BOX, "    post(up, t_ps, count - b.zero, completed,", "    post(up, t_ps, count, completed,",
          "the position is not that from home"),
    Fault(_NODE, "if t_ps - n.judged_ps < n.gap_ps:", "if t_ps - n.judged_ps < 0:",
          "requests that follow too soon are accepted, a window each"),
    Fault(_NODE, "elif n.resets_requested == 1 and order == IN_ORDER:", "elif order == IN_ORDER:",
          "a single frame with Reset restarts the box"),
    Fault(_NODE, "if flags & box.GO_HOME or not flags & frame.ENABLE:", "if flags & box.GO_HOME:",
          "a request that is not enabled keeps the watchdog quiet"),
    Fault(_NODE, "if running and field(payload, *frame.REQUEST_REQUESTER) != n.requester:",
          "if n.requester < 0:", "another PC may request totals"),
    Fault(_TURN, "if t_ps - n.heard_ps > n.watchdog_ps:", "if t_ps - n.heard_ps > 2 * n.watchdog_ps:",
          "the box waits twice as long for a silent PC"),
    Fault(_TURN, "word = (n.word_kept & ~0xFF) | (right & 0xFF)", "word = right",
          "the fault of a torn position word does nothing"),
)  # fmt: skip

_PC, _PC_NODE, _PC_TURN = (f"rtec/requester/_pc_{name}kernels.py" for name in ("", "node_", "turn_"))
PC_SIDE = (
    Fault(_PC, "elif back * p.count_mm > p.reversal_mm:", "elif back > 0:",
          "the direction turns without its hysteresis"),
    Fault(_PC, "if abs(wanted - p.target) > 0.5 + p.margin_steps:", "if abs(wanted - p.target) > 0.5:",
          "the total is rounded without its hysteresis"),
    Fault(_PC, "p.sent = min(max(goal, p.accepted - p.window), p.accepted + p.window)", "p.sent = goal",
          "the request leaves the window"),
    Fault(_PC, "sampled = p.accepted == p.sent and p.status == box.OK", "sampled = p.status == box.OK",
          "the request goes on before the box has sampled the last one"),
    Fault(_PC, "/ ((read_ps - p.read_ps) / PS_PER_S)", "/ ((t_ps - p.read_ps) / PS_PER_S)",
          "the velocity is that since the last turn, not between two readings"),
    Fault(_PC_TURN, "oldest_ps = min(min(n.status_ps, n.corrections_ps), n.position_ps)",
          "oldest_ps = max(max(n.status_ps, n.corrections_ps), n.position_ps)",
          "one kind of frames is enough to keep the watchdog quiet"),
    Fault(_PC_TURN, "if behind_ps > n.watchdog_ps + 2 * p.period_ps:", "if behind_ps < 0:",
          "a bus that delays all frames is not noticed"),
    Fault(_PC_TURN, "if abs(deviation_mm) / p.step_mm > p.word_limit + 0.5 + p.margin_steps:",
          "if abs(deviation_mm) < 0.0:", "a total beyond the request's word is cut off silently"),
    Fault(_PC_NODE, "if n.doubts > MOST_DOUBTS:", "if n.doubts > MOST_DOUBTS + 1:",
          "one implausible position more is tolerated"),
    Fault(_PC_NODE, "n.accepted != p.sent and n.accepted != p.accepted and n.accepted != n.last_total",
          "n.accepted != p.sent and n.accepted != p.accepted and n.accepted < n.last_total",
          "a total above what was requested is believed"),
)  # fmt: skip

_INFERENCE, _EFFECTS = "rtec/inference/", "rtec/effects/"
DIAGNOSIS = (
    Fault(_INFERENCE + "noise.py", "dof = float(max(int(member.sum()) - count.size, 1))",
          "dof = float(max(int(member.sum()), 1))", "the noise floor forgets that the means were fitted"),
    Fault(_INFERENCE + "noise.py", "np.diff(values)[same] ** 2) / 2.0)", "np.diff(values)[same] ** 2))",
          "the noise from neighbouring repeats is too large by a root of two"),
    Fault(_INFERENCE + "chessboard.py", "inner = gram - part @ part.T + np.diag(precision)",
          "inner = gram + np.diag(precision)", "the fold that is held out takes part in the fit"),
    Fault(_INFERENCE + "outliers.py", "if found.sum() <= max(1.0, MOST * away.size) else", "if True else",
          "heavy tails are left out as outliers"),
    Fault(_INFERENCE + "evidence.py", "return mean, left / max(sums.readings, 1)", "return mean, left",
          "the variance of the noise is its sum of squares"),
    Fault(_INFERENCE + "changes.py", "np.arange(len(p), 0, -1)", "len(p)",
          "all p values are multiplied by their number (Bonferroni, not Holm)"),
    Fault(_INFERENCE + "fit.py", "variance = float(left @ left) / max(observed.size - numbers.size, 1)",
          "variance = float(left @ left) / max(observed.size, 1)", "standard errors forget what was fitted"),
    Fault(_EFFECTS + "windup.py", "missing = np.array([2.0 if", "missing = np.array([1.0 if",
          "a wind-up that is carried over starts from nothing"),
    Fault(_EFFECTS + "conditions.py", "(direction[1:] != direction[:-1]) | (run[1:] != run[:-1])",
          "direction[1:] != direction[:-1]", "the way since a reversal goes on over the end of a run"),
    Fault(_EFFECTS + "servo_lag.py", "return -self._needed(", "return self._needed(",
          "the axis leads instead of following late"),
)  # fmt: skip

_HANDSHAKE = (
    "tests/unit/requester", "tests/property/test_requester_handshake.py", "tests/property/test_nodes_stateful.py",
    "tests/property/test_nodes_fuzz.py",
)  # fmt: skip
ROOMS = {
    "decoder": Room(
        tests=(
            "tests/unit/controller", "tests/unit/signal", "tests/property/test_signal_properties.py",
            "tests/differential/test_signal_path_receiver.py",
        ),
        compiled=False,
        faults=DECODER,
    ),
    "windows": Room(tests=_HANDSHAKE, compiled=False, faults=WINDOWS),
    "pc": Room(tests=_HANDSHAKE, compiled=False, faults=PC_SIDE),
    "inference": Room(
        tests=("tests/unit/inference", "tests/unit/effects", "tests/property/test_inference_properties.py"),
        compiled=True,
        faults=DIAGNOSIS,
    ),
}  # fmt: skip


def tree_of(folder: Path, revision: str | None) -> None:
    """Copy the program of the working tree into a folder, and its tests or those of a revision."""
    for name in PROGRAM + (OF_THE_TESTS if revision is None else ()):
        copy = shutil.copytree if (HERE / name).is_dir() else shutil.copy
        copy(HERE / name, folder / name)
    if revision is not None:
        words = ["git", "-C", str(HERE), "archive", "--format=tar", revision, "--", *OF_THE_TESTS]
        packed = subprocess.run(words, check=True, stdout=subprocess.PIPE).stdout
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            archive.extractall(folder, filter="data")


def selections(folder: Path, room: Room, module: str) -> list[list[str]]:
    """Return what to run one after the other, long files last in each.

    The examples of a module with the test files of its name, those in the folder of its name, all others.
    """
    places = [folder / name for name in room.tests]
    files = [file for place in places for file in (sorted(place.rglob("test_*.py")) if place.is_dir() else [place])]
    words = [word for word in re.split(r"[_\W]+", Path(module).stem) if word not in ("", "kernels")]
    stages: list[list[str]] = [[module] if module else [], [], []]
    for file in sorted(files, key=lambda file: any(word in file.stem for word in LAST)):
        named = any(word in file.stem for word in words)
        stage = 0 if named else 1 if file.parent.name == Path(module).parent.name else 2
        stages[stage].append(file.relative_to(folder).as_posix())
    return [stage for stage in stages if stage]


def tried(folder: Path, room: Room, module: str) -> str | None:
    """Run the tests of a room in a folder; return the first that fails, or None where all pass."""
    env = os.environ | {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    if not room.compiled:
        env["NUMBA_DISABLE_JIT"] = "1"
    words = [sys.executable, "-m", "pytest", "-x", "-n0", "-q", "-p", "no:cacheprovider", "--hypothesis-seed=0"]
    for files in selections(folder, room, module):
        try:
            done = subprocess.run(
                words + files, cwd=folder, env=env, capture_output=True, text=True, timeout=LONGEST_S, check=False
            )
        except subprocess.TimeoutExpired:
            return f"no end within {LONGEST_S:g} s"
        if done.returncode not in (0, NOTHING_COLLECTED):
            first = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
            return first[1] if first else (done.stdout + done.stderr)[-300:]
    return None


def found_by(folder: Path, room: Room, fault: Fault) -> str | None:
    """Plant a fault, run the tests, take it out again; return the test that found it."""
    path = folder / fault.file
    text = path.read_text(encoding="utf-8")
    if text.count(fault.old) != 1:
        sys.exit(f"{fault.file} holds {text.count(fault.old)} times, not once: {fault.old}")
    path.write_text(text.replace(fault.old, fault.new), encoding="utf-8")
    try:
        return tried(folder, room, fault.file)
    finally:
        path.write_text(text, encoding="utf-8")


def main() -> int:
    """Print each fault with the test that found it."""
    parser = argparse.ArgumentParser(description="Plant faults and see which of them the tests find.")
    parser.add_argument("--room", choices=ROOMS, action="append", help="only this part of the program")
    parser.add_argument("--unchecked", action="store_true", help="do not run the tests without a fault first")
    parser.add_argument("--only", type=int, metavar="N", action="append", help="only the N-th fault of a room")
    parser.add_argument("--tests", metavar="REVISION", help="tests of this commit instead of the working tree's")
    given = parser.parse_args()
    found = planted = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tree_of(folder, given.tests)
        for room_name in given.room or ROOMS:
            room = ROOMS[room_name]
            if not given.unchecked and (failing := tried(folder, room, "")):
                sys.exit(f"{room_name}: the tests fail without any fault, in {failing}")
            for number, fault in enumerate(room.faults, 1):
                if given.only and number not in given.only:
                    continue
                begun = time.perf_counter()
                by = found_by(folder, room, fault)
                found, planted = found + (by is not None), planted + 1
                sys.stdout.write(
                    f"{room_name} {number}: {fault.wrong} ({fault.file})\n"
                    f"    {by or 'NOT FOUND'}, {time.perf_counter() - begun:.0f} s\n"
                )
                sys.stdout.flush()
    sys.stdout.write(f"{found} of {planted} found\n")
    return 0 if found == planted else 1


if __name__ == "__main__":
    sys.exit(main())
