"""The page of the figures: the frame around the tables."""

from __future__ import annotations

import platform
import re
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from figures import Figure, Setting

JOB = "--frequency 500kHz --phase-error 10deg --jitter 5ns"

HEAD = f"""\
# Benchmarks

Written by `python benchmarks/measure.py -o docs/benchmarks.md`; with `--only NAME` one section is measured and
replaced, `--quick` gives a rough idea. rtec and its children run on one core, `rtec run` and `rtec diagnose` on
two. A figure is the best of several runs after one that does not count, with the median beside it; a peer gets the
same statistic. "Ratio" says how many times better than the bar a figure is; a bar in brackets is that of another
figure, for comparison. Results are checked before a time counts: every count, correction and exchange right, no
illegal transition. JOB in a command stands for `{JOB}`.
"""

SECTIONS = {
    "open-path": (
        "The open path",
        "Phase error 10°, jitter 5 ns, profile `fast`, a correction every 100 edges, filter of 60 ns, x4 decoder.\n",
    ),
    "steps": (
        "The same without the blocks",
        """\
Box and receiver take the edges one by one (`in_blocks=False`), which gives the same final state ([decision
3](decisions/0003-edge-blocks.md)).
""",
    ),
    "verilator": (
        "Compared with Verilator",
        """\
The peer is the RTL of design C and a decoder with the same filter in `benchmarks/peers`, on one clock of 50 MHz,
with the same stimulus, made before its time counts. `plain`: `verilator -O3 -CFLAGS -O3`; `tuned`: the model, too,
by `-O3` and across files; `profiled`: with a profile of a first run. Processor time.
""",
    ),
    "memory": ("Memory", "`rtec simulate` streams; most of the memory is that of Python, numpy and the compiler.\n"),
    "calibration": (
        "The closed loop",
        """\
Program, servo, axis, encoder, box, PC and controller, planning included; rest is skipped in the first row.
""",
    ),
    "run": ("The main job", ""),
    "diagnosis": (
        "The diagnosis",
        """\
`rtec diagnose` with the whole library, the process from start to end. The lathe's calibration is the thesis's (1561
targets, both directions, 1 µm of noise); it must find the reversal error along the axis and the wave of the screw.
""",
    ),
    "scan": (
        "The scan compared with refitting",
        """\
Which shape of which effect would lower the residual most, beside a constant and backlash. The peers fit model and
candidate together over the same grid; all three find the same largest fall. Processor time.
""",
    ),
    "train": (
        "Training networks",
        """\
Averages of four runs of the lathe's calibration. Processor time; an epoch of ours with all its steps beside an
iteration of scipy's `least_squares` (same residuals and Jacobian) or an epoch of scikit-learn's gradient descent.
What each reaches: [predictors](predictors.md#table-4-1-again).
""",
    ),
    "predictors": (
        "Predictors at work",
        "The calibration in closed loop, Design B, with each kind of predictor in the PC. Processor time.\n",
    ),
    "narx": (
        "NARX networks",
        """\
Processor time; an epoch of ours with all its steps beside an iteration of scipy's `least_squares` with the same
Jacobian. Free runs over data that neither trained nor chose: [predictors](predictors.md#models-of-motion).
""",
    ),
    "ls-svm": (
        "LS-SVM",
        """\
Processor time with one thread, by turns. `KernelRidge` of scikit-learn has no bias: its solutions for
the output and for ones are combined.
""",
    ),
    "bayes": (
        "Bayesian networks",
        """\
Learning from 1000 rows and exact inference with 10 rows of evidence beside pyAgrum, by turns, with the same answers.
Processor time; pyAgrum gets its rows as a data frame that is there already. It prepares all nodes at once, we each
node that is asked for, so that it is ahead where every node of a large network is asked.
""",
    ),
    "train-command": (
        "Training by `rtec train`",
        "On the calibration of `rtec run`: wall time, and the best row beside the physical model.\n",
    ),
    "handshake": (
        "PC and box",
        """\
An exchange: the PC reads valid words and asks for one step more or less; the box samples until the next one.
""",
    ),
    "link": (
        "Box and PC on the simulated bus",
        "An exchange: a request and the box's position, corrections and status, each packed, sent and checked.\n",
    ),
    "live": (
        "Box and PC as processes",
        """\
Slcan over a pseudo-terminal. The box's own time lasts from the arrival of a request to the frame that says it is
completed.
""",
    ),
    "soak": ("Hours under faults", "Those of the [safety case](safety.md), on two cores.\n"),
    "start-up": (
        "Start-up",
        "With cached machine code. A loop is 20 million additions in Python, timed beside it.\n",
    ),
    "first-run": (
        "The first run",
        "With an empty folder for machine code, on two cores, measured once, in the same loops.\n",
    ),
    "check": (
        "A verdict on an insertion algorithm",
        "The process from start to end, on two cores, the building of Verilog included.\n",
    ),
    "contour": (
        "Feed drives and toolpaths",
        "Processor time on one core, after compiling unless a row says otherwise ([contour](contour.md)).\n",
    ),
    "heat": (
        "The warm machine",
        "Processor time on one core, after compiling except in the last row ([warm machine](warm-machine.md)).\n",
    ),
    "c-source": (
        "Predictors in C",
        """\
A cycle of the thesis's loop (4.4.3) with the source of `rtec export`, by `cc -O2` on this host, without the wait
for 10 ms.
""",
    ),
    "sigrok": (
        "Compared with sigrok",
        """\
sigrok's time is that of the whole program on samples of 50 MHz, ours that of receiver and filter over an array.
""",
    ),
    "vcd": ("Writing waveforms", "Changes of A and B into memory.\n"),
    "firmware": (
        "The firmware's processor",
        "The same image as `s51` of ucsim, original timing, by turns; both end with the same state and cycles.\n",
    ),
    "stages": (
        "Where the time goes",
        "Each stage alone over arrays; in the loop they hand edges on in registers, so the rows do not add up.\n",
    ),
    "house": (
        "The program itself",
        "Lines by room: `python benchmarks/figures_house.py`. Words are those outside of code and of tables.\n",
    ),
}


