"""The page of the figures: the frame around the tables."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path

from figures import Figure, Setting

HEAD = """\
# Benchmarks

Written by `python tests/bench/measure.py -o docs/benchmarks.md`, in one run; `--quick` gives a rough idea,
`--only NAME` one group. Measured on {machine}.
{quick}
Everything runs on one core (the process and its children are tied to it), `rtec run` and `rtec diagnose` on two. Each
figure is the best of several runs after one that does not count, with the median beside it; where another program is
compared with, it gets the same statistic, and Verilator and rtec run by turns. The best run is the one that was
disturbed least: on a machine with other work to do, medians wander by tens of percent from one run to the next, and a
verdict near its bar may turn round. {load} "Ratio" says how many times better than the bar a figure is; 1 and more is
met.

Before anything is timed as done, it is checked: every correction completed, every count as calculated from
the job, no illegal transition, every exchange accepted. A run that fails this stops the measurement.
"""

TABLE_HEAD = "| figure | bar | measured | ratio | verdict | command |\n|---|---|---|---|---|---|\n"

SECTIONS = {
    "open-path": (
        "The open path",
        """\
Encoder edges with a phase error of 10° and a jitter of 5 ns, box with the profile `fast` and a correction every 100
edges, filter of 60 ns (three samples at 50 MHz), x4 decoder.
""",
    ),
    "steps": (
        "The same without the blocks",
        """\
In the open path no edge's time depends on the one before it, so the times of 128 edges are made ahead in every row
here, and the compiler computes several at once. With blocks, edges between two corrections are counted together while
nothing but counting happens to them: the box owes nothing and neighbouring edges are farther apart than the filter
needs ([decision 3](decisions/0003-edge-blocks.md)). `tests/differential/test_open_path_blocks.py` holds both ways and
the step functions without edges made ahead to the same final state, field by field.

Here box and receiver take all edges one by one (`rtec.machine.simulate(path, in_blocks=False)`). While the box only
passes edges on, whether it owes anything is asked once for a run of them, not at each. The bars are those of a
correction every 8 edges; for one every 100 edges they stand in brackets, for comparison.
""",
    ),
    "verilator": (
        "Beside Verilator",
        """\
The peer is `tests/bench/peers`: RTL of design C and of an x4 decoder with a two-stage synchroniser and the same
filter, on one clock of 50 MHz, driven at 500 kHz with the same phase error, jitter and corrections. Its stimulus is
made before the time counts; ours is made while it counts. Both are compared in processor time, in runs of about the
same length, so that others' work on the machine lengthens neither much.

`plain` is `verilator -O3 -CFLAGS -O3` (its makefile then compiles the model with `-Os`); `tuned` compiles the model
with `-O3` and across files; `profiled` lets the compiler learn from a first run as well and is the fastest that we
could make of it. Verilator steps through 25 clocks an edge, whatever happens in them; rtec has no clock to step.
The rows with bars in brackets say how much of that is left without the blocks.
""",
    ),
    "memory": (
        "Memory",
        """\
`rtec simulate` streams: what it holds does not grow with the length of the run. Nearly all of it is Python, numpy and
the compiler's runtime.
""",
    ),
    "calibration": (
        "The closed loop",
        """\
Program, servo, axis with its error, encoder, box, PC and controller; planning included. Ticks at rest in which
nothing can change are passed over at once; the second row computes every one of them.
""",
    ),
    "run": (
        "The main job",
        "",
    ),
    "diagnosis": (
        "The diagnosis",
        """\
`rtec diagnose` with the whole library, from the start of the process to its end, on two cores. The lathe's
calibration is that of the thesis, 1561 targets in both directions, made from the printed network with 1 µm of noise;
more runs of it make more rows, with the same places and so with the same scan grid. A measurement has to end with at
least the reversal error along the axis and the wave of the screw found, or nothing is timed as done.
""",
    ),
    "scan": (
        "The scan beside refitting",
        """\