ELSEWHERE = (
    (
        "the processor and ucsim, a million random steps and all pairs of operands",
        "pytest -m sweep tests/differential/test_firmware_against_ucsim.py",
        "passes, or names the step",
    ),
    (
        "110 layouts of one measurement",
        "pytest tests/differential/test_foreign_files.py",
        "92 read right, 16 after the answer that is asked for, 2 refused with what they lack; none misread",
    ),
    (
        "100 000 mutated files of each format",
        "pytest -m sweep tests/property/test_foreign_mutations.py",
        "a measurement or one clear error, less than 1 GB more memory; or fails",
    ),
    (
        "ISO 230-2 and VDI/DGQ 3441, plain sums (1e-9) and a published test",
        "pytest tests/unit/metrology",
        "passes, or fails",
    ),
    ("how fast the encoder may go", "rtec envelope", "[envelope](envelope.md)"),
    (
        "how often hidden effects are named right",
        "python -m tools.confusion --trials 125",
        "[confusion](confusion.md)",
    ),
    (
        "how often two standard errors cover the truth, 1000 draws of each case",
        "pytest -m sweep tests/unit/inference/test_inference_fit.py",
        "93 to 97 %, or fails",
    ),
    (
        "the emulated linear motor identified by its logs, as Erwinski et al. (2019) identified theirs",
        "pytest tests/recovery/test_recovery_drives.py",
        "mass, cogging within 3 standard errors and 2 %, or fails",
    ),
    (
        "no limit of an axis exceeded by more than 1e-6 on 200 random paths",
        "pytest -m sweep tests/unit/toolpath/test_feed.py",
        "passes, or shows the path",
    ),
    (
        "which errors of a machine a circle test names, 100 games a class at 3 sigma",
        "python benchmarks/ballbar_games.py",
        "[circle tests](ballbar.md)",
    ),
    ("what insertions do to an axis in motion", "python benchmarks/contour_insertions.py", "[contour](contour.md)"),
    ("what the best hour is worth", "python -m tools.rounds --games 100 --hour 40", "[rounds](rounds.md)"),
    (
        "how often an effect of one's own is found, and how good learned curves are",
        "python -m tools.own_games --games 100",
        "[own games](own-games.md)",
    ),
    ("what real measurements leave", "pytest tests/recovery", "[real data](real-data.md)"),
    (
        "what a [campaign](campaign.md) costs beside its jobs: 100 000 empty jobs in 500 MB, 2 ms each in batches, "
        "90 % efficiency of two workers",
        "python -m benchmarks.campaigns",
        "128 MB, 48 MB on disk, 0.43 ms each here and 0.38 ms in two processes; jobs that wait for 50 ms: 91 %, with "
        "eight programs on two cores",
    ),
    (
        "what a billion hours of cutting would take on a cluster, on paper",
        "python -m benchmarks.billion_hours",
        "[campaigns](campaign.md#a-billion-hours-of-cutting-on-paper)",
    ),
    (
        "independent streams at 500 kHz on both cores: 1.9 x one core",
        "python -m benchmarks.independent_streams",
        "on a machine with a load of five, missed: threads 1.06 x, processes 1.01 x in turns, on 0.95 and 0.88 "
        "cores; a stream in threads takes the processor time of one alone to 1 %",
    ),
    (
        "`kill -9` at 100 random moments of a campaign",
        "pytest -m sweep tests/unit/cli/test_cli_campaign.py",
        "nothing lost or doubled, or fails",
    ),
    ("every fault in every phase, and a hundred hours", "rtec safety --soak 100h", "[safety](safety.md)"),
    (
        "lines of Python that the tests reach, kernels apart",
        "coverage run -m pytest; coverage combine; coverage report",
        "98.3 % of 37 700",
    ),
    (
        "a million random and mutated frames into each node",
        "pytest -m sweep tests/property/test_nodes_fuzz.py",
        "passes, or shows the frame",
    ),
)
"""Figures that a run of minutes to hours gives, with its command and the page that holds them."""