Which of all shapes of all effects would lower the residual most, beside a constant and backlash: the scan,
which takes the model's columns out once and refits nothing, and two loops over the same grid in the same run, each
fitting model and candidate together. Times are processor time, the computing of the columns included; all three
have to find the same largest fall for each effect.
""",
    ),
    "train": (
        "Training networks",
        """\
The averages of four runs of the lathe's calibration, 1561 targets in both directions, 1 µm of noise a reading. All
times are processor time on one core, peers and ours by turns. scipy's `least_squares` gets the same residuals and
the same exact Jacobian; its iteration is the time over the Jacobians that it asked for, ours an epoch with all steps
that were tried in it. scikit-learn trains on all readings at once by gradient descent with momentum, one gradient an
epoch; an epoch of scaled conjugate gradient is a gradient and an exact second derivative along its direction. [What
each algorithm reaches](predictors.md#table-4-1-again) stands elsewhere.
""",
    ),
    "predictors": (
        "Predictors at work",
        """\
The programme of the calibration in closed loop, Design B in the box, with each kind of predictor in the PC, fitted
to the lathe's calibration before. Processor time of the whole run, by turns; every reading taken, every count
accounted for. The PC asks its predictor every 10 ms of the machine's time.
""",
    ),
    "train-command": (
        "Training as a user types it",
        """\
`rtec train` on the calibration of `rtec run`, with its own budget, on two cores: wall time, and its best row beside
the physical model.
""",
    ),
    "handshake": (
        "PC and box",
        """\
An exchange is a look of the PC at valid words, its next request, and the box's samples up to the PC's next look,
mailboxes with their latency included. Each exchange asks for one step more or less than the one before; the steps
that the box has accepted, its total, the number of its samples and of the requests are then compared with what
follows from the number of exchanges and the two periods.
""",
    ),
    "link": (
        "Box and PC on the bus",
        """\
An exchange is a turn of the PC: its request packed, sealed and sent, carried by the simulated bus, checked and judged
by the box, answered by position, corrections and status, and those checked by the PC. Each asks for one step more or
less than the one before, and all must be completed; the frames on the bus are compared with what the time asks for.
With the machine there are servo, encoder, injector and controller of each axis, too.
""",
    ),
    "live": (
        "Box and PC as processes",
        """\
`rtec box` and `rtec pc`, two processes, slcan over the pseudo-terminal line between them, on two cores with nothing
else to do. The box's own time goes from the arrival of a request to the departure of the frame that says it is
completed, by its log; the handshake as the PC sees it, from its turn on.
""",
    ),
    "soak": (
        "Hours under faults",
        """\
The hours of the [safety case](safety.md), on two cores. Every class of faults has to take effect, and no wrong count
may go unnoticed because of box, link or PC.
""",
    ),
    "start-up": (
        "How soon it answers",
        "From the start of the process to its end, the compiled code cached.\n",
    ),
    "first-run": (
        "The first run",
        "With an empty folder for machine code, on one core, measured once.\n",
    ),
    "check": (
        "A verdict on an insertion algorithm",
        """\
From the start of the process to its end, on two cores: checks, hunt, cutting short, data sheet, picture.
The algorithm with a bug is copied from the README. Building the Verilog counts.
""",
    ),
    "c-source": (
        "Predictors in C",
        """\
Recorded only. The loop is that of the thesis (4.4.3) in C, compiled by `cc -O2` and run on this host: read the
position, find the direction from the one before, keep it, scale, compute, return; the wait for the next of the marks,
10 ms apart, is left out. It is the processor's time for a cycle, the axis moving there and back. Before, the function
that `rtec export` writes has to say what the predictor says.
""",
    ),
    "sigrok": (
        "Beside sigrok",
        """\
Recorded only. sigrok's time is that of the whole program, reading the capture included, on samples of 50 MHz; ours
that of the receiver, filter included, over an array of edges.
""",
    ),
    "vcd": (
        "Writing waveforms",
        "Recorded only. Both write changes of A and B into memory.\n",
    ),
    "firmware": (
        "The firmware's processor",
        """\
Our 8051 and `s51` of ucsim run the same instructions of the same image on the original timing, by turns; of both the
time of the run alone counts, as ucsim says it of itself. Before, both must end with the same registers, memories and
number of cycles.
""",
    ),
    "stages": (
        "Where the time goes",
        """\
Each stage alone reads edges from an array or writes them to one, so the rows do not add up to the loop, where the
stages hand edges on in registers. The last two rows are the loop before and after the blocks.
""",
    ),
}


ELSEWHERE = (
    (
        "the processor beside ucsim, a million random steps and all pairs of operands",
        "pytest -m sweep tests/differential/test_firmware_against_ucsim.py",
        "passes, or names the step",
    ),
    (
        "110 layouts of one measurement, as instruments, spreadsheets and people write it",
        "pytest tests/differential/test_foreign_files.py",
        "92 read right, 16 after the answer that is asked for, 2 refused with what they lack; none misread",
    ),
    (
        "100 000 mutated files of each format, as text, of both laser systems and workbooks",
        "pytest -m sweep tests/property/test_foreign_mutations.py",
        "a measurement or one clear error, less than 1 GB more memory; or fails",
    ),
    (
        "ISO 230-2 and VDI/DGQ 3441 beside plain sums (1e-9) and a published test",
        "pytest tests/unit/metrology",
        "passes, or fails",
    ),
    ("how fast the encoder may go", "rtec envelope", "[envelope](envelope.md)"),
    (
        "how often hidden effects are named right",
        "python -m tests.recovery.confusion --trials 125",
        "[confusion](confusion.md)",
    ),
    (
        "how often two standard errors cover the truth, 1000 draws of each case",
        "pytest -m sweep tests/unit/inference/test_inference_fit.py",
        "93 to 97 %, or fails",
    ),
    ("what real measurements leave", "pytest tests/recovery", "[real data](real-data.md)"),
    ("every fault in every phase, and a hundred hours", "rtec safety --soak 100h", "[safety](safety.md)"),
    (
        "a million random and mutated frames into each node",
        "pytest -m sweep tests/property/test_nodes_fuzz.py",
        "passes, or shows the frame",
    ),
)
"""Figures that a run of minutes to hours gives, with its command and the page that holds them."""


def page(measured: dict[str, list[Figure]], setting: Setting, busy: float | None) -> str:
    """Return the page as markdown; ``busy`` is the load average before the start."""
    quick = "\nA quick run: shorter runs and fewer of them.\n" if setting.quick else ""
    load = "" if busy is None else f"Load average before the start: {busy:.1f}."
    parts = [HEAD.format(machine=_machine(), quick=quick, load=load)]
    for name, figures in measured.items():
        title, text = SECTIONS[name]
        rows = "".join(f"{figure.row}\n" for figure in figures)
        parts.append(f"## {title}\n\n{text}{chr(10) if text else ''}{TABLE_HEAD}{rows}")
    rows = "".join(f"| {what} | `{command}` | {where} |\n" for what, command, where in ELSEWHERE)
    parts.append(f"## Figures that stand elsewhere\n\n| what | command | where |\n|---|---|---|\n{rows}")
    return "\n".join(parts)


def _machine() -> str:
    """Return processor, system and versions in words."""
    info = Path("/proc/cpuinfo")
    names = [line for line in info.read_text().splitlines() if line.startswith("model name")] if info.exists() else []
    cpu = names[0].split(":", 1)[1].strip() if names else platform.processor() or platform.machine()
    count = f"{len(names)} cores of an {cpu}" if names else cpu
    packages = ", ".join(f"{name} {version(name)}" for name in ("rtec", "numpy", "numba", "llvmlite"))
    return f"{count}, {platform.system()}, Python {platform.python_version()}, {packages}"