def page(measured: dict[str, list[Figure]], setting: Setting, busy: float | None, before: str = "") -> str:
    """Return the page as markdown.

    Parameters
    ----------
    measured
        Figures of the groups that were measured, by name.
    setting
        How they were measured.
    busy
        Load average before the start, where it is known.
    before
        The page as it stands; its sections stay where nothing was measured.
    """
    old = {match[1]: match[0] for match in re.finditer(r"^## (.*)\n(?:(?!## ).*\n?)*", before, re.MULTILINE)}
    where = f"{_machine()}, {datetime.now(UTC):%Y-%m-%d}" + (", a quick run" if setting.quick else "")
    where += "" if busy is None else f", load before the start {busy:.1f}"
    parts = [HEAD]
    for name, (title, text) in SECTIONS.items():
        if name in measured:
            parts.append(f"## {title}\n\n{text}Machine: {where}.\n\n{_table(measured[name])}")
        elif title in old:
            parts.append(f"{old[title].rstrip()}\n")
    rows = "".join(f"| {what} | `{command}` | {found} |\n" for what, command, found in ELSEWHERE)
    parts.append(f"## Figures on other pages\n\n| what | command | where |\n|---|---|---|\n{rows}")
    return "\n".join(parts)


def _table(figures: list[Figure]) -> str:
    """Return the rows; a command that repeats all of them is stated once."""
    commands = [figure.command.replace(JOB, "JOB") for figure in figures]
    alone = len(set(commands)) == 1
    head = f"`{commands[0]}`\n\n" if alone else ""
    names = ("figure", "bar", "measured", "ratio", *(() if alone else ("command",)))
    rows = "".join(
        f"| {' | '.join((*figure.cells, *(() if alone else (f'`{command}`',))))} |\n"
        for figure, command in zip(figures, commands, strict=True)
    )
    return f"{head}| {' | '.join(names)} |\n|{'---|' * len(names)}\n{rows}"


def _machine() -> str:
    """Return processor and versions in words."""
    info = Path("/proc/cpuinfo")
    names = [line for line in info.read_text().splitlines() if line.startswith("model name")] if info.exists() else []
    cpu = names[0].split(":", 1)[1].strip() if names else platform.processor() or platform.machine()
    count = f"{len(names)} cores of an {cpu}" if names else cpu
    return f"{count}, Python {platform.python_version()}, numba {version('numba')}"
